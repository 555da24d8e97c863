"""A virtual scanner: pods around a subject, each seeing a range image, with the faults that real ones have.

It is seeded: a frame of a pod is the same whatever else is captured, and in whatever order.
docs/how-it-works/simulate.md has the formulas.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..bounds import Bounds
from ..camera import Camera
from ..errors import InputError
from ..mesh.reference import Reference, trace
from ..mesh.scene import Scene
from ..rigid import rigid_matrix
from ..scan.points import UNKNOWN_UNIT
from ..scan.range_view import RangeView

MOST_PODS = 8
_PAIR = (-27.5, 27.5)  # left and right of the front, as Farooq's DI3D rig has them
_MOST_PIXELS = 1 << 25  # of a range image: casting takes some 100 bytes a pixel
_LEAST_COSINE = 0.1  # noise grows no further: 84 degrees
_BASELINE = 0.25  # between the two cameras of a pod, in distances to the subject
_OUTLIERS = (0.5, 1.5)  # where they lie, in distances to the subject


@dataclass(frozen=True)
class Faults:
    """The faults of what a pod measures.

    noise: standard deviation of depth, scan units, where the surface faces the pod at the subject's distance.
    disparity: the step that disparity is rounded to, pixels; 0: exact. dropouts, outliers: fractions of the
    pixels that see the surface, and of those that then measure it. grazing: the steepest incidence that is
    measured, degrees. gain: factors of red, green and blue, of linear light. calibration_error: degrees by
    which its stored calibration is turned to the left of the true one, about its eye. Raises InputError.
    """

    noise: float = 0.0
    disparity: float = 0.0
    dropouts: float = 0.0
    outliers: float = 0.0
    grazing: float = 90.0
    gain: tuple[float, float, float] = (1.0, 1.0, 1.0)
    calibration_error: float = 0.0

    def __post_init__(self) -> None:
        for name, value, most in (
            ("noise", self.noise, np.inf),
            ("disparity", self.disparity, np.inf),
            ("dropouts", self.dropouts, 1),
            ("outliers", self.outliers, 1),
            ("grazing", self.grazing, 90),
            *(("gain", factor, np.inf) for factor in self.gain),
            ("calibration error", self.calibration_error, 180),
        ):
            if not (0 <= value <= most and np.isfinite(value)):
                limits = "0 or more" if most == np.inf else f"0 to {most}"
                raise InputError(f"a scanner's {name} must be {limits}, not {value}")

    def deviation(
        self, depth: NDArray[np.float64], cosine: NDArray[np.float64], distance: float
    ) -> NDArray[np.float64]:
        """The standard deviation of depths, scan units, of the shape of `depth`.

        Squared with depth, as triangulation has it, and one over the cosine of the incidence.
        distance: of the subject, scan units.
        """
        return self.noise * (depth / distance) ** 2 / np.maximum(cosine, _LEAST_COSINE)


def around(count: int) -> tuple[float, ...]:
    """Azimuths of pods, degrees: one in front, two left and right of it, more evenly all round.

    Raises InputError for a number that is not 1 to 8.
    """
    if not 1 <= count <= MOST_PODS:
        raise InputError(f"a scanner has 1 to {MOST_PODS} pods, not {count}")
    return _PAIR if count == 2 else tuple(360 * pod / count for pod in range(count))


def rig(
    bounds: Bounds,
    azimuths: tuple[float, ...],
    elevation: float = 0.0,
    *,
    aspect: float,
    fov_y: float = 30.0,
    up: str = "+y",
) -> list[Camera]:
    """The cameras of pods that look at the centre of the bounds, each as near as sees all of them.

    azimuths, elevation, aspect and up as `Camera.orbit` has them; fov_y: degrees. Raises InputError.
    """
    if not 1 <= len(azimuths) <= MOST_PODS:
        raise InputError(f"a scanner has 1 to {MOST_PODS} pods, not {len(azimuths)}")
    if not np.isfinite([*azimuths, elevation]).all():
        raise InputError("the azimuth and elevation of a pod must be finite numbers")
    return [
        Camera.orbit(bounds, azimuth, elevation, aspect=aspect, up=up, fov_y=fov_y) for azimuth in azimuths
    ]


def capture(
    scene: Scene,
    pods: list[Camera],
    size: tuple[int, int],
    faults: list[Faults],
    *,
    seed: int = 0,
    frame: int = 0,
    unit: str = UNKNOWN_UNIT,
) -> tuple[RangeView, ...]:
    """Measure one frame with each pod. size: (width, height), pixels. faults: one a pod.

    Depth is NaN and the mask False where nothing is measured; colour is that of the scene times the gain,
    confidence the cosine of the incidence. Raises InputError for sizes that are no picture or too large.
    """
    if size[0] * size[1] > _MOST_PIXELS:
        raise InputError(
            f"a range image of {size[0]}x{size[1]} is too large",
            hint=f"Choose at most {_MOST_PIXELS:,} pixels",
        )
    pictures = [trace(scene, pod, size) for pod in pods]
    return measured(pictures, pods, faults, seed=seed, frame=frame, unit=unit)


def measured(
    pictures: Sequence[Reference],
    pods: Sequence[Camera],
    faults: Sequence[Faults],
    *,
    seed: int = 0,
    frame: int = 0,
    unit: str = UNKNOWN_UNIT,
) -> tuple[RangeView, ...]:
    """Range views of true pictures, one a pod, as `capture` makes them: to compare faults without
    casting rays anew."""
    return tuple(
        _measure(picture, pod, fault, np.random.default_rng([seed, frame, number]), f"pod{number}", unit)
        for number, (picture, pod, fault) in enumerate(zip(pictures, pods, faults, strict=True))
    )


def _measure(
    picture: Reference, pod: Camera, faults: Faults, rng: np.random.Generator, name: str, unit: str
) -> RangeView:
    """The range view that comes of a true picture."""
    view, cosine = picture.view, picture.incidence()
    # Whole images, all of them, each time: so one fault does not change the chances of another.
    noise = rng.standard_normal(cosine.shape)
    lost, wrong, place = rng.random((3, *cosine.shape))

    depth = np.where(picture.covered, picture.depth, pod.distance)
    steep = np.degrees(np.arccos(cosine)) > faults.grazing
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):  # of noise beyond all measure
        depth = depth + noise * faults.deviation(depth, cosine, pod.distance)
        if faults.disparity:
            depth = _quantised(depth, _BASELINE * pod.distance * view.scale, faults.disparity)
        nearest, farthest = pod.distance * np.array(_OUTLIERS)
        depth = np.where(wrong < faults.outliers, nearest + (farthest - nearest) * place, depth)
        stored = depth.astype(np.float32)
    measured = picture.covered & ~steep & (lost >= faults.dropouts) & (stored > 0) & np.isfinite(stored)

    rotation = _to_the_left(faults.calibration_error) @ view.rotation
    return RangeView(
        depth=np.where(measured, stored, np.float32(np.nan)),
        mask=measured,
        color=(picture.color * np.array(faults.gain, np.float32)).astype(np.float16),
        confidence=np.where(measured, cosine, 0).astype(np.float32),
        fx=view.scale,
        fy=view.scale,
        cx=view.size[0] / 2,
        cy=view.size[1] / 2,
        world_to_camera=rigid_matrix(rotation, -rotation @ np.array(pod.eye)),
        name=name,
        unit=unit,
    )


def _quantised(depth: NDArray[np.float64], disparity_at_1: float, step: float) -> NDArray[np.float64]:
    """Depths whose disparity is a whole number of steps; inf where that is none."""
    steps = np.rint(disparity_at_1 / depth / step)
    return np.divide(disparity_at_1, steps * step, out=np.full(depth.shape, np.inf), where=steps > 0)


def _to_the_left(degrees: float) -> NDArray[np.float64]:
    """The rotation, (3, 3), that comes to world to camera where the camera turns to its left."""
    cosine, sine = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[cosine, 0, -sine], [0, 1, 0], [sine, 0, cosine]])

"""Views of different gain, merged: seams, fine detail, one view alone, sizes of pictures, and time (6.2).

Subjects whose truth is known are scanned by a virtual pair of pods, twice: with gains that differ, and alike.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.farooq_2013.seams import detail_psnr, pods_facing, seam_visibility, seams
from experiments.machado_2014.shown import save_picture
from experiments.suite import row_of, subjects
from experiments.tables import Row
from experiments.timing import by_turns
from viewer.backends import backend
from viewer.bench.metrics import Errors, Mask, scanned
from viewer.bench.report.pictures import Image, titled_row
from viewer.bench.run import Bench, undisturbed
from viewer.bench.scenes.subjects import Moment, Subject
from viewer.bench.scenes.viewpoints import pod_viewpoints
from viewer.camera import Camera
from viewer.drawing.renderer import Renderer
from viewer.drawing.request import Request
from viewer.drawing.timing import call_ms, draw, pass_ms
from viewer.look import Look
from viewer.mesh.reference import Reference, trace
from viewer.picture.surface import Surface
from viewer.scan.pose import Pose
from viewer.scan.range_view import RangeView
from viewer.simulate.scanner import Faults, around, capture, rig
from viewer.srgb import bytes_from_linear

BACKEND, BLENDED = "laplacian", "pyramidal"
SCENES = ("demo", "armadillo")
GAINS = ((0.909, 0.882, 0.936), (1.0, 1.0, 1.0))  # 10 % apart, with a cast of 3 %
LEVELS = (3, 4, 5, 6)
ZOOMS = (0.25, 0.5, 1.0, 2.0)  # pixels of the picture for a sample
PICTURE = "pictures/laplacian-seams.png"

VIEW_SIZE = (640, 480)  # samples of a range image
_LARGE, _LARGE_PICTURE = (1500, 1000), (1280, 800)  # samples of a view, and pixels, where it is timed
_LOOK = Look(light="flat", quality="fast")
_FARTHEST = 20.0  # degrees to either side of the front that is looked from
_SAME = 4.0  # footprints between depths that are of one surface
_EDGE = 4  # pixels
_RAYS = 2  # along an edge of a pixel, of the truth of a picture
_STEEP = 20.0  # footprints from pixel to pixel, where one surface ends before another
_GAINS = (0.88, 1.02)  # that a picture of gains shows as black and white
_BLACK, _NOTHING = 1e-3, 205  # the darkest that has a gain; gray where nothing is


@dataclass(frozen=True)
class Merging:
    """How views are merged: a backend with the parameters that differ from its defaults."""

    name: str
    backend: str
    params: Mapping[str, Any] = field(hash=False)


BEST, LINEAR = Merging("best", BLENDED, {"blend": "best"}), Merging("linear", BLENDED, {"blend": "linear"})
BY_LEVELS = tuple(Merging(f"{count} levels", BACKEND, {"levels": count}) for count in LEVELS)
CAPTURED = Merging("6 levels of captures", BACKEND, {"levels": 6, "bands": "capture"})
FINE = Merging("6 levels, fine", BACKEND, {"levels": 6, "quality": "fine"})
FRONT = "samples from the front"  # not merged: a pod stands where the camera is
VARIANTS = (
    Merging("6 levels of linear light", BACKEND, {"levels": 6, "light": "linear"}),
    Merging("6 levels, soft", BACKEND, {"levels": 6, "weights": "soft"}),
    Merging("6 levels, 3x3", BACKEND, {"levels": 6, "kernel": "3x3"}),
    CAPTURED,
)
MERGINGS = (BEST, LINEAR, *BY_LEVELS, *VARIANTS)
SIZED = (LINEAR, BY_LEVELS[-1], FINE, CAPTURED)
TIMED = (BEST, LINEAR, *BY_LEVELS, FINE, CAPTURED)


@dataclass(frozen=True, eq=False)
class Pair:
    """A subject and what a pair of pods measures of it. alike: with one gain; differing: with `GAINS`."""

    moment: Moment
    up: str
    pods: list[Camera]
    alike: tuple[RangeView, ...]
    differing: tuple[RangeView, ...]

    @classmethod
    def of(cls, subject: Subject, size: tuple[int, int]) -> Pair:
        """Scan the first moment of a subject. size: (width, height) of the range images, pixels."""
        moment = subject.moment(0)
        pods = rig(moment.mesh.bounds, around(2), aspect=size[0] / size[1], up=subject.up)
        alike, differing = (
            capture(moment.truth, pods, size, [Faults(gain=gain) for gain in gains])
            for gains in ([(1.0, 1.0, 1.0)] * 2, GAINS)
        )
        return cls(moment, subject.up, pods, alike, differing)

    @property
    def size(self) -> tuple[int, int]:
        """Size of its range images, (width, height), pixels."""
        height, width = self.alike[0].depth.shape
        return width, height

    def cameras(self, count: int, size: tuple[int, int]) -> list[Camera]:
        """Cameras around the front, the first one there, that see what a pod does at its own distance."""
        azimuths = [0.0, *np.linspace(-_FARTHEST, _FARTHEST, count - 1)] if count > 1 else [0.0]
        bounds, aspect = self.moment.mesh.bounds, size[0] / size[1]
        return [Camera.orbit(bounds, azimuth, 0, aspect=aspect, up=self.up, fov_y=30) for azimuth in azimuths]


@dataclass(frozen=True, eq=False)
class Drawn:
    """Picture of merged views. color: (H, W, 3), linear light. depth: (H, W), +inf where
    nothing is."""

    color: NDArray[np.float64]
    depth: NDArray[np.float32]

    @classmethod
    def of(
        cls,
        renderer: Renderer,
        views: Sequence[RangeView],
        camera: Camera,
        size: tuple[int, int],
        merging: Merging,
    ) -> Drawn:
        """Draw them. size: (width, height), pixels."""
        surface = Surface(renderer.gpu, size)
        draw(renderer, _request(views, camera, merging), surface)
        drawn = cls(surface.color[..., :3].astype(np.float64), surface.depth)
        surface.release()
        return drawn

    def shows(self, reference: Reference) -> Mask:
        """The pixels, (H, W), that show the true surface."""
        shown = reference.covered & np.isfinite(self.depth)
        off = np.abs(self.depth[shown] - reference.depth[shown])
        shown[shown] = off <= _SAME * reference.view.footprint(reference.depth[shown])
        return shown


def _request(views: Sequence[RangeView], camera: Camera, merging: Merging) -> Request:
    pose = Pose.of(0, 0.0, "", tuple(views))
    return Request(pose, camera, merging.backend, backend(merging.backend).params(merging.params), _LOOK)


def _pairs(bench: Bench, scenes: Sequence[str], size: tuple[int, int]) -> Iterator[tuple[str, Pair]]:
    """The pairs of the scenes that are there, by name. size: of range images."""
    for subject in subjects(bench, scenes):
        yield subject.name, Pair.of(subject, size)


def _inside(reference: Reference, mask: Mask, edge: int = _EDGE) -> Mask:
    """The pixels of a mask, (H, W), that are so many away from its edge and from steps of the true depth."""
    from scipy import ndimage

    depth = np.where(reference.covered, reference.depth, 0)
    step = ndimage.maximum_filter(depth, 3) - ndimage.minimum_filter(depth, 3)
    smooth = step <= _STEEP * reference.view.footprint(depth)
    return ndimage.binary_erosion(mask & smooth, iterations=edge)


# --- seams and fine detail ------------------------------------------------------------


def measure_seams(
    bench: Bench, scenes: Sequence[str] = SCENES, view_size: tuple[int, int] = VIEW_SIZE
) -> Iterator[Row]:
    """Yield a row for each scene and each merging, with the errors of each picture (`seam_errors`)."""
    for scene, pair in _pairs(bench, scenes, view_size):
        cameras, size = pair.cameras(bench.settings.views, bench.settings.size), bench.settings.size
        found = [seam_errors(bench.renderer, pair, camera, size) for camera in cameras]
        if bench.folder and scene == scenes[0]:
            save_picture(seam_picture(bench.renderer, pair, cameras[0], size), bench.folder / PICTURE)
        for merging in MERGINGS:
            by_view = [errors[merging.name] for errors in found]
            yield row_of(bench, scene=scene, merging=merging.name, by_view=by_view)


def seam_errors(
    renderer: Renderer,
    pair: Pair,
    camera: Camera,
    size: tuple[int, int],
    compared: Sequence[Merging] = MERGINGS,
) -> dict[str, dict[str, float]]:
    """Errors of a picture, by the names of the mergings.

    Visibility of seams as `seam_visibility` has it. `detail`: PSNR of fine detail, dB, where both pods see
    the surface, of pods that are alike; `detail_alone`: of the better of them alone. `shown`: the percentage
    of what the pods see that is shown where it is.
    """
    reference = trace(pair.moment.truth, camera, size)
    weights = pods_facing(pair.moment.truth, reference, pair.pods)
    alone = [Drawn.of(renderer, [view], camera, size, LINEAR) for view in pair.alike]
    both = _inside(
        reference, np.logical_and.reduce([*(weights > 0), *(one.shows(reference) for one in alone)])
    )
    errors = {}
    for merging in compared:
        alike, differing = _both(renderer, pair, camera, size, merging)
        shown = alike.shows(reference) & differing.shows(reference)
        errors[merging.name] = {
            **seam_visibility(differing.color, alike.color, shown, seams(weights)),
            "detail": _detail(alike, reference, both),
            "detail_alone": max(_detail(each, reference, both) for each in alone),
            "shown": 100 * float(shown[weights.any(axis=0)].mean()),
        }
    return errors


def _both(
    renderer: Renderer, pair: Pair, camera: Camera, size: tuple[int, int], merging: Merging
) -> tuple[Drawn, Drawn]:
    """The pictures of pods that are alike and of pods that differ."""
    return (
        Drawn.of(renderer, pair.alike, camera, size, merging),
        Drawn.of(renderer, pair.differing, camera, size, merging),
    )


def _detail(drawn: Drawn, reference: Reference, inside: Mask) -> float:
    return detail_psnr(drawn.color, reference.color, inside, drawn.shows(reference))


def seam_picture(renderer: Renderer, pair: Pair, camera: Camera, size: tuple[int, int]) -> Image:
    """Pictures of pods that differ, each beside how bright it is in parts of that of pods alike."""
    reference = trace(pair.moment.truth, camera, size)
    rows, columns = (np.flatnonzero(reference.covered.any(axis=axis)) for axis in (1, 0))
    box, (low, high) = (slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1)), _GAINS
    panels: dict[str, Image] = {}
    for merging in (BEST, LINEAR, BY_LEVELS[0], BY_LEVELS[-1]):
        alike, differing = _both(renderer, pair, camera, size, merging)
        shown = (alike.shows(reference) & differing.shows(reference))[..., None]
        gain = differing.color.sum(axis=2) / np.maximum(alike.color.sum(axis=2), _BLACK)
        gray = np.repeat(255 * np.clip((gain - low) / (high - low), 0, 1)[..., None], 3, axis=2)
        both = [np.where(shown, each, _NOTHING)[box] for each in (bytes_from_linear(differing.color), gray)]
        panels[f"{merging.backend}, {merging.name}"] = np.concatenate(both, axis=1).astype(np.uint8)
    return titled_row(panels)


# --- one view alone -------------------------------------------------------------------


def measure_alone(
    bench: Bench, scenes: Sequence[str] = SCENES, view_size: tuple[int, int] = VIEW_SIZE
) -> Iterator[Row]:
    """Yield a row for each scene and number of levels: how far a view alone is from its direct picture."""
    for scene, pair in _pairs(bench, scenes, view_size):
        for merging in BY_LEVELS:
            by_view = list(alone_errors(bench.renderer, pair, bench.settings.size, merging))
            yield row_of(bench, scene=scene, merging=merging.name, by_view=by_view)


def alone_errors(
    renderer: Renderer, pair: Pair, size: tuple[int, int], merging: Merging
) -> Iterator[dict[str, float]]:
    """Yield how far pictures of one view are from those that `pyramidal` draws, at a pixel a sample, from
    where the pod is and from aside: the mean and the largest difference away from edges, in 8-bit steps."""
    for pod, view in zip(pair.pods, pair.alike, strict=True):
        for camera in pod_viewpoints([view], 1.0, 2, size, up=pair.up):
            reference = trace(pair.moment.truth, camera, size)
            direct, drawn = (Drawn.of(renderer, [view], camera, size, each) for each in (LINEAR, merging))
            seen = pods_facing(pair.moment.truth, reference, [pod])[0] > 0
            inside = _inside(reference, seen & direct.shows(reference))
            steps = [bytes_from_linear(each.color)[inside].astype(int) for each in (direct, drawn)]
            off = np.abs(steps[1] - steps[0])
            yield {"mean": float(off.mean()), "worst": float(off.max())}


# --- sizes of pictures ----------------------------------------------------------------


def measure_sizes(
    bench: Bench, scenes: Sequence[str] = SCENES, view_size: tuple[int, int] = VIEW_SIZE
) -> Iterator[Row]:
    """Yield a row for each merging and zoom, of the first scene: holes and PSNR of a picture
    (`size_errors`)."""
    for scene, pair in _pairs(bench, scenes[:1], view_size):
        found = [size_errors(bench.renderer, pair, camera) for camera in pair.cameras(1, pair.size)]
        for merging, zoom in product(found[0], ZOOMS):
            by_view = [errors[merging][zoom] for errors in found]
            yield row_of(bench, scene=scene, merging=merging, zoom=zoom, by_view=by_view)


def size_errors(
    renderer: Renderer, pair: Pair, camera: Camera, compared: Sequence[Merging] = SIZED, edge: int = _EDGE
) -> dict[str, dict[float, Errors]]:
    """Holes and PSNR, dB, of pictures of several sizes, by the names of the mergings and by zoom; and, for
    what samples can tell at all, of samples that a pod where the camera is would take, resized.

    The truth is the mean of what the rays of a pixel see, in linear light, where the pods see all of it.
    edge: how many samples away from where they do not, and from steps of depth.
    """
    density = round(_RAYS * max(ZOOMS))  # rays along an edge of a sample
    width, height = pair.size
    reference = trace(pair.moment.truth, camera, (density * width, density * height))
    weights = pods_facing(pair.moment.truth, reference, pair.pods)
    seen = _inside(reference, weights.max(axis=0) > 0, density * edge)
    samples = trace(pair.moment.truth, camera, pair.size)
    found_by_zoom: dict[str, dict[float, Errors]] = {}
    for zoom in ZOOMS:
        rays = round(density / zoom)
        size = round(zoom * width), round(zoom * height)
        true, inside = bytes_from_linear(_reduced(reference.color, rays)), _reduced(seen, rays) == 1

        def errors(shown: Mask, color: NDArray[np.floating]) -> Errors:
            return scanned(shown, bytes_from_linear(color), true, inside)  # noqa: B023

        for merging in compared:
            drawn = Drawn.of(renderer, pair.alike, camera, size, merging)
            found_by_zoom.setdefault(merging.name, {})[zoom] = errors(np.isfinite(drawn.depth), drawn.color)
        found_by_zoom.setdefault(FRONT, {})[zoom] = errors(
            np.ones_like(inside), _resized(samples.color, zoom)
        )
    return found_by_zoom


def _resized(color: NDArray[np.floating], zoom: float) -> NDArray[np.float64]:
    """A picture, (H, W, 3), with so many times as many pixels along an edge: means of them, or cubics."""
    from scipy import ndimage

    if zoom <= 1:
        return _reduced(color, round(1 / zoom))
    large = ndimage.zoom(np.asarray(color, np.float64), (zoom, zoom, 1), grid_mode=True, mode="nearest")
    return np.clip(large, 0, 1)


def _reduced(values: NDArray[Any], count: int) -> NDArray[np.float64]:
    """Means of count x count pixels of (H, W, ...)."""
    height, width = values.shape[0] // count, values.shape[1] // count
    parts = values.reshape(height, count, width, count, *values.shape[2:])
    return parts.mean(axis=(1, 3), dtype=np.float64)


# --- time -----------------------------------------------------------------------------


def measure_bands(
    bench: Bench,
    scenes: Sequence[str] = SCENES,
    view_size: tuple[int, int] = _LARGE,
    size: tuple[int, int] = _LARGE_PICTURE,
) -> Iterator[Row]:
    """Yield a row for each merging and one or two views of the first scene: what a picture takes, ms, the
    median.

    Wall and processor time of a picture, and each pass as the GPU's timers have it.
    """
    for scene, pair in _pairs(bench, scenes[:1], view_size):
        (camera,) = pair.cameras(1, size)
        for count, merging in product((1, 2), TIMED):
            taken = _taken(bench, _request(pair.alike[:count], camera, merging), size)
            yield row_of(bench, scene=scene, merging=merging.name, pods=count, **taken)


def _taken(bench: Bench, request: Request, size: tuple[int, int]) -> Row:
    renderer, repeat = bench.renderer, bench.settings.repeat
    surface = Surface(renderer.gpu, size)

    def picture() -> None:
        call_ms(renderer, [request], surface)

    taken = by_turns({"picture": picture}, repeat)["picture"]
    with undisturbed():
        runs = pass_ms(renderer, [request] * repeat, surface)
    surface.release()
    passes = {name: float(np.median([run[name] for run in runs])) for name in runs[0]}
    return {"wall_ms": taken.wall, "busy_ms": taken.busy, "passes": passes}

"""Judging drawn pictures: all errors of a Surface in one view, and its flicker along a walk."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ..camera import Camera
from ..gpu.context import Gpu
from ..look import Look
from ..mesh.range_mesh import was_scanned
from ..mesh.reference import Reference, both_see, trace, visible
from ..mesh.scene import Rays, Scene
from ..picture.surface import Surface
from ..scan.points import PointCloud
from ..scan.pose import Pose
from ..scan.range_view import RangeView
from ..scan.spacing import typical_spacing
from . import metrics
from .metrics import Errors
from .truth.surface import reference_surface

_PROBES = 50_000  # points of a cloud whose visibility is looked at
_STEEPEST = 0.1  # the least cosine that counts: 84 degrees


@dataclass(frozen=True, eq=False)
class Probes:
    """Points of a cloud that lie in the picture, P of them, and whether they can truly be seen.

    pixels: (P,), indices into H * W. limit: (P,), the depth before which a picture hides them, scan units.
    seen: (P,) bool, from the truth.
    """

    pixels: NDArray[np.intp]
    limit: NDArray[np.float64]
    seen: NDArray[np.bool_]

    def found(self, depth: NDArray[np.floating]) -> NDArray[np.bool_]:
        """Tell which of them a picture of depths (H, W) does not hide; a hole hides nothing."""
        return depth.reshape(-1)[self.pixels] >= self.limit


@dataclass(frozen=True, eq=False)
class Judge:
    """The truth of one view, which judges any Surface of it.

    image: (H, W, 4) uint8, the reference, shaded in `look`. steps: (H, W), how far depths of one
    sheet may lie apart, scan units. scanned: (H, W) bool, what of the truth range views have measured; None
    where the scan has none.
    """

    reference: Reference
    look: Look
    image: NDArray[np.uint8]
    steps: NDArray[np.float64]
    probes: Probes
    scanned: NDArray[np.bool_] | None = None

    @classmethod
    def of(
        cls,
        gpu: Gpu,
        truth: Scene,
        camera: Camera,
        size: tuple[int, int],
        look: Look,
        scan: PointCloud | Pose,
        tolerance: float | None,
    ) -> Judge:
        """Trace the reference picture and find which points can truly be seen.

        scan: what backends draw of the truth, points or a pose. size: (width, height), pixels. tolerance: how
        far its points may lie off the truth, scan units; None: they are exact (`reference.visible`). The look
        says its own light, since clouds without normals and the reference would choose differently. Raises
        InputError for a size that is no picture."""
        cloud, views = (scan.cloud, scan.views) if isinstance(scan, Pose) else (scan, ())
        reference = trace(truth, camera, size)
        steps = _steps(reference, typical_spacing(cloud))
        return cls(
            reference=reference,
            look=look,
            image=reference_surface(reference, gpu, look).image(),
            steps=steps,
            probes=_probes(truth, camera, reference, cloud, steps, tolerance),
            scanned=_scanned(reference, views) if views else None,
        )

    def errors(self, surface: Surface) -> Errors:
        """Coverage, depth, normals, colour, visibility of points, as docs/developing/benchmark.md names them.

        The surface has the judge's camera and size; it is shaded in the judge's look.
        """
        reference, depth = self.reference, surface.depth
        true, drawn = reference.covered, surface.coverage > 0
        both = drawn & true
        true_depth = reference.depth.astype(np.float32)  # rounded as what is drawn is
        image = surface.image(self.look)
        of_scanned = {} if self.scanned is None else metrics.scanned(drawn, image, self.image, self.scanned)
        return (
            metrics.coverage(drawn, true)
            | metrics.depth(depth, true_depth, reference.view.footprint(true_depth), self.steps)
            | metrics.normals(surface.normal[both], reference.normal[both])
            | metrics.color(image, self.image, true)
            | metrics.visibility(self.probes.found(depth), self.probes.seen)
            | of_scanned
        )


class Walk:
    """Consecutive frames: an orbit about one moment, or the moments of a sequence seen by one camera.

    judges: of the frames. moved: where the hits of each frame but the last are at the next, (N, 3)
    relative to the next one's origin; None: where they were (`reference.both_see`).
    """

    def __init__(self, judges: list[Judge], moved: list[Rays | None]) -> None:
        self._judges = judges
        self._pixels = [
            both_see(first.reference, second.reference, hits)
            for (first, second), hits in zip(pairwise(judges), moved, strict=True)
        ]

    def flicker(self, frames: Iterable[Surface], kind: Literal["orbit", "pose"]) -> Errors:
        """`flicker_<kind>_color` and `flicker_<kind>_normal`, means over the pairs of consecutive frames.

        frames: what was drawn, one for each judge; all may be one Surface that is drawn anew.
        """
        drawn = (
            {"image": surface.image(judge.look), "normal": surface.normal}
            for surface, judge in zip(frames, self._judges, strict=True)
        )
        true = ({"image": judge.image, "normal": judge.reference.normal} for judge in self._judges)
        by_pair = [
            metrics.flicker(drawn_pair, true_pair, pixels)
            for drawn_pair, true_pair, pixels in zip(
                pairwise(drawn), pairwise(true), self._pixels, strict=True
            )
        ]
        return {
            f"flicker_{kind}_{what}": metrics.defined_mean([errors[f"flicker_{what}"] for errors in by_pair])
            for what in ("color", "normal")
        }


def _steps(reference: Reference, spacing: float) -> NDArray[np.float64]:
    """How far depths of one sheet may lie apart at each pixel, (H, W), scan units.

    The spacing of the points, or what the pixel covers of the surface where that is more.
    """
    depth = np.where(reference.covered, reference.depth, 0.0)
    slant = np.where(reference.covered, reference.incidence(), 1.0)
    return np.maximum(spacing, reference.view.footprint(depth) / np.maximum(slant, _STEEPEST))


def _scanned(reference: Reference, views: Sequence[RangeView]) -> NDArray[np.bool_]:
    """Pixels (H, W) whose true surface the views have measured."""
    scanned = reference.covered.copy()
    scanned[scanned] = was_scanned(views, reference.positions() + reference.origin)
    return scanned


def _probes(
    truth: Scene,
    camera: Camera,
    reference: Reference,
    cloud: PointCloud,
    steps: NDArray[np.float64],
    tolerance: float | None,
) -> Probes:
    """Some points of the cloud that lie in the picture; the same of the cloud for every view.

    Chosen at random, since every k-th of an ordered scan may be one column of it.
    """
    view = reference.view
    chosen: Any = slice(None)
    if len(cloud) > _PROBES:
        chosen = np.sort(np.random.default_rng(0).choice(len(cloud), _PROBES, replace=False))
    points = cloud.positions[chosen] + (cloud.origin - truth.origin)
    points = points[view.contains(points)]
    pixels, depth = view.project(points)
    column, row = np.floor(pixels).astype(np.intp).T
    return Probes(
        pixels=row * view.size[0] + column,
        limit=depth - steps[row, column] - (tolerance or 0.0),
        seen=visible(truth, points, camera, tolerance),
    )

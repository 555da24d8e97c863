"""Views of models whose visible points are known, and what is right and wrong of points called visible.

The truth is of the mesh whose vertices the points are: nothing of it hides them from the eye. Where points
are moved by noise, it is that of the vertices that they were.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from experiments.papers import figures
from viewer.bench.report.results import Row
from viewer.bench.scenes.subjects import Moment
from viewer.camera import Camera
from viewer.gpu.context import Gpu
from viewer.mesh.reference import visible
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose
from viewer.visibility.exact import Kernel, SeenPoints, hull_rows
from viewer.visibility.search import MODES, calibrated, visible_points

PAPER = figures("machado_2014")  # counts and Table 1
SCENES = ("armadillo", "igea", "dragon")
BEST, AUTOMATIC, KATZ = "best", "automatic", "Katz's search"  # radii
EXACT, HULL, COMBINED, OF_PAPER = "exact", "hull", "combined", "paper"
HULL_AT_4M, OF_PAPER_AT_4M = "hull, k = 4e6", "paper, k = 4e6"

PAPER_SECTORS = 4_000_000  # of the paper's experiment
MOST_PER_POINT = 1000  # sectors: with more, propagation takes too many steps
_AZIMUTH, _ELEVATION = 30.0, 10.0  # of the first view, degrees

Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Verdicts:
    """Numbers of points by verdict. missed: visible, not called so; extra: called so, not visible."""

    missed: int
    extra: int
    correct: int

    @classmethod
    def of(cls, called: Mask, truth: Mask) -> Verdicts:
        """The verdicts on points (N,) that are called visible or not."""
        return cls(
            missed=int(np.count_nonzero(truth & ~called)),
            extra=int(np.count_nonzero(called & ~truth)),
            correct=int(np.count_nonzero(called & truth)),
        )

    @property
    def error(self) -> float:
        """Share that is wrong, in percent of what is rightly called visible, as the paper has it."""
        return 100 * (self.missed + self.extra) / self.correct if self.correct else np.inf


@dataclass(frozen=True, eq=False)
class JudgedView:
    """A cloud as one eye sees it. truth: (N,), which of its points are visible. noise: standard deviation by
    which they were moved, scan units."""

    cloud: PointCloud
    camera: Camera
    truth: Mask
    noise: float = 0.0

    @property
    def eye(self) -> NDArray[np.float64]:
        """Place of the eye, (3,)."""
        return np.array(self.camera.eye)

    @cached_property
    def seen(self) -> SeenPoints:
        """The points from the eye."""
        return SeenPoints.of(self.cloud, self.eye)

    @property
    def farthest(self) -> float:
        """Distance to the farthest point."""
        return float(self.seen.distance.max())

    def hull(self, kernel: Kernel) -> Verdicts:
        """Verdicts of the exact operator."""
        return self.verdicts(hull_rows(self.seen, kernel))

    def verdicts(self, rows: NDArray[np.integer]) -> Verdicts:
        """Verdicts where these rows are called visible."""
        called = np.zeros(len(self.truth), bool)
        called[rows] = True
        return Verdicts.of(called, self.truth)


def views(moment: Moment, count: int, noise: float = 0.0, seed: int = 0) -> Iterator[JudgedView]:
    """A moment's points from evenly spread sides, the first from the front. noise: standard deviation along
    the normals, in diameters of the model."""
    mesh, cloud = moment.mesh, moment.pose.cloud
    by = 2 * mesh.bounds.radius * noise
    moved = cloud
    if noise:
        assert cloud.normals is not None
        lengths = np.random.default_rng(seed).normal(0, by, (len(cloud), 1))
        moved = cloud.displaced((lengths * cloud.normals).astype(np.float32))
    for number in range(count):
        camera = Camera.orbit(mesh.bounds, _AZIMUTH + 360 * number / count, _ELEVATION)
        truth = visible(mesh, cloud.positions + (cloud.origin - mesh.origin), camera)
        yield JudgedView(moved, camera, truth, by)


def pooled(by_view: Sequence[Row]) -> Verdicts:
    """The verdicts of all views of a row together."""
    return Verdicts(*(sum(view[name] for view in by_view) for name in ("missed", "extra", "correct")))


def called_on_gpu(gpu: Gpu, view: JudgedView, radius: float) -> Iterator[tuple[str, NDArray[np.uint32]]]:
    """Yield what the operator by sectors calls visible, in each mode, and with the paper's sectors."""
    pose = Pose(0, 0.0, "", view.cloud)
    half_filled = calibrated(pose, view.eye, radius).sectors.count  # eq. 5
    wanted = {mode: (mode, half_filled if mode == OF_PAPER else None) for mode in MODES}
    if MOST_PER_POINT * len(view.cloud) >= PAPER_SECTORS:
        wanted |= {HULL_AT_4M: (HULL, PAPER_SECTORS), OF_PAPER_AT_4M: (OF_PAPER, PAPER_SECTORS)}
    for method, (mode, sectors) in wanted.items():
        yield method, visible_points(pose, view.eye, radius=radius, sectors=sectors, mode=mode, gpu=gpu)

"""A sparse octree of the points, drawn as cubes as coarse as the picture allows.

Slomp 2014, VI: octants are divided as long as that tells points apart, and drawn from where
they are no larger than a pixel.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ...gpu.amplify import FEEDS, Points
from ...gpu.context import Gpu
from ...gpu.fastest import instancing_for
from ...gpu.pose import GpuPose
from ...gpu.surface import Stats, Surface
from ...params import param
from ...scan.octree import DEEPEST, Octree
from ...scan.octree.build import STOPS, Stop, build, shortfall
from ...scan.octree.leaves import closing_levels
from ...scan.octree.traverse import Cut, Sight, Traversal
from ...scan.points import PointCloud
from ...scan.pose import Pose
from ...view import View
from .. import FrameView, Limit
from .cubes import draw_voxels, shade_flat

TITLE = "Voxels"
ROWS = "octants"
DERIVES_ON_THREAD = True

_UPRIGHT = "cubes are upright: turned points lie in other ones"
_AROUND_ALL = "octants divide the cube around all points: other points make other octants"
_ALONG_A_LINE = "octants along a line touch too few others: each is drawn as large as the line is long"
# Rows of the stability suite that cubes cannot hold in principle.
LIMITS = {
    "rotated by a quarter turn": Limit(0.01, _UPRIGHT),
    "rotated by 37 degrees": Limit(0.015, _UPRIGHT),
    "normals parallel to y": Limit(0.1, _UPRIGHT),
    "near plane inside the cloud": Limit(0.015, _AROUND_ALL),
    "eye inside the cloud": Limit(0.12, _AROUND_ALL),
    "zoomed in on 10^-3 of the scan": Limit(0.025, _AROUND_ALL),
    "zoomed in on 10^-6 of the scan": Limit(0.96, _AROUND_ALL),
    "coplanar points without normals": Limit(0.04, "without normals, faces are lit"),
    "collinear points": Limit(1.0, _ALONG_A_LINE),
    "collinear points end on, perspective": Limit(1.0, _ALONG_A_LINE),
    "collinear points end on, orthographic": Limit(0.93, _ALONG_A_LINE),
}

_UNLIKE = 0.02  # share by which sizes differ of cubes that overlap
_ANYWHERE = Sight(np.zeros(3), np.eye(3), 1.0, (1, 1), 1.0, math.inf, perspective=True)
_PRIMES = np.array([73856093, 19349663, 83492791], np.uint32)  # spatial hash (Teschner et al. 2003, 4.1)


@dataclass(frozen=True)
class Params:
    """Parameters of the voxels backend."""

    stop: str = param(
        "delta",
        "Where octants are not divided any more. delta: when few positions share one; depth: at a level; "
        "occupancy: each by itself, when it holds few points",
        choices=STOPS,
        affects="derive",
        group="Octree",
    )
    delta: float = param(
        0.05,
        "The share of the positions that may lack an octant of their own",
        low=0,
        high=1,
        affects="derive",
        group="Octree",
        when={"stop": ("delta",)},
    )
    depth: int = param(
        10,
        "The level of the leaves",
        low=0,
        high=DEEPEST,
        affects="derive",
        group="Octree",
        when={"stop": ("depth",)},
    )
    occupancy: int = param(
        8,
        "How many points are not divided any more",
        low=1,
        high=1 << 20,
        affects="derive",
        unit="points",
        group="Octree",
        when={"stop": ("occupancy",)},
    )
    max_depth: int = param(
        DEEPEST, "The deepest level drawn", low=0, high=DEEPEST, sweep=(6, 7, 8, 9, 10, 11), group="Cubes"
    )
    pixel_threshold: float = param(
        1.0,
        "Octants whose edge is less are drawn in place of what they hold",
        low=0.25,
        high=64.0,
        unit="px",
        group="Cubes",
    )
    least: float = param(
        1.25,
        "Least edge of a cube, in edges of the smallest octant around it that touches others: what closes "
        "the surface where octants lie apart; 0: as large as octants",
        low=0.0,
        high=10.0,
        sweep=(0.0, 1.25),
        group="Cubes",
    )
    normals: str = param(
        "auto",
        "What is lit. smooth: the mean of the points' normals; flat: the cubes' faces; auto: smooth where "
        "the scan has normals",
        choices=("auto", "smooth", "flat"),
        affects="derive",
        group="Cubes",
    )
    cull_back: bool = param(False, "Leave out octants whose normals all face away", group="Cubes")
    scatter: bool = param(
        True,
        "Send cubes of a few pixels to their pixels one by one; off: all are made by `instancing`",
        affects="speed",
        group="Speed",
    )
    instancing: str = param(
        "auto",
        "How octants become cubes: a geometry shader, uniform blocks, buffer textures, vertex attributes or "
        "pulled vertices; auto: what is fastest on this device",
        choices=("auto", *FEEDS),
        affects="speed",
        group="Speed",
    )


def needs(pose: Pose, params: Params) -> tuple[str, ...]:
    """Normals where they are to be lit."""
    return ("normals",) if params.normals == "smooth" else ()


def derive(pose: Pose, params: Params) -> tuple[Octree, list[NDArray[np.uint8]]]:
    """The octree of a pose, and for each level how large its nodes are drawn to close the surface."""
    stop = Stop(rule=params.stop, delta=params.delta, depth=params.depth, occupancy=params.occupancy)
    octree = build(pose.cloud, stop)
    # The first cut of a process imports what it needs, of a machine compiles it: not while a window draws.
    traversal = Traversal(octree.prefix(1), _ANYWHERE)
    traversal.advance()
    traversal.cut(octree.low)
    return octree, closing_levels(octree)


def upload(gpu: Gpu, derived: tuple[Octree, list[NDArray[np.uint8]]]) -> Voxels:
    """Nothing is uploaded until a view is known."""
    return Voxels(gpu, *derived)


def draw(pose: GpuPose, frame: FrameView, surface: Surface) -> bool:
    """Draw the nodes that the view tells apart; complete where all were found, and all shall be drawn."""
    params: Params = frame.params
    voxels: Voxels = frame.derived
    if not voxels.octree.points:
        surface.clear()
        return False
    flat = params.normals == "flat" or (params.normals == "auto" and pose.stored.normals is None)
    shown = voxels.show(pose, frame, flat)
    surface.show(shown.pose, shown.rows)
    coarse = frame.share < 1 and bool((shown.cut.level < min(params.max_depth, voxels.octree.depth)).any())
    _report(shown.cut, voxels.octree, params, surface.stats)
    if coarse:
        surface.stats.left_out = math.ceil(len(pose.cloud) * (1 - frame.share))  # as good as
    points = Points(shown.pose, use_radii=True, count=len(shown.rows))
    feed = instancing_for(surface, params.instancing, "gs", "voxels", FEEDS, _ways)
    draw_voxels(points, surface, feed, params.scatter)
    if flat:
        shade_flat(points, surface)
    return coarse or not shown.cut.complete


def _ways(pose: GpuPose, surface: Surface) -> dict[str, Callable[[], None]]:
    points = Points.of(pose, surface, 1.0, use_radii=True)
    return {feed: partial(draw_voxels, points, surface, feed, scattered=False) for feed in FEEDS}


def _report(cut: Cut, octree: Octree, params: Params, stats: Stats) -> None:
    stopped = shortfall(octree, Stop(params.stop, params.delta))
    if stopped:
        stats.chosen["depth"] = stopped
    for cause, count in (("out of view", cut.outside), ("facing away", cut.facing_away)):
        if count:
            stats.skipped[f"octants {cause}"] = f"{count:,}, with all that they hold"


@dataclass(frozen=True, eq=False)
class _Shown:
    """Nodes that a view shows. rows: (n,) the first point of each node."""

    cut: Cut
    pose: GpuPose
    rows: NDArray[np.uint32]


class Voxels:
    """An octree, and the nodes of it that the last view showed."""

    def __init__(self, gpu: Gpu, octree: Octree, closing: list[NDArray[np.uint8]]) -> None:
        self.octree = octree
        self._closing = closing
        self._gpu = gpu
        self._traversal: Traversal | None = None
        self._asked: tuple[object, ...] = ()
        self._seen: tuple[object, ...] = ()
        self._shown: _Shown | None = None

    @property
    def nbytes(self) -> int:
        """Bytes held: the octree on the CPU, what the last view showed on both sides."""
        shown = self._shown.pose.uploaded_bytes + self._shown.pose.cloud.nbytes if self._shown else 0
        looking = self._traversal.nbytes if self._traversal else 0
        return self.octree.nbytes + sum(levels.nbytes for levels in self._closing) + looking + shown

    def release(self) -> None:
        """Let go of what the last view showed."""
        self._traversal = self._shown = None

    def show(self, pose: GpuPose, frame: FrameView, flat: bool) -> _Shown:
        """The nodes for a view, found anew where it or the parameters changed, else found further."""
        params: Params = frame.params
        threshold = params.pixel_threshold / math.sqrt(frame.share)  # four times the nodes at half the edge
        asked = (threshold, params.max_depth, params.least, params.cull_back, flat)
        seen = (asked, frame.view.key)
        if self._shown is not None and self._seen == seen and self._shown.cut.complete:
            return self._shown
        sight = sight_of(frame.view)
        if self._traversal is None or self._asked != asked:
            self._traversal = Traversal(
                self.octree,
                sight,
                pixel_threshold=threshold,
                max_depth=params.max_depth,
                cull_cones=params.cull_back,
                margin=self._margin(params.least),
            )
        elif self._seen != seen:
            self._traversal.look(sight)
        self._asked, self._seen = asked, seen
        self._traversal.advance(frame.budget_ms)
        self._shown = self._look_at(self._traversal.cut(pose.origin), pose, params, flat)
        return self._shown

    def _margin(self, least: float) -> float:
        """How far cubes reach beyond the balls around their octants at most, scan units."""
        half = self.octree.edge / 2
        levels = [(level, int(found.min())) for level, found in enumerate(self._closing) if len(found)]
        beyond = (least * (1 + _UNLIKE) * half / 2**closing - half / 2**level for level, closing in levels)
        return math.sqrt(3) * max(0.0, *beyond)

    def _look_at(self, cut: Cut, pose: GpuPose, params: Params, flat: bool) -> _Shown:
        """The nodes of a cut as points, their radii being half of the cubes' edges, and behind them the
        strays as they are, in cubes of typical leaves."""
        cloud, strays = pose.cloud, self.octree.strays
        rows = np.concatenate([cut.gather(self.octree, "rows"), strays])
        positions = np.concatenate([cut.centers, (cloud.world(strays) - pose.origin).astype(np.float32)])
        unlike = _unlike(self.octree, cut, pose.origin)
        closing = np.ldexp(np.float32(self.octree.edge / 2), -cut.pick(self._closing).astype(np.int32))
        radii = np.maximum(cut.halves, params.least * unlike * closing)
        typical = params.least * math.ldexp(self.octree.edge / 2, -int(np.median(self._closing[-1])))

        def of_nodes(name: str) -> NDArray:
            return np.concatenate([cut.gather(self.octree, name), getattr(cloud, name)[strays]])

        shown = PointCloud(
            positions=positions,
            origin=pose.origin,
            # Faces give their own normals to pixels.
            normals=np.zeros_like(positions) if flat else of_nodes("normals"),
            colors=None if cloud.colors is None else of_nodes("colors"),
            radii=np.concatenate([radii, np.full(len(strays), typical, np.float32)]),
            scalars=_Scalars(cloud.scalars, rows),
            # In the cut's order, near first: no row is looked for by them.
            ids=np.concatenate([cut.numbers(self.octree), strays]),
        )
        return _Shown(cut, GpuPose(self._gpu, replace(pose.pose, points=shown)), rows)


def sight_of(view: View) -> Sight:
    """The view as a cut has to know it."""
    eye = view.origin - view.rotation.T @ view.translation
    return Sight(eye, view.rotation, view.scale, view.size, view.near, view.far, view.perspective)


def _unlike(octree: Octree, cut: Cut, origin: NDArray[np.float64]) -> NDArray[np.float32]:
    """Factors from 1 to 1 + _UNLIKE, (n,), by the nodes' places: cubes that overlap would share the planes
    of their faces, and rounding would say which of them is seen (in 7 % of the pixels of a scan that was
    moved by 1000 units; with them in less than 0.1 %)."""
    edges = 2 * cut.halves[:, None].astype(np.float64)
    cells = ((cut.centers + (origin - octree.low)) / edges).astype(np.uint32)
    mixed = (cells * _PRIMES).sum(axis=1, dtype=np.uint32) * _PRIMES[0] >> np.uint32(22)
    return 1 + mixed.astype(np.float32) * np.float32(_UNLIKE / 1024)


class _Scalars(Mapping[str, NDArray[np.generic]]):
    """Scalars of each node: those of its lowest point, looked up when they are asked for."""

    def __init__(self, scalars: Mapping[str, NDArray[np.generic]], rows: NDArray[np.uint32]) -> None:
        self._scalars, self._rows = scalars, rows

    def __getitem__(self, name: str) -> NDArray[np.generic]:
        return self._scalars[name][self._rows]

    def __iter__(self) -> Iterator[str]:
        return iter(self._scalars)

    def __len__(self) -> int:
        return len(self._scalars)

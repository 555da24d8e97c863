"""Draws an octree of the points as discs or cubes, which are coarser where they are far away.

`voxels` implements the method of Slomp 2014, section VI. `voxels` divides octants until nearly every point
has an octant of its own. Of the octree, `voxels` draws the octants that are about as large as a pixel.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...gpu.context import Gpu
from ...gpu.pose import GpuPose
from ...params import param
from ...picture.stats import Stats
from ...picture.surface import Surface
from ...scan.octree import DEEPEST, Octree
from ...scan.octree.build import STOPS, Stop, build, shortfall
from ...scan.octree.discs import usual_radius
from ...scan.octree.traverse import Cut, Sight, Traversal
from ...scan.points import NOTHING, PointCloud
from ...scan.pose import Pose
from ...splatting.amplify import Points
from ...splatting.local import NEAREST_ALONE, layer_of, surface_param
from ...splatting.passes import blends
from ...view import View
from .. import AROUND_ALL, NO_DETAIL, NO_SPACING, Backend, Derives, FrameView, Limit
from .cubes import draw_cubes, shade_flat
from .discs import VARIANTS, draw_discs

_CUBES = ("cubes", "flat_cubes")  # values of `shape`
_IN_CUBES = {"shape": _CUBES}
# Rows of the stability suite that octants cannot hold in principle.
# A cube around one point has no size: nothing is seen of it where nothing is enlarged to a pixel.
_NOT_ENLARGED = tuple(
    Limit(0.0, NO_SPACING, when)
    for when in ({"instancing": ("gs", "ubo", "tbo", "pull", "tiles")}, {"passes": ("one",)})
)

_UNLIKE = 0.02  # share by which sizes differ of cubes that overlap
_ANYWHERE = Sight(np.zeros(3), np.eye(3), 1.0, (1, 1), 1.0, math.inf, perspective=True)
_PRIMES = np.array([73856093, 19349663, 83492791], np.uint32)  # spatial hash (Teschner et al. 2003, 4.1)


@dataclass(frozen=True)
class Params:
    """Parameters of the voxels backend."""

    stop: str = param(
        "delta",
        "When to stop dividing octants. delta: when nearly every position has an octant of its own; "
        "depth: at a fixed level; occupancy: when an octant holds few points",
        choices=STOPS,
        affects="derive",
        group="Octree",
    )
    delta: float = param(
        0.05,
        "Share of the positions that may lie in one octant with other positions",
        low=0,
        high=1,
        affects="derive",
        group="Octree",
        when={"stop": ("delta",)},
    )
    depth: int = param(
        10,
        "Level of the leaves",
        low=0,
        high=DEEPEST,
        affects="derive",
        group="Octree",
        when={"stop": ("depth",)},
    )
    occupancy: int = param(
        8,
        "Largest number of points in an octant that Scan4D does not divide",
        low=1,
        high=1 << 20,
        affects="derive",
        unit="points",
        group="Octree",
        when={"stop": ("occupancy",)},
    )
    shape: str = param(
        "discs",
        "How octants are drawn. discs: at the mean position, facing along the mean normal; cubes: "
        "cubes lit by the mean normal; flat_cubes: cubes lit by the normals of their faces",
        choices=("discs", *_CUBES),
        words={"discs": "Pieces of the surface", "cubes": "Cubes", "flat_cubes": "Flat cubes"},
        basic=True,
        affects="derive",
        group="Octants",
    )
    radius_scale: float = param(
        1.0,
        "Factor on the radius of discs. 1 closes the surface",
        low=0.01,
        high=100.0,
        sweep=(0.8, 1.0),
        group="Octants",
        when={"shape": ("discs",)},
    )
    passes: str = param(
        "auto",
        "one: show the nearest disc; two: blend the nearest disc with those close behind it; auto: two, "
        "or one if two is too slow in motion",
        choices=("auto", "one", "two"),
        sweep=("auto", "one"),
        group="Octants",
        when={"shape": ("discs",)},
    )
    surface: str = surface_param("nearest", "Octants", when={"shape": ("discs",)})
    least: float = param(
        0.75,
        "Smallest half edge of a cube, in radii of the disc that would replace it. Larger cubes "
        "close the surface;"
        " 0: the exact octant",
        low=0.0,
        high=10.0,
        group="Octants",
        when={"shape": _CUBES},
    )
    max_depth: int = param(
        DEEPEST,
        "Deepest level to draw",
        low=0,
        high=DEEPEST,
        sweep=(6, 7, 8, 9, 10, 11),
        group="Octants",
        title="Detail",
        basic=True,
    )
    pixel_threshold: float = param(
        1.0,
        "Largest edge, in pixels, of an octant that is drawn instead of its children",
        low=0.25,
        high=64.0,
        unit="px",
        group="Octants",
    )
    cull_back: bool = param(
        False, "Leave out octants whose normals all face away from the viewer", group="Octants"
    )
    instancing: str = param(
        "auto",
        "How the GPU draws octants. auto: the fastest way on this device; tiles: in a compute shader, or "
        "as faces if cubes are small; the others use a geometry shader, uniform blocks, buffer textures, "
        "vertex attributes or pulled vertices",
        choices=("auto", *VARIANTS),
        affects="speed",
        group="Speed",
    )


class Voxels(Backend):
    """The backend `voxels`."""

    title = "Voxels"
    good_for = "For large scans: coarser where the scan is far away"
    params_class = Params
    rows = "octants"
    blends = True
    derives = Derives.ON_THREAD
    limits = {
        "rotated by 37 degrees": (Limit(0.007, AROUND_ALL, _IN_CUBES), Limit(0.001, AROUND_ALL)),
        "the near plane inside the scan": (Limit(0.01, AROUND_ALL, _IN_CUBES), Limit(0.001, AROUND_ALL)),
        "the eye inside the scan": (Limit(0.04, AROUND_ALL, _IN_CUBES), Limit(0.01, AROUND_ALL)),
        "zoomed in to 1/1000 of the scan's width": (
            Limit(0.007, AROUND_ALL, _IN_CUBES),
            Limit(0.001, AROUND_ALL),
        ),
        "zoomed in to a millionth of the scan's width": (
            Limit(0.99, NO_DETAIL, _IN_CUBES),
            Limit(0.65, NO_DETAIL),
        ),
        "collinear points": Limit(0.015, AROUND_ALL),
        "collinear points, viewed along their line, perspective": Limit(0.01, NO_SPACING),
        "collinear points, viewed along their line, orthographic": Limit(0.01, NO_SPACING),
        **dict.fromkeys(
            (
                "one point x1000",
                "zoomed in to 1/1000 of a splat's width",
                "zoomed in to a millionth of a splat's width",
            ),
            _NOT_ENLARGED,
        ),
    }
    default_reasons = {
        "cull_back": "the camera can see the inside of an open scan: without octants that face "
        "away, 1.5 % of the pixels of the bunny, which has no base, would show the background",
        "radius_scale": "with a radius_scale of 0.8, gaps between discs stay open: 0.1 % of "
        "the pixels of the armadillo, and 1 % of a dancing body",
    }

    def needs(self, pose: Pose, params: Params) -> tuple[str, ...]:
        """Normals, but for faces, which have their own."""
        return () if params.shape == "flat_cubes" else ("normals",)

    def derive(self, pose: Pose, params: Params, view: View | None) -> Octree:
        """The octree of a pose."""
        stop = Stop(rule=params.stop, delta=params.delta, depth=params.depth, occupancy=params.occupancy)
        octree = build(pose.cloud, stop)
        # A process's first cut imports, a machine's first compiles: not while a window draws.
        traversal = Traversal(octree.prefix(1), _ANYWHERE)
        traversal.advance()
        traversal.cut(octree.low)
        return octree

    def upload(self, gpu: Gpu, octree: Octree) -> OctreeCuts:
        """Nothing is uploaded until a view is known."""
        return OctreeCuts(gpu, octree)

    def draw(self, pose: GpuPose, frame: FrameView, surface: Surface) -> bool:
        """Draw the nodes that the view tells apart; complete where all were found, and all shall be drawn."""
        params: Params = frame.params
        voxels: OctreeCuts = frame.derived
        if not len(pose.cloud):
            surface.clear()
            return False
        shown = voxels.show(pose, frame)
        surface.show(shown.pose, shown.rows, shown.octants)
        coarse = frame.share < 1 and bool(
            (shown.cut.level < min(params.max_depth, voxels.octree.depth)).any()
        )
        _report(shown.cut, voxels.octree, params, surface.stats)
        if coarse:
            surface.stats.left_out = math.ceil(len(pose.cloud) * (1 - frame.share))  # as good as
        points = Points(shown.pose, use_radii=True, count=len(shown.rows))
        if not points.count:
            surface.clear()
            return not shown.cut.complete
        layer = NEAREST_ALONE
        if params.shape == "discs":
            two = blends(frame, surface) if params.passes == "auto" else params.passes == "two"
            layer = layer_of(pose, frame, surface, blends=two)
            draw_discs(
                points,
                surface,
                instancing=params.instancing,
                radius_scale=params.radius_scale,
                two=two or layer.is_local,
                layer=layer,
            )
        else:
            draw_cubes(points, surface, params.instancing)
        if params.shape == "flat_cubes":
            shade_flat(points, surface)
        return coarse or not (shown.cut.complete and layer.known)


def _report(cut: Cut, octree: Octree, params: Params, stats: Stats) -> None:
    stopped = shortfall(octree, Stop(params.stop, params.delta))
    if stopped:
        stats.chosen["depth"] = stopped
    for cause, count in (("out of view", cut.outside), ("facing away", cut.facing_away)):
        if count:
            stats.skipped[f"octants {cause}"] = f"{count:,}, with all their children"


@dataclass(frozen=True, eq=False)
class _Shown:
    """Nodes that a view shows, and strays behind them. rows: (n,) the first point of each. octants: (n,) the
    number of each among all of the tree, NOTHING of strays."""

    cut: Cut
    pose: GpuPose
    rows: NDArray[np.uint32]
    octants: NDArray[np.uint32]


class OctreeCuts:
    """An octree, and the nodes of it that the last view showed."""

    def __init__(self, gpu: Gpu, octree: Octree) -> None:
        self.octree = octree
        self._gpu = gpu
        radii = [each.radii for each in octree.attributes if each.radii is not None]
        self._largest = [float(each.max()) for each in radii]
        self._usual = usual_radius(octree.masks, radii) if radii else 0.0
        self._traversal: Traversal | None = None
        self._asked: tuple[object, ...] = ()
        self._seen: tuple[object, ...] = ()
        self._shown: _Shown | None = None

    @property
    def nbytes(self) -> int:
        """Bytes held: the octree on the CPU, what the last view showed on both sides."""
        shown = self._shown.pose.uploaded_bytes + self._shown.pose.cloud.nbytes if self._shown else 0
        looking = self._traversal.nbytes if self._traversal else 0
        return self.octree.nbytes + looking + shown

    def release(self) -> None:
        """Let go of what the last view showed."""
        self._traversal = self._shown = None

    def show(self, pose: GpuPose, frame: FrameView) -> _Shown:
        """The nodes for a view, found anew where it or the parameters changed, else found further."""
        params: Params = frame.params
        threshold = params.pixel_threshold / math.sqrt(frame.share)  # four times the nodes at half the edge
        scale = params.radius_scale if params.shape == "discs" else params.least
        asked = (threshold, params.max_depth, params.shape, scale, params.cull_back)
        seen = (asked, frame.view.key)
        if self._shown is not None and self._seen == seen and self._shown.cut.complete:
            return self._shown
        sight = sight_of(frame.view)
        if self._traversal is None or self._asked != asked:
            reach = scale if params.shape == "discs" else math.sqrt(3) * scale * (1 + _UNLIKE)
            self._traversal = Traversal(
                self.octree,
                sight,
                pixel_threshold=threshold,
                max_depth=params.max_depth,
                cull_cones=params.cull_back,
                margins=[reach * radius for radius in self._largest],
            )
        elif self._seen != seen:
            self._traversal.look(sight)
        self._asked, self._seen = asked, seen
        self._traversal.advance(frame.budget_ms)
        cut = self._traversal.cut(pose.origin, means=params.shape == "discs")
        self._shown = self._look_at(cut, pose, params)
        return self._shown

    def _look_at(self, cut: Cut, pose: GpuPose, params: Params) -> _Shown:
        """The nodes of a cut as points, their radii those of discs or half of the cubes' edges, and behind
        them the strays as they are, as large as typical leaves."""
        cloud, strays = pose.cloud, self.octree.strays
        rows = np.concatenate([cut.gather(self.octree, "rows"), strays])
        apart = (cloud.world(strays) - pose.origin).astype(np.float32)
        positions = np.concatenate([cut.positions, apart])
        of_strays = np.full(len(strays), self._usual, np.float32)
        radii = np.concatenate([cut.gather(self.octree, "radii"), of_strays])
        if params.shape != "discs":
            radii *= params.least
            radii[: len(cut)] *= _unlike(self.octree, cut, pose.origin)
            radii[: len(cut)] = np.maximum(cut.halves, radii[: len(cut)])

        shown = PointCloud(
            positions=positions,
            origin=pose.origin,
            normals=self._normals(cut, pose, params),
            colors=None
            if cloud.colors is None
            else np.concatenate([cut.gather(self.octree, "colors"), cloud.colors[strays]]),
            radii=radii,
            scalars=_Scalars(cloud.scalars, rows),
            ids=rows if cloud.ids is None else cloud.ids[rows],  # near first: no row is looked for by them
        )
        octants = np.concatenate([cut.numbers(self.octree), np.full(len(strays), NOTHING, np.uint32)])
        return _Shown(cut, GpuPose(self._gpu, replace(pose.pose, points=shown)), rows, octants)

    def _normals(self, cut: Cut, pose: GpuPose, params: Params) -> NDArray[np.float32]:
        """Normals of the nodes, and of the strays those that the scan has: around these, none can be
        estimated, and without one they face the eye."""
        strays = self.octree.strays
        if params.shape == "flat_cubes":  # faces give their own normals to pixels
            return np.zeros((len(cut) + len(strays), 3), np.float32)
        stored = pose.stored.normals
        own = np.zeros((len(strays), 3), np.float32) if stored is None else stored[strays]
        return np.concatenate([cut.gather(self.octree, "normals"), own])


def sight_of(view: View) -> Sight:
    """The view as a cut has to know it."""
    eye = view.origin - view.rotation.T @ view.translation
    (width, height), (right, down) = view.size, view.shift
    size = (width + 2 * math.ceil(abs(right)), height + 2 * math.ceil(abs(down)))
    return Sight(eye, view.rotation, view.scale, size, view.near, view.far, view.perspective)


def _unlike(octree: Octree, cut: Cut, origin: NDArray[np.float64]) -> NDArray[np.float32]:
    """Factors from 1 to 1 + _UNLIKE, (n,), by the nodes' positions: cubes that overlap would share the planes
    of their faces, and rounding would say which of them is seen (in 7 % of the pixels of a scan that was
    moved by 1000 units; with them in less than 0.1 %). By those about the middle of the tree's cube, so that
    quarter turns and mirrors give the same."""
    middle = octree.low + octree.edge / 2 - origin
    away = np.abs(cut.positions - middle) / cut.halves[:, None].astype(np.float64)
    cells = np.sort(np.rint(away).astype(np.uint32), axis=1)  # odd ones: half edges
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

"""The octants that a view shows: found when the view changes, on the GPU or on the CPU, and drawn as points.

Both find the same octants in the same order, to the bit. Graphics cards find them in a fraction of the time;
software drivers would compute what the CPU computes anyway, but could not stop within a budget.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ...gpu.context import Gpu
from ...gpu.pose import GpuPose
from ...scan.octree import Octree
from ...scan.octree.discs import usual_radius
from ...scan.octree.traverse import Cut, Sight, Traversal
from ...scan.points import NOTHING, PointCloud
from ...view import View
from .. import FrameView
from .gpu_cut import CutOptions, GpuOctree
from .shown import CutCounts, ScalarsOfRows, ShownOctants, StrayPoints, ids_of

BY_SHADERS: bool | None = None  # whether shaders find octants, for tests; None: on graphics cards
_UNLIKE = 0.02  # share by which sizes differ of cubes that overlap
_PRIMES = np.array([73856093, 19349663, 83492791], np.uint32)  # spatial hash (Teschner et al. 2003, 4.1)


class OctantSettings(Protocol):
    """The parameters of the backend that say which octants are drawn, and how large."""

    @property
    def shape(self) -> str:
        """discs, cubes or flat_cubes."""

    @property
    def radius_scale(self) -> float:
        """Factor on the radius of discs."""

    @property
    def least(self) -> float:
        """Smallest half edge of a cube, in radii of a disc."""

    @property
    def max_depth(self) -> int:
        """Deepest level to draw."""

    @property
    def pixel_threshold(self) -> float:
        """Edge in pixels; shorter octants are not divided."""

    @property
    def cull_back(self) -> bool:
        """Whether octants that face away are left out."""


@dataclass(frozen=True, eq=False)
class _Gathered:
    """Nodes that the CPU found. rows: (n,), the first point of each. octants: (n,), the number of each among
    all of the tree, NOTHING of strays."""

    points: GpuPose
    rows: NDArray[np.uint32]
    octants: NDArray[np.uint32]
    found: CutCounts


class OctreeCuts:
    """An octree, and the nodes of it that the last view showed."""

    def __init__(self, gpu: Gpu, octree: Octree) -> None:
        self.octree = octree
        self._gpu = gpu
        radii = [each.radii for each in octree.attributes if each.radii is not None]
        self._largest = [float(each.max()) for each in radii]
        self._usual = usual_radius(octree.masks, radii) if radii else 0.0
        self._traversal: Traversal | None = None
        self._on_gpu: GpuOctree | None = None
        self._asked: tuple[object, ...] = ()
        self._seen: tuple[object, ...] = ()
        self._shown: ShownOctants | None = None

    @property
    def nbytes(self) -> int:
        """Bytes held: the octree on the CPU and the GPU, what the last view showed on both sides."""
        shown = self._shown.points.uploaded_bytes if self._shown else 0
        if isinstance(self._shown, _Gathered):
            shown += self._shown.points.cloud.nbytes
        looking = self._traversal.nbytes if self._traversal else 0
        return self.octree.nbytes + looking + shown + (self._on_gpu.nbytes if self._on_gpu else 0)

    def release(self) -> None:
        """Let go of what the last view showed."""
        if self._on_gpu is not None:
            self._on_gpu.release()
        self._traversal = self._shown = self._on_gpu = None

    def show(self, pose: GpuPose, frame: FrameView) -> ShownOctants:
        """The nodes for a view, found anew where it or the parameters changed, else found further."""
        params: OctantSettings = frame.params
        threshold = params.pixel_threshold / math.sqrt(frame.share)  # four times the nodes at half the edge
        scale = params.radius_scale if params.shape == "discs" else params.least
        asked = (threshold, params.max_depth, params.shape, scale, params.cull_back)
        seen = (asked, frame.view.key)
        if self._shown is not None and self._seen == seen and self._shown.found.complete:
            return self._shown
        reach = scale if params.shape == "discs" else math.sqrt(3) * scale * (1 + _UNLIKE)
        margins = [reach * radius for radius in self._largest]
        options = CutOptions(threshold, params.max_depth, params.cull_back, margins)
        if self._may_cut_on_gpu(params):
            self._shown = self._find_on_gpu(pose, frame, options)
        else:
            self._shown = self._find(pose, frame, options, asked, is_new=self._seen != seen)
        self._asked, self._seen = asked, seen
        return self._shown

    def _coarseness(self, frame: FrameView, edge: float) -> float:
        """The size of an octant of this edge, about where the octree is nearest, as a share of the picture's
        height."""
        view, octree = frame.view, self.octree
        if not edge:
            return 0.0
        middle = octree.low + octree.edge / 2 - view.origin
        depth = float(view.depths(middle)) - math.sqrt(3) / 2 * octree.edge if view.perspective else 1.0
        return edge * view.scale / max(depth, view.near if view.perspective else 1.0) / view.size[1]

    def _may_cut_on_gpu(self, params: OctantSettings) -> bool:
        """Whether shaders find the nodes: discs, and as many as a shader can see."""
        wanted = not self._gpu.software if BY_SHADERS is None else BY_SHADERS
        return wanted and params.shape == "discs" and GpuOctree.fits(self._gpu, self.octree)

    def _find_on_gpu(self, pose: GpuPose, frame: FrameView, options: CutOptions) -> ShownOctants:
        if self._on_gpu is None:
            self._on_gpu = GpuOctree(self._gpu, self.octree)
        octree, depth = self._on_gpu, options.max_depth
        if not octree.is_complete:
            with pose.preparing("upload"):
                pose.spent.nbytes += octree.upload(frame.budget_ms)
                while self._coarseness(frame, octree.largest(depth)) > frame.coarsest:
                    pose.spent.nbytes += octree.upload(0.0)
        coarseness = self._coarseness(frame, octree.largest(depth))
        return octree.show(pose, self._strays(pose), sight_of(frame.view), options, coarseness)

    def _find(
        self, pose: GpuPose, frame: FrameView, options: CutOptions, asked: tuple[object, ...], is_new: bool
    ) -> ShownOctants:
        sight = sight_of(frame.view)
        if self._traversal is None or self._asked != asked:
            self._traversal = Traversal(
                self.octree,
                sight,
                pixel_threshold=options.pixel_threshold,
                max_depth=options.max_depth,
                cull_cones=options.cull_cones,
                margins=options.margins,
            )
        elif is_new:
            self._traversal.look(sight)
        traversal = self._traversal
        traversal.advance(frame.budget_ms)
        while self._coarseness(frame, traversal.largest) > frame.coarsest:
            traversal.advance(0.0)
        params: OctantSettings = frame.params
        cut = traversal.cut(pose.origin, means=params.shape == "discs")
        return self._gather(cut, pose, params, self._coarseness(frame, traversal.largest))

    def _gather(self, cut: Cut, pose: GpuPose, params: OctantSettings, coarseness: float) -> _Gathered:
        """The nodes of a cut as points, their radii those of discs or half of the cubes' edges, and behind
        them the strays as they are, as large as typical leaves."""
        strays = self._strays(pose)
        rows = np.concatenate([cut.gather(self.octree, "rows"), strays.rows])
        radii = np.concatenate([cut.gather(self.octree, "radii"), strays.radii])
        if params.shape != "discs":
            radii *= params.least
            radii[: len(cut)] *= _unlike(self.octree, cut, pose.origin)
            radii[: len(cut)] = np.maximum(cut.halves, radii[: len(cut)])
        if params.shape == "flat_cubes":  # faces give their own normals to pixels
            normals = np.zeros((len(rows), 3), np.float32)
        else:
            normals = np.concatenate([cut.gather(self.octree, "normals"), strays.normals])
        colors = None
        if strays.colors is not None:
            colors = np.concatenate([cut.gather(self.octree, "colors"), strays.colors])
        shown = PointCloud(
            positions=np.concatenate([cut.positions, strays.positions]),
            origin=pose.origin,
            normals=normals,
            colors=colors,
            radii=radii,
            scalars=ScalarsOfRows(pose.cloud.scalars, rows),
            ids=ids_of(pose, rows),
        )
        numbers = cut.numbers(self.octree)
        octants = np.concatenate([numbers, np.full(len(strays.rows), NOTHING, np.uint32)])
        coarsest = int(cut.level[-1]) if len(cut) else self.octree.depth
        found = CutCounts(cut.complete, cut.outside, cut.facing_away, coarsest, coarseness)
        return _Gathered(GpuPose(self._gpu, replace(pose.pose, points=shown)), rows, octants, found)

    def _strays(self, pose: GpuPose) -> StrayPoints:
        """The points outside the tree's cube. Their normals are those that the scan has: around them, none
        can be estimated, and without one they face the eye."""
        cloud, rows = pose.cloud, self.octree.strays
        stored, radii = pose.stored.normals, np.full(len(rows), self._usual, np.float32)
        has_radii = bool(self.octree.attributes) and self.octree.attributes[0].own_radii is not None
        if has_radii and pose.stored.radii is not None:
            own = pose.stored.radii[rows]
            np.copyto(radii, own, where=(own > 0) & (own < np.inf))
        return StrayPoints(
            rows=rows,
            positions=(cloud.world(rows) - pose.origin).astype(np.float32),
            radii=radii,
            normals=np.zeros((len(rows), 3), np.float32) if stored is None else stored[rows],
            colors=None if cloud.colors is None else cloud.colors[rows],
        )


def sight_of(view: View) -> Sight:
    """The view as a cut has to know it."""
    (width, height), (right, down) = view.size, view.shift
    size = (width + 2 * math.ceil(abs(right)), height + 2 * math.ceil(abs(down)))
    return Sight(view.eye, view.rotation, view.scale, size, view.near, view.far, view.perspective)


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

"""Covering: which points others cover, by how far apart points lie; it corrects what the hull says.

The hull of the flipped points drops what lies in folds, and shows what lies behind gaps between points: its
one radius stands for the density and the bends of the whole surface. Here a visible point covers a disc, a
little wider than the distance to its neighbours. What lies behind it is hidden where discs come from all
around: on a surface that is seen aslant, nearer points lie on one side only, however steep it is. So neither
normals nor faces are needed, and points may lie as unevenly as they like.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...gpu import gl
from ...gpu.bindings import Storage, Texture
from ...gpu.bins import Bins
from ...gpu.compact import IndexList, list_flagged
from ...gpu.context import Gpu, Program
from ...gpu.pose import GpuPose
from ...gpu.scatter import Visits
from ...scan.points import PointCloud
from ...scan.spacing import nearest_rows
from .calibration import body_of, copies
from .candidates import Candidates
from .sectors import Sectors

ROUNDS = 2  # the first gives folds back, which then cover what lies behind them
REACH = 1.9  # of a disc, in distances between points
CLEAR = 0.05  # of the reach: how far behind a point others may lie, beside it, that it does not cover
STEEP = 1.0  # and how much farther for each length aside
ENOUGH = 6  # points in a ball that tell how far apart they lie
_BALL = 2.5  # its radius, in usual distances between points; it is doubled where there are too few
_LEVELS = 3
_LOOKED_AT = 8_000_000  # distances from point to point that tell of noise
_ROUGH = 0.22  # off the plane of the nearest, in distances between points: detail, up to that
_NOISY = 8.0  # the clearance for what is more, in distances between points
_CELL = 1.25  # edge of the cells that discs are listed by, in usual distances between points

Sample = tuple[gl.BufferTexture, int]  # rows that are looked at in place of all, and how many


def clearance(cloud: PointCloud) -> float:
    """Clearance behind a disc, in its reach, within which it covers nothing beside it: more where noise lifts
    points off the surface, as some of them tell; found once for each cloud."""
    return cloud.remember(_clearance)


def _clearance(cloud: PointCloud) -> float:
    if body_of(cloud).count < len(cloud):
        cloud = PointCloud(positions=cloud.positions[copies(cloud) == 0], origin=cloud.origin)
    rows = np.linspace(0, len(cloud) - 1, min(max(_LOOKED_AT // len(cloud), 8), 64)).astype(int)
    found = [_roughness(cloud.positions[nearest_rows(cloud, row)]) for row in rows.tolist()]
    return CLEAR + _NOISY * max(float(np.median(found)) - _ROUGH, 0.0) / REACH


def _roughness(points: NDArray[np.float32]) -> float:
    """How far points (N, 3) around one lie off their plane, in distances between them."""
    away = points.astype(np.float64)
    if len(away) < 2 * ENOUGH:
        return 0.0
    away -= away.mean(axis=0)
    apart = np.sqrt((away * away).sum(axis=1).max() * np.pi / len(away))
    return float(np.linalg.svd(away, compute_uv=False)[2] / np.sqrt(len(away) - 3) / apart)


def copies_in(pose: GpuPose) -> gl.BufferTexture | None:
    """The copies in a pose: which points have one of a lower row in their place; None: none has."""
    if body_of(pose.stored).count == len(pose.cloud):
        return None
    return pose.packed(copies, texel_format=gl.R32UI)


class Covering:
    """Corrects `Candidates.visible`. Holds 16 bytes a point, lists of visible points, and lists of discs.

    Raises InputError for more points than the driver takes.
    """

    def __init__(self, gpu: Gpu, points: int) -> None:
        self._gpu, self.points = gpu, points
        if 16 * points > gpu.max_storage_bytes:
            raise InputError(f"{points:,} points are more than this driver takes")
        self._sights = gl.BufferTexture(gpu.ctx.buffer(reserve=16 * max(points, 1)), gl.RGBA32F)
        self._visible, self._todo, self._sparse = (IndexList(gpu, points) for _ in range(3))
        self._bins = Bins(gpu, 1)

    @property
    def nbytes(self) -> int:
        """Bytes held on the GPU."""
        lists = (self._visible, self._todo, self._sparse)
        return self._sights.buffer.size + self._bins.nbytes + sum(each.nbytes for each in lists)

    def correct(
        self,
        candidates: Candidates,
        spacing: float,
        clear: float = CLEAR,
        repeated: gl.BufferTexture | None = None,
        sample: Sample | None = None,
    ) -> None:
        """Correct what is visible.

        candidates: of as many points; their `visible` is what the hull says, and is changed. spacing: usual
        distance between visible points, as a share of a face of the sectors. clear: `clearance` of the cloud.
        repeated: `copies_in` of the pose, where all points are looked at. sample: as `Candidates.find` had
        it.
        """
        for again in range(ROUNDS):
            with self._gpu.timers.measure("list"):
                self._list_visible(candidates, repeated, sample)
            with self._gpu.timers.measure("spread"):
                self._find_spread(candidates, spacing, sample)
            with self._gpu.timers.measure("cover"):
                self._cover(candidates, spacing, clear, repeated, sample, again > 0)

    def _list_visible(
        self, candidates: Candidates, repeated: gl.BufferTexture | None, sample: Sample | None
    ) -> None:
        def bind(_: Program) -> None:
            candidates.visible.bind(Texture.VISIBLE)
            candidates.homes.bind(Texture.HOMES)
            _bind_sample(sample)
            if repeated is not None:
                repeated.bind(Texture.COPIES)

        flags, count = "hpr/visible_items.glsl", candidates.looked_at
        defines = {"COPIES": int(repeated is not None), **_sampled(sample)}
        list_flagged(self._gpu, flags, count, self._visible, bind, defines)

    def _find_spread(self, candidates: Candidates, spacing: float, sample: Sample | None) -> None:
        """Find how far the discs of visible points reach, from finer to coarser cells."""
        gpu, todo, sparse = self._gpu, self._visible, self._sparse
        for level in range(_LEVELS):
            cells = _cells(candidates.sectors, _BALL * spacing * 2**level)
            self._list_by_cell(candidates, cells, sample, discs=False)
            last = level == _LEVELS - 1
            defines = {"LAST": int(last), "ENOUGH": f"{ENOUGH}u", "REACH": REACH}
            program = gpu.compute(
                "hpr/cover_spread.comp",
                {**defines, **_sampled(sample), **candidates.defines},
                params=cells,
            )
            gpu.set(program, ball=_ball(cells))
            sparse.clear()
            sparse.bind(Storage.NEXT_LIST, Storage.NEXT_DISPATCH)
            candidates.spots.bind(Texture.SPOTS)
            self._bind_lists()
            _bind_sample(sample)
            self._sights.buffer.bind_to_storage_buffer(Storage.SIGHTS)
            todo.run(program)
            todo, sparse = sparse, self._todo if todo is self._visible else todo

    def _cover(
        self,
        candidates: Candidates,
        spacing: float,
        clear: float,
        repeated: gl.BufferTexture | None,
        sample: Sample | None,
        listed: bool,
    ) -> None:
        """Find what the discs leave visible, of all points or of those that are."""
        cells = _cells(candidates.sectors, _CELL * spacing)
        self._list_by_cell(candidates, cells, sample, discs=True)
        defines = {"LISTED": int(listed), "COPIES": int(repeated is not None), "STEEP": STEEP}
        program = self._gpu.compute(
            "hpr/cover.comp", {**defines, **_sampled(sample), **candidates.defines}, params=cells
        )
        self._gpu.set(program, clear=clear)
        candidates.spots.bind(Texture.SPOTS)
        candidates.homes.bind(Texture.HOMES)
        self._sights.bind(Texture.SIGHTS)
        self._bind_lists()
        _bind_sample(sample)
        if repeated is not None:
            repeated.bind(Texture.COPIES)
        candidates.visible.buffer.bind_to_storage_buffer(Storage.VISIBLE)
        if listed:
            self._visible.run(program)
        else:
            self._gpu.dispatch(program, candidates.looked_at)

    def _list_by_cell(
        self,
        candidates: Candidates,
        cells: Sectors,
        sample: Sample | None,
        discs: bool,
    ) -> None:
        """List the visible points by the cells that they, or their discs, lie in."""
        if self._bins.cells != cells.count:
            self._bins.release()
            self._bins = Bins(self._gpu, cells.count)

        def bind(_: Program) -> None:
            self._visible.bind()
            candidates.spots.bind(Texture.SPOTS)
            self._sights.bind(Texture.SIGHTS)
            _bind_sample(sample)

        defines = {"DISCS": int(discs), **_sampled(sample), **candidates.defines}
        visits = Visits("hpr/cover_cells.glsl", self.points, bind, defines, cells, self._visible)
        self._bins.count(visits)
        self._bins.fill(visits)

    def _bind_lists(self) -> None:
        self._bins.starts.bind(Texture.STARTS)
        self._bins.items.bind(Texture.LISTED)

    def release(self) -> None:
        """Delete all of it."""
        self._sights.release()
        self._bins.release()
        for each in (self._visible, self._todo, self._sparse):
            each.release()


def levels(sectors: Sectors, spacing: float) -> tuple[float, ...]:
    """The radii of the balls in which points are counted, as angles, or units for parallel rays."""
    return tuple(
        _ball(_cells(sectors, _BALL * spacing * 2**level)) * (sectors.tangent or 1.0)
        for level in range(_LEVELS)
    )


def _ball(cells: Sectors) -> float:
    """The largest that lies within the cells around its own, also at the corners of a face, where cells are
    smaller."""
    return 2 * cells.half_angle / cells.edge / math.sqrt(1 + cells.tangent**2)


def _cells(sectors: Sectors, size: float) -> Sectors:
    """Cells of the same directions, about so large, a share of a face."""
    return sectors.divided(max(round(1 / size), 1))


def _sampled(sample: Sample | None) -> dict[str, object]:
    return {"SAMPLED": int(sample is not None)}


def _bind_sample(sample: Sample | None) -> None:
    if sample is not None:
        sample[0].bind(Texture.DRAWN_ROWS)

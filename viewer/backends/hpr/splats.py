"""Splats of visible points: normals by going around sectors, sizes by how far these reach.

Machado e Silva 2014, 5.3 and 5.5.
"""

from __future__ import annotations

import math

from ...gpu import gl
from ...gpu.bindings import Texture, storage
from ...gpu.constants import NO_DEPTH
from ...gpu.context import Gpu, Program
from ...gpu.pose import GpuPose
from ...gpu.scatter import CellSums, FixedPoint, Visits, take_keys
from ...picture.surface import Surface
from ...visibility.calibration import EyeCalibration, body_of
from ...visibility.candidates import Candidates
from ...visibility.covering import Covering
from ...visibility.exact_search import ExactlySeen
from ...visibility.spacing import is_steadied, spacing_texels, steady_points

_INFINITE = 1e12  # weight, from which on nearness alone counts but for ties
_MOST_SECTORS = 1 << 22  # of which 24 bytes are kept
_GAPS = 2  # times the usual steps between visible points, for gaps where some were not found
_AROUND = 8.0  # sectors around one, each of which adds 1 at most
_FINEST = 2.0**-16  # of what they add
# By row: splats, looks as `Points.buffers` has them; spacings: scan units, usual distance to the neighbors;
# keys: how far sectors reach, what is least for the farthest.
_BY_ROW = {
    "splats": (gl.RGB32UI, 3),
    "looks": (gl.RG32UI, 2),
    "spacings": (gl.R32F, 1),
    "keys": (gl.R32UI, 1),
}


class SectorSplats:
    """Splats of the candidates of sectors, found anew for each picture, as texels by row of the pose."""

    def __init__(self, gpu: Gpu, _: tuple[int, int]) -> None:
        self._gpu = gpu
        self._texels: dict[str, gl.BufferTexture] = {}
        self._sums: CellSums | None = None
        self._sum_texels: gl.BufferTexture | None = None
        self._state: object = None  # of the visible points that it knows
        self._map: Candidates | None = None

    @property
    def nbytes(self) -> int:
        """Bytes held on the GPU: 48 a point."""
        held = [texels.buffer.size for texels in self._texels.values()]
        return sum(held) + sum(each.nbytes for each in (self._sums, self._map) if each is not None)

    def __getitem__(self, name: str) -> gl.BufferTexture:
        return self._texels[name]

    def of_visible(
        self,
        pose: GpuPose,
        seen: Candidates | Covering | ExactlySeen,
        calibration: EyeCalibration,
        surface: Surface,
        fine: int = 1,
    ) -> Candidates:
        """Find the splats of the visible points, unless they are known. Returns sectors whose rows are those
        of them that are nearest to their directions, as a flip at an infinite radius gives them.

        seen: knows which points are visible. calibration: says how densely they lie. fine: times the sectors
        along an edge of those of which half would have a point.
        """
        sectors = calibration.sectors
        most = math.isqrt(_MOST_SECTORS * sectors.edge**2 // sectors.count)
        edge = min(fine * sectors.edge, most)
        if self._map is not None and self._state is seen.state and self._map.sectors.edge == edge:
            surface.stats.skipped["splats"] = "the visible points are the same as in the last picture"
            return self._map
        sectors, steps, _ = calibration.with_sectors(edge)
        if self._map is None or not self._map.fits(sectors, len(pose.cloud)):
            self._gpu.discard(self._map)
            self._map = None
            self._map = Candidates(self._gpu, sectors, len(pose.cloud))
        self._map.distinct = body_of(pose.stored).count
        nearest, among = sectors.weighted(_INFINITE), seen.visible
        self._map.find(steady_points(pose), nearest, _GAPS * steps, among=among)
        self.find(pose, self._map)
        self._state = seen.state
        return self._map

    def find(self, pose: GpuPose, candidates: Candidates) -> None:
        """Find the splats of the candidates that `candidates.rows` has; other points get none, a radius of
        0."""
        gpu, sectors = self._gpu, candidates.sectors
        self._state = None
        sums, texels = self._reserve(len(pose.cloud))

        def bind(_: Program) -> None:
            candidates.rows.bind(Texture.CANDIDATES)
            candidates.sector_positions.bind(Texture.SPOTS)
            steady_points(pose).bind(Texture.POSITIONS)

        def visits(cells: str) -> Visits:
            return Visits(cells, 0, bind, candidates.defines, sectors, candidates.inside)

        fixed = _fixed(candidates)
        with gpu.timers.measure("circulation"):
            sums.clear()
            sums.add(visits("hpr/circulation.glsl"), fixed)
        self._gpu.clear(self["keys"].buffer, NO_DEPTH)
        take_keys(gpu, visits("hpr/sizes.glsl"), self["keys"])
        with gpu.timers.measure("splats"):
            has_colors = pose.cloud.colors is not None
            defines = {
                "HAS_COLORS": int(has_colors),
                "STEADY": int(is_steadied(pose)),
                **fixed.defines,
                **candidates.defines,
            }
            program = gpu.compute("hpr/splats.comp", defines, params=sectors)
            bind(program)
            if has_colors:
                pose.array("colors").bind(Texture.COLORS)
            texels.bind(Texture.SUMS)
            spacing_texels(pose).bind(Texture.SPACINGS)
            self["keys"].bind(Texture.KEYS)
            for name in ("splats", "looks", "spacings"):
                self[name].buffer.bind_to_storage_buffer(storage(name))
            gpu.dispatch(program, len(pose.cloud))

    def _reserve(self, count: int) -> tuple[CellSums, gl.BufferTexture]:
        """Room for so many rows, and the sums of them."""
        if self._sums is None or self._sum_texels is None or self._sums.cells != max(count, 1):
            self._release_rows()
            self._sums = CellSums(self._gpu, max(count, 1), 5)
            self._sum_texels = gl.BufferTexture(self._sums.buffer, gl.R32I)
            for name, (texel_format, words) in _BY_ROW.items():
                buffer = self._gpu.buffer(reserve=4 * words * max(count, 1))
                self._texels[name] = gl.BufferTexture(buffer, texel_format)
        return self._sums, self._sum_texels

    def release(self) -> None:
        """Delete everything."""
        self._release_rows()
        self._gpu.discard(self._map)
        self._map = None

    def _release_rows(self) -> None:
        self._gpu.discard(self._sum_texels, *self._texels.values())  # the sums' buffer goes with their texels
        self._sums, self._sum_texels, self._texels = None, None, {}


def _fixed(candidates: Candidates) -> FixedPoint:
    """How normals, counts and inverse distances are added up: of the sectors that a candidate may have."""
    across = 2 * candidates.steps + 1
    most = min(candidates.sectors.count, across**2)
    return FixedPoint((_AROUND,) * 5, (_FINEST,) * 5, most)

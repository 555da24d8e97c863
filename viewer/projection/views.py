"""Range views as a source of samples: tiles that a picture needs, of the level that fits its pixels."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..gpu import gl
from ..gpu.bindings import Storage, Texture
from ..gpu.compact import IndexList
from ..gpu.constants import RANGE_TILE
from ..gpu.context import Gpu, Program
from ..gpu.pose import GpuPose
from ..gpu.scatter import Visits
from ..look import is_lit
from ..picture.surface import Surface

MODES = ("nearest", "linear", "best")  # as of_views.glsl numbers them
_SPARE = 1 << 16  # entries of a list for the parts of large tiles
COUNTS = ("empty", "drawn", "outside", "away")  # what becomes of tiles, as tiles.comp counts them


class DrawnTiles:
    """The list of the tiles that a picture draws, and how many were left out why."""

    def __init__(self, gpu: Gpu, _: tuple[int, int]) -> None:
        self._gpu = gpu
        self.counts = gpu.buffer(reserve=4 * len(COUNTS))
        self.listed = IndexList(gpu, 1, RANGE_TILE)

    @property
    def nbytes(self) -> int:
        """Bytes held on the GPU."""
        return self.listed.nbytes + self.counts.size

    def read(self) -> dict[str, int]:
        """Numbers of tiles of the levels that were looked at, by what became of them."""
        return dict(zip(COUNTS, self._read()[: len(COUNTS)], strict=True))

    def read_views(self) -> list[int]:
        """The numbers of the views that have any tile in the picture; waits for the GPU."""
        return [view for view, drawn in enumerate(self._read()[len(COUNTS) :]) if drawn]

    def reserve(self, tiles: int, views: int) -> None:
        """Make room for a list of so many tiles, of so many views."""
        if tiles > self.listed.capacity:
            self._gpu.discard(self.listed)
            self.listed = IndexList(self._gpu, tiles, RANGE_TILE)
        nbytes = 4 * (len(COUNTS) + views)
        if self.counts.size != nbytes:
            self._gpu.discard(self.counts)
            self.counts = self._gpu.buffer(reserve=nbytes)

    def _read(self) -> list[int]:
        return self._gpu.read(self.counts, np.uint32).tolist()

    def release(self) -> None:
        """Delete everything."""
        self._gpu.discard(self.listed, self.counts)


class ViewSource:
    """The samples of a pose's range views, `samples`."""

    parts: Mapping[str, str] = {"source": "pyramidal/of_views.glsl"}
    is_made = True

    def __init__(
        self, pose: GpuPose, surface: Surface, params: Any, values: Any, normals: bool = False
    ) -> None:
        """params: of the backend. values: what shaders read in `<params>`. normals: whether pixels are to
        have them whatever the look."""
        self.params = values
        self.is_closed = params.primitive == "polygons"
        self._blend = MODES.index(params.blend) if len(pose.views) > 1 else 0
        self._pose, self._params, self._view, self._lit = pose, params, surface.view, normals
        self.samples = pose.samples
        self.count = self.samples.count
        self._tiles = surface.cached(DrawnTiles)
        self._tiles.reserve(self.samples.tile_count + _SPARE, len(pose.views))
        self._texels: dict[str, gl.BufferTexture] = {}
        self.samples.reduce(params.reduction)

    def defines(self, channels: Sequence[str]) -> dict[str, object]:
        params = self._params
        return {
            **self.samples.defines,
            "POLYGONS": int(params.primitive == "polygons"),
            "FRAMED": int(params.primitive == "points"),
            "CULL_BACK": int(params.cull_back),
            "BLEND": self._blend,
            "LOD": int(params.lod),
            "FADE": int(params.lod and params.fade),
            "SKIP": int(params.skip),
            **{name.upper(): int(name in channels) for name in ("color", "normal", "value")},
        }

    def channels(self, surface: Surface) -> list[str]:
        found = ["color"] if self.samples.has_color else []
        if lit := self._lit or is_lit(surface.look):
            found.append("normal")
        if lit or self._blend:
            self._texels["normal"] = self.samples.normals(self._tiles.listed)
        if (values := surface.row_values) is not None:
            found.append("value")
            self._texels["value"] = values
        return found

    def visits(self, surface: Surface, share: float) -> Visits:
        """List the tiles that the picture needs: the visits of their samples."""
        gpu, tiles, defines = self._pose.gpu, self._tiles, self.defines([])
        program = gpu.compute("pyramidal/views/tiles.comp", {**defines, **_causes()}, params=self.params)
        with gpu.timers.measure("tiles"):
            surface.gpu.clear(tiles.counts, 0)
            tiles.listed.clear()
            tiles.listed.bind()
            tiles.counts.bind_to_storage_buffer(Storage.TILE_COUNTS)
            self.bind()
            gpu.set(program, capacity=tiles.listed.capacity)
            gpu.dispatch(program, self.samples.tile_count)
        surface.show_samples()
        surface.stats.counted["tiles"] = tiles.read

        def bind(_: Program) -> None:
            self.bind()
            tiles.listed.texels.bind(Texture.DRAWN_ROWS)

        cells = f"pyramidal/views/{self._params.primitive}.glsl"
        return Visits(cells, 0, bind, {**defines, "SUMS": 0}, self.params, tiles.listed)

    def bind(self) -> None:
        self.samples.bind(self._view)
        for name, unit in (("normal", Texture.RANGE_NORMALS), ("value", Texture.VALUES)):
            if name in self._texels:
                self._texels[name].bind(unit)


def _causes() -> dict[str, object]:
    numbers = {f"TILES_{name.upper()}": f"{number}u" for number, name in enumerate(COUNTS)}
    return {**numbers, "TILES_CAUSES": f"{len(COUNTS)}u"}

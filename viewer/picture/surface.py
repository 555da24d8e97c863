"""The Surface: what each pixel sees. Every backend writes one; everything else reads it."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import moderngl
import numpy as np
from numpy.typing import NDArray

from ..geometry import up_vector
from ..gpu.arrays import as_float32
from ..gpu.constants import EMPTY, NOTHING
from ..gpu.context import Gpu
from ..look import Look, rgba
from ..scan.points import PointCloud
from ..scan.rays import Ray
from ..srgb import linear_from_bytes
from .counts import count_points
from .target import RenderTarget

_AROUND = 3, 64  # pixels, at least and at most, in which samples of range views are looked for


class Texel(NamedTuple):
    """One pixel of a Surface, as its properties of the same names have it; depth: in terms of its view."""

    depth: float
    row: int
    level: int


class Surface(RenderTarget):
    """A picture's pixels as readers have them; properties copy them to the CPU. shown: the size, pixels, of
    the whole picture where it is drawn at less and each pixel shown on several: `image` and `arrays` have it,
    all else is of the pixels that were drawn. shaded_by: what shaded it last, None before."""

    def __init__(self, gpu: Gpu, size: tuple[int, int], shown: tuple[int, int] | None = None) -> None:
        super().__init__(gpu, size)
        self.shown = shown or size
        self.shaded_by: Callable[[Surface, Look], None] | None = None

    @property
    def depth(self) -> NDArray[np.floating]:
        """(H, W), scan units from the eye along the view axis; +inf where nothing is. float32; float64 where
        the view counts its depths from another base (see `View`)."""
        depths, base = self._read(self.depths.buffer, np.float32), self.view.base
        return depths.astype(np.float64) + base if base else depths

    @property
    def row(self) -> NDArray[np.uint32]:
        """(H, W) uint32, the point's row in the cloud's arrays, or the sample's number; 0xFFFFFFFF where
        none."""
        return self._read(self.rows.buffer, np.uint32)

    @property
    def id(self) -> NDArray[np.uint32]:
        """(H, W) uint32, the point's index in the file; 0xFFFFFFFF where none."""
        ids = self.kind.of("ids")
        return self.row if ids is None else self._fetch(ids, np.uint32(NOTHING))

    @property
    def octant(self) -> NDArray[np.uint32] | None:
        """(H, W) uint32, the number of the octant, breadth-first; 0xFFFFFFFF where none. None where points
        are drawn."""
        octants = self.kind.octants
        return None if octants is None else self._fetch(octants.__getitem__, np.uint32(NOTHING))

    @property
    def color(self) -> NDArray[np.float32]:
        """(H, W, 3) float32, linear; the look's plain colour where the scan has none; 0 where nothing is."""
        if self.is_own("color"):
            rgb = self._read_texels("color", np.uint8)[..., :3]
        else:
            rgb = self._fetch(self.kind.of("colors"), np.array(rgba(self.look.plain), np.uint8))[..., :3]
        return _LINEAR[np.where(self._covered[..., None], rgb, np.uint8(0))]

    @property
    def normal(self) -> NDArray[np.float32]:
        """(H, W, 3) float32, world space, unit length; 0 where unknown."""
        if self.is_own("normal") or self.kind.fetches("normal"):
            written = self._read_texels("normal", np.float32)
            fetched = np.where(self._covered[..., None], written, np.float32(0))
        else:
            fetched = self._fetch(self.kind.of("normals"), np.zeros(3, np.float32))
        length = np.linalg.norm(fetched, axis=2, keepdims=True)
        usable = np.isfinite(length) & (length > 0)
        along_pose = np.where(usable, fetched / np.where(usable, length, 1), 0).astype(np.float32)
        return self.layers.world_from_pose.directions(along_pose)

    @property
    def coverage(self) -> NDArray[np.float32]:
        """(H, W) float32, 0..1 of the pixel: the alpha of the backend's own colours where it wrote them."""
        covered = self._covered.astype(np.float32)
        if self.is_own("color"):
            covered *= self._read_texels("color", np.uint8)[..., 3] / np.float32(255)
        return covered

    @property
    def level(self) -> NDArray[np.uint8]:
        """(H, W) uint8: 0 measured, n filled from level n, 255 nothing. Without a row nothing was measured:
        where the backend tells no level, such a pixel counts as filled from level 1. Levels above 254 count
        as that."""
        written = self._read(self._own["level"].buffer, np.uint32) if self.is_own("level") else 0
        return _levels(self.depth, self.row, written)

    def texel(self, x: int, y: int) -> Texel:
        """One pixel, without copying the others. x: from the left, y: from the top."""
        offset = 4 * (y * self.size[0] + x)
        (depth,) = self.gpu.read(self.depths.buffer, np.float32, 1, offset)
        (row,) = self.gpu.read(self.rows.buffer, np.uint32, 1, offset)
        level = np.uint32(0)
        if self.is_own("level"):
            (level,) = self.gpu.read(self._own["level"].buffer, np.uint32, 1, offset)
        return Texel(float(depth), int(row), int(_levels(depth, row, level)))

    def depth_around(self, x: int, y: int, reach: int) -> NDArray[np.float32]:
        """(2 reach + 1, 2 reach + 1) float32: `depth` round pixel (x, y), in terms of its view; +inf
        outside the picture."""
        return self._around(self.depths.buffer, np.float32(np.inf), x, y, reach)

    def points_along(
        self, pixel: NDArray[np.float64], depth: float, reach: float
    ) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
        """The points of the scan round the ray through a place of the picture (2,), before the eye, each
        position once: (n,) their indices in the file, ascending, and (n, 3) positions relative to the view's
        origin.

        depth: what the picture shows there; of range views, only points near that and those that are seen
        around come, so that none are merged. reach: distance from the ray, scan units.
        """
        ray = Ray(self.view.unproject(pixel[None], np.array([depth]))[0], self.view.along(pixel))
        beside = int(np.clip(np.ceil(reach / self.view.footprint(depth)), *_AROUND))
        x, y = pixel.astype(int).tolist()
        ids, points = self.kind.points_along(ray, reach, self.view, partial(self._rows_around, x, y, beside))
        ahead = self.view.depths(points) > self.view.near
        ids, points = ids[ahead], points[ahead]
        once = np.arange(len(points))
        across = np.sort(points[:, 0])
        if (across[1:] == across[:-1]).any():  # else no two are at one position
            once = np.unique(points, axis=0, return_index=True)[1]
        once = once[np.argsort(ids[once])]
        return ids[once], points[once]

    def _rows_around(self, x: int, y: int, reach: int) -> NDArray[np.intp]:
        """The rows that pixels round one show, each once."""
        rows = np.unique(self._around(self.rows.buffer, np.uint32(NOTHING), x, y, reach))
        return rows[rows != NOTHING].astype(np.intp)

    def _around(self, buffer: moderngl.Buffer, empty: np.generic, x: int, y: int, reach: int) -> NDArray:
        """Words of the pixels round one, in one read; `empty` outside the picture."""
        width, height = self.size
        top, bottom = max(y - reach, 0), min(y + reach + 1, height)
        lines = self.gpu.read(buffer, empty.dtype, width * (bottom - top), 4 * width * top)
        left, right = max(x - reach, 0), min(x + reach + 1, width)
        around = np.full((2 * reach + 1, 2 * reach + 1), empty)
        rows, columns = slice(top - y + reach, bottom - y + reach), slice(left - x + reach, right - x + reach)
        around[rows, columns] = lines.reshape(-1, width)[:, left:right]
        return around

    @property
    def value(self) -> NDArray[np.float32]:
        """(H, W) float32, the number that the look colours by; NaN where there is none."""
        source, unknown = self.value_source, np.float32(np.nan)
        if source is not None and self.is_own("value"):
            written = np.where(self._covered, self._read(self._own["value"].buffer, np.float32), unknown)
            return as_float32(written.astype(np.float64), -self.value_zero)
        if source == "depth":
            return np.where(self._covered, self.depth, unknown)
        if source is None:
            return self._fetch(None, unknown)
        if source in self.finds:
            return np.where(self._covered, self._read_texels("value", np.float32)[..., 0], unknown)
        return self._fetch(lambda rows: as_float32(self._values_of(source, rows)), unknown)

    @property
    def averaged(self) -> NDArray[np.uint8] | None:
        """(H, W) uint8, how many frames the point is the mean of that each pixel shows; 0 where there is no
        point. None where no frames are averaged."""
        if self.scanned.pose.average is None:
            return None
        return self._fetch(self.kind.frames, np.uint8(0))  # type: ignore[arg-type]

    def image(self, look: Look | None = None) -> NDArray[np.uint8]:
        """The shaded picture, (H, W, 4) uint8 sRGB and alpha; look: another than was drawn with."""
        if look is not None and look != self.look:
            if self.shaded_by is None:
                raise RuntimeError("this surface has no colours yet: call shade before you read them")
            self.gpu.activate()
            self.shaded_by(self, look)
        words = self.enlarged(self._read(self.picture, np.uint32))
        return words.view(np.uint8).reshape(*self.shown[::-1], 4)

    def arrays(self) -> dict[str, NDArray]:
        """All channels by name, as `.npz` files hold them; "octant" where octants are drawn, "averaged" where
        frames are averaged."""
        names = ("color", "normal", "depth", "coverage", "value", "id", "level", "octant", "averaged")
        channels = {name: channel for name in names if (channel := getattr(self, name)) is not None}
        return {name: self.enlarged(channel) for name, channel in channels.items()}

    def enlarged(self, channel: NDArray) -> NDArray:
        """Values of the pixels that were drawn, (H, W, ...), for each of the whole picture: those of the
        pixel in which its middle lies."""
        if self.shown == self.size:
            return channel
        columns, rows = (
            (np.arange(many) * 2 + 1) * few // (2 * many)
            for few, many in zip(self.size, self.shown, strict=True)
        )
        return channel.take(columns, axis=1).take(rows, axis=0)

    def point_counts(self) -> dict[str, int]:
        """Counts of what became of the points of the file; see `count_points`."""
        return self.counting()()

    def counting(self) -> Callable[[], dict[str, int]]:
        """A function that gives `point_counts` of what is drawn now, on any thread."""
        stats = self.stats
        return partial(count_points, self.kind.counted(), self.view, self.row, stats.share, stats.faces_away)

    def found_at(self, row: int) -> dict[str, float]:
        """The number of a row, by name, that the backend gave; empty where it gave none."""
        if self._given is None:
            return {}
        name, texels = self._given
        return {name: float(self.gpu.read(texels.buffer, np.float32, 1, 4 * row)[0])}

    @property
    def scan(self) -> PointCloud:
        """The points of `scanned`, which this merges; see `point_of`."""
        return self.scanned.stored

    def point_of(self, row: int) -> int:
        """The row in `scan` of the point that a row of the surface stands for."""
        return self.kind.point(row)

    def point_at(self, row: int, least: int = 1) -> tuple[PointCloud, int]:
        """A cloud that has the point which a row stands for, and the row of the point there. It has at least
        so many of the nearest points: it is `scan`, or of range views what pixels around see."""
        return self.kind.cloud_with(row, least)

    # --- inside -----------------------------------------------------------------------

    def _read(self, buffer: moderngl.Buffer, dtype: type) -> NDArray:
        return self.gpu.read(buffer, dtype).reshape(self.size[1], -1)

    def _read_texels(self, name: str, dtype: type) -> NDArray:
        """Read what the backend wrote for each pixel, or else what the rows have, (H, W, channels)."""
        if self.is_own(name):
            texels = self._own[name]
        else:
            texels = self._texels(name)
            self._resolve(name, texels)
        read = self._read(texels.buffer, dtype).reshape(*self.size[::-1], -1)
        if not self.is_own(name):
            self.gpu.discard(texels)
        return read

    @property
    def _covered(self) -> NDArray[np.bool_]:
        """(H, W), where something is seen."""
        return np.isfinite(self.depth)

    def _values_of(self, source: str, rows: NDArray) -> NDArray:
        """Numbers of rows (n,): heights along the look's up, of a layer, or a scalar of the scan."""
        if source in self.layers.scalars:
            return self.layers.scalars[source][self.kind.points(rows)]
        find = self.kind.of("positions" if source == "height" else f"scalar:{source}")
        assert find is not None
        if source != "height":
            return find(rows)
        return self.layers.world_from_pose.points(find(rows) + self.pose.pose.origin) @ up_vector(
            self.look.up
        )

    def _fetch(self, find: Callable[[NDArray], NDArray] | None, unknown: NDArray | np.generic) -> NDArray:
        """Values of each pixel's row, as `find` gives them of some rows; `unknown` where there is no row, or
        where there are none to find."""
        rows = self.row
        out = np.full((*rows.shape, *unknown.shape), unknown)
        if find is not None:
            found = rows != NOTHING
            out[found] = find(rows[found])
        return out


def _levels(depths: Any, rows: Any, written: Any) -> NDArray[np.uint8]:
    """The levels of pixels, of any one shape, by what the Surface holds of them."""
    levels = np.clip(written, rows == NOTHING, EMPTY - 1)
    return np.where(np.isfinite(depths), levels, EMPTY).astype(np.uint8)


_LINEAR = linear_from_bytes(np.arange(256, dtype=np.uint8)).astype(np.float32)

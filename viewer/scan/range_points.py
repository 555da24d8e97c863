"""The points of range views, which are merged when something asks for them and not before."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .colors import srgb8
from .points import PointCloud, stride
from .range_view import RangeView, merge, merge_some
from .spacing import ENOUGH, PLANE, plane_residual, spacing_at

_WINDOW = 8  # pixels around a position that are searched first
_ROUGH = 8  # pixels that a calibration beside measured x and y may be off
_BENT = 2.0  # by which a lens enlarges what lies round a pixel, at most
_FAR = 1e8  # pixels
_PART = 1 << 20  # samples looked at together
_PLACES = 32  # where the spacing is looked at


@dataclass(eq=False)
class RangePoints:
    """The points that range views see.

    overview: some thousands of them, spread evenly, with the origin and the attributes that all have: what is
    known without merging. count: the valid pixels; each is a point unless float32 cannot hold its position.
    """

    views: tuple[RangeView, ...]
    overview: PointCloud
    count: int
    _merge: Callable[[], PointCloud]
    _merged: PointCloud | None = None
    _lock: threading.Lock = field(default_factory=threading.Lock, repr=False)

    @classmethod
    def of(cls, views: tuple[RangeView, ...]) -> RangePoints:
        """The points of these views. Raises InputError where no view sees a point."""
        overview, count = _overview(views)
        return cls(views, overview, count, partial(merge, views, origin=overview.origin))

    @property
    def cloud(self) -> PointCloud:
        """All points as `merge` gives them: merged once, on the thread that asks first."""
        if self._merged is None:
            with self._lock:
                if self._merged is None:
                    self._merged = self._merge()
        return self._merged

    @property
    def is_merged(self) -> bool:
        """Whether `cloud` is there."""
        return self._merged is not None

    @property
    def nbytes(self) -> int:
        """Bytes held by all arrays; those of the cloud once it is there."""
        merged = self._merged
        held = self.overview.nbytes + sum(view.nbytes for view in self.views)
        return held if merged is None else held + merged.nbytes

    # --- by samples -------------------------------------------------------------------
    # A sample is a pixel of a view. They are numbered in view order and then in row order, whether they see a
    # point or not; these numbers are the ids of the points.

    @cached_property
    def firsts(self) -> NDArray[np.int64]:
        """Number of the first sample of each view, and of all samples, (views + 1,)."""
        return np.cumsum([0, *(view.depth.size for view in self.views)])

    def of_samples(self, name: str, samples: NDArray[np.integer]) -> NDArray:
        """Values (N, ...) of samples (N,) that see a point: `positions`, relative to the origin, `colors`, or
        a scalar that the `overview` has."""
        values = (
            getattr(self.overview, name) if name in ("positions", "colors") else self.overview.scalars[name]
        )
        found = np.zeros((len(samples), *values.shape[1:]), values.dtype)
        numbers = np.searchsorted(self.firsts, samples, side="right") - 1
        for number in np.unique(numbers):
            view, inside = self.views[number], numbers == number
            row, column = np.divmod(samples[inside] - self.firsts[number], view.depth.shape[1])
            if name == "positions":
                found[inside] = view.unproject(row, column) - self.overview.origin
            elif name == "colors":
                assert view.color is not None
                found[inside, :3], found[inside, 3] = srgb8(view.color[row, column]), 255
            else:
                found[inside] = number if name == "view" else getattr(view, name)[row, column]
        return found

    def all_samples(self, name: str) -> NDArray:
        """A scalar that the `overview` has, of all samples, (S,)."""
        if name == "view":
            return np.repeat(np.arange(len(self.views), dtype=np.uint16), np.diff(self.firsts))
        return np.concatenate([getattr(view, name).ravel() for view in self.views])

    def by_sample(self, values: NDArray[np.float32]) -> NDArray[np.float32]:
        """Numbers of the points of `cloud`, (N,), put at their samples, (S,); NaN at the others."""
        spread = np.full(self.firsts[-1], np.nan, np.float32)
        spread[self.cloud.ids] = values
        return spread

    def parts(self) -> Iterator[tuple[NDArray[np.int64], NDArray[np.float32]]]:
        """Samples that see a point, a part of them at a time: numbers (n,), positions (n, 3) relative to the
        origin."""
        for first, view in zip(self.firsts[:-1], self.views, strict=True):
            rows, width = max(1, _PART // view.depth.shape[1]), view.depth.shape[1]
            for top in range(0, len(view.depth), rows):
                band = view.cropped(slice(top, top + rows), slice(None))
                offsets = band.positions() - self.overview.origin
                yield np.flatnonzero(band.valid()) + (first + top * width), offsets.astype(np.float32)

    def row_of(self, sample: int) -> int:
        """The row in `cloud` of a sample that sees a point. Counts pixels where points are not merged."""
        if self._merged is not None and (row := self._merged.row_of(sample)) is not None:
            return row
        number = int(np.searchsorted(self.firsts, sample, side="right")) - 1
        within, view = sample - int(self.firsts[number]), self.views[number]
        begun = view.cropped(slice(within // view.depth.shape[1] + 1), slice(None))
        before = [*(earlier.valid() for earlier in self.views[:number]), begun.valid().ravel()[:within]]
        return int(sum(np.count_nonzero(pixels) for pixels in before))

    def around(self, position: NDArray[np.float64], least: int = 1) -> PointCloud:
        """Some of the points: all that are near a position, (3,) in scan units, and at least so many of them
        if there are."""
        reach, origin = _WINDOW, self.overview.origin
        while True:
            windows = [_window(view, position, reach) for view in self.views]
            both = list(zip(self.views, windows, strict=True))
            crops = [view.cropped(window.rows, window.columns) for view, window in both]
            sure, reach = min(window.sure for window in windows), 2 * reach
            if not any(crop.valid().any() for crop in crops):
                continue
            cloud = merge(crops, origin=origin)
            near = np.linalg.norm(cloud.positions + (origin - position), axis=1) < sure
            if math.isinf(sure) or np.count_nonzero(near) >= least:
                break
        numbers = [
            first + window.numbers(view.depth.shape[1])
            for first, (view, window) in zip(self.firsts[:-1], both, strict=True)
        ]
        return replace(cloud, ids=np.concatenate(numbers)[cloud.ids].astype(np.uint32))

    @cached_property
    def spacing(self) -> float:
        """The typical distance between neighbours, scan units, as `typical_spacing` has it; found without
        merging."""
        ids = self.overview.ids
        assert ids is not None
        found = []
        for row in np.linspace(0, len(ids) - 1, _PLACES).astype(int):
            cloud = self.around(self.overview.positions[row] + self.overview.origin, ENOUGH)
            if (at := cloud.row_of(int(ids[row]))) is not None and (
                apart := spacing_at(cloud, at)
            ) is not None:
                found.append(apart)
        return float(np.median(found)) if found else 1.0

    @cached_property
    def roughness(self) -> float:
        """How far points lie off the planes through their neighbours, scan units, as `spacing.roughness` has
        it; found without merging."""
        overview, found = self.overview, []
        for row in np.linspace(0, len(overview) - 1, _PLACES).astype(int):
            position = overview.positions[row] + overview.origin
            near = self.around(position, PLANE)
            away = np.linalg.norm(near.positions + (near.origin - position), axis=1)
            found.append(plane_residual(near.positions[np.argsort(away)[:PLANE]]))
        return float(np.median(found))

    # --- others made of them ----------------------------------------------------------

    def with_cloud(self, cloud: PointCloud) -> RangePoints:
        """Put a cloud that has more attributes of the same points in place of `cloud`."""
        return RangePoints(self.views, self.overview, self.count, self._merge, cloud)

    def moved(self, views: tuple[RangeView, ...], by: NDArray[np.float64]) -> RangePoints:
        """Move the origin, from which the offsets of the points stay. views: those moved likewise.

        by: (3,) scan units.
        """
        overview = self.overview.moved(by)
        return RangePoints(views, overview, self.count, partial(_merged_and_moved, self, by))

    def __getstate__(self) -> dict[str, Any]:
        """All that another process needs: not the lock, nor what is merged already."""
        state = {name: value for name, value in self.__dict__.items() if name != "_lock"}
        return state | {"_merge": None} if self.is_merged else state

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__ |= {**state, "_lock": threading.Lock()}


@dataclass(frozen=True)
class _Window:
    """Pixels of a view around a position: rows and columns. sure: all that the view sees nearer to it
    than this, scan units, is in them."""

    rows: slice
    columns: slice
    sure: float

    def numbers(self, width: int) -> NDArray[np.int64]:
        """Numbers of the pixels in row order, in a view so wide."""
        rows, columns = (np.arange(part.start, part.stop) for part in (self.rows, self.columns))
        return np.add.outer(rows * width, columns).ravel()


def _window(view: RangeView, position: NDArray[np.float64], reach: int) -> _Window:
    """The pixels up to so many away from the one that sees a position, (3,), at least one."""
    size, sees = np.array(view.depth.shape[::-1]), view.project(position[None])[0][0]
    is_seen = bool(np.isfinite(sees).all())
    at = np.floor(np.clip(sees, -_FAR, _FAR)) if is_seen else size // 2
    (left, top), (right, bottom) = (
        np.clip(edge, 0, size).astype(int).tolist() for edge in (at - reach, at + reach + 1)
    )
    left, top = min(left, max(right - 1, 0)), min(top, max(bottom - 1, 0))
    rows, columns = slice(top, max(bottom, top + 1)), slice(left, max(right, left + 1))
    if (rows.stop - rows.start, columns.stop - columns.start) == view.depth.shape:
        return _Window(rows, columns, math.inf)
    x, y, z = view.world_to_camera[:3, :3] @ position + view.world_to_camera[:3, 3]
    if not is_seen:
        return _Window(rows, columns, max(float(z), 0.0))  # how far it is behind all that the pod sees
    outside = float(np.maximum(-at, at - size + 1).max())
    pixels = max(max(reach, outside) - 1 - (_ROUGH if view.xy is not None else 0), 0)
    focal = max(view.fx, view.fy) * (_BENT if view.distortion else 1.0)
    if view.kind == "height":
        return _Window(rows, columns, pixels / focal)
    # A ball of this radius is seen within so many pixels at most.
    oblique = math.sqrt(x * x + y * y + z * z) / -z
    return _Window(rows, columns, pixels * -z / (focal * oblique + pixels))


def _overview(views: Sequence[RangeView]) -> tuple[PointCloud, int]:
    """The points of valid pixels of an even stride, and the number of all.

    It is the stride at which clouds are looked at, so that what is found by either is the same.
    """
    seen = [np.flatnonzero(view.valid()) for view in views]
    count = sum(map(len, seen))
    step, first, some = stride(count), 0, []
    for pixels in seen:
        some.append(pixels[first::step])
        first = (first - len(pixels)) % step
    return merge_some(views, some), count


def _merged_and_moved(points: RangePoints, by: NDArray[np.float64]) -> PointCloud:
    return points.cloud.moved(by)

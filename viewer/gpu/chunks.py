"""Chunks: runs of a pose's points in boxes, so that none is looked at that a picture cannot show.

Scanners write points that are near each other one after another, so runs of a file are small boxes. Where
they are not, the points are put into a coarse order beside the drawing, once the pose is drawn again with a
part of it out of view; until then all are looked at. Pictures are the same to the bit either way.
"""

from __future__ import annotations

from concurrent.futures import Future
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..scan.points import PointCloud
from ..task import Task, in_background
from ..view import View
from .pose import GpuPose

CHUNK = 1 << 10  # points
LEAST = 1 << 18  # points of a pose, below which looking at all of them takes next to no time
_MOST = 0.5  # share of the points from which on all are looked at, as that needs no list
_SCATTERED = 0.5  # mean size of the boxes, in that of the pose, from which on an order is of no use
_SLACK = 1.0  # pixels beyond the edges, for what float32 rounds
_ROUNDING = 1e-5  # of the pose's size, by which boxes are larger for the same reason
_PART = 1 << 18  # points that are worked on at a time, so that they stay near the processor
_LEVEL = 5  # of the cells that are put in order: 32 along each axis
_THIRDS = [sum((i >> bit & 1) << 3 * bit for bit in range(_LEVEL)) for i in range(1 << _LEVEL)]
_DIGITS = np.array(_THIRDS, np.uint16)  # the bits of a number, two zeros between each and the next


@dataclass(frozen=True, eq=False)
class Ordered:
    """An order of points, and the boxes of its chunks. rows: (N,), None for that of the file. low, high:
    (C, 3) float32 corners relative to the cloud's origin."""

    rows: NDArray[np.uint32] | None
    low: NDArray[np.float32]
    high: NDArray[np.float32]

    @cached_property
    def is_scattered(self) -> bool:
        """Whether chunks are about as large as the whole."""
        whole = np.linalg.norm(self.high.max(axis=0) - self.low.min(axis=0))
        return bool(np.linalg.norm(self.high - self.low, axis=1).mean() > _SCATTERED * whole)

    def rows_of(self, chunks: NDArray[np.intp], count: int) -> NDArray[np.uint32]:
        """The rows of some chunks of `count` points, ascending."""
        if self.rows is None:
            rows = (chunks[:, None] * CHUNK + np.arange(CHUNK)).astype(np.uint32).ravel()
            return rows[: np.searchsorted(rows, count)]
        listed = np.zeros(count, bool)
        for chunk in chunks:
            listed[self.rows[chunk * CHUNK : (chunk + 1) * CHUNK]] = True
        return np.flatnonzero(listed).astype(np.uint32)


def in_file_order(cloud: PointCloud) -> Ordered:
    """The points as they are."""
    return Ordered(None, *_boxes(cloud.positions))


def in_coarse_order(cloud: PointCloud) -> Ordered:
    """The points by the cells of a grid of 32 along each axis, along a Morton curve; those of one cell as in
    the file."""
    positions = cloud.positions
    lows, highs = _boxes(positions)
    low, high = lows.min(axis=0), highs.max(axis=0)
    steps = np.float32(1 << _LEVEL) / np.maximum(high - low, np.finfo(np.float32).tiny)
    codes = np.empty(len(positions), np.uint16)
    for start in range(0, len(positions), _PART):
        part = slice(start, start + _PART)
        cells = np.minimum((positions[part] - low) * steps, (1 << _LEVEL) - 1).astype(np.uint8)
        x, y, z = (_DIGITS[column] for column in cells.T)
        codes[part] = x | y << 1 | z << 2
    rows = np.argsort(codes, kind="stable").astype(np.uint32)  # of 16 bits: by their digits, in linear time
    return Ordered(rows, *_boxes(positions.take(rows, axis=0)))


def _boxes(positions: NDArray[np.float32]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    starts = np.arange(0, len(positions), CHUNK)
    return np.minimum.reduceat(positions, starts, axis=0), np.maximum.reduceat(positions, starts, axis=0)


class Chunks:
    """The chunks of a pose that is drawn."""

    nbytes = 0

    def __init__(self, pose: GpuPose) -> None:
        self._pose = pose
        self._order: Ordered | None = None
        self._coarse: Future[Ordered] | None = None
        self._found: tuple[object, NDArray[np.uint32] | None] = None, None

    def rows_in(self, view: View, margin: float, reach: float = 0.0) -> NDArray[np.uint32] | None:
        """The rows, ascending, of the chunks that a view may show; None for all.

        margin, reach: how many pixels, and scan units, beyond the picture a point may be that shows.
        """
        pose = self._pose
        cloud = pose.cloud
        if len(cloud) < LEAST or view.holds(pose.bounds.corners() - view.origin):
            return None
        order = self._known_order(cloud)
        found_for = (order, view.key, margin, reach)
        if self._found[0] != found_for:
            shown = self.shown_in(order, view, margin, reach)
            few = len(shown) <= _MOST * len(order.low)
            self._found = found_for, order.rows_of(shown, len(cloud)) if few else None
        return self._found[1]

    def shown_in(self, order: Ordered, view: View, margin: float, reach: float = 0.0) -> NDArray[np.intp]:
        """The chunks, (C,) ascending, that a view may show. margin, reach: as above."""
        pose = self._pose
        moved = pose.cloud.origin - view.origin
        reach += _ROUNDING * pose.bounds.radius
        low, high = order.low + (moved - reach), order.high + (moved + reach)
        return np.flatnonzero(view.may_show(low, high, margin + _SLACK))

    @property
    def order(self) -> Ordered | None:
        """An order of the points in which chunks are small beside the pose; None where there are few points,
        or it is not known yet."""
        if len(self._pose.cloud) < LEAST:
            return None
        order = self._known_order(self._pose.cloud)
        return None if order.is_scattered else order

    def _known_order(self, cloud: PointCloud) -> Ordered:
        if self._order is None:
            self._order = in_file_order(cloud)
        elif self._coarse is not None:
            if self._coarse.done():
                self._order, self._coarse = self._coarse.result(), None
        elif self._order.rows is None and self._order.is_scattered:
            self._coarse = in_background(Task("Ordering points"), lambda: in_coarse_order(cloud))
        return self._order

    def release(self) -> None:
        """Nothing is on the GPU."""

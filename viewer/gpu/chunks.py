"""Chunks: runs of a pose's points in boxes, so that none is looked at that a picture cannot show.

Scanners write points that are near each other one after another, so runs of a file are small boxes. Where
they are not, the points are put into a coarse order beside the drawing, once the pose is drawn again with a
part of it out of view; until then all are looked at. Pictures are the same to the bit either way.
"""

from __future__ import annotations

import weakref
from concurrent.futures import Future
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..scan.points import PointCloud
from ..scan.rays import Ray
from ..task import Task, checkpoint, in_background
from ..view import View
from .context import Gpu
from .pose import GpuPose

_CHUNKS = 1 << 14  # about as many as a pose has: fewer hide less, more take longer to test
_CHUNK = 1 << 6  # points at least
LEAST = 1 << 18  # points of a pose, below which looking at all of them takes next to no time
_ON_CARDS = 16  # times as many on graphics cards: they look at all points sooner than Python lists chunks
MOST = 0.5  # share of the points from which on all are looked at, as that needs no list
_FEW = 0.1  # the same of points near a ray, which are fetched one by one
# Mean size of the boxes, in that of the pose: from where on another order is worth a second of a thread,
# and from where on an order is of no use.
_LOOSE, _SCATTERED = 0.15, 0.5
_SLACK = 1.0  # pixels beyond the edges, for what float32 rounds
_ROUNDING = 1e-5  # of the pose's size, by which boxes are larger for the same reason
_PART = 1 << 18  # points that are worked on at a time, so that they stay near the processor
_LEVEL = 5  # of the cells that are put in order: 32 along each axis
_LEAST_SPAN = np.finfo(np.float32).tiny * (2 << _LEVEL)  # cells per length stay finite
_THIRDS = [sum((i >> bit & 1) << 3 * bit for bit in range(_LEVEL)) for i in range(1 << _LEVEL)]
_DIGITS = np.array(_THIRDS, np.uint16)  # the bits of a number, two zeros between each and the next


@dataclass(frozen=True, eq=False)
class Ordered:
    """An order of points, and the boxes of its chunks. chunk: points of one. rows: (N,), None for that of the
    file. low, high: (C, 3) float32 corners relative to the cloud's origin."""

    chunk: int
    rows: NDArray[np.uint32] | None
    low: NDArray[np.float32]
    high: NDArray[np.float32]

    @cached_property
    def looseness(self) -> float:
        """The mean size of the boxes, in that of all."""
        whole = np.linalg.norm(self.high.max(axis=0) - self.low.min(axis=0))
        return float(np.linalg.norm(self.high - self.low, axis=1).mean() / max(whole, np.finfo(float).tiny))

    @property
    def is_loose(self) -> bool:
        """Whether another order is to be found."""
        return self.rows is None and self.looseness > _LOOSE

    @property
    def is_scattered(self) -> bool:
        """Whether chunks are about as large as the whole."""
        return self.looseness > _SCATTERED

    def rows_of(self, chunks: NDArray[np.intp], count: int) -> NDArray[np.uint32]:
        """The rows of some chunks of `count` points, ascending."""
        if self.rows is None:
            rows = (chunks[:, None] * self.chunk + np.arange(self.chunk)).astype(np.uint32).ravel()
            return rows[: np.searchsorted(rows, count)]
        listed = np.zeros(count, bool)
        for chunk in chunks:
            listed[self.rows[chunk * self.chunk : (chunk + 1) * self.chunk]] = True
        return np.flatnonzero(listed).astype(np.uint32)

    def along(self, ray: Ray, reach: float) -> NDArray[np.intp]:
        """The chunks whose boxes come so near to a ray, (C,) ascending.

        ray: relative to the cloud's origin. reach: scan units.
        """
        low, high = self.low.astype(np.float64), self.high.astype(np.float64)
        radii = np.linalg.norm(high - low, axis=1) / 2
        return np.flatnonzero(ray.away((low + high) / 2) <= radii + reach)

    def numbers(self, size: int) -> NDArray[np.uint32]:
        """The number of the chunk of so many points that each row is in, (N,), where rows are in an order of
        their own."""
        assert self.rows is not None
        numbers = np.empty(len(self.rows), np.uint32)
        numbers[self.rows] = np.arange(len(self.rows), dtype=np.uint32) // np.uint32(size)
        return numbers


def in_file_order(cloud: PointCloud) -> Ordered:
    """The points as they are."""
    chunk = chunk_size(len(cloud))
    return Ordered(chunk, None, *_boxes(cloud.positions, chunk))


def in_coarse_order(cloud: PointCloud) -> Ordered:
    """The points by the cells of a grid of 32 along each axis, along a Morton curve; those of one cell as in
    the file."""
    positions = cloud.positions
    lows, highs = _boxes(positions, _PART)
    low, high = lows.min(axis=0), highs.max(axis=0)
    steps = np.float32(1 << _LEVEL) / np.maximum(high - low, _LEAST_SPAN)  # flat scans have no extent across
    codes = np.empty(len(positions), np.uint16)
    for start in range(0, len(positions), _PART):
        part = slice(start, start + _PART)
        cells = np.minimum((positions[part] - low) * steps, (1 << _LEVEL) - 1).astype(np.uint8)
        x, y, z = (_DIGITS[column] for column in cells.T)
        codes[part] = x | y << 1 | z << 2
    rows = np.argsort(codes, kind="stable").astype(np.uint32)  # of 16 bits: by their digits, in linear time
    chunk = chunk_size(len(cloud))
    return Ordered(chunk, rows, *_boxes(positions, chunk, rows))


def chunk_size(count: int, chunks: int = _CHUNKS, least: int = _CHUNK) -> int:
    """How many of so many points a chunk has, a power of two: about so many chunks, of so many at least."""
    return max(least, 1 << max(count // chunks, 1).bit_length() - 1)


def _boxes(
    positions: NDArray[np.float32], chunk: int, rows: NDArray[np.uint32] | None = None
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Lower and upper corners of each so many points, (C, 3). chunk: a power of two. rows: the order of
    points; None: that of the file.

    `reduceat` would hold the interpreter's lock; reductions of columns take as long, and release it.
    """
    low, high = np.empty((2, -(-len(positions) // chunk), 3), np.float32)
    many = max(_PART, chunk)
    for start in range(0, len(positions), many):
        checkpoint()
        run = slice(start, start + many)
        part = positions[run if rows is None else rows[run]]
        first, end = start // chunk, len(part) // chunk * chunk
        for chunks in (part[:end].reshape(-1, chunk, 3), part[None, end:]):
            if not chunks.size:
                continue
            of = slice(first, first + len(chunks))
            for axis in range(3):
                low[of, axis], high[of, axis] = (
                    reduce(chunks[..., axis], axis=1) for reduce in (np.min, np.max)
                )
            first += len(chunks)
    return low, high


def best_order(cloud: PointCloud) -> Ordered:
    """The order of the file, unless chunks are large in it: then the coarse one."""
    order = in_file_order(cloud)
    if order.is_loose:
        order = in_coarse_order(cloud)
    _ = order.looseness  # now, on the worker's thread
    return order


def least_points(gpu: Gpu) -> int:
    """Points of a pose from which on chunks are of use on a device."""
    return LEAST if gpu.software else _ON_CARDS * LEAST


class Chunks:
    """The chunks of a pose. A worker finds their order, once the pose is drawn a second time."""

    nbytes = 0

    def __init__(self, pose: GpuPose) -> None:
        self._pose = weakref.proxy(pose)  # which keeps this
        self._order: Ordered | None = None
        self._finding: Future[Ordered] | None = None
        self._was_drawn = False
        self._found: tuple[object, NDArray[np.uint32] | None] = None, None

    def rows_in(self, view: View, margin: float, reach: float = 0.0) -> NDArray[np.uint32] | None:
        """The rows, ascending, of the chunks that a view may show; None for all.

        margin, reach: how many pixels, and scan units, beyond the picture a point may be that shows.
        """
        pose = self._pose
        cloud = pose.cloud
        if len(cloud) < least_points(pose.gpu) or view.holds(pose.bounds.corners() - view.origin):
            return None
        if not self._was_drawn:
            self._was_drawn = True  # there may be no second picture
            return None
        order = self._known_order(cloud)
        if order is None:
            return None
        found_for = (order, view.key, margin, reach)
        if self._found[0] != found_for:
            shown = self.shown_in(order, view, margin, reach)
            few = len(shown) <= MOST * len(order.low)
            self._found = found_for, order.rows_of(shown, len(cloud)) if few else None
        return self._found[1]

    def shown_in(self, order: Ordered, view: View, margin: float, reach: float = 0.0) -> NDArray[np.intp]:
        """The chunks, (C,) ascending, that a view may show. margin, reach: as above."""
        pose = self._pose
        moved = pose.cloud.origin - view.origin
        reach += _ROUNDING * pose.bounds.radius
        low, high = order.low + (moved - reach), order.high + (moved + reach)
        whole = low.min(axis=0, keepdims=True), high.max(axis=0, keepdims=True)
        if not view.may_show(*whole, margin + _SLACK).any():
            return np.empty(0, np.intp)
        return np.flatnonzero(view.may_show(low, high, margin + _SLACK))

    def rows_along(self, ray: Ray, reach: float) -> NDArray[np.uint32] | None:
        """The rows, in any order, of the chunks that come so near to a ray; None for all.

        ray: relative to the cloud's origin.
        """
        cloud = self._pose.stored
        if len(cloud) < LEAST:
            return None
        order = self._known_order(cloud)
        if order is None or order.is_scattered:
            return None
        near = order.along(ray, reach)
        if len(near) > _FEW * len(order.low):
            return None
        chunks = near[:, None] * order.chunk + np.arange(order.chunk)
        places = chunks[chunks < len(cloud)]
        return places.astype(np.uint32) if order.rows is None else order.rows[places]

    def take_order(self) -> Ordered | None:
        """The order that points stay in from now on, if chunks are small in it; None where there are few
        points, or it is not known yet, which each call brings nearer."""
        if len(self._pose.cloud) < least_points(self._pose.gpu):
            return None
        order = self._known_order(self._pose.cloud)
        return None if order is None or order.is_scattered else order

    @property
    def known(self) -> Ordered:
        """The order that is known."""
        assert self._order is not None, "call take_order first"
        return self._order

    def _known_order(self, cloud: PointCloud) -> Ordered | None:
        """The order; None while a worker looks for it, which the first call begins."""
        if self._order is None and self._finding is None:
            self._finding = in_background(Task("Ordering points"), lambda: best_order(cloud))
        if self._finding is not None and self._finding.done():
            self._order, self._finding = self._finding.result(), None
        return self._order

    def release(self) -> None:
        """Nothing is on the GPU."""

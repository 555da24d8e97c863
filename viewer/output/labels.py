"""Where labels stand over a picture: off the subject and off each other, joined to their lines by leaders.

The window, saved pictures and films share this. Lengths are pixels of the picture, from its upper left
corner.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import TYPE_CHECKING, TypeVar

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from ..picture.surface import Surface

Box = tuple[float, float, float, float]  # left, top, right, bottom
Spot = tuple[float, float]  # to the right, down
T = TypeVar("T")

_ROWS = 48  # of the cells that tell where the subject is
_LEAST_COVERED = 0.1  # of a cell, so that a few stray points are no subject
_SAMPLED = 4  # rows of squares of the surface that tell of a cell
_MOST_ROWS = 64  # of places that are tried
_JUDGED = 48  # places whose leaders are looked at, those that cost least without
_SHARES = (0.5, 0.25, 0.75, 0.0, 1.0)  # places on a line that a leader may begin at
_DIGITS = 5  # of a spot, in heights of the picture
_AROUND = 6  # cells about marks that a label on the subject keeps off

# In heights of the text:
_TOP, _SIDE = 2.8, 0.5  # of the picture, left free: for the window's prompt; at the sides and below
_CORNER = 6.6, 8.4  # upper right, the same: for the window's cube
CUBE_ROOM = 14.0  # shorter edge of a view that has that cube; in smaller ones labels take all room
_APART = 0.3  # labels from each other
_LEAST_LEADER = 0.8  # shorter ones are not needed

# What a place costs, in leader length, heights of the text:
_COVERS = 4.0  # a square of the subject
_COVERS_MARK = 12.0  # the same of a landmark or a line, and of the subject beside them
_CROSSES, _CROSSES_LINE = 12.0, 2.0  # a leader another one, or the line of another label
_OVERLAPS = 1e4
_UPRIGHT = 1.5  # how much more an upright leader costs: it looks like a part of a line that is upright
_OTHER_FORM = 3.0  # a form after the first
# How much worse than when it was chosen a place may become before the label leaves it:
_WORSE, _LONGER = 24.0, 6.0


@dataclass(frozen=True, eq=False)
class Callout:
    """A label: a text that belongs to a line. key: what tells it from other labels, also in the next picture.
    sizes: width and height of each of its forms, the best first. line: (N, 2), the places of the line, at
    least one."""

    key: str
    sizes: tuple[tuple[float, float], ...]
    line: NDArray[np.float64]


def forms_of(lines: Sequence[str]) -> list[list[str]]:
    """The forms that a label of lines may have: as it is, and with what stands after a colon on a line of its
    own."""
    name, _, value = lines[0].partition(": ")
    return [list(lines), [name, value.strip()]] if value and len(lines) == 1 else [list(lines)]


@dataclass(frozen=True)
class LabelPlace:
    """The place of a label. form: the number of the one that it has. leader: from its line to its box, None
    where they are near."""

    box: Box
    form: int
    leader: tuple[Spot, Spot] | None


@dataclass(frozen=True)
class LabelSpot:
    """The place of a label, as pictures of any size and text have it. key: as of `Callout`. form: as of
    `LabelPlace`. edge: the middle of the box's side that faces the line, from the middle of the picture, in
    heights of the picture. is_right: whether that is the right side."""

    key: str
    form: int
    edge: Spot
    is_right: bool


@dataclass(frozen=True)
class _Kept:
    """A place that was chosen. cost: of covering. length: of the leader, in heights of the text. cuts: how
    many labels its leader cuts."""

    spot: LabelSpot
    cost: float
    length: float
    cuts: int


@dataclass(frozen=True, eq=False)
class LabelGround:
    """The things that labels keep off.

    size: width and height of the picture. em: the height of the text. covered: (R, C), which cells of the
    picture show the subject, None where that is not known. marks: (N, 2), places of landmarks and of lines.
    taken: boxes of what else lies over the picture. view: equal while the camera is.
    """

    size: tuple[float, float]
    em: float
    covered: NDArray[np.bool_] | None
    marks: NDArray[np.float64]
    taken: Sequence[Box] = ()
    view: object = None


def covered_cells(surface: Surface) -> NDArray[np.bool_]:
    """Find which cells of a picture show the subject, (rows, columns): 48 rows, fewer of a picture that has
    fewer."""
    step = max(1, surface.size[1] // (_ROWS * _SAMPLED))
    seen = np.isfinite(surface.depth)
    for axis, length in enumerate(seen.shape):  # a square that shows one point counts: these may lie apart
        seen = np.logical_or.reduceat(seen, np.arange(0, length, step), axis=axis)
    height, width = seen.shape
    rows = min(_ROWS, height)
    columns = max(1, round(rows * width / height))
    rows_of, columns_of = (np.arange(n) * cells // n for n, cells in ((height, rows), (width, columns)))
    cells = (rows_of[:, None] * columns + columns_of).ravel()
    every = np.bincount(cells, minlength=rows * columns)
    shown = np.bincount(cells, seen.ravel(), minlength=rows * columns)
    return (shown > _LEAST_COVERED * every).reshape(rows, columns)


def said_once(labels: Sequence[T], text: Callable[[T], str]) -> list[T]:
    """Leave out labels that only repeat how the one of a value begins: "Region 1" beside "Region 1, area:
    939 mm2". text: of a label."""
    heads = {head for head, _, rest in (text(one).partition(", ") for one in labels) if ": " in rest}
    return [one for one in labels if text(one) not in heads]


def free_names(
    texts: Sequence[str],
    corners: NDArray[np.float64],
    height: float,
    width: Callable[[str], float],
    marks: NDArray[np.float64],
) -> list[int]:
    """Find which texts cover no text before them, and no mark. corners: (N, 2), their upper left ones.
    height: of a line. width: gives that of a text. marks: (M, 2), places."""
    free, taken = [], set[tuple[int, int]]()  # cells as high as a line, and half as wide
    in_cells: dict[tuple[int, int], list[Spot]] = {}
    for x, y in marks.tolist():
        in_cells.setdefault((math.floor(y / height), math.floor(2 * x / height)), []).append((x, y))
    for number, (text, (left, top)) in enumerate(zip(texts, corners.tolist(), strict=True)):
        row, column = math.floor(top / height), math.floor(2 * left / height)
        if not text or (row, column) in taken or (row + 1, column) in taken:
            continue
        columns = range(column, math.floor(2 * (left + width(text)) / height) + 1)
        cells = {(each, at) for at in columns for each in (row, row + 1)}
        near = (place for cell in cells for place in in_cells.get(cell, ()))
        right, bottom = left + width(text), top + height
        covers_mark = any(left <= x <= right and top <= y <= bottom for x, y in near)
        if not covers_mark and taken.isdisjoint(cells):
            taken |= cells
            free.append(number)
    return free


class LabelPlaces:
    """The places of labels from picture to picture.

    A label stays where it is while it fits there: it does not jump while a scan plays. All are placed anew
    once the camera has come to rest elsewhere.
    """

    def __init__(self) -> None:
        self._kept: dict[str, _Kept] = {}
        self._taken_up: tuple[LabelSpot, ...] = ()
        self._wanted: dict[str, LabelSpot] = {}  # by key, of those taken up and not placed yet
        self._placed_in: object = None  # the view that they were placed in
        self._before: object = None  # the view of the picture before

    @property
    def spots(self) -> tuple[LabelSpot, ...]:
        """The places in the last picture, for other pictures to take up."""
        return tuple(
            replace(kept.spot, edge=(round(kept.spot.edge[0], _DIGITS), round(kept.spot.edge[1], _DIGITS)))
            for kept in self._kept.values()
        )

    def take_up(self, spots: tuple[LabelSpot, ...]) -> None:
        """Have labels stand where they stand in another picture of the same view, or as near as they can."""
        if spots != self._taken_up:
            self._taken_up, self._wanted = spots, {spot.key: spot for spot in spots}
            self._kept.clear()

    def place(self, labels: Sequence[Callout], ground: LabelGround) -> list[LabelPlace]:
        """Find the places of labels in a picture, in their order."""
        keys = _apart([label.key for label in labels])
        if ground.view != self._placed_in and ground.view in (self._before, None):
            self._kept.clear()
        if not self._kept:
            self._placed_in = ground.view
        self._before = ground.view
        self._kept = {key: self._kept[key] for key in keys if key in self._kept}
        if not labels:
            return []
        layout = _Layout(labels, ground)
        for number, key in enumerate(keys):
            if key in self._kept:
                layout.keep(number, self._kept[key])
            elif key in self._wanted:
                layout.place_near(number, self._wanted[key])
                self._kept[key] = layout.kept(number, key)
        self._wanted.clear()
        for number in layout.place_others():
            self._kept[keys[number]] = layout.kept(number, keys[number])
        return [layout.place_of(number) for number in range(len(labels))]


class _Layout:
    """One picture's labels while they are being placed. boxes: (K, 4), NaN before they are."""

    def __init__(self, labels: Sequence[Callout], ground: LabelGround) -> None:
        self.labels, self.ground, self.em = labels, ground, ground.em
        width, height = ground.size
        has_cube = min(width, height) >= CUBE_ROOM * self.em
        self.low = np.array([_SIDE, _TOP if has_cube else _SIDE]) * self.em
        self.high = np.array([width - _SIDE * self.em, height - _SIDE * self.em])
        cube = width - _CORNER[0] * self.em, 0.0, width, _CORNER[1] * self.em
        self.taken = np.array([*[cube] * has_cube, *ground.taken], float).reshape(-1, 4)
        self.boxes = np.full((len(labels), 4), np.nan)
        self.forms = [0] * len(labels)
        self.starts = [_starts(label.line) for label in labels]
        self.leaders = np.full((len(labels), 2, 2), np.nan)
        cells = _weights(ground)
        self._cell = np.array(ground.size) / cells.shape[::-1]
        self._sums = np.pad(cells.cumsum(axis=0).cumsum(axis=1), ((1, 0), (1, 0)))

    # --- what places cost -----------------------------------------------------------------

    def covering(self, boxes: NDArray[np.float64]) -> NDArray[np.float64]:
        """The cost of boxes (N, 4) by what they cover, (N,)."""
        rows, columns = self._sums.shape
        left, top = np.floor(boxes[:, 0] / self._cell[0]), np.floor(boxes[:, 1] / self._cell[1])
        right, bottom = np.ceil(boxes[:, 2] / self._cell[0]), np.ceil(boxes[:, 3] / self._cell[1])
        left, right = (np.clip(x, 0, columns - 1).astype(int) for x in (left, right))
        top, bottom = (np.clip(y, 0, rows - 1).astype(int) for y in (top, bottom))
        sums = self._sums
        found = sums[bottom, right] - sums[top, right] - sums[bottom, left] + sums[top, left]
        return np.asarray(found * self._cell.prod() / self.em**2)

    def overlapping(self, boxes: NDArray[np.float64], but: Sequence[int] = ()) -> NDArray[np.float64]:
        """How many labels and other things boxes (N, 4) lie on, (N,). but: labels that do not count."""
        placed = np.isfinite(self.boxes[:, 0])
        placed[list(but)] = False
        gap = _APART * self.em * np.array([-1, -1, 1, 1])
        others = np.concatenate([self.taken, self.boxes[placed] + gap])
        return _meet(boxes, others).sum(axis=1)

    def outside(self, boxes: NDArray[np.float64]) -> NDArray[np.float64]:
        """How far boxes (N, 4) reach beyond the area for labels, in heights of the text, (N,)."""
        return np.asarray(np.maximum(boxes[:, 2:] - self.high, 0).sum(axis=1) / self.em)

    def crossing(self, number: int, leaders: NDArray[np.float64]) -> NDArray[np.float64]:
        """The cost (N,) of leaders (N, 2, 2) of a label by the leaders and lines that they cross."""
        cost = _CROSSES * _cross(leaders, self.leaders[self._placed(number)]).sum(axis=1)
        lines = [label.line for other, label in enumerate(self.labels) if other != number]
        pieces = [line[None, [0, -1]] for line in lines if len(line) > 1]
        if pieces:
            cost += _CROSSES_LINE * _cross(leaders, np.concatenate(pieces)).sum(axis=1)
        return cost

    def cutting(
        self, number: int, leaders: NDArray[np.float64], boxes: NDArray[np.float64]
    ) -> NDArray[np.intp]:
        """How many labels the leaders (N, 2, 2) of one cut through, and leaders of others through its boxes
        (N, 4), (N,)."""
        placed = self._placed(number)
        cut = _cut(leaders, self.boxes[placed]) | _cut(self.leaders[placed], boxes).T
        return np.count_nonzero(cut, axis=1)

    def _placed(self, but: int) -> NDArray[np.intp]:
        """The numbers of the other labels that are placed."""
        placed = np.isfinite(self.boxes[:, 0])
        placed[but] = False
        return np.flatnonzero(placed)

    def leaders_to(self, number: int, boxes: NDArray[np.float64]) -> NDArray[np.float64]:
        """The shortest leaders from a label's line to boxes (N, 4), (N, 2, 2)."""
        starts = self.starts[number]
        nearest = np.clip(starts[None], boxes[:, None, :2], boxes[:, None, 2:])
        shortest = np.hypot(*(nearest - starts[None]).transpose(2, 0, 1)).argmin(axis=1)
        start = starts[shortest]
        stop = nearest[np.arange(len(boxes)), shortest]
        beside = (start[:, 0] < boxes[:, 0]) | (start[:, 0] > boxes[:, 2])
        middle = 0.5 * (boxes[:, :2] + boxes[:, 2:])
        stop[:, 1] = np.where(beside, middle[:, 1], stop[:, 1])
        return np.stack([start, stop], axis=1)

    # --- placing --------------------------------------------------------------------------

    def keep(self, number: int, kept: _Kept) -> None:
        """Place a label where it was, if it fits there."""
        form, box = self._box_at(number, kept.spot)
        inside = (box[0, :2] >= self.low - 1).all() and (box[0, 2:] <= self.high + 1).all()
        leader = self.leaders_to(number, box)
        if (
            inside
            and not self.overlapping(box)[0]
            and self.covering(box)[0] <= kept.cost + _WORSE
            and _lengths(leader)[0] / self.em <= kept.length + _LONGER
            and self.cutting(number, leader, box)[0] <= kept.cuts
        ):
            self.boxes[number], self.leaders[number], self.forms[number] = box[0], leader[0], form

    def place_near(self, number: int, spot: LabelSpot) -> None:
        """Place a label as near to a spot as it covers no other label there."""
        form, there = self._box_at(number, spot)
        size = there[0, 2:] - there[0, :2]
        corner = np.clip(there[:, :2], self.low, np.maximum(self.high - size, self.low))
        boxes = np.concatenate([np.concatenate([corner, corner + size], axis=1), self._candidates(size)])
        cost = np.hypot(*(boxes[:, :2] - there[:, :2]).T) / self.em
        best = [int((cost + _OVERLAPS * self.overlapping(boxes)).argmin())]
        self.boxes[number], self.leaders[number] = boxes[best[0]], self.leaders_to(number, boxes[best])[0]
        self.forms[number] = form

    def _box_at(self, number: int, spot: LabelSpot) -> tuple[int, NDArray[np.float64]]:
        """The form and the box (1, 4) of a label at a spot."""
        sizes = self.labels[number].sizes
        form = min(spot.form, len(sizes) - 1)
        width, height = sizes[form]
        x, y = np.multiply(spot.edge, self.ground.size[1]) + 0.5 * np.array(self.ground.size)
        left = x - width if spot.is_right else x
        return form, np.array([[left, y - height / 2, left + width, y + height / 2]])

    def place_others(self) -> list[int]:
        """Place the labels that are not placed yet, from the top down; returns which these are."""
        others = [number for number in range(len(self.labels)) if np.isnan(self.boxes[number, 0])]
        for number in sorted(others, key=lambda number: (self.starts[number][0, 1], number)):
            self._place(number)
        for one, other in combinations(others, 2):
            self._exchange(one, other)
        return others

    def _place(self, number: int) -> None:
        of_forms = [self._candidates(size) for size in self.labels[number].sizes]
        forms = np.repeat(np.arange(len(of_forms)), [len(boxes) for boxes in of_forms])
        boxes = np.concatenate(of_forms)
        cost = self.covering(boxes) + _OTHER_FORM * forms
        cost += _OVERLAPS * (self.overlapping(boxes) + self.outside(boxes))
        leaders = self.leaders_to(number, boxes)
        cost += np.hypot(*(leaders[:, 1] - leaders[:, 0]).T * ((1.0,), (_UPRIGHT,))) / self.em
        judged = np.argsort(cost, kind="stable")[:_JUDGED]
        cost = cost[judged] + self.crossing(number, leaders[judged])
        cost += _CROSSES * self.cutting(number, leaders[judged], boxes[judged])
        best = judged[cost.argmin()]
        self.boxes[number], self.leaders[number] = boxes[best], leaders[best]
        self.forms[number] = int(forms[best])

    def _candidates(self, size: Sequence[float] | NDArray[np.float64]) -> NDArray[np.float64]:
        """The boxes of a size that are tried, (N, 4), all in the area where they are no larger."""
        room = np.maximum(self.high - self.low - size, 0)
        step = max(0.5 * (size[1] + _APART * self.em), self.ground.size[1] / _MOST_ROWS)
        columns, rows = (np.linspace(0, extent, int(extent / step) + 2) for extent in room)
        corners = np.stack(np.meshgrid(columns, rows), axis=-1).reshape(-1, 2) + self.low
        return np.concatenate([corners, corners + size], axis=1)

    def _exchange(self, one: int, other: int) -> None:
        """Exchange the places of two labels whose leaders cross, where both fit."""
        pair = [one, other]
        if not _cross(self.leaders[[one]], self.leaders[[other]])[0, 0]:
            return
        sizes = self.boxes[pair, 2:] - self.boxes[pair, :2]
        corners = self.boxes[pair][::-1, :2].copy()
        right = self.leaders[pair][::-1, 1, 0] > corners[:, 0] + 1  # the sides that face the line stay
        corners[:, 0] += np.where(right, (self.boxes[pair][::-1, 2] - corners[:, 0]) - sizes[:, 0], 0)
        boxes = np.concatenate([corners, corners + sizes], axis=1)
        gap = _APART * self.em * np.array([-1, -1, 1, 1])
        fits = not self.overlapping(boxes, pair).any() and not _meet(boxes[:1], boxes[1:] + gap).any()
        if fits and (boxes[:, :2] >= self.low - 1).all() and (boxes[:, 2:] <= self.high + 1).all():
            self.boxes[pair] = boxes
            for number in pair:
                self.leaders[number] = self.leaders_to(number, self.boxes[[number]])[0]

    # --- what comes of it -----------------------------------------------------------------

    def kept(self, number: int, key: str) -> _Kept:
        """The part of a label's place that is kept."""
        left, top, right, bottom = self.boxes[number].tolist()
        is_right = self.leaders[number, 0, 0] > 0.5 * (left + right)
        middle = (right if is_right else left, 0.5 * (top + bottom)) - 0.5 * np.array(self.ground.size)
        x, y = (middle / self.ground.size[1]).tolist()
        spot = LabelSpot(key, self.forms[number], (x, y), bool(is_right))
        length = float(_lengths(self.leaders[[number]])[0]) / self.em
        cost = float(self.covering(self.boxes[[number]])[0])
        cuts = int(self.cutting(number, self.leaders[[number]], self.boxes[[number]])[0])
        return _Kept(spot, cost, length, cuts)

    def place_of(self, number: int) -> LabelPlace:
        """The place of a label."""
        (x, y), (to_x, to_y) = self.leaders[number].tolist()
        is_long = _lengths(self.leaders[[number]])[0] > _LEAST_LEADER * self.em
        left, top, right, bottom = self.boxes[number].tolist()
        leader = ((x, y), (to_x, to_y)) if is_long else None
        return LabelPlace((left, top, right, bottom), self.forms[number], leader)


def _apart(keys: Sequence[str]) -> list[str]:
    """The keys, those that come again with a number."""
    counts = Counter[str]()
    made = []
    for key in keys:
        made.append(f"{key}\n{counts[key]}" if counts[key] else key)
        counts[key] += 1
    return made


def _starts(line: NDArray[np.float64]) -> NDArray[np.float64]:
    """Places on a line that a leader may begin at, (S, 2)."""
    along = np.linspace(0, 1, len(line))
    return np.stack([np.interp(_SHARES, along, line[:, axis]) for axis in (0, 1)], axis=1)


def _weights(ground: LabelGround) -> NDArray[np.float64]:
    """The cost of covering a square of the text's height in each cell, (R, C)."""
    covered = ground.covered
    if covered is None:
        covered = np.zeros((_ROWS, max(1, round(_ROWS * ground.size[0] / ground.size[1]))), bool)
    rows, columns = covered.shape
    at = np.floor(ground.marks / ground.size * (columns, rows)) if len(ground.marks) else np.empty((0, 2))
    at = at[((at >= 0) & (at < (columns, rows))).all(axis=1)].astype(int)
    marked = np.zeros(covered.shape, bool)
    marked[at[:, 1], at[:, 0]] = True
    squares = (
        ground.size[0] * ground.size[1] / covered.size / ground.em**2
    )  # a cell, however small, has a whole mark
    weights = _COVERS * (covered + 0.5 * _grown(covered)) + _COVERS_MARK * marked / min(squares, 1.0)
    near = marked
    for _ in range(_AROUND):
        near = _grown(near)
        weights += _COVERS_MARK / _AROUND * (near & covered)
    return np.asarray(weights)


def _grown(cells: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Cells (R, C) and those beside them."""
    padded = np.pad(cells, 1)
    rows = padded[:-2] | padded[1:-1] | padded[2:]
    return np.asarray(rows[:, :-2] | rows[:, 1:-1] | rows[:, 2:])


def _lengths(leaders: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.hypot(*(leaders[:, 1] - leaders[:, 0]).T)


def _meet(boxes: NDArray[np.float64], others: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Whether boxes (N, 4) share more than an edge with others (M, 4), (N, M)."""
    low = np.maximum(boxes[:, None, :2], others[None, :, :2])
    high = np.minimum(boxes[:, None, 2:], others[None, :, 2:])
    return np.asarray((low < high).all(axis=2))


def _cross(segments: NDArray[np.float64], others: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Whether segments (N, 2, 2) cross others (M, 2, 2), (N, M)."""

    def side(a: NDArray[np.float64], b: NDArray[np.float64], c: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.sign((b - a)[..., 0] * (c - a)[..., 1] - (b - a)[..., 1] * (c - a)[..., 0])

    a, b = segments[:, None, 0], segments[:, None, 1]
    c, d = others[None, :, 0], others[None, :, 1]
    return np.asarray((side(a, b, c) * side(a, b, d) < 0) & (side(c, d, a) * side(c, d, b) < 0))


def _cut(segments: NDArray[np.float64], boxes: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Whether segments (N, 2, 2) run through boxes (M, 4), (N, M)."""
    start, along = segments[:, None, 0], (segments[:, 1] - segments[:, 0])[:, None]
    along = np.where(along == 0, 1e-9, along)
    ends = np.stack([boxes[None, :, :2] - start, boxes[None, :, 2:] - start]) / along  # (2, N, M, 2)
    enter, leave = ends.min(axis=0).max(axis=2), ends.max(axis=0).min(axis=2)
    return np.asarray(np.maximum(enter, 0) < np.minimum(leave, 1))

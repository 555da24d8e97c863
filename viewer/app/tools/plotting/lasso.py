"""A lasso: a drag round a part of the surface, whose area and outline are then measured over time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ....analysis.landmarks import Landmark
from ....analysis.measures import Measure
from ....analysis.surface_point import SurfacePoint
from ....document.landmarks import Landmarks
from ....errors import InputError
from ....geometry import Vector, vector
from ...scene.canvas import Canvas, ScreenView
from ...tool_context import Click, ToolContext

FEWEST, MOST = 6, 16  # corners of a region
_OFF = 0.03  # of its width, that the outline may run off the line from corner to corner
_COLOR = 0xFFFFFF
_TITLE = "Region"


class Lasso:
    """The lasso. through: whether regions hold what is before and behind them as well."""

    def __init__(self, context: ToolContext) -> None:
        self.through = False
        self._context = context
        self._positions: list[Vector] = []  # that were drawn over, where the scan is shown

    @property
    def is_drawn(self) -> bool:
        """Whether drags in the view draw one, now or next."""
        return self._context.has_clicks

    @property
    def is_under_way(self) -> bool:
        """Whether one is being drawn."""
        return bool(self._positions)

    def toggle(self) -> None:
        """Have the next drag draw one, or not."""
        if not self.put_away():
            self._context.take_clicks()

    def put_away(self) -> bool:
        """Let drags be as without it; whether they were not."""
        was_drawn = self.is_drawn
        self._positions.clear()
        self._context.leave_clicks()
        return was_drawn

    def abandon(self) -> None:
        """Let go of the outline that is being drawn."""
        self._positions.clear()

    def take(self, click: Click, ends: bool) -> None:
        """The drag has come to a position. Raises InputError where it ends and has gone round nothing."""
        if click.picked is not None:
            self._positions.append(click.picked.place)
        self._context.redraw()
        if ends:
            positions = without_overlap(np.array(self._positions).reshape(-1, 3))
            self._positions.clear()
            self._add(positions)

    def _add(self, positions: NDArray[np.float64]) -> None:
        """Add a region: landmarks at its corners, its area and its outline."""
        made = self._context.document.part(Landmarks)
        points = [
            self._surface_point(position)
            for position in (positions[corners_of(positions)] if len(positions) > 2 else ())
        ]
        found = [point for point in points if point is not None]
        if len(found) < 3:
            raise InputError("There is no surface inside this outline.")
        name = _free_name(made)
        names = tuple(f"{name}.{number}" for number in range(1, len(found) + 1))
        landmarks = (Landmark(each).with_key(point) for each, point in zip(names, found, strict=True))
        options = {"depth": "through"} if self.through else {}
        measures = (
            Measure(f"{name}, area", "area", names, options),
            Measure(f"{name}, perimeter", "perimeter", names, options),
        )
        made = replace(made, all=(*made.all, *landmarks), measures=(*made.measures, *measures))
        self._context.change("Add region", made)
        self.put_away()

    def _surface_point(self, position: NDArray[np.float64]) -> SurfacePoint | None:
        """The point at a position that was drawn over; None where nothing was measured there, or another
        surface may be meant."""
        click = self._context.seen_at(vector(position))
        if click is None or click.picked is None or not click.picked.measured:
            return None
        return None if click.picked.at_outline else click.surface_point()

    def draw(self, canvas: Canvas, view: ScreenView) -> None:
        """Draw the outline as far as it goes."""
        if len(self._positions) > 1:
            positions = view.all_on_screen(np.array([*self._positions, self._positions[0]]))
            alphas = np.ones(len(positions))
            alphas[-2] = 0.4  # what will close it
            canvas.path(positions, [_COLOR] * len(positions), alphas, dots=False)

    def prompt(self) -> str:
        """The words that say what a drag does."""
        return (
            "Press the mouse button on the surface, draw round the region, and release the button. Esc "
            "to stop."
        )


def without_overlap(positions: NDArray[np.float64]) -> NDArray[np.float64]:
    """An outline, (M, 3), without its end as far as that has come back to its beginning: to less than 3 % of
    its width."""
    if not len(positions):
        return positions
    away = np.linalg.norm(positions - positions[0], axis=1)
    is_away = np.flatnonzero(away > _OFF * away.max())
    return positions[: is_away[-1] + 1] if len(is_away) else positions[:1]


def corners_of(positions: NDArray[np.float64]) -> NDArray[np.intp]:
    """The positions of a closed outline, (M, 3), that tell its form, in their order, (K,): two that lie far
    apart, then again and again the one that lies farthest off the line between those beside it.

    K is 6 to 16, as few as leave the outline within 3 % of its width, and M where that is less.
    """
    count = len(positions)
    first = int(np.linalg.norm(positions - positions.mean(axis=0), axis=1).argmax())
    away = np.linalg.norm(positions - positions[first], axis=1)
    corners, width = sorted({first, int(away.argmax())}), float(away.max())
    while len(corners) < min(MOST, count):
        off = np.zeros(count)
        for start, end in zip(corners, [*corners[1:], corners[0] + count], strict=True):
            between = np.arange(start + 1, end) % count
            side = positions[end % count] - positions[start]
            offsets = positions[between] - positions[start]
            share = np.clip(offsets @ side / max(side @ side, np.finfo(float).tiny), 0, 1)
            off[between] = np.linalg.norm(offsets - share[:, None] * side, axis=1)
        off[corners] = -1
        farthest = int(off.argmax())
        if len(corners) >= FEWEST and off[farthest] <= _OFF * width:
            break
        corners = sorted([*corners, farthest])
    return np.array(corners)


def _free_name(made: Landmarks) -> str:
    heads = [one.name.partition(".")[0] for one in made.all]
    taken = {*heads, *(one.name.partition(",")[0] for one in made.measures)}
    return next(name for number in range(1, len(taken) + 2) if (name := f"{_TITLE} {number}") not in taken)

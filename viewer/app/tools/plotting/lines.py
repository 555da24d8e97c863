"""The lines of measures over the picture: what is measured in the frame that is shown, and its value."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ....analysis.measures import Measure, Series
from ....analysis.measures.curves import power_of, unit_of
from ....analysis.measures.series import lines_of
from ....mesh.geodesic import length_of, steps_along
from ....output.overlays import DIM_LINE, DrawnPath, rounded
from ....output.plots import color_of_curve
from ....rigid import Rigid
from ....scan.units import Scale
from ...scene.canvas import Canvas, Label, ViewPlace
from ...tool_context import ToolContext
from .._seen import seen_in_view
from .shown import Kept
from .words import with_note, with_spread

_PIECES = 24  # of a straight line, so that a part of it may be hidden
_MOST_LABELS = 8  # measures that are told by name and value; of more, the one that is pointed at


@dataclass(frozen=True, eq=False)
class ShownLine:
    """A line of a measure in a frame. places: (P, 3) where it is shown. seen: (P,), which are not hidden."""

    measure: str
    color: int
    places: NDArray[np.float64]
    seen: NDArray[np.bool_]


class MeasureLines:
    """The lines of the measures that are plotted, in the frame that is shown; found once a picture."""

    def __init__(self, context: ToolContext) -> None:
        self._context = context
        self._kept = Kept()

    def shown(self, measures: tuple[Measure, ...], hidden: tuple[str, ...]) -> tuple[ShownLine, ...]:
        """The lines of measures but for hidden ones, where they are in the picture."""
        context, pose = self._context, self._context.pose
        if pose is None:
            return ()
        request = context.viewport.request if context.viewport.is_there else None
        motion = context.motion(pose)
        inputs = measures, hidden, context.followed.series, context.followed.tracks, pose, motion
        placed = self._kept.of("placed", inputs, lambda: self._placed(measures, hidden, pose.index, motion))
        return self._kept.of("lines", (placed, request), lambda: self._with_seen(placed))

    def _placed(
        self, measures: tuple[Measure, ...], hidden: tuple[str, ...], frame: int, motion: Rigid
    ) -> list[tuple[str, int, NDArray[np.float64]]]:
        """The lines in a frame as `_in_frame` has them, where they are shown."""
        found = self._in_frame(measures, hidden, frame)
        return [(name, color, motion.points(places)) for name, color, places in found]

    def _with_seen(self, placed: Sequence[tuple[str, int, NDArray[np.float64]]]) -> tuple[ShownLine, ...]:
        if not placed:
            return ()
        seen = seen_in_view(self._context, np.concatenate([places for *_, places in placed]))
        parts = np.split(seen, ends_of([places for *_, places in placed]))
        return tuple(ShownLine(*one, part) for one, part in zip(placed, parts, strict=True))

    def _in_frame(
        self, measures: tuple[Measure, ...], hidden: tuple[str, ...], frame: int
    ) -> Iterator[tuple[str, int, NDArray[np.float64]]]:
        """The lines of measures but for hidden ones in a frame: the measure, its colour, and places (P, 3) as
        the scan has them."""
        series, tracks = self._context.followed.series, self._context.followed.tracks
        numbers = {name: number for number, name in enumerate(series)}
        for measure in measures:
            if measure.owns_landmarks or measure.name in hidden or measure.name not in series:
                continue  # the tool that has made it draws it, or nobody
            if not all(name in tracks for name in measure.landmarks):
                continue
            color = color_of_curve(numbers[measure.name])
            for line in lines_of(measure, series[measure.name], tracks, frame):
                pieces = (
                    line if len(line) > _PIECES else steps_along(line, max(length_of(line) / _PIECES, 1e-300))
                )
                yield measure.name, color, pieces

    def drawn(
        self, measures: tuple[Measure, ...], hidden: tuple[str, ...], frame: int, radius: float
    ) -> tuple[DrawnPath, ...]:
        """The lines in a frame, for pictures that are saved, with the values of a few. radius: of the
        scan."""
        found = list(self._in_frame(measures, hidden, frame))
        untold = {name for name, *_ in found}
        if len(untold) > _MOST_LABELS:
            untold.clear()
        drawn = []
        for name, color, places in found:
            path = DrawnPath(rounded(places, radius), (color,))
            if name in untold:
                untold.discard(name)
                value = value_in_words(self._context.followed.series[name], frame, self._context.scale)
                path = replace(path, name=name, value=value)
            drawn.append(path)
        return tuple(drawn)

    def draw(
        self,
        measures: tuple[Measure, ...],
        hidden: tuple[str, ...],
        pointed: str | None,
        canvas: Canvas,
        view: ViewPlace,
    ) -> None:
        """Draw the lines, and the values of a few. pointed: the measure that the mouse points at, by name."""
        pose, labels = self._context.pose, []
        shown = self.shown(measures, hidden)
        if not shown:
            return
        told = set(dict.fromkeys(line.measure for line in shown))
        if len(told) > _MOST_LABELS:
            told &= {pointed}
        places = [line.places for line in shown]
        all_on_screen = view.all_on_screen(np.concatenate(places))
        for line, on_screen in zip(shown, np.split(all_on_screen, ends_of(places)), strict=True):
            alphas = np.where(line.seen, 1.0, DIM_LINE)
            canvas.path(on_screen, [line.color] * len(alphas), alphas, dots=False)
            if line.measure in told and pose is not None and np.isfinite(on_screen).all():
                told.discard(line.measure)
                series, scale = self._context.followed.series[line.measure], self._context.scale
                if view.shows(on_screen):
                    text = f"{line.measure}: {value_in_words(series, pose.index, scale)}"
                    labels.append(Label([text], on_screen, line.color, faint=not line.seen.any()))
        canvas.labels(labels)


def ends_of(parts: Sequence[NDArray[np.float64]]) -> NDArray[np.intp]:
    """Find where arrays end that are joined, but for the last of them."""
    return np.cumsum([len(each) for each in parts], dtype=np.intp)[:-1]


def value_in_words(series: Series, frame: int, scale: Scale) -> str:
    """The value of a measure in a frame with its uncertainty and unit; a dash where it is not known."""
    factor = scale.factor ** power_of(series.quantity)
    value, sigma = factor * series.values[frame], factor * series.sigmas[frame]
    words = with_spread(float(value), float(sigma), unit_of(series.quantity, scale.unit))
    return with_note(words, series.note(frame))

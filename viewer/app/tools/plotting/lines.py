"""The lines of measures over the picture: what is measured in the frame that is shown, and its value."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from imgui_bundle import ImVec2
from numpy.typing import NDArray

from ....analysis.measures import Measure, Series
from ....analysis.measures.curves import power_of, unit_of
from ....analysis.measures.series import lines_of
from ....analysis.surface_point import slack_before
from ....analysis.words import SURE, measured_in_words, with_note
from ....document.landmarks import Landmarks
from ....mesh.geodesic import length_of, steps_along
from ....output.overlays import DIM_LINE, LINE_COLOR, LINE_SLACK, DrawnPath, rounded
from ....output.plots import color_of_curve
from ....scan.units import Scale
from ...scene.canvas import Canvas, Label, ScreenView
from ...tool_context import ToolContext
from .._cached import Cached
from .._seen import seen_in_view

_PIECES = 24  # of a straight line, so that a part of it may be hidden
_MOST_LABELS = 8  # measures of named landmarks with a label; of more, the one that is pointed at


@dataclass(frozen=True, eq=False)
class ShownLine:
    """A line of a measure in a frame. positions: (P, 3), scan units. slack: how far before these the surface
    may be that is their own. opacities: (P,), less where it is hidden."""

    measure: Measure
    color: int
    positions: NDArray[np.float64]
    slack: float
    opacities: NDArray[np.float64]


class MeasureLines:
    """The lines of the measures in the frame that is shown; found once a picture."""

    def __init__(self, context: ToolContext) -> None:
        self._context = context
        self._cached = Cached()

    def shown(self, made: Landmarks, hidden: tuple[str, ...]) -> tuple[ShownLine, ...]:
        """The lines of measures but for hidden ones, where they are in the picture."""
        context, pose = self._context, self._context.pose
        if pose is None:
            return ()
        request = context.viewport.request if context.viewport.is_there else None
        motion, radius = context.motion(pose), context.viewport.bounds(pose).radius
        inputs = made, hidden, context.followed.series, context.followed.tracks, pose, motion

        def placed() -> list[ShownLine]:
            found = self._in_frame(made, hidden, pose.index, radius)
            return [replace(line, positions=motion.points(line.positions)) for line in found]

        lines = self._cached.of("placed", inputs, placed)
        return self._cached.of("lines", (lines, request), lambda: self._with_seen(lines))

    def _with_seen(self, lines: Sequence[ShownLine]) -> tuple[ShownLine, ...]:
        if not lines:
            return ()
        positions = [line.positions for line in lines]
        slacks = np.concatenate([np.full(len(line.positions), line.slack) for line in lines])
        seen = np.split(seen_in_view(self._context, np.concatenate(positions), slacks), ends_of(positions))
        found = []
        for line, own in zip(lines, seen, strict=True):
            is_seen = np.full(len(own), own[0] & own[-1]) if line.measure.owns_landmarks else own
            found.append(replace(line, opacities=np.where(is_seen, 1.0, DIM_LINE)))
        return tuple(found)

    def _in_frame(
        self, made: Landmarks, hidden: tuple[str, ...], frame: int, radius: float
    ) -> Iterator[ShownLine]:
        """The lines of measures but for hidden ones in a frame, as the scan has them. radius: of the scan."""
        series, tracks = self._context.followed.series, self._context.followed.tracks
        numbers = {name: number for number, name in enumerate(series)}
        for measure in made.measures:
            if measure.name in hidden or measure.name not in series:
                continue
            if not all(name in tracks for name in measure.landmarks):
                continue
            color, slack = color_of_curve(numbers[measure.name]), LINE_SLACK * radius
            if measure.owns_landmarks:
                ends = [(landmark, tracks[landmark.name]) for landmark in made.owned_by(measure)]
                spacing = max(landmark.keys[0].spacing or 0.0 for landmark, _ in ends)
                sure = SURE * max(float(np.nan_to_num(track.sigmas[frame])) for _, track in ends)
                color, slack = LINE_COLOR, float(slack_before(spacing, sure, radius))
            for line in lines_of(measure, series[measure.name], tracks, frame):
                pieces = (
                    line if len(line) > _PIECES else steps_along(line, max(length_of(line) / _PIECES, 1e-300))
                )
                yield ShownLine(measure, color, pieces, slack, np.ones(len(pieces)))

    def drawn(
        self, made: Landmarks, hidden: tuple[str, ...], frame: int, radius: float
    ) -> tuple[DrawnPath, ...]:
        """The lines in a frame, for pictures that are saved, with their labels. radius: of the scan."""
        found = list(self._in_frame(made, hidden, frame, radius))
        to_label, drawn = names_to_label(found), []
        for line in found:
            measure = line.measure
            path = DrawnPath(
                rounded(line.positions, radius), (line.color,),
                has_ends=measure.owns_landmarks, slack=line.slack,
            )  # fmt: skip
            if measure.name in to_label:
                to_label.discard(measure.name)
                path = replace(path, name=measure.label, value=self._value_in_words(made, measure, frame))
            drawn.append(path)
        return tuple(drawn)

    def draw(
        self,
        made: Landmarks,
        hidden: tuple[str, ...],
        pointed: str | None,
        canvas: Canvas,
        view: ScreenView,
    ) -> None:
        """Draw the lines and their labels. pointed: the measure that the mouse points at, by name."""
        pose, labels, shown = self._context.pose, [], self.shown(made, hidden)
        if pose is None or not shown:
            return
        to_label, positions = names_to_label(shown, pointed), [line.positions for line in shown]
        on_screen = np.split(view.all_on_screen(np.concatenate(positions)), ends_of(positions))
        for line, pixels in zip(shown, on_screen, strict=True):
            measure, opacities = line.measure, line.opacities
            canvas.path(pixels, [line.color] * len(opacities), opacities, dots=False)
            if measure.owns_landmarks:
                for end in (pixels[0], pixels[-1]):
                    if np.isfinite(end).all():
                        canvas.point(ImVec2(*end.tolist()), line.color, float(opacities[0]))
            if measure.name in to_label and np.isfinite(pixels).all():
                to_label.discard(measure.name)
                if view.shows(pixels):
                    text = f"{measure.label}: {self._value_in_words(made, measure, pose.index)}"
                    labels.append(Label([text], pixels, line.color, faint=opacities.max() < 1))
        canvas.labels(labels)

    def _value_in_words(self, made: Landmarks, measure: Measure, frame: int) -> str:
        words = value_in_words(self._context.followed.series[measure.name], frame, self._context.scale)
        return f"{words}, averaged" if made.is_averaged(measure) else words


def names_to_label(lines: Iterable[ShownLine], pointed: str | None = None) -> set[str]:
    """The measures that have a label: those that own their landmarks, and the others unless they are many.
    pointed: the one that the mouse points at, which has one then."""
    owned = {line.measure.name for line in lines if line.measure.owns_landmarks}
    others = {line.measure.name for line in lines} - owned
    return owned | (others if len(others) <= _MOST_LABELS else others & {pointed})


def ends_of(parts: Sequence[NDArray[np.float64]]) -> NDArray[np.intp]:
    """Find where arrays end that are joined, but for the last of them."""
    return np.cumsum([len(each) for each in parts], dtype=np.intp)[:-1]


def value_in_words(series: Series, frame: int, scale: Scale) -> str:
    """The value of a measure in a frame with its uncertainty and unit; a dash where it is not known."""
    factor = scale.factor ** power_of(series.quantity)
    value, sigma = factor * series.values[frame], factor * series.sigmas[frame]
    words = measured_in_words(float(value), float(sigma), unit_of(series.quantity, scale.unit))
    return with_note(words, series.note(frame))

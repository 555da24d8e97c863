"""Marks on a picture: a scale bar, what colours mean, and a stamp, laid out alike in files and in the window.

A `MarkPainter` draws them: `marked` has one for images, the window has one of its own.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ..camera import Camera
from ..geometry import Vector
from ..look import HOLE_COLOR, LEVEL_COLORS, Look, ValueKind, color_table, rgba
from ..params import describe, param
from ..resources import resource_path
from ..scan.times import frame_in_words
from .labels import Box, Callout, LabelGround, LabelPlaces, Spot, forms_of
from .overlays import (
    DIM_LINE,
    LABEL_EDGE,
    LEADER_OPACITY,
    LEADER_THICK,
    LINE_COLOR,
    LINE_THICK,
    DrawnCurve,
    DrawnPlot,
    Overlay,
    ToldLine,
    draw_line,
    draw_overlay,
)

Color = tuple[int, int, int, int]  # sRGB and alpha, bytes

INK: Color = (245, 245, 245, 255)
_MEASURED: Color = (150, 150, 150, 255)
PLATE: Color = (0, 0, 0, 170)  # light on dark, so that it is read on any picture
_LINES = 45  # of text that are as high as a picture
_LEAST_TEXT = 11.0  # pixels, where the picture has room for it
_BAR_SHARE = 1 / 6  # of the picture's width that a scale bar takes at most
_TEXT_SHARE = 0.4  # the same of a text
_MAP_SHARE = 0.2  # of the picture's height that a colour map takes at most
_MOST_DIGITS = 15  # that a float64 holds

# In heights of the text:
_MARGIN, _PAD, _GAP = 0.8, 0.5, 0.35
_TICK, _LINE = 0.5, 0.14  # height of a scale bar's ends, thickness of its line
_PLOT_HEIGHT = 0.24  # of a plot, in shares of the picture, which becomes smaller by that above it
_LINE_STEP = 1.2  # from one line of a label to the next
_MAP_WIDTH, _MAP_HEIGHT = 1.0, 8.0
_SWATCH_LINE = 1.4  # from one swatch to the next
_END = 0.28  # radius of a measured line's ends


@dataclass(frozen=True)
class Marks:
    """A choice of what is drawn over a picture."""

    scale_bar: bool = param(
        False, "A bar of a round length in scan units; in perspective at the depth of the camera's target"
    )
    color_bar: bool = param(
        False,
        "The colour map and its numbers, where the look colours by a number; colours of levels and holes",
    )
    stamp: bool = param(False, "Number of the frame, and its time")
    measurements: bool = param(False, "Measured distances, as they stand in the frame")
    notes: bool = param(False, "Notes that are pinned to places and to the frame")
    landmarks: bool = param(False, "Landmarks, as they stand in the frame")
    trajectories: bool = param(False, "Ways of landmarks through all frames, those that the view shows")
    measure_lines: bool = param(False, "What measures measure in the frame, with their values")
    plot: bool = param(False, "The plot of measures, where it is shown, with a line at the frame")

    def __bool__(self) -> bool:
        return any(getattr(self, field.name) for field in fields(self))


MARKS = tuple(parameter.name for parameter in describe(Marks))


def marks_of(names: Sequence[str] | None) -> Marks:
    """The choice of these names of MARKS."""
    return Marks(**dict.fromkeys(names or (), True))


@dataclass(frozen=True)
class MeasuredLine:
    """A measured distance in a picture, or a note at a place, which is both ends.

    ends: two places, scan units. slack: of each, how far before it the surface may be that is its own, scan
    units. text: that stands beside it. hidden: whether something is before one of its ends.
    """

    ends: tuple[Vector, Vector]
    slack: tuple[float, float]
    text: str
    hidden: bool = False


@dataclass(frozen=True)
class Legend:
    """The words and numbers that the marks of a picture show.

    unit: of length. pose: its index, of `count`. time: the pose's, seconds. range_note: what the colour bar
    says of its numbers. lines: that were measured, and notes at places. notes: on the frame. factor: how many
    of `unit` one unit of the scan is. overlay: landmarks and lines of them, None where none are drawn.
    covered: the cells of the picture that show the subject (see `labels.covered_cells`), None where not
    known. places: of labels in the pictures before, which change with
    this one. plot: None where none is drawn.
    """

    marks: Marks
    camera: Camera
    look: Look
    unit: str
    pose: int
    count: int
    time: float
    range_note: str = ""
    lines: tuple[MeasuredLine, ...] = ()
    notes: tuple[str, ...] = ()
    factor: float = 1.0
    overlay: Overlay | None = None
    plot: DrawnPlot | None = None
    covered: NDArray[np.bool_] | None = field(default=None, compare=False)
    places: LabelPlaces = field(default_factory=LabelPlaces, compare=False)


class MarkPainter(Protocol):
    """A surface that marks are drawn on. Text is one line, `em` pixels high."""

    em: float

    def width(self, text: str) -> float:
        """Width of a text, pixels."""

    def text(self, left: float, top: float, text: str) -> None:
        """Write in INK."""

    def box(self, box: Box, color: Color) -> None:
        """Fill a rectangle."""

    def gradient(self, box: Box, colors: NDArray[np.uint8]) -> None:
        """Fill a rectangle with colours, (N, 4) uint8, from bottom to top."""


# --- what they say --------------------------------------------------------------------------


def round_length(most: float) -> float:
    """The largest of 1, 2 and 5 times a power of ten that is no longer than `most`, which is positive."""
    power = 10.0 ** math.floor(math.log10(most))
    return max((factor * power for factor in (1, 2, 5) if factor * power <= most), default=power)


def scale_bar(camera: Camera, size: tuple[float, float], factor: float = 1.0) -> tuple[float, float]:
    """A round length, and how many pixels it takes at the depth of the camera's target.

    It takes at most a sixth of the picture's width. size: (width, height), pixels. factor: from scan units to
    those that the length is in.
    """
    width, height = size
    view_height = factor * camera.view_height
    length = round_length(_BAR_SHARE * width * view_height / height)
    return length, length * height / view_height


def quantity(look: Look, unit: str, kind: ValueKind | None = None) -> str:
    """The number that the look colours by, with its unit where it is a length. kind: of what a backend
    finds."""
    if kind is not None or _is_length(look, kind):
        unit_words = f" ({unit})" if _is_length(look, kind) else ""
        return look.color_by.replace("_", " ").capitalize() + unit_words
    return "Value" if look.color_by.startswith("#") else look.color_by


def _is_length(look: Look, kind: ValueKind | None) -> bool:
    """Whether the number that the look colours by is one in the scan's unit. kind: as for `quantity`."""
    return look.color_by in ("depth", "height") if kind is None else kind.is_length


def number(value: float, span: float) -> str:
    """A number with three digits of the span that it is one of, the shorter way."""
    if not math.isfinite(value):
        return str(value)
    magnitude = math.floor(math.log10(span)) if span > 0 else math.floor(math.log10(abs(value) or 1))
    decimals = max(2 - magnitude, 0)
    plain = f"{round(value, decimals) + 0.0:,.{decimals}f}"  # + 0.0: no minus before zero
    if not value:
        return "0"
    digits = min(max(math.floor(math.log10(abs(value))) + 2 - magnitude, 2), _MOST_DIGITS)
    scientific = f"{value:.{digits}e}"
    return plain if len(plain) <= len(scientific) + 1 else scientific


def range_note(legend: Legend) -> str:
    """Words on where the range of colours is from, where it is not that of all frames or given."""
    look = legend.look
    is_own = look.range == "frame" and None in (look.low, look.high) and look.color_by != "depth"
    return legend.range_note or ("range of this frame" if is_own and legend.count > 1 else "")


def swatches(look: Look) -> list[tuple[Color, str]]:
    """Colours that the look shows something else by than numbers, and what each says."""
    told = []
    if look.color_by == "level":
        levels = [f"Level {number}" for number in range(1, len(LEVEL_COLORS) + 1)]
        levels[-1] += " and above"
        told = [(_MEASURED, "Measured"), *zip(map(rgba, LEVEL_COLORS), levels, strict=True)]
    return [*told, (rgba(HOLE_COLOR), "Hole")] if look.holes else told


def stamp(legend: Legend) -> str:
    """The frame, counted from 1, and its time."""
    return f"{frame_in_words(legend.pose).capitalize()} of {legend.count}, {legend.time:.3f} s"


# --- where they are -------------------------------------------------------------------------


def text_height(size: tuple[int, int]) -> int:
    """Height of marks' text in a picture of (width, height) pixels: less in one that is small or narrow."""
    extent = min(size[1], 0.75 * size[0])
    return max(1, round(max(extent / _LINES, min(_LEAST_TEXT, extent / 16))))


def draw(
    painter: MarkPainter,
    size: tuple[float, float],
    legend: Legend,
    values: tuple[float, float] | None,
    kind: ValueKind | None = None,
) -> list[Box]:
    """Draw the legend's marks: scale bar lower left, colour bar and swatches lower right, stamp and notes on
    the frame upper left. Returns where they are.

    size: (width, height), pixels. values: where the colour map begins and ends; None: no colour bar. kind: of
    its numbers, where the backend found them.
    """
    drawn = []
    if legend.marks.scale_bar:
        drawn.append(_draw_scale_bar(painter, size, legend))
    if legend.marks.color_bar:
        bottom = size[1] - _MARGIN * painter.em
        if values is not None:
            drawn.append(_draw_color_bar(painter, size, legend, values, kind))
            bottom = drawn[-1][1] - _GAP * painter.em
        if told := swatches(legend.look):
            drawn.append(_draw_swatches(painter, size, told, bottom))
    upper_left = [stamp(legend)] if legend.marks.stamp else []
    return [*drawn, *_draw_plates(painter, size, [*upper_left, *legend.notes])]


def scale_bar_box(painter: MarkPainter, size: tuple[float, float], legend: Legend) -> Box:
    """The place of the scale bar's plate."""
    em = painter.em
    _, pixels = scale_bar(legend.camera, size, legend.factor)
    width = max(round(pixels), painter.width(_scale_text(painter, size, legend))) + 2 * _PAD * em
    left, bottom = round(_MARGIN * em), round(size[1] - _MARGIN * em)
    return left, bottom - round((1 + _GAP + _TICK + 2 * _PAD) * em), left + width, bottom


def _scale_text(painter: MarkPainter, size: tuple[float, float], legend: Legend) -> str:
    length, _ = scale_bar(legend.camera, size, legend.factor)
    return _shortened(painter, f"{length:,.6g} {legend.unit}", _TEXT_SHARE * size[0])


def _draw_scale_bar(painter: MarkPainter, size: tuple[float, float], legend: Legend) -> Box:
    em = painter.em
    box = left, top, right, bottom = scale_bar_box(painter, size, legend)
    painter.box(box, PLATE)
    text, pixels = _scale_text(painter, size, legend), round(scale_bar(legend.camera, size, legend.factor)[1])
    painter.text((left + right - painter.width(text)) / 2, top + _PAD * em, text)
    start, foot = round((left + right - pixels) / 2), round(bottom - _PAD * em)
    line, tick = max(1, round(_LINE * em)), max(2, round(_TICK * em))
    for x in (start, start + pixels - line):
        painter.box((x, foot - tick, x + line, foot), INK)
    painter.box((start + line, foot - line, start + pixels - line, foot), INK)
    return box


def ticks(low: float, high: float, kind: ValueKind | None = None) -> list[tuple[float, str]]:
    """Shares of the colour bar at which numbers stand, from its foot, and these. kind: as for `draw`."""
    shares = (0.0, 0.5, 1.0) if high != low else (0.0,)
    if kind is not None and kind.goes_by_log(low, high):
        values = [math.exp((1 - share) * math.log(low) + share * math.log(high)) for share in shares]
        return [(share, number(value, value)) for share, value in zip(shares, values, strict=True)]
    return [(share, number(low + share * (high - low), abs(high - low))) for share in shares]


def _draw_color_bar(
    painter: MarkPainter,
    size: tuple[float, float],
    legend: Legend,
    values: tuple[float, float],
    kind: ValueKind | None,
) -> Box:
    """Draw it lower right; returns where it is."""
    em = painter.em
    title = _shortened(painter, quantity(legend.look, legend.unit, kind), _TEXT_SHARE * size[0])
    note = _shortened(painter, range_note(legend), _TEXT_SHARE * size[0])
    factor = legend.factor if _is_length(legend.look, kind) else 1.0
    told = ticks(factor * values[0], factor * values[1], kind)
    widest = (_MAP_WIDTH + _GAP) * em + max(painter.width(text) for _, text in told)
    widest = max(widest, painter.width(title), painter.width(note))
    height = min(_MAP_HEIGHT * em, _MAP_SHARE * size[1])
    right, bottom = round(size[0] - _MARGIN * em), round(size[1] - _MARGIN * em)
    left = round(right - widest - 2 * _PAD * em)
    top = round(bottom - height - (2.5 + (1 + _GAP if note else 0) + 2 * _PAD) * em)
    box = left, top, right, bottom
    painter.box(box, PLATE)
    left += round(_PAD * em)
    painter.text(left, top + round(_PAD * em), title)
    if note:
        painter.text(left, top + round((_PAD + 1 + _GAP) * em), note)
    foot = bottom - round((_PAD + 0.5) * em)
    colors = color_table(legend.look.color_map)
    painter.gradient((left, foot - round(height), left + round(_MAP_WIDTH * em), foot), colors)
    for share, text in told:
        painter.text(left + (_MAP_WIDTH + _GAP) * em, foot - share * height - em / 2, text)
    return box


def _draw_swatches(
    painter: MarkPainter, size: tuple[float, float], told: list[tuple[Color, str]], bottom: float
) -> Box:
    em, line = painter.em, round(_SWATCH_LINE * painter.em)
    texts = [_shortened(painter, text, _TEXT_SHARE * size[0]) for _, text in told]
    right = round(size[0] - _MARGIN * em)
    left = round(right - max(map(painter.width, texts)) - (_MAP_WIDTH + _GAP + 2 * _PAD) * em)
    top = round(bottom - _PAD * em) - len(told) * line
    painter.box((left, top, right, bottom), PLATE)
    for place, ((color, _), text) in enumerate(zip(told, texts, strict=True)):
        x, y = left + round(_PAD * em), top + round(_PAD * em) + place * line
        painter.box((x, y, x + round(_MAP_WIDTH * em), y + round(em)), color)
        painter.text(x + (_MAP_WIDTH + _GAP) * em, y, text)
    return left, top, right, bottom


def _draw_plates(painter: MarkPainter, size: tuple[float, float], texts: Sequence[str]) -> list[Box]:
    """Draw texts below each other upper left; returns where they are."""
    em, left = painter.em, round(_MARGIN * painter.em)
    boxes: list[Box] = []
    height = round((1 + 2 * _PAD) * em)
    for number, line in enumerate(texts):
        text, top = _shortened(painter, line, size[0] - 2 * (_MARGIN + _PAD) * em), left + number * height
        boxes.append((left, top, left + painter.width(text) + 2 * _PAD * em, top + height))
        painter.box(boxes[-1], PLATE)
        painter.text(left + _PAD * em, top + _PAD * em, text)
    return boxes


def _draw_plot(painter: _Overlay, size: tuple[float, float], plot: DrawnPlot, pose: int) -> bool:
    """Draw a plot at the bottom of a picture, with a line at a frame; whether it has any values."""
    em, x = painter.em, _numbers(plot.x)
    curves = [(curve, _numbers(curve.values)) for curve in plot.curves if len(curve.values) == len(x)]
    curves = [(curve, values) for curve, values in curves if np.isfinite(x + values).any()]
    if not curves:
        return False
    left, right = round(_MARGIN * em), round(size[0] - _MARGIN * em)
    top, bottom = round((1 - _PLOT_HEIGHT) * size[1]), round(size[1] - _MARGIN * em)
    painter.box((left, top, right, bottom), PLATE)
    start, stop, high, low = left + _PAD * em, right - _PAD * em, top + 2 * em, bottom - 2 * em
    across = _scaled(x, x, start, stop)
    for curve, values in curves:
        of_unit = np.concatenate([others for other, others in curves if other.unit == curve.unit])
        places = np.stack([across, _scaled(values, of_unit, low, high)], axis=1)
        count = len(places)
        inks, none = [curve.color] * count, np.zeros(count, bool)
        painter.polyline(places, LINE_THICK * em, inks, np.ones(count), none, 0.0)
    if pose < len(across) and np.isfinite(across[pose]):
        half = max(0.5, 0.05 * em)
        painter.box((across[pose] - half, high, across[pose] + half, low), INK)
    _draw_plot_words(painter, (start, low + 0.4 * em, stop, top + 0.45 * em), plot, curves, pose)
    return True


def _draw_plot_words(
    painter: _Overlay,
    room: Box,
    plot: DrawnPlot,
    curves: Sequence[tuple[DrawnCurve, NDArray[np.float64]]],
    pose: int,
) -> None:
    """Write the names of a plot's curves with their values at a frame, and its abscissa. room: from the left
    to the right; the tops of the abscissa's numbers and of the names."""
    em, (start, below, stop, above), x = painter.em, room, _numbers(plot.x)
    at = start
    for curve, values in curves:
        now = values[pose] if pose < len(values) else np.nan
        words = f"{now:.4g} {curve.unit}" if np.isfinite(now) else "-"
        text = f"{curve.name}: {words}" if curve.name else words
        if at + em + painter.width(text) > stop:
            break
        painter.box(
            (at, above + 0.15 * em, at + 0.7 * em, above + 0.85 * em), (*rgba(f"#{curve.color:06x}")[:3], 255)
        )
        painter.text(at + em, above, text)
        at += painter.width(text) + 2 * em
    least, most = float(np.nanmin(x)), float(np.nanmax(x))
    for text, share in (
        (number(least, most - least), 0.0),
        (plot.x_label, 0.5),
        (number(most, most - least), 1.0),
    ):
        painter.text(start + share * (stop - start - painter.width(text)), below, text)


def _numbers(values: Sequence[float | None]) -> NDArray[np.float64]:
    return np.array([np.nan if value is None else value for value in values])


def _scaled(
    values: NDArray[np.float64], span: NDArray[np.float64], start: float, stop: float
) -> NDArray[np.float64]:
    """Find where values are between start and stop, at which the least and the largest of a span lie."""
    least, most = np.nanmin(span), np.nanmax(span)
    return np.asarray(start + (stop - start) * (values - least) / (most - least or 1.0))


def _draw_lines(painter: _Overlay, size: tuple[float, float], legend: Legend, taken: Sequence[Box]) -> None:
    """Draw landmarks and their lines, and the measured lines, and their labels; what has an end behind the
    eye
    is left out. taken: where other marks are."""
    told: list[ToldLine] = []
    marks = np.empty((0, 2))
    if legend.overlay is not None:
        told, marks = draw_overlay(painter, size, legend.camera, legend.overlay)
    lines = legend.lines if legend.marks.measurements or legend.marks.notes else ()
    for line in lines:
        places = _places(line, legend.camera, size)
        if places is None:
            continue
        opacities = np.full(2, DIM_LINE if line.hidden else 1.0)
        draw_line(painter, places, [LINE_COLOR] * 2, opacities, np.ones(2, bool), 2 * _END * painter.em)
        told.append(ToldLine(line.text, places, LINE_COLOR, float(opacities[0])))
    inside = [one for one in told if _is_inside(one.places, size)]
    marks = np.concatenate([marks, *(one.places for one in inside)])
    ground = LabelGround(size, painter.em, legend.covered, marks, taken, legend.camera)
    _draw_labels(painter, legend.places, inside, ground)


def _draw_labels(
    painter: _Overlay, places: LabelPlaces, told: Sequence[ToldLine], ground: LabelGround
) -> None:
    """Draw texts on plates at their places, each with a leader from its line."""
    em = painter.em
    room = ground.size[0] - 2 * (_MARGIN + _PAD) * em
    forms = [
        [[_shortened(painter, line, room) for line in form] for form in forms_of([one.text])] for one in told
    ]
    labels = [
        Callout(one.text.partition(":")[0], tuple(_plate_size(painter, form) for form in own), one.places)
        for one, own in zip(told, forms, strict=True)
    ]
    placed = places.place(labels, ground)
    for one, place in zip(told, placed, strict=True):
        if place.leader is not None:
            ends, none = np.array(place.leader), np.zeros(2, bool)
            opacities = np.full(2, max(one.opacity, LEADER_OPACITY))
            draw_line(painter, ends, [one.color] * 2, opacities, none, 0.0, LEADER_THICK)
    for one, own, place in zip(told, forms, placed, strict=True):
        left, top, _, bottom = place.box
        painter.box(place.box, PLATE)
        painter.box(
            (left, top, left + max(2, round(LABEL_EDGE * em)), bottom),
            (*rgba(f"#{one.color:06x}")[:3], round(255 * one.opacity)),
        )
        for number, line in enumerate(own[place.form]):
            painter.text(left + _PAD * em, top + (_PAD + number * _LINE_STEP) * em, line)


def _plate_size(painter: MarkPainter, lines: Sequence[str]) -> tuple[float, float]:
    """Width and height of the plate of a label."""
    height = 1 + (len(lines) - 1) * _LINE_STEP + 2 * _PAD
    return max(map(painter.width, lines)) + 2 * _PAD * painter.em, height * painter.em


def _is_inside(places: NDArray[np.float64], size: tuple[float, float]) -> bool:
    """Whether some of a line's places (N, 2) are in a picture."""
    return bool(((places >= 0) & (places <= size)).all(axis=1).any())


def _places(line: MeasuredLine, camera: Camera, size: tuple[float, float]) -> NDArray[np.float64] | None:
    """The ends in a picture of this size, (2, 2); None where one is behind the eye."""
    width, height = size
    places = camera.places_in_picture(np.array(line.ends)) * (height, -height) + (width / 2, height / 2)
    return places if np.isfinite(places).all() else None


def _shortened(painter: MarkPainter, text: str, room: float) -> str:
    if painter.width(text) <= room:
        return text
    while text and painter.width(text + "…") > room:
        text = text[:-1]
    return text + "…"


# --- in images ------------------------------------------------------------------------------


def marked(
    image: NDArray[np.uint8],
    legend: Legend | None,
    values: tuple[float, float] | None,
    kind: ValueKind | None = None,
) -> NDArray[np.uint8]:
    """The image, (H, W, 4) uint8 sRGB and alpha, with the legend's marks; outside them as it was.

    values, kind: as for `draw`.
    """
    from PIL import Image

    if legend is None or not legend.marks:
        return image
    below = Image.fromarray(image)
    lines, above = _Overlay(below.size), _Overlay(below.size)
    taken = draw(above, below.size, legend, values, kind)
    _draw_lines(lines, below.size, legend, taken)
    made = Image.alpha_composite(Image.alpha_composite(below, lines.image), above.image)
    plot = _Overlay(below.size)
    if legend.plot is None or not _draw_plot(plot, below.size, legend.plot, legend.pose):
        return np.asarray(made)
    wide, high = (round((1 - _PLOT_HEIGHT) * extent) for extent in below.size)
    with_room = Image.new("RGBA", below.size, rgba(legend.look.background))
    with_room.paste(made.resize((max(wide, 1), max(high, 1))), ((below.width - wide) // 2, 0))
    return np.asarray(Image.alpha_composite(with_room, plot.image))


class _Overlay:
    """A MarkPainter of transparent pixels."""

    def __init__(self, size: tuple[int, int]) -> None:
        from PIL import Image, ImageDraw, ImageFont

        self.image = Image.new("RGBA", size)
        self.em = float(text_height(size))
        self._draw: Any = ImageDraw.Draw(self.image)
        path = resource_path("assets", "fonts", "Roboto-Regular.ttf")
        # The same layout whether or not the library for complex scripts is there.
        self._font = ImageFont.truetype(path, self.em, layout_engine=ImageFont.Layout.BASIC)

    def width(self, text: str) -> float:
        return float(self._font.getlength(text))

    def text(self, left: float, top: float, text: str) -> None:
        # Capitals and digits stand 0.71 em high: in the middle of the line.
        self._draw.text((round(left), round(top + 0.855 * self.em)), text, INK, self._font, anchor="ls")

    def polyline(
        self,
        places: NDArray[np.float64],
        width: float,
        colors: Sequence[int],
        opacities: NDArray[np.float64],
        dots: NDArray[np.bool_],
        dot: float,
    ) -> None:
        wide, high = self.image.size
        reach = max(width, dot) / 2 + 1
        there = np.logical_and.reduce(np.isfinite(places), axis=1)
        if not there.any():
            return
        (low_x, low_y), (high_x, high_y) = places[there].min(axis=0), places[there].max(axis=0)
        left, right = _pixels(low_x, high_x, reach, wide)
        top, bottom = _pixels(low_y, high_y, reach, high)
        if left >= right or top >= bottom:
            return
        pixels = np.zeros((bottom - top, right - left, 4), np.uint8)
        ends = [(at, at + 1, width) for at in np.flatnonzero(there[:-1] & there[1:]).tolist()]
        ends += [(at, at, dot) for at in np.flatnonzero(dots & there).tolist()]
        for first, last, thick in ends:
            color = (*rgba(f"#{colors[first]:06x}")[:3], float(opacities[first]))
            _stroke_on(pixels, places[first] - (left, top), places[last] - (left, top), thick, color)
        self._lay(pixels, (left, top))

    def mark(self, place: Spot, radius: float, sides: int, color: int, opacity: float) -> None:
        (left, right), (top, bottom) = (
            _pixels(at, at, radius + 1, extent) for at, extent in zip(place, self.image.size, strict=True)
        )
        if left >= right or top >= bottom:
            return
        x, y = np.arange(left, right) + 0.5 - place[0], np.arange(top, bottom)[:, None] + 0.5 - place[1]
        if sides:
            turns = (2 * np.arange(sides) + 1) * np.pi / sides  # across the edges
            away = np.max([x * np.cos(turn) + y * np.sin(turn) for turn in turns], axis=0)
            away -= radius * np.cos(np.pi / sides)
        else:
            away = np.hypot(x, y) - radius
        pixels = np.zeros((*away.shape, 4), np.uint8)
        pixels[..., :3] = rgba(f"#{color:06x}")[:3]
        pixels[..., 3] = np.round(255 * opacity * np.clip(0.5 - away, 0, 1))
        self._lay(pixels, (left, top))

    def ring(self, place: Spot, radius: float, width: float, color: int, opacity: float) -> None:
        count = max(12, min(round(2 * radius), 360))
        turns = 2 * np.pi * np.arange(count + 1) / count
        circle = radius * np.stack([np.cos(turns), np.sin(turns)], axis=1) + place
        none = np.zeros(count + 1, bool)
        self.polyline(circle, width, [color] * (count + 1), np.full(count + 1, opacity), none, 0.0)

    def shaded_text(self, left: float, top: float, text: str, opacity: float) -> None:
        for off, ink in ((1, (0, 0, 0)), (0, INK[:3])):
            place = round(left) + off, round(top + 0.855 * self.em) + off
            self._draw.text(place, text, (*ink, round(255 * opacity)), self._font, anchor="ls")

    def _lay(self, pixels: NDArray[np.uint8], place: tuple[int, int]) -> None:
        """Lay pixels, (H, W, 4), over what is there, with their upper left corner at a place."""
        from PIL import Image

        self.image.alpha_composite(Image.fromarray(pixels), place)

    def box(self, box: Box, color: Color) -> None:
        left, top, right, bottom = map(round, box)
        if left < right and top < bottom:  # else the picture is too small for it
            self._draw.rectangle((left, top, right - 1, bottom - 1), color)

    def gradient(self, box: Box, colors: NDArray[np.uint8]) -> None:
        from PIL import Image

        left, top, right, bottom = map(round, box)
        if left >= right or top >= bottom:
            return
        rows = colors[np.linspace(len(colors) - 1, 0, bottom - top).round().astype(int)]
        stripe = np.repeat(rows[:, None], right - left, axis=1)
        self.image.paste(Image.fromarray(np.ascontiguousarray(stripe)), (left, top))


def _pixels(one: float, other: float, reach: float, extent: int) -> tuple[int, int]:
    """The first pixel and the one after the last of a stroke from one place to another, in a picture."""
    return max(0, math.floor(min(one, other) - reach)), min(extent, math.ceil(max(one, other) + reach))


def _stroke_on(
    pixels: NDArray[np.uint8],
    start: NDArray[np.float64],
    stop: NDArray[np.float64],
    width: float,
    color: tuple[float, float, float, float],
) -> None:
    """Draw a line with round ends onto transparent pixels, (H, W, 4), where it covers more than what is
    there. color: bytes, and opacity from 0 to 1."""
    high, wide = pixels.shape[:2]
    left, right = _pixels(start[0], stop[0], width / 2 + 1, wide)
    top, bottom = _pixels(start[1], stop[1], width / 2 + 1, high)
    if left >= right or top >= bottom:
        return
    (first_x, first_y), (across, down) = start.tolist(), (stop - start).tolist()
    x = np.arange(left, right, dtype=np.float32) + 0.5 - first_x
    y = np.arange(top, bottom, dtype=np.float32)[:, None] + 0.5 - first_y
    along = np.clip((x * across + y * down) / max(across**2 + down**2, 1e-9), 0, 1)  # share of its length
    away = np.hypot(x - along * across, y - along * down)
    opacity = np.round(255 * color[3] * np.clip(width / 2 + 0.5 - away, 0, 1)).astype(np.uint8)
    there = pixels[top:bottom, left:right]
    is_more = opacity > there[..., 3]
    there[is_more, :3] = np.array(color[:3], np.uint8)
    there[is_more, 3] = opacity[is_more]

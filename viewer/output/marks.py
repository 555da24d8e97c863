"""Marks in the corners of a picture: a scale bar, what colours mean, a stamp.

They are alike in files and in the window. A `MarkPainter` draws them: `ImagePainter` for images, the window
has one of its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..look import ValueKind, color_table
from .labels import Box
from .legend import Color, Legend, quantity, range_note, scale_bar, shows_length, stamp, swatches, ticks

INK: Color = (245, 245, 245, 255)
PLATE: Color = (0, 0, 0, 170)  # light on dark, so that it is read on any picture
_LINES = 45  # of text that are as high as a picture
_LEAST_TEXT = 11.0  # pixels, where the picture has room for it
_TEXT_SHARE = 0.4  # the same of a text
_MAP_SHARE = 0.2  # of the picture's height that a colour map takes at most

# In heights of the text:
MARGIN, PAD, _GAP = 0.8, 0.5, 0.35
_TICK, _LINE = 0.5, 0.14  # height of a scale bar's ends, thickness of its line
_MAP_WIDTH, _MAP_HEIGHT = 1.0, 8.0
_SWATCH_LINE = 1.4  # from one swatch to the next


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
        bottom = size[1] - MARGIN * painter.em
        if values is not None:
            drawn.append(_draw_color_bar(painter, size, legend, values, kind))
            bottom = drawn[-1][1] - _GAP * painter.em
        if found := swatches(legend.look):
            drawn.append(_draw_swatches(painter, size, found, bottom))
    upper_left = [stamp(legend)] if legend.marks.stamp else []
    return [*drawn, *_draw_plates(painter, size, [*upper_left, *legend.notes])]


def scale_bar_box(painter: MarkPainter, size: tuple[float, float], legend: Legend) -> Box:
    """The place of the scale bar's plate."""
    em = painter.em
    _, pixels = scale_bar(legend.camera, size, legend.factor)
    width = max(round(pixels), painter.width(_scale_text(painter, size, legend))) + 2 * PAD * em
    left, bottom = round(MARGIN * em), round(size[1] - MARGIN * em)
    return left, bottom - round((1 + _GAP + _TICK + 2 * PAD) * em), left + width, bottom


def _scale_text(painter: MarkPainter, size: tuple[float, float], legend: Legend) -> str:
    length, _ = scale_bar(legend.camera, size, legend.factor)
    return fitted_text(painter, f"{length:,.6g} {legend.unit}", _TEXT_SHARE * size[0])


def _draw_scale_bar(painter: MarkPainter, size: tuple[float, float], legend: Legend) -> Box:
    em = painter.em
    box = left, top, right, bottom = scale_bar_box(painter, size, legend)
    painter.box(box, PLATE)
    text, pixels = _scale_text(painter, size, legend), round(scale_bar(legend.camera, size, legend.factor)[1])
    painter.text((left + right - painter.width(text)) / 2, top + PAD * em, text)
    start, foot = round((left + right - pixels) / 2), round(bottom - PAD * em)
    line, tick = max(1, round(_LINE * em)), max(2, round(_TICK * em))
    for x in (start, start + pixels - line):
        painter.box((x, foot - tick, x + line, foot), INK)
    painter.box((start + line, foot - line, start + pixels - line, foot), INK)
    return box


def _draw_color_bar(
    painter: MarkPainter,
    size: tuple[float, float],
    legend: Legend,
    values: tuple[float, float],
    kind: ValueKind | None,
) -> Box:
    """Draw it lower right; returns where it is."""
    em = painter.em
    title = fitted_text(painter, quantity(legend.look, legend.unit, kind), _TEXT_SHARE * size[0])
    note = fitted_text(painter, range_note(legend), _TEXT_SHARE * size[0])
    factor = legend.factor if shows_length(legend.look, kind) else 1.0
    labels = ticks(factor * values[0], factor * values[1], kind)
    widest = (_MAP_WIDTH + _GAP) * em + max(painter.width(text) for _, text in labels)
    widest = max(widest, painter.width(title), painter.width(note))
    height = min(_MAP_HEIGHT * em, _MAP_SHARE * size[1])
    right, bottom = round(size[0] - MARGIN * em), round(size[1] - MARGIN * em)
    left = round(right - widest - 2 * PAD * em)
    top = round(bottom - height - (2.5 + (1 + _GAP if note else 0) + 2 * PAD) * em)
    box = left, top, right, bottom
    painter.box(box, PLATE)
    left += round(PAD * em)
    painter.text(left, top + round(PAD * em), title)
    if note:
        painter.text(left, top + round((PAD + 1 + _GAP) * em), note)
    foot = bottom - round((PAD + 0.5) * em)
    colors = color_table(legend.look.color_map)
    painter.gradient((left, foot - round(height), left + round(_MAP_WIDTH * em), foot), colors)
    for share, text in labels:
        painter.text(left + (_MAP_WIDTH + _GAP) * em, foot - share * height - em / 2, text)
    return box


def _draw_swatches(
    painter: MarkPainter, size: tuple[float, float], swatches: list[tuple[Color, str]], bottom: float
) -> Box:
    em, line = painter.em, round(_SWATCH_LINE * painter.em)
    texts = [fitted_text(painter, text, _TEXT_SHARE * size[0]) for _, text in swatches]
    right = round(size[0] - MARGIN * em)
    left = round(right - max(map(painter.width, texts)) - (_MAP_WIDTH + _GAP + 2 * PAD) * em)
    top = round(bottom - PAD * em) - len(swatches) * line
    painter.box((left, top, right, bottom), PLATE)
    for place, ((color, _), text) in enumerate(zip(swatches, texts, strict=True)):
        x, y = left + round(PAD * em), top + round(PAD * em) + place * line
        painter.box((x, y, x + round(_MAP_WIDTH * em), y + round(em)), color)
        painter.text(x + (_MAP_WIDTH + _GAP) * em, y, text)
    return left, top, right, bottom


def _draw_plates(painter: MarkPainter, size: tuple[float, float], texts: Sequence[str]) -> list[Box]:
    """Draw texts below each other upper left; returns where they are."""
    em, left = painter.em, round(MARGIN * painter.em)
    boxes: list[Box] = []
    height = round((1 + 2 * PAD) * em)
    for number, line in enumerate(texts):
        text, top = fitted_text(painter, line, size[0] - 2 * (MARGIN + PAD) * em), left + number * height
        boxes.append((left, top, left + painter.width(text) + 2 * PAD * em, top + height))
        painter.box(boxes[-1], PLATE)
        painter.text(left + PAD * em, top + PAD * em, text)
    return boxes


def fitted_text(painter: MarkPainter, text: str, room: float) -> str:
    """Shorten a text that is wider than this room, pixels: it ends in an ellipsis then."""
    if painter.width(text) <= room:
        return text
    while text and painter.width(text + "…") > room:
        text = text[:-1]
    return text + "…"

"""A painter of images: marks, lines and text over transparent pixels."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..look import rgba
from ..resources import resource_path
from .labels import Box, Spot
from .legend import Color
from .marks import INK, text_height


class ImagePainter:
    """A `MarkPainter` and `OverlayPainter` of transparent pixels."""

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

    def band(self, edges: NDArray[np.float64], color: int, opacity: float) -> None:
        """Fill between two lines. edges: (N, 3), across, and the heights of both lines there; NaN: a gap."""
        from PIL import Image, ImageDraw

        cover = Image.new("L", self.image.size)
        fill = ImageDraw.Draw(cover)
        there = np.logical_and.reduce(np.isfinite(edges), axis=1)
        for at in np.flatnonzero(there[:-1] & there[1:]).tolist():
            (x, low, high), (next_x, next_low, next_high) = edges[at : at + 2].tolist()
            fill.polygon([(x, low), (next_x, next_low), (next_x, next_high), (x, high)], round(255 * opacity))
        pixels = np.zeros((*cover.size[::-1], 4), np.uint8)
        pixels[..., :3], pixels[..., 3] = rgba(f"#{color:06x}")[:3], np.asarray(cover)
        self._lay(pixels, (0, 0))

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

"""Measurements over the 3D view: their ends, lines and labels, and the clicks that set ends."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from imgui_bundle import ImVec2, imgui

from ...camera import Camera
from ...geometry import Vector
from ...measurement import End, Reading
from .. import notices, theme
from ..scene import navigation
from .measuring import distance_words

if TYPE_CHECKING:
    from ..app import App

_LINE, _OUTLINE = 0x58D6F0, 0x000000  # light on dark, so that it is seen on any surface
_DIM = 0.35  # opacity where an end is not seen
_END, _THICK = 0.28, 0.11  # radius, thickness; in heights of the font
_HEAD = 2.6  # of the view's head, where the banner is


def draw(app: App, size: ImVec2) -> None:
    """Draw over the view, the last item of the current ImGui window, and take its clicks.

    size: of the view.
    """
    measuring, camera = app.measuring, app.session.camera
    if camera is None or app.playback.pose is None:
        return
    if measuring.active:
        _take_mouse(app)
    readings = measuring.readings()
    measuring.watch(readings)
    view = ViewPlace(camera, imgui.get_item_rect_min(), size)
    labels = [
        box for number, reading in enumerate(readings, 1) if (box := _draw_one(app, view, number, reading))
    ]
    _draw_labels(labels, view)
    if begun := measuring.here.begun:
        _draw_begun(app, view, begun)


def _take_mouse(app: App) -> None:
    """A click sets an end; a drag turns the view, as ever."""
    elsewhere = imgui.is_popup_open("", imgui.PopupFlags_.any_popup) or imgui.is_any_item_active()
    if imgui.is_key_pressed(imgui.Key.escape) and not elsewhere:
        app.measuring.toggle()
        return
    if imgui.is_item_hovered():
        imgui.set_mouse_cursor(imgui.MouseCursor_.hand)
    is_released = imgui.is_item_deactivated() and imgui.is_mouse_released(0)
    if is_released and may_click() and imgui.is_item_hovered() and not imgui.get_io().key_shift:
        at = (imgui.get_mouse_pos() - imgui.get_item_rect_min()) * app.window.pixel_ratio
        app.measuring.click((math.floor(at.x), math.floor(at.y)))


def may_click() -> bool:
    """Whether the left button has hardly been moved since it was pressed."""
    moved = imgui.get_mouse_drag_delta(0)
    return not (moved.x or moved.y)


class ViewPlace:
    """Where places of the scan are on the screen. corner: of the view, upper left."""

    def __init__(self, camera: Camera, corner: ImVec2, size: ImVec2) -> None:
        self.camera, self.corner, self.size = camera, corner, size

    def clipped(self, start: ImVec2, stop: ImVec2) -> tuple[ImVec2, ImVec2] | None:
        """The part of a line on the screen that is in the view, None where none is."""
        begin, end, along = 0.0, 1.0, stop - start
        far = self.corner + self.size
        for place, step, low, high in (
            (start.x, along.x, self.corner.x, far.x),
            (start.y, along.y, self.corner.y, far.y),
        ):
            if step:
                enter, leave = sorted(((low - place) / step, (high - place) / step))
                begin, end = max(begin, enter), min(end, leave)
            elif not low <= place <= high:
                return None
        return (start + along * begin, start + along * end) if begin <= end else None

    def on_screen(self, position: Vector) -> ImVec2 | None:
        """None behind the eye."""
        place = navigation.place(self.camera, position)
        if place is None:
            return None
        return self.corner + self.size * 0.5 + ImVec2(place[0] * self.size.y, -place[1] * self.size.y)


class _Label:
    """Lines of text on a plate, beside a line on the screen. faint: whether it is dimmed."""

    def __init__(self, lines: Sequence[str], start: ImVec2, stop: ImVec2, faint: bool) -> None:
        self.lines, self.faint = lines, faint
        em = imgui.get_font_size()
        self.pad = ImVec2(0.4 * em, 0.2 * em)
        extents = [imgui.calc_text_size(line) for line in lines]
        self.extent = ImVec2(max(e.x for e in extents), sum(e.y for e in extents))
        # Upward at a right angle to the line, so far that the plate does not cover it.
        along = stop - start
        length = math.hypot(along.x, along.y)
        across = ImVec2(along.y, -along.x) / length if length else ImVec2(0, -1)
        if across.y > 0:
            across = across * -1
        plate = self.extent + self.pad * 2
        away = (abs(across.x) * plate.x + abs(across.y) * plate.y) / 2 + 2 * _END * em
        self.corner = (start + stop) * 0.5 + across * away - self.extent * 0.5

    def keep_within(self, corner: ImVec2, size: ImVec2) -> None:
        """Move it so that all of it is in a rectangle."""
        low, high = corner + self.pad, corner + size - self.pad - self.extent
        self.corner = ImVec2(max(low.x, min(self.corner.x, high.x)), max(low.y, min(self.corner.y, high.y)))

    def overlaps(self, other: _Label) -> bool:
        """Whether the plates do."""
        gap = self.pad + other.pad
        ends, other_ends = self.corner + self.extent + gap, other.corner + other.extent + gap
        return (
            self.corner.x < other_ends.x and other.corner.x < ends.x
            and self.corner.y < other_ends.y and other.corner.y < ends.y
        )  # fmt: skip

    def draw(self) -> None:
        """Text in the theme's colours on a plate of the theme, which is read on any picture."""
        draw_list = imgui.get_window_draw_list()
        plate = imgui.get_color_u32(imgui.Col_.window_bg, 0.92)
        ends = self.corner + self.extent
        draw_list.add_rect_filled(self.corner - self.pad, ends + self.pad, plate, self.pad.x)
        at = ImVec2(self.corner.x, self.corner.y)
        for number, line in enumerate(self.lines):
            color = imgui.Col_.text_disabled if number or self.faint else imgui.Col_.text
            draw_list.add_text(at, imgui.get_color_u32(color), line)
            at.y += imgui.calc_text_size(line).y


def _draw_one(app: App, view: ViewPlace, number: int, reading: Reading) -> _Label | None:
    """Draw ends and line of a measurement; returns its label, None where nothing of it is in the view."""
    ends = reading.measurement.ends
    alpha = 1.0 if all([app.measuring.is_seen(end) for end in ends]) else _DIM
    places = [view.on_screen(end.position) for end in ends]
    there = [place for place in places if place is not None]
    if len(there) == 2:
        _draw_line(there[0], there[1], alpha)
    for end, place in zip(ends, places, strict=True):
        if place is not None:
            _draw_end(end, place, alpha)
    seen = view.clipped(there[0], there[-1]) if there else None
    if seen is None:
        return None
    lines = [f"{number}:  {distance_words(reading, app.unit)}"]
    if len(app.playback.timeline) > 1:
        lines.append(reading.motion)
    return _Label(lines, *seen, alpha < 1)


def _draw_labels(labels: Sequence[_Label], view: ViewPlace) -> None:
    """Draw them in the view, below the banner, each below those before it that it would overlap."""
    placed: list[_Label] = []
    head = ImVec2(0, _HEAD * imgui.get_font_size())
    for label in labels:
        label.keep_within(view.corner + head, view.size - head)
        while in_way := [other for other in placed if label.overlaps(other)]:
            lowest = max(other.corner.y + other.extent.y + other.pad.y for other in in_way)
            label.corner.y = lowest + label.pad.y + 1
        label.draw()
        placed.append(label)


def _draw_begun(app: App, view: ViewPlace, begun: End) -> None:
    """The first end, and a line from there to the mouse."""
    place = view.on_screen(begun.position)
    if place is None:
        return
    if imgui.is_item_hovered() and app.measuring.active:
        _draw_line(place, imgui.get_mouse_pos(), 0.7)
    _draw_end(begun, place, 1.0)


def _draw_line(start: ImVec2, stop: ImVec2, alpha: float) -> None:
    draw_list, thick = imgui.get_window_draw_list(), _THICK * imgui.get_font_size()
    draw_list.add_line(start, stop, theme.packed(_OUTLINE, 0.6 * alpha), thick + 2)
    draw_list.add_line(start, stop, theme.packed(_LINE, alpha), thick)


def _draw_end(end: End, place: ImVec2, alpha: float) -> None:
    """A disc at a point, a ring on the surface."""
    draw_list, em = imgui.get_window_draw_list(), imgui.get_font_size()
    if end.snapped == "point":
        draw_list.add_circle_filled(place, _END * em + 1, theme.packed(_OUTLINE, 0.6 * alpha))
        draw_list.add_circle_filled(place, _END * em, theme.packed(_LINE, alpha))
    else:
        draw_list.add_circle(place, _END * em, theme.packed(_OUTLINE, 0.6 * alpha), thickness=_THICK * em + 2)
        draw_list.add_circle(place, _END * em, theme.packed(_LINE, alpha), thickness=_THICK * em)


def draw_banner(app: App, size: ImVec2) -> None:
    """Say what a click does while it measures. size: of the view."""
    if not app.measuring.active:
        return
    which = "second" if app.measuring.here.begun else "first"
    text = f"Measuring: click the {which} place.  Esc ends."
    em, extent = imgui.get_font_size(), imgui.calc_text_size(text)
    corner = ImVec2((size.x - extent.x) / 2, 0.9 * em)
    notices.draw_text(text, corner, extent, extent.x + em, ImVec2(0.8 * em, 0.4 * em))

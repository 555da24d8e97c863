"""Measurements over the 3D view: their ends, lines and labels, and the clicks that set ends."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from imgui_bundle import ImVec2, imgui

from ....analysis.measure import End, Reading
from ....camera import Camera
from ....geometry import Vector
from ... import notices, theme
from ...scene import navigation
from ...scene.labels import Box, Line, free_place, usual_place
from . import distance_words

if TYPE_CHECKING:
    from ...app import App

_LINE, _OUTLINE = 0x58D6F0, 0x000000  # light on dark, so that it is seen on any surface
_DIM = 0.35  # opacity where an end is not seen
_END, _THICK = 0.28, 0.11  # radius, thickness; in heights of the font
_GAP = 0.5  # between a line and its label
_HEAD = 2.6  # of the view's head, where the banner is


def draw(app: App, size: ImVec2) -> None:
    """Draw over the view, the last item of the current ImGui window, and take its clicks.

    size: of the view.
    """
    measuring, camera = app.measuring, app.document.camera
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
    _draw_labels(labels, view, _boxes_of_ends(view, readings))
    if begun := measuring.begun:
        _draw_begun(app, view, begun)


def _take_mouse(app: App) -> None:
    """A click sets an end; a drag turns the view, as ever."""
    if imgui.is_item_hovered():
        imgui.set_mouse_cursor(imgui.MouseCursor_.hand)
    is_released = imgui.is_item_deactivated() and imgui.is_mouse_released(0)
    is_first = imgui.get_io().mouse_clicked_last_count[0] == 1  # not the second of a double click
    may_set = is_first and may_click() and not imgui.get_io().key_shift
    if is_released and may_set and imgui.is_item_hovered():
        at = (imgui.get_mouse_pos() - imgui.get_item_rect_min()) * app.window.pixel_ratio
        app.measuring.click((math.floor(at.x), math.floor(at.y)))


def may_click() -> bool:
    """Whether the left button has hardly been moved since it was pressed."""
    moved = imgui.get_mouse_drag_delta(0)
    return not (moved.x or moved.y)


class ViewPlace:
    """Where places of the scan are on the screen. corner: of the view, upper left. box: the view."""

    def __init__(self, camera: Camera, corner: ImVec2, size: ImVec2) -> None:
        self.camera, self.corner, self.size = camera, corner, size
        self.box = Box(corner, corner + size)

    def on_screen(self, position: Vector) -> ImVec2 | None:
        """None behind the eye."""
        place = navigation.place(self.camera, position)
        if place is None:
            return None
        return self.corner + self.size * 0.5 + ImVec2(place[0] * self.size.y, -place[1] * self.size.y)


class _Label:
    """Lines of text on a plate. line: beside which, on the screen. faint: whether it is dimmed."""

    def __init__(self, texts: Sequence[str], line: Line, faint: bool) -> None:
        self.texts, self.line, self.faint = texts, line, faint
        em = imgui.get_font_size()
        self._pad = ImVec2(0.4 * em, 0.2 * em)
        extents = [imgui.calc_text_size(text) for text in texts]
        self.size = ImVec2(max(e.x for e in extents), sum(e.y for e in extents)) + self._pad * 2

    def in_short(self) -> _Label:
        """Its number alone."""
        return _Label([self.texts[0].partition(":")[0]], self.line, self.faint)

    def draw(self, box: Box) -> None:
        """Text in the theme's colours on a plate of the theme, which is read on any picture."""
        draw_list = imgui.get_window_draw_list()
        draw_list.add_rect_filled(
            box.low, box.high, imgui.get_color_u32(imgui.Col_.window_bg, 0.92), self._pad.x
        )
        at = box.low + self._pad
        for number, text in enumerate(self.texts):
            color = imgui.Col_.text_disabled if number or self.faint else imgui.Col_.text
            draw_list.add_text(at, imgui.get_color_u32(color), text)
            at.y += imgui.calc_text_size(text).y


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
    seen = view.box.clipped(there[0], there[-1]) if there else None
    if seen is None:
        return None
    lines = [f"{number}:  {distance_words(reading, app.unit)}"]
    if len(app.playback.timeline) > 1:
        lines.append(reading.motion)
    return _Label(lines, seen, alpha < 1)


def _draw_labels(labels: Sequence[_Label], view: ViewPlace, taken: list[Box]) -> None:
    """Draw them in the view, below the banner, off each other and what is taken; in short where there is no
    room, and then in full under the mouse."""
    em = imgui.get_font_size()
    lines = [label.line for label in labels]
    area = Box(view.box.low + ImVec2(0, _HEAD * em), view.box.high)
    for label in labels:
        short, gap = label.in_short(), _GAP * em
        if (box := free_place(label.size, label.line, gap, area, taken, lines)) is not None:
            label.draw(box)
        else:
            box = free_place(short.size, label.line, gap, area, taken, lines)
            box = box or usual_place(short.size, label.line, gap, area)
            short.draw(box)
            if imgui.is_item_hovered() and imgui.is_mouse_hovering_rect(box.low, box.high):
                imgui.set_tooltip("\n".join(label.texts))
        taken.append(box)


def _boxes_of_ends(view: ViewPlace, readings: Sequence[Reading]) -> list[Box]:
    side = 2 * _END * imgui.get_font_size() + 2
    places = [view.on_screen(end.position) for reading in readings for end in reading.measurement.ends]
    return [Box.around(place, ImVec2(side, side)) for place in places if place is not None]


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


def draw_banner(app: App, size: ImVec2) -> float:
    """Say what a click does while it measures; returns where that ends, 0 without. size: of the view."""
    if not app.measuring.active:
        return 0.0
    which = "second" if app.measuring.begun else "first"
    text = f"Measuring: click the {which} place.  Esc ends."
    em, extent = imgui.get_font_size(), imgui.calc_text_size(text)
    corner = ImVec2((size.x - extent.x) / 2, 0.9 * em)
    notices.draw_text(text, corner, extent, extent.x + em, ImVec2(0.8 * em, 0.4 * em))
    return corner.y + extent.y + 0.4 * em

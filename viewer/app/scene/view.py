"""The 3D view: the mouse moves the camera; notes lie over the picture."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

from imgui_bundle import ImVec2, imgui

from ...camera import Camera
from ...files import printable
from ...geometry import Vector
from ...scan.pose import Pose
from .. import notices, theme, widgets
from . import cube, navigation, up_menu
from .canvas import ViewPlace

if TYPE_CHECKING:
    from ..app import App

_PIVOT = 0xF0C24B

_BUTTONS = (
    imgui.ButtonFlags_.mouse_button_left
    | imgui.ButtonFlags_.mouse_button_middle
    | imgui.ButtonFlags_.mouse_button_right
)
_RED = 0xE0483E  # 0xRRGGBB


def draw(app: App) -> None:
    """Declare the view in the current ImGui window, which it fills."""
    size, told = imgui.get_content_region_avail(), app.failures.told
    the_cube, has_cube = app.steering.cube, app.steering.cube.is_shown and not app.full_view.is_on
    camera = app.document.camera and app.glide.seen(app.document.camera)  # that the picture shows
    cube.take_mouse(app.steering, app.document, camera, size, has_cube)
    on_menu = (
        has_cube
        and app.document.camera is not None
        and up_menu.declare(
            app.steering, app.document.look.up, size, lambda: app.commands.of["pick_up"].act(app)
        )
    )
    if the_cube.under_mouse is not None or on_menu:
        imgui.set_next_item_allow_overlap()  # so that the view is not hovered there
    imgui.invisible_button("view", size, _BUTTONS)
    with told("Finding what is under the mouse"):
        app.pointer.point_at(_pixel(app) if imgui.is_item_hovered() else None)
    if app.document.camera is not None and app.playback.pose is not None:
        with told("Moving the view"):
            _move(app, app.playback.pose, size)
        with told("Tools"):
            _serve_tools(app, size)
    with told("The cube"):
        if has_cube:
            cube.draw(the_cube, app.document, camera, app.palette, size)
    with told("Scale bar and colour bar"):
        app.marks.draw(size)
    text = printable(words_over(app) or "")
    if app.naming.name is not None:
        text = "\n".join(filter(None, (app.naming.name, text)))
    if text:
        _draw_note(text, size)
    else:
        _draw_prompt(app.tools.prompt, size)
    app.notices.draw(size)
    if app.capture.recorder is not None:
        _draw_recording_mark()


def _move(app: App, pose: Pose, size: ImVec2) -> None:
    """Take what the mouse does to the camera."""
    sets_pivot = imgui.is_mouse_double_clicked(0) and not app.tools.takes_clicks
    if imgui.is_item_hovered() and sets_pivot:
        app.steering.set_pivot()
    radius = app.viewport.bounds(pose).radius
    _take_drag(app, size, radius)
    if imgui.is_item_hovered() and imgui.get_io().mouse_wheel:
        _take_wheel(app, size, radius)
    camera, pivot = app.document.camera, app.document.pivot
    if camera and pivot and imgui.is_item_hovered():
        _draw_pivot(app.glide.seen(camera), pivot, size)


def _take_drag(app: App, size: ImVec2, radius: float) -> None:
    io, camera, gesture = imgui.get_io(), app.document.camera, app.steering.gesture
    assert camera is not None
    if imgui.is_item_activated():
        app.tools.is_dragging = False
        if imgui.is_mouse_clicked(0) and not io.key_shift:
            app.tools.press(imgui.get_mouse_pos())
        app.steering.gesture = None if app.tools.is_dragging else _gesture(io)
        app.steering.turntable.stop()
    elif gesture == "orbit" and app.tools.clicking and widgets.is_click():
        pass  # so that a click does not turn the view
    elif gesture:
        # The move that ends with the release counts as well, that of the press does not.
        right, up = io.mouse_delta.x / size.y, -io.mouse_delta.y / size.y
        app.steering.drag(gesture, right, up, radius)
    if not imgui.is_item_active():
        app.steering.gesture = None


def _serve_tools(app: App, size: ImVec2) -> None:
    """Let tools have their clicks, and draw over the picture."""
    is_hovered = imgui.is_item_hovered()
    if app.tools.is_dragging and not widgets.is_click():
        app.tools.drag(_pixel(app), ends=imgui.is_item_deactivated())
    elif app.tools.clicking and is_hovered:
        imgui.set_mouse_cursor(imgui.MouseCursor_.hand)
        is_released = imgui.is_item_deactivated() and imgui.is_mouse_released(0)
        is_first = imgui.get_io().mouse_clicked_last_count[0] == 1  # not the second of a double click
        if is_released and is_first and widgets.is_click() and not imgui.get_io().key_shift:
            app.tools.click(_pixel(app))
    if camera := app.document.camera:
        place = ViewPlace(app.glide.seen(camera), imgui.get_item_rect_min(), size, is_hovered)
        app.tools.draw_over(place, app.marks.boxes)


def _take_wheel(app: App, size: ImVec2, radius: float) -> None:
    camera = app.document.camera
    assert camera is not None
    at = imgui.get_mouse_pos() - imgui.get_item_rect_min() - size * 0.5
    seen = app.pointer.picked.place if app.pointer.picked else None
    notches = imgui.get_io().mouse_wheel
    app.steering.zoom(navigation.wheel(camera, notches, (at.x / size.y, -at.y / size.y), radius, seen))


def _pixel(app: App) -> tuple[int, int]:
    """The picture's pixel under the mouse."""
    at = (imgui.get_mouse_pos() - imgui.get_item_rect_min()) * app.window.pixel_ratio
    return math.floor(at.x), math.floor(at.y)


def _draw_pivot(camera: Camera, pivot: Vector, size: ImVec2) -> None:
    """A ring round the point that the view turns about."""
    place = camera.place_in_picture(pivot)
    if place is None:
        return
    center = imgui.get_item_rect_min() + size * 0.5 + ImVec2(place[0] * size.y, -place[1] * size.y)
    radius = 0.4 * imgui.get_font_size()
    draw_list = imgui.get_window_draw_list()
    # Light on dark, so that it is seen on any surface.
    draw_list.add_circle(center, radius, theme.packed(0x000000, 0.6), thickness=0.25 * radius + 2)
    draw_list.add_circle(center, radius, theme.packed(_PIVOT), thickness=0.25 * radius)


def _gesture(io: imgui.IO) -> str:
    if io.mouse_down[1]:
        return "zoom"
    return "pan" if io.mouse_down[2] or io.key_shift else "orbit"


def words_over(app: App) -> str | None:
    """The words over the picture: why it is not what was asked for."""
    playback = app.playback
    if app.viewport.problem:
        return str(app.viewport.problem)
    if app.replayer.replaying is not None:
        return str(app.replayer.replaying)
    if playback.pose is None:
        return str(playback.problem) if playback.problem else None
    if playback.player.playing or playback.pose.index == app.session.index:
        return _words_on_nothing(app)
    return f"{playback.problem}\nYou see {playback.pose.label} instead." if playback.problem else None


def _words_on_nothing(app: App) -> str | None:
    """The words over a picture at rest that shows nothing: why, and which key helps."""
    counts = app.counting.counts
    if (
        counts is None
        or not app.counting.is_blank
        or app.playback.pose is None
        or not app.playback.pose.count
    ):
        return None
    if counts["drawn"] + counts["hidden"] and not app.rendering.levels.get(0, True):
        return words_on_levels(app.rendering.levels, app.keys.of["switch_level_0"])
    key = app.keys.of["fit"]
    return "Nothing is in view" + (f": press {key} to show all" if key else "")


def words_on_levels(levels: Mapping[int, bool], key: str) -> str:
    """Say that the levels that a renderer shows have no data in view. levels: whether each is shown. key:
    that shows what was measured."""
    shown = [f"{level}" for level, is_shown in levels.items() if is_shown]
    if not shown:
        what = "All levels are off"
    elif len(shown) == 1:
        what = f"Level {shown[0]} has no data here"
    else:
        what = f"Levels {', '.join(shown[:-1])} and {shown[-1]} have no data here"
    return what + (f"; press {key}" if key else "")


def _draw_note(text: str, size: ImVec2) -> None:
    """Say something at the top of the view."""
    em = imgui.get_font_size()
    wrap = max(10 * em, min(0.7 * size.x, 40 * em))
    extent = imgui.calc_text_size(text, wrap_width=wrap)
    corner = ImVec2((size.x - extent.x) / 2, 2 * em)
    notices.draw_text(text, corner, extent, wrap, ImVec2(em, 0.6 * em))


def _draw_prompt(text: str, size: ImVec2) -> None:
    """Say what a click does, where there is something to say."""
    if text:
        em = imgui.get_font_size()
        wrap = max(8 * em, size.x - 2 * em)
        extent = imgui.calc_text_size(text, wrap_width=wrap)
        corner = ImVec2((size.x - extent.x) / 2, 0.9 * em)
        notices.draw_text(text, corner, extent, wrap, ImVec2(0.8 * em, 0.4 * em))


def _draw_recording_mark() -> None:
    """A red dot in the upper left corner."""
    em, text = imgui.get_font_size(), "recording"
    extent = imgui.calc_text_size(text)
    corner = ImVec2(2.6 * em, 1.4 * em)
    notices.draw_text(text, corner, extent, extent.x + em, ImVec2(1.6 * em, 0.4 * em))
    center = imgui.get_window_pos() + corner + ImVec2(-0.8 * em, extent.y / 2)
    imgui.get_window_draw_list().add_circle_filled(center, 0.36 * em, theme.packed(_RED))

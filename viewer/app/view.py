"""The 3D view: the mouse moves the camera; notes lie over the picture."""

from __future__ import annotations

from typing import TYPE_CHECKING

from imgui_bundle import ImVec2, imgui

from ..camera import Camera
from . import navigation, theme

if TYPE_CHECKING:
    from .app import App

_BUTTONS = (
    imgui.ButtonFlags_.mouse_button_left
    | imgui.ButtonFlags_.mouse_button_middle
    | imgui.ButtonFlags_.mouse_button_right
)


def draw(app: App) -> None:
    """Declare the view in the current ImGui window, which it fills."""
    size = imgui.get_content_region_avail()
    imgui.invisible_button("view", size, _BUTTONS)
    if app.session.camera is not None and app.playback.pose is not None:
        radius = app.picture.bounds(app.playback.pose).radius
        app.session.camera = _navigate(app, app.session.camera, size, radius)
    text = _note(app)
    if text:
        _draw_note(text, size)


def _navigate(app: App, camera: Camera, size: ImVec2, radius: float) -> Camera:
    io = imgui.get_io()
    if imgui.is_item_activated():
        app.gesture = _gesture(io)
    elif app.gesture:
        # The move that ends with the release counts as well, that of the press does not.
        right, up = io.mouse_delta.x / size.y, -io.mouse_delta.y / size.y
        if app.gesture == "zoom":
            camera = navigation.zoom(camera, up, radius)
        else:
            move = navigation.orbit if app.gesture == "orbit" else navigation.pan
            camera = move(camera, right, up)
    if not imgui.is_item_active():
        app.gesture = None
    if imgui.is_item_hovered() and io.mouse_wheel:
        at = imgui.get_mouse_pos() - imgui.get_item_rect_min() - size * 0.5
        camera = navigation.wheel(camera, io.mouse_wheel, (at.x / size.y, -at.y / size.y), radius)
    return camera


def _gesture(io: imgui.IO) -> str:
    if io.mouse_down[1]:
        return "zoom"
    return "pan" if io.mouse_down[2] or io.key_shift else "orbit"


def _note(app: App) -> str | None:
    """What to say over the picture: why it is not what was asked for."""
    playback = app.playback
    if app.picture.problem:
        return str(app.picture.problem)
    if app.opening:
        return f"Opening {app.opening} ..."
    if playback.pose is None:
        return str(playback.problem) if playback.problem else "Loading ..."
    if playback.player.playing or playback.pose.index == app.session.index:
        return None
    if playback.problem:
        return f"{playback.problem}\n{playback.pose.label} is shown instead."
    return f"Loading {playback.timeline.label(app.session.index)} ..."


def _draw_note(text: str, size: ImVec2) -> None:
    em = imgui.get_font_size()
    wrap = max(10 * em, min(0.7 * size.x, 40 * em))
    extent = imgui.calc_text_size(text, wrap_width=wrap)
    corner = ImVec2((size.x - extent.x) / 2, 2 * em)
    draw_list = imgui.get_window_draw_list()
    pad = ImVec2(em, 0.6 * em)
    draw_list.add_rect_filled(corner - pad, corner + extent + pad, theme.packed(theme.PANEL, 0.92), 0.4 * em)
    imgui.set_cursor_pos(corner)
    imgui.push_text_wrap_pos(corner.x + wrap)
    imgui.text_unformatted(text)
    imgui.pop_text_wrap_pos()

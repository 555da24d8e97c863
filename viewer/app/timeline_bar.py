"""The bar at the bottom: playing, the frames as a track, and the latest message."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from imgui_bundle import ImVec2, imgui
from imgui_bundle import icons_fontawesome_4 as icons
from numpy.typing import NDArray

from . import theme, widgets

if TYPE_CHECKING:
    from .app import App

_TRACK, _CACHED, _BROKEN, _HEAD = 0x33383F, 0x4A6B86, 0xD2544B, 0xF0F2F5


def draw(app: App) -> None:
    """Declare the bar in the current ImGui window."""
    playback = app.playback
    player, several = playback.player, len(playback.timeline) > 1
    if widgets.icon_button(icons.ICON_FA_STEP_BACKWARD, "Previous frame (Left)", several):
        app.step(-1)
    imgui.same_line()
    icon = icons.ICON_FA_PAUSE if player.playing else icons.ICON_FA_PLAY
    if widgets.icon_button(icon, "Play or pause (Space)", several):
        app.toggle_play()
    imgui.same_line()
    if widgets.icon_button(icons.ICON_FA_STEP_FORWARD, "Next frame (Right)", several):
        app.step(1)
    imgui.same_line()
    loop = imgui.checkbox("loop", player.loop)[0]
    imgui.set_item_tooltip("Play round the end (L)")
    if loop:
        app.toggle_loop()
    imgui.same_line()
    _draw_place(app)
    imgui.same_line()
    _draw_track(app)
    _draw_status(app)


def _draw_place(app: App) -> None:
    """Time and frame, in a width that does not change while playing."""
    timeline, index = app.playback.timeline, app.session.index
    last = f"{timeline.times[-1]:.2f} s    {len(timeline)}/{len(timeline)}"
    left = imgui.get_cursor_pos_x()
    imgui.align_text_to_frame_padding()
    imgui.text(f"{timeline.times[index]:.2f} s    {index + 1}/{len(timeline)}")
    imgui.set_item_tooltip(timeline.label(index))
    imgui.same_line(left + imgui.calc_text_size(last).x + imgui.get_font_size())


def _draw_track(app: App) -> None:
    """The frames over time: cached ones lighter, broken ones red. A press or a drag goes there."""
    size = ImVec2(imgui.get_content_region_avail().x, imgui.get_frame_height())
    if size.x < 1:
        return
    imgui.invisible_button("track", size)
    playback = app.playback
    track = _Track(playback.player.edges, imgui.get_item_rect_min(), size)
    if imgui.is_item_active() or imgui.is_item_deactivated():
        app.seek(playback.player.frame_at(track.time(imgui.get_mouse_pos().x)))
    track.bar(0, len(playback.timeline), _TRACK)
    for run in playback.timeline.cached():
        track.bar(run.start, run.stop, _CACHED)
    for index in playback.timeline.broken:
        track.bar(index, index + 1, _BROKEN)
    track.head(app.session.index, _HEAD if playback.problem is None else _BROKEN)


class _Track:
    """Where times lie on the screen. edges: as a Player has them."""

    def __init__(self, edges: NDArray[np.float64], corner: ImVec2, size: ImVec2) -> None:
        self.edges, self.corner, self.size = edges, corner, size
        self.draw_list = imgui.get_window_draw_list()

    def x(self, time: float) -> float:
        """The place of a time."""
        return self.corner.x + time / float(self.edges[-1]) * self.size.x

    def time(self, x: float) -> float:
        """The time at a place."""
        return (x - self.corner.x) / self.size.x * float(self.edges[-1])

    def bar(self, start: int, stop: int, color: int) -> None:
        """Mark a run of frames, at least two pixels wide."""
        left, right = self.x(self.edges[start]), self.x(self.edges[stop])
        top, bottom = self.corner.y + 0.32 * self.size.y, self.corner.y + 0.68 * self.size.y
        corners = ImVec2(left, top), ImVec2(max(right, left + 2), bottom)
        self.draw_list.add_rect_filled(*corners, theme.packed(color))

    def head(self, index: int, color: int) -> None:
        """Mark the middle of the current frame."""
        x = (self.x(self.edges[index]) + self.x(self.edges[index + 1])) / 2
        half = 0.14 * self.size.y
        corners = ImVec2(x - half, self.corner.y), ImVec2(x + half, self.corner.y + self.size.y)
        self.draw_list.add_rect_filled(*corners, theme.packed(color), half)


def _draw_status(app: App) -> None:
    imgui.spacing()
    playback = app.playback
    name = f"{playback.timeline.name}   {playback.timeline.label(app.session.index)}"
    right = imgui.get_content_region_avail().x - imgui.calc_text_size(name).x
    if app.notes:
        imgui.text_disabled(app.notes[-1])
        imgui.set_item_tooltip(app.notes[-1])
        imgui.same_line()
    imgui.set_cursor_pos_x(imgui.get_cursor_start_pos().x + right)
    imgui.text_disabled(name)

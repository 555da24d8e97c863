"""The bar at the bottom: playing, the frames as a track, and what is under the mouse."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from imgui_bundle import ImVec2, imgui
from imgui_bundle import icons_fontawesome_6 as icons
from numpy.typing import NDArray

from ...scan.times import frame_in_words
from .. import theme, widgets
from ..keys import Keys
from ..menus import Commands
from ..notices import Notices
from ..part import WindowPart
from ..scene.pointed import Pointer
from ..scene.viewport import Viewport
from ..session import Session
from ..tasks import Tasks
from ..toolbox import Toolbox
from ..window_look import WindowLook
from .playback import Playback
from .player import SPEEDS
from .thumbnails import Thumbnails

_SPEED_WIDTH = 4.6  # in heights of the font
_STEPS, _PACES = 4, 3  # buttons
_SHORTEST_TRACK = 8.0
_BAR = (0.12, 0.4)  # of the track's height, where the frames are
_SPANS = (0.0, 0.12)  # the same of what tools mark
_TICKS = 0.5  # where their numbers begin
_HANDLE = 0.2  # half the width of what sets an end
_GRAB = 1.5  # of that, how near the mouse has to be
_FIRST, _LAST = 1, 2
_TICK_TEXT = 0.75  # heights of the font
_TICK_ROOM = 7.0  # from one to the next at least, in heights of their text
_WORK_SHARE = 0.4  # of the status bar's width, for work that goes on
_GAP = "    "  # between what is said of the point under the mouse


@dataclass(eq=False)
class TimelineBar(WindowPart):
    """Declares the bar."""

    name = "timeline_bar"
    session: Session
    playback: Playback
    viewport: Viewport
    tools: Toolbox
    thumbnails: Thumbnails
    pointer: Pointer
    notices: Notices
    tasks: Tasks
    commands: Commands
    keys: Keys
    window_look: WindowLook

    def draw(self) -> None:
        """Declare the bar in the current ImGui window. Where it is narrow, the track has its room first: how
        the scan plays moves into a list, and the time goes."""
        several = len(self.playback.timeline) > 1
        em, gap = imgui.get_font_size(), imgui.get_style().item_spacing.x
        button = widgets.ICON_WIDTH * imgui.get_frame_height() + gap
        time_width = _widest_time(self.playback) + em
        room = imgui.get_content_region_avail().x - _STEPS * button - _SHORTEST_TRACK * em
        has_pace = room > _PACES * button + _SPEED_WIDTH * em + gap + time_width
        imgui.begin_disabled(not several)
        self._draw_steps()
        if has_pace:
            self._draw_pace()
        else:
            self._draw_list_of_pace()
        imgui.end_disabled()
        if has_pace or room > button + time_width:
            _draw_time(self.playback, time_width)
        report = _report(self.playback) if self.playback.player.playing else ""
        # Its width stays while it says nothing: the track must not move under the mouse.
        room = (
            imgui.calc_text_size(_rates("100", "100", "10000 skipped")).x + imgui.get_style().item_spacing.x
        )
        width = imgui.get_content_region_avail().x
        is_wide = several and width - room > _SHORTEST_TRACK * imgui.get_font_size()
        self._draw_track(width - room if is_wide else width)
        if is_wide:
            imgui.same_line()
            imgui.text_disabled(report)
            widgets.tooltip(
                "How many frames per second you see, and how many the scan has at this speed. "
                "Scan4D skips frames that it cannot load or draw in time"
            )
        _draw_status(self.playback, self.pointer, self.notices, self.tasks)

    def _draw_steps(self) -> None:
        """Buttons that go somewhere or start to."""
        playing = self.playback.player.playing
        for icon, name in (
            (icons.ICON_FA_BACKWARD_FAST, "first"),
            (icons.ICON_FA_BACKWARD_STEP, "back"),
            (icons.ICON_FA_PAUSE if playing else icons.ICON_FA_PLAY, "play"),
            (icons.ICON_FA_FORWARD_STEP, "next"),
        ):
            self._draw_button(icon, name)

    def _draw_button(self, icon: str, name: str, color: int | None = None, about: str = "") -> None:
        """The button of a command. about: what more its tooltip says."""
        # By its name: the keyboard stays with it where the icon changes.
        if widgets.icon_button(f"{icon}###{name}", self.keys.hint(name) + about, color):
            self.commands.of[name].act()
        imgui.same_line()

    def _draw_pace(self) -> None:
        """Declare how it plays."""
        pace, accent = self.session.pace, self.window_look.palette.accent
        for icon, name, about in (
            (
                icons.ICON_FA_ARROW_ROTATE_RIGHT,
                "loop",
                ": start again at the first frame after the last frame",
            ),
            (icons.ICON_FA_BACKWARD, "reverse", ""),
            (icons.ICON_FA_FILM, "every_frame", ": show every frame, even if playback gets slower"),
        ):
            self._draw_button(icon, name, accent if getattr(pace, name) else None, about)
        imgui.set_next_item_width(_SPEED_WIDTH * imgui.get_font_size())
        titles = {f"{speed:g}": f"{speed:.1f}x" for speed in (*SPEEDS, pace.speed)}
        chosen = float(widgets.combo("speed", f"{pace.speed:g}", [f"{speed:g}" for speed in SPEEDS], titles))
        hints = (self.keys.hint(name) for name in ("slower", "faster", "speed_1"))
        widgets.tooltip("Playback speed. " + ", ".join(hints))
        if chosen != pace.speed:
            self.playback.change(time.monotonic(), speed=chosen)
        imgui.same_line()

    def _draw_list_of_pace(self) -> None:
        """Declare a button that opens how the scan plays."""
        if widgets.icon_button(
            f"{icons.ICON_FA_CARET_DOWN}###pace", "Playback options: loop, direction, speed"
        ):
            imgui.open_popup("how it plays")
        corner = imgui.get_item_rect_min() - ImVec2(0, imgui.get_style().item_spacing.y)
        imgui.set_next_window_pos(corner, imgui.Cond_.always, ImVec2(0, 1))
        if imgui.begin_popup("how it plays"):
            self._draw_pace()
            imgui.end_popup()
        imgui.same_line()

    def _draw_track(self, width: float) -> None:
        """Draw the frames over time: cached ones coloured, broken ones red, and seconds. A press or a drag
        goes there; a tooltip describes the frame under the mouse."""
        playback, palette, height = self.playback, self.window_look.palette, imgui.get_frame_height()
        inset = ImVec2(_GRAB * _HANDLE * height, 0)  # so that handles at the ends are grabbed by either half
        if width < 2 * inset.x + 1:
            return
        imgui.invisible_button("track", ImVec2(width, height))
        spans = self.tools.spans
        track = _Track(
            playback.whole.edges, imgui.get_item_rect_min() + inset, ImVec2(width, height) - inset * 2
        )
        timeline, frame = playback.timeline, playback.whole.frame_at(track.time(imgui.get_mouse_pos().x))
        if imgui.is_item_active() or imgui.is_item_deactivated():
            storage, grabbed = imgui.get_state_storage(), imgui.get_id("grabbed")
            if imgui.is_item_activated():
                storage.set_int(grabbed, track.grabbed(playback.span, imgui.get_mouse_pos()))
            if end := storage.get_int(grabbed):
                playback.set_end(end == _LAST, frame)
            else:
                playback.seek(frame, time.monotonic())
        if len(timeline) > 1:
            if imgui.is_item_hovered():
                self._draw_frame(frame, [span.words for span in spans if frame in span.frames])
            track.seconds(float(timeline.times[0]), playback.span)
        track.bar(0, len(playback.timeline), palette.frame[0])
        for run in playback.timeline.cached():
            track.bar(run.start, run.stop, palette.cached)
        for index in playback.timeline.broken:
            track.bar(index, index + 1, palette.broken)
        for span in spans:
            track.bar(span.frames.start, span.frames.stop, span.color, _SPANS)
        if len(playback.timeline) > 1:
            track.ends(playback.span, palette.accent)
            track.head(playback.session.index, palette.text if playback.problem is None else palette.broken)

    def _draw_frame(self, frame: int, marks: Sequence[str]) -> None:
        """Describe a frame beside the mouse: a small picture, its time and its name, and its marks."""
        timeline, camera = self.playback.timeline, self.session.document.camera
        if imgui.begin_tooltip():
            if camera is not None:
                self.thumbnails.draw(timeline, frame, camera, self.viewport.aspect)
            words = [frame_in_words(frame), timeline.label(frame)]
            imgui.text("\n".join((f"{timeline.times[frame]:.2f} s", *dict.fromkeys(words), *marks)))
            imgui.end_tooltip()


def _draw_time(playback: Playback, width: float) -> None:
    """Write time and frame, in a width that does not change while playing."""
    timeline, index = playback.timeline, playback.session.index
    left = imgui.get_cursor_pos_x()
    imgui.align_text_to_frame_padding()
    imgui.text(_time_and_frame(timeline.times[index], index, len(timeline)))
    widgets.tooltip(timeline.label(index))
    imgui.same_line(left + width)


def _widest_time(playback: Playback) -> float:
    times, count = playback.timeline.times, len(playback.timeline)
    ends = (_time_and_frame(time, count - 1, count) for time in (times[0], times[-1]))
    return max(imgui.calc_text_size(text).x for text in ends)


def _time_and_frame(time: float, index: int, count: int) -> str:
    return f"{time:.2f} s    {index + 1}/{count}"


def _report(playback: Playback) -> str:
    pace = playback.session.pace
    shown, due = (
        f"{rate:.0f}" if playback.player.rate >= 10 else f"{rate:.1f}"
        for rate in (playback.rate, playback.player.rate)
    )
    return _rates(shown, due, "every frame" if pace.every_frame else f"{playback.dropped} skipped")


def _rates(shown: str, due: str, more: str) -> str:
    return f"playing {shown} of {due} frames/s ({more})"


class _Track:
    """The track on the screen, along which times lie. edges: as a Player has them."""

    def __init__(self, edges: NDArray[np.float64], corner: ImVec2, size: ImVec2) -> None:
        self.edges, self.corner, self.size = edges, corner, size
        self.draw_list = imgui.get_window_draw_list()

    def x(self, time: float) -> float:
        """The position of a time, pixels."""
        return self.corner.x + time / float(self.edges[-1]) * self.size.x

    def time(self, x: float) -> float:
        """The time at a position."""
        return (x - self.corner.x) / self.size.x * float(self.edges[-1])

    def bar(self, start: int, stop: int, color: int, shares: tuple[float, float] = _BAR) -> None:
        """Mark a run of frames, at least two pixels wide. shares: of the height, where it is."""
        left, right = self.x(self.edges[start]), self.x(self.edges[stop])
        top, bottom = (self.corner.y + share * self.size.y for share in shares)
        corners = ImVec2(left, top), ImVec2(max(right, left + 2), bottom)
        self.draw_list.add_rect_filled(*corners, theme.packed(color))

    def seconds(self, first: float, span: range) -> None:
        """Mark round times below the bar, with as many numbers as there is room for. first: of the first
        frame, which the scan's times may begin at. span: the frames between handles, which numbers avoid."""
        size, font = _TICK_TEXT * imgui.get_font_size(), imgui.get_font()
        duration = float(self.edges[-1])
        step = tick_step(duration, self.size.x / (_TICK_ROOM * size))
        decimals = max(0, -math.floor(math.log10(step)))
        top, middle = (self.corner.y + share * self.size.y for share in (_BAR[1], _TICKS))
        color = imgui.get_color_u32(imgui.Col_.text_disabled)
        reach = _HANDLE * self.size.y + 0.2 * size
        ends = (self.x(self.edges[index]) for index in (span.start, span.stop))
        handles = [(end - reach, end + reach) for end in ends]
        for number in range(math.ceil(first / step), math.floor((first + duration) / step) + 1):
            x, text = self.x(number * step - first), f"{number * step:.{decimals}f} s"
            self.draw_list.add_line(ImVec2(x, top), ImVec2(x, middle), color)
            wide = imgui.calc_text_size(text).x * _TICK_TEXT
            left = beside(x - wide / 2, wide, handles, self.corner.x, self.corner.x + self.size.x)
            self.draw_list.add_text(font, size, ImVec2(left, middle), color, text)

    def ends(self, span: range, color: int) -> None:
        """Mark the frames that are played: a handle below either end, a line between where not all are."""
        top, half = self.corner.y + _BAR[1] * self.size.y, _HANDLE * self.size.y
        left, right = self.x(self.edges[span.start]), self.x(self.edges[span.stop])
        if len(span) < len(self.edges) - 1:
            line = ImVec2(left, top), ImVec2(right, top + 0.25 * half)
            self.draw_list.add_rect_filled(*line, theme.packed(color))
        for x in (left, right):
            corners = ImVec2(x, top), ImVec2(x - half, top + 1.5 * half), ImVec2(x + half, top + 1.5 * half)
            self.draw_list.add_triangle_filled(*corners, theme.packed(color))

    def grabbed(self, span: range, mouse: ImVec2) -> int:
        """The end whose handle is under the mouse, _FIRST or _LAST; 0 where none is."""
        half = _HANDLE * self.size.y
        if mouse.y > self.corner.y + _BAR[1] * self.size.y:
            for end, index in ((_LAST, span.stop), (_FIRST, span.start)):
                if abs(mouse.x - self.x(self.edges[index])) <= _GRAB * half:
                    return end
        return 0

    def head(self, index: int, color: int) -> None:
        """Mark the middle of the current frame."""
        x = (self.x(self.edges[index]) + self.x(self.edges[index + 1])) / 2
        half = 0.14 * self.size.y
        bottom = self.corner.y + (_BAR[0] + _BAR[1]) * self.size.y
        corners = ImVec2(x - half, self.corner.y), ImVec2(x + half, bottom)
        self.draw_list.add_rect_filled(*corners, theme.packed(color), half)


def tick_step(duration: float, most: float) -> float:
    """Seconds from one tick to the next: 1, 2 or 5 times a power of ten, so that there are at most so many in
    the duration, or one where that is less."""
    least = duration / max(most, 1.0)
    power = 10.0 ** math.floor(math.log10(least))
    return next(factor * power for factor in (1, 2, 5, 10) if factor * power >= least)


def beside(
    left: float, wide: float, taken: Sequence[tuple[float, float]], first: float, last: float
) -> float:
    """Move a text aside as little as needed; returns where it begins. left, wide: of the text. taken: from
    where to where it must not be. first, last: of the room for it."""
    starts = [left, *(to for _, to in taken), *(start - wide for start, _ in taken)]
    free = [
        edge for edge in (min(max(edge, first), last - wide) for edge in starts)
        if all(edge + wide <= start or to <= edge for start, to in taken)
    ]  # fmt: skip
    return min(free, key=lambda edge: abs(edge - left), default=min(max(left, first), last - wide))


def _pointed(words: list[str], room: float) -> str:
    """Join as many words on what is under the mouse as there is room for."""
    while words and imgui.calc_text_size(text := _GAP.join(words)).x > room:
        words = words[:-1]
    return text if words else ""


def _draw_status(playback: Playback, pointer: Pointer, notices: Notices, tasks: Tasks) -> None:
    """Show the work that goes on, what is under the mouse, else the latest message; the names of scan and
    frame."""
    imgui.spacing()
    width, gap = imgui.get_content_region_avail().x, 2 * imgui.get_font_size()
    names = playback.timeline.name, playback.timeline.label(playback.session.index)
    name = "   ".join(widgets.fitted(one, width / 4) for one in names)
    left = width - imgui.calc_text_size(name).x
    tasks.draw(_WORK_SHARE * width)
    if tasks.shown:
        imgui.same_line(0, gap)
    room = left - gap - (imgui.get_cursor_pos_x() - imgui.get_cursor_start_pos().x)
    text = _pointed(pointer.words, room)
    if not text:
        text = widgets.fitted(notices.latest, room)
    imgui.text_disabled(text)
    imgui.same_line()
    imgui.set_cursor_pos_x(imgui.get_cursor_start_pos().x + left)
    imgui.text_disabled(name)
    widgets.tooltip("\n".join(names))

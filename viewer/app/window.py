"""The window: an OpenGL context, ImGui in it, and waiting for events.

moderngl-window makes the window; ImGui's own C++ backends, which imgui-bundle carries, take
in its events and draw the widgets. The loop is the app's, since theirs draw all the time.
"""

from __future__ import annotations

import ctypes
import os
import sys
import time
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Annotated, Any

import glfw
from imgui_bundle import imgui, implot
from moderngl_window.context.glfw.window import Window as GlfwWindow

from ..document.schema import Kind
from ..errors import NoOpenGLError
from ..gpu import gl
from ..gpu.context import obstacle
from ..gpu.shader_cache import shader_cache
from . import theme

_GL = (4, 3)
_SIZE = (1600, 1000)
_LEAST = (640, 420)  # times the display's scale; in less, menus and timeline are cut
_SCREEN_SHARE = 0.9  # that a window takes at most
_SETTLE_FRAMES = 3  # until ImGui has taken in an event: press, release, layout
_DOUBLE_CLICK = 0.3  # seconds from one press to the next at most, without what frames take
_TOOLTIP_DELAY = 0.6  # seconds; ImGui shows tooltips a moment after the last event
_MODIFIERS = {
    glfw.KEY_LEFT_CONTROL, glfw.KEY_RIGHT_CONTROL, glfw.KEY_LEFT_SHIFT, glfw.KEY_RIGHT_SHIFT,
    glfw.KEY_LEFT_ALT, glfw.KEY_RIGHT_ALT, glfw.KEY_LEFT_SUPER, glfw.KEY_RIGHT_SUPER,
}  # fmt: skip
_UNUSED_KEY = imgui.Key.f24
_ENDS_ALT = (imgui.backends.glfw_mouse_button_callback, imgui.backends.glfw_window_focus_callback)


Area = tuple[int, int, int, int]  # left, top, width, height; screen coordinates

_LEAST_SIDE = 160  # width and height that a window keeps
_GRIP = 80  # of its upper edge that must be on a screen, so that a mouse can drag it
_FARTHEST = 2**15  # from the origin of the screens
Pixels = Annotated[int, Kind("a position on the screen, in pixels", lambda value: abs(value) < _FARTHEST)]


@dataclass(frozen=True)
class WindowPlacement:
    """A window without its frame, in screen coordinates; where it goes back to while it is maximised."""

    left: Pixels
    top: Pixels
    width: Pixels
    height: Pixels
    maximised: bool = False


def reachable(placement: WindowPlacement, screens: Sequence[Area]) -> WindowPlacement | None:
    """The placement, no larger than its screen; None where no screen shows enough of its upper edge."""
    for left, top, width, height in screens:
        visible = min(placement.left + placement.width, left + width) - max(placement.left, left)
        if visible >= _GRIP and top <= placement.top <= top + height - _GRIP:
            fitted = (
                max(_LEAST_SIDE, min(placement.width, width)),
                max(_LEAST_SIDE, min(placement.height, height)),
            )
            return WindowPlacement(placement.left, placement.top, *fitted, placement.maximised)
    return None


class Window(GlfwWindow):
    """Opens at once. Raises NoOpenGLError where there is no display or no OpenGL for it."""

    def __init__(self, title: str, placement: WindowPlacement | None = None) -> None:
        """placement: where it was before; the usual one where that is None, or on no screen any more."""
        problems: list[str] = []

        def note_problem(code: int, text: Any) -> None:
            problems.append(text.decode(errors="replace"))

        glfw.set_error_callback(note_problem)
        if sys.platform.startswith("linux"):
            # moderngl finds a window's context through GLX; on Wayland that is XWayland's.
            glfw.init_hint(glfw.PLATFORM, glfw.PLATFORM_X11)
        try:
            if not glfw.init():
                raise ValueError("no display")
            shader_cache()
            super().__init__(title=title, gl_version=_GL, size=_initial_size(), vsync=True, visible=False)
        except Exception as error:  # moderngl and moderngl-window raise bare Exceptions
            glfw.terminate()
            problems += filter(None, (str(error), obstacle()))
            raise NoOpenGLError(
                f"no window can be opened ({'; '.join(problems)})",
                hint=(
                    "The window needs a display and OpenGL 4.3. 'scan4d render' makes pictures without a "
                    "window; 'scan4d doctor' shows details"
                ),
            ) from error
        self.dropped: list[str] = []
        self._restore(placement)
        # On a scaled display it is larger than asked for, which moderngl-window does not notice.
        self._width, self._height = glfw.get_window_size(self._window)
        width, height = (round(side * self._display_scale) for side in _LEAST)
        glfw.set_window_size_limits(self._window, width, height, glfw.DONT_CARE, glfw.DONT_CARE)
        self.exit_key = self.fullscreen_key = None
        glfw.set_window_attrib(self._window, glfw.AUTO_ICONIFY, False)  # a full screen beside others stays
        self.text_scale = 1.0
        self._scale = 0.0  # of text and widgets in ImGui's coordinates, as it is set
        self._is_key_pressed = False  # since a modifier changed
        self._is_alt_alone = self._was_alt = False  # pressed without anything else; and released so
        self._frames_due = _SETTLE_FRAMES
        self._tooltips_at: float | None = None
        self._began = time.monotonic()  # when the last frame did
        self._waited = 0.0  # seconds of sleep since
        self._took: deque[float] = deque(maxlen=2)  # seconds from one frame to the next, without sleep
        self._start_imgui()
        self._take_events()

    def _take_events(self) -> None:
        """Whatever happens makes frames due, and goes to ImGui."""
        backends = imgui.backends
        for attach, forward in (
            (glfw.set_char_callback, backends.glfw_char_callback),
            (glfw.set_cursor_pos_callback, backends.glfw_cursor_pos_callback),
            (glfw.set_cursor_enter_callback, backends.glfw_cursor_enter_callback),
            (glfw.set_mouse_button_callback, backends.glfw_mouse_button_callback),
            (glfw.set_scroll_callback, backends.glfw_scroll_callback),
            (glfw.set_window_focus_callback, backends.glfw_window_focus_callback),
        ):  # fmt: skip
            attach(self._window, partial(self._take_event, forward))
        glfw.set_key_callback(self._window, self._take_key)
        glfw.set_window_refresh_callback(self._window, self._note_event)
        glfw.set_drop_callback(self._window, self._note_drop)  # type: ignore[arg-type]  # its stub is wrong
        self.resize_func = self._note_event

    def _take_event(self, forward: Callable[..., None], window: Any, *event: Any) -> None:
        self._note_event()
        if forward in _ENDS_ALT:
            self._is_alt_alone = False
        forward(_address(window), *event)

    def _note_event(self, *_: Any) -> None:
        self.touch()
        self._tooltips_at = time.monotonic() + _TOOLTIP_DELAY

    def _take_key(self, window: Any, key: int, *event: int) -> None:
        """Pass a key on to ImGui.

        A frame of ImGui has one state of the modifiers, the last one. So where one changes after a key was
        pressed, that is for the next frame: Ctrl+B typed in haste is not B.
        """
        if key not in _MODIFIERS:
            self._is_key_pressed = True
        elif self._is_key_pressed:
            self._is_key_pressed = False
            for down in (True, False):  # of one key ImGui takes in one change a frame
                imgui.get_io().add_key_event(_UNUSED_KEY, down)
        _, action, _ = event
        self._was_alt = self._was_alt or (
            key == glfw.KEY_LEFT_ALT and action == glfw.RELEASE and self._is_alt_alone
        )
        self._is_alt_alone = key == glfw.KEY_LEFT_ALT and action != glfw.RELEASE
        self._take_event(imgui.backends.glfw_key_callback, window, key, *event)

    def take_alt(self) -> bool:
        """Whether Alt was pressed and released since the last call, and nothing else meanwhile."""
        was_alt, self._was_alt = self._was_alt, False
        return was_alt

    def _note_drop(self, _: Any, paths: list[str]) -> None:
        self.dropped += paths
        self._note_event()

    def take_dropped(self) -> list[str]:
        """The files and folders that were dropped onto it since the last call."""
        paths, self.dropped = self.dropped, []
        return paths

    def _restore(self, placement: WindowPlacement | None) -> None:
        """Go where it was, and show."""
        found = placement and reachable(
            placement, [glfw.get_monitor_workarea(one) for one in glfw.get_monitors()]
        )
        if found:
            glfw.set_window_pos(self._window, found.left, found.top)
            glfw.set_window_size(self._window, found.width, found.height)
            if found.maximised:
                glfw.maximize_window(self._window)
        self._last_placement = found or None
        self.visible = True

    @property
    def placement(self) -> WindowPlacement | None:
        """The placement of the window; while it fills a screen or is an icon, that before. None: never
        seen."""
        seen = self._window, glfw.ICONIFIED
        if glfw.get_window_monitor(self._window) or glfw.get_window_attrib(*seen):
            return self._last_placement
        if glfw.get_window_attrib(self._window, glfw.MAXIMIZED):
            before = self._last_placement or WindowPlacement(
                *glfw.get_window_pos(self._window), *_initial_size()
            )
            self._last_placement = replace(before, maximised=True)
        else:
            size = glfw.get_window_size(self._window)
            self._last_placement = WindowPlacement(*glfw.get_window_pos(self._window), *size)
        return self._last_placement

    def _start_imgui(self) -> None:
        imgui.create_context()
        implot.create_context()
        imgui.get_io().set_ini_filename("")
        imgui.get_io().config_debug_highlight_id_conflicts = False  # tests look for these, users need not
        imgui.get_io().config_flags |= imgui.ConfigFlags_.nav_enable_keyboard.value
        imgui.backends.glfw_init_for_opengl(_address(self._window), False)
        imgui.backends.opengl3_init("#version 430")
        theme.add_fonts()
        theme.set_colors(theme.PALETTES[theme.DEFAULT])

    # --- the loop ---------------------------------------------------------------------

    def touch(self, frames: int = _SETTLE_FRAMES) -> None:
        """Something has changed that the next frames must show."""
        self._frames_due = max(self._frames_due, frames)

    @property
    def due(self) -> bool:
        """Whether a frame has to be drawn for what happened in the window."""
        return self._frames_due > 0

    def wait(self, seconds: float) -> float:
        """Handle events; sleep until one comes, a frame is due or the time is over.

        Returns how many seconds longer than that it took: another thread did not let this one go on.
        """
        start = time.monotonic()
        if self._tooltips_at is not None:
            seconds = min(seconds, self._tooltips_at - time.monotonic())
        if self.due or seconds <= 0:
            seconds = 0.0
        self._handle_events(seconds)
        self._waited += time.monotonic() - start
        late = max(0.0, time.monotonic() - start - seconds)
        if self._tooltips_at is not None and time.monotonic() >= self._tooltips_at:
            self._tooltips_at = None
            self.touch()
        return late

    def _handle_events(self, seconds: float) -> None:
        try:
            if seconds:
                glfw.wait_events_timeout(seconds)
            else:
                glfw.poll_events()
        except UnicodeDecodeError as error:  # by glfw's wrapper, of a dropped name
            self._note_drop(None, [os.fsdecode(error.object)])

    def begin(self) -> None:
        """Begin a frame: widgets may be declared from here on."""
        now = time.monotonic()
        self._took.append(now - self._began - self._waited)
        self._began, self._waited = now, 0.0
        if imgui.get_current_context().within_frame_scope:  # the one before did not come to its end
            imgui.end_frame()
        self._set_scale()
        imgui.backends.opengl3_new_frame()
        imgui.backends.glfw_new_frame()
        # ImGui takes in a press, a release and a press by three frames, however fast they came. So the time
        # of the two frames before does not count: a double click is one in a slow window, too.
        io, seconds = imgui.get_io(), _DOUBLE_CLICK + sum(self._took)
        io.mouse_double_click_time, io.mouse_single_click_delay = seconds, 2 * seconds  # more, for ImGui
        imgui.new_frame()
        # ImGui takes in one press or release of a key at a time.
        queued = imgui.get_current_context().input_events_queue.size()
        self._frames_due = max(0, self._frames_due - 1)
        if queued:
            self.touch()

    def _set_scale(self) -> None:
        """Follow the display that the window is on, and the user's choice."""
        if (scale := self._display_scale * self.text_scale) != self._scale:
            self._scale = scale
            theme.set_sizes(scale)
            self.touch()

    def end(self) -> None:
        """Draw the widgets over what is in the window, and show it."""
        imgui.render()
        self.ctx.screen.use()
        gl.default_clip_space()
        imgui.backends.opengl3_render_draw_data(imgui.get_draw_data())
        gl.reverse_depth()
        glfw.swap_buffers(self._window)

    def fill(self, color: int) -> None:
        """Paint all of it. color: 0xRRGGBB."""
        self.ctx.screen.use()
        self.ctx.viewport = (0, 0, *self.buffer_size)
        self.ctx.clear(*theme.rgb(color))

    @property
    def _display_scale(self) -> float:
        """The scale of the display that the window is on, in ImGui's coordinates."""
        return glfw.get_window_content_scale(self._window)[0] / self.pixel_ratio

    @property
    def pixel_ratio(self) -> float:
        """Pixels of the framebuffer for one of ImGui's; a minimised window has no size."""
        return self.buffer_width / self.width if self.width else 1.0

    @property
    def refresh_ms(self) -> float:
        """How long the screen shows a frame, milliseconds; 0 where it does not tell."""
        monitor = glfw.get_primary_monitor()
        rate = glfw.get_video_mode(monitor).refresh_rate if monitor else 0
        return 1e3 / rate if rate else 0.0

    def to_pixels(self, left: float, top: float, width: float, height: float) -> tuple[int, int, int, int]:
        """Convert ImGui's coordinates to the framebuffer's: (left, bottom, width, height) in pixels."""
        x, y, w, h = (round(v * self.pixel_ratio) for v in (left, top, width, height))
        return x, self.buffer_height - y - h, w, h

    def _set_fullscreen(self, value: bool) -> None:
        """Fill the monitor that the window is on, or no more; moderngl-window takes the primary one."""
        if value:
            self._rectangle = *glfw.get_window_pos(self._window), *glfw.get_window_size(self._window)
            monitor = _monitor_at(self._rectangle)
            (width, height), _, refresh = glfw.get_video_mode(monitor)
            glfw.set_window_monitor(self._window, monitor, 0, 0, width, height, refresh)
        else:
            no_monitor: Any = None
            glfw.set_window_monitor(self._window, no_monitor, *self._rectangle, glfw.DONT_CARE)

    def hide(self) -> None:
        """Take it off the screen before it is destroyed."""
        glfw.hide_window(self._window)

    def destroy(self) -> None:
        """Close the window and let go of its context."""
        imgui.backends.opengl3_shutdown()
        imgui.backends.glfw_shutdown()
        implot.destroy_context()
        imgui.destroy_context()
        super().destroy()


def _initial_size() -> tuple[int, int]:
    """The usual size, smaller where the screen is. glfw multiplies it by the display's scale."""
    monitor = glfw.get_primary_monitor()
    if not monitor:
        return _SIZE
    _, _, width, height = glfw.get_monitor_workarea(monitor)
    x_scale, y_scale = glfw.get_monitor_content_scale(monitor)
    return min(_SIZE[0], int(_SCREEN_SHARE * width / x_scale)), min(
        _SIZE[1], int(_SCREEN_SHARE * height / y_scale)
    )


def _address(window: Any) -> int:
    """The address of a glfw window, as ImGui takes it."""
    return ctypes.cast(window, ctypes.c_void_p).value or 0


def _monitor_at(rectangle: tuple[int, int, int, int]) -> Any:
    """The monitor that shows most of a window. rectangle: left, top, width, height on the screen."""

    def shared(monitor: Any) -> int:
        left, top = glfw.get_monitor_pos(monitor)
        size = glfw.get_video_mode(monitor).size
        across = min(rectangle[0] + rectangle[2], left + size.width) - max(rectangle[0], left)
        down = min(rectangle[1] + rectangle[3], top + size.height) - max(rectangle[1], top)
        return max(across, 0) * max(down, 0)

    return max(glfw.get_monitors(), key=shared)

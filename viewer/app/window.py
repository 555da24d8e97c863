"""The window: an OpenGL context, ImGui in it, and waiting for events.

moderngl-window makes the window; ImGui's own C++ backends, which imgui-bundle carries, take
in its events and draw the widgets. The loop is the app's, since theirs draw all the time.
"""

from __future__ import annotations

import ctypes
import sys
import time
from typing import Any

import glfw
from imgui_bundle import imgui
from moderngl_window.context.glfw.window import Window as GlfwWindow

from ..errors import NoOpenGLError
from ..gpu import gl
from . import theme

_GL = (4, 3)
_SIZE = (1600, 1000)
_SCREEN_SHARE = 0.9  # that a window takes at most
_SETTLE_FRAMES = 3  # until ImGui has taken in an event: press, release, layout
_TOOLTIP_DELAY = 0.6  # seconds; ImGui shows tooltips a moment after the last event


class Window(GlfwWindow):
    """Opens at once. Raises NoOpenGLError where there is no display or no OpenGL for it."""

    def __init__(self, title: str) -> None:
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
            super().__init__(title=title, gl_version=_GL, size=_initial_size(), vsync=True)
        except Exception as error:  # moderngl and moderngl-window raise bare Exceptions
            glfw.terminate()
            raise NoOpenGLError(
                f"no window can be opened ({'; '.join([*problems, str(error)])})",
                hint="It needs a display and OpenGL 4.3. 'scan4d render' makes pictures without a window; "
                "'scan4d doctor' tells more",
            ) from error
        # On a scaled display it is larger than asked for, which moderngl-window does not notice.
        self._width, self._height = glfw.get_window_size(self._window)
        self.exit_key = self.fullscreen_key = None
        self._frames_due = _SETTLE_FRAMES
        self._tooltips_at: float | None = None
        self._note_events()
        self._start_imgui()

    def _note_events(self) -> None:
        """Whatever happens makes frames due. ImGui's callbacks go on to call these."""
        for attach in (
            glfw.set_key_callback, glfw.set_char_callback, glfw.set_cursor_pos_callback,
            glfw.set_cursor_enter_callback, glfw.set_mouse_button_callback, glfw.set_scroll_callback,
            glfw.set_window_refresh_callback, glfw.set_window_focus_callback,
        ):  # fmt: skip
            attach(self._window, self._note_event)
        self.resize_func = self._note_event

    def _note_event(self, *_: Any) -> None:
        self.touch()
        self._tooltips_at = time.monotonic() + _TOOLTIP_DELAY

    def _start_imgui(self) -> None:
        imgui.create_context()
        imgui.get_io().set_ini_filename("")
        imgui.backends.glfw_init_for_opengl(ctypes.cast(self._window, ctypes.c_void_p).value or 0, True)
        imgui.backends.opengl3_init("#version 430")
        theme.apply(glfw.get_window_content_scale(self._window)[0] / self.pixel_ratio)

    # --- the loop ---------------------------------------------------------------------

    def touch(self, frames: int = _SETTLE_FRAMES) -> None:
        """Something has changed that the next frames must show."""
        self._frames_due = max(self._frames_due, frames)

    @property
    def due(self) -> bool:
        """Whether a frame has to be drawn for what happened in the window."""
        return self._frames_due > 0

    def wait(self, seconds: float) -> None:
        """Handle events; sleep until one comes, a frame is due or the time is over."""
        if self._tooltips_at is not None:
            seconds = min(seconds, self._tooltips_at - time.monotonic())
        if self.due or seconds <= 0:
            glfw.poll_events()
        else:
            glfw.wait_events_timeout(seconds)
        if self._tooltips_at is not None and time.monotonic() >= self._tooltips_at:
            self._tooltips_at = None
            self.touch()

    def begin(self) -> None:
        """Begin a frame: widgets may be declared from here on."""
        imgui.backends.opengl3_new_frame()
        imgui.backends.glfw_new_frame()
        imgui.new_frame()
        # ImGui takes in one press or release of a key at a time.
        queued = imgui.get_current_context().input_events_queue.size()
        self._frames_due = max(0, self._frames_due - 1)
        if queued:
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
    def pixel_ratio(self) -> float:
        """Pixels of the framebuffer for one of ImGui's; a minimised window has no size."""
        return self.buffer_width / self.width if self.width else 1.0

    def to_pixels(self, left: float, top: float, width: float, height: float) -> tuple[int, int, int, int]:
        """From ImGui's coordinates to the framebuffer: (left, bottom, width, height) in pixels."""
        x, y, w, h = (round(v * self.pixel_ratio) for v in (left, top, width, height))
        return x, self.buffer_height - y - h, w, h

    def destroy(self) -> None:
        """Close the window and let go of its context."""
        imgui.backends.opengl3_shutdown()
        imgui.backends.glfw_shutdown()
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

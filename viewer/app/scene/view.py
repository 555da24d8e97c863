"""The 3D view: the mouse moves the camera; notes lie over the picture."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from imgui_bundle import ImVec2, imgui

from ...camera import Camera
from ...files import printable
from ...geometry import Vector
from ...scan.pose import Pose
from ...scan.times import frame_in_words
from .. import notices, theme, widgets
from ..failures import Failures
from ..keys import Keys
from ..menus import Commands
from ..notices import Notices
from ..output.capture import Capture
from ..output.replaying import Replayer
from ..part import WindowPart
from ..playing.playback import Playback
from ..session import Session
from ..toolbox import Toolbox
from ..window import Window
from . import navigation, up_menu
from .canvas import ScreenView
from .counting import Counting
from .cube import OrientationCube
from .full_view import FullView
from .glide import Glide
from .legend import ViewMarks
from .pointed import Pointer
from .rendering import Rendering
from .steering import Steering
from .switching import Switching
from .viewport import Viewport

_PIVOT = 0xF0C24B

_BUTTONS = (
    imgui.ButtonFlags_.mouse_button_left
    | imgui.ButtonFlags_.mouse_button_middle
    | imgui.ButtonFlags_.mouse_button_right
)
_RED = 0xE0483E  # 0xRRGGBB


@dataclass(eq=False)
class SceneView(WindowPart):
    """The 3D view, with what lies over the picture."""

    name = "view"
    window: Window
    session: Session
    playback: Playback
    viewport: Viewport
    failures: Failures
    steering: Steering
    cube: OrientationCube
    glide: Glide
    pointer: Pointer
    tools: Toolbox
    marks: ViewMarks
    switching: Switching
    rendering: Rendering
    counting: Counting
    capture: Capture
    replayer: Replayer
    full_view: FullView
    notices: Notices
    commands: Commands
    keys: Keys

    def draw(self) -> None:
        """Declare the view in the current ImGui window, which it fills."""
        size, reported = imgui.get_content_region_avail(), self.failures.reported
        cube, has_cube = self.cube, self.cube.is_shown and not self.full_view.is_on
        camera = self.session.document.camera and self.glide.seen(
            self.session.document.camera
        )  # that the picture shows
        cube.take_mouse(camera, size, has_cube)
        on_menu = (
            has_cube
            and self.session.document.camera is not None
            and up_menu.declare(cube, self.session.document.look.up, size, self.commands.of["pick_up"].act)
        )
        if cube.under_mouse is not None or on_menu:
            imgui.set_next_item_allow_overlap()  # so that the view is not hovered there
        imgui.invisible_button("view", size, _BUTTONS)
        with reported("Finding what is under the mouse"):
            self.pointer.point_at(self._pixel() if imgui.is_item_hovered() else None)
        if self.session.document.camera is not None and self.playback.pose is not None:
            with reported("Moving the view"):
                self._move(self.playback.pose, size)
            with reported("Tools"):
                self._serve_tools(size)
        with reported("The cube"):
            if has_cube:
                cube.draw(camera, size)
        with reported("Scale bar and colour bar"):
            self.marks.draw(size)
        text = printable(self.words_over() or "")
        if self.switching.caption is not None:
            text = "\n".join(filter(None, (self.switching.caption, text)))
        if text:
            _draw_note(text, size)
        else:
            _draw_prompt(self.tools.prompt, size)
        self.notices.draw(size)
        if self.capture.recorder is not None:
            _draw_recording_mark()

    def _move(self, pose: Pose, size: ImVec2) -> None:
        """Take what the mouse does to the camera."""
        sets_pivot = imgui.is_mouse_double_clicked(0) and not self.tools.takes_clicks
        if imgui.is_item_hovered() and sets_pivot:
            self.steering.set_pivot()
        radius = self.viewport.bounds(pose).radius
        self._take_drag(size, radius)
        if imgui.is_item_hovered() and imgui.get_io().mouse_wheel:
            self._take_wheel(size, radius)
        camera, pivot = self.session.document.camera, self.session.document.pivot
        if camera and pivot and imgui.is_item_hovered():
            _draw_pivot(self.glide.seen(camera), pivot, size)

    def _take_drag(self, size: ImVec2, radius: float) -> None:
        io, camera, gesture = imgui.get_io(), self.session.document.camera, self.steering.gesture
        assert camera is not None
        if imgui.is_item_activated():
            self.tools.is_dragging = False
            if imgui.is_mouse_clicked(0) and not io.key_shift:
                self.tools.press(imgui.get_mouse_pos())
            self.steering.gesture = None if self.tools.is_dragging else _gesture(io)
            self.steering.turntable.stop()
        elif gesture == "orbit" and self.tools.clicking and widgets.is_click():
            pass  # so that a click does not turn the view
        elif gesture:
            # The move that ends with the release counts as well, that of the press does not.
            right, up = io.mouse_delta.x / size.y, -io.mouse_delta.y / size.y
            self.steering.drag(gesture, right, up, radius)
        if not imgui.is_item_active():
            self.steering.gesture = None

    def _serve_tools(self, size: ImVec2) -> None:
        """Let tools have their clicks, and draw over the picture."""
        is_hovered = imgui.is_item_hovered()
        if self.tools.is_dragging and not widgets.is_click():
            self.tools.drag(self._pixel(), ends=imgui.is_item_deactivated())
        elif self.tools.clicking and is_hovered:
            imgui.set_mouse_cursor(imgui.MouseCursor_.hand)
            is_released = imgui.is_item_deactivated() and imgui.is_mouse_released(0)
            is_first = imgui.get_io().mouse_clicked_last_count[0] % 2 == 1  # not the second of a double click
            if is_released and is_first and widgets.is_click() and not imgui.get_io().key_shift:
                self.tools.click(self._pixel())
        if camera := self.session.document.camera:
            on_screen = ScreenView(self.glide.seen(camera), imgui.get_item_rect_min(), size, is_hovered)
            self.tools.draw_over(on_screen, self.marks.boxes)

    def _take_wheel(self, size: ImVec2, radius: float) -> None:
        camera = self.session.document.camera
        assert camera is not None
        at = imgui.get_mouse_pos() - imgui.get_item_rect_min() - size * 0.5
        seen = self.pointer.picked.place if self.pointer.picked else None
        notches = imgui.get_io().mouse_wheel
        self.steering.zoom(navigation.wheel(camera, notches, (at.x / size.y, -at.y / size.y), radius, seen))

    def _pixel(self) -> tuple[int, int]:
        """The picture's pixel under the mouse."""
        at = (imgui.get_mouse_pos() - imgui.get_item_rect_min()) * self.window.pixel_ratio
        return math.floor(at.x), math.floor(at.y)

    def words_over(self) -> str | None:
        """The words over the picture: why it is not what was asked for."""
        playback = self.playback
        if self.viewport.problem:
            return str(self.viewport.problem)
        if self.replayer.replaying is not None:
            return str(self.replayer.replaying)
        if playback.pose is None:
            return str(playback.problem) if playback.problem else None
        if playback.is_empty:
            return f"{frame_in_words(self.session.index).capitalize()} is empty"
        if playback.player.playing or playback.pose.index == self.session.index:
            return self._words_on_nothing()
        return (
            f"{playback.problem}\nThe view shows {playback.pose.label} instead." if playback.problem else None
        )

    def _words_on_nothing(self) -> str | None:
        """The words over a picture at rest that shows nothing: why, and which key helps."""
        counts = self.counting.counts
        if (
            counts is None
            or not self.counting.is_blank
            or self.playback.pose is None
            or not self.playback.pose.count
        ):
            return None
        if counts["drawn"] + counts["hidden"] and not self.rendering.levels.get(0, True):
            return words_on_levels(self.rendering.levels, self.keys.of["switch_level_0"])
        key = self.keys.of["fit"]
        return "Nothing is in view" + (f": press {key} to show all" if key else "")


def _draw_pivot(camera: Camera, pivot: Vector, size: ImVec2) -> None:
    """A ring round the point that the view turns about."""
    middle = camera.place_in_picture(pivot)
    if middle is None:
        return
    center = imgui.get_item_rect_min() + size * 0.5 + ImVec2(middle[0] * size.y, -middle[1] * size.y)
    radius = 0.4 * imgui.get_font_size()
    draw_list = imgui.get_window_draw_list()
    # Light on dark, so that it is seen on any surface.
    draw_list.add_circle(center, radius, theme.packed(0x000000, 0.6), thickness=0.25 * radius + 2)
    draw_list.add_circle(center, radius, theme.packed(_PIVOT), thickness=0.25 * radius)


def _gesture(io: imgui.IO) -> str:
    if io.mouse_down[1]:
        return "zoom"
    return "pan" if io.mouse_down[2] or io.key_shift else "orbit"


def words_on_levels(levels: Mapping[int, bool], key: str) -> str:
    """Say that the levels that a renderer shows have no data in view. levels: whether each is shown. key:
    that shows what was measured."""
    shown = [f"{level}" for level, is_shown in levels.items() if is_shown]
    if not shown:
        what = "All levels are off"
    elif len(shown) == 1:
        what = f"Level {shown[0]} has no pixels in this view"
    else:
        what = f"Levels {', '.join(shown[:-1])} and {shown[-1]} have no pixels in this view"
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

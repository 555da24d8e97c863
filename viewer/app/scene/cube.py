"""The orientation cube at the upper right of the 3D view: it turns with the camera, and turns it.

A widget over the view, declared before it, since ImGui gives the mouse to what is declared first. Its
letters are slanted rectangles of the font's picture.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from imgui_bundle import ImVec2, imgui
from numpy.typing import NDArray

from ...camera import Camera
from ...output.labels import CUBE_ROOM
from .. import theme, widgets
from ..commands import Command
from ..part import WindowPart, remembered
from ..session import Session
from ..window_look import WindowLook
from . import navigation, orientation
from .orientation import Direction
from .steering import Steering

_HALF = 1.55  # of an edge, in heights of the font
_REACH = _HALF * 3**0.5  # of the corners from the centre
_MARGIN = 0.5
_TEXT_HEIGHT = 0.57  # of a face's label, in half edges
_READABLE = 0.3  # cosine between line of sight and face from which its label is written
SHADE = 0.24  # how much darker a face is that is seen from the side


@dataclass(eq=False)
class OrientationCube(WindowPart):
    """The cube, and what the mouse does with it.

    is_held: the button went down on it; while it is dragged, `steering.is_turned` is true. on_up: the mouse
    is on the button below it. under_mouse: the part of the cube that is, None where none is.
    """

    name = "cube"
    session: Session
    steering: Steering
    window_look: WindowLook
    is_shown: bool = remembered(True)
    is_held: bool = field(default=False, init=False)
    on_up: bool = field(default=False, init=False)
    under_mouse: Direction | None = field(default=None, init=False)

    def toggle(self) -> None:
        """Show it, or hide it."""
        self.is_shown = not self.is_shown

    def take_mouse(self, seen: Camera | None, size: ImVec2, is_drawn: bool) -> None:
        """Let the mouse click and drag the cube; declare this before the view, so that it comes first.

        seen: the camera that the picture shows, which the document's may be ahead of; None before there is
        one. size: of the view. is_drawn: whether the cube is.
        """
        document, steering = self.session.document, self.steering
        where, camera = cube_position(size.x, size.y, imgui.get_font_size()), document.camera
        self.under_mouse = None
        if camera is None or seen is None or where is None or not is_drawn:
            self.is_held = steering.is_turned = False
            return
        x, y, half = where
        mouse = imgui.get_mouse_pos() - imgui.get_window_pos() - ImVec2(x, y)
        turned = orientation.rotation(seen, document.look.up, document.front)
        under = orientation.part_at(turned, mouse.x / half, -mouse.y / half)
        if under is None and not self.is_held:
            return
        before, reach = imgui.get_cursor_pos(), half * 3**0.5
        imgui.set_cursor_pos(ImVec2(x - reach, y - reach))
        clicked = imgui.invisible_button("cube", ImVec2(2 * reach, 2 * reach))
        imgui.set_cursor_pos(before)
        self.is_held = imgui.is_item_active()
        if imgui.is_item_hovered() or self.is_held:
            self.under_mouse = under
        if clicked and under is not None and not steering.is_turned:
            steering.look_from(*orientation.angles(under))
        steering.is_turned = self.is_held and (steering.is_turned or imgui.is_mouse_dragging(0))
        if steering.is_turned:
            steering.turntable.stop()
            # The cube's surface follows the mouse.
            delta = imgui.get_io().mouse_delta / (2 * reach)
            steering.move("Turn view", navigation.orbit(camera, delta.x, -delta.y, document.pivot))
        elif under is not None:
            widgets.tooltip(f"Look from {orientation.name(under)}")

    def draw(self, seen: Camera | None, size: ImVec2) -> None:
        """Draw the cube over the view in the current ImGui window. seen, size: as for `take_mouse`."""
        document, where = self.session.document, cube_position(size.x, size.y, imgui.get_font_size())
        if seen is None or where is None:
            return
        x, y, half = where
        turned = orientation.rotation(seen, document.look.up, document.front)
        corner = imgui.get_window_pos() + ImVec2(x, y)
        _Drawing(self, self.window_look.palette, turned, corner, half).draw()

    COMMANDS = (Command("cube", "Orientation cube", toggle, is_on=lambda cube: cube.is_shown),)


def cube_position(width: float, height: float, em: float) -> tuple[float, float, float] | None:
    """Centre from the view's upper left corner, and half an edge; None in a view that is too small.

    width, height: of the view. em: the font's height.
    """
    if min(width, height) < CUBE_ROOM * em:
        return None
    inset = (_REACH + _MARGIN) * em
    return width - inset, inset, _HALF * em


class _Drawing:
    """One picture of the cube. center: on the screen. half: an edge's half length."""

    def __init__(
        self,
        cube: OrientationCube,
        palette: theme.Palette,
        turned: NDArray[np.float64],
        center: ImVec2,
        half: float,
    ) -> None:
        self.palette, self.marked = palette, cube.under_mouse
        self.turned, self.center, self.half = turned, center, half
        self.draw_list = imgui.get_window_draw_list()

    def on_screen(self, points: NDArray[np.float64]) -> list[Any]:
        """Points of the cube, (N, 3), as ImGui takes them."""
        seen = points @ self.turned[:2].T * self.half
        return [self.center + ImVec2(right, -up) for right, up in seen]

    def draw(self) -> None:
        """The faces that are seen, with their names."""
        for face, axis in orientation.FACES.items():
            facing = float(self.turned[2] @ axis)
            if facing > 0.01:
                self.draw_face(axis, facing)
                if facing > _READABLE:
                    self.write(face.capitalize(), axis)

    def draw_face(self, face: Direction, facing: float) -> None:
        """One face, darker the less it faces the eye; what is under the mouse in another colour."""
        corners = self.on_screen(orientation.square(face))
        color = theme.mixed(self.palette.button[0], 0x000000, SHADE * (1 - facing))
        self.draw_list.add_convex_poly_filled(corners, theme.packed(color, 0.95))
        if self.marked and np.dot(face, self.marked) > 0:
            marked = self.on_screen(orientation.patch(face, self.marked))
            self.draw_list.add_convex_poly_filled(marked, theme.packed(self.palette.button[2]))
        line = theme.packed(self.palette.faint)
        self.draw_list.add_polyline(corners, line, self.half / 18, imgui.ImDrawFlags_.closed)

    def write(self, text: str, face: Direction) -> None:
        """The name of a face, lying in it: each letter a slanted rectangle of the font's picture."""
        right, up = orientation.writing(self.turned, face)
        font = imgui.get_font_baked()
        scale = _TEXT_HEIGHT / font.size
        glyphs = [font.find_glyph(ord(letter)) for letter in text]
        pen = -sum(glyph.advance_x for glyph in glyphs) / 2
        middle = (font.ascent - font.descent) / 2
        color = theme.packed(self.palette.text)
        for glyph in glyphs:
            left, top = pen + glyph.x0, glyph.y0 - middle
            across, down = pen + glyph.x1, glyph.y1 - middle
            places = np.array([(left, top), (across, top), (across, down), (left, down)]) * scale
            corners = self.on_screen(face + places[:, :1] * right - places[:, 1:] * up)
            self.draw_list.prim_reserve(6, 4)
            a, b, c, d = corners
            self.draw_list.prim_quad_uv(
                a, b, c, d,
                ImVec2(glyph.u0, glyph.v0), ImVec2(glyph.u1, glyph.v0),
                ImVec2(glyph.u1, glyph.v1), ImVec2(glyph.u0, glyph.v1), color,
            )  # fmt: skip
            pen += glyph.advance_x

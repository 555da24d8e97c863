"""The scale bar and the colour bar over the 3D view, laid out as on pictures."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from imgui_bundle import ImVec2, imgui
from numpy.typing import NDArray

from ...output import marks
from ...output.labels import Box
from ...output.legend import Color, Legend, Marks
from ..commands import Command
from ..part import WindowPart, remembered
from ..playing.playback import Playback
from ..playing.ranging import Ranging
from ..session import Session
from .steering import Steering
from .viewport import Viewport

SHOWN_FIRST = Marks(scale_bar=True, color_bar=True)  # until the user chooses
_OF_TOOLS = (
    "notes",
    "landmarks",
    "trajectories",
    "measure_lines",
    "plot",
)  # as the tools draw them
_STEPS = 32  # of a colour bar; colours between them are blended


def _mark(name: str, title: str, key: str) -> Command:
    """Shows one of the marks over the view."""
    return Command(
        name, title, lambda marks: marks.toggle(name), key, is_on=lambda marks: getattr(marks.shown, name)
    )


@dataclass(eq=False)
class ViewMarks(WindowPart):
    """The marks over the view.

    shown: those that the view has. boxes: where they were drawn last, pixels from the view's upper left
    corner.
    """

    name = "marks"
    OFFERS = {"marks_of_files": "of_files"}
    session: Session
    playback: Playback
    viewport: Viewport
    steering: Steering
    ranging: Ranging
    shown: Marks = remembered(factory=lambda: SHOWN_FIRST)
    in_files: bool = remembered(True)  # whether saved pictures and recordings have the marks
    boxes: list[Box] = field(default_factory=list, init=False)

    @property
    def of_files(self) -> Marks:
        """The marks of saved pictures and recordings: as the view has them, or none."""
        of_tools = dict.fromkeys(_OF_TOOLS, True)
        return replace(self.shown, **of_tools) if self.in_files else Marks()

    def toggle_in_files(self) -> None:
        """Have pictures saved with the marks of the view, or bare."""
        self.in_files = not self.in_files

    def toggle(self, name: str) -> None:
        """Show one of `legend.MARKS` or hide it."""
        self.shown = replace(self.shown, **{name: not getattr(self.shown, name)})

    def draw(self, size: ImVec2) -> None:
        """Draw the marks of the picture into the current ImGui window, the 3D view. size: of the view."""
        request, surface = self.viewport.request, self.viewport.surface
        camera, self.boxes = self.session.document.camera, []
        if camera is None or request is None or surface is None or not self.viewport.is_there:
            return
        pose, scale, count = request.pose, self.playback.scale, len(self.playback.timeline)
        legend = Legend(
            self.shown, camera, surface.look, scale.unit, pose.index, count, float(pose.time),
            self.ranging.words(), factor=scale.factor,
        )  # fmt: skip
        corner = imgui.get_window_pos()
        canvas = _View(corner)
        self.boxes = marks.draw(canvas, (size.x, size.y), legend, surface.color_range, surface.value_kind)
        if self.shown.scale_bar and self.steering.gesture is None and imgui.is_window_hovered():
            left, top, right, bottom = marks.scale_bar_box(canvas, (size.x, size.y), legend)
            if imgui.is_mouse_hovering_rect(corner + ImVec2(left, top), corner + ImVec2(right, bottom)):
                imgui.set_tooltip(_scale_bar_help(self.steering.is_orthographic))

    COMMANDS = (
        _mark("scale_bar", "Scale bar", "S"),
        _mark("color_bar", "Colour bar", "C"),
        Command(
            "marks_in_files", "Include overlays in screenshots", toggle_in_files,
            is_on=lambda marks: marks.in_files,
        ),
    )  # fmt: skip


def _scale_bar_help(orthographic: bool) -> str:
    if orthographic:
        return "Valid at every depth"
    return "The scale bar is valid at the depth of the pivot. Nearer objects look larger"


class _View:
    """A `MarkPainter` over the current ImGui window. corner: its upper left one."""

    def __init__(self, corner: ImVec2) -> None:
        self.em = imgui.get_font_size()
        self._corner = corner
        self._list = imgui.get_window_draw_list()

    def width(self, text: str) -> float:
        return imgui.calc_text_size(text).x

    def text(self, left: float, top: float, text: str) -> None:
        self._list.add_text(self._corner + ImVec2(round(left), round(top)), _packed(marks.INK), text)

    def box(self, box: Box, color: Color) -> None:
        self._list.add_rect_filled(*self._corners(box), _packed(color))

    def gradient(self, box: Box, colors: NDArray[np.uint8]) -> None:
        left, top, right, bottom = box
        edges = np.linspace(bottom, top, _STEPS + 1)
        packed = [_packed(colors[i]) for i in np.linspace(0, len(colors) - 1, _STEPS + 1).round().astype(int)]
        for step in range(_STEPS):
            low, high = packed[step : step + 2]
            corners = self._corners((left, float(edges[step + 1]), right, float(edges[step])))
            self._list.add_rect_filled_multi_color(*corners, high, high, low, low)

    def _corners(self, box: Box) -> tuple[ImVec2, ImVec2]:
        left, top, right, bottom = map(round, box)
        return self._corner + ImVec2(left, top), self._corner + ImVec2(right, bottom)


def _packed(color: Color | NDArray[np.uint8]) -> int:
    red, green, blue, alpha = (int(part) for part in color)
    return red | green << 8 | blue << 16 | alpha << 24

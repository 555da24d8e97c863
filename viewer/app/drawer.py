"""The drawer under the timeline: what tools show over time, beside each other."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from imgui_bundle import ImVec2, imgui

from ..document.schema import Kind
from .keyboard import Keyboard
from .keys import Keys
from .part import WindowPart, remembered
from .toolbox import Toolbox
from .ui import Ui

LOWEST, HIGHEST, USUAL = 7.0, 60.0, 15.0  # in heights of the font
DrawerHeight = Annotated[
    float, Kind("a height that the plot area can have", lambda height: LOWEST <= height <= HIGHEST)
]


@dataclass(eq=False)
class Drawer(WindowPart):
    """The drawer. It is there while a tool has something in it."""

    name = "drawer"
    tools: Toolbox
    keyboard: Keyboard
    keys: Keys
    height: DrawerHeight = remembered(USUAL)  # in heights of the font

    def __post_init__(self) -> None:
        self._content = LOWEST  # height of what was declared last, in heights of the font

    @property
    def is_open(self) -> bool:
        """Whether a tool has something to show in it."""
        return any(True for _ in self.tools.drawn_below())

    @property
    def shown_height(self) -> float:
        """The height now, in heights of the font: the user's, or that of its few words."""
        return min(self._content, self.height) if self.tools.is_below_bare else self.height

    def draw_grip(self, width: float) -> None:
        """Declare what resizes it, in a window of its own at its upper edge: a drag does, a double click
        brings the usual height back."""
        imgui.invisible_button("##grip", ImVec2(max(width, 1), max(imgui.get_content_region_avail().y, 1)))
        if self.tools.is_below_bare:
            return
        if imgui.is_item_hovered() or imgui.is_item_active():
            imgui.set_mouse_cursor(imgui.MouseCursor_.resize_ns)
        if imgui.is_item_hovered() and imgui.is_mouse_double_clicked(imgui.MouseButton_.left):
            self.height = USUAL
        elif imgui.is_item_active():
            dragged = imgui.get_io().mouse_delta.y / imgui.get_font_size()
            self.height = min(max(self.height - dragged, LOWEST), HIGHEST)

    def draw(self) -> None:
        """Declare what tools show in it, in the current ImGui window."""
        keyboard, ui = self.keyboard, Ui(self.keys)
        flags = keyboard.flags("drawer")
        sections = list(self.tools.drawn_below())
        gaps = (len(sections) - 1) * imgui.get_style().item_spacing.x
        size = ImVec2((imgui.get_content_region_avail().x - gaps) / max(len(sections), 1), 0)
        ends: list[float] = []
        for number, (name, declare) in enumerate(sections):
            if number:
                imgui.same_line()
            imgui.begin_child(name, size, window_flags=flags)
            if not number:
                keyboard.take("drawer")
            start = imgui.get_cursor_pos_y()
            declare(ui)
            ends.append(imgui.get_cursor_pos_y() - start)
            imgui.end_child()
        padding = 2 * imgui.get_style().window_padding.y
        self._content = (max(ends, default=0.0) + padding) / imgui.get_font_size()

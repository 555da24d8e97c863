"""The panel at the right: sections, one below the other, what a user asks first at the top."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Any

from imgui_bundle import ImVec2, imgui

from ...document.schema import Kind, ReadBy, is_object
from .. import widgets
from ..keyboard import Keyboard
from ..keys import Keys
from ..part import Parts, Section, WindowPart, remembered
from ..playing.playback import Playback
from ..toolbox import Toolbox
from ..ui import Ui

_TOOLS_RANK = 20  # of the sections of tools

NARROWEST, WIDEST, USUAL = 14.0, 60.0, 21.0  # in heights of the font
PanelWidth = Annotated[float, Kind("a width of the panel", lambda width: NARROWEST <= width <= WIDEST)]


def _read_sections(data: Any) -> dict[str, bool]:
    """Whether sections are open, by name; what is something else is left out."""
    values = data.items() if is_object(data) else ()
    return {name: value for name, value in values if isinstance(value, bool)}


Opened = Annotated[Mapping[str, bool], ReadBy(_read_sections)]


@dataclass(eq=False)
class Panel(WindowPart):
    """The panel: how wide it is, and which of its sections are open."""

    name = "side_panel"
    parts: Parts
    playback: Playback
    tools: Toolbox
    keyboard: Keyboard
    keys: Keys
    width: PanelWidth = remembered(USUAL)  # in heights of the font
    opened: Opened = remembered(factory=dict)  # whether sections are open, by name, where that was changed

    def draw_grip(self, height: float) -> None:
        """Declare what resizes the panel, in a window of its own at the panel's left edge: a drag does, a
        double click brings the usual width back."""
        imgui.invisible_button("##grip", ImVec2(max(imgui.get_content_region_avail().x, 1), max(height, 1)))
        if imgui.is_item_hovered() or imgui.is_item_active():
            imgui.set_mouse_cursor(imgui.MouseCursor_.resize_ew)
        width = self.width
        if imgui.is_item_hovered() and imgui.is_mouse_double_clicked(imgui.MouseButton_.left):
            width = USUAL
        elif imgui.is_item_active():
            dragged = imgui.get_io().mouse_delta.x / imgui.get_font_size()
            width = min(max(width - dragged, NARROWEST), WIDEST)
        self.width = width

    def draw(self) -> None:
        """Declare the panel in the current ImGui window."""
        imgui.begin_child("settings", window_flags=self.keyboard.flags("panel"))
        self.keyboard.take("panel")
        ui = Ui(self.keys)
        parts = [part for part in self.parts if part.SECTION is not None]
        sections = [(part.SECTION, part.panel, False) for part in parts]
        marks = {part.SECTION.title: part.mark for part in parts}
        sections += [
            (Section(title, _TOOLS_RANK), declare, is_revealed)
            for title, is_revealed, declare in self.tools.sections()
        ]
        for section, declare, is_revealed in sorted(sections, key=lambda found: found[0].rank):
            if self.playback.pose is not None or not section.needs_pose:
                about = marks.get(section.title, "")
                self._draw_section(section, partial(declare, ui), is_revealed, about)
        imgui.end_child()

    def _draw_section(
        self, section: Section, declare: Callable[[], object], is_revealed: bool, mark: str
    ) -> None:
        """Declare a section. is_revealed: whether to open it and scroll to its end. mark: words on why its
        header has a mark, empty where it has none."""
        name, opened = section.title.rpartition("###")[2], self.opened
        imgui.set_next_item_open(is_revealed or opened.get(name, section.is_open))
        shows = imgui.collapsing_header(section.title)
        if mark:
            widgets.mark_header(mark)
        if opened.get(name, section.is_open) != shows:
            self.opened = {**opened, name: shows}
        if shows:
            imgui.push_id(widgets.unhidden(name))  # what other sections declare may have the same labels
            declare()
            imgui.pop_id()
            if is_revealed:
                imgui.set_scroll_here_y(1.0)

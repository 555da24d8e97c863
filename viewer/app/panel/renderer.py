"""The panel's section on the renderer: which one draws, why, and how."""

from __future__ import annotations

from dataclasses import dataclass

from imgui_bundle import imgui

from ...backends import backend, backends
from .. import widgets
from ..part import Section, WindowPart
from ..playing.playback import Playback
from ..scene.choosing import Choosing
from ..scene.rendering import Rendering
from ..session import Session
from ..ui import Ui
from . import automatic


@dataclass(eq=False)
class RendererSection(WindowPart):
    """The section."""

    name = "renderer_section"
    SECTION = Section("Renderer", 50)
    session: Session
    playback: Playback
    rendering: Rendering
    choosing: Choosing

    def panel(self, ui: Ui) -> None:
        """Declare it."""
        pose = self.playback.pose
        if pose is None:
            return
        name, _ = self.session.document.chosen(pose)
        imgui.set_next_item_width(-1)
        chosen = widgets.combo(
            "backend", name, self.rendering.choices, {n: b.title for n, b in backends().items()}
        )
        widgets.tooltip(f"{name}: {backend(name).help}")
        if chosen != name:
            self.rendering.choose(chosen)
        widgets.faint(backend(chosen).good_for)
        is_for_all = self.rendering.is_for_all
        if imgui.checkbox("Use for all scans", is_for_all)[1] != is_for_all:
            self.rendering.toggle_for_all()
        widgets.tooltip(
            "New scans start with this renderer and its options.\n"
            "Otherwise, each new scan starts with the renderer that suits it best."
        )
        if self.rendering.others_begin_with and not is_for_all:
            widgets.faint(f"New scans start with: {self.rendering.others_begin_with}")
            if imgui.button("Clear choice for all scans"):
                self.rendering.clear_for_all()
        automatic.draw(self.session, self.rendering, self.choosing, self.playback.scale)
        name, params = self.session.document.chosen(pose)
        imgui.push_id("renderer")  # the look has parameters of the same names
        self.rendering.edit_params(
            widgets.edit(
                params,
                self.session.document.defaults(pose)[1],
                widgets.EditOptions(rest="More renderer options"),
            )
        )
        imgui.pop_id()

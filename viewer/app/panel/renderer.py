"""The panel's section on the renderer: which one draws, why, and how."""

from __future__ import annotations

from typing import TYPE_CHECKING

from imgui_bundle import imgui

from ...backends import backend, backends
from .. import widgets
from . import automatic

if TYPE_CHECKING:
    from ...scan.pose import Pose
    from ...scan.units import Scale
    from ..scene.choosing import Choosing
    from ..scene.rendering import Rendering
    from ..session import Session


def draw(session: Session, rendering: Rendering, choosing: Choosing, scale: Scale, pose: Pose) -> None:
    """Declare the section. scale: how lengths are told."""
    name, _ = session.document.chosen(pose)
    imgui.set_next_item_width(-1)
    chosen = widgets.combo("backend", name, rendering.choices, {n: b.title for n, b in backends().items()})
    widgets.tooltip(f"{name}: {backend(name).help}")
    if chosen != name:
        rendering.choose(chosen)
    widgets.faint(backend(chosen).good_for)
    is_for_all = rendering.is_for_all
    if imgui.checkbox("Use for all scans", is_for_all)[1] != is_for_all:
        rendering.toggle_for_all()
    widgets.tooltip(
        "Scans that you open for the first time begin with this renderer and its options.\n"
        "Otherwise each begins with the one that suits it best."
    )
    if rendering.others_begin_with and not is_for_all:
        widgets.faint(f"New scans start with: {rendering.others_begin_with}")
        if imgui.button("Clear choice for all scans"):
            rendering.clear_for_all()
    automatic.draw(session, rendering, choosing, scale)
    name, params = session.document.chosen(pose)
    imgui.push_id("renderer")  # the look has parameters of the same names
    rendering.edit_params(
        widgets.edit(params, session.document.defaults(pose)[1], rest="More renderer options")
    )
    imgui.pop_id()

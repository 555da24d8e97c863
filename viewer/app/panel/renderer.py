"""The panel's section on the renderer: which one draws, and how."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from imgui_bundle import imgui

from ...backends import backend, backends
from .. import widgets

if TYPE_CHECKING:
    from ...backends import Backend
    from ...scan.pose import Pose
    from ..scene.rendering import Rendering
    from ..session import Session


def draw(session: Session, rendering: Rendering, pose: Pose) -> None:
    """Declare the section."""
    name, _ = session.document.chosen(pose)
    imgui.set_next_item_width(-1)
    chosen = widgets.combo("backend", name, list(backends()), {n: b.title for n, b in backends().items()})
    widgets.tooltip(f"{name}: {backend(name).help}")
    if chosen != name:
        rendering.choose(chosen)
    name, params = session.document.chosen(pose)
    for attribute in _estimated(backend(name), pose, params):
        widgets.fact(attribute.capitalize(), "estimated")
        widgets.tooltip(f"The scan stores no {attribute}; they are estimated from its points")
    rendering.edit_params(widgets.edit(params, session.document.defaults(pose)[1]))


def _estimated(drawn_by: Backend, pose: Pose, params: Any) -> list[str]:
    """Attributes that the backend uses and the pose does not store: estimated, or found as it draws."""
    used = {*drawn_by.needs(pose, params), *(["normals"] if drawn_by.finds_normals else [])} - {"views"}
    return sorted(name for name in used if getattr(pose.overview, name) is None)

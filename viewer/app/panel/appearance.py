"""The panel's section on the picture: colours, light, background."""

from __future__ import annotations

from collections.abc import Collection
from typing import TYPE_CHECKING

from imgui_bundle import imgui

from ...backends import backend
from ...files import printable
from ...look import COLOR_BY, COLOR_WORDS, Look, drawable
from ...params import in_words
from .. import widgets
from ..ui import Ui

if TYPE_CHECKING:
    from ...scan.pose import Pose
    from ..scene.rendering import Rendering
    from ..session import Session


def draw(session: Session, rendering: Rendering, pose: Pose, ui: Ui) -> None:
    """Declare the section."""
    look = session.document.look
    names = session.laid.layers(pose).names(pose.overview.scalars)
    colors = _colors(look, names, backend(session.document.chosen(pose)[0]).values)
    rendering.edit_look(widgets.edit(look, Look(up=look.up), {"color_by": colors}, hidden=("up",)))
    imgui.begin_disabled(rendering.is_default)
    if imgui.button("Back to the usual", ui.button_size(1)):
        rendering.reset()
    imgui.end_disabled()
    ui.tooltip("Appearance and renderer as of a scan that was never open", "reset")


def _colors(look: Look, scalars: Collection[str], found: Collection[str]) -> dict[str, str]:
    """Sources of colours, and the title of each: also the one chosen where it is not there.

    scalars: that the frame has. found: what the backend finds.
    """
    titles = {name: COLOR_WORDS[name] for name in COLOR_BY} | {name: printable(name) for name in scalars}
    titles |= {name: in_words(name) for name in found if name not in titles}
    if look.color_by in titles:
        return titles
    is_here = drawable(look, scalars) == look  # as the scalar's number
    return titles | {look.color_by: printable(look.color_by) + ("" if is_here else " (not here)")}

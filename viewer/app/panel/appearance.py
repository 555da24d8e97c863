"""The panel's section on the picture: colours, light, background."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

from imgui_bundle import imgui

from ...backends import backend
from ...files import printable
from ...look import COLOR_BY, COLOR_WORDS, RANGE_WORDS, Look, drawable
from ...params import in_words
from .. import widgets
from ..ui import Ui

if TYPE_CHECKING:
    from ...scan.pose import Pose
    from ...scan.units import Scale
    from ..scene.rendering import Rendering
    from ..scene.viewport import Viewport
    from ..session import Session

_FIXED = "fixed"  # both ends are given


def draw(
    session: Session, rendering: Rendering, viewport: Viewport, scale: Scale, pose: Pose, ui: Ui
) -> None:
    """Declare the section. scale: how lengths are told, as which heights and depths are edited."""
    look = session.document.look
    names = session.laid.layers(pose).names(pose.overview.scalars)
    found = backend(session.document.chosen(pose)[0]).values
    colors = _colors(look, names, found)
    is_found = look.color_by in found and look.color_by not in names
    shown = viewport.surface.color_range if viewport.surface is not None and viewport.is_there else None
    factor = scale.factor if look.color_by in ("depth", "height") else 1.0
    told = _in_unit(look, factor)
    shown = shown and (factor * shown[0], factor * shown[1])
    edited = widgets.edit(
        told, Look(up=look.up), {"color_by": colors}, ("up", *(["range"] if is_found else [])),
        dict(zip(("low", "high"), shown or (), strict=False)), {"range": partial(_edit_range, shown)},
    )  # fmt: skip
    ends = _in_unit(edited, 1 / factor)
    low = look.low if edited.low == told.low else ends.low  # what is not edited stays to the last bit
    high = look.high if edited.high == told.high else ends.high
    rendering.edit_look(replace(edited, low=low, high=high))
    imgui.begin_disabled(rendering.is_default)
    if imgui.button("Back to the usual", ui.button_size(1)):
        rendering.reset()
    imgui.end_disabled()
    ui.tooltip("Appearance and renderer as of a scan that was never open", "reset")


def _in_unit(look: Look, factor: float) -> Look:
    """The look with its ends of the colour map in another unit."""
    low, high = (None if end is None else factor * end for end in (look.low, look.high))
    return replace(look, low=low, high=high)


def _edit_range(shown: tuple[float, float] | None, look: Look) -> Look:
    """Declare what chooses the ends of the colour map: of all frames, of each, or as they are now.

    shown: where it begins and ends in the picture; None: nowhere.
    """
    help = "range: what the colours span. Fixed keeps what that is now, to be changed below"
    widgets.label("Range", help, imgui.get_frame_height())
    now = look.range if None in (look.low, look.high) else _FIXED
    titles = RANGE_WORDS | ({_FIXED: "Fixed"} if shown or now == _FIXED else {})
    chosen = widgets.combo("value", now, list(titles), titles)
    if chosen == now:
        return look
    if chosen == _FIXED:
        low, high = shown or (0.0, 1.0)
        return replace(look, low=low, high=high)
    return replace(look, range=chosen, low=None, high=None)


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

"""The panel's section on the picture: colours, light, background."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from functools import partial

from imgui_bundle import imgui

from ...backends import backend
from ...files import printable
from ...look import BACKGROUNDS, COLOR_BY, COLOR_WORDS, RANGE_WORDS, Look, drawable
from ...output.legend import goes_by_length
from ...params import in_words
from ...scan.pose import Pose
from ...scan.units import Scale
from .. import theme, widgets
from ..part import Section, WindowPart
from ..playing.playback import Playback
from ..scene.rendering import Rendering
from ..scene.viewport import Viewport
from ..session import Session
from ..ui import Ui

_FIXED = "fixed"  # both ends are given
_THEME, _OWN = "theme", "own"
_FIRST_OWN = {_THEME: Look().background, _OWN: "#7f858d"}  # no preset's
_BACKGROUND_WORDS = {
    _THEME: "Same as theme", "white": "White, for print", "black": "Black", "transparent": "Transparent",
    _OWN: "Custom colour",
}  # fmt: skip
_OF_NUMBERS = ("color_map", "range", "low", "high")
_OF_LIGHT = ("ambient", "diffuse", "specular", "shininess")
_OF_EDGES = ("eye_dome_strength", "eye_dome_radius")


@dataclass(eq=False)
class AppearanceSection(WindowPart):
    """The section."""

    name = "appearance_section"
    SECTION = Section("Appearance", 30)
    session: Session
    playback: Playback
    viewport: Viewport
    rendering: Rendering

    def panel(self, ui: Ui) -> None:
        """Declare it."""
        if self.playback.pose is not None:
            _draw(self.session, self.rendering, self.viewport, self.playback.scale, self.playback.pose, ui)


def _draw(
    session: Session, rendering: Rendering, viewport: Viewport, scale: Scale, pose: Pose, ui: Ui
) -> None:
    """Declare the section. scale: of displayed lengths, as which heights and depths are edited."""
    look = session.document.look
    names = session.laid.layers(pose).names(pose.overview.scalars)
    found = backend(session.document.chosen(pose)[0]).values
    colors = _colors(look, names, found)
    is_found = look.color_by in found and look.color_by not in names
    shown = viewport.surface.color_range if viewport.surface is not None and viewport.is_there else None
    factor = scale.factor if goes_by_length(look.color_by) else 1.0
    is_here = drawable(look, names, found) == look
    drawn_by, params = session.document.chosen(pose)
    idle = idle_parameters(look, pose, is_here, _why_unlit(look, drawn_by, params, pose))
    displayed = _in_unit(look, factor)
    shown = shown and (factor * shown[0], factor * shown[1])
    options = widgets.EditOptions(
        {"color_by": colors}, ("up", *(["range"] if is_found else [])),
        dict(zip(("low", "high"), shown or (), strict=False)), idle,
        {"range": partial(_edit_range, shown), "background": _edit_background}, "More appearance options",
    )  # fmt: skip
    edited = widgets.edit(displayed, Look(up=look.up), options)
    ends = _in_unit(edited, 1 / factor)
    low = look.low if edited.low == displayed.low else ends.low  # what is not edited stays to the last bit
    high = look.high if edited.high == displayed.high else ends.high
    rendering.edit_look(replace(edited, low=low, high=high))
    imgui.begin_disabled(rendering.is_default)
    if ui.row("Reset appearance").button():
        rendering.reset()
    imgui.end_disabled()
    ui.tooltip("Set appearance and renderer to the defaults of a new scan", "reset")


def _in_unit(look: Look, factor: float) -> Look:
    """The look with its ends of the colour map in another unit."""
    low, high = (None if end is None else factor * end for end in (look.low, look.high))
    return replace(look, low=low, high=high)


def _edit_background(look: Look) -> Look:
    """Declare what chooses the background, and a field for one's own."""
    help = (
        "background: colour behind the scan, in the window and in saved pictures. A film cannot have "
        "a transparent background"
    )
    widgets.label("Background", help, imgui.get_frame_height())
    presets = {color: name for name, color in BACKGROUNDS.items()}
    now = _THEME if theme.leaves_background(look) else presets.get(look.background, _OWN)
    chosen = widgets.combo("background", now, list(_BACKGROUND_WORDS), _BACKGROUND_WORDS)
    if chosen != now:
        return replace(look, background=_FIRST_OWN.get(chosen) or BACKGROUNDS[chosen])
    if now != _OWN:
        return look
    widgets.label("", gutter=imgui.get_frame_height())
    return replace(look, background=widgets.edit_color("##value", look.background))


def _why_unlit(look: Look, name: str, params: object, pose: Pose) -> str:
    """Why a picture by this backend has no light where nothing else is chosen; empty where it has."""
    drawn_by, cloud = backend(name), pose.overview
    is_photograph = drawn_by.draws_samples(pose, params) and cloud.colors is not None
    if is_photograph and look.color_by in ("auto", "own"):
        return "Scan4D adds no light to the photos of range images. To add light, choose another Light"
    has_normals = cloud.normals is not None or drawn_by.finds_normals
    if has_normals or "normals" in drawn_by.needs(pose, params):
        return ""
    return (
        "The scan has no normals, so Scan4D draws it without light. If you choose another Light, Scan4D "
        "estimates normals"
    )


def idle_parameters(look: Look, pose: Pose, is_here: bool, why_unlit: str) -> dict[str, str]:
    """The parameters that change nothing now, and why. is_here: whether there is what the look colours by.
    why_unlit: why there is no light by itself, empty where there is."""
    has_own = pose.overview.colors is not None
    idle = {}
    if has_own and (look.color_by in ("auto", "own") or not is_here):
        idle["plain"] = (
            "The scan has its own colours. To show one colour instead, choose 'Single colour' above"
        )
    elif is_here and look.color_by not in ("auto", "own", "plain", "level"):
        shown = COLOR_WORDS.get(look.color_by, printable(look.color_by)).lower()
        idle["plain"] = f"This setting has no effect while the colours show {shown}"
    if not is_here:
        idle |= dict.fromkeys(_OF_NUMBERS, "This frame has no values of the quantity that the colours show")
    if look.light == "auto" and why_unlit:
        idle |= dict.fromkeys(_OF_LIGHT, why_unlit)
    elif look.eye_dome is None:
        idle |= dict.fromkeys(_OF_EDGES, "Automatic edge shading is on only if the view has no light")
    return idle


def _edit_range(shown: tuple[float, float] | None, look: Look) -> Look:
    """Declare what chooses the ends of the colour map: of all frames, of each, or as they are now.

    shown: where it begins and ends in the picture; None: nowhere.
    """
    help = (
        "range: lowest and highest value of the colours. Fixed keeps the present range, which you can "
        "edit below"
    )
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
    return titles | {look.color_by: printable(look.color_by) + ("" if is_here else " (not in this frame)")}

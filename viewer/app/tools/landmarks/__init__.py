"""Landmarks: named places of the subject, placed by a click each and followed through time."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from imgui_bundle import ImVec2
from imgui_bundle import icons_fontawesome_6 as icons
from numpy.typing import NDArray

from ....analysis.landmarks import Landmark, Template
from ....analysis.landmarks.mirroring import Proposal, proposal_for
from ....analysis.pick import are_seen
from ....analysis.surface_point import slack_before
from ....document.landmarks import Landmarks
from ....errors import InputError
from ....geometry import Vector, vector
from ....output.overlays import DrawnMarks
from ....params import param
from ....scan.times import frame_in_words
from ...commands import Command, Menu
from ...scene.canvas import Canvas, ScreenView
from ...tool_context import Click, FrameSpan, ToolContext
from ...ui import Ui
from .._cached import Cached
from . import overlay, panel
from .corners import regions_of
from .exchange import Exchange
from .following import Following
from .notebook import Notebook
from .shown import ShownLandmarks, drawn_landmarks
from .words import gap_spans, placed_words

TITLE = "Landmarks"
_GRAB = 0.7  # how near the mouse has to be to take hold of one, in heights of the font
_OFF = (
    3.0,
    0.03,
)  # deviations, and shares of the scan's radius, that the surface may be off a mirrored position


@dataclass(frozen=True)
class Settings:
    """Choices that come back at the next start."""

    follow: bool = param(True, "Track landmarks through all frames as soon as you place them")
    names: bool = param(True, "Show the names of landmarks in the view, where there is room")
    loupe: bool = param(True, "Show a magnifier under the mouse while you place landmarks")


class Tool:
    """The tool that places landmarks. These are in the document.

    selected: the name of the one that was placed or chosen last, "" for none. corrects: whether clicks set
    that one, though it is placed or skipped. dragged: where the one that is dragged would be, in the
    coordinates that the scan is shown in; None while none is. open_regions: those whose corners are listed.

    The class has more than 30 methods because each hook of a tool and each of its commands is one.
    """

    def __init__(self, context: ToolContext) -> None:
        self.context = context
        self.selected, self.corrects = "", False
        self.open_regions: set[str] = set()
        self.dragged: Vector | None = None
        self.follower = Following(context)
        self.notebook = Notebook(context)
        self.exchange = Exchange(context, self.begin)
        self._pressed = ""  # the name of the one that the mouse went down on
        self._arrows_in: int | None = None  # frame in which arrow keys move the selected one
        self._cached = Cached()
        self._on_screen = np.empty((0, 2))
        self._grab = 0.0  # pixels

    # --- what there is ----------------------------------------------------------------

    @property
    def made(self) -> Landmarks:
        """The landmarks of the open scan."""
        return self.context.document.part(Landmarks)

    @property
    def frame(self) -> int:
        """The frame that is shown."""
        return self.context.index if self.context.pose is None else self.context.pose.index

    @property
    def shown(self) -> ShownLandmarks:
        """The landmarks in the frame that is shown."""
        of = self.made.all, self.context.followed.tracks, self.frame
        return self._cached.of("shown", of, lambda: ShownLandmarks.of(self.made.listed, *of[1:]))

    @property
    def regions(self) -> Mapping[str, str]:
        """The landmarks that are corners of regions, and the names of these."""
        measures = self.made.measures
        return self._cached.of("regions", (measures,), lambda: regions_of(measures))

    @property
    def positions(self) -> NDArray[np.float64]:
        """(N, 3): where they are in the picture, NaN where that is not known."""
        pose = self.context.pose
        found = self.shown.positions
        return found if pose is None else self.context.motion(pose).points(found)

    @property
    def seen(self) -> NDArray[np.bool_]:
        """(N,): which are in the picture with nothing before them; found once a picture."""
        viewport, shown = self.context.viewport, self.shown
        surface, request = viewport.surface, viewport.request
        if surface is None or request is None or not viewport.is_there:
            return shown.is_there

        def find() -> NDArray[np.bool_]:
            radius = viewport.bounds(request.pose).radius
            slacks = np.asarray(slack_before(shown.spacings, np.nan_to_num(shown.sure), radius))
            return are_seen(surface, self.positions, slacks) if shown.is_there.any() else shown.is_there

        return self._cached.of("seen", (shown, request, surface), find)

    @property
    def target(self) -> Landmark | None:
        """The landmark that a click sets: the chosen one, else the next that is to be placed."""
        chosen = self.made.named(self.selected)
        if chosen is not None:
            waits = chosen.state == "not placed" and self.frame not in chosen.missing
            if self.corrects or waits:
                return chosen
        return self.made.next_to_place(self.frame, self.selected)

    @property
    def is_free(self) -> bool:
        """Whether clicks make landmarks of new names."""
        return not self.made.template

    @property
    def proposal(self) -> Proposal | None:
        """Position of the one that a click sets, as the mirror image of its partner, in scan coordinates;
        None where that is not known, or it has a position in the frame."""
        target, shown = self.target, self.shown

        def find() -> Proposal | None:
            template = self.exchange.templates.get(self.made.template)
            listed = {one.name for one in template.landmarks} if template else set()
            return None if target is None else _mirrored(target, shown, listed)

        return self._cached.of("proposal", (target, shown), find)

    # --- placing ----------------------------------------------------------------------

    @property
    def is_active(self) -> bool:
        """Whether clicks in the view place landmarks."""
        return self.context.has_clicks and not self.notebook.is_pinning

    def toggle(self) -> None:
        """Take up the tool or put it away."""
        was_active = self.is_active
        self.abandon()
        if was_active:
            self.context.leave_clicks()
        else:
            self.context.take_clicks()
            self.context.reveal()

    def pin_note(self) -> None:
        """Have the next click pin a note."""
        self.abandon()
        self.notebook.is_pinning = True
        self.context.take_clicks()

    def on_escape(self) -> bool:
        """Put the tool away; whether it was taken up."""
        was_active = self.context.has_clicks
        self.abandon()
        self.context.leave_clicks()
        return was_active

    def abandon(self) -> None:
        """Let go of what was chosen and what is dragged."""
        self.corrects, self.dragged, self.notebook.is_pinning = False, None, False
        self._arrows_in = None

    @property
    def takes_arrows(self) -> bool:
        """Whether arrow keys move the selected one: after it was placed, moved or chosen in this frame, until
        another frame is shown."""
        number = self.shown.number(self.selected)
        is_there = number is not None and bool(self.shown.is_there[number])
        return self.is_active and is_there and self._arrows_in == self.frame == self.context.index

    def prompt(self) -> str:
        """The words that say what a click does, and what arrow keys move."""
        if self.notebook.is_pinning:
            return "Note: click the position of the note. Esc to stop."
        arrows = f" The arrow keys move {self.selected}." if self.takes_arrows else ""
        return f"{self._prompt_of_click()}{arrows} Esc to stop."

    def _prompt_of_click(self) -> str:
        target, names = self.target, [one.name for one in self.made.listed]
        if target is not None and target.state == "not placed":
            number = names.index(target.name) + 1
            return f"{target.title}, {number} of {len(names)}: click its position."
        if target is not None:
            return f"{target.title}: click its position in {frame_in_words(self.frame)}."
        if self.is_free:
            return f"{self.made.free_name()}: click its position."
        return (
            f"{placed_words(self.made.listed)}: drag a landmark to correct it, or choose a landmark in the "
            "list."
        )

    def on_click(self, click: Click) -> bool:
        """Set the next one at what was clicked; raises InputError where it cannot be."""
        if self.notebook.is_pinning:
            self.notebook.pin(click)
            self.context.leave_clicks()
            return True
        target = self.target
        if target is None and self._pressed:
            self.selected, self._arrows_in = self._pressed, self.frame
            return True
        if target is None and not self.is_free:
            return False
        self._set(target or Landmark(self.made.free_name()), click, "Place landmark")
        return True

    def _set(self, landmark: Landmark, click: Click, name: str, merge: object = None) -> None:
        """Set one at what is seen, and go on to the next. name, merge: of the step of the history."""
        point = click.surface_point()
        if click.through_gap:
            self.context.note(
                "You clicked on a gap between points. Scan4D used the nearest surface in front of the gap."
            )
        self.corrects = self.corrects and bool(landmark.keys)
        self.selected, self._arrows_in = landmark.name, point.frame
        self.context.change(name, self.made.with_landmark(landmark.with_key(point)), merge=merge)

    def on_press(self, mouse: ImVec2) -> bool:
        """Take hold of the one under the mouse, where one is."""
        self._pressed = "" if self.notebook.is_pinning else self.under(mouse)
        return bool(self._pressed)

    def under(self, mouse: ImVec2) -> str:
        """The name of the seen landmark that a position on the screen is on; "" where it is on none."""
        if len(self._on_screen) != len(self.shown.landmarks) or not len(self._on_screen):
            return ""
        away = np.hypot(*(self._on_screen - (mouse.x, mouse.y)).T)
        away[~self.seen | np.isnan(away)] = np.inf
        nearest = int(away.argmin())
        return self.shown.landmarks[nearest].name if away[nearest] <= self._grab else ""

    def on_drag(self, click: Click, ends: bool) -> None:
        """Show the one that is dragged where it would be, and set it where it is let go."""
        landmark, picked = self.made.named(self._pressed), click.picked
        self.dragged = None if ends or picked is None else picked.place
        self.context.redraw()
        if ends and landmark is not None:
            if picked is None:
                raise InputError(f"No surface under the mouse: {landmark.name} stays where it was.")
            self.corrects = False
            self._set(landmark, click, "Move landmark")

    def on_arrow(self, right: int, up: int) -> bool:
        """Move the selected one by a pixel, along the surface that is seen; whether arrow keys move it."""
        number = self.shown.number(self.selected)
        if number is None or not self.takes_arrows:
            return False
        click = (
            self.context.seen_at(vector(self.positions[number]), (right, up)) if self.seen[number] else None
        )
        if click is None or click.pose.index != self.shown.frame:
            raise InputError(
                f"{self.selected} is hidden in this view. Turn the view until you see it, then move it."
            )
        if click.picked is not None:
            landmark = self.shown.landmarks[number]
            self._set(landmark, click, "Nudge landmark", merge=("nudge", landmark.name, self.frame))
        return True

    def take_mirrored(self) -> None:
        """Set the next one where the mirror image of its partner is, on the surface that is seen there."""
        target, proposal, pose = self.target, self.proposal, self.context.pose
        if target is None or proposal is None or pose is None:
            raise InputError(
                "The mirror position is not known yet: first place the mirror partner and a few other pairs."
            )
        position = self.context.motion(pose).points(proposal.position)
        click = self.context.seen_at(vector(position))
        deviations, share = _OFF
        most = deviations * np.nan_to_num(proposal.sigma) + share * self.context.viewport.bounds(pose).radius
        if click is None or click.picked is None or np.linalg.norm(click.picked.position - position) > most:
            raise InputError(
                f"The mirror position of {target.name} is hidden in this view. Turn the view until you "
                "see it."
            )
        self._set(target, click, "Place landmark")

    # --- the list ---------------------------------------------------------------------

    def rows(self) -> list[int | str]:
        """The rows of the list: landmarks by number, and regions by name, before their corners where these
        are shown."""
        rows: dict[int | str, None] = {}
        listed = self.made.listed
        for number, landmark in enumerate(listed):
            region = self.regions.get(landmark.name)
            if region is None:
                rows[number] = None
            elif region not in rows:
                corners = [n for n, one in enumerate(listed) if self.regions.get(one.name) == region]
                rows |= dict.fromkeys([region, *(corners if region in self.open_regions else ())])
        return list(rows)

    def choose(self, name: str) -> None:
        """Select one in the list: clicks set it, and the view goes where it is known."""
        landmark = self.made.named(name)
        if landmark is None:
            return
        self.selected, self._arrows_in = name, self.frame
        self.corrects = self.is_active and landmark.state != "not placed"
        number = self.shown.number(name)
        if number is not None and self.shown.is_there[number]:
            self._look_at(number)
        elif landmark.keys:
            nearest = min(landmark.keys, key=lambda key: abs(key.frame - self.frame))
            self._arrows_in = nearest.frame
            self.context.seek(nearest.frame)

    def _look_at(self, number: int) -> None:
        """Bring one into the middle of the view, where it is not seen."""
        camera, position = self.context.document.camera, vector(self.positions[number])
        if camera is not None and not self.seen[number]:
            self.context.change("Look at landmark", camera=camera.centered(position), pivot=position)

    def begin(self, template: Template | None) -> None:
        """Have the landmarks of a template placed, or such of new names; and take up the tool."""
        made = replace(self.made, template="") if template is None else self.made.begun_with(template)
        self.context.change("Choose template", made)
        self.selected = ""
        if not self.is_active:
            self.toggle()

    def change_selected(self, name: str, landmark: Landmark) -> None:
        """Change the selected one. name: of the step of the history."""
        self.corrects = False
        self.context.change(name, self.made.with_landmark(landmark))

    def skip(self) -> None:
        """Leave out the next one, or place it after all."""
        if target := self.target:
            self.selected = target.name
            self.change_selected("Skip landmark", replace(target, skipped=not target.skipped))

    def set_missing(self) -> None:
        """Say that the one which a click sets, or the selected one, is not there in this frame."""
        landmark = self.target or self.made.named(self.selected)
        if landmark is not None:
            self.selected = landmark.name
            self.change_selected("Mark landmark not visible", landmark.with_missing(self.frame))

    def rename(self, name: str) -> None:
        """Give the selected one another name. Raises InputError for one that is taken."""
        name = name.strip()
        if not name or name == self.selected:
            return
        if self.made.named(name) is not None:
            raise InputError(f"A landmark '{name}' exists already. Choose another name.")
        self.context.change("Rename landmark", self.made.renamed(self.selected, name))
        self.selected = name

    def pair(self, partner: str) -> None:
        """Have the selected one and another be mirror images of each other; "": of none."""
        self.context.change("Set mirror partner", self.made.paired(self.selected, partner))

    def delete(self) -> None:
        """Delete the selected one."""
        if self.made.named(self.selected) is not None:
            self.context.change("Delete landmark", self.made.without_landmark(self.selected))
            self.selected, self.corrects = "", False

    def take_key_away(self) -> None:
        """Take back that the selected one was set in this frame."""
        if landmark := self.made.named(self.selected):
            self.change_selected("Remove correction", landmark.without_key(self.frame))

    def why_no_correction(self) -> str:
        """Say why the selected one has no correction in this frame that could be removed; "" where it has."""
        landmark = self.made.named(self.selected)
        if landmark is None:
            return "Select a landmark first"
        if landmark.key_at(self.frame) is None:
            return f"You did not place {landmark.name} in {frame_in_words(self.frame)}"
        if len(landmark.keys) == 1:
            return f"You placed {landmark.name} only in this frame. To remove the landmark, press Delete"
        return ""

    # --- in the window ----------------------------------------------------------------

    def panel(self, ui: Ui) -> None:
        """Declare the section of the panel."""
        panel.draw(self, ui)

    def dialog(self) -> None:
        """Declare the dialogs that name a file, while one is open."""
        self.exchange.draw()

    def overlay(self, canvas: Canvas, view: ScreenView) -> None:
        """Draw landmarks and notes over the picture."""
        self._grab = _GRAB * canvas.em
        self._on_screen = view.all_on_screen(self.positions)
        overlay.draw(self, self._on_screen, canvas, view)
        self.notebook.draw_over(self.shown.frame, canvas, view)

    def drawn(self, frame: int) -> DrawnMarks:
        """The landmarks over a frame of pictures that are saved."""
        is_now = frame == self.frame
        shown = (
            self.shown if is_now else ShownLandmarks.of(self.made.listed, self.context.followed.tracks, frame)
        )
        has_names: bool = self.context.settings.names
        return DrawnMarks(drawn_landmarks(shown, has_names, self.regions))

    def spans(self) -> list[FrameSpan]:
        """The gaps, for the timeline."""
        tracks, regions = self.context.followed.tracks, self.regions
        of = self.made.all, tracks, regions
        return self._cached.of("spans", of, lambda: gap_spans(self.made.listed, tracks, regions))

    def on_file(self, path: Path) -> bool:
        """Read a file of landmarks; whether it is one."""
        return self.exchange.take(path)

    def advance(self, budget: float) -> bool:
        """Have landmarks followed; whether something new was found."""
        if self._arrows_in != self.context.index:
            self._arrows_in = None
        return self.follower.advance(self.context.settings.follow)


def _mirrored(target: Landmark, shown: ShownLandmarks, listed: Collection[str]) -> Proposal | None:
    """The mirrored position of one that has none in the frame. listed: by the template, so that those without
    a partner are of the midline; of others nobody knows."""
    number = shown.number(target.name)
    if not target.partner or (number is not None and shown.is_there[number]):
        return None
    partners = {one.name: one.partner for one in shown.landmarks if one.partner}
    there = [(one.name, n) for n, one in enumerate(shown.landmarks) if shown.is_there[n]]
    positions = {name: shown.positions[n] for name, n in there if name in partners or name in listed}
    return proposal_for(target.name, positions, partners)


def _while_active(name: str, title: str, act: object, key: str) -> Command:
    """A command on the landmark that is selected or placed next."""
    return Command(name, title, act, key, can=lambda tool: tool.is_active)  # type: ignore[arg-type]


COMMANDS = {
    "Tools": (
        Command(
            "landmarks", "Place landmarks", Tool.toggle, "K",
            is_on=lambda tool: tool.is_active, can=lambda tool: tool.context.document.camera is not None,
            short="Landmarks", icon=icons.ICON_FA_LOCATION_DOT,
        ),
        Menu("Landmarks", (
            (
                _while_active("skip_landmark", "Skip / unskip", Tool.skip, "X"),
                _while_active("missing_landmark", "Not visible in this frame", Tool.set_missing, "Shift+X"),
                _while_active("mirrored_landmark", "Place from mirror partner", Tool.take_mirrored, "A"),
                Command(
                    "delete_landmark", "Delete landmark", Tool.delete, "Delete",
                    can=lambda tool: bool(tool.selected)
                ),
                Command(
                    "landmark_key", "Remove correction in this frame", Tool.take_key_away, "Shift+Delete",
                    can=lambda tool: not tool.why_no_correction(),
                ),
            ),
            (
                Command("note_at_place", "Pin a note", Tool.pin_note, "J"),
                Command(
                    "note_at_frame", "Add frame note",
                    lambda tool: tool.notebook.add_to_frame(tool.frame), "Shift+J",
                ),
            ),
            (
                Command("read_landmarks", "Import landmarks...", lambda tool: tool.exchange.ask_to_read()),
                Command(
                    "choose_template", "Load template...",
                    lambda tool: tool.exchange.ask_for_template(),
                ),
                Command(
                    "save_template", "Save as template...",
                    lambda tool: tool.exchange.ask_to_save_template(),
                    can=lambda tool: bool(tool.made.listed),
                ),
                Command(
                    "save_landmarks", "Export landmarks...", lambda tool: tool.exchange.ask_to_save(),
                    can=lambda tool: any(one.keys for one in tool.made.listed),
                ),
            ),
        )),
    )
}  # fmt: skip
MOUSE = (
    ("Click while placing", "Place the next landmark"),
    ("Drag a landmark while placing", "Correct the landmark in this frame"),
    (
        "Arrow keys, after you place or choose a landmark",
        "Move the landmark by a pixel, until the frame changes",
    ),
)

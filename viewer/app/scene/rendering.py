"""Which backend draws, how, and in which look."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from ...backends import backends
from ...choice.goal import Goal
from ...document.document import Document
from ...look import Look, drawable
from ...params import Parameter, switches
from ...scan.pose import Pose
from ...scan.times import frame_in_words
from ..commands import Command, Item, Listing
from ..part import WindowPart
from ..playing.playback import Playback
from ..session import Session, edit_name

_UNKNOWN = "Renderer"  # what the toolbar says until a renderer draws
_LEVEL = "level_"  # begins the names of switches that show levels
FIRST_GOAL = Goal("time", 50.0)  # ms


@dataclass(eq=False)
class Rendering(WindowPart):
    """Changes backend, parameters and look of the document."""

    name = "rendering"
    CONDITIONS = {"renderer options": lambda rendering: bool(rendering.switches)}
    session: Session
    playback: Playback
    note_of_scan: Callable[[str], None]

    def __post_init__(self) -> None:
        self._missed: set[tuple[str, str]] = set()  # scan, and scalar or backend, which were reported

    def tell_missing(self, pose: Pose) -> None:
        """Report, once a scan, that the chosen backend is not there or cannot draw it, and that neither frame
        nor backend has the number that the user chose to colour by."""
        look, chosen_backend = self.session.document.look, self.session.document.backend
        absent = self.session.scan, f"backend {chosen_backend}"
        stand_in = self.session.document.defaults(pose)[0]
        if chosen_backend not in (None, stand_in) and absent not in self._missed:
            self._missed.add(absent)
            known = backends().get(str(chosen_backend))
            why = (
                f"{known.title} cannot draw this scan"
                if known
                else f"This version of Scan4D has no renderer '{chosen_backend}'"
            )
            self.note_of_scan(f"{why}. {backends()[stand_in].title} draws the scan instead.")
        missed = self.session.scan, look.color_by
        names = self.session.laid.layers(pose).names(pose.overview.scalars)
        drawn_by = backends()[self.session.document.chosen(pose)[0]]
        if missed not in self._missed and drawable(look, names, drawn_by.values) != look:
            self._missed.add(missed)
            chosen = missed[1]
            name = f"scalar {chosen[1:]}" if chosen.startswith("#") else f"'{chosen}'"
            finders = [one.title for one in backends().values() if chosen in one.values]
            self.note_of_scan(
                f"{drawn_by.title} does not compute {name}, but {' and '.join(finders)} can. The "
                "view shows other colours."
                if finders
                else (
                    f"{frame_in_words(pose.index).capitalize()} has no {name} to colour by. Scan4D shows "
                    "other colours until a frame has it."
                )
            )

    @property
    def backend(self) -> str | None:
        """The name of the backend that draws; None before the first pose."""
        pose = self.playback.pose
        return None if pose is None else self.session.document.chosen(pose)[0]

    def choose(self, name: str) -> None:
        """Draw with a backend."""
        session = self.session
        session.history.change(f"Choose {backends()[name].title}", session.document.drawn_by(name))

    def aim(self, goal: Goal | None) -> None:
        """Have the backend chosen automatically for a goal; None: draw with the one that was chosen before.
        Other bounds without a pause are one step."""
        former = self.session.document.goal
        if goal is None:
            document = self.session.document
            self.session.history.change("Choose renderer by hand", document.drawn_by(document.backend))
        elif former is None:
            self.session.change("Choose renderer automatically", goal=goal)
        elif goal != former:
            self.session.change("Change limit", merge="Change limit", goal=goal)

    def switch_automatic(self) -> None:
        """Have the backend chosen automatically, within a time at first, or not any more."""
        self.aim(FIRST_GOAL if self.session.document.goal is None else None)

    @property
    def is_for_all(self) -> bool:
        """Whether scans that were never open begin with the renderer that draws this one."""
        wanted, usual = self._for_all, self.session.for_all
        return (wanted.backend, wanted.params, wanted.goal) == (usual.backend, usual.params, usual.goal)

    @property
    def _for_all(self) -> Document:
        document = self.session.document
        name = None if document.goal else self.backend
        return Document(
            backend=name,
            params={of: params for of, params in document.params.items() if of == name},
            goal=document.goal,
        )

    def toggle_for_all(self) -> None:
        """Have scans that were never open begin with the renderer and the parameters of this one, or each
        with its own default again."""
        self.session.for_all = Document() if self.is_for_all else self._for_all

    def clear_for_all(self) -> None:
        """Have each scan that was never open begin with its own default."""
        self.session.for_all = Document()

    @property
    def others_begin_with(self) -> str:
        """Words on the renderer that scans which were never open begin with; empty: each with its own."""
        usual = self.session.for_all
        if usual.goal is not None:
            return f"automatic, within {usual.goal}"
        return backends()[usual.backend].title if usual.backend in backends() else ""

    def reset(self) -> None:
        """Draw as a scan is drawn that was never open: renderer, its parameters and look."""
        look = Look(up=self.session.document.look.up)
        usual = replace(self.session.document.drawn_by(None), params={}, look=look)
        self.session.history.change("Reset appearance", usual)

    @property
    def is_default(self) -> bool:
        """Whether all is drawn as `reset` has it."""
        document = self.session.document
        is_own = document.backend is not None or document.goal is not None or document.params
        return not is_own and document.look == Look(up=document.look.up)

    @property
    def choices(self) -> list[str]:
        """The names of the backends that draw the pose, and of the one that is chosen."""
        pose = self.playback.pose
        found = backends().values()
        return [one.name for one in found if pose is None or one.name == self.backend or one.draws(pose)]

    def items(self) -> Iterator[Item]:
        """The renderers for a menu, each with what it is good for."""
        for name in self.choices:
            words = f"{backends()[name].title}: {backends()[name].good_for}"
            yield words, partial(self.choose, name), name == self.backend

    @property
    def title(self) -> str:
        """The name of the renderer that draws; a word for it before that is known."""
        return _UNKNOWN if self.backend is None else backends()[self.backend].title

    def step(self, by: int) -> None:
        """Draw with the next backend, 1, or the one before, -1."""
        if self.backend is not None:
            names = self.choices
            self.choose(names[(names.index(self.backend) + by) % len(names)])

    @property
    def params(self) -> Any:
        """The backend's parameters; None before the first pose."""
        pose = self.playback.pose
        return None if pose is None else self.session.document.chosen(pose)[1]

    def edit_params(self, params: Any) -> None:
        """Draw with other parameters of the backend; edits of one without a pause are one step."""
        if self.backend is not None and params != self.params:
            name = edit_name(self.params, params)
            changed = self.session.document.with_params(self.backend, params)
            if changed.goal is not None:
                changed = changed.drawn_by(self.backend)
            self.session.history.change(name, changed, merge=name)

    def edit_look(self, look: Look) -> None:
        """Draw with another look; edits of one field without a pause are one step."""
        if look != self.session.document.look:
            before = self.session.document.look
            is_range = replace(before, range=look.range, low=look.low, high=look.high) == look
            name = "Change range" if is_range else edit_name(before, look)
            self.session.change(name, merge=name, look=look)

    def switch_look(self, name: str) -> None:
        """Switch a field of the look on or off."""
        look: Any = self.session.document.look
        self.edit_look(replace(look, **{name: not getattr(look, name)}))

    @property
    def switches(self) -> dict[str, Parameter]:
        """The switches among the backend's parameters, see `params.switches`; none before the first pose."""
        return {} if self.params is None else switches(self.params)

    def is_on(self, name: str) -> bool:
        """Whether one of `switches` is on; False where the backend does not have it."""
        return name in self.switches and self.switches[name].is_on(self.params)

    @property
    def levels(self) -> dict[int, bool]:
        """Whether the backend shows each level, 0: what was measured; empty where it has no such switches."""
        named = (name for name in self.switches if name.startswith(_LEVEL))
        return {int(name[len(_LEVEL) :]): self.is_on(name) for name in named}

    def switch(self, name: str) -> None:
        """Switch one of `switches` on or off."""
        self.edit_params(self.switches[name].switched(self.params))

    COMMANDS = (
        Listing(
            "", items, "renderers", lambda rendering: rendering.title,
            lambda: [_UNKNOWN, *(one.title for one in backends().values())],
        ),
        Command("renderer_for_all", "Use renderer for all scans", toggle_for_all,
            is_on=lambda rendering: rendering.is_for_all),
        Command("reset", "Reset appearance", reset, "Ctrl+R", can=lambda rendering: not rendering.is_default),
    )  # fmt: skip

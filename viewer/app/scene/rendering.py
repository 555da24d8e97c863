"""Which backend draws, how, and in which look."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from ...backends import backends
from ...choice.goal import Goal
from ...document.document import Document
from ...look import Look, drawable
from ...params import switches
from ...scan.pose import Pose
from ...scan.times import frame_in_words
from ..playing.playback import Playback
from ..session import Session, edit_name

_LEVEL = "level_"  # begins the names of switches that show levels
FIRST_GOAL = Goal("time", 50.0)  # ms


class Rendering:
    """Changes backend, parameters and look of the document."""

    def __init__(self, session: Session, playback: Playback, note: Callable[[str], None]) -> None:
        self._session, self._playback, self._note = session, playback, note
        self._missed: set[tuple[str, str]] = set()  # scan, and scalar or backend, which were told

    def tell_missing(self, pose: Pose) -> None:
        """Tell, once a scan, that the chosen backend is not there or cannot draw it, and that neither frame
        nor backend has the number that the user chose to colour by."""
        look, chosen_backend = self._session.document.look, self._session.document.backend
        absent = self._session.scan, f"backend {chosen_backend}"
        stand_in = self._session.document.defaults(pose)[0]
        if chosen_backend not in (None, stand_in) and absent not in self._missed:
            self._missed.add(absent)
            known = backends().get(str(chosen_backend))
            why = (
                f"{known.title} cannot draw this scan"
                if known
                else f"This Scan4D has no renderer '{chosen_backend}'"
            )
            self._note(f"{why}. {backends()[stand_in].title} draws it instead.")
        missed = self._session.scan, look.color_by
        names = self._session.laid.layers(pose).names(pose.overview.scalars)
        drawn_by = backends()[self._session.document.chosen(pose)[0]]
        if missed not in self._missed and drawable(look, names, drawn_by.values) != look:
            self._missed.add(missed)
            chosen = missed[1]
            name = f"scalar {chosen[1:]}" if chosen.startswith("#") else f"'{chosen}'"
            finders = [one.title for one in backends().values() if chosen in one.values]
            self._note(
                f"{drawn_by.title} does not compute {name}, but {' and '.join(finders)} can. The "
                "view shows other colours."
                if finders
                else f"{frame_in_words(pose.index).capitalize()} has no {name} to colour by: "
                "other colours are shown until a frame has it."
            )

    @property
    def backend(self) -> str | None:
        """The name of the backend that draws; None before the first pose."""
        pose = self._playback.pose
        return None if pose is None else self._session.document.chosen(pose)[0]

    def choose(self, name: str) -> None:
        """Draw with a backend."""
        session = self._session
        session.history.change(f"Choose {backends()[name].title}", session.document.drawn_by(name))

    def aim(self, goal: Goal | None) -> None:
        """Have the backend chosen automatically for a goal; None: draw with the one that was chosen before.
        Other bounds without a pause are one step."""
        former = self._session.document.goal
        if goal is None:
            document = self._session.document
            self._session.history.change("Choose renderer by hand", document.drawn_by(document.backend))
        elif former is None:
            self._session.change("Choose renderer automatically", goal=goal)
        elif goal != former:
            self._session.change("Change limit", merge="Change limit", goal=goal)

    def switch_automatic(self) -> None:
        """Have the backend chosen automatically, within a time at first, or not any more."""
        self.aim(FIRST_GOAL if self._session.document.goal is None else None)

    @property
    def is_for_all(self) -> bool:
        """Whether scans that were never open begin with the renderer that draws this one."""
        wanted, usual = self._for_all, self._session.for_all
        return (wanted.backend, wanted.params, wanted.goal) == (usual.backend, usual.params, usual.goal)

    @property
    def _for_all(self) -> Document:
        document = self._session.document
        name = None if document.goal else self.backend
        return Document(
            backend=name,
            params={of: params for of, params in document.params.items() if of == name},
            goal=document.goal,
        )

    def toggle_for_all(self) -> None:
        """Have scans that were never open begin with the renderer and the parameters of this one, or each
        with its own default again."""
        self._session.for_all = Document() if self.is_for_all else self._for_all

    def clear_for_all(self) -> None:
        """Have each scan that was never open begin with its own default."""
        self._session.for_all = Document()

    @property
    def others_begin_with(self) -> str:
        """Words on the renderer that scans which were never open begin with; empty: each with its own."""
        usual = self._session.for_all
        if usual.goal is not None:
            return f"automatic, within {usual.goal}"
        return backends()[usual.backend].title if usual.backend in backends() else ""

    def reset(self) -> None:
        """Draw as a scan is drawn that was never open: renderer, its parameters and look."""
        look = Look(up=self._session.document.look.up)
        usual = replace(self._session.document.drawn_by(None), params={}, look=look)
        self._session.history.change("Reset appearance", usual)

    @property
    def is_default(self) -> bool:
        """Whether all is drawn as `reset` has it."""
        document = self._session.document
        is_own = document.backend is not None or document.goal is not None or document.params
        return not is_own and document.look == Look(up=document.look.up)

    @property
    def choices(self) -> list[str]:
        """The names of the backends that draw the pose, and of the one that is chosen."""
        pose = self._playback.pose
        found = backends().values()
        return [one.name for one in found if pose is None or one.name == self.backend or one.draws(pose)]

    def step(self, by: int) -> None:
        """Draw with the next backend, 1, or the one before, -1."""
        if self.backend is not None:
            names = self.choices
            self.choose(names[(names.index(self.backend) + by) % len(names)])

    @property
    def _params(self) -> Any:
        """The backend's parameters; None before the first pose."""
        pose = self._playback.pose
        return None if pose is None else self._session.document.chosen(pose)[1]

    def edit_params(self, params: Any) -> None:
        """Draw with other parameters of the backend; edits of one without a pause are one step."""
        if self.backend is not None and params != self._params:
            name = edit_name(self._params, params)
            changed = self._session.document.with_params(self.backend, params)
            if changed.goal is not None:
                changed = changed.drawn_by(self.backend)
            self._session.history.change(name, changed, merge=name)

    def edit_look(self, look: Look) -> None:
        """Draw with another look; edits of one field without a pause are one step."""
        if look != self._session.document.look:
            before = self._session.document.look
            is_range = replace(before, range=look.range, low=look.low, high=look.high) == look
            name = "Change range" if is_range else edit_name(before, look)
            self._session.change(name, merge=name, look=look)

    def switch_look(self, name: str) -> None:
        """Switch a field of the look on or off."""
        look: Any = self._session.document.look
        self.edit_look(replace(look, **{name: not getattr(look, name)}))

    @property
    def switches(self) -> dict[str, bool]:
        """The switches among the backend's parameters, see `params.switches`; none before the first pose."""
        return {} if self._params is None else switches(self._params)

    @property
    def levels(self) -> dict[int, bool]:
        """Whether the backend shows each level, 0: what was measured; empty where it has no such switches."""
        switches = self.switches.items()
        return {int(name[len(_LEVEL) :]): is_on for name, is_on in switches if name.startswith(_LEVEL)}

    def switch(self, name: str) -> None:
        """Switch one of `switches` on or off."""
        self.edit_params(replace(self._params, **{name: not self.switches[name]}))

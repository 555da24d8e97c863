"""The automatic choice of the renderer: made when the view is at rest, and kept while it serves."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass
from functools import cached_property
from statistics import median
from typing import Any

from ...choice.choose import Choice, Comparison, known_configurations
from ...choice.goal import Goal, in_unit
from ...choice.known import model_of
from ...choice.model import Model
from ...choice.seen import ScanInView
from ...drawing.request import Request, view_of
from ...errors import InputError
from ...task import Task, in_background
from ..commands import Command
from ..part import WindowPart
from ..playing.playback import Playback
from ..session import Session
from .activity import Activity
from .rendering import Rendering
from .viewport import Viewport

_REST = 0.2  # seconds after the last picture
_LAST = 5  # pictures of one configuration whose times are kept
_OVER = 1.5  # times the limit: what pictures take from then on is reported
_SCALES = (1.0,)  # pictures at rest have all their pixels, and in motion those that there is time for


@dataclass(eq=False)
class Choosing(WindowPart):
    """Chooses the configuration that the scan is drawn in, as long as the document has a goal.

    comparison: of all configurations in the view that is shown, or was at rest last; choice: one; both None
    while there is no goal, and before the first. problem: why nothing is chosen, empty where something is.
    overrun: words on pictures that take far longer than the limit, empty where they do not.
    """

    name = "choosing"
    doing = "Choosing the renderer"
    OFFERS = {"choice_of": "choice_of"}
    session: Session
    playback: Playback
    viewport: Viewport
    rendering: Rendering
    activity: Activity
    note_of_scan: Callable[[str], None]

    def __post_init__(self) -> None:
        self._forget()

    def _forget(self) -> None:
        self.comparison: Comparison | None = None
        self.choice: Choice | None = None
        self.problem = self.overrun = ""
        self._request: Request | None = None  # that was looked at, and how large it was
        self._size = (0, 0)
        self._seeing: Future[ScanInView] | None = None
        self._seen: ScanInView | None = None
        self._compared: Any = None
        self._timed = 0  # the number of the last picture whose time was taken
        self._times: dict[str, deque[float]] = {}  # ms, of pictures in full, by the key of the configuration

    @cached_property
    def _model(self) -> Model | str:
        """The model of the device, or why there is none."""
        try:
            return model_of(self.viewport.renderer.gpu)
        except InputError as error:
            return f"{error.what[:1].upper()}{error.what[1:]}. {error.hint}, and start Scan4D again"

    @property
    def why_not(self) -> str:
        """Why nothing can be chosen on this device; empty where it can."""
        return self._model if isinstance(self._model, str) else ""

    @property
    def waits(self) -> bool:
        """Whether the view is being looked at."""
        return self._seeing is not None

    @property
    def is_due(self) -> bool:
        """Whether there is something to choose for what is shown, once it is at rest."""
        is_wanted = self.session.document.goal is not None and not self.why_not
        return is_wanted and self.viewport.is_there and (self.waits or not self._has_looked)

    @property
    def _has_looked(self) -> bool:
        """Whether what is shown is what was looked at, but for how it is drawn."""
        now, before = self.viewport.request, self._request
        if now is None or before is None or self._size != self.viewport.size:
            return False
        return (now.pose, now.camera, now.layers) == (before.pose, before.camera, before.layers)

    def advance(self, now: float) -> bool:
        """Look at the view, or choose; whether something else was chosen or is to be shown."""
        document, viewport = self.session.document, self.viewport
        if document.goal is None or self.why_not:
            if self._compared is not None or self._request is not None:
                self._forget()
            return False
        self._note_time()
        self._tell_overrun(document.goal)
        is_whole = viewport.is_there and viewport.is_complete and now > viewport.shown_at + _REST
        if self._seeing is not None and self._seeing.done():
            seeing, self._seeing = self._seeing, None
            found = seeing.result()
            self._seen = found if self._has_looked else None
        elif self._seeing is None and self.activity.rests(now) and is_whole and not self._has_looked:
            self._look()
        is_known = self._seen is not None and self._has_looked
        return is_known and self._choose(document.goal)

    def _look(self) -> None:
        """Begin to find out what is known of the view, on a thread of its own."""
        request, size = self.viewport.request, self.viewport.size
        assert request is not None
        self._request, self._size, self._seen = request, size, None
        view = view_of(request, size)
        self._seeing = in_background(Task("Analysing the view"), lambda: ScanInView.of(request.pose, view))

    def _choose(self, goal: Goal) -> bool:
        """Choose by what is known of the view, unless that was done."""
        unit, seen = self.playback.unit, self._seen
        if (asked := (goal, unit, seen)) == self._compared:
            return self._apply()  # undo may bring back a document that another configuration draws
        is_same_goal = self._compared is None or self._compared[:2] == asked[:2]
        self._compared = asked
        assert self._request is not None and seen is not None and not isinstance(self._model, str)
        known = known_configurations(self._request.pose, self._model, _SCALES)
        self.comparison = self.choice = None
        try:
            if not known:
                raise InputError("no renderer with measured times on this device can draw this scan")
            self.comparison = Comparison.of(known, seen, in_unit(goal, unit), self._model)
        except InputError as error:
            self.problem = error.what
            return True
        self.problem = ""
        present = self.session.document.configuration if is_same_goal else None
        self.choice = self.comparison.settled(present)
        self._apply()
        return True

    def _apply(self) -> bool:
        """Have the document drawn as it was chosen; whether it is drawn otherwise so far."""
        if self.choice is None or self.choice.configuration == self.session.document.configuration:
            return False
        self.session.amend(configuration=self.choice.configuration)
        return True

    def _note_time(self) -> None:
        """Take down what the last picture took, where it was drawn in full by a configuration."""
        viewport, chosen = self.viewport, self.session.document.configuration
        surface, request = viewport.surface, viewport.request
        if viewport.number == self._timed or chosen is None or surface is None or request is None:
            return
        self._timed = viewport.number
        is_in_full = viewport.is_complete and not viewport.is_preview and "draw" not in surface.stats.skipped
        if is_in_full and (request.backend.name, request.params) == (
            chosen.backend,
            chosen.params,
        ):
            times = self._times.get(chosen.key)
            if times is None:  # the first one takes what is made once
                self._times[chosen.key] = deque(maxlen=_LAST)
            else:
                times.append(surface.stats.cpu_ms - surface.stats.upload_ms)

    def _tell_overrun(self, goal: Goal) -> None:
        """Tell, once until it is over, that pictures take far longer than the limit."""
        before, ms = self.overrun, self.measured_ms
        is_over = goal.kind == "time" and ms is not None and ms > _OVER * goal.bound
        busy = "The computer is busy, or slower than when 'scan4d bench --calibrate' measured it."
        self.overrun = f"Pictures take {ms:.0f} ms; the limit is {goal}. {busy}" if is_over else ""
        if self.overrun and not before:
            self.note_of_scan(self.overrun)

    @property
    def measured_ms(self) -> float | None:
        """The time of pictures drawn as it was chosen, ms: the median of the last ones; None before there
        are any."""
        times = self._times.get(self.choice.configuration.key) if self.choice is not None else None
        return median(times) if times else None

    def choice_of(self, request: Request) -> Choice | None:
        """The choice that the picture that is shown was drawn by; None where it was made for another view, or
        a user or the scan says how it is drawn."""
        if self.choice is None or self.session.document.goal is None or not self._has_looked:
            return None
        chosen = self.choice.configuration
        return (
            self.choice if (request.backend.name, request.params) == (chosen.backend, chosen.params) else None
        )

    COMMANDS = (
        Command(
            "automatic", "Automatic renderer", lambda choosing: choosing.rendering.switch_automatic(),
            is_on=lambda choosing: choosing.session.document.goal is not None,
            can=lambda choosing: not choosing.why_not or choosing.session.document.goal is not None,
        ),
    )  # fmt: skip

"""How fast the frames of the open scan follow each other: as its document says."""

from __future__ import annotations

from dataclasses import dataclass

from ...scan.open import has_times_in_names, retime
from ...scan.timeline import Timeline
from ...scan.times import typical_rate
from ..part import WindowPart
from ..session import Session
from .playback import Playback


@dataclass(eq=False)
class Pacing(WindowPart):
    """Keeps the times of the frames as the document has them.

    fps: the rate of all scans that the command line states, which wins; None without one. has_names: whether
    the names of the open scan's frames say when they are.
    """

    name = "pacing"
    doing = "Setting the times of frames"
    turn = -2
    session: Session
    playback: Playback
    fps: float | None

    def __post_init__(self) -> None:
        self.is_stated = self.fps is not None
        self.has_names = False
        self._timeline: Timeline | None = None  # the last one that was looked at,
        self._chosen: tuple[float | None, bool] = None, False  # and what its times are by

    @property
    def rate(self) -> float:
        """Frames a second of the scan, as most of them follow each other."""
        return typical_rate(self.playback.timeline.times)

    @property
    def can_change(self) -> bool:
        """Whether the user can say when the frames are."""
        timeline = self.playback.timeline
        return len(timeline) > 1 and not (self.is_stated or timeline.is_measured)

    def choose(self, fps: float | None) -> None:
        """Have this many frames a second."""
        self.session.change("Change frame rate", fps=fps, times_by_names=False)

    def use_names(self, by_names: bool) -> None:
        """Have the names of the frames tell when they are, or not."""
        self.session.change("Use times from file names", times_by_names=by_names)

    def advance(self, now: float) -> bool:
        """Take in what the document says; whether times have changed."""
        timeline, document = self.playback.timeline, self.session.document
        if timeline is not self._timeline:
            self._timeline, self._chosen = timeline, (None, False)
            self.has_names = self.can_change and has_times_in_names(timeline)
        chosen = document.fps, document.times_by_names
        if chosen == self._chosen or not self.can_change:
            return False
        self._chosen = chosen
        retime(timeline, *chosen)
        self.playback.retime(now)
        return True

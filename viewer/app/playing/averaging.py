"""Averages of frames: how many frames count, as the document of the open scan says."""

from __future__ import annotations

from dataclasses import dataclass

from ...scan.timeline import Timeline
from ..part import WindowPart
from ..session import Session
from .playback import Playback

CHOICES = (0, 2, 4, 8, 16, 32)  # frames


@dataclass(eq=False)
class FrameAveraging(WindowPart):
    """Has the timeline average frames as the document says.

    average: frames of all scans that the command line states; None without one.
    """

    name = "averaging"
    doing = "Averaging frames"
    turn = -2
    session: Session
    playback: Playback
    average: int | None

    def begin_scan(self, timeline: Timeline) -> None:
        """Take in what the command line says."""
        if self.average is not None:
            self.session.amend(average=self.average)

    def choose(self, frames: int) -> None:
        """Average so many frames; 0: none."""
        self.session.change("Average frames", merge="average", average=frames)

    def measure(self, averaged: bool) -> None:
        """Have measures use averaged points, or points as scanned."""
        self.session.change("Measure on averaged points", measure_averaged=averaged)

    def advance(self, now: float) -> None:
        """Take in what the document says."""
        self.playback.timeline.average(self.session.document.averaging)

    @property
    def waits(self) -> bool:
        """Whether the average that is to be shown is about to come."""
        pose, wanted = self.playback.pose, self.session.document.averaging
        if pose is None or self.playback.problem is not None:
            return False
        shown = 0 if pose.average is None else pose.average.frames
        return shown != (wanted.frames if wanted.is_on else 0)

    @property
    def words(self) -> str:
        """Words on how much of the shown frame is averaged; empty where frames are not averaged."""
        pose = self.playback.pose
        average = None if pose is None else pose.average
        if average is None:
            return "Averaging..." if self.waits else ""
        if average.usual == 1:
            return "No point stands still: no average"
        return f"{100 * average.share:.0f} % of the points stand still: mean of {average.usual} frames"

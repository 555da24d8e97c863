"""A scan being played: which pose is shown, without ever waiting for the disk."""

from __future__ import annotations

from ..errors import InputError
from ..scan.pose import Pose
from ..scan.timeline import Timeline
from .player import Player
from .session import Session


class Playback:
    """Moves `session.index` along a timeline and finds the pose to show.

    pose: the one that is shown, None before the first. Where reading is slower than
    playing, it is the latest one that is there.
    """

    def __init__(self, timeline: Timeline, session: Session) -> None:
        self.timeline = timeline
        self.session = session
        self.player = Player(timeline.times)
        self.pose: Pose | None = None
        session.index = min(session.index, len(timeline) - 1)
        timeline.request(session.index)

    @property
    def problem(self) -> InputError | None:
        """Why the current frame cannot be read, None where it can."""
        return self.timeline.broken.get(self.session.index)

    @property
    def waiting(self) -> bool:
        """Whether the current frame is still being read."""
        return (self.pose is None or self.pose.index != self.session.index) and self.problem is None

    def toggle(self, now: float) -> None:
        """Play from the current frame, or pause. now: seconds of the clock."""
        if self.player.playing:
            self.player.pause()
        else:
            self.session.index = self.player.play(self.session.index, now)
            self.timeline.prefetch(self.session.index)

    def toggle_loop(self, now: float) -> None:
        """Play round the end, or stop there."""
        self.player.loop = not self.player.loop
        if self.player.playing:
            self.player.play(self.session.index, now)

    def seek(self, index: int, now: float) -> None:
        """Go to a frame; playing goes on from there."""
        if index == self.session.index:
            return
        self.session.index = index
        self.timeline.request(index)
        if self.player.playing:
            self.player.play(index, now)

    def step(self, count: int, now: float) -> None:
        """Pause, and go some frames on."""
        self.player.pause()
        self.seek(self.player.step(self.session.index, count), now)

    def advance(self, now: float) -> None:
        """Take in what time and the timeline's worker have brought."""
        index = self.player.due(self.session.index, now)
        if index != self.session.index:
            self.session.index = index
            self.timeline.prefetch(index)
        self.pose = self._best_pose() or self.pose

    def _best_pose(self) -> Pose | None:
        wanted = self.session.index
        pose = self.timeline.ready(wanted)
        if pose is not None or self.pose is None or not self.player.playing:
            return pose
        held = [self.pose.index, *(index for run in self.timeline.cached() for index in run)]
        return self.timeline.ready(min(held, key=lambda index: (wanted - index) % len(self.timeline)))

    def close(self) -> None:
        """Stop reading."""
        self.timeline.close()

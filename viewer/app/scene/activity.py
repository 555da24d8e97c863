"""Whether the view moves, or rests."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from ..part import WindowPart
from ..playing.playback import Playback
from .glide import Glide
from .steering import Steering


@dataclass(eq=False)
class Activity(WindowPart):
    """Says what goes on in the view."""

    name = "activity"
    playback: Playback
    steering: Steering
    glide: Glide
    is_replaying: Callable[[], bool]

    @property
    def is_moving(self) -> bool:
        """Whether the scan plays or the camera moves."""
        return self.playback.player.playing or self.steering.moves

    @property
    def is_idle(self) -> bool:
        """Whether nothing moves and no frame is awaited, so that workers may use the time."""
        return not (self.is_moving or self.playback.waiting)

    def rests(self, now: float) -> bool:
        """Whether the view stays as it is. now: by the clock, seconds."""
        goes_on = self.is_moving or self.glide.is_on or self.is_replaying()
        return self.steering.rests(now) and not goes_on

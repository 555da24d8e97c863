"""What is known of landmarks through time: one tool has it found, all tools may read it."""

from __future__ import annotations

from collections.abc import Mapping
from functools import reduce
from operator import or_
from types import MappingProxyType

from ..analysis.measures import Series
from ..analysis.motion.followed_points import FollowedPoints
from ..analysis.track import Track
from ..rigid import Rigid


class Followed:
    """The tracks of the open scan's landmarks, and its measures over time.

    tracks: by landmark, of those that are placed, in their order; frames nobody has looked at yet are
    pending. Positions are those of the scan, whatever tools move it to. series: by measure; those that were
    computed. Either is another object where something has changed, and only then. is_following: whether
    more of the tracks is being found, or is about to be; is_measuring: likewise of measures of surfaces.
    still: the motion of each frame to where the stabilised scan stands, None in a gap; None while the scan
    is shown as recorded. curves: other curves by name, by the tool that finds them; another object after
    each change. points: the points of a reference frame, followed through all frames; None before they are.
    """

    def __init__(self) -> None:
        self.tracks: Mapping[str, Track] = MappingProxyType({})
        self.series: Mapping[str, Series] = MappingProxyType({})
        self.is_following = self.is_measuring = False
        self.curves: dict[str, Mapping[str, Series]] = {}
        self.still: tuple[Rigid | None, ...] | None = None
        self.points: FollowedPoints | None = None

    @property
    def is_busy(self) -> bool:
        """Whether more is going to be known, without the user's doing."""
        return self.is_following or self.is_measuring

    @property
    def all_curves(self) -> dict[str, Series]:
        """The series of measures, and the curves of all tools, by name."""
        return reduce(or_, map(dict, self.curves.values()), dict(self.series))

    def take_tracks(self, tracks: Mapping[str, Track]) -> bool:
        """Take in the tracks that are there now; whether one is another object than before."""
        if list(tracks.items()) == list(self.tracks.items()):  # a track equals itself alone
            return False
        self.tracks = MappingProxyType(dict(tracks))
        return True

    def take_series(self, series: Mapping[str, Series]) -> bool:
        """Take in the series that are there now; whether one is another object than before."""
        if list(series.items()) == list(self.series.items()):
            return False
        self.series = MappingProxyType(dict(series))
        return True

"""Landmarks through all frames of a scan, in the order of need."""

from __future__ import annotations

import os
from collections import OrderedDict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from copy import copy
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ...errors import EmptyFrame, InputError
from ...scan.pose import Pose
from ...scan.timeline import Timeline
from ...task import checkpoint
from ..landmarks import Landmark
from ..surface_point import SurfacePoint, followed
from ..track import Track
from .blending import track_of
from .body import DeformableBody
from .carrier import Carrier
from .follower import Follower, Sighting
from .pattern import RecurringPoints
from .settings import TrackingSettings
from .surface import MomentSurface

_MOMENTS = 5  # that are held: two in each direction, and one in which landmarks were set
_APART = 0.04, 3.0  # of the scan's size, and spacings: changes of distances that ask for a body
_MANY = 100  # landmarks of a frame, for which one body costs less than a patch for each
_THREADS = max(1, min(4, os.cpu_count() or 1))


@dataclass(eq=False)
class _Moment:
    """A pose, and its surface once it is needed: one for each thread, which fit parabolas of their own."""

    pose: Pose
    origin: NDArray[np.float64]
    spacing: float
    _surfaces: list[MomentSurface] = field(default_factory=list)

    def surface(self, thread: int) -> MomentSurface:
        while len(self._surfaces) <= thread:
            first = self._surfaces[0] if self._surfaces else None
            made = first.unfitted() if first else MomentSurface.of(self.pose, self.origin, self.spacing)
            self._surfaces.append(made)
        return self._surfaces[thread]


@dataclass(eq=False)
class _Pass:
    """A landmark followed from a spot in one direction, as far as it has come.

    end: the last frame that it has to reach; it may come farther, where it had to before.
    """

    spot: SurfacePoint
    direction: int
    end: int
    seen: dict[int, Sighting] = field(default_factory=dict)
    at: int = -1  # the frame that was looked at last
    follower: Follower | None = None
    topology: str | None = None  # of the frame in which it was set

    def __post_init__(self) -> None:
        self.at = self.spot.frame

    @property
    def left(self) -> int:
        """How many frames are to be looked at."""
        return max((self.end - self.at) * self.direction, 0)

    def is_exact_in(self, topology: str | None) -> bool:
        """Whether its points are known in frames of a topology."""
        return self.spot.id is not None and topology is not None and topology == self.topology

    def has_before(self, frame: int) -> bool:
        """Whether a frame lies on its way that it has yet to reach."""
        return 0 < (frame - self.at) * self.direction <= self.left


Carry = Callable[[Sequence[SurfacePoint]], Sequence[Mapping[int, Sighting]]]
# A pass, and the moments of its key where that is needed, of the frame before, and of the one to look at.
_Followed = tuple[_Pass, _Moment | None, _Moment, _Moment]


class Tracker:
    """Landmarks of a scan, followed from where they were set through all frames.

    Nothing is computed before `run`. `tracks`, `look_at` and `progress` may be used from any thread.
    """

    def __init__(
        self,
        timeline: Timeline,
        landmarks: Sequence[Landmark],
        *,
        first: int = 0,
        settings: TrackingSettings | None = None,
        known: Tracker | None = None,
        carry: Carry | None = None,
    ) -> None:
        """first: the frame that is needed first. known: an earlier tracker of the same timeline, of which
        is taken over what landmarks that have changed leave as it was; that one must not run any more.
        carry: gives the sightings of spots in all frames at once, where densely tracked points know them."""
        self.settings = settings or TrackingSettings()
        self._timeline, self._first, self._carry = timeline, first, carry
        self._landmarks = [landmark for landmark in landmarks if landmark.state == "placed"]
        is_same = known is not None and known._timeline is timeline and known.settings == self.settings
        old = known if is_same else None
        self._origin: NDArray[np.float64] | None = old._origin if old else None
        self._spacing: float = old._spacing if old else 1.0
        self._moments: OrderedDict[int, _Moment] = old._moments if old else OrderedDict()
        self._passes: dict[tuple[SurfacePoint, int], _Pass] = {}
        self._bodies: dict[int, tuple[int, DeformableBody]] = {}  # by direction: in which frame, and which
        self._carriers: dict[tuple[int, int], Carrier] = old._carriers if old else {}  # by key, direction
        for landmark in self._landmarks:
            for part in _passes_of(landmark, len(timeline)):
                name = part.spot, part.direction
                if (shared := self._passes.get(name)) is not None:  # of another landmark in the same place
                    shared.end = max(shared.end, part.end, key=lambda frame: frame * part.direction)
                    continue
                held = old._passes.get(name) if old else None
                if held is not None:
                    held.end = part.end
                self._passes[name] = held or part
        before = {landmark.name: landmark for landmark in old._landmarks} if old else {}
        self._tracks: dict[str, Track] = {}
        for landmark in self._landmarks:
            is_kept = old is not None and before.get(landmark.name) == landmark
            self._tracks[landmark.name] = Track.pending(timeline.times)
            if is_kept and old:
                self._tracks[landmark.name] = old._tracks[landmark.name]
            else:
                self._update(landmark, self._known_frames(landmark))
        self._whole = sum(part.left for part in self._passes.values())

    @property
    def tracks(self) -> Mapping[str, Track]:
        """Each landmark's track so far, by name; what has not changed stays the same object."""
        return dict(self._tracks)

    @property
    def progress(self) -> float:
        """How much of what was to be done is done, 0..1."""
        left = sum(part.left for part in self._passes.values())
        return 1 - left / self._whole if self._whole else 1.0

    def look_at(self, frame: int) -> None:
        """Do first, from now on, what this frame needs."""
        self._first = frame

    def run(self) -> Iterator[int]:
        """Follow the landmarks; gives each frame of which something new is known, as soon as it is.

        Raises Cancelled between frames, see `checkpoint`; another call goes on from there.
        """
        yield from self._carried()
        for frame in sorted({part.spot.frame for part in self._passes.values() if part.left}):
            if self._origin is None:  # that of the first key, in whatever order frames are read
                self._read(frame)
        with (
            ThreadPoolExecutor(1, "scan4d-tracking-reads") as reader,
            ThreadPoolExecutor(_THREADS, "scan4d-tracking") as pool,
        ):
            ahead: tuple[int, Future[_Moment | InputError]] | None = None
            while (step := self._next_step()) is not None:
                checkpoint(self.progress)
                direction, frame, parts = step
                if ahead is not None and ahead[0] == frame:
                    read = ahead[1].result()
                    if isinstance(read, _Moment):
                        self._hold(frame, read)
                following = frame + direction
                ahead = None
                if any(part.left > 1 for part in parts) and following not in self._moments:
                    ahead = following, reader.submit(self._read, following)
                self._look(frame, parts, pool)
                seen = {part.spot: part.left for part in parts}
                for landmark in self._landmarks:
                    if any(key in seen for key in landmark.keys):
                        is_drift_known = any(seen.get(key) == 0 for key in landmark.keys)
                        self._update(landmark, range(len(self._timeline)) if is_drift_known else [frame])
                yield frame
        for part in self._passes.values():
            part.follower = None if not part.left else part.follower
        self._moments.clear()
        self._bodies.clear()
        self._carriers.clear()

    def _carried(self) -> Iterator[int]:
        """Carry the spots of passes that have not begun; gives the frames of which something new is known."""
        parts = [part for part in self._passes.values() if part.left and not part.seen]
        if self._carry is None or not parts:
            return
        spots = list(dict.fromkeys(part.spot for part in parts))
        found = dict(zip(spots, self._carry(spots), strict=True))
        for part in parts:
            if found[part.spot]:
                part.seen, part.at = dict(found[part.spot]), part.end
        for landmark in self._landmarks:
            if any(found.get(key) for key in landmark.keys):
                self._update(landmark, range(len(self._timeline)))
        yield from range(len(self._timeline)) if any(found.values()) else ()

    def _next_step(self) -> tuple[int, int, list[_Pass]] | None:
        """The direction and frame to be looked at next, and the passes that do; None: nothing is left.

        Those that lag behind go first, so that all come to one frame together.
        """
        passes = [part for part in self._passes.values() if part.left]
        if not passes:
            return None
        first = self._first
        needed = [part for part in passes if part.has_before(first)] or passes
        lagging = max(needed, key=lambda part: (part.direction, (first - part.at) * part.direction))
        direction, at = lagging.direction, lagging.at
        return direction, at + direction, [p for p in passes if p.direction == direction and p.at == at]

    def _look(self, frame: int, parts: Sequence[_Pass], pool: ThreadPoolExecutor) -> None:
        """Have passes look at a frame."""
        to_follow: list[_Followed] = []
        for part in parts:
            try:
                moment, key = self._moment(frame), None
                topology = moment.pose.overview.topology
                if part.follower is None and not part.is_exact_in(topology):
                    key = self._moment(part.spot.frame)
                    part.topology = key.pose.overview.topology
            except InputError as error:
                is_empty = isinstance(error, EmptyFrame)
                what = "is empty" if is_empty else f"cannot be read: {error.what}"
                part.seen[frame] = Sighting.gap(f"{error.where or 'a frame'} {what}")
                continue
            if part.is_exact_in(topology):
                part.seen[frame] = _exact(part.spot, moment.pose)
                continue
            try:
                before = self._moment(part.at)
            except InputError:
                before = moment
            to_follow.append((part, key, before, moment))
        if to_follow:
            self._follow(to_follow, frame, pool)
        for part in parts:
            part.at = frame

    def _follow(self, parts: Sequence[_Followed], frame: int, pool: ThreadPoolExecutor) -> None:
        """Have passes that are at one frame look at the next one."""
        parts = self._carry_along(parts, frame)
        if not parts:
            return
        shares = [parts[thread::_THREADS] for thread in range(_THREADS)]
        for thread, share in enumerate(shares):  # made here: what a thread makes, another one must not
            for _, *moments in share:
                for each in moments:
                    if each is not None:
                        each.surface(thread)
        for done in [pool.submit(self._begin, share, thread) for thread, share in enumerate(shares)]:
            done.result()
        _, _, before, moment = parts[0]
        here, there = before.surface(0), moment.surface(0)
        followers = [part.follower for part, *_ in parts if part.follower is not None]
        unmoved = [copy(follower) for follower in followers]
        points = RecurringPoints(here, there, *_starts(followers))
        left = []
        for one in parts:
            part = one[0]
            assert part.follower is not None
            sighting = part.follower.go_along(points, there)
            if sighting is None:
                left.append(one)
            else:
                part.seen[frame] = sighting
        if left:
            self._follow_surface(left, frame, pool, followers, unmoved, points)

    def _carry_along(self, parts: Sequence[_Followed], frame: int) -> Sequence[_Followed]:
        """Have passes look at the next frame that set out from one frame together with many others; gives
        those that are left."""
        assert self._origin is not None
        left: list[_Followed] = []
        groups: dict[int, list[_Followed]] = {}
        for one in parts:
            groups.setdefault(one[0].spot.frame, []).append(one)
        for start, group in groups.items():
            part, key, _, moment = group[0]
            carrier = self._carriers.get((start, part.direction))
            if carrier is not None and (carrier.at - part.at) * part.direction > 0:
                carrier = None  # it is ahead
            if carrier is None and key is not None and part.at == start and len(group) > _MANY:
                carrier = Carrier(start, key.surface(0), self._origin)
                self._carriers[start, part.direction] = carrier
            if carrier is None:
                left += group
                continue
            carrier.move_to(frame, moment.surface(0))
            spots = [one[0].spot for one in group]
            for one, sighting in zip(group, carrier.sightings(spots), strict=True):
                one[0].seen[frame] = sighting
        return left

    def _follow_surface(
        self,
        parts: Sequence[_Followed],
        frame: int,
        pool: ThreadPoolExecutor,
        followers: Sequence[Follower],
        unmoved: Sequence[Follower],
        points: RecurringPoints,
    ) -> None:
        """Have passes that no points carry look at the next frame, along with a body where they need it.

        followers: of all passes. unmoved: as they were in the frame before. points: that recur.
        """
        shares = [parts[thread::_THREADS] for thread in range(_THREADS)]
        first, _, before, moment = parts[0]
        here, there = before.surface(0), moment.surface(0)
        own = [part.follower for part, *_ in parts]
        where, body = self._bodies.get(first.direction, (first.at, None))
        body = body if where == first.at else None
        while True:
            if body is not None:
                for follower in own:
                    if follower is not None:
                        follower.hold_on(body)
                body.move_to(there.held.points, points)
            for done in [pool.submit(_step, share, thread, frame) for thread, share in enumerate(shares)]:
                done.result()
            if body is not None or not (_move_apart(unmoved, followers, there) or _lose(unmoved, followers)):
                break
            body = DeformableBody(here.held.points, here.spacing)
            for follower, was in zip(followers, unmoved, strict=True):
                if follower in own:
                    vars(follower).update(vars(was))
        if body is not None:
            self._bodies[first.direction] = frame, body

    def _begin(self, share: Sequence[_Followed], thread: int) -> None:
        """Make the followers of some passes, in a thread of its own."""
        assert self._origin is not None
        for part, key, *_ in share:
            if part.follower is None and key is not None:
                part.follower = Follower(part.spot, key.surface(thread), self._origin, self.settings)

    def _moment(self, frame: int) -> _Moment:
        """A frame as it is held, or read now. Raises InputError."""
        if frame in self._moments:
            self._moments.move_to_end(frame)
            return self._moments[frame]
        return self._hold(frame, self._read(frame))

    def _hold(self, frame: int, read: _Moment | InputError) -> _Moment:
        if isinstance(read, InputError):
            raise read
        self._moments[frame] = read
        while len(self._moments) > _MOMENTS:
            self._moments.popitem(last=False)
        return read

    def _read(self, frame: int) -> _Moment | InputError:
        try:
            pose = self._timeline.visit(frame)
            if self._origin is None:
                self._origin, self._spacing = pose.origin, pose.spacing
            pose.cloud  # noqa: B018  merged here, beside the passes
            return _Moment(pose, self._origin, self._spacing)
        except InputError as error:
            return error

    def _update(self, landmark: Landmark, frames: Iterable[int]) -> None:
        """Have the track of a landmark tell what is known now of some frames."""
        seen = {name: part.seen for key in landmark.keys for name, part in self._of_key(key)}
        bound = self.settings.bound_at(self._spacing)
        self._tracks[landmark.name] = track_of(landmark, seen, bound, self._tracks[landmark.name], frames)

    def _known_frames(self, landmark: Landmark) -> Iterable[int]:
        """The frames of which anything is known of a landmark."""
        count = len(self._timeline)
        missing = {frame for frame in landmark.missing if frame < count}
        keyed = {key.frame for key in landmark.keys if key.frame < count}
        if not keyed:
            return range(count)  # it was set elsewhere: a gap in all of them
        return (
            missing
            | keyed
            | {frame for key in landmark.keys for _, part in self._of_key(key) for frame in part.seen}
        )

    def _of_key(self, key: SurfacePoint) -> Iterator[tuple[tuple[SurfacePoint, int], _Pass]]:
        for name in ((key, 1), (key, -1)):
            if name in self._passes:
                yield name, self._passes[name]


def _step(share: Sequence[_Followed], thread: int, frame: int) -> None:
    """Have some passes look at a frame, in a thread of its own."""
    for part, _, before, moment in share:
        assert part.follower is not None
        part.seen[frame] = part.follower.step(moment.surface(thread), before.surface(thread))


def _starts(followers: Sequence[Follower]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Give the positions and motions of the landmarks that are not lost, (n, 3) each."""
    found = [follower for follower in followers if follower.position is not None]
    positions = np.array([follower.position for follower in found]).reshape(-1, 3)
    return positions, np.array([follower.velocity for follower in found]).reshape(-1, 3)


def _move_apart(before: Sequence[Follower], after: Sequence[Follower], surface: MomentSurface) -> bool:
    """Whether landmarks move so much against each other, from a frame to the next, as limbs do."""
    both = [(one.position, other.position) for one, other in zip(before, after, strict=True)]
    positions = np.array([(one, other) for one, other in both if one is not None and other is not None])
    if not len(positions):
        return False
    distances = np.linalg.norm(positions[:, None] - positions[None], axis=-1)  # (n, n, 2)
    change = np.abs(distances[..., 1] - distances[..., 0]).max()
    return bool(change > max(_APART[0] * surface.size, _APART[1] * surface.spacing))


def _lose(before: Sequence[Follower], after: Sequence[Follower]) -> bool:
    """Whether a step loses most of the landmarks that were found, as a jump does."""
    found = [
        other.position is None for one, other in zip(before, after, strict=True) if one.position is not None
    ]
    return 2 * sum(found) > len(found)


def _passes_of(landmark: Landmark, count: int) -> Iterator[_Pass]:
    """The ways from each key to the next ones and to the ends of a scan with so many frames."""
    keys = [key for key in landmark.keys if key.frame < count]
    for before, after in zip((None, *keys), (*keys, None), strict=True):
        if before is not None:
            yield _Pass(before, 1, after.frame if after else count - 1)
        if after is not None:
            yield _Pass(after, -1, before.frame if before else 0)


def _exact(spot: SurfacePoint, pose: Pose) -> Sighting:
    """A spot in a pose of the same topology."""
    there = followed(spot, pose)
    if there is None:
        return Sighting.gap("the points around the landmark are missing in this frame")
    spread = np.zeros((3, 3)) if there.spread is None else there.spread
    return Sighting(np.array(there.position), spread)


def track_landmarks(
    timeline: Timeline,
    landmarks: Sequence[Landmark],
    *,
    first: int = 0,
    settings: TrackingSettings | None = None,
    known: Tracker | None = None,
) -> Mapping[str, Track]:
    """Follow landmarks through all frames of a scan; gives their tracks by name. See `Tracker`.

    Raises Cancelled where the task is cancelled.
    """
    tracker = Tracker(timeline, landmarks, first=first, settings=settings, known=known)
    for _ in tracker.run():
        pass
    return tracker.tracks

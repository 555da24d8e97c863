"""Numbers of followed points to colour by, found beside the window for frames in memory, and their range."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from ....analysis.motion.followed_points import FollowedPoints, FrameFacts
from ....analysis.motion.quantities import QUANTITIES, frames_needed
from ....rigid import Rigid
from ....scan.pose import Life, Pose
from ....task import Task, checkpoint
from ...tool_context import ToolContext
from .._colored import rounded_up

_LEAST = {"length": 0.1, "speed": 0.1, "strain": 1.0}  # where a colour map ends at least: spacings, percent

_Key = tuple[object, ...]  # of what the numbers of a frame depend on


class _Largest(NamedTuple):
    """How large a number is in a frame, and what is said of it. key: of what that depends on."""

    key: _Key
    value: float
    facts: FrameFacts


class PointColors:
    """The numbers of the frames that are in memory; each goes with its frame."""

    def __init__(self, context: ToolContext) -> None:
        self._context = context
        self._points: FollowedPoints | None = None
        self._name = ""
        self._found: WeakKeyDictionary[Life, tuple[_Key, NDArray[np.float32]]] = WeakKeyDictionary()
        self._rows: WeakKeyDictionary[Life, NDArray[np.int64]] = WeakKeyDictionary()
        self._unknown: WeakKeyDictionary[Life, NDArray[np.float32]] = WeakKeyDictionary()
        self._largest: dict[int, _Largest] = {}
        self._keys: dict[int, _Key] = {}  # of the frames that are known
        self._of: tuple[object, ...] | None = None  # what these depend on
        self._task: Task | None = None

    def of(self, pose: Pose) -> NDArray[np.float32]:
        """The numbers of a pose, by row of its cloud; NaN as long as they are not known."""
        if (found := self._found.get(pose.life)) is not None:
            return found[1]
        if (unknown := self._unknown.get(pose.life)) is None:
            unknown = self._unknown[pose.life] = np.full(len(pose.cloud), np.nan, np.float32)
        return unknown

    def facts(self, frame: int) -> FrameFacts | None:
        """The facts of the points in a frame; None where they are not known yet."""
        found = self._largest.get(frame)
        return None if found is None else found.facts

    def end(self, name: str) -> float | None:
        """The end of the colour map of a number, as far as its frames are known; None where none is."""
        known = [one.value for one in self._largest.values() if np.isfinite(one.value)]
        if name != self._name or not known or self._points is None:
            return None
        kind = QUANTITIES[name].kind
        least = _LEAST[kind] * (1.0 if kind == "strain" else self._points.spacing)
        return rounded_up(max(*known, least))

    def advance(self, points: FollowedPoints | None, name: str) -> None:
        """Have found what the view shows, the range, then what the view shows next. name: of the number that
        the view shows; "" for none."""
        if points is not self._points or name != self._name:
            if points is not self._points:
                self._rows = WeakKeyDictionary()
            self._points, self._name, self._of = points, name, None
            self._found, self._largest = WeakKeyDictionary(), {}
        if self._task is not None and any(work.task is self._task for work in self._context.works):
            return
        if points is None or not name:
            return
        self._find_keys(points)
        if not (self._color(points, [self._context.index]) or self._measure(points)):
            self._color(points, self._from_shown())

    def _from_shown(self) -> list[int]:
        """All frames, from the one that is shown on."""
        count, shown = len(self._context.timeline), self._context.index
        return [(shown + step) % count for step in range(count)]

    def _find_keys(self, points: FollowedPoints) -> None:
        """Find on which motions the number depends in each frame that is known, where these may be others."""
        count, known = len(self._context.timeline), points.known
        ends = _key_of({frame: self._context.motion_of(frame) for frame in (0, count - 1)})
        of = self._context.followed.still, ends, len(known)
        if of != self._of:
            self._of = of
            self._keys = {
                frame: _key_of(self._motions(points, frame))
                for frame in range(count)
                if known.issuperset({points.reference, *frames_needed(self._name, frame, count)})
            }

    def _motions(self, points: FollowedPoints, frame: int) -> dict[int, Rigid | None]:
        needed = frames_needed(self._name, frame, len(self._context.timeline))
        return {index: self._context.motion_of(index) for index in {points.reference, *needed}}

    def _color(self, points: FollowedPoints, frames: list[int]) -> bool:
        """Have the numbers of the first of these frames found that lacks them; whether there is one."""
        for frame in frames:
            pose = self._context.timeline.ready(frame) if frame in self._keys else None
            if pose is None or self._found.get(pose.life, (None,))[0] == self._keys[frame]:
                continue
            self._run(self._coloring(points, pose))
            return True
        return False

    def _coloring(self, points: FollowedPoints, pose: Pose) -> Callable[[], Callable[[], None]]:
        """Work that finds the numbers of a pose."""
        name, key, motions = self._name, self._keys[pose.index], self._motions(points, pose.index)
        nearest, found, known = self._rows, self._found, self._rows.get(pose.life)

        def find() -> Callable[[], None]:
            rows = points.rows_nearest(pose) if known is None else known
            values = points.of_pose(name, pose.index, rows, motions.get)

            def take() -> None:
                nearest[pose.life], found[pose.life] = rows, (key, values)

            return take

        return find

    def _measure(self, points: FollowedPoints) -> bool:
        """Have found how large the number is in frames of which that is not known; whether there are any."""
        name, keys, largest = self._name, self._keys, self._largest
        left = [frame for frame in keys if frame not in largest or largest[frame].key != keys[frame]]
        motions = {frame: self._motions(points, frame) for frame in left}
        if not left:
            return False

        def find() -> Callable[[], None]:
            found = {}
            for number, frame in enumerate(left):
                checkpoint(number / len(left))
                value = points.largest(name, frame, motions[frame].get)
                found[frame] = _Largest(keys[frame], value, points.facts(frame))
            return lambda: largest.update(found)

        self._run(find)
        return True

    def _run(self, find: Callable[[], Callable[[], None]]) -> None:
        self._task = self._context.run("Measuring displacements", find, lambda take: take())


def _key_of(motions: Mapping[int, Rigid | None]) -> _Key:
    return tuple(
        (frame, None if one is None else one.matrix.tobytes()) for frame, one in sorted(motions.items())
    )

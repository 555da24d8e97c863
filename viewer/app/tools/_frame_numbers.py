"""Numbers of the frames that are in memory, found beside the window; each goes with its frame."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Generic, TypeVar
from weakref import WeakKeyDictionary

from ...scan.pose import Life, Pose
from ...task import Task
from ..tool_context import ToolContext

V = TypeVar("V")


class FrameNumbers(Generic[V]):
    """The numbers of frames, such as distances, first of the frame that the view shows."""

    def __init__(self, context: ToolContext, title: str, unknown: Callable[[Pose], V]) -> None:
        """title: of the work, as the window shows it. unknown: numbers of a pose before they are known."""
        self._context, self._title, self._make_unknown = context, title, unknown
        self._found: WeakKeyDictionary[Life, tuple[object, V]] = WeakKeyDictionary()
        self._unknown: WeakKeyDictionary[Life, V] = WeakKeyDictionary()
        self._keys: Mapping[int, object] = {}
        self._task: Task | None = None

    def of(self, pose: Pose) -> V:
        """The numbers of a pose; the unknown ones where it has no key, and as long as they are not known."""
        found = self._found.get(pose.life)
        if found is not None and pose.index in self._keys and found[0] == self._keys[pose.index]:
            return found[1]
        if (unknown := self._unknown.get(pose.life)) is None:
            unknown = self._unknown[pose.life] = self._make_unknown(pose)
        return unknown

    def advance(self, keys: Mapping[int, object], find: Callable[[Pose], V]) -> None:
        """Have found what the view shows, then what it shows next.

        keys: of what the numbers depend on, by frame; frames without one are left. find: gives the numbers
        of a pose, on a thread of its own.
        """
        self._keys = keys
        if self._task is not None and any(work.task is self._task for work in self._context.works):
            return
        if (pose := self._next(keys)) is None:
            return
        found, key = self._found, keys[pose.index]

        def take(values: V) -> None:
            found[pose.life] = key, values

        self._task = self._context.run(self._title, lambda: find(pose), take)

    def _next(self, keys: Mapping[int, object]) -> Pose | None:
        """The first pose from the one that is shown on, in memory, whose numbers are not known."""
        timeline, shown = self._context.timeline, self._context.index
        for step in range(len(timeline)):
            frame = (shown + step) % len(timeline)
            pose = timeline.ready(frame) if frame in keys else None
            if pose is not None and self._found.get(pose.life, (None,))[0] != keys[frame]:
                return pose
        return None

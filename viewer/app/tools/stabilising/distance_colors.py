"""Distances from the reference frame, to colour the scan by: found beside the window for frames in memory."""

from __future__ import annotations

from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from ....analysis.motion.distances import distances_from, unknown_distances
from ....rigid import Rigid
from ....scan.pose import Life, Pose
from ....task import Task
from ...tool_context import ToolContext
from .stabiliser import Motions

Values = NDArray[np.float32]


class DistanceColors:
    """The distances of the frames that are in memory; each goes with its frame."""

    def __init__(self, context: ToolContext) -> None:
        self._context = context
        self._motions: Motions | None = None
        self._found: WeakKeyDictionary[Life, Values] = WeakKeyDictionary()
        self._unknown: WeakKeyDictionary[Life, Values] = WeakKeyDictionary()
        self._task: Task | None = None

    def of(self, pose: Pose) -> Values:
        """The distances of a pose, by row of its cloud; NaN as long as they are not known."""
        if (found := self._found.get(pose.life)) is not None:
            return found
        if (unknown := self._unknown.get(pose.life)) is None:
            unknown = self._unknown[pose.life] = unknown_distances(len(pose.cloud))
        return unknown

    def advance(self, motions: Motions | None, is_wanted: bool) -> None:
        """Have found what the view shows, then what it shows next. is_wanted: whether the view shows any."""
        if motions is not self._motions:
            self._motions, self._found = motions, WeakKeyDictionary()
        if self._task is not None and any(work.task is self._task for work in self._context.works):
            return
        if motions is None or motions.reference is None or not is_wanted:
            return
        pose = self._next(motions)
        if pose is None:
            return
        motion, found = motions.known[pose.index].motion, self._found
        if motion is None:
            found[pose.life] = unknown_distances(len(pose.cloud))
            return
        surface, origin, back = motions.reference.surface, motions.reference.origin, motion.inverse

        def find(pose: Pose = pose, back: Rigid = back) -> Values:
            return distances_from(surface, origin, pose.cloud, back)

        def take(values: Values) -> None:
            found[pose.life] = values

        self._task = self._context.run("Measuring distances", find, take)

    def _next(self, motions: Motions) -> Pose | None:
        """The first pose from the one that is shown on, in memory, whose distances are not known yet."""
        timeline, shown = self._context.timeline, self._context.index
        for step in range(len(timeline)):
            frame = (shown + step) % len(timeline)
            pose = timeline.ready(frame) if frame in motions.known else None
            if pose is not None and pose.life not in self._found:
                return pose
        return None

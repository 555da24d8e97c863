"""Numbers to colour the scan by, found beside the window for frames in memory: how far each point is from the
reference frame, and whether it is of the rigid region."""

from __future__ import annotations

from collections.abc import Mapping
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from ....analysis.motion import distances
from ....analysis.motion.distances import distances_from, in_region, unknown_distances
from ....scan.pose import Life, Pose
from ....task import Task
from ...tool_context import ToolContext
from .stabiliser import Motions

Values = Mapping[str, NDArray[np.float32]]
REGION = "rigid region"  # 1 in the region, 0 elsewhere


class MotionColors:
    """The numbers of the frames that are in memory; each goes with its frame."""

    def __init__(self, context: ToolContext) -> None:
        self._context = context
        self._motions: Motions | None = None
        self._found: WeakKeyDictionary[Life, Values] = WeakKeyDictionary()
        self._unknown: WeakKeyDictionary[Life, Values] = WeakKeyDictionary()
        self._task: Task | None = None

    def of(self, pose: Pose) -> Values:
        """The numbers of a pose by name, by row of its cloud; NaN as long as they are not known."""
        if (found := self._found.get(pose.life)) is not None:
            return found
        if (unknown := self._unknown.get(pose.life)) is None:
            unknown = self._unknown[pose.life] = _unknown(pose)
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
            found[pose.life] = _unknown(pose)
            return
        reference, rows, back = motions.reference, motions.rows, motion.inverse

        def find() -> Values:
            surface, origin, cloud = reference.surface, reference.origin, pose.cloud
            return {
                distances.NAME: distances_from(surface, origin, cloud, back),
                REGION: in_region(surface, origin, cloud, back, rows),
            }

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


def _unknown(pose: Pose) -> Values:
    return dict.fromkeys((distances.NAME, REGION), unknown_distances(len(pose.cloud)))

"""Numbers to colour the scan by, found beside the window for frames in memory: how far each point is from the
reference frame, and whether it is of the rigid region."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ....analysis.motion import distances
from ....analysis.motion.distances import distances_from, in_region, unknown_distances
from ....scan.pose import Pose
from ...tool_context import ToolContext
from .._frame_numbers import FrameNumbers
from .stabiliser import Motions

Values = Mapping[str, NDArray[np.float32]]
REGION = "rigid region"  # 1 in the region, 0 elsewhere


class MotionColors:
    """The numbers of the frames that are in memory."""

    def __init__(self, context: ToolContext) -> None:
        self._numbers = FrameNumbers[Values](context, "Measuring distances", _unknown)

    def of(self, pose: Pose) -> Values:
        """The numbers of a pose by name, by row of its cloud; NaN as long as they are not known."""
        return self._numbers.of(pose)

    def advance(self, motions: Motions | None, is_wanted: bool) -> None:
        """Have found what the view shows, then what it shows next. is_wanted: whether the view shows any."""
        if motions is None or motions.reference is None:
            self._numbers.advance({}, _unknown)
            return
        if not is_wanted:
            return
        reference, rows, known = motions.reference, motions.rows, motions.known

        def find(pose: Pose) -> Values:
            motion, cloud = known[pose.index].motion, pose.cloud
            if motion is None:
                return _unknown(pose)
            surface, origin = reference.surface, reference.origin
            return {
                distances.NAME: distances_from(surface, origin, cloud, motion.inverse),
                REGION: in_region(surface, origin, cloud, motion.inverse, rows),
            }

        self._numbers.advance(dict.fromkeys(list(known), motions), find)


def _unknown(pose: Pose) -> Values:
    return dict.fromkeys((distances.NAME, REGION), unknown_distances(len(pose.cloud)))

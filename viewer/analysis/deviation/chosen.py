"""The reference of deviations as a user chooses it, and the deviations of frames from it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...rigid import Rigid
from ...scan.open import open_scan
from ...scan.points import PointCloud
from ...scan.pose import Pose
from ...scan.timeline import Timeline
from ..motion.rest import mean_of_rest
from ..motion.stabilise import MotionReference
from .reference import DeviationReference, deviation_reference

NAME = "deviation"  # of the numbers, as looks colour by them
_REACH = 0.1  # of the longest edge of the box around the reference

Float = NDArray[np.float64]


def search_reach(pose: Pose) -> float:
    """The distance from a reference beyond which a point has no value, where none is stated, scan units."""
    return _REACH * float((pose.bounds.high - pose.bounds.low).max())


@dataclass(frozen=True, eq=False)
class Deviations:
    """Signed distances from a reference.

    reach: beyond which a point has no value, scan units. assumes_unit: the reference states no unit, so that
    Scan4D assumes that of the scan.
    """

    reference: DeviationReference
    reach: float
    assumes_unit: bool = False

    def of(self, cloud: PointCloud, reference_from_frame: Rigid) -> NDArray[np.float32]:
        """The deviations of a cloud, (N,) float32 by row, scan units; NaN where a point has none."""
        moved = reference_from_frame.points(cloud.world())
        return self.reference.signed(moved, self.reach).astype(np.float32)


@dataclass(frozen=True)
class ReferenceChoice:
    """A reference by where it comes from.

    first, last: frames of the scan; where they differ, all from the one to the other, whose mean it is. file:
    another scan or a mesh, of which the first frame counts; "": the scan itself.
    """

    first: int = 0
    last: int = 0
    file: str = ""

    def read(self, timeline: Timeline) -> Deviations:
        """Deviations from the reference. timeline: of the scan. Raises InputError."""
        if self.file:
            with open_scan(self.file) as other:
                assumes_unit = timeline.gives_unit_to(other)
                return _deviations(other, other.pose(0), assumes_unit)
        timeline.label(self.last)  # raises where there is none
        pose = timeline.pose(self.first)
        if self.first != self.last:
            frames = range(self.first, self.last + 1) if self.first < self.last else range(0)
            if not frames:
                raise InputError("The last frame of the mean is before its first frame.")
            region = MotionReference.of(pose, np.arange(len(pose.cloud)), self.first)
            pose = mean_of_rest(timeline, pose, region, frames).pose
        return _deviations(timeline, pose)


def _deviations(timeline: Timeline, pose: Pose, assumes_unit: bool = False) -> Deviations:
    faces = timeline.faces(pose.index).triangles()
    return Deviations(deviation_reference(pose, faces), search_reach(pose), assumes_unit)


def moved_to_reference(
    choice: ReferenceChoice, shown: Rigid | None, reference_shown: Rigid | None
) -> Rigid | None:
    """The motion of a frame to the coordinates of the reference; None where it is not known.

    shown, reference_shown: by which the frame and the first frame of the reference are shown; None in a gap
    of a stabilised scan. Another scan stands as its file has it.
    """
    if shown is None or choice.file:
        return shown
    return None if reference_shown is None else reference_shown.inverse.after(shown)

"""The mean of frames in which the subject rests, as a reference with less noise than any of them.

The frames are stabilised to the first of them. Each point of the first moves onto the mean of their surfaces,
along their normals. A frame counts at a point where its surface is off no more than noise explains, so that
what moves between the frames, such as an eyelid, stays as it is in the first.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...scan.pose import Pose
from ...scan.timeline import Timeline
from .stabilise import FrameMotion, MotionReference, moment_surface, stabilise

_REACH = 3.0  # spacings, within which a frame has its surface
_MOST = 3.0  # standard deviations of noise, that a surface may be off, or
_FLOOR = 0.02  # spacings
_DEVIATION = 1.4826  # standard deviation of Gaussian residuals, by their median absolute deviation


@dataclass(frozen=True, eq=False)
class RestMean:
    """The mean of rest frames.

    pose: the first frame, with its N points moved. counts: (N,), how many frames each point is the mean of.
    frames: that were averaged. left_out: reasons, by frame.
    """

    pose: Pose
    counts: NDArray[np.int64]
    frames: tuple[int, ...]
    left_out: Mapping[int, str]


def mean_of_rest(timeline: Timeline, pose: Pose, region: MotionReference, frames: Sequence[int]) -> RestMean:
    """Average frames. pose: the first of them. region: that counts as rigid in it, by which they are
    stabilised.

    With n frames, noise falls at least with the square root of n: the surfaces of the other frames are fitted
    to several points. Raises InputError where no other frame fits the first.
    """
    from .region_kernels import heights_over

    world = pose.cloud.world()
    ways, counts = np.zeros_like(world), np.ones(len(world), np.int64)
    known: dict[int, FrameMotion] = {}
    rows = region.region.rows
    for frame in stabilise(timeline, region, 0.0, known, frames):
        motion = known[frame].motion
        if motion is None or frame == region.frame:
            continue
        surface = moment_surface(timeline.pose(frame).cloud, region.origin)
        moved = np.ascontiguousarray(motion.points(world) - region.origin)
        heights, normals = heights_over(surface.held, moved, _REACH * surface.spacing)
        noise = _DEVIATION * float(np.nanmedian(np.abs(heights[rows])))
        counted = np.abs(heights) <= max(_MOST * noise, _FLOOR * surface.spacing)
        ways[counted] -= (heights[counted, None] * normals[counted]) @ motion.rotation
        counts += counted
    left_out = {frame: known[frame].reason for frame in frames if known[frame].motion is None}
    averaged = tuple(frame for frame in frames if frame not in left_out)
    if len(averaged) == 1:
        frame, reason = next(iter(left_out.items()))
        what = f"no other frame fits the first one of the mean; {timeline.label(frame)}: {reason}"
        raise InputError(what, timeline.name, "Name frames in which the subject rests, or one frame")
    cloud = pose.cloud
    positions = world + ways / counts[:, None] - cloud.origin
    mean = replace(cloud, positions=positions.astype(np.float32), remainders=None, octree=None)
    return RestMean(replace(pose, points=mean), counts, averaged, left_out)

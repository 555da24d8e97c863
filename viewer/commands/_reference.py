"""The moment in which motions begin, as the command line names it."""

from __future__ import annotations

import hashlib
import re
from argparse import Namespace
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import __version__
from ..analysis.motion.rest import RestMean, mean_of_rest
from ..analysis.motion.stabilise import MotionReference
from ..document.recording import fingerprint
from ..document.saved_session import known_as
from ..errors import InputError
from ..scan.pose import Pose
from ..scan.timeline import Timeline
from ..scan.times import frame_in_words
from ._console import tell, warn
from ._scans import open_timeline, poses_between


@dataclass(frozen=True, eq=False)
class StartOfMotion:
    """The pose that motions begin in.

    named: as the command line names it. frame: the frame of the scan that it is; None: it is none of them.
    rest: the frames that it is to be the mean of, or is. scan: the other scan that it is of. mean: how it was
    averaged.
    """

    pose: Pose
    named: str
    frame: int | None
    rest: tuple[int, ...] = ()
    scan: str | None = None
    mean: RestMean | None = None

    @classmethod
    def of(cls, args: Namespace, timeline: Timeline) -> StartOfMotion:
        """The reference that the command line names; of rest frames, the first one. Raises InputError."""
        named = args.reference
        if re.fullmatch(r"-?[\d:,]+", named):
            if len(timeline) == 1:
                hint = "Name a scan with several frames, or name another scan with --reference"
                raise InputError("has only one frame, so there is no motion to find", timeline.name, hint)
            return cls.in_frames(timeline, named, "--reference")
        with open_timeline(args, named) as other:
            check_unit(other, timeline)
            return cls(other.pose(0), named, None, scan=named)

    @classmethod
    def in_frames(cls, timeline: Timeline, named: str, option: str) -> StartOfMotion:
        """The frame or the frames, such as 0,3,7 or 0:6, that an option names. Raises InputError."""
        frames = _frames(named, timeline, option)
        return cls(timeline.pose(frames[0]), named, frames[0], frames if len(frames) > 1 else ())

    def averaged(self, timeline: Timeline, region: MotionReference) -> StartOfMotion:
        """The mean of its rest frames. Raises InputError."""
        mean = mean_of_rest(timeline, self.pose, region, self.rest)
        for frame, reason in mean.left_out.items():
            warn(f"The reference is averaged without {frame_in_words(frame)}: {reason}")
        points = f"{mean.counts.mean():.1f} frames a point"
        tell(f"The reference is the mean of {len(mean.frames)} frames; on average, of {points}")
        return replace(self, pose=mean.pose, frame=None, mean=mean)

    def facts(self) -> dict[str, Any]:
        """The facts for the report."""
        mean = self.mean and {
            "frames": [frame + 1 for frame in self.mean.frames],
            "frames_of_a_point": float(self.mean.counts.mean()),
            "left_out": {str(frame + 1): reason for frame, reason in self.mean.left_out.items()},
        }
        return {"scan": self.scan, "frame": self.pose.index + 1, "label": self.pose.label, "mean": mean}


def check_unit(other: Timeline, timeline: Timeline) -> None:
    """Warn where Scan4D assumes the unit of a reference scan. Raises InputError where it has another unit."""
    if timeline.gives_unit_to(other):
        warn(f"{other.name} states no unit. Scan4D assumes {timeline.unit}, the unit of the scan")


def _frames(text: str, timeline: Timeline, option: str) -> tuple[int, ...]:
    """The frames that an option names, the first one first. Raises InputError."""
    frames: dict[int, None] = {}
    for part in text.split(","):
        if part.removeprefix("-").isdecimal():
            timeline.label(int(part))  # raises where there is none
            frames[int(part)] = None
        else:
            frames |= dict.fromkeys(poses_between(part, timeline, option))
    return tuple(frames)


def key_of_partial(
    args: Namespace, timeline: Timeline, reference: StartOfMotion, positions: NDArray[np.float64]
) -> dict[str, Any]:
    """The scan, the reference, and positions in it that partial results must be of, to be used again."""
    return {
        "version": __version__,
        "scan": known_as(args.scan),
        "hash": fingerprint(timeline.files),
        "times": len(timeline),
        "unit": timeline.unit,
        "reference": reference.named,
        "positions": hashlib.sha256(positions.tobytes()).hexdigest(),
    }

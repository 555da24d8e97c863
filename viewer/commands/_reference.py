"""The moment in which the motions of `scan4d motion` begin."""

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
from ..scan.units import conversion
from ._console import tell, warn
from ._scans import open_timeline, poses_between


@dataclass(frozen=True, eq=False)
class StartOfMotion:
    """The pose that motions begin in.

    frame: the frame of the scan that it is; None: it is none of them. rest: the frames that it is to be the
    mean of, or is. scan: the other scan that it is of. mean: how it was averaged.
    """

    pose: Pose
    frame: int | None
    rest: tuple[int, ...] = ()
    scan: str | None = None
    mean: RestMean | None = None

    @classmethod
    def of(cls, args: Namespace, timeline: Timeline) -> StartOfMotion:
        """The reference that the command line names; of rest frames, the first one. Raises InputError."""
        if not re.fullmatch(r"-?[\d:,]+", args.reference):
            return cls._of_scan(args, timeline)
        frames = _frames(args.reference, timeline)
        if len(timeline) == 1:
            hint = "Name a scan with several frames, or name another scan with --reference"
            raise InputError("has only one frame, so there is no motion to find", timeline.name, hint)
        return cls(timeline.pose(frames[0]), frames[0], frames if len(frames) > 1 else ())

    @classmethod
    def _of_scan(cls, args: Namespace, timeline: Timeline) -> StartOfMotion:
        with open_timeline(args, args.reference) as other:
            if conversion(other.unit, timeline.unit) != 1.0:
                what = f"has the unit '{other.unit}', but the scan has '{timeline.unit}'"
                raise InputError(what, other.name, "Use a reference in the unit of the scan")
            return cls(other.pose(0), None, scan=args.reference)

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


def _frames(text: str, timeline: Timeline) -> tuple[int, ...]:
    """The frames that a text names, the first one first. Raises InputError."""
    frames: dict[int, None] = {}
    for part in text.split(","):
        if part.removeprefix("-").isdecimal():
            timeline.label(int(part))  # raises where there is none
            frames[int(part)] = None
        else:
            frames |= dict.fromkeys(poses_between(part, timeline, "--reference"))
    return tuple(frames)


def key_of_partial(args: Namespace, timeline: Timeline, positions: NDArray[np.float64]) -> dict[str, Any]:
    """The scan, the reference, and positions in it that partial results must be of, to be used again."""
    return {
        "version": __version__,
        "scan": known_as(args.scan),
        "hash": fingerprint(timeline.files),
        "times": len(timeline),
        "unit": timeline.unit,
        "reference": args.reference,
        "positions": hashlib.sha256(positions.tobytes()).hexdigest(),
    }

"""The moment in which the motions of `scan4d motion` begin."""

from __future__ import annotations

import hashlib
from argparse import Namespace
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import __version__
from ..document.recording import fingerprint
from ..document.saved_session import known_as
from ..errors import InputError
from ..scan.pose import Pose
from ..scan.timeline import Timeline
from ..scan.units import conversion
from ._scans import open_timeline


@dataclass(frozen=True, eq=False)
class StartOfMotion:
    """The pose that motions begin in. frame: the frame of the scan that it is; None: it is of another
    scan."""

    pose: Pose
    frame: int | None
    scan: str | None

    @classmethod
    def of(cls, args: Namespace, timeline: Timeline) -> StartOfMotion:
        """The reference that the command line names. Raises InputError."""
        if isinstance(args.reference, int):
            timeline.label(args.reference)  # raises where there is none
            if len(timeline) == 1:
                hint = "Name a scan with several frames, or name another scan with --reference"
                raise InputError("has only one frame, so there is no motion to find", timeline.name, hint)
            return cls(timeline.pose(args.reference), args.reference, None)
        with open_timeline(args, args.reference) as other:
            if conversion(other.unit, timeline.unit) != 1.0:
                what = f"has the unit '{other.unit}', but the scan has '{timeline.unit}'"
                raise InputError(what, other.name, "Use a reference in the unit of the scan")
            return cls(other.pose(0), None, args.reference)

    def facts(self) -> dict[str, Any]:
        """The facts for the report."""
        frame = 1 if self.frame is None else self.frame + 1
        return {"scan": self.scan, "frame": frame, "label": self.pose.label}


def key_of_partial(args: Namespace, timeline: Timeline, positions: NDArray[np.float64]) -> dict[str, Any]:
    """The scan, the reference, and positions in it that partial results must be of, to be used again."""
    return {
        "version": __version__,
        "scan": known_as(args.scan),
        "hash": fingerprint(timeline.files),
        "times": len(timeline),
        "unit": timeline.unit,
        "reference": str(args.reference),
        "positions": hashlib.sha256(positions.tobytes()).hexdigest(),
    }

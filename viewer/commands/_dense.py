"""`scan4d motion --dense`: where every point of the reference frame is in the other frames."""

from __future__ import annotations

import hashlib
from argparse import Namespace
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from .. import __version__
from ..analysis.motion.dense import DensePoints, PointState, follow_points
from ..analysis.motion.displacements import save_displacements
from ..analysis.motion.partial_frames import PartialFrames
from ..document.recording import fingerprint
from ..document.saved_session import known_as
from ..errors import InputError
from ..files import output_folder, save_json
from ..scan.inputs import scan_inputs
from ..scan.pose import Pose
from ..scan.timeline import Timeline
from ._console import progress, tell, warn
from ._outputs import claim
from ._scans import report

_FILE, _REPORT, _PARTIAL = "displacements.npz", "report.json", "displacements.partial"
_POOR = 0.5  # of the points: a warning where fewer are seen

ReferencePose = Callable[[Namespace, Timeline], tuple[Pose, int | None]]


def run_dense(args: Namespace, timeline: Timeline, reference_pose: ReferencePose) -> list[Path]:
    """Follow every point of the reference frame; gives the files that it wrote. Raises InputError."""
    if args.region:
        raise InputError("--dense follows all points, so it takes no --region", hint="Omit --region")
    file, facts = args.out / _FILE, args.out / _REPORT
    claim([file, facts], scan_inputs(timeline), args.force)
    pose, frame = reference_pose(args, timeline)
    output_folder(args.out)
    points = DensePoints(pose)
    kept = PartialFrames(args.out / _PARTIAL, _key(args, timeline, points))
    done = sum(index in kept for index in range(len(timeline)))
    if done:
        tell(f"Scan4D continues: {done} of {len(timeline)} frames are known")
    with progress(len(timeline) - done) as tick:
        for _ in follow_points(timeline, points, frame, kept):
            tick()
    report(timeline, 0)
    save_displacements(file, points.reference, len(timeline), kept.read)
    shares, bodies = [], 0
    for index in range(len(timeline)):
        one = kept.read(index)
        shares.append(np.bincount(one.state, minlength=3) / len(one.state))
        bodies += one.pose is not None
    states = np.array(shares)
    others = np.delete(states, [] if frame is None else frame, axis=0)
    is_exact = not bodies and bool((others[:, PointState.LOST] < 1).any())
    found = {
        "version": __version__,
        "scan": timeline.name,
        "unit": timeline.unit,
        "reference": {"frame": None if frame is None else frame + 1, "label": pose.label},
        "points": len(points.points),
        "same_points_in_file": is_exact,
        "states": {
            state.name.lower(): {"share": float(states[:, state].mean()), "frames": states[:, state].tolist()}
            for state in PointState
        },
    }
    save_json(facts, found)
    kept.end()
    _tell(states, is_exact, len(points.points))
    return [file, facts]


def _key(args: Namespace, timeline: Timeline, points: DensePoints) -> dict[str, Any]:
    """The scan and reference that frames must be of, to be used again."""
    return {
        "version": __version__,
        "scan": known_as(args.scan),
        "hash": fingerprint(timeline.files),
        "times": len(timeline),
        "unit": timeline.unit,
        "reference": str(args.reference),
        "points": hashlib.sha256(points.reference.tobytes()).hexdigest(),
    }


def _tell(shares: np.ndarray, is_exact: bool, count: int) -> None:
    """The report in words. shares: (F, 3), of the states in each frame."""
    if is_exact:
        tell(f"The frames hold the same {count:,} points: their motion is exact")
        return
    seen, hidden, lost = shares.mean(axis=0)
    tell(f"Of {count:,} points, {seen:.1%} are seen, {hidden:.1%} hidden, {lost:.1%} lost")
    poor = int((shares[:, PointState.SEEN] < _POOR).sum())
    if poor:
        warn(f"Fewer than half of the points are seen in {poor} of {len(shares)} frames")

"""Find the motion of a rigid region, such as the head, over time.

Scan4D writes into DIR: transforms.csv with the motion of each frame and how sure it is, report.json, and
region.json with the points of the region. If you interrupt the command, the same command later continues.
"""

from __future__ import annotations

import hashlib
from argparse import ArgumentParser, ArgumentTypeError, Namespace
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import __version__
from ..analysis.motion.axes import anatomical_axes, weak_directions
from ..analysis.motion.found import found_region
from ..analysis.motion.partial import PartialMotions
from ..analysis.motion.region import RigidRegion
from ..analysis.motion.stabilise import FrameMotion, MotionReference, MotionState, WeakLimits, stabilise
from ..csv_text import cell, save_rows
from ..document.landmarks import Landmarks
from ..document.recording import fingerprint
from ..document.saved_session import known_as, stored
from ..errors import InputError
from ..files import output_folder, save_json
from ..scan.inputs import scan_inputs
from ..scan.pose import Pose
from ..scan.timeline import Timeline
from ..scan.times import frame_in_words
from ..scan.units import conversion
from ._console import progress, tell, warn
from ._dense import run_dense
from ._outputs import add_output_argument, claim
from ._scans import SCAN_HELP, open_timeline, report

_TABLE, _REPORT, _REGION, _PARTIAL = "transforms.csv", "report.json", "region.json", "transforms.partial"
_COLUMNS = (
    "frame", "time", "qw", "qx", "qy", "qz", "tx", "ty", "tz",
    "sigma_rx", "sigma_ry", "sigma_rz", "sigma_tx", "sigma_ty", "sigma_tz", "state",
)  # fmt: skip
_CLOSE = 0.5  # mm
_RIGID = 0.95  # of distances: a region of which fewer are close changes its shape
_WORLD = np.eye(3)


def add_arguments(parser: ArgumentParser) -> None:
    """The arguments of `scan4d motion`."""
    parser.add_argument("scan", metavar="SCAN", help=SCAN_HELP)
    parser.add_argument(
        "--region", type=Path, metavar="FILE",
        help="JSON file of the rigid region (spheres, points or landmarks); default: Scan4D finds it",
    )  # fmt: skip
    parser.add_argument(
        "--reference", type=_reference, default=0, metavar="I|SCAN",
        help="frame of SCAN in which motions begin, counted from 0; or another scan, for its first frame; "
        "default 0",
    )  # fmt: skip
    parser.add_argument(
        "--dense", action="store_true",
        help="follow every point of the reference frame instead, and write displacements.npz",
    )  # fmt: skip
    add_output_argument(parser, "folder for the results", "DIR")


def run(args: Namespace) -> int:
    """Write the motions of all frames, or of all points."""
    with open_timeline(args, args.scan) as timeline:
        paths = run_dense(args, timeline, _reference_pose) if args.dense else _stabilised(args, timeline)
    for path in paths:
        tell(path)
    return 0


def _stabilised(args: Namespace, timeline: Timeline) -> list[Path]:
    """Find the motions of a region; gives the files that it wrote."""
    table, facts, region_file = (args.out / name for name in (_TABLE, _REPORT, _REGION))
    claim([table, facts, region_file], _inputs(args, timeline), args.force)
    limits = WeakLimits(_millimetres(timeline, _CLOSE))
    region = RigidRegion.read(args.region) if args.region else None
    pose, frame = _reference_pose(args, timeline)
    if region is None:
        output_folder(args.out)  # an error comes before the search
        tell("Scan4D looks for a region that stays rigid in all frames")
        rows = found_region(timeline, pose, frame)
    else:
        rows = _rows(args, region, pose, frame)
    reference = MotionReference.of(pose, rows, frame)
    output_folder(args.out)
    partial = PartialMotions(args.out / _PARTIAL, _key(args, timeline, pose.cloud.world()[rows]))
    known = partial.read()
    if known:
        tell(f"Scan4D continues: the motions of {len(known)} of {len(timeline)} frames are known")
    with progress(len(timeline) - len(known)) as tick:
        try:
            for _ in stabilise(timeline, reference, limits.shift, known):
                partial.save(known)
                tick()
        except KeyboardInterrupt:
            warn(f"{partial.path} keeps the frames so far. To continue, run the same command again")
            raise
    report(timeline, 0)
    axes = _axes(args, pose)
    states = {index: found.state(axes, limits) for index, found in known.items()}
    rows_of_table = (_row(timeline, index, known[index], states[index]) for index in sorted(known))
    save_rows(table, [_COLUMNS, *rows_of_table])
    ids = rows if pose.cloud.ids is None else pose.cloud.ids[rows].astype(np.int64)
    save_json(region_file, RigidRegion(np.empty((0, 4)), ids).to_json())
    found = {
        "version": __version__,
        "scan": timeline.name,
        "unit": timeline.unit,
        "reference": _facts_of_reference(args, pose),
        "region": _facts_of_region(args, pose, rows, reference),
        **_facts_of_motions(known, states, limits, frame),
        "weak_directions": [
            {**asdict(one), "words": one.in_words(timeline.unit)}
            for one in weak_directions(known, axes, limits)
        ],
    }
    save_json(facts, found)
    partial.end()
    _tell(found, timeline)
    return [table, facts, region_file]


def _reference(text: str) -> int | str:
    if not text:
        raise ArgumentTypeError("'' is neither a number of a frame nor a scan")
    return int(text) if text.removeprefix("-").isdecimal() else text


def _inputs(args: Namespace, timeline: Timeline) -> list[Path]:
    return [*scan_inputs(timeline), *([args.region] if args.region else [])]


def _millimetres(timeline: Timeline, length: float) -> float:
    """A length in mm in the unit of a scan. Raises InputError where that is no known length."""
    factor = conversion("mm", timeline.unit)
    if factor is None:
        what = f"has the unit '{timeline.unit}', which is not a known unit of length"
        raise InputError(what, timeline.name, "State the unit of the scan, such as --unit mm")
    return length * factor


def _reference_pose(args: Namespace, timeline: Timeline) -> tuple[Pose, int | None]:
    """The pose that motions begin in, and its frame; None: it is of another scan."""
    if isinstance(args.reference, int):
        timeline.label(args.reference)  # raises where there is none
        if len(timeline) == 1:
            hint = "Name a scan with several frames, or name another scan with --reference"
            raise InputError("has only one frame, so there is no motion to find", timeline.name, hint)
        return timeline.pose(args.reference), args.reference
    with open_timeline(args, args.reference) as other:
        if conversion(other.unit, timeline.unit) != 1.0:
            what = f"has the unit '{other.unit}', but the scan has '{timeline.unit}'"
            raise InputError(what, other.name, "Use a reference in the unit of the scan")
        return other.pose(0), None


def _rows(args: Namespace, region: RigidRegion, pose: Pose, frame: int | None) -> NDArray[np.int64]:
    """The rows of the reference in the region of a file. Raises InputError, which names that file."""
    places = _places(args, region, frame)
    try:
        return region.rows(pose.cloud, places)
    except InputError as error:
        raise InputError(error.what, args.region, error.hint) from None


def _places(args: Namespace, region: RigidRegion, frame: int | None) -> dict[str, NDArray[np.float64]]:
    """The positions of landmarks in the reference frame, for a region that names some. Raises InputError."""
    if not region.landmarks:
        return {}
    if frame is None:
        raise InputError("names landmarks, but the reference is another scan", args.region)
    session = stored(known_as(args.scan))
    if session is None:
        hint = "Open the scan in the window and place landmarks"
        raise InputError("names landmarks, but the scan has no saved session", args.region, hint)
    placed = {one.name: one.key_at(frame) for one in session.document.part(Landmarks).all}
    return {name: np.array(key.position) for name, key in placed.items() if key is not None}


def _key(args: Namespace, timeline: Timeline, region: NDArray[np.float64]) -> dict[str, Any]:
    """The scan, region (P, 3) and reference that partial motions must be of, to be used again."""
    return {
        "version": __version__,
        "scan": known_as(args.scan),
        "hash": fingerprint(timeline.files),
        "times": len(timeline),
        "unit": timeline.unit,
        "reference": str(args.reference),
        "region": hashlib.sha256(region.tobytes()).hexdigest(),
    }


def _row(timeline: Timeline, index: int, found: FrameMotion, state: MotionState) -> list[object]:
    """The row of a frame."""
    from scipy.spatial.transform import Rotation

    if found.motion is None:
        numbers: list[float | None] = [None] * 13
    else:
        x, y, z, w = Rotation.from_matrix(found.motion.rotation).as_quat(canonical=True)
        shift, sigmas = found.motion.matrix[:3, 3], found.deviations(_WORLD)
        numbers = [cell(value) for value in (w, x, y, z, *shift, *sigmas)]
    return [index + 1, float(timeline.times[index]), *numbers, state.value]


def _axes(args: Namespace, pose: Pose) -> NDArray[np.float64]:
    """The anatomical axes of the subject in the reference frame."""
    if args.up:
        return anatomical_axes(args.up)
    return anatomical_axes(pose.upright.up, pose.upright.front)


def _facts_of_reference(args: Namespace, pose: Pose) -> dict[str, Any]:
    """The facts of the reference, for the report."""
    is_frame = isinstance(args.reference, int)
    return {
        "scan": None if is_frame else args.reference,
        "frame": args.reference + 1 if is_frame else 1,
        "label": pose.label,
    }


def _facts_of_region(
    args: Namespace, pose: Pose, rows: NDArray[np.int64], reference: MotionReference
) -> dict[str, Any]:
    """The facts of the region, for the report."""
    return {
        "source": "found" if args.region is None else str(args.region),
        "points": len(rows),
        "share_of_points": len(rows) / max(pose.count, 1),
        "middle": reference.middle.tolist(),
    }


def _facts_of_motions(
    known: Mapping[int, FrameMotion],
    states: Mapping[int, MotionState],
    limits: WeakLimits,
    frame: int | None,
) -> dict[str, Any]:
    """The facts of the motions, for the report. frame: of the reference, which agrees with itself."""
    shares = {index: found.within for index, found in known.items() if found.motion and index != frame}
    least = min(shares, key=lambda index: shares[index]) if shares else None
    return {
        "within_half_mm": {
            "mean": float(np.mean(list(shares.values()))) if shares else None,
            "least": None if least is None else shares[least],
            "least_in_frame": None if least is None else least + 1,
        },
        "states": {state.value: sum(one is state for one in states.values()) for state in MotionState},
        "limits": {"degrees": limits.degrees, "length": limits.shift},
        "gaps": {str(i + 1): known[i].reason for i in sorted(known) if known[i].motion is None},
    }


def _tell(found: Mapping[str, Any], timeline: Timeline) -> None:
    """The report in words."""
    region, within = found["region"], found["within_half_mm"]
    tell(
        f"The region has {region['points']:,} points, {region['share_of_points']:.0%} of the reference frame"
    )
    if within["mean"] is not None:
        share = f"{within['mean']:.1%} of the region"
        tell(f"On average, {share} lies within ±{_CLOSE} mm of the surface of a frame")
    for one in found["weak_directions"]:
        warn(f"{one['words']} (in {one['frames']} of {len(timeline)} frames)")
    if found["gaps"]:
        number, reason = next(iter(found["gaps"].items()))
        share = f"{len(found['gaps'])} of {len(timeline)} frames"
        warn(f"Scan4D finds no motion in {share}, such as {_frame(number)}: {reason}")
    if within["least"] is not None and within["least"] < _RIGID:
        share = f"in {_frame(within['least_in_frame'])}, only {within['least']:.1%} of it lies"
        warn(
            f"The region does not stay rigid: {share} within ±{_CLOSE} mm of the surface. "
            "Name another region with --region"
        )


def _frame(number: int | str) -> str:
    """The words for a frame, of its number in the report."""
    return frame_in_words(int(number) - 1)

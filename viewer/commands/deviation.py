"""Measure signed distances from a reference surface.

Scan4D writes into DIR: deviation.csv with statistics of each frame, one NPZ file of values per frame, and
report.json. Positive values are outside. A point beyond the border of the reference has no value. With
M3C2, values are distances between means of points, and each has a level of detection.
"""

from __future__ import annotations

import re
from argparse import ArgumentParser, Namespace
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .. import __version__
from ..analysis.deviation.chosen import search_reach
from ..analysis.deviation.m3c2 import M3C2Reference
from ..analysis.deviation.reference import ESTIMATED, DeviationReference, deviation_reference
from ..analysis.deviation.statistics import DeviationStatistics, detected_share
from ..analysis.motion.stabilise import FrameMotion
from ..csv_text import cell, save_rows
from ..document.saved_session import known_as
from ..errors import InputError
from ..files import output_folder, save_json
from ..scan.inputs import scan_inputs
from ..scan.pose import Pose
from ..scan.timeline import Timeline
from ._console import tell, warn
from ._maps import map_files, positive_length, tell_few, tell_left_out, written_maps
from ._outputs import add_output_argument, claim
from ._reference import StartOfMotion, check_unit
from ._rigid import rigid_part, tell_rigid
from ._scans import SCAN_HELP, open_timeline, report

_TABLE, _REPORT, _PARTIAL = "deviation.csv", "report.json", "transforms.partial"
_COLUMNS = ("frame", "time", "mean", "rms", "p95", "max", "share")
_SURFACE, _M3C2 = "surface", "m3c2"
_VALUE, _DETECTABLE, _DETECTED = "value", "detectable", ("detected",)
_NONE = np.empty(0)


def add_arguments(parser: ArgumentParser) -> None:
    """The arguments of `scan4d deviation`."""
    parser.add_argument("scan", metavar="SCAN", help=SCAN_HELP)
    parser.add_argument(
        "--to", metavar="REFERENCE", required=True,
        help="scan or mesh that frames are compared with; SCAN itself for its own frames",
    )  # fmt: skip
    parser.add_argument(
        "--to-pose", metavar="I|I,J,...", default="0",
        help="frame of REFERENCE, counted from 0; with --stabilise, also several frames of SCAN, such as "
        "0,3,7 or 0:6, for their mean; default 0",
    )  # fmt: skip
    parser.add_argument(
        "--stabilise", action="store_true",
        help="first remove the rigid motion of each frame, such as that of the head",
    )  # fmt: skip
    parser.add_argument(
        "--region", type=Path, metavar="FILE",
        help="with --stabilise: JSON file of the rigid region (spheres, points or landmarks); default: "
        "Scan4D finds it",
    )  # fmt: skip
    parser.add_argument(
        "--reach", type=positive_length, metavar="LENGTH",
        help="distance from the reference beyond which a point has no value, in the unit of the scan; "
        "default: a tenth of the longest edge of the reference",
    )  # fmt: skip
    parser.add_argument(
        "--method", choices=(_SURFACE, _M3C2), default=_SURFACE,
        help="distance from the nearest place of the reference surface, or M3C2 (Lague et al. 2013): "
        "distance between the means of the points in a cylinder; default surface",
    )  # fmt: skip
    parser.add_argument(
        "--cylinder", type=positive_length, metavar="RADIUS",
        help="with M3C2: radius of the cylinder; default: 2.5 times the spacing of the reference",
    )  # fmt: skip
    parser.add_argument(
        "--normal", type=positive_length, metavar="RADIUS",
        help="with M3C2: radius around a point whose plane gives its normal; default: 3 times the spacing "
        "of the reference, or 12.5 times its noise if that is more",
    )  # fmt: skip
    parser.add_argument(
        "--whole-cylinder", action="store_true",
        help="with M3C2: average all points up to the reach, as the paper has it; default: the cylinder "
        "grows until it holds the surface",
    )  # fmt: skip
    add_output_argument(parser, "folder for the results", "DIR")


def run(args: Namespace) -> int:
    """Write the table, the values and the report."""
    if args.region and not args.stabilise:
        raise InputError("--region names what is stabilised", hint="Add --stabilise")
    if args.method != _M3C2 and (args.cylinder or args.normal or args.whole_cylinder):
        raise InputError("--cylinder, --normal and --whole-cylinder belong to M3C2", hint="Add --method m3c2")
    with open_timeline(args, args.scan) as timeline, _opened(args, timeline) as other:
        for path in _written(args, timeline, other):
            tell(path)
    return 0


@dataclass(frozen=True, eq=False)
class _Compared:
    """The reference, and the motions that take frames back to it.

    reach: distance beyond which a point has no value, scan units. motions: from the reference to each frame;
    None: frames stay as recorded. middle: of the region that the motions are of, (3,). facts: for the report.
    """

    reference: DeviationReference
    reach: float
    motions: Mapping[int, FrameMotion] | None
    middle: np.ndarray | None
    facts: dict[str, Any]


@contextmanager
def _opened(args: Namespace, timeline: Timeline) -> Iterator[Timeline]:
    """The scan of the reference. Raises InputError where its unit differs."""
    if known_as(args.to) == known_as(args.scan):
        yield timeline
        return
    with open_timeline(args, args.to) as other:
        check_unit(other, timeline)
        yield other


def _written(args: Namespace, timeline: Timeline, other: Timeline) -> list[Path]:
    """Measure all frames; gives the files that it wrote. Raises InputError."""
    table, facts = args.out / _TABLE, args.out / _REPORT
    files = map_files(args.out, timeline)
    inputs = [*scan_inputs(timeline), *scan_inputs(other), *([args.region] if args.region else [])]
    claim([table, facts, *files], inputs, args.force)
    compared = _compared(args, timeline, other)
    output_folder(args.out)
    rows, shares = [], []
    left_out: dict[int, str] = {}

    def measure(pose: Pose) -> Mapping[str, np.ndarray]:
        return _measured(compared, pose)

    for index, arrays in written_maps(timeline, files, measure, left_out):
        found = DeviationStatistics.of(arrays.get(_VALUE, _NONE))
        shares.append(found.share)
        numbers = [*found]
        if args.method == _M3C2:
            numbers.append(detected_share(arrays.get(_VALUE, _NONE), arrays.get(_DETECTABLE, _NONE)))
        rows.append((index + 1, float(timeline.times[index]), *map(cell, numbers)))
    report(timeline, 0)
    save_rows(table, [_COLUMNS + (_DETECTED if args.method == _M3C2 else ()), *rows])
    reasons = {str(index + 1): reason for index, reason in left_out.items()}
    save_json(facts, {**compared.facts, "left_out": reasons})
    (args.out / _PARTIAL).unlink(missing_ok=True)
    _tell(timeline, compared, shares, left_out)
    return [table, facts, *(file for index, file in enumerate(files) if index not in left_out)]


def _compared(args: Namespace, timeline: Timeline, other: Timeline) -> _Compared:
    """The reference, and the motions from it to each frame. Raises InputError."""
    start = _start(args, timeline, other)
    found: dict[str, Any] = {"version": __version__, "scan": timeline.name, "unit": timeline.unit}
    motions = middle = None
    faces = other.faces(start.pose.index).triangles()
    if args.stabilise:
        rigid = rigid_part(args, timeline, start, args.out / _PARTIAL)
        start, motions, found["rigid"] = rigid.reference, rigid.known, rigid.facts(args.region or "found")
        tell_rigid(rigid)
        middle = None if rigid.region is None else rigid.region.middle
    reference: DeviationReference
    if args.method == _M3C2:
        reference = M3C2Reference(start.pose, args.cylinder, args.normal, args.whole_cylinder)
        found["m3c2"] = {
            "cylinder": reference.cylinder,
            "normal": reference.normal,
            "whole": args.whole_cylinder,
        }
    else:
        reference = deviation_reference(start.pose, faces)
    reach = args.reach or search_reach(start.pose)
    found |= {"reference": {**start.facts(), "outside_by": reference.outside_by}, "reach": reach}
    return _Compared(reference, reach, motions, middle, found)


def _start(args: Namespace, timeline: Timeline, other: Timeline) -> StartOfMotion:
    """The pose of the reference. Raises InputError."""
    option = "--to-pose"
    if other is timeline:
        start = StartOfMotion.in_frames(timeline, args.to_pose, option)
        if start.rest and not args.stabilise:
            raise InputError("the mean of several frames needs --stabilise", option)
        return start
    if not re.fullmatch(r"-?\d+", args.to_pose):
        raise InputError(f"'{args.to_pose}' is not one frame of the reference", option)
    return StartOfMotion(other.pose(int(args.to_pose)), f"{args.to} {args.to_pose}", None, scan=args.to)


def _measured(compared: _Compared, pose: Pose) -> dict[str, np.ndarray]:
    """The deviations of a frame, and with M3C2 the least that noise does not explain, (N,). Raises
    InputError."""
    reference = compared.reference
    found = FrameMotion.still() if compared.motions is None else compared.motions[pose.index]
    if found.motion is None:
        raise InputError(found.reason)
    positions = found.motion.inverse.points(pose.cloud.world())
    if isinstance(reference, M3C2Reference):
        distances = reference.distances(positions, compared.reach)
        moved: np.ndarray | float = 0.0
        if compared.middle is not None:
            moved = found.deviations_at(positions, distances.directions, compared.middle)
        return {_VALUE: distances.values, _DETECTABLE: distances.detectable(moved)}
    return {_VALUE: reference.signed(positions, compared.reach)}


def _tell(timeline: Timeline, compared: _Compared, shares: list[float], left_out: Mapping[int, str]) -> None:
    """The results in words."""
    known = [share for index, share in enumerate(shares) if index not in left_out]
    if known:
        tell(f"On average, {np.mean(known):.1%} of the points lie above or below the reference surface")
    tell(f"Scan4D looks up to {compared.reach:.3g} {timeline.unit} away (--reach)")
    tell_few(known, "a value")
    if isinstance(compared.reference, M3C2Reference):
        radii = (
            f"{compared.reference.cylinder:.3g} (--cylinder) and {compared.reference.normal:.3g} (--normal)"
        )
        tell(f"M3C2 compares points, also those of a mesh, with radii of {radii} {timeline.unit}")
    if compared.reference.outside_by == ESTIMATED:
        warn("The reference has no normals. Scan4D estimates which side is outside")
    tell_left_out(timeline, left_out)

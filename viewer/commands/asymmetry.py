"""Measure how far each frame differs from its mirror image.

Scan4D finds the mid-plane of each frame and mirrors the frame. It writes into DIR: asymmetry.csv with the
plane and the root mean square of the distances, one NPZ file of signed distances per frame, and report.json.
A positive distance is outside the mirror image.
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import __version__
from ..analysis.asymmetry.asymmetry_map import asymmetry_map
from ..analysis.asymmetry.mid_plane import MidPlane, MirroredPose
from ..analysis.deviation.chosen import search_reach
from ..analysis.motion.axes import anatomical_axes
from ..csv_text import cell, save_rows
from ..errors import InputError
from ..files import output_folder, save_json
from ..scan.inputs import scan_inputs
from ..scan.pose import Pose
from ..scan.timeline import Timeline
from ..scan.times import frame_in_words
from ._console import tell
from ._maps import map_files, positive_length, tell_few, tell_left_out, written_maps
from ._outputs import add_output_argument, claim
from ._reference import StartOfMotion
from ._rigid import RigidPart, rigid_part, tell_rigid
from ._scans import SCAN_HELP, open_timeline, report

_TABLE, _REPORT, _PARTIAL = "asymmetry.csv", "report.json", "transforms.partial"
_COLUMNS = ("frame", "time", "rms", "share", "nx", "ny", "nz", "d")

Float = NDArray[np.float64]


def add_arguments(parser: ArgumentParser) -> None:
    """The arguments of `scan4d asymmetry`."""
    parser.add_argument("scan", metavar="SCAN", help=SCAN_HELP)
    parser.add_argument(
        "--region", type=Path, metavar="FILE",
        help="JSON file of the region of the first frame that tells the mid-plane (spheres, points or "
        "landmarks), for example the upper face; default: all points",
    )  # fmt: skip
    parser.add_argument(
        "--reach", type=positive_length, metavar="LENGTH",
        help="distance from the mirror image beyond which a point has no value, in the unit of the scan; "
        "default: a tenth of the longest edge of the first frame",
    )  # fmt: skip
    add_output_argument(parser, "folder for the results", "DIR")


def run(args: Namespace) -> int:
    """Write the table, the values and the report."""
    with open_timeline(args, args.scan) as timeline:
        for path in _written(args, timeline):
            tell(path)
    return 0


@dataclass
class _Whole:
    """All points tell the mid-plane. before: that of the frame before."""

    before: MidPlane | None = None

    def found(self, pose: Pose, left: Float) -> MidPlane:
        """The mid-plane of a frame. Raises InputError."""
        near = self.before
        self.before = MirroredPose(pose).mid_plane(left if near is None else near.plane.normal, near)
        return self.before


@dataclass
class _Region:
    """A region tells the mid-plane. places: of the region in the first frame, (P, 3). known: the mid-plane
    that was found first, in the first frame."""

    rigid: RigidPart
    places: Float
    known: MidPlane | None = None

    def found(self, pose: Pose, left: Float) -> MidPlane:
        """The mid-plane of a frame. Raises InputError."""
        moved = self.rigid.known[pose.index]
        if moved.motion is None:
            raise InputError(moved.reason)
        mirrored = MirroredPose(pose, moved.motion.points(self.places))
        if self.known is not None:
            near = replace(self.known, plane=self.known.plane.moved(moved.motion))
            return mirrored.mid_plane(near.plane.normal, near)
        found = mirrored.mid_plane(left)
        self.known = replace(found, plane=found.plane.moved(moved.motion.inverse))
        return found


@dataclass(frozen=True, eq=False)
class _Frame:
    """A frame in numbers, see `AsymmetryMap`."""

    mid: MidPlane
    rms: float
    share: float
    noise: float

    def facts(self) -> dict[str, float]:
        """The numbers for the report."""
        mid = self.mid
        return {"turn": mid.turn, "shift": mid.shift, "matched": mid.matched, "noise": self.noise}


def _written(args: Namespace, timeline: Timeline) -> list[Path]:
    """Measure all frames; gives the files that it wrote. Raises InputError."""
    table, facts, files = args.out / _TABLE, args.out / _REPORT, map_files(args.out, timeline)
    inputs = [*scan_inputs(timeline), *([args.region] if args.region else [])]
    claim([table, facts, *files], inputs, args.force)
    pose = timeline.pose(0)
    up, front = (args.up, 0.0) if args.up else (pose.upright.up, pose.upright.front)
    left, reach = anatomical_axes(up, front)[0], args.reach or search_reach(pose)
    found: dict[str, Any] = {"version": __version__, "scan": timeline.name, "unit": timeline.unit}
    planes: _Region | _Whole = _Whole()
    if args.region:
        start = StartOfMotion.in_frames(timeline, "0", "--region")
        rigid = rigid_part(args, timeline, start, args.out / _PARTIAL)
        found["rigid"] = rigid.facts(args.region)
        tell_rigid(rigid)
        planes = _Region(rigid, start.pose.cloud.world()[rigid.rows])
    output_folder(args.out)
    known: dict[int, _Frame] = {}
    left_out: dict[int, str] = {}

    def measure(pose: Pose) -> Mapping[str, Float]:
        mid = planes.found(pose, left)
        asymmetry = asymmetry_map(pose, mid.plane, reach)
        known[pose.index] = _Frame(mid, asymmetry.rms, asymmetry.share, asymmetry.noise)
        return {"value": asymmetry.values}

    rows = [
        _row(timeline, index, known.get(index))
        for index, _ in written_maps(timeline, files, measure, left_out)
    ]
    report(timeline, 0)
    save_rows(table, [_COLUMNS, *rows])
    in_words = {"mid_planes": {str(index + 1): frame.facts() for index, frame in known.items()}}
    reasons = {str(index + 1): reason for index, reason in left_out.items()}
    save_json(facts, {**found, "reach": reach, **in_words, "left_out": reasons})
    (args.out / _PARTIAL).unlink(missing_ok=True)
    _tell(timeline, known, reach)
    tell_left_out(timeline, left_out)
    return [table, facts, *(file for index, file in enumerate(files) if index not in left_out)]


def _row(timeline: Timeline, index: int, frame: _Frame | None) -> list[object]:
    """The row of a frame; None: it has no values."""
    numbers = [np.nan, 0.0, *[np.nan] * 4]
    if frame is not None:
        numbers = [frame.rms, frame.share, *frame.mid.plane.normal, frame.mid.plane.offset]
    return [index + 1, float(timeline.times[index]), *map(cell, numbers)]


def _tell(timeline: Timeline, known: Mapping[int, _Frame], reach: float) -> None:
    """The results in words."""
    if known:
        most = max(known, key=lambda index: np.nan_to_num(known[index].rms))
        rms = f"{known[most].rms:.3g} {timeline.unit} RMS"
        tell(f"The asymmetry is largest in {frame_in_words(most)}: {rms}")
    tell(f"Scan4D looks up to {reach:.3g} {timeline.unit} away (--reach)")
    shares = [frame.share for frame in known.values()]
    tell_few(shares, "a mirror image", ". Name the subject with --region")

"""Write frames of a scan in another file format.

OUT is a .ply, .pcd, .npz, .exr or .svo file. A sequence needs a numbered pattern such as out%04d.ply; Scan4D
writes the times into times.csv beside it. One .svo file holds all frames with their times.
--normals and --radii estimate and store what the scan lacks, so that it opens faster. --visible-from writes
only the points that are visible from one position.
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ..bounds import Bounds
from ..errors import InputError
from ..output.export import check_output, is_pattern
from ..scan import formats
from ..scan.estimate import with_estimates
from ..scan.inputs import scan_inputs
from ..scan.octree.build import Stop
from ..scan.pose import Pose
from ..scan.timeline import Timeline
from . import _arguments as arguments
from ._console import progress, tell, warn
from ._outputs import add_force_argument, claim
from ._scans import (
    SCAN_HELP,
    add_pose_arguments,
    chosen_poses,
    frame_outputs,
    framing,
    open_timeline,
    read_poses,
    with_files,
)

_ESTIMATES = ("normals", "radii")

_MARGIN = 1 / 8  # of the extent of some poses, around it, that others may need


def add_arguments(parser: ArgumentParser) -> None:
    """The arguments of `scan4d convert`."""
    parser.add_argument("scan", metavar="SCAN", help=SCAN_HELP)
    suffixes = " ".join([*formats.writable_suffixes(views=True), *formats.scan_suffixes()])
    parser.add_argument("out", metavar="OUT", type=Path, help=f"{suffixes}, or a pattern with %%04d")
    add_force_argument(parser)
    add_pose_arguments(parser)
    for name in _ESTIMATES:
        parser.add_argument(f"--{name}", action="store_true", help=f"estimate and store missing {name}")
    parser.add_argument(
        "--visible-from",
        type=_eye,
        metavar="X,Y,Z",
        help="write only the points that are visible from this position, in scan units",
    )
    group = parser.add_argument_group("octrees (.svo)").add_mutually_exclusive_group()
    group.add_argument(
        "--delta",
        type=float,
        metavar="D",
        help="how many of the positions, as a fraction, may lie in an octree leaf with other positions; "
        "default 0.05",
    )
    group.add_argument(
        "--depth",
        type=int,
        metavar="H",
        help="level of the octree at which all leaves lie, 0 to 21; replaces --delta",
    )


def run(args: Namespace) -> int:
    """Write the chosen poses, by default all; broken frames among several are left out."""
    stop = _stop(args)
    _check_holds(args)
    poses = _Poses(_wanted(args), args.visible_from)
    with open_timeline(args, args.scan) as timeline:
        indices = chosen_poses(args, timeline) or list(range(len(timeline)))
        if args.out.suffix.lower() in formats.scan_suffixes():
            _write_scan(args, timeline, indices, stop, poses)
        else:
            _write_frames(args, timeline, indices, poses)
    if poses.eye is not None:
        tell(poses.counts())
    tell(args.out)
    return 0


def _check_holds(args: Namespace) -> None:
    """Raise InputError where the format of the output holds none of what is to be estimated."""
    suffix = args.out.suffix.lower()
    storing = formats.writable_suffixes() + formats.scan_suffixes()
    for name in _wanted(args):
        if suffix not in storing:
            hint = f"Write {', '.join(storing)}, or leave out --{name}"
            raise InputError(f"'{suffix}' files cannot store {name}", args.out, hint)


def _wanted(args: Namespace) -> list[str]:
    return [name for name in _ESTIMATES if getattr(args, name)]


def _eye(text: str) -> tuple[float, ...]:
    return arguments.numbers(text, (3,), "a position X,Y,Z such as 0,1.5,3")


class _Poses:
    """The poses as they are written: with what is asked for and they lack estimated, and of the points those
    that an eye sees, if there is one. estimates: names."""

    def __init__(self, estimates: Sequence[str], eye: tuple[float, ...] | None) -> None:
        self._estimates, self.eye = estimates, eye
        self._seen: list[int] = []
        self._all = 0

    def of(self, timeline: Timeline, indices: Sequence[int]) -> Iterator[Pose]:
        """Read and yield them."""
        for pose in read_poses(timeline, indices):
            missing = [name for name in self._estimates if getattr(pose.overview, name) is None]
            if missing:
                pose = with_estimates(pose, missing)
            yield pose if self.eye is None else self._visible(pose, self.eye)

    def _visible(self, pose: Pose, eye: tuple[float, ...]) -> Pose:
        from ..visibility.search import visible_points

        cloud = pose.cloud
        ids = visible_points(pose, eye)
        rows = ids if cloud.ids is None else np.searchsorted(cloud.ids, ids)
        self._seen.append(len(rows))
        self._all += len(cloud)
        return replace(pose, points=cloud.of_rows(rows))

    def counts(self) -> str:
        """How many points are seen, as a line."""
        stated = f"{sum(self._seen):,} of {self._all:,} points are visible"
        each = f", {min(self._seen):,} to {max(self._seen):,} in each of {len(self._seen)} poses"
        return stated + (each if len(self._seen) > 1 else "")


def _stop(args: Namespace) -> Stop | None:
    """The rule by which octrees end; None: the default. Raises InputError where there are no octrees."""
    stated: dict[str, Any] = {}
    if args.delta is not None:
        stated = {"rule": "delta", "delta": args.delta}
    elif args.depth is not None:
        stated = {"rule": "depth", "depth": args.depth}
    if stated and args.out.suffix.lower() not in formats.scan_suffixes():
        raise InputError(
            f"--{stated['rule']} applies only to octrees",
            args.out,
            "Write a .svo file, or leave this option out",
        )
    return Stop(**stated) if stated else None


def _write_scan(
    args: Namespace, timeline: Timeline, indices: Sequence[int], stop: Stop | None, chosen: _Poses
) -> None:
    out = args.out
    check_output(out, formats.scan_suffixes(), several=False)
    if is_pattern(out):
        raise InputError(
            "has a number field in its name, but the scan becomes a single file with all frames",
            out,
            "Leave it out",
        )
    claim([out], scan_inputs(timeline), args.force)
    with progress(len(indices)) as tick:

        def poses() -> Iterator[Pose]:
            for pose in chosen.of(timeline, indices):
                yield pose
                tick()

        formats.write_poses(out, poses(), timeline.unit, stop=stop, around=_around(timeline, indices))
    try:
        formats.check(out)
    except InputError as problem:  # all is there, but not everybody can read it
        warn(str(problem))


def _around(timeline: Timeline, indices: Sequence[int]) -> Bounds:
    """The bounds of these poses; of several with a margin, since not all are looked at."""
    bounds = framing(timeline, indices)
    return bounds if len(indices) == 1 else bounds.grown(_MARGIN * float((bounds.high - bounds.low).max()))


def _write_frames(args: Namespace, timeline: Timeline, indices: Sequence[int], chosen: _Poses) -> None:
    known = sorted([*formats.writable_suffixes(views=True), *formats.scan_suffixes()])
    check_output(args.out, known, several=len(indices) > 1)
    claim(frame_outputs(args.out, indices, timeline), scan_inputs(timeline), args.force)
    written = with_files(args.out, chosen.of(timeline, indices), len(indices))
    for remark in {formats.write(path, pose.cloud, pose.views) for pose, path in written} - {None}:
        warn(f"{args.out}: {remark}")

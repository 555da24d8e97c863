"""Find the motion of a rigid region, such as the head.

Scan4D writes into DIR: transforms.csv with the motion of each frame and how sure it is, report.json, and
region.json with the points of the region. With --dense, displacements.npz holds the way of every point, and
paths.csv the mean paths of regions. If you interrupt the command, the same command later continues.
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from .. import __version__
from ..analysis.motion.displacements import save_displacements
from ..csv_text import save_rows
from ..errors import InputError
from ..files import save_json
from ..scan.inputs import scan_inputs
from ..scan.timeline import Timeline
from ._console import tell, warn
from ._dense import dense_facts, dense_part, path_rows, tell_dense
from ._outputs import add_output_argument, claim
from ._reference import StartOfMotion
from ._rigid import region_rows, rigid_part, tell_rigid
from ._scans import SCAN_HELP, open_timeline, report

_RESULTS = "transforms.csv", "report.json", "region.json", "displacements.npz", "paths.csv"
_PARTIAL = "transforms.partial", "displacements.partial"


def add_arguments(parser: ArgumentParser) -> None:
    """The arguments of `scan4d motion`."""
    parser.add_argument("scan", metavar="SCAN", help=SCAN_HELP)
    parser.add_argument(
        "--region", type=Path, metavar="FILE",
        help="JSON file of the rigid region (spheres, points or landmarks); default: Scan4D finds it",
    )  # fmt: skip
    parser.add_argument(
        "--reference", default="0", metavar="I|I,J,...|SCAN",
        help="frame of SCAN in which motions begin, counted from 0; or several, such as 0,3,7 or 0:6, for "
        "their mean; or another scan, for its first frame; default 0",
    )  # fmt: skip
    parser.add_argument(
        "--dense", action="store_true",
        help="also follow every point of the reference frame, and write displacements.npz",
    )  # fmt: skip
    parser.add_argument(
        "--paths", type=Path, nargs="+", action="extend", default=[], metavar="FILE",
        help="with --dense, also write paths.csv with the mean paths of these regions (files as of --region)",
    )  # fmt: skip
    add_output_argument(parser, "folder for the results", "DIR")


def run(args: Namespace) -> int:
    """Write the motions of all frames, and of all points where they are asked for."""
    with open_timeline(args, args.scan) as timeline:
        try:
            paths = _written(args, timeline)
        except KeyboardInterrupt:
            if any((args.out / name).exists() for name in _PARTIAL):
                warn(f"{args.out} keeps the frames so far. To continue, run the same command again")
            raise
    for path in paths:
        tell(path)
    return 0


def _written(args: Namespace, timeline: Timeline) -> list[Path]:
    """Find the motions; gives the files that it wrote. Raises InputError."""
    if args.paths and not args.dense:
        raise InputError("--paths needs the motions of all points", hint="Add --dense")
    table, facts, region, points, paths = (args.out / name for name in _RESULTS)
    outputs = [table, facts, region, *[points] * args.dense, *[paths] * bool(args.paths)]
    named = args.paths if args.region is None else [*args.paths, args.region]
    claim(outputs, [*scan_inputs(timeline), *named], args.force)
    start = StartOfMotion.of(args, timeline)
    regions = {file: region_rows(args, file, start) for file in args.paths}
    motions, followed = (args.out / name for name in _PARTIAL)
    rigid = rigid_part(args, timeline, start, motions, needed=not args.dense)
    found: dict[str, Any] = {
        "version": __version__,
        "scan": timeline.name,
        "unit": timeline.unit,
        "reference": rigid.reference.facts(),
        "rigid": rigid.facts(args.region or "found"),
    }
    tell_rigid(rigid)
    if args.dense:
        kept = dense_part(args, timeline, rigid.reference, followed)
        found["dense"] = dense_facts(len(timeline), rigid.reference, kept)
        tell_dense(found["dense"])
    report(timeline, 0)
    writers: dict[Path, Callable[[Path], None]] = {
        table: lambda path: save_rows(path, rigid.table()),
        facts: lambda path: save_json(path, found),
    }
    if rigid.region is None:
        region.unlink(missing_ok=True)  # that of an earlier run
    else:
        writers[region] = lambda path: save_json(path, rigid.points().to_json())
    if args.dense:
        world = rigid.reference.pose.cloud.world()
        writers[points] = lambda path: save_displacements(path, world, len(timeline), kept.read)
    if regions:
        writers[paths] = lambda path: save_rows(path, path_rows(regions, rigid, kept))
    _save(writers)
    motions.unlink(missing_ok=True)
    if args.dense:
        kept.end()
    return list(writers)


def _save(writers: Mapping[Path, Callable[[Path], None]]) -> None:
    """Write all files or, where one fails, none, so that the same command can go on."""
    written: list[Path] = []
    try:
        for path, write in writers.items():
            written.append(path)
            write(path)
    except BaseException:
        for path in written[:-1]:
            path.unlink(missing_ok=True)
        raise

"""Write poses as PLY, PCD or NPZ, and range views also as EXR.

OUT is a file for one pose, or for a sequence a numbered pattern such as out%04d.ply, with
the times beside it in times.csv.
"""

from __future__ import annotations

import csv
from argparse import ArgumentParser, Namespace
from pathlib import Path

from ..errors import InputError
from ..export import check_output, is_pattern, numbered
from ..files import whole_file
from ..scan import formats
from ..scan.times import TIMES_FILE
from .console import progress
from .scans import SCAN_HELP, add_pose_arguments, chosen_poses, open_timeline, read_poses


def add_arguments(parser: ArgumentParser) -> None:
    """The arguments of `scan4d convert`."""
    parser.add_argument("scan", metavar="SCAN", help=SCAN_HELP)
    suffixes = " ".join(formats.writable_suffixes(views=True))
    parser.add_argument("out", metavar="OUT", type=Path, help=f"{suffixes}, or a pattern with %%04d")
    add_pose_arguments(parser)


def run(args: Namespace) -> int:
    """Write the chosen poses, by default all; broken frames among several are left out."""
    sequence = is_pattern(args.out)
    with open_timeline(args, args.scan) as timeline:
        indices = chosen_poses(args, timeline) or list(range(len(timeline)))
        check_output(args.out, formats.writable_suffixes(views=True), several=len(indices) > 1)
        files = {index: numbered(args.out, index) for index in indices}
        times_file = args.out.with_name(TIMES_FILE)
        if sequence:
            _check_times_file(times_file, {file.name for file in files.values()})
        rows = []
        with progress(len(indices)) as tick:
            for pose in read_poses(timeline, indices):
                formats.write(files[pose.index], pose.cloud, pose.views)
                rows.append((files[pose.index].name, pose.time))
                tick()
    if sequence:
        with whole_file(times_file) as path, open(path, "w", newline="", encoding="utf-8") as stream:
            csv.writer(stream).writerows([("file", "time"), *rows])
    print(args.out)
    return 0


def _check_times_file(path: Path, names: set[str]) -> None:
    """Raise InputError where there is a times.csv that tells the times of other files."""
    if not path.exists():
        return
    try:
        with open(path, newline="", encoding="utf-8") as stream:
            told = {row[0] for row in csv.reader(stream) if row}
    except (OSError, UnicodeDecodeError, csv.Error):
        told = {"?"}
    if told - names - {"file"}:
        raise InputError("tells the times of other files", path, "Convert into a folder of its own")

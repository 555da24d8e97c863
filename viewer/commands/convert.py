"""Write poses as PLY, PCD or NPZ, and range views also as EXR.

OUT is a file for one pose, or for a sequence a numbered pattern such as out%04d.ply, with
the times beside it in times.csv.
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

from ..export import check_output
from ..scan import formats
from .console import progress
from .scans import SCAN_HELP, add_pose_arguments, chosen_poses, frame_files, open_timeline, read_poses


def add_arguments(parser: ArgumentParser) -> None:
    """The arguments of `scan4d convert`."""
    parser.add_argument("scan", metavar="SCAN", help=SCAN_HELP)
    suffixes = " ".join(formats.writable_suffixes(views=True))
    parser.add_argument("out", metavar="OUT", type=Path, help=f"{suffixes}, or a pattern with %%04d")
    add_pose_arguments(parser)


def run(args: Namespace) -> int:
    """Write the chosen poses, by default all; broken frames among several are left out."""
    with open_timeline(args, args.scan) as timeline:
        indices = chosen_poses(args, timeline) or list(range(len(timeline)))
        check_output(args.out, formats.writable_suffixes(views=True), several=len(indices) > 1)
        with frame_files(args.out, indices) as file_of, progress(len(indices)) as tick:
            for pose in read_poses(timeline, indices):
                formats.write(file_of(pose), pose.cloud, pose.views)
                tick()
    print(args.out)
    return 0

"""Scans as the command line names them: opened, their poses chosen, and read one after another."""

from __future__ import annotations

import csv
import math
import os
import re
from argparse import ArgumentParser, ArgumentTypeError, Namespace, _ArgumentGroup
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path

import numpy as np

from ..bounds import Bounds
from ..csv_text import save_rows, text_of_cell
from ..errors import InputError
from ..files import absolute, printable
from ..scan import formats
from ..scan.averaging import MOST_FRAMES
from ..scan.open import entries, open_scan
from ..scan.pose import Pose
from ..scan.timeline import Timeline
from ..scan.times import TIMES_FILE, frame_in_words
from ..scan.upright import UNKNOWN, Upright
from ._console import progress, warn

_FRAMED = 5  # poses that a camera is fitted to
_TRIED = 100  # poses that are tried where one that can be read is looked for
SCAN_HELP = (
    "a file, a folder, a numbered pattern such as 'frame%%04d.ply' or 'frame*.ply', or demo; an octree file "
    "(.svo) also by its address (http, https), or - for standard input"
)


def add_pose_arguments(parser: ArgumentParser) -> None:
    """The arguments that choose poses."""
    group = parser.add_argument_group("poses").add_mutually_exclusive_group()
    group.add_argument("--pose", type=int, metavar="I", help="one frame, counted from 0")
    group.add_argument("--time", type=float, metavar="S", help="the frame nearest to a time in seconds")
    group.add_argument("--poses", metavar="A:B[:STEP]", help="frames from A up to, but not including, B")
    group.add_argument("--all", action="store_true", help="all frames")


def add_average_argument(parser: ArgumentParser | _ArgumentGroup) -> None:
    """The argument that averages frames."""
    parser.add_argument(
        "--average", type=_average, metavar="N",
        help="reduce noise: points that stand still become the mean of the last N frames, 2 to "
        f"{MOST_FRAMES}; default 0: off",
    )  # fmt: skip


def _average(text: str) -> int:
    frames = int(text) if text.isdecimal() else -1
    if frames != 0 and not 2 <= frames <= MOST_FRAMES:
        raise ArgumentTypeError(f"'{text}' is neither 0 nor a number of frames from 2 to {MOST_FRAMES}")
    return frames


def open_timeline(args: Namespace, scan: str) -> Timeline:
    """Open a scan with the unit, the rate and the corrections of the command line. Raises InputError."""
    return open_scan(scan, unit=args.unit, fps=args.fps, read=stated_corrections(args))


def stated_corrections(args: Namespace) -> dict[str, str]:
    """The corrections of the command line, with the take as one of them."""
    return {**args.read, **({} if args.take is None else {"take": args.take})}


def chosen_poses(args: Namespace, timeline: Timeline) -> list[int] | None:
    """The indices that the arguments choose, at least one; None where they leave it open.

    Raises InputError where there is no such pose.
    """
    if args.pose is not None:
        timeline.label(args.pose)  # raises where there is none
        return [args.pose]
    if args.time is not None:
        if not math.isfinite(args.time):
            raise InputError(f"{args.time} is not a time", "--time", "Use seconds")
        return [timeline.nearest(args.time)]
    if args.poses is not None:
        return poses_between(args.poses, timeline, "--poses")
    return list(range(len(timeline))) if args.all else None


def poses_between(text: str, timeline: Timeline, option: str) -> list[int]:
    """The indices of a range A:B or A:B:STEP that an option names. Raises InputError where there are none."""
    match = re.fullmatch(r"(\d*):(\d*)(?::0*([1-9]\d*))?", text)
    if not match:
        raise InputError(
            f"'{text}' is not a valid range of frames", option, "Use A:B or A:B:STEP, for example 0:10:2"
        )
    start, stop, step = (int(part) if part else None for part in match.groups())
    indices = list(range(len(timeline)))[start:stop:step]
    if not indices:
        raise InputError(
            f"the scan has no frame in the range {text}",
            timeline.name,
            f"The scan has the frames 0 to {len(timeline) - 1}",
        )
    return indices


def read_poses(timeline: Timeline, indices: Sequence[int], with_empty: bool = False) -> Iterator[Pose]:
    """The poses of these indices, the next one being read while one is in use.

    Where several are asked for, broken ones are reported and left out, and empty ones too. with_empty: empty
    ones come as poses without points. Raises InputError where no pose is left, or several without points.
    """
    read = timeline.drawn if with_empty else timeline.pose
    said, found = 0, False
    for number, index in enumerate(indices):
        try:
            pose = read(index)
        except InputError:
            if len(indices) == 1:
                raise
            said = report(timeline, said)
            continue
        said, found = report(timeline, said), found or pose.count > 0
        if number + 1 < len(indices):
            timeline.request(indices[number + 1])
        yield pose
    if not found and len(indices) > 1:
        raise InputError(f"none of the {len(indices)} frames can be read", timeline.name)


def framing(timeline: Timeline, indices: Sequence[int]) -> Bounds:
    """The bounds of some of these poses together, so that a subject that moves stays in the picture, but for
    poses that are astray.

    Broken ones are passed over. Raises InputError where none can be read.
    """
    spread = dict.fromkeys(indices[i * (len(indices) - 1) // (_FRAMED - 1)] for i in range(_FRAMED))
    boxes = []
    for index in spread:
        with suppress(InputError):
            boxes.append(timeline.pose(index).bounds)
    if not boxes:  # there may be a readable one between
        return first_readable(timeline, indices).bounds
    return Bounds.of_frames(boxes[0], boxes)


def stated_upright(args: Namespace, timeline: Timeline, indices: Sequence[int]) -> Upright:
    """The up axis and the front: from the arguments, else guessed from the first readable one of these
    poses."""
    if args.up:
        return Upright(args.up, "as stated", 1.0)
    with suppress(InputError):
        return first_readable(timeline, indices).upright
    return UNKNOWN


def frame_title(timeline: Timeline, index: int) -> str:
    """A frame's number and file, for messages."""
    return f"{frame_in_words(index)} ({timeline.label(index)})"


def first_readable(timeline: Timeline, indices: Sequence[int]) -> Pose:
    """The first of these poses that is not broken; no later one is read.

    Of many poses, `_TRIED` are tried: half of them in order, half spread over the rest. Raises InputError
    where none of them can be read. Where all of them are empty, those of the whole scan are tried.
    """
    tried, half = list(indices), _TRIED // 2
    if len(tried) > _TRIED:
        tried[half:] = [tried[i] for i in np.linspace(half, len(tried) - 1, half).astype(int)]
    for index in tried:
        with suppress(InputError):
            return timeline.pose(index)
    if timeline.empty.issuperset(indices) and len(indices) < len(timeline):
        return first_readable(timeline, range(len(timeline)))
    error = timeline.broken[tried[0]]
    if len(indices) == 1:
        raise error
    of_all = f"Scan4D tried to read {len(tried)} of {len(indices)} frames, and all of them failed"
    raise InputError(of_all, timeline.name, f"The first: {error}")


def report(timeline: Timeline, said: int) -> int:
    """Print the timeline's messages from number `said` on; how many are printed now."""
    messages = timeline.messages[said:]
    for notice in messages:
        known = notice.text.startswith(timeline.name)  # a single file is named after itself
        warn(notice.text if known else f"{timeline.name}: {notice.text}")
    return said + len(messages)


def frame_outputs(out: Path, indices: Sequence[int], timeline: Timeline) -> list[Path]:
    """All files that `with_files` leads to, of these poses of a scan.

    Raises InputError where a times.csv holds the times of other files, or would be one to other frames.
    """
    from ..output.export import is_pattern, numbered  # takes 40 ms, which `scan4d info` does not need

    files = [numbered(out, index) for index in indices]
    if not is_pattern(out):
        return files
    times_file = out.with_name(TIMES_FILE)
    _check_times_file(times_file, {printable(file.name) for file in files})
    _check_other_frames(out, {file.name for file in files}, timeline)
    return [*files, times_file]


def with_files(out: Path, poses: Iterable[Pose], count: int) -> Iterator[tuple[Pose, Path]]:
    """Poses, so many, each with the file that it goes to; for a pattern, times.csv beside them when all are
    written."""
    from ..output.export import is_pattern, numbered

    rows: list[tuple[str, float]] = []
    with progress(count) as tick:
        for pose in poses:
            path = numbered(out, pose.index)
            rows.append((printable(path.name), pose.time))  # as labels have it
            yield pose, path
            tick()
    if is_pattern(out):
        save_rows(out.with_name(TIMES_FILE), [("file", "time"), *rows])


def _check_times_file(path: Path, names: set[str]) -> None:
    """Raise InputError where there is a times.csv that holds the times of other files."""
    if not path.exists():
        return
    try:
        with open(path, newline="", encoding="utf-8") as stream:
            listed = {text_of_cell(row[0]) for row in csv.reader(stream) if row}
    except (OSError, UnicodeDecodeError, csv.Error):
        listed = {"?"}
    if listed - names - {"file"}:
        raise InputError("already contains the times of other files", path, "Write into a separate folder")


def _check_other_frames(out: Path, names: set[str], timeline: Timeline) -> None:
    """Raise InputError where a times.csv beside these outputs would have to state the times of other frames.

    These are files of the same kind, and several of another one: a single file needs no times. Those in a
    folder `frames` as well, and those of the scan itself that are in several folders.
    """
    folder = out.parent
    found = [file for file in _scan_files(folder) if file.name not in names]
    found += _scan_files(folder / "frames")
    if len(timeline.files) > 1 and os.path.samefile(_common_folder(timeline.files), folder):
        found += [file for file in timeline.files if file.parent != folder]
    kinds = Counter(file.suffix.lower() for file in found)
    if kinds[out.suffix.lower()] or any(count > 1 for count in kinds.values()):
        what = (
            f"contains other frames, such as {found[0].name}, but the new {TIMES_FILE} would not contain "
            "their times"
        )
        raise InputError(what, folder, "Write into a separate folder")


def _scan_files(folder: Path) -> list[Path]:
    """The files in a folder that can be frames, if it is there."""
    if not os.path.isdir(folder):
        return []
    there = [entry for entry in sorted(entries(folder)) if not entry.name.startswith(".")]
    return [
        file
        for file in there
        if file.name != TIMES_FILE and formats.is_known(file.suffix.lower()) and file.is_file()
    ]


def _common_folder(files: Sequence[Path]) -> Path:
    return Path(os.path.commonpath([absolute(file.parent) for file in files]))

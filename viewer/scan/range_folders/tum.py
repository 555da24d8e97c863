"""TUM's RGB-D folders: rgb.txt, depth.txt and groundtruth.txt, whose rows begin with a time in seconds.

Depth is in 1/5000 m. A pose is a translation and a quaternion x y z w, from the camera to the world, in
metres. To each depth picture belong the colours and the pose nearest in time, within 0.02 s, each of them
once. If no file states the camera, Scan4D takes the one that the data set's page gives for all of it, ROS's
default: f 525, c 319.5, 239.5 for 640 x 480 pixels, without distortion.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from heapq import heappop, heappush
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError, shortened
from ...files import named_inside
from ...rigid import rigid_matrix
from ..image_poses import UPRIGHT, from_camera_to_world, rotation_of
from ..reading.camera import PRIMESENSE
from ..reading.sequence import Decided
from ._cameras import camera_of_folder
from ._partners import PICTURE_BYTES, DepthPicture, frames_of_pictures
from ._source import RangeFrames
from ._texts import rows_of

TITLE = "TUM's RGB-D images"

_DEPTH, _COLOR, _POSES = "depth.txt", "rgb.txt", "groundtruth.txt"
_KINECT = replace(PRIMESENSE, depth_scale=5000.0)
_MOST_APART = 0.02  # s


def find(folder: Path, names: Sequence[str], decided: Decided) -> RangeFrames | None:
    """A frame for each depth picture that is listed; None where nothing lists them."""
    if _DEPTH not in names or not {_COLOR, _POSES} & {*names}:
        return None
    times, rows = _rows(folder / _DEPTH)
    if not len(rows):
        raise InputError("lists no depth pictures", folder / _DEPTH)
    colors = _partners(times, folder / _COLOR) if _COLOR in names else [None] * len(rows)
    poses = _partners(times, folder / _POSES) if _POSES in names else None
    pictures = [
        DepthPicture(
            named_inside(folder, words[0], folder / _DEPTH),
            named_inside(folder, color[0], folder / _COLOR) if color else None,
        )
        for words, color in zip(rows, colors, strict=True)
    ]
    camera = camera_of_folder(folder, names, decided.corrections, default=_KINECT, kind=TITLE)

    def pose(index: int) -> NDArray[np.float64]:
        if poses is None:
            return UPRIGHT
        if (words := poses[index]) is None:
            what = f"has no camera pose: no pose in {_POSES} is within {_MOST_APART} s of its time"
            raise InputError(what, pictures[index].depth)
        return _pose(words, folder / _POSES)

    lists = [folder / name for name in (_DEPTH, _COLOR, _POSES) if name in names]
    return frames_of_pictures(folder, pictures, camera, pose, decided, lists, times - times[0])


def lacks(names: Sequence[str]) -> str:
    """The list of depth pictures, where poses stand without."""
    return f"the list of depth pictures, {_DEPTH}, is missing" if _POSES in names else ""


def nearest_once(times: NDArray[np.float64], others: NDArray[np.float64], most: float) -> NDArray[np.int64]:
    """The number of the nearest other of each time, no other twice; -1 where none is within `most`.

    times, others: (N,) and (M,), increasing. The nearest pairs come first.

    The nearest pair of those left are always neighbours among all times that are left, in order: so of N + M
    times only neighbours are looked at, and new ones where a pair goes.
    """
    both = np.concatenate([times, others])
    order = np.argsort(both, kind="stable")
    after, before = np.full(len(both) + 1, -1), np.full(len(both) + 1, -1)  # the last one: an end
    after[order[:-1]], before[order[1:]] = order[1:], order[:-1]
    found, count = np.full(len(times), -1), len(times)
    pairs: list[tuple[float, int, int]] = []

    def meet(left: int, right: int) -> None:
        one, other = min(left, right), max(left, right)
        if 0 <= one < count <= other and (apart := abs(both[other] - both[one])) <= most:
            heappush(pairs, (apart, one, other - count))

    for left, right in zip(order[:-1].tolist(), order[1:].tolist(), strict=True):
        meet(left, right)
    is_left = np.ones(len(both), bool)
    while pairs:
        _, one, other = heappop(pairs)
        if not (is_left[one] and is_left[other + count]):
            continue
        found[one] = other
        for gone in (one, other + count):
            is_left[gone] = False
            left, right = int(before[gone]), int(after[gone])
            after[left], before[right] = right, left
            meet(left, right)
    return found


def _rows(path: Path) -> tuple[NDArray[np.float64], list[list[str]]]:
    """Times (N,), increasing, and the words behind them. Raises InputError."""
    by_time: dict[float, list[str]] = {}
    for number, words in rows_of(path, PICTURE_BYTES):
        if "," in words[0]:
            words = " ".join(words).replace(",", " ").split() or words
        by_time.setdefault(_time(words, path, number), words[1:])
    times = sorted(by_time)
    return np.array(times), [by_time[time] for time in times]


def _time(words: list[str], path: Path, line: int) -> float:
    try:
        time = float(words[0])
    except ValueError:
        time = np.nan
    if not np.isfinite(time) or len(words) < 2:
        where = f"{path}, line {line}"
        raise InputError(
            f"'{shortened(' '.join(words))}' is not a row of data",
            where,
            "Each row of the list is a time in seconds and the file name of a picture",
        )
    return time


def _partners(times: NDArray[np.float64], path: Path) -> list[list[str] | None]:
    """The words of the row that belongs to each time, or None."""
    others, rows = _rows(path)
    return [rows[at] if at >= 0 else None for at in nearest_once(times, others, _MOST_APART)]


def _pose(words: list[str], path: Path) -> NDArray[np.float64]:
    try:
        numbers = np.array(words, np.float64).reshape(7)
    except ValueError:
        hint = "Each row is a time in seconds, a translation and a quaternion: t tx ty tz qx qy qz qw"
        raise InputError(f"'{shortened(' '.join(words))}' is not a pose", path, hint) from None
    return from_camera_to_world(rigid_matrix(rotation_of(numbers[3:]), numbers[:3]))

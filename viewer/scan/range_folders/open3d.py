"""Open3D's RGB-D folders: depth/ and color/, poses in trajectory.log or odometry.log, pairs in rgbd.match.

Depth is in millimetres. Each record of a log is three whole numbers and a matrix from the camera to the
world, in metres, in the order of the frames. If no file states the camera, Scan4D takes Open3D's
default, a PrimeSense: f 525, c 319.5, 239.5 for 640 x 480 pixels.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...files import named_inside
from ..image_poses import UPRIGHT, from_camera_to_world
from ..reading.camera import PRIMESENSE
from ..reading.sequence import Decided
from ._cameras import camera_of_folder
from ._partners import PICTURE_BYTES, DepthPicture, frames_of_pictures, named_pictures
from ._source import RangeFrames
from ._texts import rows_of

TITLE = "Open3D's RGB-D images"

_DEPTH_FOLDER = "depth"

_PAIRS = "rgbd.match"
_LOGS = ("trajectory.log", "odometry.log")  # the better one first
_RECORD = 19  # numbers: three that count, and a matrix


def find(folder: Path, names: Sequence[str], decided: Decided) -> RangeFrames | None:
    """A frame for each depth picture, where a log or a list of pairs stands beside the folder `depth`."""
    known = [name for name in (_PAIRS, *_LOGS) if name in names]
    if not known or _DEPTH_FOLDER not in names:
        return None
    pictures = _pairs(folder) if _PAIRS in known else named_pictures(folder, names)
    if not pictures:
        raise InputError("holds no depth pictures", folder / _DEPTH_FOLDER, "They are 16-bit PNG")
    camera = camera_of_folder(
        folder, names, decided.corrections, default=PRIMESENSE, is_known_scale=True, kind=TITLE
    )
    log = next((name for name in _LOGS if name in names), None)
    poses = None if log is None else read_log(folder / log)

    def pose(index: int) -> NDArray[np.float64]:
        if poses is None:
            return UPRIGHT
        if index >= len(poses):
            raise InputError(
                f"has no camera pose: {log} contains only {len(poses)} poses", pictures[index].depth
            )
        return from_camera_to_world(poses[index])

    beside = [folder / name for name in known]
    return frames_of_pictures(folder, pictures, camera, pose, decided, beside)


def lacks(names: Sequence[str]) -> str:
    """The folder of depth pictures, where logs or pairs stand without."""
    known = [name for name in (_PAIRS, *_LOGS) if name in names]
    return f"the folder '{_DEPTH_FOLDER}' of 16-bit PNG is missing" if known else ""


def read_log(path: Path) -> NDArray[np.float64]:
    """The matrices of a log, (N, 4, 4), from the camera to the world. Raises InputError."""
    words = [word for _, row in rows_of(path) for word in row]
    try:
        return np.array(words, np.float64).reshape(-1, _RECORD)[:, 3:].reshape(-1, 4, 4)
    except ValueError as error:
        hint = "Each pose in the log is three whole numbers and a 4 x 4 matrix"
        raise InputError("is damaged, or is not a log of poses", path, hint) from error


def _pairs(folder: Path) -> list[DepthPicture]:
    file = folder / _PAIRS
    pairs = [words for _, words in rows_of(file, PICTURE_BYTES)]
    if any(len(pair) != 2 for pair in pairs):
        raise InputError(
            "has a line that is not a pair of names",
            file,
            "Each line names the depth picture, then the colour picture",
        )
    return [DepthPicture(*(named_inside(folder, name, file) for name in pair)) for pair in pairs]

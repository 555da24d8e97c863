"""Depth pictures and what belongs to each: colours of the same pixels, and where the camera stood."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ..image_poses import from_camera_to_world
from ..range_view import RangeView
from ..times import natural_key
from ._calibration import FILES, Calibration
from ._pictures import COLOR_SUFFIXES, DEPTH_SUFFIX, depth_view, is_depth
from ._source import RangeFrames
from ._texts import rows_of

DEPTH_FOLDER = "depth"
PICTURE_BYTES = 3000  # of memory for what is known of a depth picture

_DEPTH, _POSE = "depth", "pose"  # in the names of files, and of folders
_COLORS = ("color", "colour", "rgb", "image")
_POSE_SUFFIX = ".txt"


@dataclass(frozen=True)
class DepthPicture:
    """A depth picture, its colours, and its pose, which stand in other files or are not there."""

    depth: Path
    color: Path | None = None
    pose: Path | None = None


def frames_of_pictures(
    folder: Path,
    pictures: Sequence[DepthPicture],
    calibration: Calibration,
    pose: Callable[[int], NDArray[np.float64]],
    beside: Sequence[str] = (),
    recorded: NDArray[np.float64] | None = None,
) -> RangeFrames:
    """Frames of one view each. pose: the world_to_camera of each. beside: names of other files that are read.

    recorded: the times of the frames, (T,) seconds.
    """

    def read(index: int) -> Iterator[RangeView]:
        yield depth_view(pictures[index].depth, pictures[index].color, calibration, pose(index))

    used = [
        path
        for picture in pictures
        for path in (picture.depth, picture.color, picture.pose)
        if path is not None
    ]
    others = [folder / name for name in (*FILES, *beside) if (folder / name).is_file()]
    labels = tuple(picture.depth.relative_to(folder).as_posix() for picture in pictures)
    files = tuple(dict.fromkeys([*used, *others]))
    return RangeFrames(folder.resolve().name, labels, read, files, calibration.unit, lambda: recorded)


def named_pictures(folder: Path, names: Sequence[str]) -> list[DepthPicture]:
    """The depth pictures of a folder with their partners, in natural order.

    They are in its folder `depth`, with partners of the same name in folders `color` (or `rgb`, `image`) and
    `pose`; or in the folder itself, where partners have `color` and `pose` in place of `depth`, or the
    same name and another suffix.
    """
    if DEPTH_FOLDER in names:
        return list(_in_folders(folder, names))
    there = set(names)
    return [
        DepthPicture(
            folder / name,
            _first(folder, there, _color_names(name)),
            _first(folder, there, _pose_names(name)),
        )
        for name in depth_names(folder, names)
    ]


def depth_names(folder: Path, names: Sequence[str]) -> list[str]:
    """The names of depth pictures in natural order: PNG that say so, or all if the first is 16-bit grey."""
    pictures = sorted((name for name in names if name.lower().endswith(DEPTH_SUFFIX)), key=natural_key)
    named = [name for name in pictures if _DEPTH in name.lower()]
    return named or (pictures if pictures and is_depth(folder / pictures[0]) else [])


def pose_of_file(picture: DepthPicture) -> NDArray[np.float64]:
    """The world_to_camera of the picture's pose file, a 4 x 4 matrix from the camera to the world.

    Raises InputError.
    """
    if picture.pose is None:
        raise InputError("has no camera pose: the file with the pose is missing", picture.depth)
    try:
        numbers = np.array([word for _, words in rows_of(picture.pose) for word in words], np.float64)
        if numbers.shape != (16,):
            raise InputError(f"holds {numbers.size} numbers, but a pose is a 4 x 4 matrix")
        return from_camera_to_world(numbers.reshape(4, 4))
    except InputError as error:
        raise InputError(error.what, picture.pose, error.hint) from error
    except ValueError as error:
        raise InputError("is not a pose: it contains other words than numbers", picture.pose) from error


def _in_folders(folder: Path, names: Sequence[str]) -> Iterator[DepthPicture]:
    of_colors = next((name for name in _COLORS if name in names), None)
    colors = _by_stem(folder / of_colors, COLOR_SUFFIXES) if of_colors else {}
    poses = _by_stem(folder / _POSE, (_POSE_SUFFIX,))
    for stem, depth in _by_stem(folder / DEPTH_FOLDER, (DEPTH_SUFFIX,)).items():
        yield DepthPicture(depth, colors.get(stem), poses.get(stem))


def _by_stem(folder: Path, suffixes: Sequence[str]) -> dict[str, Path]:
    """The files of a folder by their names without suffix, in natural order; none where it is not there."""
    try:
        files = [folder / name for name in os.listdir(folder) if not name.startswith(".")]
    except OSError:
        return {}
    chosen = [file for file in files if file.suffix.lower() in suffixes]
    return {file.stem: file for file in sorted(chosen, key=lambda file: natural_key(file.name))}


def _color_names(depth: str) -> Iterator[str]:
    stem, lower = Path(depth).stem, Path(depth).stem.lower()
    stems = [_replaced(stem, color) for color in _COLORS] if _DEPTH in lower else [stem]
    for suffix in COLOR_SUFFIXES:
        yield from (name for one in stems if (name := one + suffix) != depth)


def _pose_names(depth: str) -> Iterator[str]:
    stem = Path(depth).stem
    if _DEPTH in stem.lower():
        yield _replaced(stem, _POSE) + _POSE_SUFFIX
    yield from (f"{stem}.{_POSE}{_POSE_SUFFIX}", stem + _POSE_SUFFIX)


def _replaced(stem: str, word: str) -> str:
    """The name with a word in place of `depth`."""
    at = stem.lower().rindex(_DEPTH)
    return stem[:at] + word + stem[at + len(_DEPTH) :]


def _first(folder: Path, there: set[str], names: Iterator[str]) -> Path | None:
    return next((folder / name for name in names if name in there), None)

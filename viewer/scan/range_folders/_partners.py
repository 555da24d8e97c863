"""Depth pictures and what belongs to each: colours, mask, confidence, its camera, and where that stood."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ..contents import StatedCamera
from ..image_poses import IMAGE_AXES, from_camera_to_world
from ..range_view import RangeView
from ..reading.camera import DepthCamera, Size
from ..reading.camera_files import stated_cameras
from ..reading.depths import size_of_image
from ..reading.sequence import Decided
from ..times import natural_key
from ._cameras import FolderCamera
from ._pictures import (
    COLOR_SUFFIXES,
    DEPTH_SUFFIX,
    OTHER_DEPTH_SUFFIXES,
    ViewFiles,
    depth_view,
    is_depth,
)
from ._source import RangeFrames
from ._texts import object_of, rows_of, text_of

DEPTH_FOLDERS = ("depth", "depths", "depth_images", "depth_maps", "depthmaps", "lowres_depth")
PICTURE_BYTES = 3000  # of memory for what is known of a depth picture

_DEPTH = "depth"  # in the names of files
# What the folders of partners are called; in the names of files, these words replace `depth`.
_COLORS = (
    "color", "colour", "rgb", "image", "colors", "images", "corrected_images", "rgb_images", "lowres_wide",
    "frame",
)  # fmt: skip
_POSES = ("pose", "poses")
_CONFIDENCES = ("confidence", "conf", "confidences", "confidence_images")
_MASKS = ("mask", "masks")
_CAMERAS = ("cameras", "corrected_cameras", "camera", "frame", "lowres_wide_intrinsics")
_CAMERA_SUFFIXES = (".json", ".pincam")
_POSE_SUFFIX = ".txt"
_ARKIT_POSE, _ARKIT_TIME = "cameraPoseARFrame", "time"  # fields of a picture's camera file


@dataclass(frozen=True)
class DepthPicture:
    """A depth picture, and the files of its partners, which may be missing.

    camera: a file that states the camera of this picture alone, and perhaps its pose. stated: cameras of this
    picture alone in a file of all.
    """

    depth: Path
    color: Path | None = None
    pose: Path | None = None
    mask: Path | None = None
    confidence: Path | None = None
    camera: Path | None = None
    stated: tuple[StatedCamera, ...] = field(default=(), kw_only=True)

    @property
    def files(self) -> tuple[Path, ...]:
        """All that are there."""
        named = (self.depth, self.color, self.pose, self.mask, self.confidence, self.camera)
        return tuple(path for path in named if path is not None)


def frames_of_pictures(
    folder: Path,
    pictures: Sequence[DepthPicture],
    camera: FolderCamera,
    pose: Callable[[int], NDArray[np.float64]],
    decided: Decided,
    beside: Iterable[Path] = (),
    recorded: NDArray[np.float64] | None = None,
) -> RangeFrames:
    """Frames of one view each. pose: the world_to_camera of each. beside: other files that are read.

    recorded: the times of the frames, (T,) seconds.
    """

    def read(index: int) -> Iterator[RangeView]:
        picture, of_frame = pictures[index], decided.at(index)

        def camera_of(stored: NDArray, of_color: Size | None) -> DepthCamera:
            own = own_cameras(picture.camera) if picture.camera else picture.stated
            is_whole = stored.dtype.kind != "f"
            size = size_of_image(stored)
            return camera.of_picture(size, of_frame, is_whole=is_whole, of_color=of_color, own=own)

        files = ViewFiles(
            depth=picture.depth, color=picture.color, mask=picture.mask, confidence=picture.confidence
        )
        yield depth_view(files, camera_of, pose(index), of_frame)

    used = [path for picture in pictures for path in picture.files]
    labels = tuple(picture.depth.relative_to(folder).as_posix() for picture in pictures)
    files = tuple(dict.fromkeys([*used, *camera.files, *(path for path in beside if path.is_file())]))
    return RangeFrames(folder.resolve().name, labels, read, files, camera.unit, lambda: recorded)


def named_pictures(folder: Path, names: Sequence[str]) -> list[DepthPicture]:
    """The depth pictures of a folder with their partners, in natural order.

    They are in its folder `depth`, with partners of the same name in folders such as `color` or `pose`; or in
    the folder itself, where partners have another word in place of `depth`, or the same name and another
    suffix.
    """
    if (of_depth := depth_folder(names)) is not None:
        return list(_in_folders(folder, names, of_depth))
    there = {name.lower(): name for name in names}

    def first(candidates: Iterator[str]) -> Path | None:
        return next((folder / there[name.lower()] for name in candidates if name.lower() in there), None)

    return [
        DepthPicture(
            folder / name,
            first(_partner_names(name, _COLORS, COLOR_SUFFIXES)),
            first(_pose_names(name)),
            first(_partner_names(name, _MASKS, COLOR_SUFFIXES, without_word=False)),
            first(_partner_names(name, _CONFIDENCES, COLOR_SUFFIXES, without_word=False)),
            first(_partner_names(name, _CAMERAS, _CAMERA_SUFFIXES, without_word=False)),
        )
        for name in depth_names(folder, names)
    ]


def depth_folder(names: Sequence[str]) -> str | None:
    """The folder of depth pictures among the names in a folder."""
    return first_named(DEPTH_FOLDERS, names)


def first_named(wanted: Sequence[str], names: Sequence[str]) -> str | None:
    """The name among those of a folder that is the first one wanted, in upper or lower case."""
    there = {name.lower(): name for name in names}
    return next((there[name] for name in wanted if name in there), None)


def depth_names(folder: Path, names: Sequence[str]) -> list[str]:
    """The names of depth pictures in natural order.

    These are PNG that say so, or all PNG if the first is 16-bit grey, or else other pictures that say so.
    """
    pictures = sorted((name for name in names if name.lower().endswith(DEPTH_SUFFIX)), key=natural_key)
    others = sorted((name for name in names if name.lower().endswith(OTHER_DEPTH_SUFFIXES)), key=natural_key)
    if named := [name for name in pictures if _DEPTH in name.lower()]:
        return named
    if pictures and is_depth(folder / pictures[0]):
        return pictures
    return [name for name in others if _DEPTH in name.lower()]


def own_cameras(path: Path) -> tuple[StatedCamera, ...]:
    """The cameras in a file that belongs to one picture. Raises InputError."""
    try:
        return stated_cameras(path.name, text_of(path))
    except InputError as error:
        raise InputError(error.what, path, error.hint) from error


def pose_of_picture(picture: DepthPicture) -> NDArray[np.float64]:
    """The world_to_camera of a picture, from its pose file, else from its camera file. Raises InputError."""
    if picture.pose is not None or picture.camera is None:
        return pose_of_file(picture)
    stored = object_of(picture.camera)
    try:
        if "t_00" in stored:  # Polycam: the upper three rows
            rows = [[float(stored[f"t_{row}{column}"]) for column in range(4)] for row in range(3)]
            matrix = np.array([*rows, [0, 0, 0, 1]])
        else:
            matrix = np.array(stored[_ARKIT_POSE], np.float64).reshape(4, 4)
        return from_camera_to_world(matrix @ IMAGE_AXES)  # their cameras look along -z, +y is up
    except InputError as error:
        raise InputError(error.what, picture.camera, error.hint) from error
    except (KeyError, TypeError, ValueError) as error:
        raise InputError("holds no camera pose", picture.camera) from error


def states_a_pose(picture: DepthPicture) -> bool:
    """Whether the file of a picture's camera states its pose, too."""
    if picture.camera is None or picture.camera.suffix.lower() != ".json":
        return False
    try:
        return bool({"t_00", _ARKIT_POSE} & object_of(picture.camera).keys())
    except InputError:  # reading the frame will say why
        return False


def times_of_pictures(pictures: Sequence[DepthPicture]) -> NDArray[np.float64] | None:
    """Seconds that the camera files of ARKit's pictures state, (T,); None where one states none."""
    times = []
    for picture in pictures:
        try:
            stored = object_of(picture.camera) if picture.camera else {}
        except InputError:  # reading the frame will say why
            return None
        if _ARKIT_POSE not in stored or not isinstance(time := stored.get(_ARKIT_TIME), int | float):
            return None
        times.append(float(time))
    return np.array(times) - times[0]


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
        raise InputError("is not a pose: it contains words that are not numbers", picture.pose) from error


def _in_folders(folder: Path, names: Sequence[str], of_depth: str) -> Iterator[DepthPicture]:
    def partners(folders: Sequence[str], suffixes: Sequence[str]) -> dict[str, Path]:
        found = first_named(folders, names)
        return {} if found is None else _by_stem(folder / found, suffixes)

    colors, poses = partners(_COLORS, COLOR_SUFFIXES), partners(_POSES, (_POSE_SUFFIX,))
    masks, confidences = partners(_MASKS, COLOR_SUFFIXES), partners(_CONFIDENCES, COLOR_SUFFIXES)
    cameras = partners(_CAMERAS, _CAMERA_SUFFIXES)
    pictures = _by_stem(folder / of_depth, (DEPTH_SUFFIX,)) or _by_stem(
        folder / of_depth, OTHER_DEPTH_SUFFIXES
    )
    all_partners = [_by_name_or_number(found) for found in (colors, poses, masks, confidences, cameras)]
    for stem, depth in pictures.items():
        yield DepthPicture(depth, *(partner(stem) for partner in all_partners))


def _by_name_or_number(files: Mapping[str, Path]) -> Callable[[str], Path | None]:
    """A function that finds the file of a depth picture's name, or else the only one with its numbers."""
    by_number: dict[str, list[Path]] = {}
    for stem, file in files.items():
        by_number.setdefault(_numbers_in(stem), []).append(file)

    def find(stem: str) -> Path | None:
        if stem in files:
            return files[stem]
        alike = by_number.get(_numbers_in(stem), [])
        return alike[0] if len(alike) == 1 and _numbers_in(stem) else None

    return find


def _numbers_in(stem: str) -> str:
    """The numbers in a name: `depth_0001` and `rgb_0001` have the same."""
    return " ".join(re.findall(r"\d+", stem))


def _by_stem(folder: Path, suffixes: Sequence[str]) -> dict[str, Path]:
    """The files of a folder by their names without suffix, in natural order; none where it is not there."""
    try:
        files = [folder / name for name in os.listdir(folder) if not name.startswith(".")]
    except OSError:
        return {}
    chosen = [file for file in files if file.suffix.lower() in suffixes]
    return {file.stem: file for file in sorted(chosen, key=lambda file: natural_key(file.name))}


def _partner_names(
    depth: str, words: Sequence[str], suffixes: Sequence[str], without_word: bool = True
) -> Iterator[str]:
    """Names that a partner may have. without_word: whether one may have the depth picture's own name."""
    stem = Path(depth).stem
    if _DEPTH in stem.lower():
        stems = [_replaced(stem, word) for word in words]
    else:
        stems = [stem] if without_word else []
    for suffix in suffixes:
        yield from (name for one in stems if (name := one + suffix) != depth)


def _pose_names(depth: str) -> Iterator[str]:
    stem = Path(depth).stem
    if _DEPTH in stem.lower():
        yield _replaced(stem, _POSES[0]) + _POSE_SUFFIX
    yield from (f"{stem}.{_POSES[0]}{_POSE_SUFFIX}", stem + _POSE_SUFFIX)


def _replaced(stem: str, word: str) -> str:
    """The name with a word in place of `depth`."""
    at = stem.lower().rindex(_DEPTH)
    return stem[:at] + word + stem[at + len(_DEPTH) :]

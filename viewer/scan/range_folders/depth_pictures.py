"""Depth pictures in general: colours, poses and masks by the same names, and a file that states the camera.

Most recorders write such folders. They differ in the name and in the form of the file with the camera, which
`viewer/scan/reading/camera_files.py` knows.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from .. import formats
from ..image_poses import UPRIGHT
from ..reading.sequence import Decided
from ._cameras import FolderCamera, camera_of_folder
from ._partners import (
    DepthPicture,
    depth_folder,
    frames_of_pictures,
    named_pictures,
    pose_of_picture,
    states_a_pose,
    times_of_pictures,
)
from ._pictures import DEPTH_SUFFIX, is_depth
from ._source import RangeFrames
from ._trajectories import PlacedPictures, trajectory_of_folder

TITLE = "depth pictures"
GENERAL = True

_DEPTH = "depth"  # in names
_INNER = ("keyframes", "EXR_RGBD", "frames", "results")  # folders that recorders put all pictures into
_HINT = (
    'Put a camera.json beside the pictures: {"fx": 525, "fy": 525, "cx": 319.5, "cy": 239.5, "depth_scale": '
    "1000}, or state the camera with --read camera=fx,fy,cx,cy"
)


def find(folder: Path, names: Sequence[str], decided: Decided) -> RangeFrames | None:
    """A frame for each depth picture; None where there is none, or the folder may be another scan.

    Raises InputError where 16-bit pictures are all that there is, and nothing says that they are depth.
    """
    base, inner = _with_pictures(folder, names)
    pictures = named_pictures(base, inner)
    if not pictures:
        return None
    if _has_scan_files({*names, *inner}) and not pictures[0].camera:
        camera = _camera_beside_scans(base, inner, pictures[0].depth, decided)
        if camera is None:
            return None
    else:
        camera = camera_of_folder(base, inner, decided.corrections)
        if not camera.is_stated and base != folder:
            camera = camera_of_folder(folder, names, decided.corrections)
        first = pictures[0].depth
        if not (camera.is_stated or pictures[0].camera or is_depth(first) or _is_no_png(first)):
            return None
        if not (camera.is_stated or pictures[0].camera or _say_depth(pictures, inner)):
            raise InputError("contains 16-bit pictures, but no file states their camera", folder, _HINT)
    if any(picture.pose for picture in pictures) or states_a_pose(pictures[0]):

        def pose(index: int) -> NDArray[np.float64]:
            return pose_of_picture(pictures[index])

        return frames_of_pictures(
            folder, pictures, camera, pose, decided, recorded=times_of_pictures(pictures)
        )
    found = (
        trajectory_of_folder(base, inner) or (base != folder and trajectory_of_folder(folder, names)) or None
    )
    if found is None:
        return frames_of_pictures(folder, pictures, camera, lambda _: UPRIGHT, decided)
    placed = PlacedPictures.of(found, pictures)
    return frames_of_pictures(
        folder, placed.with_cameras(), camera, placed.pose, decided, [found.file], placed.times
    )


def _camera_beside_scans(
    folder: Path, names: Sequence[str], first: Path, decided: Decided
) -> FolderCamera | None:
    """The camera of depth pictures beside scan files, which they may be themselves; None where those are the
    scan, as no file says that the pictures are depth."""
    says_depth = _DEPTH in first.relative_to(folder).as_posix().lower()
    if not (says_depth if _is_no_png(first) else is_depth(first)):
        return None
    try:
        camera = camera_of_folder(folder, names, decided.corrections, only_own=True)
    except InputError:
        if not _is_no_png(first):
            raise
        return None  # a camera.json of Scan4D's own, beside pictures that it has made
    return camera if camera.is_stated else None


def _is_no_png(path: Path) -> bool:
    """Whether a depth picture is of a kind that stores no colours but depth or points."""
    return path.suffix.lower() != DEPTH_SUFFIX


def _say_depth(pictures: Sequence[DepthPicture], names: Sequence[str]) -> bool:
    """Whether the names of the pictures, or of their folder, say that they are depth."""
    return depth_folder(names) is not None or _DEPTH in pictures[0].depth.name.lower()


def _with_pictures(folder: Path, names: Sequence[str]) -> tuple[Path, Sequence[str]]:
    """The folder that holds the pictures, and the names in it: the folder itself, or one in it."""
    for name in _INNER:
        if name in names and depth_folder(names) is None and (folder / name).is_dir():
            inner = [path.name for path in (folder / name).iterdir()]
            if depth_folder(inner) is not None or any(_DEPTH in one.lower() for one in inner):
                return folder / name, inner
    return folder, names


def _has_scan_files(names: Iterable[str]) -> bool:
    """Whether there are scan files beside the pictures; text tables there are notes."""
    suffixes = {Path(name).suffix.lower() for name in names}
    return any(formats.is_known(suffix) for suffix in suffixes - formats.NOTES)


def lacks(names: Sequence[str]) -> str:
    """The depth of a recording of Record3D that is only unpacked."""
    if {"metadata", "rgbd"} <= {*names}:
        return "Record3D stores depth in its own format. In Record3D, export the recording as EXR with RGB-D"
    return ""

"""Depth pictures in general: 16-bit PNG, colours and poses by the same names, and a camera.json."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ...errors import InputError
from .. import formats
from ..image_poses import UPRIGHT
from ._calibration import calibration_file, read_calibration
from ._partners import frames_of_pictures, named_pictures, pose_of_file
from ._pictures import is_depth
from ._source import RangeFrames

TITLE = "depth pictures"
GENERAL = True

_HINT = 'Put a camera.json beside them: {"fx": 525, "fy": 525, "cx": 319.5, "cy": 239.5, "depth_scale": 1000}'


def find(folder: Path, names: Sequence[str]) -> RangeFrames | None:
    """A frame for each depth picture; None where there is none, or the folder may be another scan.

    Raises InputError where depth pictures are all that there is, and their calibration is missing.
    """
    pictures, camera = named_pictures(folder, names), calibration_file(names)
    if not pictures:
        return None
    has_scans = _has_scan_files(names)
    if (camera is None or has_scans) and not is_depth(pictures[0].depth):
        return None
    if camera is None:
        if has_scans:
            return None
        raise InputError("holds depth pictures without the data of their camera", folder, _HINT)
    calibration = read_calibration(folder / camera)
    have_poses = any(picture.pose for picture in pictures)
    return frames_of_pictures(
        folder, pictures, calibration, lambda index: pose_of_file(pictures[index]) if have_poses else UPRIGHT
    )


def _has_scan_files(names: Sequence[str]) -> bool:
    """Whether there are scan files beside the pictures; text tables there are notes."""
    suffixes = {Path(name).suffix.lower() for name in names}
    return bool(suffixes & {*formats.known_suffixes()} - formats.NOTES)

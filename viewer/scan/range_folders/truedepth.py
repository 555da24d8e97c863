"""A phone's TrueDepth frames: frame-*.npz with `depth`, `color` and `timestamp`, and camera_intrinsics.json.

Depth is in metres; the colours are stored linear. The calibration is Apple's: a matrix by columns, for
pictures of a width that stands beside it. No poses are known: each frame is in its camera's own space. The
sensor lies on its side in the phone, so pictures are turned by quarters until gravity, as `motion-data.json`
tells it, goes down in them.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError, shortened
from ...srgb import bytes_from_linear
from ..formats.npz import read_arrays
from ..image_poses import UPRIGHT
from ..range_view import RangeView
from ..reading.camera import CENTER, decide_view
from ..reading.sequence import Decided
from ..times import natural_key
from ._source import RangeFrames
from ._texts import json_of, object_of

TITLE = "TrueDepth frames"

_CAMERA, _MOTION, _FRAME = "camera_intrinsics.json", "motion-data.json", "frame-"
_MATRIX, _WIDTH = "intrinsic_matrix", "intrinsic_matrix_reference_dimensions_width"
_SRGB = bytes_from_linear(np.arange(256) / 255)  # of a stored colour


def find(folder: Path, names: Sequence[str], decided: Decided) -> RangeFrames | None:
    """A frame for each file; None where there is no such calibration."""
    frames = [name for name in names if name.startswith(_FRAME) and name.endswith(".npz")]
    if not frames or _CAMERA not in names:
        return None
    frames.sort(key=natural_key)
    camera = _intrinsics(folder / _CAMERA)
    turns = _quarter_turns(folder / _MOTION) if _MOTION in names else 0
    files = [folder / name for name in frames]
    return RangeFrames(
        name=folder.resolve().name,
        labels=tuple(frames),
        read=lambda index: iter([_view(files[index], camera, turns, decided.at(index))]),
        files=(*files, *(folder / name for name in (_CAMERA, _MOTION) if name in names)),
        unit="m",
        recorded=lambda: _times(files),
    )


def lacks(names: Sequence[str]) -> str:
    """The frames, where their calibration stands without."""
    return f"the frames, {_FRAME}N.npz, are missing" if _CAMERA in names else ""


def _view(file: Path, camera: NDArray[np.float64], turns: int, decided: Decided) -> RangeView:
    """The view of a frame, turned clockwise by so many quarters."""
    depth, color = read_arrays(file, "depth", "color")
    if color.dtype != np.uint8:
        raise InputError(f"array 'color' is of type {color.dtype}, expected uint8", file)
    if depth.ndim != 2:
        raise InputError(f"array 'depth' has shape {depth.shape}, expected (H, W)", file)
    fx, fy, cx, cy = camera * depth.shape[1] + (0, 0, CENTER, CENTER)
    for _ in range(turns):
        fx, fy, cx, cy = fy, fx, depth.shape[0] - cy, cx
        depth, color = np.rot90(depth, -1), np.rot90(color, -1)
    pinhole = {"fx": fx, "fy": fy, "cx": cx, "cy": cy}
    why = (
        (
            f"Scan4D turns the pictures by {90 * turns} degrees, because {_MOTION} states the direction of "
            "gravity"
        )
        if turns
        else ""
    )
    return RangeView(
        depth=np.ascontiguousarray(depth),
        mask=np.isfinite(depth),
        color=_SRGB[color],
        **decide_view(pinhole, depth.shape[::-1], decided, _CAMERA, why, "neighbour"),
        world_to_camera=UPRIGHT,
        name="truedepth",
        unit="m",
    )


def _times(files: Sequence[Path]) -> NDArray[np.float64] | None:
    """Seconds from the first frame on, (T,); None where a frame tells none."""
    try:
        stored = [float(read_arrays(file, "timestamp")[0]) for file in files]
    except Exception:  # whatever is wrong with a frame, reading it tells
        return None
    return np.array(stored) - stored[0]


def _quarter_turns(file: Path) -> int:
    """How often pictures are to be turned clockwise by a quarter, from gravity in the phone's axes.

    These are right, up and out of the screen, where its camera looks; the picture's right is the phone's
    bottom. Raises InputError.
    """
    try:
        records = json_of(file)
        gravity = np.array([(record["gravity_x"], record["gravity_y"]) for record in records], np.float64)
        right, up = gravity.sum(axis=0)  # none of an empty list
    except (ValueError, KeyError, TypeError) as error:
        hint = "If you remove this file, Scan4D shows the pictures in the orientation of the sensor"
        raise InputError(f"has no usable gravity: {shortened(repr(error))}", file, hint) from error
    sides = (right, -up, -right, up)  # how far up the picture's top is, its left, its bottom, its right
    return sides.index(max(sides))


def _intrinsics(file: Path) -> NDArray[np.float64]:
    """fx, fy, cx and cy in widths of the picture, (4,). Raises InputError."""
    stored = object_of(file)
    try:
        camera = np.array(stored[_MATRIX], np.float64).reshape(9)[[0, 4, 6, 7]] / float(stored[_WIDTH])
    except (ValueError, KeyError, TypeError, ZeroDivisionError) as error:
        raise InputError(f"is not a calibration: {shortened(str(error))}", file) from error
    if not (np.isfinite(camera).all() and (camera > 0).all()):
        raise InputError("is not a calibration: numbers of its matrix must be above 0", file)
    return camera

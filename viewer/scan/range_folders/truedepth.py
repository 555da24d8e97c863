"""A phone's TrueDepth frames: frame-*.npz with `depth`, `color` and `timestamp`, and camera_intrinsics.json.

Depth is in metres; the colours are stored linear. The calibration is Apple's: a matrix by columns, for
pictures of a width that stands beside it. No poses are known: each frame is in its camera's own space.
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
from ..times import natural_key
from ._source import RangeFrames
from ._texts import object_of

TITLE = "TrueDepth frames"

_CAMERA, _FRAME = "camera_intrinsics.json", "frame-"
_MATRIX, _WIDTH = "intrinsic_matrix", "intrinsic_matrix_reference_dimensions_width"
_CENTER = 0.5  # of a pixel: in the matrix that of the first one is at 0, 0
_SRGB = bytes_from_linear(np.arange(256) / 255)  # of a stored colour


def find(folder: Path, names: Sequence[str]) -> RangeFrames | None:
    """A frame for each file; None where there is no such calibration."""
    frames = [name for name in names if name.startswith(_FRAME) and name.endswith(".npz")]
    if not frames or _CAMERA not in names:
        return None
    frames.sort(key=natural_key)
    camera = _intrinsics(folder / _CAMERA)
    files = [folder / name for name in frames]
    return RangeFrames(
        name=folder.resolve().name,
        labels=tuple(frames),
        read=lambda index: (_view(files[index], camera),),
        files=(*files, folder / _CAMERA),
        unit="m",
        recorded=lambda: _times(files),
    )


def _view(file: Path, camera: NDArray[np.float64]) -> RangeView:
    depth, color = read_arrays(file, "depth", "color")
    if color.dtype != np.uint8:
        raise InputError(f"array 'color' is of type {color.dtype}, expected uint8", file)
    fx, fy, cx, cy = camera * depth.shape[-1]
    return RangeView(
        depth=depth,
        mask=np.isfinite(depth),
        color=_SRGB[color],
        fx=fx,
        fy=fy,
        cx=cx + _CENTER,
        cy=cy + _CENTER,
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


def _intrinsics(file: Path) -> NDArray[np.float64]:
    """fx, fy, cx and cy in widths of the picture, (4,). Raises InputError."""
    stored = object_of(file)
    try:
        camera = np.array(stored[_MATRIX], np.float64).reshape(9)[[0, 4, 6, 7]] / float(stored[_WIDTH])
    except (ValueError, KeyError, TypeError, ZeroDivisionError) as error:
        raise InputError(f"is no calibration: {shortened(str(error))}", file) from error
    if not (np.isfinite(camera).all() and (camera > 0).all()):
        raise InputError("is no calibration: a number of its matrix is not above 0", file)
    return camera

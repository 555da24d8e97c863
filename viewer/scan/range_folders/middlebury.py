"""A stereo pair of Middlebury's: calibration.json, *_disp.npz with `disparity`, and *_left.png.

Depth is baseline * focal length / (disparity + the distance of the principal points), in millimetres. An
infinite disparity is unknown.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from ...errors import InputError, shortened
from ..formats.npz import read_arrays
from ..image_poses import UPRIGHT
from ..range_view import RangeView
from ..reading.camera import CENTER, decide_view
from ..reading.sequence import Decided
from ._pictures import read_color, size_of_image
from ._source import RangeFrames
from ._texts import object_of

TITLE = "a stereo pair of Middlebury's"

_CALIBRATION, _DISPARITY, _LEFT = "calibration.json", "_disp.npz", "_left.png"
_NUMBERS = (
    "focal_length_px", "principal_point_left_x_px", "principal_point_y_px", "principal_point_dx_px",
    "baseline_mm",
)  # fmt: skip


def find(folder: Path, names: Sequence[str], decided: Decided) -> RangeFrames | None:
    """The left view; None where there is no disparity with such a calibration."""
    pairs = [name.removesuffix(_DISPARITY) for name in names if name.endswith(_DISPARITY)]
    if len(pairs) != 1 or _CALIBRATION not in names:
        return None
    numbers = _numbers(folder / _CALIBRATION)
    (pair,) = pairs
    disparity, left = folder / f"{pair}{_DISPARITY}", folder / f"{pair}{_LEFT}"
    color = left if left.name in names else None
    files = (disparity, folder / _CALIBRATION, *([color] if color else []))

    def read(_: int) -> Iterator[RangeView]:
        yield _view(disparity, color, numbers, decided)

    return RangeFrames(folder.resolve().name, (disparity.name,), read, files, "mm")


def lacks(names: Sequence[str]) -> str:
    """The disparity, where the calibration stands without."""
    return f"the disparity picture NAME{_DISPARITY} is missing" if _CALIBRATION in names else ""


def _view(file: Path, left: Path | None, numbers: Sequence[float], decided: Decided) -> RangeView:
    (disparity,) = read_arrays(file, "disparity")
    color = None if left is None else read_color(left)
    focal, cx, cy, apart, baseline = numbers
    between = disparity.astype(np.float64) + apart
    known = np.isfinite(between) & (between > 0)
    depth = np.full(disparity.shape, np.nan, np.float32)
    depth[known] = baseline * focal / between[known]
    pinhole = {"fx": focal, "fy": focal, "cx": cx + CENTER, "cy": cy + CENTER}
    return RangeView(
        depth=depth,
        mask=known,
        color=color,
        **decide_view(pinhole, size_of_image(depth), decided, _CALIBRATION, source="neighbour"),
        world_to_camera=UPRIGHT,
        name="left",
        unit="mm",
    )


def _numbers(file: Path) -> list[float]:
    """Numbers of the calibration in their order. Raises InputError."""
    stored = object_of(file)
    try:
        return [float(stored[name]) for name in _NUMBERS]
    except (ValueError, KeyError, TypeError) as error:
        raise InputError(f"is not a calibration: {shortened(str(error))}", file) from error

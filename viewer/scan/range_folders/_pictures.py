"""Range views of pictures: depth as 16-bit PNG or TIFF; colours, mask and confidence as PNG, JPEG or TIFF."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError, Scan4DError
from ..admission import opened
from ..formats._pictures import COLOR_KINDS, DEPTH_KINDS, numbers_of_picture, opened_picture, srgb_of_picture
from ..points import UNKNOWN_UNIT
from ..range_view import RangeView, mask_of
from ..units import usable_unit
from ._calibration import Calibration

COLOR_SUFFIXES = (".png", ".jpg", ".jpeg")
DEPTH_SUFFIX = ".png"

_SIXTEEN_BITS = "I;16"  # as Pillow calls a grey picture of these
_COLORED = ("RGB", "RGBA", "LA", "P")  # likewise
_NOTHING = 65535  # beside 0: where a sensor tells that it measured none
_SIGNATURE, _SIXTEEN_BIT_GREY = (
    b"\x89PNG\r\n\x1a\n",
    b"\x10\x00",
)  # the bits and the colour type in a PNG's head
_HEAD = 26  # bytes of it


def is_depth(path: Path) -> bool:
    """Whether a file is a 16-bit grey PNG, by its first bytes."""
    try:
        with opened(path) as stream:
            head = stream.read(_HEAD)
    except (OSError, Scan4DError):
        return False
    return head.startswith(_SIGNATURE) and head.endswith(_SIXTEEN_BIT_GREY)


def read_depth(path: Path) -> NDArray:
    """The numbers of a 16-bit grey PNG, or of a TIFF, (H, W). Raises InputError."""
    with opened_picture(path, DEPTH_KINDS) as image:
        if image.format == "PNG" and not image.mode.startswith(_SIXTEEN_BITS):
            raise InputError(f"is a picture of type {image.mode}, but a depth picture must be 16-bit grey")
        return numbers_of_picture(image)


def read_color(path: Path) -> NDArray[np.uint8]:
    """The colours of a PNG, JPEG or TIFF, (H, W, 3), sRGB. Raises InputError."""
    with opened_picture(path, COLOR_KINDS) as image:
        return srgb_of_picture(image)


def read_numbers(path: Path) -> NDArray:
    """The numbers of a PNG, JPEG or TIFF, (H, W); of one in colour, its grey. Raises InputError."""
    with opened_picture(path, COLOR_KINDS) as image:
        return numbers_of_picture(image.convert("L") if image.mode in _COLORED else image)


def depth_view(
    depth: Path,
    color: Path | None,
    calibration: Calibration,
    world_to_camera: NDArray[np.float64],
    name: str = "camera",
    mask: Path | None = None,
    confidence: Path | None = None,
) -> RangeView:
    """The range view of a depth picture, and of colours, mask and confidence of the same pixels.

    Of whole numbers, 0 and 65535 mean that nothing was measured. Raises InputError.
    """
    stored = read_depth(depth)
    calibration.check_size(stored.shape[::-1], depth)
    measured = np.ones(stored.shape, bool)
    if stored.dtype.kind != "f":
        measured = (stored != 0) & (stored != _NOTHING)

    def of_same_pixels(path: Path, what: str, read: Callable[[Path], NDArray]) -> NDArray:
        image = read(path)
        if image.shape[:2] != stored.shape:
            sizes = f"has {_size(image)} pixels, but its depth picture has {_size(stored)}"
            raise InputError(sizes, path, f"{what} must have the same size")
        return image

    if mask is not None:
        measured &= mask_of(of_same_pixels(mask, "A mask", read_numbers))
    return RangeView(
        depth=stored.astype(np.float32) / np.float32(calibration.depth_scale),
        kind=calibration.kind,
        mask=measured,
        color=None if color is None else of_same_pixels(color, "Colours", read_color),
        confidence=None
        if confidence is None
        else of_same_pixels(confidence, "Confidence", read_numbers).astype(np.float32),
        fx=calibration.fx,
        fy=calibration.fy,
        cx=calibration.cx,
        cy=calibration.cy,
        distortion=calibration.distortion,
        world_to_camera=world_to_camera,
        name=name,
        unit=usable_unit(calibration.unit) or UNKNOWN_UNIT,
    )


def _size(image: NDArray) -> str:
    return f"{image.shape[1]} x {image.shape[0]}"

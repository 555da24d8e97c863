"""Depth and colours that are stored as pictures: 16-bit PNG, and PNG or JPEG."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError, Scan4DError, explained
from ..formats._admission import admit, opened, size_of
from ..range_view import RangeView
from ._calibration import Calibration

if TYPE_CHECKING:
    from PIL.Image import Image

COLOR_SUFFIXES = (".png", ".jpg", ".jpeg")
DEPTH_SUFFIX = ".png"

_SIXTEEN_BITS = "I;16"  # as Pillow calls a grey picture of these
_NOTHING = 65535  # beside 0: where a sensor tells that it measured none
_BYTES = 12  # of memory for a pixel, decoded and as a view
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


def read_depth(path: Path) -> NDArray[np.uint16]:
    """The numbers of a 16-bit grey PNG, (H, W). Raises InputError."""
    with _decoded(path, ("PNG",)) as image:
        if image.mode != _SIXTEEN_BITS:
            raise InputError(f"is a picture of type {image.mode}, where 16-bit grey tells depth")
        return np.array(image)


def read_color(path: Path) -> NDArray[np.uint8]:
    """The colours of a PNG or JPEG, (H, W, 3), sRGB. Raises InputError."""
    with _decoded(path, ("PNG", "JPEG")) as image:
        if image.mode == _SIXTEEN_BITS:
            raise InputError("is a 16-bit grey picture, where colours should be")
        return np.array(image if image.mode == "RGB" else image.convert("RGB"))


def depth_view(
    depth: Path,
    color: Path | None,
    calibration: Calibration,
    world_to_camera: NDArray[np.float64],
    name: str = "camera",
) -> RangeView:
    """The range view of a depth picture, and of the colours of the same pixels. Raises InputError.

    0 and 65535 mean that nothing was measured.
    """
    stored = read_depth(depth)
    colors = None if color is None else read_color(color)
    if colors is not None and colors.shape[:2] != stored.shape:
        what = f"has {_size(colors)} pixels, its depth {_size(stored)}"
        raise InputError(what, color, "Colours must be those of the same pixels")
    calibration.check_size(stored.shape[::-1], depth)
    return RangeView(
        depth=stored.astype(np.float32) / np.float32(calibration.depth_scale),
        kind=calibration.kind,
        mask=(stored > 0) & (stored < _NOTHING),
        color=colors,
        fx=calibration.fx,
        fy=calibration.fy,
        cx=calibration.cx,
        cy=calibration.cy,
        distortion=calibration.distortion,
        world_to_camera=world_to_camera,
        name=name,
        unit=calibration.unit,
    )


@contextmanager
def _decoded(path: Path, kinds: tuple[str, ...]) -> Iterator[Image]:
    """A picture of one of these kinds. Whatever is wrong with it is one InputError."""
    from PIL import Image

    try:
        with opened(path) as stream, Image.open(stream, formats=kinds) as image:
            admit(size_of(stream), image.width * image.height * _BYTES)
            image.load()
            yield image
    except Scan4DError as error:
        raise InputError(error.what, error.where or path, error.hint) from error
    except OSError as error:
        is_missing = error.errno is not None
        what, hint = explained(error) if is_missing else (f"is no {' or '.join(kinds)}, or damaged", None)
        raise InputError(what, path, hint) from error
    except Exception as error:  # Pillow's readers raise what they like
        raise InputError(f"is no {' or '.join(kinds)}, or damaged ({error})", path) from error


def _size(image: NDArray) -> str:
    return f"{image.shape[1]} x {image.shape[0]}"

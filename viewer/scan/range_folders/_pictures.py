"""Range views of pictures: depth as 16-bit PNG, TIFF, NPY or EXR; colours, mask and confidence as PNG, JPEG
or TIFF."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError, Scan4DError
from .. import formats
from ..admission import admit, opened, size_of
from ..formats._pictures import COLOR_KINDS, DEPTH_KINDS, numbers_of_picture, opened_picture, srgb_of_picture
from ..formats._stored import StoredArray
from ..points import UNKNOWN_UNIT
from ..pose import Scanned
from ..range_view import RangeView, mask_of
from ..reading.camera import DepthCamera, Size
from ..reading.depths import lying_over, measured_depths, over_depth, size_of_image
from ..reading.record import Decision
from ..reading.sequence import Decided
from ..units import usable_unit

COLOR_SUFFIXES = (".png", ".jpg", ".jpeg")
DEPTH_SUFFIX = ".png"
OTHER_DEPTH_SUFFIXES = (".tif", ".tiff", ".npy", ".exr", ".pgm")

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


def read_depth(path: Path, decided: Decided) -> NDArray:
    """The numbers of a 16-bit grey PNG or PGM, of a TIFF, of a NPY or of an EXR, (H, W). Raises InputError.

    Depth that an EXR has no number for is NaN.
    """
    if path.suffix.lower() == ".npy":
        return _read_npy(path)
    if path.suffix.lower() == ".exr":
        views = _views_of_exr(path, decided)
        if not isinstance(views, tuple):
            raise InputError("contains points, but Scan4D expects a depth picture here", path)
        return np.where(views[0].mask, views[0].depth, np.float32(np.nan))
    with opened_picture(path, ("PPM",) if path.suffix.lower() == ".pgm" else DEPTH_KINDS) as image:
        if image.format == "PNG" and not image.mode.startswith(_SIXTEEN_BITS):
            raise InputError(f"is a picture of type {image.mode}, but a depth picture must be 16-bit grey")
        return numbers_of_picture(image)


def _views_of_exr(path: Path, decided: Decided) -> Scanned:
    """The views of an EXR among depth pictures, where R is depth if no channel says so. Raises InputError."""
    try:
        return formats.read(path, decided=Decided(decided.corrections))
    except InputError:
        if "depth-channel" in decided.corrections:
            raise
        try:
            views = formats.read(path, decided=Decided(decided.corrections.amended({"depth-channel": "R"})))
        except InputError:
            views = None
        if views is None:
            raise
    why = "The picture lies among depth pictures, but none of its channels is called depth"
    decided.note(Decision("depth-channel", "R", "assumed", why=why, changes_numbers=True))
    return views


def _read_npy(path: Path) -> NDArray:
    """The numbers of a NPY file, (H, W). Raises InputError."""
    with formats.one_message(path, "cannot be read"), opened(path) as stream:
        array = StoredArray.open("depth", stream, size_of(stream))
        if len(array.shape) != 2 or array.dtype.kind not in "fiu":
            raise InputError(f"is {array.shape} {array.dtype}, but a depth picture is (H, W) numbers", path)
        admit(size_of(stream), array.memory())
        values = array.read()
    return values.astype(values.dtype.newbyteorder("="), copy=False)


def read_color(path: Path) -> NDArray[np.uint8]:
    """The colours of a PNG, JPEG or TIFF, (H, W, 3), sRGB. Raises InputError."""
    with opened_picture(path, COLOR_KINDS) as image:
        return srgb_of_picture(image)


def read_numbers(path: Path) -> NDArray:
    """The numbers of a PNG, JPEG or TIFF, (H, W); of one in colour, its grey. Raises InputError."""
    with opened_picture(path, COLOR_KINDS) as image:
        return numbers_of_picture(image.convert("L") if image.mode in _COLORED else image)


@dataclass(frozen=True, kw_only=True)
class ViewFiles:
    """The pictures of one range view: its depth, and perhaps its colours, mask and confidence."""

    depth: Path
    color: Path | None = None
    mask: Path | None = None
    confidence: Path | None = None


def depth_view(
    files: ViewFiles,
    camera_of: Callable[[NDArray, Size | None], DepthCamera],
    world_to_camera: NDArray[np.float64],
    decided: Decided,
    name: str = "camera",
) -> RangeView:
    """The range view of a depth picture, and of its colours, mask and confidence.

    camera_of: the camera of the stored numbers, (H, W), beside colours of this size. Pictures of another size
    with the same aspect ratio count as they lie over the depth. Of whole numbers, 0 and 65535 mean that
    nothing was measured. Raises InputError.
    """
    stored = read_depth(files.depth, decided)
    color = None if files.color is None else read_color(files.color)
    try:
        camera = camera_of(stored, None if color is None else size_of_image(color))
    except InputError as error:
        raise InputError(error.what, error.where or files.depth, error.hint) from error
    measured = measured_depths(stored, decided, () if stored.dtype.kind == "f" else (0, _NOTHING))
    measured |= stored != stored  # the depth itself says so of NaN
    if files.mask is not None:
        mask = over_depth(read_numbers(files.mask), stored)
        if mask is None:
            raise InputError("the mask has a different shape than its depth picture", files.mask)
        measured &= mask_of(mask)

    confidence = None
    if files.confidence is not None:
        confidence = lying_over(read_numbers(files.confidence), stored, "confidence", decided)
    return RangeView(
        depth=stored.astype(np.float32) / np.float32(camera.depth_scale),
        mask=measured,
        color=None if color is None else lying_over(color, stored, "colours", decided),
        confidence=None if confidence is None else confidence.astype(np.float32),
        world_to_camera=world_to_camera,
        name=name,
        unit=usable_unit(camera.unit) or UNKNOWN_UNIT,
        **camera.of_view,
    )

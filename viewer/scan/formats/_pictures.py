"""Pictures through Pillow: depth, colours and masks that are stored as PNG, JPEG or TIFF."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError, Scan4DError, explained
from ...native import LIBTIFF, unsaid
from ..admission import admit, opened, size_of
from ._stored import QUIETLY

if TYPE_CHECKING:
    from PIL.Image import Image

DEPTH_KINDS = ("PNG", "TIFF")  # as Pillow names them
COLOR_KINDS = ("PNG", "JPEG", "TIFF")
TEXTURE_KINDS = ("PNG", "JPEG", "TIFF", "BMP", "TGA", "WEBP")

_BYTES = {
    "1": 4,
    "L": 4,
    "I;16": 10,
    "RGB": 13,
}  # of memory for a pixel of a mode of Pillow's, with its copies
_MOST_BYTES = 16  # the same of all other modes
_MOST_REDUCED = 4
_MOST_RATIO = 40  # of memory to the file: flat and masked pictures pack well
_OF_NUMBERS = ("L", "I", "F", "1")  # modes of Pillow's, and those that begin with I;16
_COMPRESSED = "libtiff"  # what decodes compressed TIFF, into the machine's order of bytes
_IN_NATIVE_ORDER = {"F;32BF": "F;32NF", "I;32BS": "I;32NS", "I;32B": "I;32N", "I;16BS": "I;16NS"}
_HINT = "Check that the file is complete. Scan4D cannot read 64-bit numbers: save them with 32 bits"


@contextmanager
def opened_picture(path: Path, kinds: tuple[str, ...], reduction: int = 1) -> Iterator[Image]:
    """A picture of one of these kinds, of which the header is read and the pixels are read when asked for.

    reduction: the caller wants JPEG in that part of its width and height. Whatever is wrong with the picture
    is one InputError.
    """
    from PIL import Image

    title = " or ".join(kinds)
    try:
        # Pillow warns of odd tags and large pictures.
        with opened(path) as stream, QUIETLY, warnings.catch_warnings(action="ignore"), unsaid(LIBTIFF):
            image = Image.open(stream, formats=kinds)
            pixels = image.width * image.height // (reduction**2 if image.format == "JPEG" else 1)
            admit(size_of(stream), pixels * _BYTES.get(image.mode, _MOST_BYTES), _MOST_RATIO)
            yield image
    except Scan4DError as error:
        raise InputError(error.what, error.where or path, error.hint) from error
    except Image.DecompressionBombError as error:
        most = 2 * (Image.MAX_IMAGE_PIXELS or 0)
        raise InputError(f"has too many pixels: Scan4D reads at most {most:,}", path) from error
    except OSError as error:
        what, hint = (f"is not a valid {title} file", _HINT) if error.errno is None else explained(error)
        raise InputError(what, path, hint) from error
    except Exception as error:  # Pillow's readers raise what they like
        raise InputError(f"is not a valid {title} file ({error})", path) from error


def numbers_of_picture(image: Image) -> NDArray:
    """The numbers of a picture of one channel, (H, W), of the type that they are stored in, or a wider one.

    Raises InputError for pictures in colour.
    """
    if image.mode not in _OF_NUMBERS and not image.mode.startswith("I;16"):
        raise InputError(f"is a picture of type {image.mode}, but Scan4D needs one number per pixel here")
    tiles = getattr(image, "tile", [])  # that are still to be decoded
    for index, tile in enumerate(tiles):
        # Pillow takes what was decoded for numbers in the file's order of bytes.
        if tile[0] == _COMPRESSED and tile[3][0] in _IN_NATIVE_ORDER:
            tiles[index] = tile._replace(args=(_IN_NATIVE_ORDER[tile[3][0]], *tile[3][1:]))
    values = np.array(image)
    return values.astype(values.dtype.newbyteorder("="), copy=False)


def srgb_of_picture(image: Image) -> NDArray[np.uint8]:
    """The colours of a picture, (H, W, 3), sRGB; grey ones too. Raises InputError beyond 8 bit."""
    if image.mode in ("I", "F") or image.mode.startswith("I;16"):
        raise InputError(f"is a picture of type {image.mode}, but Scan4D needs colours here")
    return np.array(image if image.mode == "RGB" else image.convert("RGB"))


class PictureFile(NamedTuple):
    """A picture whose header is read. width, height: pixels. changed: differs where its file has changed."""

    path: Path
    width: int
    height: int
    changed: tuple[int, int]


def picture_file(path: Path) -> PictureFile:
    """Read the header of a picture of colours. Raises InputError."""
    try:
        status = path.stat()
    except OSError as error:
        what, hint = explained(error)
        raise InputError(what, path, hint) from error
    with opened_picture(path, TEXTURE_KINDS, _MOST_REDUCED) as image:
        return PictureFile(path, image.width, image.height, (status.st_mtime_ns, status.st_size))


def texture_colors(path: Path, reduction: int = 1) -> NDArray[np.uint8]:
    """The colours of a picture, (H, W, 3) sRGB, or (H, W, 4) where it is transparent in places.

    reduction: 1, 2 or 4: the picture is that much smaller on either side. Raises InputError.
    """
    with opened_picture(path, TEXTURE_KINDS, reduction) as image:
        wanted = -(-image.width // reduction), -(-image.height // reduction)
        image.draft(None, wanted)  # JPEG: what is decoded is smaller
        left = max(1, round(image.width / wanted[0]))
        colors = _of_texture(image)
        if left > 1:
            colors = colors.reduce(left)
        values = np.asarray(colors)
        return values if values.shape[2] == 3 or (values[..., 3] < 255).any() else values[..., :3]


def _of_texture(image: Image) -> Image:
    """The picture as RGB or RGBA; numbers of 16 bit are grey values."""
    from PIL import Image as images

    if image.mode.startswith("I;16") or image.mode == "I":
        return images.fromarray((np.asarray(image) // 257).clip(0, 255).astype(np.uint8)).convert("RGB")
    if image.mode == "F":
        raise InputError("is a picture of floating-point numbers, but Scan4D needs colours here")
    is_transparent = image.mode in ("RGBA", "LA", "PA", "RGBa", "La") or "transparency" in image.info
    wanted = "RGBA" if is_transparent else "RGB"
    return image if image.mode == wanted else image.convert(wanted)

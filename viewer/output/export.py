"""Writing pictures: PNG, EXR, NPZ, numbered files and contact sheets; films are in `film`.

PNG and MP4 show the picture as the look has it, with its marks; EXR and NPZ hold the Surface behind
it, unshaded and unmarked. PNG and EXR can carry a description, a text that says how they were made.
Every file takes its name only when it is complete.
"""

from __future__ import annotations

import math
import os
import re
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any
from zipfile import ZIP_DEFLATED, ZipFile
from zlib import Z_RLE

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError, MissingPackageError, explained
from ..files import open_plain, whole_file
from ..look import Look, rgba
from ..native import OPENEXR, unsaid
from .film import FILM_SUFFIX, FilmTimes, film
from .labels import LabelPlaces, covered_cells
from .legend import Legend
from .marked import marked

if TYPE_CHECKING:
    from ..picture.surface import Surface

PICTURE_SUFFIXES = (".png", ".exr", ".npz")
OUTPUT_SUFFIXES = (*PICTURE_SUFFIXES, FILM_SUFFIX)
DESCRIBED_SUFFIXES = (".png", ".exr")
UNMARKED_SUFFIXES = (".exr", ".npz")

_NUMBER = re.compile("%(0?[0-9]*)d")
_DESCRIPTION = "scan4d"  # the key of a PNG's text, the name of an EXR's attribute
_THUMBNAIL_WIDTH = 320  # pixels
_SHEET_GAP = 4  # pixels


# --- where pictures go ----------------------------------------------------------------------


def is_pattern(path: Path) -> bool:
    """Whether the name has a place for a number, such as %04d."""
    return bool(_NUMBER.search(path.name))


def numbered(pattern: Path, number: int) -> Path:
    """The file of this number: out%04d.png and 7 give out0007.png."""
    return pattern.with_name(
        _NUMBER.sub(lambda m: f"{number:{m[1]}d}" if m[1] else str(number), pattern.name)
    )


def check_output(path: Path, suffixes: Sequence[str], several: bool) -> None:
    """Raise InputError, before any work, where results cannot go to this path.

    suffixes: the known ones. several: whether there is more than one result.
    """
    suffix = path.suffix.lower()
    if suffix not in suffixes:
        what = f"cannot write '{suffix}' files" if suffix else "has no suffix, but the suffix sets the format"
        raise InputError(what, path, f"Known: {', '.join(suffixes)}")
    if not os.path.isdir(path.parent):  # which raises nothing
        raise InputError(f"there is no folder '{path.parent}'", path, "Create it first")
    if os.path.isdir(path):
        raise InputError("is a folder", path, "Name a file in it")
    places = len(_NUMBER.findall(path.name))
    film = suffix == FILM_SUFFIX
    if places > 1 or (places and film):
        raise InputError(
            "has too many number fields",
            path,
            "For a film, use no number field such as %04d in the name. For pictures, use one number field",
        )
    if several and not places and not film:
        film_hint = f" or {path.stem}{FILM_SUFFIX}" if FILM_SUFFIX in suffixes else ""
        hint = f"Use a pattern such as {path.stem}%04d{path.suffix}{film_hint}"
        raise InputError("is the name of one file, but this command writes several files", path, hint)


@contextmanager
def pictures(
    path: Path, size: tuple[int, int], times: FilmTimes | None
) -> Iterator[Callable[[Surface, int, float, str | None, Legend | None], None]]:
    """A function that writes a surface to the file, the numbered file or the film that the path names.

    It takes the surface, its number, its start in a film in seconds, its description and its legend.
    size: (width, height). times: of a film. Raises InputError where something cannot be written.
    """
    places = LabelPlaces()

    def with_places(legend: Legend | None) -> Legend | None:
        """The legend whose labels stay where they are from picture to picture."""
        return None if legend is None else replace(legend, places=places)

    if path.suffix.lower() == FILM_SUFFIX:
        with film(path, size, times or FilmTimes()) as add:
            yield lambda surface, number, start, description, legend: add(
                _marked_image(surface, with_places(legend)), start
            )
    else:
        yield lambda surface, number, start, description, legend: write_picture(
            surface, numbered(path, number), description, with_places(legend)
        )


# --- pictures -------------------------------------------------------------------------------


def write_picture(
    surface: Surface, path: Path | str, description: str | None = None, legend: Legend | None = None
) -> None:
    """Write a surface as the suffix says: .png, .exr or .npz. Raises InputError.

    description: a text that .png and .exr carry (see `read_description`). legend: of the marks on a .png.
    """
    path = Path(path)
    check_output(path, PICTURE_SUFFIXES, several=False)
    with whole_file(path) as temporary:
        match path.suffix.lower():
            case ".png":
                _write_png(_marked_image(surface, legend), temporary, description)
            case ".exr":
                _write_exr(surface, temporary, description)
            case ".npz":
                _write_npz(surface.arrays(), temporary)


def write_png(image: NDArray[np.uint8], path: Path | str, description: str | None = None) -> None:
    """Write an image, (H, W, 3 or 4) uint8 sRGB, and a text that it carries. Raises InputError."""
    with whole_file(path) as temporary:
        _write_png(image, temporary, description)


def write_arrays(arrays: dict[str, NDArray], path: Path | str) -> None:
    """Write arrays as an .npz file. Raises InputError."""
    with whole_file(path) as temporary:
        _write_npz(arrays, temporary)


def _marked_image(surface: Surface, legend: Legend | None) -> NDArray[np.uint8]:
    image = surface.image()
    if legend is None:
        return image
    return marked(image, with_hidden(legend, surface), surface.color_range, surface.value_kind)


def with_hidden(legend: Legend, surface: Surface) -> Legend:
    """The legend that knows where the surface shows the subject, and what it hides of lines and landmarks."""
    from ..analysis.pick import (
        are_seen,
    )  # here, as commands that draw nothing know this module, and no OpenGL

    if legend.overlay is None:
        return legend
    overlay = legend.overlay.with_seen(partial(are_seen, surface))
    return replace(legend, overlay=overlay, covered=covered_cells(surface))


def read_description(path: Path) -> str:
    """The description that a .png or .exr carries. Raises InputError where there is none."""
    try:
        text = (_png_texts if path.suffix.lower() == ".png" else _exr_header)(path).get(_DESCRIPTION)
    except MissingPackageError:
        raise
    except Exception as error:  # whatever a damaged picture does to a reader
        if isinstance(error, OSError) and error.errno:
            what, hint = explained(error)
            raise InputError(f"cannot be read: {what}", path, hint) from error
        raise InputError(
            "cannot be read as a picture", path, "The file is damaged, or is not a picture"
        ) from error
    if not isinstance(text, str):
        hint = "Use a picture that you saved with 'scan4d render' or in the window"
        raise InputError("does not contain the view and scan of the picture", path, hint)
    return text


def _png_texts(path: Path) -> dict[Any, Any]:
    """Without decoding the picture: ours stand before it."""
    from PIL import Image

    with warnings.catch_warnings(), open_plain(path) as file, Image.open(file, formats=["PNG"]) as image:
        warnings.simplefilter("ignore", Image.DecompressionBombWarning)
        return dict(image.info)


def _exr_header(path: Path) -> dict[str, Any]:
    import OpenEXR

    with unsaid(OPENEXR), open_plain(path) as stream, OpenEXR.File(stream, header_only=True) as file:
        return dict(file.header())


def _write_png(image: NDArray[np.uint8], path: Path, description: str | None = None) -> None:
    from PIL import Image
    from PIL.PngImagePlugin import PngInfo

    texts = PngInfo()
    if description is not None:
        texts.add_itxt(_DESCRIPTION, description)
    # Fast, and small for pictures.
    Image.fromarray(image).save(path, compress_level=1, compress_type=Z_RLE, pnginfo=texts)


def _write_exr(surface: Surface, path: Path, description: str | None = None) -> None:
    """R, G, B: linear colour, A: coverage, Z: depth; normal.X .Y .Z, value; id, level as integers,
    and octant where octants are drawn."""
    import OpenEXR

    arrays = surface.arrays()
    channels = {
        **dict(zip("RGB", np.moveaxis(arrays["color"], 2, 0), strict=True)),
        "A": arrays["coverage"],
        "Z": arrays["depth"],
        **{f"normal.{axis}": arrays["normal"][..., i] for i, axis in enumerate("XYZ")},
        "value": arrays["value"],
        "id": arrays["id"],
        "level": arrays["level"].astype(np.uint32),
    }
    if "octant" in arrays:
        channels["octant"] = arrays["octant"]
    if "averaged" in arrays:
        channels["averaged"] = arrays["averaged"].astype(np.uint32)
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    if description is not None:
        header[_DESCRIPTION] = description
    contiguous = {name: np.ascontiguousarray(channel) for name, channel in channels.items()}
    with open(path, "wb") as stream:  # by a stream, failures come as OSError
        OpenEXR.File(header, contiguous).write(stream)


def _write_npz(arrays: dict[str, NDArray], path: Path) -> None:
    # numpy packs at level 6: several times as long, for a tenth less.
    with ZipFile(path, "w", ZIP_DEFLATED, compresslevel=1) as archive:
        for name, array in arrays.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
                np.lib.format.write_array(member, array, allow_pickle=False)


# --- contact sheets -------------------------------------------------------------------------


def thumbnail(image: NDArray[np.uint8], width: int = _THUMBNAIL_WIDTH) -> NDArray[np.uint8]:
    """The image (H, W, 4) uint8, scaled down to this width if it is wider."""
    from PIL import Image

    if image.shape[1] <= width:
        return image
    height = max(1, round(image.shape[0] * width / image.shape[1]))
    return np.asarray(Image.fromarray(image).resize((width, height), Image.Resampling.BOX))


def contact_sheet(images: Sequence[NDArray[np.uint8]], path: Path | str) -> None:
    """Write images of one size, (H, W, 4) uint8, in rows on one PNG. Raises InputError."""
    columns = math.ceil(math.sqrt(len(images)))
    height, width = (n + _SHEET_GAP for n in images[0].shape[:2])
    rows = math.ceil(len(images) / columns)
    sheet = np.full(
        (rows * height + _SHEET_GAP, columns * width + _SHEET_GAP, 4), rgba(Look().background), np.uint8
    )
    for place, image in enumerate(images):
        top, left = (place // columns) * height + _SHEET_GAP, (place % columns) * width + _SHEET_GAP
        sheet[top : top + image.shape[0], left : left + image.shape[1]] = image
    write_png(sheet, path)

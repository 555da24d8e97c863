"""Textures: whether the pictures that a mesh names give its points their colours, and how."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ..contents import PointContents, TextureContents
from ..texture import TexturedCorners, vertex_colors
from .record import Decision
from .sequence import Decided

KEY = "texture"
_COLORS = ("red", "green", "blue")


def paint(contents: PointContents, decided: Decided, read_picture: Callable[[Path], NDArray]) -> None:
    """Give the points the colours of their texture, as columns, where they have no colours of their own.

    read_picture: reads (H, W, 3) sRGB bytes, and raises InputError. A picture that is missing or damaged is
    reported, and its material's colour stands in for it.
    """
    texture = contents.texture
    if texture is None or not any(texture.images):
        return
    names = ", ".join(dict.fromkeys(image.name for image in texture.images if image is not None))
    stated = decided.corrections.get(KEY)
    if stated == "none":
        decided.note(Decision(KEY, "none", "user", "--read"))
        return
    if stated is None and set(_COLORS) <= {name.lower() for name in contents.columns}:
        why = "The vertices have colors of their own"
        decided.note(Decision(KEY, "none", "assumed", names, why, ("vertices",)))
        decided.note_unused(f"texture {names}")
        return
    images = [_picture(image, read_picture, decided) for image in texture.images]
    if all(image is None for image in images):
        decided.note(Decision(KEY, "none", "assumed", names, "Scan4D cannot read its pictures"))
        return
    for name in [name for name in contents.columns if name.lower() in _COLORS]:
        del contents.columns[name]
    count = len(next(iter(contents.columns.values())))
    painted = vertex_colors(_corners(texture), images, texture.colors, count)
    contents.columns.update(zip(_COLORS, painted.T, strict=True))
    if stated == "vertices":
        decided.note(Decision(KEY, "vertices", "user", "--read"))
    else:
        why = "Each vertex has the color of the texture there"
        decided.note(Decision(KEY, "vertices", "neighbour", names, why))


def _picture(
    image: Path | None, read_picture: Callable[[Path], NDArray], decided: Decided
) -> NDArray[np.uint8] | None:
    if image is None:
        return None
    try:
        return read_picture(image)
    except InputError as error:
        decided.report("assumed", f"Scan4D cannot read the texture {image.name}: {error.what}")
        return None


def _corners(texture: TextureContents) -> TexturedCorners:
    """The corners with their positions in the texture."""
    uv = np.full((len(texture.corners), 2), np.nan)
    known = (texture.corners >= 0) & (texture.corners < len(texture.uv))
    uv[known] = texture.uv[texture.corners[known]]
    return TexturedCorners(texture.vertices, uv, texture.materials)

"""Textures of meshes: the colours that pictures give the vertices."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

_AT_ONCE = 1 << 18  # corners sampled together


@dataclass(frozen=True, eq=False)
class TexturedCorners:
    """Corners of faces, and where the texture of each is.

    vertices:  (C,) int64, rows of points
    uv:        (C, 2) float64, v up; NaN where a corner has none
    materials: (C,) int64, -1 where a corner has none
    """

    vertices: NDArray[np.int64]
    uv: NDArray[np.float64]
    materials: NDArray[np.int64]


def sampled(image: NDArray[np.uint8], uv: NDArray[np.float64]) -> NDArray[np.float64]:
    """Colours of a picture, (H, W, 3) sRGB, at positions (K, 2), bilinear between the middles of pixels.

    u points right and v up, both from 0 to 1; positions beyond repeat the picture. Returns (K, 3), 0..255.
    """
    height, width = image.shape[:2]
    beyond = (uv < 0) | (uv > 1)
    within = np.where(beyond, uv - np.floor(uv), uv)
    x = np.clip(within[:, 0] * width - 0.5, 0, width - 1)
    y = np.clip((1 - within[:, 1]) * height - 0.5, 0, height - 1)
    left, top = x.astype(np.intp), y.astype(np.intp)
    right, bottom = np.minimum(left + 1, width - 1), np.minimum(top + 1, height - 1)
    to_right, down = (x - left)[:, None], (y - top)[:, None]
    above = image[top, left] * (1 - to_right) + image[top, right] * to_right
    below = image[bottom, left] * (1 - to_right) + image[bottom, right] * to_right
    return above * (1 - down) + below * down


def vertex_colors(
    corners: TexturedCorners,
    images: Sequence[NDArray[np.uint8] | None],
    colors: NDArray[np.float64],
    count: int,
) -> NDArray[np.uint8]:
    """The colours of so many vertices, (count, 3) sRGB: the mean of those at their corners.

    images: a picture a material, None where it has none: there its colour counts, colors (M, 3) in 0..1.
    Vertices without a textured corner are white.
    """
    sums, found = np.zeros((count, 3)), np.zeros(count)
    is_usable = (corners.vertices >= 0) & (corners.vertices < count) & (corners.materials >= 0)
    for material, image in enumerate(images):
        own = np.flatnonzero(is_usable & (corners.materials == material))
        if image is not None:
            own = own[np.isfinite(corners.uv[own]).all(axis=1)]
        for start in range(0, len(own), _AT_ONCE):
            part = own[start : start + _AT_ONCE]
            shown = (
                np.broadcast_to(colors[material] * 255, (len(part), 3))
                if image is None
                else sampled(image, corners.uv[part])
            )
            vertices = corners.vertices[part]
            found += np.bincount(vertices, minlength=count)
            for channel in range(3):
                sums[:, channel] += np.bincount(vertices, shown[:, channel], count)
    mean = np.where(found[:, None] > 0, sums / np.maximum(found, 1)[:, None], 255)
    return np.rint(np.clip(mean, 0, 255)).astype(np.uint8)

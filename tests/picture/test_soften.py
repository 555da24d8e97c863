"""Softened pictures, against the same in numpy."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from scenes import looking_down_z
from test_filled import slope

from viewer.picture.soften import soften
from viewer.picture.surface import Surface

Draw = Callable[..., Surface]
CAMERA = looking_down_z(fov_y=2 * np.degrees(np.arctan(1 / 4)))
SKIN, DARK = 0xFF80A0D0, 0xFF101820  # words of pictures
NEAR, FAR = 4.0, 40.0


def around(values: NDArray) -> NDArray:
    """(H, W, 9): each pixel and the eight around it; at edges they are the edge's."""
    return sliding_window_view(np.pad(values, 1, mode="edge"), (3, 3)).reshape(*values.shape, 9)


def softened(picture: NDArray, depth: NDArray, scale: float) -> NDArray[np.uint8]:
    """The plain version of `soften`. picture: (H, W, 4) bytes."""
    front = depth - np.where(np.isfinite(depth), 8 * depth / scale, 0)
    nearer = around(depth) < front[..., None]
    count = nearer.sum(axis=2)
    channels = []
    for channel in np.moveaxis(picture.astype(int), 2, 0):
        mean = (around(channel) * nearer).sum(axis=2) // np.maximum(count, 1)
        closed = np.where(count >= 7, mean, channel)
        channels.append((around(closed) @ np.array([1, 2, 1, 2, 4, 2, 1, 2, 1]) + 8) // 16)
    return np.stack(channels, axis=2).astype(np.uint8)


def soft(surface: Surface, words: NDArray, depth: NDArray) -> NDArray[np.uint8]:
    """The picture of a surface after softening, when it shows these."""
    surface.depths.buffer.write(depth.astype(np.float32).tobytes())
    surface.picture.write(words.astype(np.uint32).tobytes())
    soften(surface)
    return surface.image()


@pytest.mark.parametrize("size", [(61, 43), (1, 1), (16, 9), (17, 2), (33, 70)])
def test_it_is_the_mean_of_what_is_around_without_holes(draw: Draw, size: tuple[int, int]) -> None:
    surface = draw(slope(), CAMERA, size)
    rng = np.random.default_rng(3)
    words = rng.integers(0, 2**32, size[::-1], np.uint32)
    depth = rng.choice([NEAR, NEAR, NEAR, NEAR, NEAR, NEAR, NEAR, FAR, np.inf], size[::-1])
    picture = words.view(np.uint8).reshape(*size[::-1], 4)
    expected = softened(picture, depth, surface.view.scale)
    np.testing.assert_array_equal(soft(surface, words, depth), expected)


def test_holes_between_splats_go_and_lines_stay(draw: Draw) -> None:
    surface = draw(slope(), CAMERA, (40, 30))
    words, depth = np.full((30, 40), SKIN), np.full((30, 40), NEAR)
    bytes_of_skin = np.array([SKIN], np.uint32).view(np.uint8)
    for y, x in ((5, 5), (5, 20), (5, 21), (0, 30)):  # one hole, two side by side, one at the edge
        words[y, x], depth[y, x] = DARK, FAR
    depth[0, 30] = np.inf
    assert (soft(surface, words, depth) == bytes_of_skin).all()
    words[15], depth[15] = DARK, FAR
    assert (soft(surface, words, depth)[15, :, 0] < 0.7 * bytes_of_skin[0]).all(), "a line is no hole"

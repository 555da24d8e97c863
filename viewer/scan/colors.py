"""Colours between the 8-bit sRGB of files and points and the linear half that range views may have.

Every 8-bit value survives the conversion to half and back.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from ..srgb import bytes_from_linear, linear_from_bytes


def linear_from_srgb8(colors: NDArray[np.uint8]) -> NDArray[np.float16]:
    """Linear colours 0..1 of sRGB colours, any shape."""
    return _linear_table()[colors]


def srgb8(colors: NDArray) -> NDArray[np.uint8]:
    """sRGB colours of what a range view has, 8 bit as they are or linear half, any shape."""
    return colors if colors.dtype == np.uint8 else srgb8_from_linear(colors)


def srgb8_from_linear(colors: NDArray[np.float16]) -> NDArray[np.uint8]:
    """sRGB colours of linear ones, any shape; what is outside 0..1 is clipped, NaN is black."""
    return _srgb8_table()[np.ascontiguousarray(colors).view(np.uint16)]


@cache
def _linear_table() -> NDArray[np.float16]:
    return linear_from_bytes(np.arange(256, dtype=np.uint8)).astype(np.float16)


@cache
def _srgb8_table() -> NDArray[np.uint8]:
    """A table by the bits of a half: a look-up is many times faster than a power for each pixel."""
    with np.errstate(invalid="ignore"):  # of signalling NaN
        linear = np.arange(1 << 16, dtype=np.uint16).view(np.float16).astype(np.float64)
    return bytes_from_linear(np.nan_to_num(linear))

"""Colours on the scales of files, in the 8-bit sRGB of points and the linear half that range views may have.

Every 8-bit value survives the conversion to half and back, and those to 16 bit: times 256 and times 257.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from ..srgb import bytes_from_linear, linear_from_bytes

_CHUNK = 1 << 18  # points converted at a time
_BITS_16 = 65535
_FULL_BY_KIND = {"b": 1, "f": 1}


def full_scale(colors: NDArray) -> int:
    """The value of full brightness that a type has by itself: 1 of floats, 65535 of 16 bit, else 255."""
    return _FULL_BY_KIND.get(colors.dtype.kind, _BITS_16 if colors.dtype == np.uint16 else 255)


def rgba8(colors: NDArray, full: int) -> NDArray[np.uint8]:
    """Colours (N, 3 or 4) of any real type with this value of full brightness as 8 bit, (N, 4).

    Alpha is 255 where there is none, NaN is 0, what exceeds the scale is clipped, and values are rounded.
    """
    if colors.dtype == np.uint8 and full == 255 and colors.shape[1] == 4:
        return np.ascontiguousarray(colors)
    rgba = np.full((len(colors), 4), 255, np.uint8)
    for start in range(0, len(colors), _CHUNK):
        part = _bytes_of(colors[start : start + _CHUNK], full)
        for channel in range(part.shape[1]):  # by columns: numpy is slow along the short axis
            rgba[start : start + _CHUNK, channel] = part[:, channel]
    return rgba


def _bytes_of(values: NDArray, full: int) -> NDArray:
    """Values of any shape on the scale 0..255, as whole numbers of any type."""
    if values.dtype == np.uint8 and full == 255:
        return values
    if values.dtype.kind == "f":
        kind = values.dtype if full == 255 else np.float32
        return np.rint(
            np.clip(np.nan_to_num(values.astype(kind, copy=False)), 0, full) * np.float32(255 / full)
        )
    if values.dtype == np.uint16 and full == _BITS_16:
        return _bytes_of_16_bit()[values]
    values = np.clip(values.astype(np.int64), 0, full)
    return _bytes_of_16_bit()[values] if full == _BITS_16 else values * (255 // full)


@cache
def _bytes_of_16_bit() -> NDArray[np.uint8]:
    """Bytes by 16-bit values: the nearest, c for both 256 c and 257 c."""
    values = np.arange(_BITS_16 + 1)
    return np.maximum(values >> 8, np.rint(values / 257).astype(int)).astype(np.uint8)


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

"""sRGB (IEC 61966-2-1): between encoded colours, as files and screens have them, and linear ones.

shaders/common/color.glsl does the same with the same numbers.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

SLOPE = 12.92  # of the linear part, up to LINEAR_KNEE or ENCODED_KNEE
OFFSET, SCALE, POWER = 0.055, 1.055, 2.4  # of the part above
LINEAR_KNEE, ENCODED_KNEE = 0.0031308, 0.04045


def linear_from_bytes(encoded: NDArray[np.uint8]) -> NDArray[np.float64]:
    """Linear colours 0..1 of sRGB bytes, any shape."""
    return _LINEAR[encoded]


def bytes_from_linear(linear: NDArray[np.floating]) -> NDArray[np.uint8]:
    """sRGB bytes of linear colours, any shape; what is outside 0..1 is clipped."""
    c = np.clip(np.asarray(linear, np.float64), 0, 1)
    encoded = np.where(c > LINEAR_KNEE, SCALE * c ** (1 / POWER) - OFFSET, c * SLOPE)
    return np.rint(encoded * 255).astype(np.uint8)


def _linear_table() -> NDArray[np.float64]:
    c = np.arange(256) / 255
    return np.where(c > ENCODED_KNEE, ((c + OFFSET) / SCALE) ** POWER, c / SLOPE)


_LINEAR = _linear_table()

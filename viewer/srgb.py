"""sRGB (IEC 61966-2-1): between encoded colours, as files and screens have them, and linear ones.

shaders/common/color.glsl does the same with the same numbers.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

SLOPE = 12.92  # of the linear part, up to LINEAR_KNEE or ENCODED_KNEE
OFFSET, SCALE, POWER = 0.055, 1.055, 2.4  # of the part above
LINEAR_KNEE, ENCODED_KNEE = 0.0031308, 0.04045
# Colours that are added up are whole steps of linear light, so that sums are exact: as few steps as keep
# neighbouring levels apart where they are dark. Roots are light's square roots, which need fewer bits.
LIGHT_STEPS, LIGHT_ROOTS = 4095, 1023
LIGHT_PARTS = 16  # of a step, to which means of pictures are rounded before they become bytes


def linear_from_bytes(encoded: NDArray[np.uint8]) -> NDArray[np.float64]:
    """Linear colours 0..1 of sRGB bytes, any shape."""
    return _LINEAR[encoded]


def bytes_from_linear(linear: NDArray[np.floating]) -> NDArray[np.uint8]:
    """sRGB bytes of linear colours, any shape; what is outside 0..1 is clipped."""
    c = np.clip(np.asarray(linear, np.float64), 0, 1)
    encoded = np.where(c > LINEAR_KNEE, SCALE * c ** (1 / POWER) - OFFSET, c * SLOPE)
    return np.rint(encoded * 255).astype(np.uint8)


def roots_from_bytes(encoded: NDArray[np.uint8]) -> NDArray[np.uint16]:
    """Square roots of the linear light of sRGB bytes, any shape, 0..LIGHT_ROOTS."""
    return _ROOTS[encoded]


def light_from_bytes(encoded: NDArray[np.uint8]) -> NDArray[np.uint16]:
    """Linear light of sRGB bytes, any shape, 0..LIGHT_STEPS: whole steps, whose sums are exact.

    `bytes_from_light` turns each level back into itself; a mean is off by less than half a level before it
    is rounded to one.
    """
    return _LIGHT[encoded]


def bytes_from_light(light: NDArray[np.floating]) -> NDArray[np.uint8]:
    """sRGB bytes of means of what `light_from_bytes` gives, any shape."""
    return bytes_from_linear(np.asarray(light, np.float64) / LIGHT_STEPS)


def _linear_table() -> NDArray[np.float64]:
    c = np.arange(256) / 255
    return np.where(c > ENCODED_KNEE, ((c + OFFSET) / SCALE) ** POWER, c / SLOPE)


_LINEAR = _linear_table()
_ROOTS = np.rint(np.sqrt(_LINEAR) * LIGHT_ROOTS).astype(np.uint16)
_LIGHT = np.rint(_ROOTS.astype(float) ** 2 * (LIGHT_STEPS / LIGHT_ROOTS**2)).astype(np.uint16)

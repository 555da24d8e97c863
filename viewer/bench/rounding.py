"""What OpenGL leaves to a driver in the last bits: how far off hardware may be where nothing is wrong."""

from __future__ import annotations

from dataclasses import dataclass

from ..gpu.context import Gpu


@dataclass(frozen=True)
class Rounding:
    """How far off a GPU's numbers may be.

    quotient: units in the last place of a quotient or an inverse root; 0.5: as near as float32 comes.
    corner: pixels, along x and along y, by which the rasteriser moves the corners of what it draws. Depth and
    all else is interpolated between corners so moved, so that within a triangle each position is moved by no
    more: depth changes by the surface's slope times it, and a border lies as far beside.
    """

    quotient: float
    corner: float

    @classmethod
    def of(cls, gpu: Gpu) -> Rounding:
        """Rounding by a GPU: of hardware what the specification leaves to it, 2.5 units (GLSL 4.50, 4.7.1),
        and half a step of the grid that corners are moved to, of GL_SUBPIXEL_BITS. Mesa's software drivers
        divide exactly, and interpolate between corners where they are."""
        if gpu.software:
            return IN_SOFTWARE
        return cls(2.5, half_step(gpu))

    @property
    def roundings(self) -> float:
        """The roundings of float32 that a quotient counts for."""
        return max(self.quotient, 1.0)


def half_step(gpu: Gpu) -> float:
    """Half a step of the grid that a rasteriser moves points and corners to, pixels; in software as well."""
    return float(0.5 ** (gpu.ctx.info["GL_SUBPIXEL_BITS"] + 1))


IN_SOFTWARE = Rounding(0.5, 0.0)

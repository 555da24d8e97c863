"""Terrains: grids of heights over the ground, as range views seen from straight above."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..rigid import rigid_matrix
from .range_view import RangeView
from .units import conversion

METRE = "m"


@dataclass(frozen=True, kw_only=True)
class Ground:
    """The ground below a grid of heights: the corner of its first cell, and the steps from cell to cell.

    left: x of the first column's outer edge, first: y of the first row's. right: how x grows with a column,
    down: how y grows with a row, so below 0 where the first row is the northern one. degrees: whether all
    that is longitude and latitude, else it is in the unit of the heights. unit: of the heights.
    """

    left: float
    first: float
    right: float
    down: float
    degrees: bool
    unit: str

    @property
    def turned(self) -> tuple[slice, slice]:
        """Rows and columns in the order in which the northern row and the western column come first."""
        return slice(None, None, -1 if self.down > 0 else 1), slice(None, None, -1 if self.right < 0 else 1)


def metres_of_a_degree(latitude: float) -> tuple[float, float]:
    """Metres of a degree of longitude and of latitude, there, on the WGS84 ellipsoid.

    latitude: degrees. The usual series in cosines, good to a decimetre.
    """
    angle = math.radians(latitude)
    east = 111_412.84 * math.cos(angle) - 93.5 * math.cos(3 * angle) + 0.118 * math.cos(5 * angle)
    north = (
        111_132.92 - 559.82 * math.cos(2 * angle) + 1.175 * math.cos(4 * angle) - 0.0023 * math.cos(6 * angle)
    )
    return east, north


def terrain_view(heights: NDArray, there: NDArray[np.bool_], ground: Ground, name: str) -> RangeView:
    """The range view of heights (H, W) of any real type: x is east, y north and z up, in the heights' unit.

    there: (H, W), False where nothing is known. Degrees become lengths by those of a degree in the middle of
    the grid, which then is at 0, 0. Raises InputError for a grid of no extent, and for degrees beside heights
    of an unknown unit.
    """
    rows, columns = heights.shape
    x, y = ground.left + ground.right * columns / 2, ground.first + ground.down * rows / 2
    right, down = ground.right, ground.down
    if not (np.isfinite([x, y]).all() and right and down):
        raise InputError(
            f"the cells have the unusable size {right:g} x {down:g}, starting at {ground.left:g}, "
            f"{ground.first:g}"
        )
    if ground.degrees:
        if abs(y) >= 90:
            raise InputError(f"the centre of the terrain is at {y:g} degrees of latitude")
        metre = conversion(METRE, ground.unit)
        if metre is None:
            raise InputError(
                f"the heights are in '{ground.unit}', but the ground coordinates are in degrees",
                hint="Convert the heights into metres",
            )
        east, north = metres_of_a_degree(y)
        x, y, right, down = 0.0, 0.0, right * east * metre, down * north * metre
    return RangeView(
        kind="height",
        depth=np.negative(heights[ground.turned], dtype=np.float32),
        mask=there[ground.turned].copy(),
        fx=1 / abs(right),
        fy=1 / abs(down),
        cx=columns / 2,
        cy=rows / 2,
        world_to_camera=rigid_matrix(np.eye(3), np.array([-x, -y, 0.0])),
        name=name,
        unit=ground.unit,
    )

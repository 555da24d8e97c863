"""Grids over a picture: small cells that points are listed by, and coarse ones for what is known around."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...scan.points import PointCloud
from ...scan.spacing import sparse_spacing
from ...view import View

if TYPE_CHECKING:
    from .neighborhoods import Search

FINEST_COARSE, COARSEST = 4, 7  # shifts of coarse cells: 16 to 128 pixels
_COARSEST_FINE = 4
_FINE = 0.7  # edge of fine cells, in typical radii
_SAMPLE = 4096  # points that tell how large splats are beside the picture
_WIDEST_BORDER, _BORDER_STEP = 512, 16  # pixels


@dataclass(frozen=True)
class Grids:
    """The grids, and what else their shaders read (shaders/auto_splats/place.glsl).

    Sizes are numbers of cells; a shift is the power of two that a cell has pixels along an edge. margin:
    pixels round the picture whose points take part. unit: factor on positions, a power of two.
    border: pixels round the picture shown that the picture of these grids has more, at each edge.
    typical: radius of neighborhoods as points are dense in the picture, pixels; typical_in_space: as they are
    over a body of the scan's size, a rough one, scan units; widest: from which on splats grow no more, scan
    units. culls, growth, alone, drops, noise: as `Search` has them. sweeps: of rotations, by which
    eigenvectors are found.
    """

    fine_size: tuple[int, int]
    coarse_size: tuple[int, int]
    fine_shift: int
    coarse_shift: int
    margin: int
    border: int
    culls: bool
    growth: float
    alone: float
    drops: bool
    noise: float
    unit: float
    typical: float = 1.0
    typical_in_space: float = 0.0
    widest: float = 0.0
    sweeps: int = 5

    @classmethod
    def of(
        cls,
        size: tuple[int, int],
        coarse_shift: int,
        search: Search,
        unit: float = 1.0,
        border: int = 0,
    ) -> Grids:
        """The grids over a picture of a size, pixels, with its border, before anything typical is known."""
        margin = 1 << coarse_shift
        fine, coarse = _cells(size, margin, 0), _cells(size, margin, coarse_shift)
        rules = search.culls, search.growth, search.alone, search.drops, search.noise
        return cls(fine, coarse, 0, coarse_shift, margin, border, *rules, unit)

    def refined(self, size: tuple[int, int], typical: float, in_space: float, widest: float) -> Grids:
        """The grids with fine cells for typical neighborhoods. typical, in_space, widest: as above."""
        shift = min(max(round(math.log2(_FINE * typical)), 0), _COARSEST_FINE)
        return replace(
            self,
            fine_size=_cells(size, self.margin, shift),
            fine_shift=shift,
            typical=typical,
            typical_in_space=in_space,
            widest=widest,
        )

    @property
    def fine_cells(self) -> int:
        """How many fine cells there are."""
        return math.prod(self.fine_size)

    @property
    def coarse_cells(self) -> int:
        """How many coarse cells there are."""
        return math.prod(self.coarse_size)


def _cells(size: tuple[int, int], margin: int, shift: int) -> tuple[int, int]:
    x, y = (-(-(pixels + 2 * margin) >> shift) for pixels in size)
    return x, y


def border_of(cloud: PointCloud, view: View, k: int) -> int:
    """How far beside a picture points lie whose splats may reach into it, pixels: the radius of neighborhoods
    of k where points are sparse, as large as it is seen of those in the picture and beside; of those nearest
    to it where a sample has none there. At most 512."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):  # in the eye's plane
        pixels, depth = view.project(cloud.remember(_sample_of) + (cloud.origin - view.origin))
        radius = sparse_spacing(cloud) * math.sqrt(k / math.pi) * view.scale
        radii = radius / depth if view.perspective else np.full(len(depth), radius)
        (x, y), (width, height) = pixels.T, view.size
        beside = np.maximum(np.maximum(-x, x - width), np.maximum(-y, y - height))
        beside = np.maximum(beside, 0)
    shown = (depth >= view.near) & (depth <= view.far) & np.isfinite(beside)
    if not shown.any():
        return 0
    near = shown & (beside <= radii)
    if not near.any():
        near = shown & (beside == beside[shown].min())
    wanted = min(float(np.quantile(radii[near], 0.9)), _WIDEST_BORDER)
    return _BORDER_STEP * math.ceil(wanted / _BORDER_STEP)


def foresee_border(cloud: PointCloud) -> None:
    """Find the facts that `border_of` reads (`Backend.foresee`)."""
    cloud.remember(_sample_of)
    sparse_spacing(cloud)


def _sample_of(cloud: PointCloud) -> NDArray[np.float32]:
    """Positions of some points, spread evenly over the file, (n, 3) relative to the cloud's origin."""
    rows = np.linspace(0, len(cloud) - 1, min(len(cloud), _SAMPLE)).astype(int)
    return cloud.positions[rows]

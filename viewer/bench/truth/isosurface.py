"""Implicit surfaces as meshes."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ...mesh.scene import Rays
from ...scan.faces import Triangles

_SKIPPED = 4  # lines from one of the coarse grid to the next

Lines = tuple[
    NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]
]  # ascending positions along x, y, z


def isosurface(grid: NDArray[np.float32], lines: Lines) -> tuple[Rays, Triangles]:
    """Vertices (V, 3) and faces (F, 3) of where values on a grid are zero.

    Marching cubes (Lewiner et al. 2003). grid: (X, Y, Z), negative inside, NaN: no surface near. lines: where
    its planes cross the axes; they need not be evenly spaced. Faces run counterclockwise seen from outside.
    """
    from skimage.measure import marching_cubes

    known = np.isfinite(grid)
    at, faces, _, _ = marching_cubes(
        np.where(known, grid, 1), 0.0, gradient_direction="descent", mask=known, allow_degenerate=False
    )
    positions = [
        np.interp(column, np.arange(len(line)), line) for column, line in zip(at.T, lines, strict=True)
    ]
    return np.stack(positions, axis=1), faces.astype(np.uint32)


def grid_values(
    values: Callable[[Rays], NDArray[np.floating]], lines: Lines, reach: float
) -> NDArray[np.float32]:
    """The values of a function at the points of a grid, (X, Y, Z), those near zero exactly.

    values: of points (N, 3). reach: where the value at a point of a grid four times as coarse is larger than
    this, it stands for the values around it: twice the coarse cell's diagonal is safe for a distance.
    """
    x, y, z = (line[::_SKIPPED] for line in lines)
    coarse = values(np.stack(np.meshgrid(x, y, z, indexing="ij"), axis=-1).reshape(-1, 3))
    grid = coarse.reshape(len(x), len(y), len(z)).astype(np.float32)
    for axis, line in enumerate(lines):
        grid = grid.take(np.arange(len(line)) // _SKIPPED, axis)
    near = np.nonzero(np.abs(grid) < reach)
    grid[near] = values(np.stack([line[rows] for line, rows in zip(lines, near, strict=True)], axis=1))
    return grid

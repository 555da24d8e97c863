"""Organised grids of points as range views: the parallel calibration that fits them best."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ..range_view import RangeView

_FLATTEST = 1e-3  # of the second direction that a grid needs


def view_of_grid(grid: NDArray[np.floating], to_grid: NDArray[np.float64], name: str, unit: str) -> RangeView:
    """The range view of measured points, a height field over the plane that its rows and columns go along.

    grid: (H, W, 3), the top row first, seen from the side where its columns go to the right; not finite: no
    sample. to_grid: (4, 4) from the world to the grid's coordinates. Its x and y are kept as measured. The
    calibration is the parallel one that fits rows and columns best, which a scanner's optics leave by some
    pixels. Raises InputError where the points lie along a line.
    """
    valid = np.isfinite(grid).all(axis=2)
    row, column = np.nonzero(valid)
    points = grid[valid].astype(np.float64)
    axes = _axes(points, column, row)
    in_camera = points @ axes.T
    fx, cx = _line(in_camera[:, 0], column + 0.5)
    fy, cy = _line(-in_camera[:, 1], row + 0.5)
    depth, xy = np.full(valid.shape, np.nan, np.float32), np.full((*valid.shape, 2), np.nan, np.float32)
    depth[valid], xy[valid] = -in_camera[:, 2], in_camera[:, :2]
    turn = np.eye(4)
    turn[:3, :3] = axes
    return RangeView(
        kind="height",
        depth=depth,
        mask=valid,
        xy=xy,
        fx=fx,
        fy=fy,
        cx=cx,
        cy=cy,
        world_to_camera=turn @ to_grid,
        name=name,
        unit=unit,
    )


def _axes(
    points: NDArray[np.float64], column: NDArray[np.integer], row: NDArray[np.integer]
) -> NDArray[np.float64]:
    """A camera's axes as rows (3, 3), right, up and back: those perpendicular ones along which the grid goes.

    What a scanner calls a column may go along a slanted plane: the fit finds the direction in which all
    points of a pixel lie behind each other.
    """
    pixels = np.stack([column, -row], axis=1).astype(np.float64)
    if len(points) < 3:
        raise InputError(f"has {len(points)} points, too few for a surface")
    slopes = np.linalg.lstsq(points - points.mean(axis=0), pixels - pixels.mean(axis=0))[0].T
    lengths = np.linalg.norm(slopes, axis=1, keepdims=True)
    left, sizes, right = np.linalg.svd(slopes / np.where(lengths > 0, lengths, 1), full_matrices=False)
    if sizes[1] < _FLATTEST:
        raise InputError("its points lie along a line, which is no surface")
    x, y = left @ right
    return np.stack([x, y, np.cross(x, y)])


def _line(lengths: NDArray[np.floating], pixels: NDArray[np.floating]) -> tuple[float, float]:
    """Pixels per unit of length, and the pixel at 0."""
    middle, center = lengths.mean(), pixels.mean()
    slope = float(((lengths - middle) @ (pixels - center)) / np.square(lengths - middle).sum())
    return slope, float(center - slope * middle)

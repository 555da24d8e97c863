"""Organised grids of points as range views: the calibration, a pinhole's or parallel, that fits them best."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..rigid import rigid_matrix
from .range_view import RangeView

_FLATTEST = 1e-3  # of the second direction that a grid needs
_ROUNDED = 1e-5  # of depth: how far from a pixel's ray points may be where the rays stand for them
_SAMPLE = 1 << 16  # points that the pinhole is fitted to
_AT_ONCE = 1 << 17  # points looked at together
_FEWEST = 16  # points, that tell a camera
_MOST_APART = 0.01  # of the longer edge: how far from a camera's rays, in the median, points are at most


def view_of_camera(
    grid: NDArray[np.floating], world_to_camera: NDArray[np.float64], name: str, unit: str
) -> RangeView | None:
    """The range view of points that a camera has measured, or None where no pinhole has these in its pixels.

    grid: (H, W, 3) in the image's axes (x right, y down, z ahead), the top row first; not finite: no sample.
    The pinhole is fitted by least squares. Where its rays do not meet all points up to rounding, x and y are
    stored as measured.
    """
    valid = np.isfinite(grid).all(axis=2)
    seen = np.flatnonzero(valid)
    if len(seen) < _FEWEST or not (grid[..., 2][valid] > 0).all():
        return None
    some = np.unravel_index(seen[:: max(1, len(seen) // _SAMPLE)], valid.shape)
    points = grid[some].astype(np.float64)
    rays = points[:, :2] / points[:, 2:]
    if not (np.ptp(rays, axis=0) > 0).all():
        return None
    row, column = some
    (fx, cx), (fy, cy) = _line(rays[:, 0], column + 0.5), _line(rays[:, 1], row + 0.5)
    pinhole = fx, fy, cx, cy
    apart = np.median(_apart(points, row, column, pinhole))
    if min(fx, fy) <= 0 or not apart <= _MOST_APART * max(valid.shape):
        return None
    xy = None
    if _farthest(grid, valid, pinhole) > _ROUNDED * min(fx, fy):
        xy = np.where(valid[..., None], grid[..., :2], np.nan).astype(np.float32)
        np.negative(xy[..., 1], out=xy[..., 1])
    return RangeView(
        depth=np.where(valid, grid[..., 2], np.nan).astype(np.float32),
        mask=valid,
        xy=xy,
        fx=fx,
        fy=fy,
        cx=cx,
        cy=cy,
        world_to_camera=world_to_camera,
        name=name,
        unit=unit,
    )


def _farthest(
    grid: NDArray[np.floating], valid: NDArray[np.bool_], pinhole: tuple[float, float, float, float]
) -> float:
    """Pixels between a point and the ray of its pixel, at most."""
    height, most = max(1, _AT_ONCE // valid.shape[1]), 0.0
    for top in range(0, len(valid), height):
        row, column = np.nonzero(valid[top : top + height])
        points = grid[top : top + height][row, column].astype(np.float64)
        most = max(most, float(_apart(points, row + top, column, pinhole).max(initial=0)))
    return most


def _apart(
    points: NDArray[np.float64],
    row: NDArray[np.integer],
    column: NDArray[np.integer],
    pinhole: tuple[float, float, float, float],
) -> NDArray[np.float64]:
    """Pixels between where a pinhole sees points (N, 3) and where they are in the grid, (N,)."""
    fx, fy, cx, cy = pinhole
    x, y, z = points.T
    return np.maximum(np.abs(x / z * fx + cx - column - 0.5), np.abs(y / z * fy + cy - row - 0.5))


def view_of_grid(grid: NDArray[np.floating], to_grid: NDArray[np.float64], name: str, unit: str) -> RangeView:
    """The range view of measured points, a height field over the plane that its rows and columns go along.

    grid: (H, W, 3), the top row first, seen from the side where its columns go to the right; not finite: no
    sample. to_grid: (4, 4) from the world to the grid's coordinates. Its x and y are stored as measured. The
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
    return RangeView(
        kind="height",
        depth=depth,
        mask=valid,
        xy=xy,
        fx=fx,
        fy=fy,
        cx=cx,
        cy=cy,
        world_to_camera=rigid_matrix(axes, np.zeros(3)) @ to_grid,
        name=name,
        unit=unit,
    )


def is_seen_from_behind(view: RangeView, to_grid: NDArray[np.float64]) -> bool:
    """Whether a view of `view_of_grid` looks along the z of its grid, as where the lowest row came first."""
    return bool((view.world_to_camera @ np.linalg.inv(to_grid))[2, 2] < 0)


def _axes(
    points: NDArray[np.float64], column: NDArray[np.integer], row: NDArray[np.integer]
) -> NDArray[np.float64]:
    """A camera's axes as rows (3, 3), right, up and back: those perpendicular ones along which the grid goes.

    What a scanner calls a column may go along a slanted plane: the fit finds the direction in which all
    points of a pixel lie behind each other.
    """
    pixels = np.stack([column, -row], axis=1).astype(np.float64)
    if len(points) < 3:
        raise InputError(f"has only {len(points)} points, too few for a surface")
    slopes = np.linalg.lstsq(points - points.mean(axis=0), pixels - pixels.mean(axis=0))[0].T
    lengths = np.linalg.norm(slopes, axis=1, keepdims=True)
    left, sizes, right = np.linalg.svd(slopes / np.where(lengths > 0, lengths, 1), full_matrices=False)
    if sizes[1] < _FLATTEST:
        raise InputError("the points lie along a line, so they form no surface")
    x, y = left @ right
    return np.stack([x, y, np.cross(x, y)])


def _line(lengths: NDArray[np.floating], pixels: NDArray[np.floating]) -> tuple[float, float]:
    """Pixels per unit of length, and the pixel at 0."""
    middle, center = lengths.mean(), pixels.mean()
    slope = float(((lengths - middle) @ (pixels - center)) / np.square(lengths - middle).sum())
    return slope, float(center - slope * middle)

"""Bounds of pictures by what a driver may round (viewer/bench/rounding.py); in software all of them are 0."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from viewer.bench.rounding import Rounding, half_step
from viewer.camera import Camera
from viewer.gpu.context import Gpu
from viewer.picture.surface import Surface
from viewer.scan.points import PointCloud
from viewer.view import View

_NOTHING = 0xFFFFFFFF
_ROUNDED = 16 * 2.0**-24  # of themselves: what a few products, sums and a quotient of float32 are off


def displaced(gpu: Gpu) -> list[tuple[float, float]]:
    """Places, pixels from a pixel's centre, between which lies what the rasteriser shows there: the centre,
    and the corners of all that it may be moved by."""
    corner = Rounding.of(gpu).corner
    return [(0.0, 0.0), *((x, y) for x in (-corner, corner) for y in (-corner, corner) if corner)]


def allowed_points(gpu: Gpu, cloud: PointCloud, camera: Camera, row: NDArray[np.uint32]) -> NDArray[np.bool_]:
    """Which pixels show what OpenGL allows of points that are a pixel each, (H, W).

    row: the points that they show, (H, W). The rasteriser moves each point to its grid, by half a step at
    most, and float32 rounds before. A point is sure in a pixel where it stays in it, however moved. A pixel
    may show a point that can lie in it and has no sure one in front, or nothing where no point is sure.
    """
    height, width = row.shape
    view = View.of(camera, (width, height), cloud.origin, cloud.bounds())
    pixels, depths = view.project(cloud.positions.astype(np.float64))
    by = half_step(gpu) + _ROUNDED * max(row.shape)
    moves = np.array([(x, y) for x in (-by, by) for y in (-by, by)])
    x, y = np.moveaxis(np.floor(pixels + moves[:, np.newaxis]).astype(int), 2, 0)  # (4, N)
    cells = np.where((x >= 0) & (x < width) & (y >= 0) & (y < height), y * width + x, -1)
    is_sure = (cells == cells[0]).all(axis=0) & (cells[0] >= 0) & (depths >= view.near)
    nearest = np.full(row.size, np.inf)
    np.minimum.at(nearest, cells[0, is_sure], depths[is_sure])
    shown, flat = np.flatnonzero(row.ravel() != _NOTHING), row.ravel()
    allowed = np.isinf(nearest)
    points = flat[shown]
    in_front = depths[points] <= nearest[shown] * (1 + _ROUNDED)
    allowed[shown] = (cells[:, points] == shown).any(axis=0) & in_front
    return allowed.reshape(row.shape)


def at_borders(surface: Surface) -> int:
    """How many pixels of two pictures may show different splats, where the rasteriser moved their corners.

    Borders between splats of a pixel or more are at most 2 pixel widths long in each pixel, as
    `viewer.bench.stability.Tolerance` has it; one of each picture lies at most a corner's way to either side.
    """
    return round(4 * Rounding.of(surface.gpu).corner * np.count_nonzero(surface.row != _NOTHING))


def moved(surface: Surface) -> NDArray[np.float64]:
    """By how much of itself the depth of each pixel's disc may change where its corners are moved, (H, W):
    1 / depth of a plane is linear in pixels. inf: it is seen edge on."""
    corner, view, cloud = Rounding.of(surface.gpu).corner, surface.view, surface.pose.cloud
    error = np.zeros(surface.row.shape)
    if not corner or cloud.normals is None:
        return error
    there = surface.row != _NOTHING
    normals = cloud.normals[surface.row[there]].astype(np.float64) @ view.rotation.T
    y, x = np.nonzero(there)
    step = (
        np.stack([x + 0.5 - view.center[0], view.center[1] - y - 0.5], axis=1) / view.scale
    )  # a unit of depth
    if not view.perspective:
        step = np.zeros_like(step)
    across = np.abs(np.sum(normals[:, :2] * step, axis=1) - normals[:, 2])
    width = 1 / view.scale if view.perspective else 1 / (view.scale * surface.depth[there])
    with np.errstate(divide="ignore"):
        error[there] = corner * np.abs(normals[:, :2]).sum(axis=1) * width / across
    return error


def stored(
    surface: Surface, depth: NDArray[np.floating] | float, times: int = 1
) -> NDArray[np.float64] | float:
    """By how much of itself a depth may be off that was a value of the depth buffer so often.

    In perspective it is divided for that and divided back; else it is a share of what the depth buffer
    reaches over, of which a quotient and a product or a difference are rounded.
    """
    quotient, view = Rounding.of(surface.gpu).quotient, surface.view
    if view.perspective:
        return times * 2 * quotient * 2.0**-23
    return times * (quotient + 1) * 2.0**-23 * np.maximum(view.reach / depth - 1, 1)

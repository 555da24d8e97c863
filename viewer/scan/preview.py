"""Small pictures of poses, made without a GPU: so that a user recognises a scan before it is opened."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ..camera import Camera
from ..task import checkpoint
from .pods import first_camera
from .points import PointCloud
from .pose import Pose

_MOST_POINTS = 60_000  # that are drawn
_SMALLEST, _LARGEST = 2, 6  # pixels from the middle of a splat to its edge
_PLAIN = 215  # grey of points without a colour, 0..255
_DARKEST = 0.25  # of the light that falls on what faces the eye
_SMOOTH = 2  # pixels around one that its depth is averaged over, for light


def preview_picture(pose: Pose, size: tuple[int, int], camera: Camera | None = None) -> NDArray[np.uint8]:
    """A picture of a pose, lit from the eye, (H, W, 4) RGBA; alpha 0 where nothing is.

    size: width and height in pixels. camera: None has it as it is first shown; of an orthographic one the
    picture is in perspective. Takes some tens of milliseconds for whatever number of points, and ends
    where its task is cancelled. Raises InputError where there is no point.
    """
    width, height = size
    cloud = pose.overview
    if camera is None:
        camera = first_camera(pose.views, pose.bounds, width / height, pose.upright)
    camera = camera.projected("perspective")
    step = -(-len(cloud) // _MOST_POINTS)
    rotation = camera.rotation()
    eye = np.subtract(camera.eye, cloud.origin)
    right, up, back = rotation @ (cloud.positions[::step].astype(np.float64) - eye).T
    focal = 0.5 * height / math.tan(math.radians(camera.fov_y) / 2)
    near = camera.clip_range()[0]
    rows = np.flatnonzero(-back > near)
    depth = -back[rows]
    columns = np.floor(0.5 * width + focal * right[rows] / depth).astype(np.int64)
    lines = np.floor(0.5 * height - focal * up[rows] / depth).astype(np.int64)
    spacing = pose.spacing * math.sqrt(step * pose.count / len(cloud))
    typical = float(np.median(depth)) if len(depth) else 1.0
    reach = min(max(round(spacing * focal / typical), _SMALLEST), _LARGEST)
    depths, nearest = _splatted(depth, columns, lines, size, reach)
    light = _light(depths, focal)
    picture = np.zeros((height, width, 4), np.uint8)
    seen = nearest >= 0
    picture[seen, :3] = _PLAIN if cloud.colors is None else _colors(cloud, rows[nearest[seen]] * step)
    picture[seen, :3] = picture[seen, :3] * light[seen][:, None]
    picture[seen, 3] = 255
    return picture


def _colors(cloud: PointCloud, rows: NDArray[np.int64]) -> NDArray[np.uint8]:
    assert cloud.colors is not None
    return cloud.colors[rows, :3]


def _splatted(
    depth: NDArray[np.float64],
    columns: NDArray[np.int64],
    lines: NDArray[np.int64],
    size: tuple[int, int],
    reach: int,
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """The depth of the nearest disc of each pixel, (H, W), infinite where there is none, and its point, -1
    there. depth, columns, lines: (N,), of each point. reach: radius of the discs, pixels."""
    width, height = size
    order = np.argsort(depth, kind="stable")
    ranks = np.full(height * width, len(depth), np.int64)
    for down in range(-reach, reach + 1):
        checkpoint()
        half = int(math.sqrt(reach**2 - down**2))
        for aside in range(-half, half + 1):
            x, y = columns[order] + aside, lines[order] + down
            inside = np.flatnonzero((x >= 0) & (x < width) & (y >= 0) & (y < height))
            np.minimum.at(ranks, y[inside] * width + x[inside], inside)
    seen = ranks < len(depth)
    nearest = np.full(height * width, -1)
    nearest[seen] = order[ranks[seen]]
    depths = np.full(height * width, np.inf)
    depths[seen] = depth[nearest[seen]]
    return depths.reshape(height, width), nearest.reshape(height, width)


def _light(depths: NDArray[np.float64], focal: float) -> NDArray[np.float64]:
    """How much light from the eye each pixel sends back, (H, W) 0..1, from the slope of the depths around."""
    seen = np.isfinite(depths)
    filled, weight = np.where(seen, depths, 0.0), seen.astype(np.float64)
    for axis in (0, 1):
        filled, weight = (_summed(values, axis) for values in (filled, weight))
    smooth = filled / np.maximum(weight, 1)
    smooth = np.where(weight > 0, smooth, smooth.max(initial=0.0))
    down, aside = np.gradient(smooth)
    pixel = smooth / focal
    facing = pixel / np.sqrt(np.maximum(down**2 + aside**2 + pixel**2, np.finfo(float).tiny))
    return _DARKEST + (1 - _DARKEST) * facing


def _summed(values: NDArray[np.float64], axis: int) -> NDArray[np.float64]:
    """The sums over the pixels around each along an axis; outside of the picture there is nothing."""
    padded = np.pad(values, [(_SMOOTH, _SMOOTH) if each == axis else (0, 0) for each in (0, 1)])
    windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * _SMOOTH + 1, axis)
    return windows.sum(axis=-1)

"""Range views of scenes with exactly known answers."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from viewer.camera import Camera
from viewer.scan.colors import linear_from_srgb8
from viewer.scan.range_view import RangeView


def looking_at(eye: ArrayLike, target: ArrayLike) -> NDArray[np.float64]:
    """World to camera, (4, 4), of a pod at `eye` with +y up."""
    matrix = np.eye(4)
    matrix[:3, :3] = Camera(eye=tuple(eye), target=tuple(target)).rotation()
    matrix[:3, 3] = -matrix[:3, :3] @ np.asarray(eye, float)
    return matrix


def sphere_view(
    eye: ArrayLike, center: ArrayLike = (0, 0, 0), size: tuple[int, int] = (48, 40), name: str = "left"
) -> RangeView:
    """A unit sphere as a pod at `eye` sees it, with all attributes; size: (width, height)."""
    (width, height), focal = size, 1.1 * max(size)
    cx, cy = width / 2 + 0.3, height / 2 - 0.7
    matrix = looking_at(eye, center)
    x = (np.arange(width) + 0.5 - cx) / focal
    y = (cy - np.arange(height) - 0.5) / focal
    rays = np.stack([*np.meshgrid(x, y), -np.ones((height, width))], axis=2)
    middle = matrix[:3, :3] @ np.asarray(center, float) + matrix[:3, 3]
    a, b, c = (rays**2).sum(axis=2), rays @ middle, middle @ middle - 1
    inside = b * b - a * c
    depth = np.where(inside > 0, (b - np.sqrt(np.maximum(inside, 0))) / a, np.nan)
    rng = np.random.default_rng(5)
    return RangeView(
        depth=depth.astype(np.float32),
        mask=rng.random(depth.shape) < 0.9,
        color=linear_from_srgb8(rng.integers(0, 256, (*depth.shape, 3), np.uint8)),
        confidence=rng.random(depth.shape, np.float32),
        fx=focal,
        fy=focal,
        cx=cx,
        cy=cy,
        world_to_camera=matrix,
        name=name,
        unit="mm",
    )

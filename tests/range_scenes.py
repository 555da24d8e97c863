"""Range views of scenes with exactly known answers."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from viewer.camera import Camera
from viewer.scan.colors import linear_from_srgb8
from viewer.scan.lens import undistorted
from viewer.scan.range_view import DepthKind, RangeView

LENSES = {  # strong, but real: a Kinect's colour camera, a wide angle, a phone's with all eight numbers
    "none": (),
    "barrel": (-0.28, 0.07, 0.002, -0.001),
    "kinect": (0.2624, -0.9531, -0.0054, 0.0026, 1.1633),
    "rational": (0.5, 0.02, 0.0004, -0.0003, 0.001, 0.83, 0.13, 0.008),
}


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


def camera_points(name: str, x: NDArray, y: NDArray, kind: DepthKind) -> tuple[NDArray, NDArray]:
    """Points (..., 3) in camera space of a sphere around (0.1, -0.2, -4), of radius 1.5, or of a leaning
    plane, and the normals there: on the rays (x, y, -1), or of heights at these x and y. NaN: none."""
    along = kind == "height"
    ray = np.stack([0 * x, 0 * x, -np.ones_like(x)] if along else [x, y, -np.ones_like(x)], axis=-1)
    start = np.stack([x, y, 0 * x], axis=-1) * along
    if name == "plane":
        normal = np.array([0.36, 0.48, 0.8])  # of the plane normal . p = -3
        points = start + ((-3 - start @ normal) / (ray @ normal))[..., None] * ray
        return points, np.broadcast_to(normal, points.shape)
    center, radius = np.array([0.1, -0.2, -4.0]), 1.5
    a, b = (ray**2).sum(axis=-1), (ray * (start - center)).sum(axis=-1)
    inside = b * b - a * (((start - center) ** 2).sum(axis=-1) - radius**2)
    step = np.where(inside > 0, (-b - np.sqrt(np.maximum(inside, 0))) / a, np.nan)
    points = start + step[..., None] * ray
    return points, (points - center) / radius


def shape_view(
    name: str, kind: DepthKind, lens: str = "none", measured: bool = False
) -> tuple[RangeView, NDArray, NDArray]:
    """A sphere or plane, see `camera_points`, as a pod sees it from aside, and the exact world positions and
    normals of its pixels, (N, 3). measured: whether x and y are measured, off the grid by up to two pixels.
    """
    width, height, focal, cx, cy = 121, 97, 110.0, 60.8, 47.9
    if kind == "height":
        focal = 25.0
    row, column = np.mgrid[:height, :width].astype(float)
    if measured:  # as a swinging stripe of light does
        column += 2 * np.sin(row / 7)
        row += np.cos(column / 11)
    x, y = (column + 0.5 - cx) / focal, (cy - row - 0.5) / focal
    if LENSES[lens]:
        x, y = undistorted(x, -y, LENSES[lens])
        y = -y
    points, normals = camera_points(name, x, y, kind)
    depth = np.linalg.norm(points, axis=2) if kind == "range" else -points[..., 2]
    matrix = looking_at((3.0, 1.0, 2.0), (0.5, 0.0, 0.0))
    seen = np.isfinite(depth)
    view = RangeView(
        depth=depth.astype(np.float32),
        kind=kind,
        mask=np.ones(depth.shape, bool),
        xy=points[..., :2].astype(np.float32) if measured else None,
        fx=focal,
        fy=focal,
        cx=cx,
        cy=cy,
        distortion=LENSES[lens],
        world_to_camera=matrix,
        name=name,
        unit="mm",
    )
    return view, (points[seen] - matrix[:3, 3]) @ matrix[:3, :3], normals[seen] @ matrix[:3, :3]


def heights(depth: ArrayLike, mask: NDArray[np.bool_] | None = None, **fields: object) -> RangeView:
    """A pod at the origin that looks down -z in parallel: a scan unit apart, the middle one on the axis."""
    depth = np.asarray(depth, np.float32)
    height, width = depth.shape
    known = {"mask": np.ones(depth.shape, bool) if mask is None else mask, "world_to_camera": np.eye(4)}
    pinhole = {"fx": 1.0, "fy": 1.0, "cx": width / 2, "cy": height / 2}
    return RangeView(depth=depth, kind="height", **{**known, **pinhole, **fields})


def straight_above(shape: tuple[int, int], zoom: float = 1.0) -> tuple[Camera, tuple[int, int]]:
    """A camera that sees all of `heights` of a shape, each in the middle of a pixel where zoom is 1, and the
    picture's size."""
    size = round(shape[1] * zoom), round(shape[0] * zoom)
    return Camera((0, 0, 1000), (0, 0, 0), projection="orthographic", height=size[1] / zoom), size

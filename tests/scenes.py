"""Scenes with exactly known answers, and a slow, obvious renderer to compare with."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from viewer.backends import backends
from viewer.camera import Camera
from viewer.mesh.triangles import Mesh
from viewer.scan.points import PointCloud
from viewer.testing.backends import BUFFERS as BUFFERS
from viewer.testing.backends import draws_points
from viewer.testing.backends import variants as variants_of
from viewer.testing.scenes import NOTHING, of_variant, sphere
from viewer.testing.scenes import looking_down_z as looking_down_z
from viewer.testing.scenes import plane as plane
from viewer.view import View

DRAWS_POINTS = [one.name for one in backends().values() if draws_points(one)]


def variants() -> list[str]:
    """All backends that draw points, each in every way that changes its shaders but not its picture."""
    return [variant for name in DRAWS_POINTS for variant in variants_of(backends()[name])]


def _for_each(names: list[str]) -> pytest.MarkDecorator:
    marked = (pytest.param(name, marks=pytest.mark.backend(of_variant(name)[0])) for name in names)
    return pytest.mark.parametrize("name", list(marked))


def rarely(*values: object) -> list[object]:
    """Values of a parameter that repeat what others show: their tests are slow."""
    return [pytest.param(value, marks=pytest.mark.slow) for value in values]


def rarely_together(*rows: tuple[object, ...]) -> list[object]:
    """Values of several parameters at once, a row with one of each, that repeat what others show."""
    return [pytest.param(*row, marks=pytest.mark.slow) for row in rows]


every_backend = _for_each(variants())
# Those that show the points themselves, where they lie.
every_backend_of_points = _for_each(
    [name for name in variants() if backends()[of_variant(name)[0]].rows == "points"]
)


def zbuffer(
    cloud: PointCloud, camera: Camera, size: tuple[int, int]
) -> tuple[NDArray[np.float64], NDArray[np.uint32]]:
    """Depth and row of the nearest point of each pixel, point by point in float64."""
    view = View.of(camera, size, cloud.origin, cloud.bounds())
    pixels, depths = view.project(cloud.positions.astype(np.float64))
    depth = np.full(size[::-1], np.inf)
    row = np.full(size[::-1], NOTHING, np.uint32)
    for i, ((x, y), d) in enumerate(zip(pixels, depths, strict=True)):
        if d >= view.near and 0 <= x < size[0] and 0 <= y < size[1] and d < depth[int(y), int(x)]:
            depth[int(y), int(x)], row[int(y), int(x)] = d, i
    return depth, row


def sphere_hits(
    camera: Camera, size: tuple[int, int], radius: float = 1.0
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Exact depth (inf: no hit) and world normal of a sphere at the origin, per pixel centre."""
    view = View.of(camera, size, np.zeros(3), sphere(8, radius).bounds())
    x, y = np.meshgrid(np.arange(size[0]) + 0.5 - size[0] / 2, np.arange(size[1]) + 0.5 - size[1] / 2)
    flat = np.stack([x / view.scale, -y / view.scale, np.zeros_like(x)], axis=-1)
    if view.perspective:
        start, step = np.zeros(3), flat + np.array([0, 0, -1.0])
    else:
        start, step = flat, np.broadcast_to([0, 0, -1.0], flat.shape)
    center = view.translation
    a, b = (step**2).sum(-1), (step * (start - center)).sum(-1)
    c = ((start - center) ** 2).sum(-1) - radius**2
    root = b * b - a * c
    t = np.where(root >= 0, (-b - np.sqrt(np.maximum(root, 0))) / a, np.inf)
    hit = np.where(np.isfinite(t), t, 0)[..., None] * step + start
    return -hit[..., 2] + np.where(np.isfinite(t), 0, np.inf), (hit - center) / radius @ view.rotation


def sphere_mesh(rings: int = 64, center: tuple[float, float, float] = (0, 0, 0), smooth: bool = True) -> Mesh:
    """A unit sphere of quads halved, its vertices exactly on it, to float32."""
    polar = np.linspace(0, np.pi, rings + 1)[:, None]
    turn = np.linspace(0, 2 * np.pi, 2 * rings, endpoint=False)[None, :]
    p = np.stack(
        [np.sin(polar) * np.cos(turn), np.cos(polar) + 0 * turn, -np.sin(polar) * np.sin(turn)], axis=-1
    ).reshape(-1, 3)
    ring, column = np.divmod(np.arange(2 * rings * rings), 2 * rings)
    a, b = ring * 2 * rings + column, ring * 2 * rings + (column + 1) % (2 * rings)
    faces = np.concatenate(
        [np.stack([a, a + 2 * rings, b], 1), np.stack([b, a + 2 * rings, b + 2 * rings], 1)]
    )
    cloud = PointCloud.from_arrays(p + np.array(center), normals=p if smooth else None, colors=p * 0.5 + 0.5)
    return Mesh(cloud, faces.astype(np.uint32))

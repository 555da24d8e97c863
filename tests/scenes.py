"""Scenes with exactly known answers, and a slow, obvious renderer to compare with."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from viewer.backends import Backend, backends
from viewer.camera import Camera
from viewer.mesh.triangles import Mesh
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose
from viewer.splatting.amplify import FEEDS
from viewer.view import View

NOTHING = 0xFFFFFFFF


DRAWS_POINTS = [
    one.name for one in backends().values()
    if one.draws(Pose.of(0, 0.0, "one", PointCloud.from_arrays(np.zeros((1, 3)))))
]  # fmt: skip
BUFFERS = tuple(feed for feed in FEEDS if feed != "gs")  # feeds that give the same bits: test_same_bits.py


def variants() -> list[str]:
    """All backends that draw points, by name, each in every way that changes its shaders but not its picture.

    "surfels instancing=gs". One of those that give the same bits: "auto" is one of the others, feeds from
    buffers agree.
    """

    def ways(one: Backend) -> list[str]:
        return [
            f"{one.name} {parameter.name}={word}"
            for parameter in one.parameters
            if parameter.affects == "speed"
            for word in parameter.choices
            if word not in ("auto", *BUFFERS[1:])
        ]

    return [variant for name in DRAWS_POINTS for variant in ways(backends()[name]) or [name]]


def of_variant(name: str) -> tuple[str, dict[str, object]]:
    """The backend of a variant and its parameters."""
    name, _, setting = name.partition(" ")
    return name, dict([setting.split("=")]) if setting else {}


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


def sphere(count: int, radius: float = 1.0, center: tuple[float, float, float] = (0, 0, 0)) -> PointCloud:
    """A Fibonacci sphere with exact normals, and radii of 1.5 times the spacing."""
    i = np.arange(count) + 0.5
    polar, turn = np.arccos(1 - 2 * i / count), np.pi * (1 + 5**0.5) * i
    normals = np.stack([np.cos(turn) * np.sin(polar), np.cos(polar), np.sin(turn) * np.sin(polar)], axis=1)
    spacing = radius * np.sqrt(4 * np.pi / count)
    return PointCloud.from_arrays(
        normals * radius + np.array(center),
        normals=normals,
        colors=normals * 0.5 + 0.5,
        radii=np.full(count, 1.5 * spacing),
        scalars={"height": normals[:, 1]},
    )


def plane(edge: int, depth: float, spacing: float = 0.05) -> PointCloud:
    """edge x edge points on z = -depth, facing +z."""
    x, y = np.meshgrid(np.arange(edge) - (edge - 1) / 2, np.arange(edge) - (edge - 1) / 2)
    points = np.stack([x.ravel() * spacing, y.ravel() * spacing, np.full(edge * edge, -depth)], axis=1)
    normals = np.tile([0.0, 0.0, 1.0], (edge * edge, 1))
    return PointCloud.from_arrays(points, normals=normals, radii=np.full(edge * edge, 1.5 * spacing))


def looking_down_z(**fields: object) -> Camera:
    """At the origin, looking along -z."""
    return Camera(eye=(0, 0, 0), target=(0, 0, -1), **fields)  # type: ignore[arg-type]


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

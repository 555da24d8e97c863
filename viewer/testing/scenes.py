"""Scenes with exactly known answers, and pictures of them."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from ..backends import Backend, backend
from ..camera import Camera
from ..drawing.frame import render_frame
from ..drawing.renderer import shared_renderer
from ..drawing.request import Request
from ..gpu.constants import NOTHING as NOTHING  # the id of a pixel that shows no point
from ..look import Look
from ..picture.surface import Surface
from ..scan.points import PointCloud
from ..scan.pose import Pose, Scanned


def draw(
    scanned: Scanned,
    camera: Camera,
    size: tuple[int, int] = (64, 48),
    which: str | Backend = "points",
    look: Look | None = None,
    params: dict[str, object] | None = None,
) -> Surface:
    """Draw points or range views and return the finished Surface.

    size: width and height in pixels. which: a backend, its name, or a variant such as
    "surfels instancing=gs". look: None for flat light.
    """
    setting: dict[str, object] = {}
    if isinstance(which, str):
        name, setting = of_variant(which)
        which = backend(name)
    values = which.params({**setting, **(params or {})})
    request = Request(Pose.of(0, 0.0, "test", scanned), camera, which, values, look or Look(light="flat"))
    surface = Surface(shared_renderer().gpu, size)
    while render_frame(shared_renderer(), request, surface):
        pass
    return surface


def of_variant(name: str) -> tuple[str, dict[str, object]]:
    """The backend of a variant, such as "surfels instancing=gs", and its parameters."""
    name, _, setting = name.partition(" ")
    parameter, _, value = setting.partition("=")
    return name, {parameter: value} if parameter else {}


@cache
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


def looking_down_z(**fields: Any) -> Camera:
    """A camera at the origin that looks along -z."""
    return Camera(eye=(0, 0, 0), target=(0, 0, -1), **fields)

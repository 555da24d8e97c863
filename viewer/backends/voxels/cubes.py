"""Voxels: upright cubes around points, small ones by scatter, the others amplified (Slomp 2014, VI-B)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ...gpu import gl
from ...gpu.bindings import Texture
from ...gpu.pose import GpuPose
from ...gpu.scatter import Visits
from ...picture.surface import Surface
from ...splatting.amplify import FEEDS, Points, Shape, amplify
from ...splatting.fastest import instancing_for

CUBE = Shape("voxels/cube.glsl", corners=9)
_FRAGMENT = "voxels/cube.frag"
_SMALL = 3.0  # half of the edge, pixels: up to it, a ray for each pixel of a cube costs less than faces do
_OF_SOME = ("gs", "tbo", "pull")  # feeds that bring some of the points


def draw_cubes(points: Points, surface: Surface, instancing: str) -> None:
    """The nearest cube of each pixel. Points: their radii are half of the edges.

    instancing: a feed, which then brings all of them; else cubes of a few pixels are met with the ray of each
    pixel, which gives the same picture, and the fastest feed brings the others.
    """
    if instancing in FEEDS:
        amplify(points, surface, instancing, CUBE, _FRAGMENT)
        return
    small, large = _by_size(points, surface)
    if small is None:
        surface.stats.skipped["scatter"] = "no voxel is smaller than a pixel"
    else:
        _scatter(small, surface)
        surface.stats.chosen["instancing"] = "scatter"
    if large is None:
        surface.stats.skipped["splat"] = (
            "all voxels are smaller than a pixel, so Scan4D writes each voxel to a single pixel"
        )
    else:
        feed = instancing_for(surface, "auto", "gs", "voxels", _OF_SOME, _variants)
        amplify(large, surface, feed, CUBE, _FRAGMENT, over=small is not None)
        surface.stats.chosen["instancing"] = feed if small is None else f"scatter, {feed}"
    surface.gpu.discard(*(part.rows for part in (small, large) if part is not None and part is not points))


def _variants(pose: GpuPose, surface: Surface) -> dict[str, Callable[[], None]]:
    points = Points.of(pose, surface, 1.0, use_radii=True)
    return {feed: partial(amplify, points, surface, feed, CUBE, _FRAGMENT) for feed in _OF_SOME}


def shade_flat(points: Points, surface: Surface) -> None:
    """Give each pixel the normal of the face that it shows."""
    gpu, covered = surface.gpu, surface.list_covered()
    with gpu.timers.measure("faces"):
        points.pose.array("positions").bind(Texture.POSITIONS)
        surface.bind_textures()
        surface.bind_own("normal")
        covered.run(gpu.compute("voxels/faces.comp"))


def _by_size(points: Points, surface: Surface) -> tuple[Points | None, Points | None]:
    """The small ones and the large ones; the points themselves where they are all of one kind."""
    cloud, view = points.pose.cloud, surface.view
    assert cloud.radii is not None
    pixels = cloud.radii * np.float32(points.enlarged * view.scale)
    if view.perspective:
        pixels /= np.maximum(view.depths(cloud.positions).astype(np.float32), np.float32(view.near))
    small = pixels <= _SMALL
    if small.all():
        return points, None
    if not small.any():
        return None, points
    return _part(points, small), _part(points, ~small)


def _part(points: Points, chosen: NDArray[np.bool_]) -> Points:
    rows = np.flatnonzero(chosen).astype(np.uint32)
    return replace(points, rows=gl.BufferTexture(points.pose.gpu.buffer(rows), gl.R32UI), count=len(rows))


def _scatter(points: Points, surface: Surface) -> None:
    visits = Visits("voxels/scatter.glsl", points.count, points.bind, points.defines)
    with surface.keeping_nearest() as nearest:
        nearest.take(visits)

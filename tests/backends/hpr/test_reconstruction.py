"""Reconstruction between visible points by pull and push."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scenes import NOTHING, sphere, sphere_hits

from viewer.camera import Camera
from viewer.look import Look
from viewer.picture.surface import Surface
from viewer.scan.points import PointCloud

Draw = Callable[..., Surface]
SIZE = (160, 120)
PARAMS = {"steps": 16, "radius": 300, "point_size": 1}  # no point of the back is seen through gaps


def reconstructed(draw: Draw, cloud: PointCloud, camera: Camera) -> Surface:
    return draw(cloud, camera, SIZE, "hpr", Look(light="head"), {**PARAMS, "output": "reconstruction"})


def test_it_closes_a_sphere_up_to_its_outline(draw: Draw) -> None:
    ball = sphere(4000)
    cloud = PointCloud.from_arrays(ball.positions, colors=ball.colors)
    camera = Camera.orbit(cloud.bounds(), 40, 25, aspect=4 / 3)
    surface = reconstructed(draw, cloud, camera)
    depth, normal = sphere_hits(camera, SIZE)
    inside, covered = np.isfinite(depth), np.isfinite(surface.depth)
    outline = np.count_nonzero(np.diff(inside, axis=1)) + np.count_nonzero(np.diff(inside, axis=0))
    middle = inside & (normal @ camera.rotation()[2] > 0.3)
    assert covered[middle].all()
    assert (covered & ~inside).sum() < 2.5 * outline, "a spacing is 3 pixels"
    off = np.abs(surface.depth[middle] - depth[middle])
    assert off.mean() < 0.01
    assert off.max() < 0.15
    cosine = np.einsum("ijk,ijk->ij", surface.normal, normal)[middle]
    assert np.degrees(np.arccos(np.clip(cosine, -1, 1))).mean() < 4


def test_what_is_filled_has_a_level_and_no_row(draw: Draw) -> None:
    cloud = PointCloud.from_arrays(sphere(4000).positions)
    camera = Camera.orbit(cloud.bounds(), 40, 25, aspect=4 / 3)
    surface = reconstructed(draw, cloud, camera)
    points = draw(cloud, camera, SIZE, "hpr", params={**PARAMS, "output": "points"})
    measured, covered = points.row != NOTHING, np.isfinite(surface.depth)
    np.testing.assert_array_equal(surface.row, points.row)
    np.testing.assert_array_equal(surface.depth[measured], points.depth[measured])
    np.testing.assert_array_equal(surface.level == 0, measured)
    filled = surface.level[covered & ~measured]
    assert len(filled) > 1000
    assert filled.min() == 1
    assert filled.max() < 8


def test_surfaces_one_behind_the_other_are_not_mixed(draw: Draw) -> None:
    front, back = sphere(10_000, 0.5, (0, 0, 0)), sphere(10_000, 2.0, (0, 0, -5))
    positions = np.concatenate([ball.positions + ball.origin for ball in (front, back)])
    camera = Camera(eye=(0, 0, 3), target=(0, 0, 0), fov_y=50)
    surface = reconstructed(draw, PointCloud.from_arrays(positions), camera)
    depth = surface.depth[np.isfinite(surface.depth)]
    assert not ((depth > 3.2) & (depth < 5.8)).any()
    assert (depth < 3.2).sum() > 1000
    assert (depth > 5.8).sum() > 1000

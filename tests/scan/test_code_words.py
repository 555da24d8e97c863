"""What a look and parameters make of a pose as code words."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scenes import sphere

from viewer.camera import Camera
from viewer.codewords.engine import draw_words
from viewer.codewords.words import decode_words
from viewer.errors import InputError
from viewer.look import Look, color_table
from viewer.scan.code_words import Params, point_materials, words_of
from viewer.scan.layers import Layers
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose
from viewer.view import View

SIZE = (96, 64)


def ball(**changes: object) -> Pose:
    cloud = replace(sphere(3000), **changes)  # type: ignore[arg-type]
    return Pose(0, 0.0, "ball", cloud)


def view_of_pose(pose: Pose, layers: Layers | None = None) -> View:
    camera = Camera.orbit(pose.bounds, 20, 10, aspect=SIZE[0] / SIZE[1])
    place = {} if layers is None else {"world_from_pose": layers.world_from_pose}
    return View.of(camera, SIZE, pose.origin, pose.bounds, **place)


def test_the_pictures_colors_are_those_of_the_look() -> None:
    pose, rng = ball(), np.random.default_rng(0)
    heat = rng.uniform(0, 1, len(pose.cloud))
    pose = replace(pose, points=replace(pose.cloud, scalars={"heat": heat}))
    view = view_of_pose(pose)
    unlit = Look(light="flat", plain="#112233")
    palette, index = point_materials(pose, view, replace(unlit, color_by="plain"))
    assert (palette.tolist(), set(index)) == ([[0x11, 0x22, 0x33]], {0})
    palette, index = point_materials(pose, view, replace(unlit, color_by="heat", low=0.0, high=1.0))
    expected = color_table("batlow")[np.rint(heat * 255).astype(int), :3]
    assert np.abs(palette[index].astype(int) - expected).max() <= 6  # 127 steps of 256
    palette, index = point_materials(pose, view, replace(unlit, color_by="normal"))
    normals = pose.cloud.normals
    assert normals is not None
    assert np.sqrt(((palette[index] / 255 - (normals / 2 + 0.5)) ** 2).mean()) < 0.06
    for color_by in ("depth", "height", "id", "level", "own"):
        palette, index = point_materials(pose, view, replace(unlit, color_by=color_by))
        assert len(index) == len(pose.cloud)
        assert index.max() < len(palette)
    with pytest.raises(InputError, match="unknown colour source 'cold'"):
        point_materials(pose, view, replace(unlit, color_by="cold"))
    layers = Layers({"cold": heat})
    assert len(point_materials(pose, view, replace(unlit, color_by="cold"), layers)[0]) == 128


def test_depth_and_height_go_by_where_points_are() -> None:
    pose = ball()
    view = view_of_pose(pose)
    depth = view.depths(pose.cloud.positions)
    for color_by, values in (("depth", depth), ("height", pose.cloud.world()[:, 1])):
        index = point_materials(pose, view, Look(color_by=color_by))[1]
        assert (np.diff(index[np.argsort(values)].astype(int)) >= 0).all()


def test_points_without_anything_are_drawn() -> None:
    bare = Pose(0, 0.0, "bare", PointCloud.from_arrays(sphere(3000).positions))
    stream = words_of(bare, view_of_pose(bare), Look(), Params())
    assert set(decode_words(stream.words)["diffuse"]) == {127}  # unlit
    assert draw_words(stream).covered.mean() > 0.2
    empty = Pose(0, 0.0, "none", PointCloud.from_arrays(np.empty((0, 3))))
    assert len(words_of(empty, view_of_pose(bare), Look(), Params())) == 0


def test_radii_are_the_scans_own_or_one_for_all() -> None:
    pose = ball(radii=np.full(3000, 1e-6, np.float32))
    view = view_of_pose(pose)
    covered = {
        radius: int(draw_words(words_of(pose, view, Look(), Params(radius=radius))).covered.sum())
        for radius in ("own", "uniform")
    }
    assert covered["own"] < covered["uniform"]
    larger = draw_words(words_of(pose, view, Look(), Params(radius="uniform", radius_scale=3.0)))
    assert larger.covered.sum() > covered["uniform"]


def test_a_view_from_another_origin_shows_the_same() -> None:
    pose = ball()
    view = view_of_pose(pose)
    origin = pose.origin + np.array([0.25, -0.5, 0.125])
    camera = Camera.orbit(pose.bounds, 20, 10, aspect=SIZE[0] / SIZE[1])
    other = View.of(camera, SIZE, origin, pose.bounds)
    for color_by in ("depth", "normal"):
        look = Look(color_by=color_by)
        pictures = [draw_words(words_of(pose, each, look, Params())) for each in (view, other)]
        assert np.mean(pictures[0].ids() != pictures[1].ids()) < 0.01  # where roundings differ
        assert np.mean(pictures[0].image != pictures[1].image) < 0.01


def test_what_faces_away_and_steps_are_parameters() -> None:
    pose = ball()
    view = view_of_pose(pose)
    all_words, front = (len(words_of(pose, view, Look(), Params(cull_back=cull))) for cull in (False, True))
    assert 0.4 < front / all_words < 0.6
    fine = words_of(pose, view, Look(), Params(sizes=33, size_parts=4, normals=121, normal_parts=10))
    assert draw_words(fine).covered.any()
    with pytest.raises(InputError, match="odd number"):
        words_of(pose, view, Look(), Params(normals=60))

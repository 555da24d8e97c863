"""Pixels that no point gave, by a backend that fills holes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import filling
import numpy as np
import pytest
from numpy.typing import NDArray
from scenes import NOTHING, looking_down_z, plane

from viewer.analysis.pick import pick
from viewer.gpu import gl
from viewer.look import Look, color_table
from viewer.picture.shade import shade
from viewer.picture.surface import EMPTY, Surface
from viewer.scan.points import PointCloud

Draw = Callable[..., Surface]
SIZE = (61, 43)  # odd on purpose
CAMERA = looking_down_z(fov_y=2 * np.degrees(np.arctan(1 / 4)))  # 21.5 pixels a unit at depth 4
FLAT = Look(light="flat", eye_dome=False, background="#0a141e28")


def slope() -> PointCloud:
    """Points three to four pixels apart, whose depth, colour and number change from left to right."""
    cloud = plane(12, depth=4.0, spacing=0.16)
    across = cloud.positions[:, 0].astype(float) / 2 + 0.5
    positions = cloud.world() + np.outer(across, [0, 0, 0.1])
    colors = np.stack([across, 1 - across, 0.25 + 0 * across], axis=1)
    scalars = {"q": 1.7e9 + 255 * across}
    return PointCloud.from_arrays(positions, normals=cloud.normals, colors=colors, scalars=scalars)


def around(measured: NDArray[np.bool_], values: NDArray, levels: int) -> tuple[NDArray, NDArray]:
    """The plain twin of filling.comp: the levels and the mean of values (H, W, n), NaN where none is near."""
    level = np.where(measured, 0, EMPTY).astype(np.uint8)
    filled = np.where(measured[..., None], values.astype(float), np.nan)
    for y, x in np.argwhere(~measured):
        for n in range(1, levels + 1):
            window = slice(max(y - n, 0), y + n + 1), slice(max(x - n, 0), x + n + 1)
            if measured[window].any():
                level[y, x], filled[y, x] = n, values[window][measured[window]].mean(axis=0)
                break
    return level, filled


def linear(srgb: NDArray) -> NDArray[np.float64]:
    share = srgb / 255
    return np.where(share > 0.04045, ((share + 0.055) / 1.055) ** 2.4, share / 12.92)


@pytest.mark.parametrize("levels", [0, 1, 3])
def test_a_filled_pixel_has_a_depth_a_level_and_no_point(draw: Draw, levels: int) -> None:
    plain = draw(slope(), CAMERA, SIZE, look=FLAT)
    surface = draw(slope(), CAMERA, SIZE, filling.BACKEND, FLAT, {"levels": levels})
    measured = plain.row != NOTHING
    level, depth = around(measured, plain.depth[..., None], levels)
    assert {*np.unique(level)} == {*range(levels + 1), EMPTY}
    np.testing.assert_array_equal(surface.level, level)
    np.testing.assert_array_equal(surface.row, plain.row)
    np.testing.assert_array_equal(surface.id, plain.id)
    np.testing.assert_array_equal(surface.coverage, level != EMPTY)
    covered = np.isfinite(surface.depth)
    np.testing.assert_array_equal(covered, level != EMPTY)
    np.testing.assert_allclose(surface.depth[covered], depth[covered, 0], rtol=1e-6)
    assert len(surface.list_covered()) == covered.sum()
    assert (surface.image()[~covered] == [10, 20, 30, 40]).all()
    assert surface.point_counts() == plain.point_counts()


def test_blended_channels_are_read_and_shown(draw: Draw) -> None:
    surface = draw(slope(), CAMERA, SIZE, filling.BACKEND, FLAT)
    measured = surface.row != NOTHING
    _, color = around(measured, slope().colors[np.where(measured, surface.row, 0)], 3)
    covered = surface.level != EMPTY
    shown = surface.image()
    assert np.abs(shown[covered][:, :3] - color[covered][:, :3]).max() <= 0.51
    assert (shown[covered][:, 3] == 255).all()
    np.testing.assert_allclose(surface.color[covered], linear(shown[covered][:, :3]), rtol=1e-5)
    np.testing.assert_allclose(surface.normal[covered], np.tile([0, 0, 1.0], (covered.sum(), 1)), atol=1e-6)
    assert not surface.color[~covered].any()
    assert not surface.normal[~covered].any()


@pytest.mark.parametrize("source", ["q", "height", "depth"])
def test_blended_numbers_go_through_the_colour_map(draw: Draw, source: str) -> None:
    low, high = {"q": (1.7e9, 1.7e9 + 255), "height": (-1.0, 1.0), "depth": (3.8, 4.1)}[source]
    look = replace(FLAT, color_by=source, color_map="cividis", low=low, high=high)
    surface = draw(slope(), CAMERA, SIZE, filling.BACKEND, look)
    row = np.where(surface.row != NOTHING, surface.row, 0)
    exact = {"q": slope().scalars["q"], "height": slope().world()[:, 1]}.get(source)
    value = surface.depth
    if exact is not None:
        value = around(surface.row != NOTHING, exact[row][..., None], 3)[1][..., 0]
    covered = surface.level != EMPTY
    assert (surface.level[covered] > 0).any()
    np.testing.assert_array_equal(np.isnan(surface.value), ~covered)
    np.testing.assert_allclose(surface.value[covered], value[covered], rtol=1e-6, atol=1e-6)
    entry = np.clip((value[covered] - low) / (high - low), 0, 1) * 255
    table = color_table("cividis").astype(int)
    steps = [
        np.abs(surface.image()[covered].astype(int) - table[np.clip(np.rint(entry).astype(int) + by, 0, 255)])
        for by in (-1, 0, 1)
    ]
    assert np.min([step.max(axis=1) for step in steps], axis=0).max() == 0, "a neighbouring entry at most"


def test_numbers_blended_for_one_source_are_not_shown_as_another(draw: Draw) -> None:
    look = replace(FLAT, color_by="q", plain="#ff0000")
    surface = draw(slope(), CAMERA, SIZE, filling.BACKEND, look)
    filled = np.isin(surface.level, (1, 2, 3))
    shown = surface.image(replace(look, color_by="height"))
    assert (shown[filled] == [255, 0, 0, 255]).all(), "nobody knows"
    assert np.isnan(surface.value[filled]).all()
    assert np.isfinite(surface.value[surface.level == 0]).all()
    surface.image(look)
    assert np.isfinite(surface.value[filled]).all()


@pytest.mark.parametrize("color_by", ["auto", "own", "plain", "q", "height", "id"])
def test_what_a_backend_leaves_open_is_plain(draw: Draw, color_by: str) -> None:
    look = replace(FLAT, color_by=color_by, plain="#336699")
    surface = draw(slope(), CAMERA, SIZE, filling.BACKEND, look, {"blends": False})
    filled = np.isin(surface.level, (1, 2, 3))
    assert (surface.image()[filled] == [0x33, 0x66, 0x99, 255]).all()
    assert np.isnan(surface.value[filled]).all()
    assert not surface.normal[filled].any()
    np.testing.assert_allclose(surface.color[filled], linear(np.full((filled.sum(), 3), [0x33, 0x66, 0x99])))


def test_a_normal_that_is_left_open_faces_the_eye(draw: Draw) -> None:
    look = Look(light="head", ambient=0.2, diffuse=0.5, specular=0.0, eye_dome=False, plain="#ffffff")
    surface = draw(slope(), CAMERA, SIZE, filling.BACKEND, look, {"blends": False})
    filled = np.isin(surface.level, (1, 2, 3))
    assert len(np.unique(surface.image()[filled], axis=0)) == 1, "lit alike, however far from the middle"
    normals = surface.image(replace(look, light="flat", color_by="normal"))[filled] / 127.5 - 1
    y, x = np.nonzero(filled)
    view = surface.view  # the eye is at zero
    to_eye = -(view.unproject(np.stack([x, y], axis=1) + 0.5, np.ones(len(x))) + surface.scan.origin)
    to_eye /= np.linalg.norm(to_eye, axis=1, keepdims=True)
    np.testing.assert_allclose(normals[:, :3], to_eye, atol=1.1 / 127.5)


def test_depth_as_the_number_is_resolved_like_others(draw: Draw) -> None:
    look = replace(FLAT, color_by="depth", low=3.8, high=4.1)
    surface = draw(slope(), CAMERA, SIZE, "points", look)
    picture, value = surface.image().copy(), surface.value
    surface.resolve("value")
    assert surface.is_own("value")
    np.testing.assert_array_equal(surface.value, value)
    shade(surface, look)
    np.testing.assert_array_equal(surface.image(), picture)


@pytest.mark.parametrize("level", [0, 255, 256, 0xFFFFFFFF])
def test_a_pixel_without_a_row_is_filled_whatever_level_a_backend_writes(draw: Draw, level: int) -> None:
    surface = draw(slope(), CAMERA, SIZE, "points", FLAT)
    gl.clear_words(surface.depths.buffer, int(np.float32(4).view(np.uint32)))
    gl.clear_words(surface.own("level").buffer, level)
    filled = surface.row == NOTHING
    assert (surface.level[filled] == (1 if level == 0 else 254)).all()
    y, x = np.argwhere(filled)[0]
    picked = pick(surface, x, y)
    assert picked is not None
    assert not picked.measured
    assert picked.level == surface.level[y, x]


@pytest.mark.parametrize("name", ["color", "normal", "value"])
def test_what_is_resolved_on_the_gpu_is_what_readers_find(draw: Draw, name: str) -> None:
    cloud = slope()
    for missing in ({}, {"colors": None, "normals": None}):
        surface = draw(replace(cloud, **missing), CAMERA, SIZE, "points", replace(FLAT, color_by="q"))
        before = getattr(surface, name)
        surface.resolve(name)
        tolerance = 128 if name == "value" else 1e-6  # of float32 at 1.7e9
        np.testing.assert_allclose(getattr(surface, name), before, rtol=0, atol=tolerance)
        assert surface.is_own(name)

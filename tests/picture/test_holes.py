"""What was filled and what stayed open, as the look shows them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import filling
import numpy as np
import pytest
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from scenes import DRAWS_POINTS, looking_down_z, sphere
from test_filled import FLAT, around, linear, slope

from viewer.camera import Camera
from viewer.gpu import gl
from viewer.look import HOLE_COLOR, HOLE_REACH, LEVEL_COLORS, Look, rgba
from viewer.picture.shade import shade
from viewer.picture.surface import Surface

Draw = Callable[..., Surface]
SIZE = (61, 43)
CAMERA = looking_down_z(fov_y=2 * np.degrees(np.arctan(1 / 4)))
BY_LEVEL = replace(FLAT, color_by="level")
HOLES = replace(FLAT, holes=True)
RED = list(rgba(HOLE_COLOR))


def closed(shown: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The plain closing by a square; outside of the picture nothing has to be near."""

    def square(outside: bool, inside: NDArray[np.bool_]) -> NDArray[np.bool_]:
        padded = np.pad(inside, HOLE_REACH, constant_values=outside)
        return sliding_window_view(padded, (2 * HOLE_REACH + 1,) * 2)

    near = square(False, shown).any(axis=(2, 3))
    return square(True, near).all(axis=(2, 3))


def with_holes(surface: Surface, shown: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The holes that are painted of a surface that shows something at these pixels."""
    depths = np.where(shown, np.float32(4), np.float32(np.inf))
    surface.depths.buffer.write(depths.tobytes())
    gl.clear_words(surface.rows.buffer, 0)
    surface.own("level")  # so that what is covered is looked at anew
    shade(surface, HOLES)
    return (surface.image() == RED).all(axis=2)


@pytest.mark.parametrize("size", [(61, 43), (1, 1), (32, 9), (33, 70), (300, 5), (64, 64)])
@pytest.mark.parametrize("share", [0.0, 0.004, 0.05, 0.7, 1.0])
def test_holes_are_what_the_closing_adds(draw: Draw, size: tuple[int, int], share: float) -> None:
    surface = draw(slope(), CAMERA, size)
    rng = np.random.default_rng(3)
    for _ in range(3):
        shown = rng.random(size[::-1]) < share
        np.testing.assert_array_equal(with_holes(surface, shown), closed(shown) & ~shown)


@pytest.mark.parametrize("width", [1, 2 * HOLE_REACH, 2 * HOLE_REACH + 1])
def test_gaps_up_to_a_width_are_holes(draw: Draw, width: int) -> None:
    surface = draw(slope(), CAMERA, (120, 90))
    shown = np.ones((90, 120), bool)
    shown[30 : 30 + width, 40 : 40 + width] = False
    assert with_holes(surface, shown).sum() == (width * width if width <= 2 * HOLE_REACH else 0)


def test_what_surrounds_a_scan_is_no_hole(draw: Draw) -> None:
    cloud = sphere(4000)
    surface = draw(cloud, Camera.orbit(cloud.bounds(), aspect=4 / 3), (200, 150), look=HOLES)
    red, shown = (surface.image() == RED).all(axis=2), surface.level == 0
    np.testing.assert_array_equal(red, closed(shown) & ~shown)
    y, x = np.mgrid[:150, :200]
    radius = np.hypot(x - 99.5, y - 74.5)
    edge = radius[shown].max()
    assert red[radius < edge - HOLE_REACH].sum() > 1000
    assert not red[radius > edge].any()


@pytest.mark.parametrize("name", [*DRAWS_POINTS, "filling"])
def test_every_renderer_shows_its_holes(draw: Draw, name: str) -> None:
    which = filling.BACKEND if name == "filling" else name
    plain = draw(slope(), CAMERA, SIZE, which, FLAT).image().copy()
    surface = draw(slope(), CAMERA, SIZE, which, HOLES)
    shown = np.isfinite(surface.depth)
    red = closed(shown) & ~shown
    np.testing.assert_array_equal(surface.image()[~red], plain[~red])
    assert (surface.image()[red] == RED).all()
    assert name != "points" or red.sum() > 500


@pytest.mark.parametrize("colors", [True, False])
@pytest.mark.parametrize("blends", [True, False])
def test_levels_have_their_colours_and_what_was_measured_is_grey(
    draw: Draw, colors: bool, blends: bool
) -> None:
    cloud = slope() if colors else replace(slope(), colors=None)
    surface = draw(cloud, CAMERA, SIZE, filling.BACKEND, BY_LEVEL, {"blends": blends, "levels": 3})
    level, shown = surface.level, surface.image().astype(int)
    assert {*np.unique(level)} == {0, 1, 2, 3, 255}
    for n in (1, 2, 3):
        assert (shown[level == n] == rgba(LEVEL_COLORS[n - 1])).all()
    measured = shown[level == 0]
    assert (np.ptp(measured[:, :3], axis=1) == 0).all()
    own = cloud.colors[surface.row[level == 0]][:, :3] if colors else np.array([rgba(BY_LEVEL.plain)[:3]])
    luminance = linear(own) @ [0.2126, 0.7152, 0.0722]
    assert np.abs(linear(measured[:, 0]) - luminance).max() < 1 / 128
    assert (shown[level == 255] == rgba(FLAT.background)).all()
    np.testing.assert_array_equal(level, around(level == 0, level[..., None], 3)[0])


def test_levels_above_the_last_colour_have_that(draw: Draw) -> None:
    surface = draw(slope(), CAMERA, SIZE, look=BY_LEVEL)
    gl.clear_words(surface.depths.buffer, int(np.float32(4).view(np.uint32)))
    for written, color in ((0, 0), (1, 0), (5, 4), (6, 4), (254, 4), (0xFFFFFFFF, 4)):
        gl.clear_words(surface.own("level").buffer, written)
        shade(surface, BY_LEVEL)
        filled = surface.level > 0
        assert (surface.image()[filled] == rgba(LEVEL_COLORS[color])).all()
        assert filled.sum() > 1000


def test_levels_are_told_of_every_scan(draw: Draw) -> None:
    """Also where no renderer fills, and beside a scalar of that name."""
    cloud = replace(slope(), scalars={"level": slope().scalars["q"]})
    surface = draw(cloud, CAMERA, SIZE, look=BY_LEVEL)
    assert (np.ptp(surface.image()[surface.level == 0][:, :3], axis=1) == 0).all()
    assert surface.color_range is None
    with_light = draw(sphere(500), Camera.orbit(sphere(500).bounds()), SIZE, look=Look(color_by="level"))
    assert len(np.unique(with_light.image()[with_light.level == 0], axis=0)) > 5

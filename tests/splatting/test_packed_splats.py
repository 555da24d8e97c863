"""Splats that a compute pass packed: the same picture as with arrays of the pose's own."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
import packed
import pytest
from packed import Packed
from scenes import NOTHING
from splat_scenes import CAMERAS, CLOUD, ELLIPSES, SIZE, assert_agree, assert_equal, every_camera

from viewer.camera import Camera
from viewer.look import Look
from viewer.picture.surface import Surface
from viewer.scan.points import PointCloud
from viewer.splatting.packed import VARIANTS
from viewer.splatting.packed import draw_splats as draw_all

# As the surfels backend draws them, which makes none smaller.
draw_splats = partial(draw_all, refine=False)
Draw = Callable[..., Surface]
CLOUDS = {"round": CLOUD, "elliptical": ELLIPSES}
LOOK = Look(light="head")
every_cloud = pytest.mark.parametrize("cloud", CLOUDS.values(), ids=CLOUDS)
every_way = pytest.mark.parametrize("way", VARIANTS)
every_number = pytest.mark.parametrize("passes", ["one", "two"])


def splatted(
    draw: Draw, cloud: PointCloud, splats: Packed, camera: Camera, elliptical: bool = True, **how: object
) -> Surface:
    """A picture of bare positions and colours, and of these splats."""
    bare = PointCloud.from_arrays(cloud.positions, colors=cloud.colors)
    return draw(bare, camera, SIZE, packed.backend(splats, partial(draw_splats, **how), elliptical), LOOK)


def test_words_keep_what_was_packed() -> None:
    splats = Packed.of(ELLIPSES)
    normals, radii, axes = packed.unpack(splats.words)
    assert ELLIPSES.normals is not None
    assert ELLIPSES.axes is not None
    np.testing.assert_allclose(normals, ELLIPSES.normals, atol=1e-4)
    first, other = np.linalg.norm(ELLIPSES.axes[:, :3], axis=1), ELLIPSES.axes[:, 3]
    np.testing.assert_array_equal(radii, np.minimum(first, other).astype(np.float32))
    np.testing.assert_allclose(np.linalg.norm(axes[:, :3], axis=1), np.maximum(first, other), rtol=1e-4)
    along = np.einsum("ij,ij->i", axes[:, :3], ELLIPSES.axes[:, :3]) / first
    expected = np.where(first >= other, np.maximum(first, other), 0)
    np.testing.assert_allclose(np.abs(along), expected, atol=2e-4 * first.max())


@every_camera
@every_cloud
@every_way
def test_the_same_picture_as_of_the_poses_own(
    draw: Draw, way: str, cloud: PointCloud, camera: Camera
) -> None:
    splats = Packed.of(cloud)
    one = splatted(draw, cloud, splats, camera, instancing=way)
    own = draw(splats.on(cloud), camera, SIZE, "surfels", LOOK, {"instancing": way, "passes": "one"})
    assert (own.row != NOTHING).any()
    assert_agree(one, own, 0.002)
    seen = (one.row == own.row) & (own.row != NOTHING)
    np.testing.assert_allclose(one.normal[seen], own.normal[seen], atol=1e-6)


@every_cloud
@every_way
def test_the_same_when_splats_are_blended(draw: Draw, way: str, cloud: PointCloud) -> None:
    splats, camera = Packed.of(cloud), CAMERAS["perspective"]
    one = splatted(draw, cloud, splats, camera, instancing=way, two=True)
    params = {"instancing": way, "passes": "two", "enlarge": 1.0}
    own = draw(splats.on(cloud), camera, SIZE, "surfels", LOOK, params)
    assert_agree(one, own, 0.002)
    assert one.is_own("color")
    assert one.is_own("normal")
    assert np.abs(one.color - own.color).max() < 0.02
    assert (np.abs(one.normal - own.normal).max(axis=2) > 0.02).mean() < 1e-3


@every_way
@every_number
def test_ellipses_are_drawn_round_where_so_asked(draw: Draw, way: str, passes: str) -> None:
    splats, camera = Packed.of(ELLIPSES), CAMERAS["perspective"]
    given = {"instancing": way, "two": passes == "two"}
    one = splatted(draw, ELLIPSES, splats, camera, elliptical=False, **given)
    params = {"instancing": way, "passes": passes, "enlarge": 1.0, "radius": "own"}
    own = draw(splats.on(ELLIPSES, elliptical=False), camera, SIZE, "surfels", LOOK, params)
    assert_agree(one, own, 0.002)


@every_way
@every_number
def test_rows_that_are_not_listed_have_no_splat(draw: Draw, way: str, passes: str) -> None:
    rows = np.arange(0, len(CLOUD), 3, np.uint32)
    splats, camera = Packed(Packed.of(CLOUD).words, rows), CAMERAS["perspective"]
    one = splatted(draw, CLOUD, splats, camera, instancing=way, two=passes == "two")
    few = PointCloud.from_arrays(
        CLOUD.positions[rows],
        normals=packed.unpack(splats.words)[0][rows],
        colors=CLOUD.colors[rows],  # type: ignore[index]
        radii=CLOUD.radii[rows],  # type: ignore[index]
    )
    own = draw(
        few,
        camera,
        SIZE,
        "surfels",
        LOOK,
        {"instancing": way, "passes": passes, "enlarge": 1.0, "radius": "own"},
    )
    np.testing.assert_array_equal(one.row == NOTHING, own.row == NOTHING)
    covered = one.row != NOTHING
    assert (rows[own.row[covered]] != one.row[covered]).mean() < 2e-3
    assert np.abs(one.color - own.color).max() < 0.02 or passes == "one"


@pytest.mark.parametrize("feed", ["gs", "vbo", "ubo"])
def test_feeds_of_attributes_give_way(draw: Draw, feed: str) -> None:
    splats, camera = Packed.of(CLOUD), CAMERAS["perspective"]
    ways = [splatted(draw, CLOUD, splats, camera, instancing=way) for way in (feed, "tbo")]
    assert_equal(*ways)

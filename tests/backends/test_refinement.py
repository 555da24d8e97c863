"""Splats of hidden points, which are made as small as those that hide them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
import packed
import pytest
from packed import Packed
from scenes import NOTHING, looking_down_z, rarely, sphere
from splat_scenes import CAMERAS, CLOUD, assert_agree, assert_equal

from viewer.bench.judge import Judge
from viewer.bench.truth.shapes import AnalyticScene, Sphere
from viewer.camera import Camera
from viewer.drawing.renderer import Renderer
from viewer.gpu import gl
from viewer.look import Look
from viewer.picture.surface import Surface
from viewer.scan.points import PointCloud
from viewer.splatting.packed import VARIANTS, _ByRow, draw_splats

Draw = Callable[..., Surface]
SIZE = (320, 240)
LOOK = Look(light="head", color_by="plain")
CENTERS = [(0.4 * i - 0.8, 0.15 * i, -1.2 * i) for i in range(5)]
ROW_OF_BALLS = PointCloud.from_arrays(
    np.concatenate([sphere(1500, center=center).world() for center in CENTERS])
)
ALONG_IT = Camera((-1.2, 0.1, 4.5), (0.0, 0.3, -2.4), fov_y=45)
every_way = pytest.mark.parametrize("way", VARIANTS)
every_number = pytest.mark.parametrize("passes", ["one", "two"])


def splatted(
    draw: Draw, cloud: PointCloud, splats: Packed, camera: Camera, elliptical: bool = False, **how: object
) -> Surface:
    bare = PointCloud.from_arrays(cloud.world(), colors=cloud.colors)
    return draw(bare, camera, SIZE, packed.backend(splats, partial(draw_splats, **how), elliptical), LOOK)


def before_the_eye(*discs: tuple[float, float, float]) -> tuple[PointCloud, Packed]:
    """Discs that face the eye of `looking_down_z`: (x, depth, radius) of each."""
    x, depth, radius = np.array(discs).T
    cloud = PointCloud.from_arrays(np.column_stack([x, 0 * x, -depth]))
    return cloud, Packed(packed.pack(np.tile([0.0, 0.0, 1.0], (len(x), 1)), radius))


@every_way
@every_number
def test_a_hidden_splat_does_not_reach_beyond_what_hides_it(draw: Draw, way: str, passes: str) -> None:
    cloud, splats = before_the_eye((0.0, 1.0, 0.1), (0.0, 1.5, 0.4))
    given = {"instancing": way, "two": passes == "two"}
    before, after = (
        splatted(draw, cloud, splats, looking_down_z(), refine=refine, **given) for refine in (False, True)
    )
    assert set(np.unique(before.row)) == {0, 1, NOTHING}
    assert set(np.unique(after.row)) == {0, NOTHING}
    np.testing.assert_array_equal(after.row == 0, before.row == 0)


@every_way
def test_what_lies_beside_or_close_behind_keeps_its_size(draw: Draw, way: str) -> None:
    """A splat beside, one behind by less than half a radius, and one whose centre is out of view."""
    cloud, splats = before_the_eye((0.0, 1.0, 0.1), (0.3, 1.5, 0.2), (0.0, 1.04, 0.15), (-0.75, 1.2, 0.4))
    before, after = (
        splatted(draw, cloud, splats, looking_down_z(), instancing=way, refine=refine)
        for refine in (False, True)
    )
    assert set(np.unique(before.row)) == {0, 1, 2, 3, NOTHING}
    assert_equal(before, after)


@pytest.mark.parametrize("camera", [CAMERAS["perspective"], CAMERAS["orthographic"]])
def test_nothing_is_drawn_again_where_no_splat_reaches_farther_than_what_hides_it(
    draw: Draw, camera: Camera
) -> None:
    """Of a closed surface of equal splats the far side stays as it is, and the near side, however steep."""
    before, after = (
        splatted(draw, CLOUD, Packed.of(CLOUD), camera, instancing="tiles", refine=refine)
        for refine in (False, True)
    )
    assert_equal(before, after)
    counts = after.stats.counted["refined tiles"]()
    assert counts["in"] > 100
    assert counts["again"] == 0


@pytest.mark.parametrize("projection", ["perspective", *rarely("orthographic")])
@pytest.mark.parametrize("elliptical", [False, True])
@every_number
def test_all_ways_agree(draw: Draw, projection: str, elliptical: bool, passes: str) -> None:
    camera = replace(ALONG_IT, projection=projection)
    splats = packed.estimate(ROW_OF_BALLS, camera, SIZE)
    two = passes == "two"
    first, *others = (
        splatted(draw, ROW_OF_BALLS, splats, camera, elliptical, instancing=way, two=two) for way in VARIANTS
    )
    for other in others:
        assert (first.row != other.row).mean() < 1e-3
        assert (np.abs(first.color - other.color).max(axis=2) > 0.02).mean() < 1e-3


def test_tiles_that_are_not_shown_again_are_those_that_stay(draw: Draw) -> None:
    """The picture is that of the smaller splats alone, and far from all tiles changed."""
    splats = packed.estimate(ROW_OF_BALLS, ALONG_IT, SIZE)
    refined = splatted(draw, ROW_OF_BALLS, splats, ALONG_IT, instancing="tiles")
    counts = refined.stats.counted["refined tiles"]()
    assert 0 < counts["again"] < 0.8 * counts["in"]
    texels = refined.cached(_ByRow).reserve("radii", len(ROW_OF_BALLS), gl.R32F)
    radii = np.frombuffer(texels.buffer.read(), np.uint32)
    words = splats.words.copy()
    words[splats.rows, 1] = radii[splats.rows]
    smaller = splatted(draw, ROW_OF_BALLS, Packed(words, splats.rows), ALONG_IT, refine=False)
    assert (words != splats.words).any()
    assert_agree(refined, smaller, 0.001)


@every_number
@pytest.mark.usefixtures("short_spans")
def test_large_splats_among_small_ones(draw: Draw, passes: str) -> None:
    """A hidden splat larger than the lists of tiles take."""
    x, y = np.meshgrid(np.linspace(-0.3, 0.3, 40), np.linspace(-0.3, 0.3, 40))
    near = np.column_stack([x.ravel(), y.ravel(), np.random.default_rng(0).uniform(-1, -0.995, x.size)])
    cloud = PointCloud.from_arrays(np.concatenate([near, [[0.0, 0.0, -1.5], [0.9, 0.0, -1.6]]]))
    radii = np.concatenate([np.full(len(near), 0.02), [0.9, 0.5]])
    splats = Packed(packed.pack(np.tile([0.0, 0.0, 1.0], (len(cloud), 1)), radii))
    size = (1200, 900)
    pictures = [
        draw(
            cloud,
            looking_down_z(),
            size,
            packed.backend(splats, partial(draw_splats, instancing=way, two=passes == "two")),
            LOOK,
        )
        for way in VARIANTS
    ]
    assert "rasterised" in "".join(pictures[0].stats.skipped.values())
    for picture in pictures:
        shown = np.unique(picture.row)
        assert len(near) not in shown, "hidden, and made small"
        assert len(near) + 1 in shown, "not hidden"
        assert_agree(picture, pictures[1], 0.002)


@pytest.mark.slow
def test_surfaces_behind_others_are_nearer_the_truth(renderer: Renderer, draw: Draw) -> None:
    """Five balls, one behind another: fewer pixels of a wrong one, less beyond outlines, no more holes."""
    truth = AnalyticScene(tuple(Sphere(center=center) for center in CENTERS))
    judge = Judge.of(renderer.gpu, truth, ALONG_IT, SIZE, LOOK, ROW_OF_BALLS, None)
    splats = packed.estimate(ROW_OF_BALLS, ALONG_IT, SIZE)
    without, refined = (
        judge.errors(splatted(draw, ROW_OF_BALLS, splats, ALONG_IT, two=True, refine=refine))
        for refine in (False, True)
    )
    assert refined["wrong_layer_percent"] < 0.9 * without["wrong_layer_percent"]
    assert refined["spill_percent"] < 0.9 * without["spill_percent"]
    assert refined["hole_percent"] < 0.02
    assert refined["psnr"] > without["psnr"] + 1


@pytest.mark.backend("auto_splats")
def test_grid_culling_leaves_no_gaps(renderer: Renderer, draw: Draw) -> None:
    """Points at random leave gaps between splats of the nearest surface, which those behind it close."""
    rng, size = np.random.default_rng(0), (480, 360)
    random = [
        directions / np.linalg.norm(directions, axis=1, keepdims=True)
        for directions in rng.normal(size=(5, 15_000, 3))
    ]
    cloud = PointCloud.from_arrays(
        np.concatenate([ball + center for ball, center in zip(random, CENTERS, strict=True)])
    )
    truth = AnalyticScene(tuple(Sphere(center=center) for center in CENTERS))
    judge = Judge.of(renderer.gpu, truth, ALONG_IT, size, LOOK, cloud, None)
    without, culled = (
        judge.errors(draw(cloud, ALONG_IT, size, "auto_splats", LOOK, {"cull": cull}))
        for cull in (False, True)
    )
    assert culled["hole_percent"] < without["hole_percent"] + 0.04
    assert culled["through_percent"] < without["through_percent"] + 0.1
    assert culled["psnr"] > without["psnr"] - 0.5

"""Coarser levels of detail: a share of the points, larger to match, as a picture at rest."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scenes import NOTHING, sphere

from viewer.backends import SHARES, backend, surfels
from viewer.camera import Camera
from viewer.drawing.frame import render_frame, reshade, supersample
from viewer.drawing.plan import Ready, make_plan
from viewer.drawing.renderer import Renderer
from viewer.drawing.request import Request
from viewer.errors import InputError
from viewer.look import Look
from viewer.picture.sample import is_sampled
from viewer.picture.surface import Surface
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose

SIZE = (320, 240)
CLOUD = sphere(40_000)
CAMERA = Camera((0.5, 0.4, 3.0), (0.0, 0.0, 0.0), fov_y=46)
SETTINGS = {
    "touching": ("points", {"point_size": 0}),
    "pixels": ("points", {}),
    "surfels": ("surfels", {}),
    "one pass": ("surfels", {"passes": "one"}),
    "quads": ("surfels", {"instancing": "tbo"}),
}


def request(setting: str, cloud: PointCloud = CLOUD, look: Look | None = None, **values: object) -> Request:
    name, given = SETTINGS[setting]
    params = backend(name).params({**given, **values})
    return Request(Pose(0, 0.0, "test", cloud), CAMERA, name, params, look or Look())


@pytest.mark.parametrize("share", SHARES)
@pytest.mark.parametrize("setting", SETTINGS)
def test_it_is_the_preview_of_that_share_and_whole(renderer: Renderer, setting: str, share: float) -> None:
    level, preview = Surface(renderer.gpu, SIZE), Surface(renderer.gpu, SIZE)
    assert not render_frame(renderer, request(setting, share=share), level)
    assert render_frame(renderer, request(setting), preview, share=share)
    for channel, values in preview.arrays().items():
        np.testing.assert_array_equal(level.arrays()[channel], values, channel)
    assert level.is_whole
    assert not preview.is_whole
    assert (level.stats.left_out, level.stats.is_sample) == (0, False)
    assert preview.stats.left_out == len(CLOUD) - np.count_nonzero(rows_of(share))


def rows_of(share: float) -> np.ndarray:
    return is_sampled(np.arange(len(CLOUD), dtype=np.uint32), share)


@pytest.mark.parametrize("setting", SETTINGS)
def test_a_preview_of_it_shows_a_share_of_its_points(renderer: Renderer, setting: str) -> None:
    surface = Surface(renderer.gpu, SIZE)
    assert render_frame(renderer, request(setting, share=0.5), surface, share=0.2)
    rows = np.unique(surface.row)
    assert rows_of(0.1)[rows[rows != NOTHING]].all()
    assert surface.stats.left_out == pytest.approx(0.4 * len(CLOUD), abs=2)
    assert not surface.is_whole


@pytest.mark.parametrize("setting", ["touching", "surfels", "one pass"])
def test_what_is_left_out_leaves_no_holes_and_moves_the_surface_little(
    renderer: Renderer, setting: str
) -> None:
    surfaces = {}
    for share in (1.0, *SHARES):
        surfaces[share] = Surface(renderer.gpu, SIZE)
        render_frame(renderer, request(setting, share=share), surfaces[share])
    whole = surfaces[1.0]
    inside = np.zeros(SIZE[::-1], bool)
    inside[60:180, 100:220] = True
    for share in SHARES:
        level = surfaces[share]
        assert (level.row[inside] != NOTHING).mean() > (0.97 if setting == "touching" else 0.9999)
        covered = [np.count_nonzero(each.row != NOTHING) for each in (level, whole)]
        assert covered[0] == pytest.approx(covered[1], rel=0.08)
        both = inside & (level.row != NOTHING) & (whole.row != NOTHING)
        off = np.abs(level.depth[both] - whole.depth[both])
        pixel = 3.0 / whole.view.scale
        assert np.median(off) < (3.0 if setting == "touching" else 0.5) * pixel


def test_squares_of_it_are_as_large_as_its_points_are_apart(renderer: Renderer) -> None:
    """And not as some whole pixels, times those of all points."""
    dense, surface = sphere(300_000), Surface(renderer.gpu, (160, 120))
    for share in (1.0, 0.3):  # whose squares would be of two pixels if those of one were enlarged
        render_frame(renderer, request("touching", dense, share=share), surface)
        _, counts = np.unique(surface.row[surface.row != NOTHING], return_counts=True)
        assert counts.max() == 1


def test_it_is_shaded_anew_and_has_samples_as_others_have(renderer: Renderer) -> None:
    surface = Surface(renderer.gpu, SIZE)
    asked = request("touching", share=0.25)
    render_frame(renderer, asked, surface)
    other = replace(asked, look=Look(color_by="depth", quality="balanced"))
    ready = make_plan(renderer, other, SIZE)
    assert isinstance(ready, Ready)
    assert reshade(ready, surface)
    while supersample(renderer, other, surface):
        pass
    assert surface.stats.samples > 1
    assert (~is_sampled(surface.row[surface.row != NOTHING], 0.25)).sum() == 0


@pytest.mark.parametrize("bad", [0.0, 1.5, -1, "all"])
def test_shares_are_more_than_none_and_at_most_all(bad: object) -> None:
    with pytest.raises(InputError, match="share"):
        backend("points").params({"share": bad})


def test_more_splats_than_can_be_listed_are_drawn_on_a_coarser_level(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And not by the rasteriser, which takes many times as long; all of them where that is asked for, or
    they are so small that they are not listed."""
    monkeypatch.setattr(renderer.gpu, "software", True)
    monkeypatch.setattr(surfels, "most_listed", lambda gpu: len(CLOUD) // 4)
    surface, level, whole = (Surface(renderer.gpu, SIZE) for _ in range(3))
    for passes in ("one", "two"):
        tiles = {"instancing": "tiles", "passes": passes}
        assert not render_frame(renderer, request("surfels", **tiles), surface)
        assert surface.is_whole
        assert surface.stats.chosen["share"].startswith("0.25")
        render_frame(renderer, request("surfels", share=0.25, **tiles), level)
        render_frame(renderer, request("surfels", share=1.0, **tiles), whole)
        np.testing.assert_array_equal(surface.depth, level.depth)
        assert "share" not in whole.stats.chosen
        assert not is_sampled(whole.row[whole.row != NOTHING], 0.25).all()
    far = replace(request("surfels", instancing="tiles"), camera=replace(CAMERA, eye=(50.0, 40.0, 300.0)))
    render_frame(renderer, far, surface)
    assert "second pass" in surface.stats.skipped  # under a pixel
    assert "share" not in surface.stats.chosen

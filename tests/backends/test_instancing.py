"""The ways from points to splats: one picture, whichever is taken."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hardware import at_borders, stored
from numpy.typing import NDArray
from scenes import BUFFERS, NOTHING, rarely, sphere
from splat_scenes import (
    CAMERAS,
    CLOUD,
    SIZE,
    assert_agree,
    assert_equal,
    every_camera,
)

from viewer.backends import backend
from viewer.backends import surfels as surfels_backend
from viewer.camera import Camera
from viewer.drawing.frame import render_frame
from viewer.drawing.renderer import Renderer
from viewer.drawing.request import Request
from viewer.gpu import gl
from viewer.gpu.pose import GpuPose
from viewer.picture.surface import Surface
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose
from viewer.splatting import tiles
from viewer.splatting.amplify import FEEDS, Points
from viewer.splatting.lists import TileLists
from viewer.view import View

pytestmark = pytest.mark.backend("surfels")
Draw = Callable[..., Surface]


@pytest.fixture
def surfels(draw: Draw) -> Draw:
    """surfels(cloud, camera, size, instancing=..., ...): one finished Surface."""

    def surfels(cloud: PointCloud, camera: Camera, size: tuple[int, int] = SIZE, **params: object) -> Surface:
        return draw(cloud, camera, size, "surfels", params=params)

    return surfels


def assert_blends_alike(one: Surface, other: Surface) -> None:
    """Colours are a level apart, but at borders of splats: of a thousandth of the pixels in software, of more
    where a rasteriser moved corners."""
    away = np.abs(one.image().astype(int) - other.image()).max(axis=-1)
    assert np.count_nonzero(away > 1) <= max(1e-3 * away.size, at_borders(one))


@every_camera
@pytest.mark.parametrize("radius", ["own", "uniform"])
def test_feeds_from_buffers_give_the_same_bits(surfels: Draw, camera: Camera, radius: str) -> None:
    first = surfels(CLOUD, camera, instancing="tbo", radius=radius)
    assert (first.row != NOTHING).any()
    for feed in BUFFERS:
        assert_equal(surfels(CLOUD, camera, instancing=feed, radius=radius), first)


@every_camera
@pytest.mark.parametrize("way", ["gs", "tiles"])
def test_other_ways_agree_with_them(surfels: Draw, camera: Camera, way: str) -> None:
    assert_agree(surfels(CLOUD, camera, instancing=way), surfels(CLOUD, camera, instancing="tbo"), 0.005)


@pytest.mark.slow
def test_of_100_000_splats_next_to_none_changes(surfels: Draw) -> None:
    """A share of the pixels: where more splats stand in a pixel, more of them are equally near."""
    cloud, camera, size = sphere(100_000), Camera((0.3, 0.5, 2.6), fov_y=46), (1920, 1280)
    pictures = {way: surfels(cloud, camera, size, instancing=way) for way in ("gs", "tbo", "tiles")}
    assert np.count_nonzero(pictures["tbo"].row != NOTHING) > 1_000_000
    assert_agree(pictures["gs"], pictures["tbo"], 0.003)
    assert_agree(pictures["tiles"], pictures["tbo"], 0.005)


@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
def test_splats_that_face_away_are_left_out_only_where_they_are_hidden(
    surfels: Draw, projection: str
) -> None:
    """Which way a disc faces decides when it is looked at, not whether it is seen."""
    camera = CAMERAS[projection]
    turned = np.where(np.random.default_rng(0).random((len(CLOUD), 1)) < 0.5, -1, 1).astype(np.float32)
    assert CLOUD.normals is not None
    other = replace(CLOUD, normals=CLOUD.normals * turned)
    one, two = (surfels(cloud, camera, instancing="tiles") for cloud in (CLOUD, other))
    # What the first found is read back as depths; last bits may be lost on the way.
    if not one.gpu.software:
        covered = one.row != NOTHING
        np.testing.assert_array_equal(covered, two.row != NOTHING)
        error = np.abs(two.depth[covered] / one.depth[covered] - 1)
        assert (error <= stored(one, one.depth[covered], times=2)).all()
        return
    if projection == "perspective":
        assert_equal(one, two)
    assert np.count_nonzero(one.row != two.row) <= 5
    np.testing.assert_allclose(one.depth, two.depth, rtol=2e-7)


@pytest.mark.parametrize("way", ["tiles", *FEEDS])
def test_culling_leaves_out_what_faces_away_and_counts_it(surfels: Draw, way: str) -> None:
    camera = CAMERAS["perspective"]
    all_of_it = surfels(CLOUD, camera, instancing=way)
    culled = surfels(CLOUD, camera, instancing=way, cull_back=True)
    assert "away" not in all_of_it.point_counts()
    counts = culled.point_counts()
    to_eye = np.array(camera.eye) - CLOUD.world()
    away = np.einsum("ij,ij->i", CLOUD.normals, to_eye) < 0
    assert counts["away"] == np.count_nonzero(away)
    assert counts.pop("in") == sum(counts.values())
    assert not np.isin(culled.row, np.flatnonzero(away)).any()
    front = ~np.isin(all_of_it.row, [*np.flatnonzero(away), NOTHING])
    np.testing.assert_array_equal(culled.row[front], all_of_it.row[front])


def test_the_same_bits_again(surfels: Draw) -> None:
    first = surfels(CLOUD, CAMERAS["perspective"])
    surfels(sphere(500), CAMERAS["inside"], (90, 70))
    again = surfels(CLOUD, CAMERAS["perspective"])
    assert_equal(first, again)
    np.testing.assert_array_equal(first.image(), again.image())


@pytest.mark.parametrize(
    "camera",
    [
        pytest.param(camera, id=name, marks=[] if name == "inside" else [pytest.mark.slow])
        for name, camera in CAMERAS.items()
    ],
)
@pytest.mark.usefixtures("short_spans")
def test_pixels_may_be_shared_out_as_hardware_likes(
    renderer: Renderer, surfels: Draw, camera: Camera, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What lists say of parts leaves out no pixel, of ellipses seen edge on neither, in any pass. It does not
    show either which of them are blended before what faces away is listed: those without a gap."""
    monkeypatch.setattr(tiles, "_LARGE_COST", 0)  # else it is for the length of lists to tell who draws
    random = np.random.default_rng(5)
    normals = random.normal(size=(3000, 3))
    long = np.cross(normals, random.normal(size=(3000, 3)))
    long *= 0.2 / np.linalg.norm(long, axis=1, keepdims=True)
    ellipses = PointCloud.from_arrays(
        random.normal(size=(3000, 3)),
        normals=normals,
        axes=np.concatenate([long, np.full((3000, 1), 0.05)], axis=1),
    )
    kinds: tuple[dict[str, object], ...] = (
        {"passes": "one"},
        {"passes": "two"},
        {"passes": "two", "enlarge": 1.0},
        {"passes": "two", "enlarge": 1.0, "radius_scale": 0.6},
    )
    scenes = [(cloud, kind) for cloud in (CLOUD, ellipses) for kind in kinds]
    others = [surfels(cloud, camera, instancing="tiles", **kind) for cloud, kind in scenes]
    monkeypatch.setattr(renderer.gpu, "software", not renderer.gpu.software)
    for (cloud, kind), other in zip(scenes, others, strict=True):
        surface = surfels(cloud, camera, instancing="tiles", **kind)
        assert_equal(surface, other)
        np.testing.assert_array_equal(surface.image(), other.image())


@pytest.mark.usefixtures("short_spans")
def test_what_tiles_cannot_hold_is_rasterised(
    renderer: Renderer, surfels: Draw, monkeypatch: pytest.MonkeyPatch
) -> None:
    def rasterised(cloud: PointCloud, camera: Camera, size: tuple[int, int], cull_back: bool = False) -> str:
        """Why; the picture is that of the rasteriser."""
        given = {"cull_back": cull_back, "share": 1.0}
        surface = surfels(cloud, camera, size, instancing="tiles", **given)
        assert_equal(surface, surfels(cloud, camera, size, instancing="gs", **given))
        return surface.stats.skipped["tiles"]

    with monkeypatch.context() as patched:
        patched.setattr(tiles, "_MOST_PIXELS", 80)
        assert "along an edge" in rasterised(CLOUD, CAMERAS["perspective"], SIZE)
    huge = sphere(300)
    assert "large splats" in rasterised(huge, Camera((0.3, 0.5, 1.2)), (1600, 1200), cull_back=True)
    monkeypatch.setattr(renderer.gpu, "max_storage_bytes", 16 * len(CLOUD))
    assert "entries" in rasterised(CLOUD, CAMERAS["perspective"], (1280, 960))
    monkeypatch.setattr(renderer.gpu, "max_storage_bytes", 16 * len(CLOUD) - 1)
    assert "points" in rasterised(CLOUD, CAMERAS["perspective"], SIZE)


@pytest.mark.usefixtures("short_spans")
def test_some_large_splats_among_many(surfels: Draw) -> None:
    """A wall behind a sphere: its splats are as large as the picture."""
    cloud, camera = _before_a_wall()
    surface = surfels(cloud, camera, (800, 600), instancing="tiles")
    assert "3 rasterised" in surface.stats.skipped.values()
    assert len(CLOUD) in surface.row
    assert_agree(surface, surfels(cloud, camera, (800, 600), instancing="tbo"), 0.003)


@pytest.mark.parametrize("passes", ["one", "two"])
def test_software_lists_splats_as_large_as_the_picture(
    renderer: Renderer, surfels: Draw, passes: str
) -> None:
    if not renderer.gpu.software:
        pytest.skip("hardware has large splats rasterised")
    cloud, camera = _before_a_wall()
    surface, quads = (
        surfels(cloud, camera, (800, 600), instancing=way, passes=passes, enlarge=1.0)
        for way in ("tiles", "tbo")
    )
    assert not any("rasterised" in told for told in surface.stats.skipped.values())
    assert len(CLOUD) in surface.row
    assert_agree(surface, quads, 0.003)


@pytest.mark.parametrize("projection", ["perspective", *rarely("orthographic")])
def test_splats_across_the_near_plane_beside_the_picture_change_nothing(
    surfels: Draw, projection: str
) -> None:
    """Of those, a ring around the eye, none is rasterised; those in view are, and shown as ever."""
    camera = Camera((0.0, 0.1, 0.2), (0.1, 0.0, 3.0), fov_y=40, near=0.05, projection=projection, height=0.8)
    across = _across_near(camera)
    assert np.count_nonzero(across) > 100
    ring = surfels(CLOUD, camera, instancing="tiles")
    assert not any("rasterised" in told for told in ring.stats.skipped.values())
    assert CLOUD.normals is not None
    assert CLOUD.radii is not None
    others = PointCloud.from_arrays(
        CLOUD.world()[~across], normals=CLOUD.normals[~across], radii=CLOUD.radii[~across]
    )
    np.testing.assert_allclose(ring.depth, surfels(others, camera, instancing="tiles").depth, rtol=2e-6)

    forward = np.subtract(camera.target, camera.eye) / np.linalg.norm(np.subtract(camera.target, camera.eye))
    before = np.array(camera.eye) + 0.05 * forward + [[0.0, 0.0, 0.0], [0.01, 0.01, 0.01], [0.0, 0.5, 0.0]]
    cloud = PointCloud.from_arrays(
        np.concatenate([CLOUD.world(), before]),
        normals=np.concatenate([CLOUD.normals, [[0.5, 0.5, 0.2]] * 3]),
        radii=np.concatenate([CLOUD.radii, [0.01, 0.02, 0.03]]),
    )
    tiled, quads = (surfels(cloud, camera, instancing=way) for way in ("tiles", "gs"))
    assert "2 rasterised" in tiled.stats.skipped.values()
    assert {len(CLOUD), len(CLOUD) + 1} <= set(tiled.row.ravel())
    assert_agree(tiled, quads, 0.003)


def _across_near(camera: Camera) -> NDArray[np.bool_]:
    """Which discs of CLOUD may reach to both sides of the near plane."""
    forward = np.subtract(camera.target, camera.eye)
    depths = (CLOUD.world() - camera.eye) @ (forward / np.linalg.norm(forward))
    return np.abs(depths - camera.near) < CLOUD.radii


def _before_a_wall() -> tuple[PointCloud, Camera]:
    """A sphere, and three splats behind it that are as large as the picture."""
    wall = {"positions": [[0, 0, -3.0 - i] for i in range(3)], "normals": [[0.1, 0, 1.0]] * 3}
    cloud = PointCloud.from_arrays(
        np.concatenate([CLOUD.world(), wall["positions"]]),
        normals=np.concatenate([CLOUD.normals, wall["normals"]]),  # type: ignore[list-item]
        radii=np.concatenate([CLOUD.radii, [5.0] * 3]),  # type: ignore[list-item]
    )
    return cloud, Camera((0.0, 0.0, 3.0), (0, 0, 0), fov_y=60)


def test_a_feed_packs_when_it_is_chosen_and_the_pose_counts_it(renderer: Renderer) -> None:
    pose = Pose(0, 0.0, "test", CLOUD)
    surface = Surface(renderer.gpu, SIZE)

    def held(way: str) -> int:
        params = backend("surfels").params({"instancing": way})
        render_frame(renderer, Request(pose, CAMERAS["perspective"], "surfels", params), surface)
        return renderer.bytes_of(pose)

    bare = held("gs")
    assert held("tbo") == held("vbo") == held("pull") == bare
    packed = held("ubo") - bare
    assert 7 * 4 * len(CLOUD) <= packed < 7 * 4 * len(CLOUD) + (1 << 16), "and one block at most more"
    assert held("ubo") == held("gs") == bare + packed


def test_lists_belong_to_the_surface_and_follow_the_poses(renderer: Renderer) -> None:
    surface = Surface(renderer.gpu, SIZE)
    sizes: list[int] = []
    for count in (100, 50_000, 60_000, 1000):
        pose = Pose(0, 0.0, "test", sphere(count))
        params = backend("surfels").params({"instancing": "tiles"})
        render_frame(renderer, Request(pose, CAMERAS["perspective"], "surfels", params), surface)
        lists = surface.cached(TileLists)
        assert lists.length, "those that were drawn with"
        sizes.append(lists.nbytes)
        assert surface.nbytes >= sizes[-1] >= 40 * count
    assert sizes[:3] == sorted(sizes[:3])
    assert sizes[3] < sizes[1] / 10, "room for a much larger pose is given up"


def test_what_is_chosen_stands_in_the_statistics(renderer: Renderer, surfels: Draw) -> None:
    surface = surfels(CLOUD, CAMERAS["perspective"])
    chosen = surface.stats.chosen["instancing"]
    assert chosen == "tiles" if renderer.gpu.software else chosen in ("tiles", *FEEDS)
    assert_equal(surface, surfels(CLOUD, CAMERAS["perspective"], instancing=chosen))
    assert "instancing" not in surfels(CLOUD, CAMERAS["perspective"], instancing="gs").stats.chosen


_MAKING = """
#include "common/item.glsl"
layout(std430, binding = 0) readonly buffer Positions { float positions[]; };
layout(std430, binding = 1) writeonly buffer Normals { float normals[]; };
layout(std430, binding = 2) writeonly buffer Radii { float radii[]; };
void main() {
    uint i = item();
    if (i >= uint(radii.length())) return;
    vec3 normal = normalize(vec3(positions[3u * i], positions[3u * i + 1u], positions[3u * i + 2u]));
    for (uint k = 0u; k < 3u; ++k) normals[3u * i + k] = normal[k];
    radii[i] = 0.03 + 0.01 * normal.x;
}
"""


@pytest.mark.parametrize("passes", ["one", "two", "one_blended", "sorted"])
def test_statistics_tell_what_feed_really_ran(surfels: Draw, passes: str) -> None:
    """Uniform blocks bring what the pose stores: no radii that were found on the GPU, no sorted points."""
    camera, bare = CAMERAS["perspective"], replace(CLOUD, radii=None)
    for cloud, replaced in ((CLOUD, passes == "sorted"), (bare, True)):
        by = {feed: surfels(cloud, camera, instancing=feed, passes=passes) for feed in ("ubo", "tbo")}
        told = by["ubo"].stats.chosen.get("instancing", "")
        assert told.startswith("tbo instead of ubo") == replaced, told
        assert "instancing" not in by["tbo"].stats.chosen
        assert_equal(by["ubo"], by["tbo"])


@pytest.mark.parametrize("feed", ["tiles", *FEEDS])
def test_points_take_what_a_compute_pass_made(renderer: Renderer, tmp_path: Path, feed: str) -> None:
    gpu, count = renderer.gpu, len(CLOUD)
    (shader := tmp_path / "making.comp").write_text(_MAKING, encoding="utf-8")
    bare = GpuPose(gpu, Pose(0, 0.0, "test", PointCloud.from_arrays(CLOUD.positions)))
    normals = gl.BufferTexture(gpu.ctx.buffer(reserve=12 * count), gl.RGB32F)
    radii = gl.BufferTexture(gpu.ctx.buffer(reserve=4 * count), gl.R32F)
    for binding, made in enumerate((bare.array("positions"), normals, radii)):
        made.buffer.bind_to_storage_buffer(binding)
    gpu.dispatch(gpu.compute(str(shader)), count)
    stored = replace(
        bare.cloud,
        normals=np.frombuffer(normals.buffer.read(), np.float32).reshape(-1, 3),
        radii=np.frombuffer(radii.buffer.read(), np.float32),
    )
    splats = surfels_backend._splats(surfels_backend.Params(), 0.0)
    buffers = {"normals": normals, "radii": radii}
    pictures = []
    for points in (
        Points(bare, use_radii=True, count=count, buffers=buffers),
        Points(GpuPose(gpu, Pose(0, 0.0, "test", stored)), use_radii=True, count=count),
    ):
        surface = Surface(gpu, SIZE)
        surface.start(points.pose, View.of(CAMERAS["inside"], SIZE, stored.origin, stored.bounds()))
        surfels_backend._draw_nearest(points, surface, feed, splats)
        pictures.append(surface)
    assert (pictures[0].row != NOTHING).any()
    assert_equal(*pictures)
    assert bare.uploaded_bytes == 12 * count, "positions alone"

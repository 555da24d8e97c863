"""Voxels against exact cubes, and what a cut of an octree has to show."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import cast

import numpy as np
import pytest
from hardware import displaced, stored
from numpy.typing import NDArray
from scenes import NOTHING, looking_down_z, rarely_together, sphere, sphere_hits
from scipy import ndimage
from scipy.ndimage import distance_transform_edt
from scipy.spatial import cKDTree
from splat_scenes import assert_agree

from viewer.analysis.pick import pick
from viewer.backends import backend
from viewer.backends.voxels import Params, cuts
from viewer.bench.scenes.catalog import subject
from viewer.camera import Camera
from viewer.drawing.frame import draw_plan, render_frame
from viewer.drawing.plan import Effort, Ready, make_plan
from viewer.drawing.renderer import Renderer
from viewer.drawing.request import Request
from viewer.look import Look
from viewer.mesh.reference import trace
from viewer.picture.surface import Surface
from viewer.scan import formats
from viewer.scan.octree import Octree
from viewer.scan.octree.build import Stop
from viewer.scan.octree.storage import from_bytes
from viewer.scan.octree.stored import octree_of
from viewer.scan.open import open_scan
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose
from viewer.scan.spacing import typical_spacing
from viewer.splatting.amplify import FEEDS

pytestmark = pytest.mark.backend("voxels")
Draw = Callable[..., Surface]
SIZE = (96, 72)
CLOUD = sphere(1200)
CAMERAS = {
    "perspective": Camera.orbit(CLOUD.bounds(), 30, 20, aspect=4 / 3),
    "orthographic": Camera.orbit(CLOUD.bounds(), 30, 20, aspect=4 / 3, projection="orthographic"),
    "close": Camera((0.2, 0.1, 1.25), (0.0, 0.0, 0.0), fov_y=30),
    "inside": Camera((0.0, 0.1, 0.2), (0.6, 0.3, 0.5), fov_y=70),
    "near plane": Camera((0.0, 0.1, 1.5), (0.0, 0.0, 0.0), fov_y=70, near=0.6),
}
every_camera = pytest.mark.parametrize("camera", CAMERAS.values(), ids=CAMERAS)


def voxels(draw: Draw, cloud: PointCloud, camera: Camera, size=SIZE, look=None, **params: object) -> Surface:
    return draw(cloud, camera, size, "voxels", look, params)


def rays(surface: Surface, off: tuple[float, float] = (0.0, 0.0)) -> tuple[NDArray, NDArray]:
    """Origins and directions through pixels, (H, W, 3), along which depth is the parameter; float64,
    relative to the origin. off: pixels from their centres."""
    width, height = surface.size
    y, x = np.mgrid[0:height, 0:width] + 0.5
    pixels = np.stack([x + off[0], y + off[1]], axis=-1).reshape(-1, 2)
    at_one, at_two = (surface.view.unproject(pixels, np.full(len(pixels), depth)) for depth in (1.0, 2.0))
    along = at_two - at_one
    return (at_one - along).reshape(height, width, 3), along.reshape(height, width, 3)


def exact(surface: Surface, off: tuple[float, float] = (0.0, 0.0)) -> tuple[NDArray, NDArray]:
    """Depth and row of the nearest of the cubes that a surface shows, cube by cube in float64.

    off: as `rays` has it.
    """
    cubes, view = surface.pose.cloud, surface.view
    pixel = 0.7072 / view.scale  # the least half of an edge, at depth 1 where there is perspective
    near, along = rays(surface, off)
    depth, row = np.full(surface.size[::-1], np.inf), np.full(surface.size[::-1], NOTHING, np.uint32)
    for i, (center, half) in enumerate(zip(cubes.positions.astype(float), cubes.radii.astype(float))):  # type: ignore[union-attr]  # noqa: B905
        half = max(half, pixel * max(float(view.depths(center)), view.near) ** view.perspective)
        with np.errstate(divide="ignore", invalid="ignore"):
            ends = np.stack([(center - half - near) / along, (center + half - near) / along])
        enter, leave = ends.min(axis=0).max(axis=-1), ends.max(axis=0).min(axis=-1)
        first = (enter <= leave) & (enter >= view.near) & (enter < depth)
        depth[first], row[first] = enter[first], i
    return depth, row


@pytest.mark.parametrize(
    ("depth", "least"), [(3, 0.0), (21, 0.25), *rarely_together((3, 0.25), (5, 0.0), (5, 0.25), (21, 0.0))]
)
@every_camera
def test_a_pixel_shows_the_nearest_cube(draw: Draw, camera: Camera, depth: int, least: float) -> None:
    fixed = {"shape": "cubes", "max_depth": depth, "least": least, "pixel_threshold": 0.25}
    surface = voxels(draw, CLOUD, camera, **fixed)
    depths, rows = (
        np.stack(each) for each in zip(*(exact(surface, off) for off in displaced(surface.gpu)), strict=True)
    )
    expected = np.clip(surface.depth, depths.min(axis=0), depths.max(axis=0))
    row, clear = rows[0], (rows == rows[0]).all(axis=0)  # on no border, as far as a rasteriser moves these
    seen, there = surface.row != NOTHING, row != NOTHING
    assert (clear & (seen != there)).mean() <= 2e-4
    both = seen & there
    same = both & (surface.row == row)
    np.testing.assert_allclose(surface.depth[same], expected[same], rtol=2e-4)
    others = both & clear & ~same
    along_axis = camera is CAMERAS["near plane"]  # in x: rays of one column run within faces
    assert others.mean() <= (0.03 if along_axis else 2e-3)
    error = np.abs(surface.depth[others] / expected[others] - 1)
    assert np.count_nonzero(error > 1e-5) <= (2e-3 if along_axis else 1e-3) * both.sum()


@pytest.mark.parametrize("shape", ["discs", "cubes"])
@every_camera
def test_feeds_from_buffers_give_the_same_bits_and_the_others_agree(
    draw: Draw, camera: Camera, shape: str
) -> None:
    fixed = {"max_depth": 5, "least": 0.0, "shape": shape}
    feeds = {feed: voxels(draw, CLOUD, camera, (400, 300), instancing=feed, **fixed) for feed in FEEDS}
    for feed in FEEDS:
        assert "splat" not in feeds[feed].stats.skipped, "all are drawn as such"
        assert "instancing" not in feeds[feed].stats.chosen, "by the feed that was asked for"
    for feed in ("ubo", "vbo", "pull"):
        np.testing.assert_array_equal(feeds["tbo"].row, feeds[feed].row)
        np.testing.assert_array_equal(feeds["tbo"].depth, feeds[feed].depth)
    assert_agree(feeds["gs"], feeds["tbo"], 0.003)
    chosen = voxels(draw, CLOUD, camera, (400, 300), **fixed)
    feeds_of_auto = ("gs",) if chosen.gpu.software else FEEDS  # on hardware whatever was fastest
    ways = ("scatter", "tiles", *feeds_of_auto, *(f"scatter, {feed}" for feed in feeds_of_auto))
    assert chosen.stats.chosen["instancing"] in ways
    assert (chosen.row != feeds["tbo"].row).mean() < 0.02


def test_no_octant_of_the_picture_is_missing(draw: Draw) -> None:
    """Each point that faces the eye shows its octant, or one before it."""
    surface = voxels(draw, CLOUD, CAMERAS["perspective"])
    to_eye = np.array(CAMERAS["perspective"].eye) - CLOUD.world()
    facing = (CLOUD.normals * to_eye).sum(axis=1) > 0.3 * np.linalg.norm(to_eye, axis=1)
    assert facing.sum() > 300
    pixels, depths = surface.view.project(CLOUD.positions[facing].astype(float))
    x, y = pixels.astype(int).T
    radius = float(surface.pose.cloud.radii.max())  # type: ignore[union-attr]
    assert (surface.depth[y, x] <= depths + radius).all()


def before_surface(surface: Surface, true_depth: NDArray[np.floating]) -> NDArray[np.float64]:
    """How far what is seen lies behind the surface, signed, along the rays of pixels that see both; (N,), in
    scan units."""
    both = (surface.row != NOTHING) & np.isfinite(true_depth)
    _, along = rays(surface)
    return (surface.depth[both] - true_depth[both]) * np.linalg.norm(along, axis=-1)[both]


@pytest.mark.parametrize("count", [4000, 40_000])
@pytest.mark.parametrize("shape", ["discs", "cubes"])
def test_what_is_seen_is_the_surface(draw: Draw, shape: str, count: int) -> None:
    """Of a sphere, each pixel along its ray, in edges of leaves.

    A disc of radius r touches it at its centre, or, where that is the mean of points up to a leaf's diagonal
    apart, under it: it lies before it by r^2 / 2, behind it by diagonal^2 / 8, at most. A cube holds some of
    the surface in its octant, and all of that lies in cubes.
    """
    cloud = sphere(count)
    camera = Camera.orbit(cloud.bounds(), 30, 20, aspect=4 / 3)
    surface = voxels(draw, cloud, camera, (160, 120), shape=shape, pixel_threshold=0.25)
    true_depth, normal = sphere_hits(camera, (160, 120))
    both = np.isfinite(true_depth)
    assert (surface.row != NOTHING)[both].all(), "a hole"
    _, along = rays(surface)
    facing = -np.einsum("ijk,ijk->ij", normal, along)[both] / np.linalg.norm(along, axis=-1)[both]
    octree = backend("voxels").derive(Pose(0, 0.0, "", cloud), Params(), None)
    edge = octree.size(octree.depth)
    size = surface.pose.cloud.radii[surface.row[both]].astype(float)  # type: ignore[union-attr, index]
    away = before_surface(surface, true_depth) * facing / edge
    rounding = 1e-4
    if shape == "discs":
        assert (away >= -(size**2) / 2 / edge - rounding).all()
        assert away.max() <= 3 * edge / 8 + rounding
    else:
        assert (away >= -np.sqrt(3) * (size / edge + 0.5)).all()
        assert away.max() <= rounding


def test_discs_are_nearer_to_the_surface_than_faces_of_cubes_are(draw: Draw) -> None:
    camera = CAMERAS["perspective"]
    true_depth, _ = sphere_hits(camera, SIZE)
    discs, cubes = (
        np.abs(before_surface(voxels(draw, CLOUD, camera, shape=shape), true_depth))
        for shape in ("discs", "cubes")
    )
    assert np.median(discs) < 0.2 * np.median(cubes)


def test_an_octant_is_as_large_as_the_picture_asks(draw: Draw) -> None:
    for threshold in (1.0, 6.0):
        fixed = {"shape": "cubes", "least": 0.0, "pixel_threshold": threshold}
        surface = voxels(draw, CLOUD, CAMERAS["perspective"], **fixed)
        cubes, octree = surface.pose.cloud, backend("voxels").derive(Pose(0, 0.0, "", CLOUD), Params(), None)
        size = 2 * cubes.radii * surface.view.scale / surface.view.depths(cubes.positions)  # type: ignore[operator]
        inner = cubes.radii > 0.75 * octree.size(octree.depth)  # type: ignore[operator]
        assert inner.any() == (threshold > 1)
        assert (size[inner] <= threshold).all()
        assert (size[~inner] <= 2 * threshold).all() or not inner.any()
        assert surface.stats.left_out == 0


def test_normals_are_those_of_the_points_or_of_the_faces(draw: Draw) -> None:
    camera = CAMERAS["perspective"]
    smooth, flat = (
        voxels(draw, CLOUD, camera, max_depth=5, shape=shape) for shape in ("cubes", "flat_cubes")
    )
    seen = smooth.row != NOTHING
    np.testing.assert_array_equal(smooth.depth, flat.depth)
    direction = smooth.pose.cloud.positions[smooth.row[seen]] + CLOUD.origin
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    assert np.einsum("ij,ij->i", smooth.normal[seen], direction).min() > 0.9
    normal = flat.normal[seen]
    np.testing.assert_array_equal(np.sort(np.abs(normal), axis=1), [[0, 0, 1]] * len(normal))
    _, along = rays(flat)
    assert (np.einsum("ij,ij->i", normal, along[seen]) < 0).all(), "faces that face the eye"


def test_octants_are_numbered_and_a_pick_gives_their_first_point(draw: Draw, renderer: Renderer) -> None:
    colors = np.zeros((len(CLOUD), 3), np.uint8)
    colors[:, 0] = np.arange(len(CLOUD)) % 200
    cloud = PointCloud.from_arrays(
        CLOUD.world(), normals=CLOUD.normals, colors=colors, scalars={"row": np.arange(len(CLOUD))}
    )
    surface = voxels(draw, cloud, CAMERAS["perspective"], max_depth=4, look=Look(color_by="row"))
    octree = backend("voxels").derive(Pose(0, 0.0, "", cloud), Params(), None)
    starts = np.cumsum(octree.counts) - octree.counts
    octants = surface.octant
    assert octants is not None
    shown = np.unique(octants[octants != NOTHING])
    assert shown.min() >= starts[4]
    assert shown.max() < starts[5]
    ((y, x), *_) = np.argwhere(octants == shown[0])
    picked = pick(surface, int(x), int(y))
    assert picked is not None
    assert picked.row is not None
    assert picked.row == octree.attributes[4].rows[shown[0] - starts[4]]  # type: ignore[index]
    assert surface.id[y, x] == picked.id == picked.row
    np.testing.assert_array_equal(picked.point, cloud.world(picked.row))
    assert picked.scalars == {"row": picked.row}
    assert surface.value[y, x] == pytest.approx(picked.row)
    np.testing.assert_array_equal(surface.arrays()["octant"], octants)
    assert "octant" not in draw(cloud, CAMERAS["perspective"], SIZE, "points", None).arrays()


def test_ids_are_those_of_the_file(draw: Draw) -> None:
    """Points that were dropped count."""
    positions = np.concatenate([np.full((7, 3), np.nan), CLOUD.world()])
    normals = np.concatenate([np.zeros((7, 3)), CLOUD.normals])  # type: ignore[list-item]
    radii = np.concatenate([np.zeros(7), CLOUD.radii])  # type: ignore[list-item]
    cloud = PointCloud.from_arrays(positions, normals=normals, radii=radii)
    one, other = (voxels(draw, each, CAMERAS["perspective"]) for each in (CLOUD, cloud))
    np.testing.assert_array_equal(one.octant, other.octant)
    seen = one.id != NOTHING
    np.testing.assert_array_equal(one.id[seen] + 7, other.id[seen])


@pytest.mark.parametrize("shape", ["discs", "cubes", "flat_cubes"])
@pytest.mark.parametrize("far", [30.0, -1000.0, 1e6])
def test_a_stray_changes_nothing_but_where_it_is(draw: Draw, far: float, shape: str) -> None:
    camera = CAMERAS["perspective"]
    positions = np.concatenate([np.full((1, 3), far), CLOUD.world()])
    normals = np.concatenate([[[0, 0, 1]], CLOUD.normals])  # type: ignore[list-item]
    strayed = PointCloud.from_arrays(positions, normals=normals)
    alone = PointCloud.from_arrays(CLOUD.world(), normals=CLOUD.normals)
    one, other = (voxels(draw, each, camera, shape=shape) for each in (alone, strayed))
    seen = one.id != NOTHING
    np.testing.assert_array_equal(other.depth[seen], one.depth[seen])
    np.testing.assert_array_equal(other.id[seen], one.id[seen] + 1)
    assert np.count_nonzero((other.id != NOTHING) & ~seen) <= 9


def test_a_stray_is_seen_where_it_is_and_is_no_octant(draw: Draw) -> None:
    camera = Camera((0.0, 0.0, 200.0), (0.0, 0.0, 0.0), fov_y=30)
    positions = np.concatenate([CLOUD.world(), [[30.0, 0.0, 0.0]]])
    surface = voxels(draw, PointCloud.from_arrays(positions), camera)
    shown = surface.id == len(CLOUD)
    assert 1 <= np.count_nonzero(shown) <= 4
    assert surface.octant is not None
    assert (surface.octant[shown] == NOTHING).all()
    ((y, x), *_) = np.argwhere(shown)
    picked = pick(surface, int(x), int(y))
    assert picked is not None
    np.testing.assert_array_equal(picked.point, [30, 0, 0])


@pytest.mark.parametrize("color_by", ["row", "height", "depth"])
def test_colours_stand_for_the_same_values_in_every_view(draw: Draw, color_by: str) -> None:
    cloud = PointCloud.from_arrays(
        CLOUD.world(), normals=CLOUD.normals, scalars={"row": np.arange(len(CLOUD))}
    )
    for camera in (CAMERAS["perspective"], CAMERAS["close"]):
        shown, points = (
            draw(cloud, camera, SIZE, name, Look(color_by=color_by)) for name in ("voxels", "points")
        )
        assert shown.color_range == points.color_range


@pytest.mark.parametrize("by_shaders", [False, True])
def test_uploaded_octants_are_counted(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch, by_shaders: bool
) -> None:
    """Those of each new view, or, where shaders find these, the octree once."""
    monkeypatch.setattr(cuts, "BY_SHADERS", by_shaders)
    pose, surface = Pose(0, 0.0, "test", CLOUD), Surface(renderer.gpu, SIZE)
    request = Request(pose, CAMERAS["perspective"], "voxels", Params())
    for camera in (CAMERAS["perspective"], CAMERAS["close"]):
        render_frame(renderer, replace(request, camera=camera), surface)
        is_first = camera is CAMERAS["perspective"]
        assert (surface.stats.upload_ms > 0) == (is_first or not by_shaders)
        assert (surface.stats.uploaded_bytes > 0) == (is_first or not by_shaders)
        render_frame(renderer, replace(request, camera=camera), surface)
        assert surface.stats.upload_ms == 0


def test_what_faces_away_is_left_out_where_it_is_asked_for(draw: Draw) -> None:
    camera = CAMERAS["perspective"]
    everything, front = (voxels(draw, CLOUD, camera, cull_back=cull) for cull in (False, True))
    assert "octants facing away" in front.stats.skipped
    assert "octants facing away" not in everything.stats.skipped
    assert len(front.pose.cloud) < 0.7 * len(everything.pose.cloud)
    seen = np.isfinite(everything.depth)
    changed = seen != np.isfinite(front.depth)
    bound = 0.0 if front.gpu.software else stored(front, front.depth[seen], times=2)
    changed[seen] |= np.abs(everything.depth[seen] - front.depth[seen]) > bound * everything.depth[seen]
    assert changed.mean() < 0.02, "of a closed surface next to nothing is seen of the other side"


def test_octants_out_of_view_cost_nothing(draw: Draw) -> None:
    surface = voxels(draw, replace(CLOUD, radii=None), CAMERAS["close"])
    assert "octants out of view" in surface.stats.skipped
    assert len(surface.pose.cloud) < len(CLOUD) / 3


def test_fig_5_leaves_of_few_points_are_of_all_sizes(draw: Draw) -> None:
    """Slomp 2014, VI-A: a stray point keeps a large octant where these stop by occupancy."""
    stray = np.concatenate([CLOUD.positions, [[0.0, 0.0, 1.6]]])
    cloud = PointCloud.from_arrays(stray, normals=np.concatenate([CLOUD.normals, [[0, 0, 1]]]))  # type: ignore[list-item]
    fixed = {"shape": "cubes", "occupancy": 2, "least": 0.0, "pixel_threshold": 0.25}
    sizes = {
        stop: voxels(draw, cloud, CAMERAS["perspective"], stop=stop, **fixed)
        for stop in ("delta", "occupancy")
    }
    delta, occupancy = (np.unique(one.pose.cloud.radii) for one in sizes.values())
    assert len(delta) == 1
    assert len(occupancy) > 2
    assert occupancy.max() >= 4 * np.median(sizes["occupancy"].pose.cloud.radii)


def test_a_budget_gives_coarser_pictures_that_get_finer_and_never_open(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No pixel loses what it showed, but for few at the outline, and none shows the far side in its place.

    Of the CPU's cut: shaders find all octants at once.
    """
    monkeypatch.setattr(cuts, "BY_SHADERS", False)
    cloud = sphere(300_000)
    camera = Camera.orbit(cloud.bounds(), 30, 20, aspect=4 / 3)
    pose, surface = Pose(0, 0.0, "test", cloud), Surface(renderer.gpu, (640, 480))
    request = Request(pose, camera, "voxels", Params(depth=9, stop="depth", pixel_threshold=0.25))
    render_frame(renderer, request, surface)  # prepared
    seen, whole = surface.row != NOTHING, surface.depth.copy()
    turned = replace(request, camera=Camera.orbit(cloud.bounds(), 40, 20, aspect=4 / 3))
    first = Surface(renderer.gpu, (640, 480))
    refinable, drawn, depths = True, [], []
    while refinable:
        refinable = draw_plan(ready(renderer, turned), first, budget_ms=0)
        drawn.append(len(first.pose.cloud))
        if first.stats.coarseness < 0.1:  # before, few discs stand for all of the ball
            depths.append(first.depth.copy())
    assert len(depths) > 3
    assert drawn == sorted(drawn)
    finest = depths[-1]
    for depth in depths:
        assert not np.isinf(depth)[ndimage.binary_erosion(np.isfinite(finest))].any()
        assert (depth <= finest + 0.5)[np.isfinite(finest) & np.isfinite(depth)].all(), "the far side"
    again = replace(request, pose=pose)
    render_frame(renderer, again, surface)
    np.testing.assert_array_equal(surface.depth, whole)
    np.testing.assert_array_equal(surface.row != NOTHING, seen)


def ready(renderer: Renderer, request: Request) -> Ready:
    plan = make_plan(renderer, request, (640, 480), Effort.WAIT)
    assert isinstance(plan, Ready)
    return plan


@pytest.mark.parametrize("on_gpu", [False, True])
@pytest.mark.parametrize("change", ["pose", "camera", "preview"])
def test_no_unfinished_cut_is_coarser_than_the_picture_before(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch, change: str, on_gpu: bool
) -> None:
    """With no time at all, a new pose would begin with the root: one disc as large as the picture."""
    monkeypatch.setattr(cuts, "BY_SHADERS", on_gpu)
    camera = Camera.orbit(CLOUD.bounds(), 30, 20, aspect=4 / 3)
    request = Request(Pose(0, 0.0, "a", CLOUD), camera, "voxels", Params(pixel_threshold=0.25))
    surface, small = Surface(renderer.gpu, (640, 480)), Surface(renderer.gpu, (320, 240))
    draw_plan(ready(renderer, request), surface, budget_ms=0)
    coarse = surface.stats.coarseness
    assert coarse > 0.2, "the first picture ever may be coarse"
    while draw_plan(ready(renderer, request), surface, budget_ms=0):
        assert surface.stats.coarseness <= coarse
        coarse = surface.stats.coarseness
    whole = surface.pose.cloud.radii.max()  # type: ignore[union-attr]
    turned = replace(camera, eye=tuple(np.add(camera.eye, 0.1)))
    changed = {
        "pose": replace(request, pose=Pose(1, 1.0, "b", CLOUD.displaced(np.full((len(CLOUD), 3), 0.01)))),
        "camera": replace(request, camera=turned),
        "preview": replace(request, camera=turned),
    }[change]
    target = small if change == "preview" else surface
    draw_plan(ready(renderer, changed), target, budget_ms=0, before=surface)
    assert target.stats.coarseness == 0
    assert target.pose.cloud.radii.max() <= 1.1 * whole  # type: ignore[union-attr]


def test_a_stored_octree_is_drawn_as_stored(renderer: Renderer, tmp_path: Path) -> None:
    cloud = PointCloud.from_arrays(
        np.concatenate([CLOUD.world(), [[500.0, 0, 0]]]),
        normals=np.concatenate([CLOUD.normals, [[0, 0, 1]]]),  # type: ignore[list-item]
    )
    stop = Stop("depth", depth=4)
    formats.write_poses(tmp_path / "a.svo", iter([Pose(0, 0.0, "a", cloud)]), "mm", stop=stop)
    pose = open_scan(tmp_path / "a.svo").pose(0)
    stored = cast(Octree, backend("voxels").derive(pose, Params(), None))
    raw = from_bytes((tmp_path / "a.svo").read_bytes())
    for level, masks in enumerate(raw.masks):
        np.testing.assert_array_equal(stored.masks[level], masks)
        np.testing.assert_array_equal(stored.attributes[level].normals, raw.attributes[level].normals)
    assert stored.leaves + 1 == len(pose.cloud)
    assert stored.depth == 4
    assert stored.loss > 0.05, "coarser than Scan4D would build it"
    again = cast(Octree, backend("voxels").derive(pose, Params(stop="delta"), None))
    assert again.counts.sum() != stored.counts.sum()
    deepest = stored.attributes[-1].rows
    np.testing.assert_allclose(
        pose.cloud.world(deepest), stored.centers(stored.depth), atol=1e-4 * stored.size(stored.depth)
    )
    for level, masks in enumerate(stored.masks):
        children = np.repeat(np.arange(len(masks)), np.bitwise_count(masks))
        lowest = np.full(len(masks), NOTHING, np.uint32)
        np.minimum.at(lowest, children, stored.attributes[level + 1].rows)
        inner = masks > 0
        np.testing.assert_array_equal(stored.attributes[level].rows[inner], lowest[inner])
    surface = Surface(renderer.gpu, SIZE)
    request = Request(pose, Camera.orbit(pose.bounds, 30, 20, aspect=4 / 3), "voxels", Params())
    render_frame(renderer, request, surface)
    assert np.isfinite(surface.depth).mean() > 0.1


def test_moved_points_have_no_stored_octree(tmp_path: Path) -> None:
    formats.write_poses(tmp_path / "a.svo", iter([Pose(0, 0.0, "a", CLOUD)]), "mm")
    cloud = open_scan(tmp_path / "a.svo").pose(0).cloud
    assert octree_of(cloud) is not None
    assert octree_of(replace(cloud, colors=None)) is not None
    for other in (cloud.moved(np.ones(3)), cloud.displaced(np.ones(3)), cloud.of_rows(np.arange(9))):
        assert octree_of(other) is None
    turned = octree_of(replace(cloud, normals=-cloud.normals))
    assert turned is not None
    np.testing.assert_allclose(turned.attributes[-1].normals, -cloud.normals, atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(turned.attributes[3].normals, axis=1), 1, atol=1e-6)


@pytest.mark.parametrize("level", [4, 5, 6, 7])
def test_coarser_levels_stay_closed(draw: Draw, level: int) -> None:
    """A node's disc covers those below: per pixel, nothing of the finest picture is open in a coarser one."""
    cloud = sphere(40_000)
    camera = Camera.orbit(cloud.bounds(), 30, 20, aspect=4 / 3)
    finest, coarse = (
        voxels(draw, cloud, camera, (240, 180), max_depth=deep, pixel_threshold=0.25) for deep in (21, level)
    )
    if level < 6:
        assert coarse.octant.min() < finest.octant.min(), "others are shown"  # type: ignore[union-attr]
    inside = ndimage.binary_erosion(finest.row != NOTHING)
    assert np.isfinite(coarse.depth)[inside].all()
    assert (coarse.depth <= finest.depth + 0.5)[inside].all()


def test_the_same_view_is_not_cut_again(renderer: Renderer) -> None:
    pose, surface = Pose(0, 0.0, "test", CLOUD), Surface(renderer.gpu, SIZE)
    request = Request(pose, CAMERAS["perspective"], "voxels", Params())
    render_frame(renderer, request, surface)
    first = surface.pose
    render_frame(renderer, replace(request, look=Look(light="head")), surface)
    assert surface.pose is first
    render_frame(renderer, replace(request, camera=CAMERAS["close"]), surface)
    assert surface.pose is not first


def test_without_colours_normals_and_radii(draw: Draw) -> None:
    bare = PointCloud.from_arrays(CLOUD.world())
    surface = voxels(draw, bare, CAMERAS["perspective"])
    seen = surface.row != NOTHING
    assert np.linalg.norm(surface.normal[seen], axis=1).min() > 0.99, "they are estimated"
    given = voxels(draw, CLOUD, CAMERAS["perspective"])
    assert (seen != (given.row != NOTHING)).mean() < 0.01
    flat = voxels(draw, bare, CAMERAS["perspective"], shape="flat_cubes")
    assert flat.is_own("normal"), "faces are lit"
    assert backend("voxels").needs(Pose(0, 0.0, "", bare), Params(shape="flat_cubes")) == ()


@pytest.mark.parametrize("radius", [0.0, -1.0, np.nan, np.inf, 1e-6])
def test_radii_that_say_nothing_or_leave_gaps_change_nothing(draw: Draw, radius: float) -> None:
    odd = replace(CLOUD, radii=np.full(len(CLOUD), radius, np.float32))
    bare = replace(CLOUD, radii=None)
    shown, expected = (voxels(draw, cloud, CAMERAS["perspective"]) for cloud in (odd, bare))
    np.testing.assert_array_equal(shown.depth, expected.depth)


def test_discs_cover_what_the_radii_of_their_points_say(draw: Draw) -> None:
    """As surfels draw them, but for a leaf's width; not where the spacing is asked for."""
    radius = np.float32(3 * typical_spacing(CLOUD))
    large = replace(CLOUD, radii=np.full(len(CLOUD), radius, np.float32))
    options = {"passes": "one", "surface": "nearest"}
    shown = voxels(draw, large, CAMERAS["perspective"], pixel_threshold=0.25, **options)
    leaves = shown.pose.cloud
    assert leaves.radii is not None
    assert (leaves.radii == radius).all()
    discs = draw(large, CAMERAS["perspective"], SIZE, "surfels", params={**options, "radius": "own"})
    uncovered = (discs.row != NOTHING) & (shown.row == NOTHING)
    assert uncovered.sum() <= 1e-3 * (discs.row != NOTHING).sum()
    by_spacing = voxels(draw, large, CAMERAS["perspective"], radius="spacing")
    bare = voxels(draw, replace(CLOUD, radii=None), CAMERAS["perspective"])
    np.testing.assert_array_equal(by_spacing.depth, bare.depth)


def test_radii_that_another_backend_asked_for_change_nothing(renderer: Renderer) -> None:
    pose = Pose(0, 0.0, "", replace(CLOUD, radii=None))

    def depth(name: str, **params: object) -> NDArray:
        surface, chosen = Surface(renderer.gpu, SIZE), backend(name).params(params)
        render_frame(renderer, Request(pose, CAMERAS["perspective"], name, chosen), surface)
        return surface.depth.copy()

    expected = depth("voxels")
    depth("surfels", radius="own")
    np.testing.assert_array_equal(depth("voxels", occupancy=9), expected, "another key, the same octree")


@pytest.mark.parametrize("large", [False, True])
def test_octree_files_keep_radii(draw: Draw, tmp_path: Path, large: bool) -> None:
    """Up to 7 % larger; of a coarser octree, whose leaves stand for more points, they say nothing."""
    spacing = np.float32(typical_spacing(CLOUD))
    radii = np.linspace(2, 4, len(CLOUD), dtype=np.float32) * spacing if large else None
    cloud = replace(CLOUD, radii=radii)
    formats.write_poses(tmp_path / "a.svo", iter([Pose(0, 0.0, "a", cloud)]), "mm")
    scan = open_scan(tmp_path / "a.svo")
    found = scan.pose(0).cloud
    octree = octree_of(found)
    assert octree is not None
    assert found.radii is not None
    if radii is None:
        assert all(each.own_radii is None for each in octree.attributes)
        return
    nearest = cKDTree(cloud.world()).query(found.world())[1]
    alone = np.bincount(nearest, minlength=len(cloud))[nearest] == 1
    share = found.radii / radii[nearest]
    assert (share >= 1 - 1e-6).mean() > 0.95, "a leaf of two points may be nearer to the smaller one"
    assert (share[alone] <= 1.08).mean() > 0.95
    shown = voxels(draw, found, CAMERAS["perspective"], pixel_threshold=0.25)
    assert shown.pose.cloud.radii.min() > 1.5 * spacing  # type: ignore[union-attr]
    spaced = voxels(draw, found, CAMERAS["perspective"], pixel_threshold=0.25, radius="spacing")
    assert spaced.pose.cloud.radii.max() < 2 * shown.pose.cloud.radii.min()  # type: ignore[union-attr]


def test_the_depth_says_why_subdivision_ended(draw: Draw) -> None:
    twins = np.concatenate([CLOUD.positions, CLOUD.positions + np.float32(1e-7)])
    cloud = PointCloud.from_arrays(twins, normals=np.concatenate([CLOUD.normals] * 2))  # type: ignore[list-item]
    surface = voxels(draw, cloud, CAMERAS["perspective"], delta=0.0)
    assert "deepest level, 21" in surface.stats.chosen["depth"]
    assert "depth" not in voxels(draw, CLOUD, CAMERAS["perspective"]).stats.chosen


def test_one_and_no_point(draw: Draw) -> None:
    one = PointCloud.from_arrays([[0, 0, -3.0]], normals=[[0, 0, 1]], radii=[0.5])
    surface = voxels(draw, one, looking_down_z(), (33, 33))
    assert surface.id[16, 16] == 0
    none = PointCloud.from_arrays(np.zeros((0, 3)), normals=np.zeros((0, 3)))
    assert (voxels(draw, none, looking_down_z(), (33, 33)).row == NOTHING).all()


def test_it_is_a_backend_like_others() -> None:
    declared = backend("voxels")
    assert declared.title == "Voxels"
    assert {"stop", "delta", "depth", "occupancy"} <= {
        p.name for p in declared.parameters if p.affects == "derive"
    }


@pytest.mark.slow
@pytest.mark.parametrize("fixed", [{}, {"max_depth": 7}, {"max_depth": 6}], ids=str)
def test_the_demo_scan_is_closed_and_shows_the_surface(draw: Draw, fixed: dict[str, object]) -> None:
    """Each pixel against the exact surface, along its ray: nothing is open, nor open to the far side, where
    what is seen would lie farther behind than its disc reaches; half of the pixels are within 0.3 spacings.
    """
    moment = subject("demo", None).moment(0)
    mesh, size = moment.mesh, (320, 240)
    camera = Camera.orbit(mesh.bounds, 140, 20, aspect=4 / 3)
    truth = trace(mesh, camera, size)
    surface = voxels(draw, moment.pose.cloud, camera, size, pixel_threshold=0.25, **fixed)
    seen = surface.row != NOTHING
    assert (truth.covered & ~seen).sum() <= 1e-3 * truth.covered.sum()
    away = before_surface(surface, truth.depth)
    assert np.median(np.abs(away)) <= 0.3 * typical_spacing(moment.pose.cloud)
    radii = surface.pose.cloud.radii[surface.row[seen & truth.covered]]  # type: ignore[union-attr, index]
    assert (away > radii).mean() <= 1e-3
    pixel = truth.depth[truth.covered].mean() / surface.view.scale
    beside = distance_transform_edt(~truth.covered)[seen] * pixel
    assert np.quantile(beside, 0.99) <= 2 * np.median(surface.pose.cloud.radii)  # type: ignore[arg-type]

"""Voxels against exact cubes, and what a cut of an octree has to show."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scenes import NOTHING, looking_down_z, sphere
from scipy.ndimage import distance_transform_edt
from test_instancing import assert_agree

from viewer.analysis.pick import pick
from viewer.backends import backend
from viewer.backends.voxels import Params, derive
from viewer.bench.scenes.catalog import subject
from viewer.camera import Camera
from viewer.frame import Request, render_frame
from viewer.gpu.amplify import FEEDS
from viewer.gpu.surface import Surface
from viewer.look import Look
from viewer.mesh.reference import trace
from viewer.renderer import Renderer
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose

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


def rays(surface: Surface) -> tuple[NDArray, NDArray]:
    """Origins and directions through pixel centres, (H, W, 3), along which depth is the parameter; float64,
    relative to the origin."""
    width, height = surface.size
    y, x = np.mgrid[0:height, 0:width] + 0.5
    pixels = np.stack([x, y], axis=-1).reshape(-1, 2)
    at_one, at_two = (surface.view.unproject(pixels, np.full(len(pixels), depth)) for depth in (1.0, 2.0))
    along = at_two - at_one
    return (at_one - along).reshape(height, width, 3), along.reshape(height, width, 3)


def exact(surface: Surface) -> tuple[NDArray, NDArray]:
    """Depth and row of the nearest of the cubes that a surface shows, cube by cube in float64."""
    cubes, view = surface.pose.cloud, surface.view
    pixel = 0.7072 / view.scale  # the least half of an edge, at depth 1 where there is perspective
    near, along = rays(surface)
    depth, row = np.full(surface.size[::-1], np.inf), np.full(surface.size[::-1], NOTHING, np.uint32)
    for i, (center, half) in enumerate(zip(cubes.positions.astype(float), cubes.radii.astype(float))):  # type: ignore[union-attr]  # noqa: B905
        half = max(half, pixel * max(float(view.depths(center)), view.near) ** view.perspective)
        with np.errstate(divide="ignore", invalid="ignore"):
            ends = np.stack([(center - half - near) / along, (center + half - near) / along])
        enter, leave = ends.min(axis=0).max(axis=-1), ends.max(axis=0).min(axis=-1)
        first = (enter <= leave) & (enter >= view.near) & (enter < depth)
        depth[first], row[first] = enter[first], i
    return depth, row


@pytest.mark.parametrize("least", [0.0, 0.4])
@pytest.mark.parametrize("depth", [3, 5, 21])
@every_camera
def test_a_pixel_shows_the_nearest_cube(draw: Draw, camera: Camera, depth: int, least: float) -> None:
    surface = voxels(draw, CLOUD, camera, max_depth=depth, least=least, pixel_threshold=0.25)
    expected, row = exact(surface)
    seen = surface.row != NOTHING
    assert (seen != np.isfinite(expected)).mean() <= 2e-4
    both = seen & np.isfinite(expected)
    same = both & (surface.row == row)
    np.testing.assert_allclose(surface.depth[same], expected[same], rtol=1e-4)
    others = both & ~same
    along_axis = camera is CAMERAS["near plane"]  # in x: rays of one column run within faces
    assert others.mean() <= (0.03 if along_axis else 2e-3)
    error = np.abs(surface.depth[others] / expected[others] - 1)
    assert np.count_nonzero(error > 1e-5) <= (2e-3 if along_axis else 1e-3) * both.sum()


@every_camera
def test_feeds_from_buffers_give_the_same_bits_and_the_others_agree(draw: Draw, camera: Camera) -> None:
    fixed = {"max_depth": 5, "least": 0.0}
    feeds = {feed: voxels(draw, CLOUD, camera, (400, 300), instancing=feed, **fixed) for feed in FEEDS}
    assert "splat" not in feeds["gs"].stats.skipped, "cubes are large enough to be drawn as such"
    for feed in ("ubo", "vbo", "pull"):
        np.testing.assert_array_equal(feeds["tbo"].row, feeds[feed].row)
        np.testing.assert_array_equal(feeds["tbo"].depth, feeds[feed].depth)
    assert_agree(feeds["gs"], feeds["tbo"], 0.003)


def test_no_octant_of_the_picture_is_missing(draw: Draw) -> None:
    """Each point of the front shows its octant, or one before it."""
    surface = voxels(draw, CLOUD, CAMERAS["perspective"])
    pixels, depths = surface.view.project(CLOUD.positions.astype(float))
    x, y = pixels.astype(int).T
    edge = 2 * float(surface.pose.cloud.radii.max())  # type: ignore[union-attr]
    assert (surface.depth[y, x] <= depths + edge).all()


@pytest.mark.parametrize("level", [4, 5, 6, 7])
def test_what_is_seen_lies_within_a_cube_of_the_surface(draw: Draw, level: int) -> None:
    """Depth and silhouette of a sphere, each within one voxel everywhere; the picture is closed."""
    cloud = sphere(40_000)
    camera = Camera.orbit(cloud.bounds(), 30, 20, aspect=4 / 3)
    surface = voxels(draw, cloud, camera, max_depth=level, pixel_threshold=0.25)
    near, along = rays(surface)
    seen = surface.row != NOTHING
    half = surface.pose.cloud.radii[surface.row[seen]]  # type: ignore[index]
    edge = 2 * np.maximum(half, 0.75 * surface.depth[seen] / surface.view.scale)  # no less than a pixel
    places = (near + along * np.where(seen, surface.depth, 0)[..., None])[seen]
    away = np.abs(np.linalg.norm(places + cloud.origin, axis=1) - 1)
    assert (away <= np.sqrt(3) * edge).all()
    middle = -(near * along).sum(axis=-1) / (along**2).sum(axis=-1)  # of each ray, nearest to the sphere
    beside = np.linalg.norm(near + along * middle[..., None] + cloud.origin, axis=-1)
    assert seen[beside < 1].all(), "a hole"
    assert (beside[seen] <= 1 + np.sqrt(3) * edge).all()


def test_an_octant_is_as_large_as_the_picture_asks(draw: Draw) -> None:
    for threshold in (1.0, 6.0):
        surface = voxels(draw, CLOUD, CAMERAS["perspective"], least=0.0, pixel_threshold=threshold)
        cubes, (octree, _) = surface.pose.cloud, derive(Pose(0, 0.0, "", CLOUD), Params())
        size = 2 * cubes.radii * surface.view.scale / surface.view.depths(cubes.positions)  # type: ignore[operator]
        inner = cubes.radii > 0.75 * octree.size(octree.depth)  # type: ignore[operator]
        assert inner.any() == (threshold > 1)
        assert (size[inner] <= threshold).all()
        assert (size[~inner] <= 2 * threshold).all() or not inner.any()
        assert surface.stats.left_out == 0


def test_normals_are_those_of_the_points_or_of_the_faces(draw: Draw) -> None:
    camera = CAMERAS["perspective"]
    smooth, flat = (voxels(draw, CLOUD, camera, max_depth=5, normals=normals) for normals in ("auto", "flat"))
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
    octree, _ = derive(Pose(0, 0.0, "", cloud), Params())
    starts = np.cumsum(octree.counts) - octree.counts
    shown = np.unique(surface.id[surface.id != NOTHING])
    assert shown.min() >= starts[4]
    assert shown.max() < starts[5]
    ((y, x), *_) = np.argwhere(surface.id == shown[0])
    picked = pick(surface, int(x), int(y))
    assert picked is not None
    assert picked.row is not None
    assert picked.row == octree.attributes[4].rows[shown[0] - starts[4]]  # type: ignore[index]
    np.testing.assert_array_equal(picked.point, cloud.world(picked.row))
    assert picked.scalars == {"row": picked.row}
    assert surface.value[y, x] == pytest.approx(picked.row)


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


def test_octants_of_a_new_view_are_told_as_uploaded(renderer: Renderer) -> None:
    pose, surface = Pose(0, 0.0, "test", CLOUD), Surface(renderer.gpu, SIZE)
    request = Request(pose, CAMERAS["perspective"], "voxels", Params())
    for camera in (CAMERAS["perspective"], CAMERAS["close"]):
        render_frame(renderer, replace(request, camera=camera), surface)
        assert surface.stats.upload_ms > 0
        render_frame(renderer, replace(request, camera=camera), surface)
        assert surface.stats.upload_ms == 0


def test_what_faces_away_is_left_out_where_it_is_asked_for(draw: Draw) -> None:
    camera = CAMERAS["perspective"]
    everything, front = (voxels(draw, CLOUD, camera, cull_back=cull) for cull in (False, True))
    assert "octants facing away" in front.stats.skipped
    assert "octants facing away" not in everything.stats.skipped
    assert len(front.pose.cloud) < 0.7 * len(everything.pose.cloud)
    changed = (everything.depth != front.depth).mean()
    assert changed < 0.02, "of a closed surface next to nothing is seen of the other side"


def test_octants_out_of_view_cost_nothing(draw: Draw) -> None:
    surface = voxels(draw, CLOUD, CAMERAS["close"], least=0.0)
    assert "octants out of view" in surface.stats.skipped
    assert len(surface.pose.cloud) < len(CLOUD) / 3


def test_fig_5_leaves_of_few_points_are_of_all_sizes(draw: Draw) -> None:
    """Slomp 2014, VI-A: a stray point keeps a large octant where these stop by occupancy."""
    stray = np.concatenate([CLOUD.positions, [[0.0, 0.0, 1.6]]])
    cloud = PointCloud.from_arrays(stray, normals=np.concatenate([CLOUD.normals, [[0, 0, 1]]]))  # type: ignore[list-item]
    sizes = {
        stop: voxels(
            draw, cloud, CAMERAS["perspective"], stop=stop, occupancy=2, least=0.0, pixel_threshold=0.25
        )
        for stop in ("delta", "occupancy")
    }
    delta, occupancy = (np.unique(one.pose.cloud.radii) for one in sizes.values())
    assert len(delta) == 1
    assert len(occupancy) > 2
    assert occupancy.max() >= 4 * np.median(sizes["occupancy"].pose.cloud.radii)


def test_a_budget_gives_coarser_pictures_that_get_finer_and_never_open(renderer: Renderer) -> None:
    cloud = sphere(300_000)
    camera = Camera.orbit(cloud.bounds(), 30, 20, aspect=4 / 3)
    pose, surface = Pose(0, 0.0, "test", cloud), Surface(renderer.gpu, (640, 480))
    finest = Params(least=0.0, depth=9, stop="depth", pixel_threshold=0.25)
    request = Request(pose, camera, "voxels", finest)
    render_frame(renderer, request, surface)  # prepared
    seen, drawn = surface.row != NOTHING, []
    whole = surface.depth.copy()
    turned = replace(request, camera=Camera.orbit(cloud.bounds(), 40, 20, aspect=4 / 3))
    refinable = True
    covered = None
    while refinable:
        refinable = render_frame(renderer, turned, surface, wait=False)
        drawn.append(len(surface.pose.cloud))
        covered = surface.row != NOTHING if covered is None else covered
        if len(drawn) == 1:
            first = covered.mean()
    assert drawn == sorted(drawn)
    assert first >= (surface.row != NOTHING).mean() * 0.999
    again = replace(request, pose=pose)
    render_frame(renderer, again, surface)
    np.testing.assert_array_equal(surface.depth, whole)
    np.testing.assert_array_equal(surface.row != NOTHING, seen)


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
    assert surface.is_own("normal"), "faces are lit"
    covered = (surface.row != NOTHING).mean()
    smooth = voxels(draw, bare, CAMERAS["perspective"], normals="smooth")
    assert not smooth.is_own("normal")
    assert (smooth.row != NOTHING).mean() == covered
    assert np.linalg.norm(smooth.normal[smooth.row != NOTHING], axis=1).min() > 0.99


@pytest.mark.parametrize("radius", [0.0, -1.0, np.nan, np.inf, 2e38])
def test_radii_that_cannot_be_count_as_unknown(draw: Draw, radius: float) -> None:
    odd = replace(CLOUD, radii=np.full(len(CLOUD), radius, np.float32))
    bare = replace(CLOUD, radii=None)
    shown, expected = (voxels(draw, cloud, CAMERAS["perspective"], least=10.0) for cloud in (odd, bare))
    np.testing.assert_array_equal(shown.depth, expected.depth)


def test_the_depth_says_why_subdivision_ended(draw: Draw) -> None:
    twins = np.concatenate([CLOUD.positions, CLOUD.positions + np.float32(1e-7)])
    cloud = PointCloud.from_arrays(twins, normals=np.concatenate([CLOUD.normals] * 2))  # type: ignore[list-item]
    surface = voxels(draw, cloud, CAMERAS["perspective"], delta=0.0)
    assert "level 21" in surface.stats.chosen["depth"]
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


@pytest.mark.parametrize("fixed", [{}, {"max_depth": 7}, {"max_depth": 6, "least": 0.0}], ids=str)
def test_the_demo_scan_is_closed_and_within_a_voxel(draw: Draw, fixed: dict[str, object]) -> None:
    """Against the exact surface: no more than 0.1 % holes; each place and the outline within the diagonal of
    the voxel that shows it, which is as far as a point of the octant may be."""
    import open3d

    moment = subject("demo", None).moment(0)
    mesh, size = moment.mesh, (320, 240)
    camera = Camera.orbit(mesh.bounds, 140, 20, aspect=4 / 3)
    truth = trace(mesh, camera, size)
    surface = voxels(draw, moment.pose.cloud, camera, size, pixel_threshold=0.25, **fixed)
    seen = surface.row != NOTHING
    assert (truth.covered & ~seen).sum() <= 1e-3 * truth.covered.sum()
    pixel = surface.depth[seen] / surface.view.scale
    edge = 2 * np.maximum(surface.pose.cloud.radii[surface.row[seen]], 0.7072 * pixel)  # type: ignore[index]
    centers = np.argwhere(seen)[:, ::-1] + 0.5
    places = surface.view.unproject(centers, surface.depth[seen]) + moment.pose.cloud.origin - mesh.origin
    faces = open3d.t.geometry.RaycastingScene()
    faces.add_triangles(open3d.core.Tensor(mesh.points.positions), open3d.core.Tensor(mesh.faces))
    away = faces.compute_distance(open3d.core.Tensor(places.astype(np.float32))).numpy()
    assert (away <= np.sqrt(3) * edge).all()
    beside = distance_transform_edt(~truth.covered)[seen] * pixel
    assert (beside <= np.sqrt(3) * edge + pixel).all()

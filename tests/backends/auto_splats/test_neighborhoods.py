"""Neighbourhoods found in a picture are those of a k-d tree, for every visible point; so are the planes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bare_scenes import SCENES, SIZE, BareScene, every_scene, on_unit_sphere, ring_scene, seen
from numpy.typing import NDArray
from plain_neighborhoods import (
    PlainNeighborhoods,
    beside_lines,
    cell_reaches,
    certain_counts,
    neighborhoods,
    planes,
)
from scenes import rarely

import viewer
from viewer.analysis.visible_normals import NormalSearch, VisibleNormals, read_normals
from viewer.backends.auto_splats.neighborhoods import Neighborhoods, Search
from viewer.bench.metrics import angles_between
from viewer.bench.scenes import catalog
from viewer.camera import Camera
from viewer.drawing.renderer import Renderer
from viewer.errors import InputError
from viewer.picture.surface import Surface
from viewer.scan.open import open_scan
from viewer.scan.points import NOTHING, PointCloud
from viewer.scan.pose import Pose
from viewer.view import View

pytestmark = pytest.mark.backend("auto_splats")

K = 10
RULES = {"growth": 4.0, "alone": 8.0}  # by default
LEAST_COUNT, CERTAIN, TURNED = 6, 0.08, 12.0  # of adaptive planes: points, radians, degrees
EXACT = 4e-6  # of a radius: some roundings of float32
# Bounds of splats in radii of a point's share, and the factor on what cells reach.
LEAST_SHARE, MOST_SHARE, OPEN, LEANING = 0.9, 1.39, 1.75, 1.19
CROWDED = 4.0  # pixels within which hidden neighbours have no cell
FLAT, CLOSE = 0.38, 3  # of the second eigenvalue, up to which points lie on a plane; which neighbour counts
LINE, APART, BESIDE = 0.1, 0.4, 6.0  # when neighbours are on a line; radii that others beside it are away
DISTINCT = 1e-2  # shares of the largest eigenvalue between the lowest two, from which a normal is well known


def estimated(scene: BareScene, **params: Any) -> VisibleNormals:
    search = NormalSearch(**{"k": K, "adaptive": False, **params})
    return viewer.estimate_normals(pose_of(scene), scene.camera, size=scene.size, search=search)


def pose_of(scene: BareScene) -> Pose:
    return Pose(0, 0.0, "bare", scene.cloud)


def check(
    scene: BareScene, found: VisibleNormals, k: int = K, *, rounded: bool = False, **rules: float
) -> PlainNeighborhoods:
    """Compare with the reference, every visible point.

    rounded: whether distances that are equal but for rounding are common; planes are then not compared where
    the last neighbour is one of several.
    """
    cloud = scene.cloud
    true = neighborhoods(cloud, found.rows, found.neighbors, k, found.usual, **{**RULES, **rules})
    np.testing.assert_array_equal(found.counts, true.counts)
    np.testing.assert_allclose(found.radii, true.radii, rtol=EXACT, atol=0)
    fitted = planes(cloud, found.rows, true)
    clear = true.clear(EXACT) if rounded else np.ones(len(found.rows), bool)
    known = clear & fitted.distinct(DISTINCT) & ~fitted.on_lines(1.01 * LINE)
    angle = angles_between(found.normals[known], fitted.normals[known])
    assert np.minimum(angle, 180 - angle).max(initial=0) < 0.1
    np.testing.assert_allclose(np.linalg.norm(found.normals, axis=1), 1, atol=1e-4)
    np.testing.assert_allclose(found.curvatures[clear], fitted.curvature[clear], atol=1e-4)
    return true


def seen_rows(scene: BareScene, draw: Callable[..., Surface]) -> NDArray[np.intp]:
    """The rows that plain points of a pixel show."""
    rows = draw(scene.cloud, scene.camera, scene.size, "points").row
    return np.unique(rows[rows != NOTHING]).astype(np.intp)


@pytest.mark.parametrize("hidden_neighbors", [True, *rarely(False)])
@every_scene
def test_neighborhoods_are_those_of_a_tree(
    name: str, hidden_neighbors: bool, draw: Callable[..., Surface]
) -> None:
    scene = SCENES[name]()
    found = estimated(scene, hidden_neighbors=hidden_neighbors)
    visible = seen_rows(scene, draw)
    np.testing.assert_array_equal(np.sort(found.rows), visible)
    assert len(np.unique(found.neighbors)) == len(found.neighbors)
    assert np.isin(visible, found.neighbors).all()
    if not hidden_neighbors:
        np.testing.assert_array_equal(np.sort(found.neighbors), visible)
    check(scene, found)
    eye = np.array(scene.camera.eye) - scene.cloud.origin - scene.cloud.positions[found.rows]
    if scene.camera.projection == "orthographic":
        eye = np.broadcast_to(scene.camera.rotation()[2], eye.shape)
    towards = np.einsum("ij,ij->i", found.normals, eye) / np.linalg.norm(eye, axis=1)
    assert towards.min() > -1e-3
    assert not found.splat_radii[found.outliers].any()
    assert not found.hidden[np.isin(found.neighbors, visible)].any()


def pixel_sizes(scene: BareScene, rows: NDArray[np.integer]) -> NDArray[np.float64]:
    """What a pixel is wide at the depths of some points, (M,), scan units."""
    camera, height = scene.camera, scene.size[1]
    if camera.projection == "orthographic":
        return np.full(len(rows), camera.view_height / height)
    places = scene.cloud.positions[rows] + scene.cloud.origin
    depths = (np.array(camera.eye) - places) @ camera.rotation()[2]
    return depths * 2 * np.tan(np.radians(camera.fov_y) / 2) / height


def flat_reaches(true: PlainNeighborhoods, values: NDArray[np.float64]) -> NDArray[np.float64]:
    """How far splats may reach (M,), in radii of the neighbourhoods: no farther than points spread."""
    rows = np.arange(len(true.counts))
    close = true.distances[rows, np.minimum(CLOSE, true.counts - 1)]
    close = close / np.where(true.radii > 0, true.radii, 1)
    flatness = FLAT * values[:, 1] / np.maximum(values[:, 0], 1e-9)
    spread = np.sqrt(2 * values[:, 1] / true.counts) * np.maximum(flatness, 1)
    return np.maximum(LEANING * close / 2, spread)


def test_splats_at_the_tip_of_a_horn_do_not_stand_out() -> None:
    """Points wind around it: no plane tells how they lie. Not adaptive, as this looks like noise."""
    along, turn = np.arange(80) / 2, np.arange(80) * 2.4
    horn = np.stack([along, 0.5 * np.cos(turn), 0.5 * np.sin(turn)], axis=1)
    cloud = PointCloud.from_arrays(horn)
    camera = Camera((20, 0, 100), (20, 0, 0), fov_y=8, near=1, far=200)
    pose, fixed = Pose(0, 0.0, "horn", cloud), NormalSearch(adaptive=False)
    found = viewer.estimate_normals(pose, camera, size=(480, 120), search=fixed)
    assert len(found.rows) > 20
    assert found.splat_radii.max() < 1.5


@every_scene
def test_splats_reach_as_far_as_cells(name: str) -> None:
    """To the places that are nearer to their point than to any other one that is seen: so no gap is left."""
    scene = SCENES[name]()
    found = estimated(scene)
    true = check(scene, found)
    belongs = np.arange(K) < true.counts[:, None]
    hidden = np.isin(true.nearest, found.neighbors[found.hidden])
    crowded = CROWDED * pixel_sizes(scene, found.rows)[:, None]
    shared = belongs & ~(hidden & (true.distances <= crowded))
    edges, shares = cell_reaches(scene.cloud, found.rows, true, found.normals, shared)
    share = shares[:, None]
    closing = np.where(edges > OPEN * share, share, np.minimum(LEANING * edges, MOST_SHARE * share))
    reach = np.maximum(closing.max(axis=1), LEAST_SHARE * shares)
    near_limit = (np.abs(edges / share - OPEN) < 0.01).any(axis=1)
    values = planes(scene.cloud, found.rows, true).values
    reach = np.minimum(reach, flat_reaches(true, values))
    on_line = values[:, 1] <= 1.01 * LINE * values[:, 2]
    near_limit |= (hidden & np.isclose(true.distances, crowded, rtol=1e-4)).any(axis=1)
    clear = true.clear(EXACT) & ~found.outliers & ~on_line & ~near_limit  # elsewhere rounding decides
    expected = (true.radii * reach)[clear]
    as_expected = np.isclose(found.splat_radii[clear], expected, rtol=0.01)
    assert (as_expected | (found.splat_radii[clear] < expected)).all()  # smaller where points are sparse
    assert np.count_nonzero(as_expected) >= 0.8 * len(expected) or name == "strays"


def test_what_a_longer_list_has_left_is_not_searched(renderer: Renderer) -> None:
    """Work groups are in rows, so that there are more of them than points to be searched together."""
    scene, size = SCENES["two-scales"](), (640, 480)
    resident, surface = renderer.resident(pose_of(scene)), Surface(renderer.gpu, size)
    view = View.of(scene.camera, size, resident.origin, resident.bounds)
    surface.start(resident, view)
    found = surface.cached(Neighborhoods)

    def splats() -> NDArray[np.uint32]:
        found.find(resident, surface, view, Search(K))
        found["extents"].buffer.clear()  # so that the next search begins alike
        return found.read("splats", np.uint32, 3)

    expected = splats()
    together, rows = found.read_rounds()["more"], found._rest._rows
    assert together % rows > 0
    found._rest.texels.buffer.clear(chunk=np.uint32(found.count).tobytes())
    found._searched.texels.buffer.clear(chunk=np.uint32(found.participants).tobytes())
    np.testing.assert_array_equal(splats(), expected)


@pytest.mark.slow
@pytest.mark.parametrize("noise", [0.0, 0.02])
def test_planes_of_lines_go_through_the_nearest_beside_them(noise: float) -> None:
    """And splats reach no less far along the line than a quarter of how far they reach beside it."""
    scene = ring_scene(noise)
    found = estimated(scene)
    true = check(scene, found)
    fitted = planes(scene.cloud, found.rows, true)
    on_line = fitted.on_lines(0.99 * LINE) & ~found.outliers & (true.counts >= LEAST_COUNT)
    rows, along, radii = found.rows[on_line], fitted.vectors[on_line, :, 2], true.radii[on_line]
    one, other = beside_lines(
        scene.cloud, rows, along, found.neighbors, APART * radii, BESIDE * (1 - EXACT) * radii
    )
    gaps = np.linalg.norm(one, axis=1)
    assert np.count_nonzero(gaps) > 2000
    normals = np.cross(along, one - other)[gaps > 0]
    angles = angles_between(found.normals[on_line][gaps > 0], normals)
    # Which one is nearest, or opposite enough, is decided by rounding here and there.
    assert (np.minimum(angles, 180 - angles) < 0.1).mean() > 0.99
    longer = 0.5 * LEANING * np.maximum(gaps, np.linalg.norm(other, axis=1))
    assert (found.splat_radii[on_line] >= 0.249 * longer).mean() > 0.99


@pytest.mark.parametrize("height", [0.6, *rarely(0.1), 0.02])
def test_pictures_are_closed_up_to_their_borders(height: float, draw: Callable[..., Surface]) -> None:
    """Points beside a picture have splats that reach into it, however few are in it: it shows what a wider
    one does."""
    places = np.random.default_rng(15).uniform(-1, 1, (3000, 2))
    cloud = PointCloud.from_arrays(np.column_stack([places, 0.1 * np.sin(5 * places[:, 0])]))
    wide = 400 if height < 0.1 else 100  # pixels: more than the radius of a splat
    size = (SIZE[0] + 2 * wide, SIZE[1] + 2 * wide)
    for x, y in ((0.0, 0.0), (0.31, -0.2), (-0.4, 0.37)):
        camera = Camera((x, y, 2.0), (x, y, 0.0), projection="orthographic", height=height)
        wider = replace(camera, height=height * size[1] / SIZE[1])
        depth = draw(cloud, camera, SIZE, "auto_splats").depth
        expected = draw(cloud, wider, size, "auto_splats").depth[wide:-wide, wide:-wide]
        assert np.isfinite(expected).all()
        assert np.isfinite(depth).all()


@pytest.mark.parametrize("noise", [0.0, 0.02])
def test_rings_close(noise: float, draw: Callable[..., Surface]) -> None:
    """The ground is closed from ring to ring, and lies flat."""
    scene = ring_scene(noise, (640, 480))
    surface = draw(scene.cloud, scene.camera, scene.size, "auto_splats")
    x, y = (axis.ravel() + 0.5 for axis in np.meshgrid(*map(np.arange, scene.size)))
    pixels, view = np.column_stack([x, y]), surface.view
    rays = view.unproject(pixels, np.full(len(pixels), 2.0)) - view.unproject(pixels, np.ones(len(pixels)))
    eye = np.array(scene.camera.eye)
    ground = eye + rays * ((-1.5 - eye[2]) / rays[:, 2:])
    away = np.hypot(*ground[:, :2].T)
    within = (away > 2.6) & (away < 7.5) & (rays[:, 2] < 0)
    on_ground = within.reshape(scene.size[::-1])
    assert np.count_nonzero(on_ground) > 50_000
    assert np.isinf(surface.depth[on_ground]).mean() <= (0.003 if noise else 0)
    tilts = np.degrees(np.arccos(np.clip(surface.normal[on_ground & np.isfinite(surface.depth), 2], -1, 1)))
    assert np.median(tilts) < (8 if noise else 0.5)


@pytest.mark.parametrize("k", [3, *rarely(4, 7, 16, 32)])
@pytest.mark.parametrize("name", ["bumpy", "copied", "lattice", "strays", "three-points"])
def test_any_number_of_neighbors(name: str, k: int) -> None:
    scene = SCENES[name]()
    check(scene, estimated(scene, k=k), k)


@pytest.mark.parametrize("growth", [1.0, 2.0, 100.0])
@pytest.mark.parametrize("expansions", [0, 3, 10])
def test_gaps_end_neighborhoods(growth: float, expansions: int) -> None:
    scene = SCENES["strays"]()
    found = estimated(scene, growth=growth, expansions=expansions)
    true = check(scene, found, growth=growth, alone=2.0**expansions)
    assert found.outliers[true.counts == 1].all()
    others = found.outliers & (true.counts > 1)  # as far from all others as these are
    assert (true.distances[others, 1] ** 2 > 0.7 * (1 - EXACT) * true.radii[others] ** 2).all()


MISSED = pytest.mark.xfail(strict=True, reason="95.9 % (bumpy) and 91.6 % (two-scales) of the planes agree")


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", [pytest.param("bumpy", marks=MISSED), "noisy", pytest.param("two-scales", marks=MISSED)]
)
def test_planes_go_through_as_few_points_as_are_certain(renderer: Renderer, name: str) -> None:
    """In neighborhoods that noise does not widen."""
    scene = SCENES[name]()
    pose, surface = renderer.resident(pose_of(scene)), Surface(renderer.gpu, scene.size)
    view = View.of(scene.camera, scene.size, pose.origin, pose.bounds)
    surface.start(pose, view)
    searched = surface.cached(Neighborhoods)
    searched.find(pose, surface, view, Search(30, alone=8.0, adaptive=True))
    found = read_normals(scene.cloud, searched)
    all_of_them = estimated(scene, k=30)
    np.testing.assert_array_equal(found.radii, all_of_them.radii)
    np.testing.assert_array_equal(found.counts, all_of_them.counts)
    true = neighborhoods(scene.cloud, found.rows, found.neighbors, 30, found.usual, **RULES)
    counts = certain_counts(scene.cloud, found.rows, true, LEAST_COUNT, CERTAIN, TURNED)
    assert (counts < true.counts).mean() > 0.01
    angle = angles_between(found.normals, planes(scene.cloud, found.rows, true, counts).normals)
    assert (np.minimum(angle, 180 - angle) < 0.1).mean() > 0.99  # rounding decides here and there


def test_outliers_are_kept_where_they_are_wanted() -> None:
    scene = SCENES["strays"]()
    assert estimated(scene).outliers.any()
    kept = estimated(scene, expansions=None)
    assert not kept.outliers.any()
    check(scene, kept, alone=np.inf)


def test_neighborhoods_are_the_same_wherever_they_are_seen_from() -> None:
    """With all points taking part or none hidden: an open sheet, from several sides, near and far."""
    x, y = np.random.default_rng(0).uniform(-1, 1, (2, 3000))
    sheet = seen(np.stack([x, y, 0.2 * np.sin(3 * x) * np.cos(2 * y)], axis=1), (640, 480))
    first = estimated(sheet)
    for camera in (sheet.camera.orbited(2, 0), sheet.camera.orbited(-30, 10), sheet.camera.zoomed(0.8)):
        other = estimated(replace(sheet, camera=camera))
        both, at, there = np.intersect1d(first.rows, other.rows, return_indices=True)
        assert len(both) > 2500
        np.testing.assert_array_equal(first.radii[at], other.radii[there])
        angle = angles_between(first.normals[at], other.normals[there])
        assert np.minimum(angle, 180 - angle).max() < 0.01


def test_empty_poses_have_no_neighborhoods() -> None:
    nothing = PointCloud.from_arrays(np.empty((0, 3)))
    found = viewer.estimate_normals(Pose(0, 0.0, "empty", nothing), Camera((0.0, 0.0, 3.0)), size=(64, 48))
    assert len(found.rows) == len(found.normals) == len(found.neighbors) == 0
    away = seen(on_unit_sphere(500))
    turned = replace(away, camera=Camera((0.0, 0.0, 5.0), (0.0, 0.0, 10.0)))
    assert not len(estimated(turned).rows)


def test_points_without_ids_of_their_own_keep_those_of_the_file() -> None:
    points = on_unit_sphere(800)
    points[::5] = np.nan
    scene = seen(points)
    found = estimated(scene)
    np.testing.assert_array_equal(found.ids, scene.cloud.ids[found.rows])


@pytest.mark.parametrize("values", [{"k": 2}, {"k": 33}, {"growth": 0.5}, {"growth": np.nan}])
def test_searches_outside_their_range_are_refused(values: dict[str, Any]) -> None:
    with pytest.raises(InputError):
        NormalSearch(**values)


def test_a_picture_without_pixels_is_refused() -> None:
    with pytest.raises(InputError):
        viewer.estimate_normals(SCENES["sphere"]().cloud, size=(0, 9))


# --- real scans -----------------------------------------------------------------------------


@pytest.fixture(scope="module")
def real(data_dir: Path) -> Callable[[str], BareScene]:
    """A real scan in the paper's picture size, or a scene of the benchmark."""

    def load(name: str) -> BareScene:
        if name in catalog.scene_names(None):
            pose = catalog.subject(name, data_dir).moment(0).pose
        else:
            with open_scan(data_dir / name) as timeline:
                pose = timeline.pose(0)
        cloud = PointCloud(pose.cloud.positions, pose.cloud.origin)
        camera = Camera.orbit(cloud.bounds(), 20, 15, aspect=1760 / 900)
        return BareScene(cloud, camera, (1760, 900))

    return load


@pytest.mark.parametrize(
    "name",
    [
        "two-bunnies",
        "sequences/kitti_lidar_street_10",
        *rarely(
            "dragon-scans",
            "sequences/hands_knot_5",
            "sequences/waving_cat_16",
            "models/bimba_points_80002.ply",
            "models/open3d_living_room_fragment.pcd",
            "odd/pcd/CSite1_red2-utm.pcd",
        ),
    ],
)
def test_neighborhoods_of_real_scans_are_those_of_a_tree(name: str, real: Callable[[str], BareScene]) -> None:
    scene = real(name)
    check(scene, estimated(scene), rounded=True)

"""Reference pictures: shading, visibility, the same points in two frames, and no error of their own."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import pytest
from scenes import rarely, sphere, sphere_mesh

from viewer.bench import metrics
from viewer.bench.truth.shapes import AnalyticScene, Plane, Sphere
from viewer.bench.truth.surface import reference_surface
from viewer.camera import Camera
from viewer.errors import InputError
from viewer.look import Look
from viewer.mesh.reference import both_see, trace, visible
from viewer.mesh.triangles import Mesh, read_mesh, vertex_normals
from viewer.scan.formats import read, read_faces
from viewer.scan.points import PointCloud
from viewer.scan.spacing import typical_spacing
from viewer.srgb import bytes_from_linear, linear_from_bytes

if TYPE_CHECKING:
    from viewer.drawing.renderer import Renderer
    from viewer.picture.surface import Surface

SIZE = (96, 72)
CAMERA = Camera(eye=(2, 1.5, 3))


def test_srgb_bytes_survive_linear_light() -> None:
    assert (bytes_from_linear(linear_from_bytes(np.arange(256, dtype=np.uint8))) == np.arange(256)).all()


def test_no_picture_is_one_message() -> None:
    with pytest.raises(InputError, match="0x5"):
        trace(AnalyticScene((Sphere(),)), CAMERA, (0, 5))


# --- as a Surface --------------------------------------------------------------------------


def test_its_surface_has_its_channels(renderer: Renderer) -> None:
    picture = trace(sphere_mesh(), CAMERA, SIZE)
    surface, arrays = reference_surface(picture, renderer.gpu), picture.arrays()
    shown = surface.arrays()
    assert shown.keys() == arrays.keys()
    assert all(shown[name].shape == arrays[name].shape for name in arrays)
    for name in ("id", "coverage", "level"):
        assert (shown[name] == arrays[name]).all()
    assert (shown["depth"] == arrays["depth"].astype(np.float32)).all()
    assert np.abs(shown["normal"] - arrays["normal"]).max() < 1e-6
    assert np.abs(shown["color"] - arrays["color"]).max() < 0.005  # half a byte of sRGB, at white


def test_nothing_seen_is_all_background(renderer: Renderer) -> None:
    picture = trace(AnalyticScene((Sphere(),)), Camera(eye=(0, 0, 4), target=(0, 0, 9)), SIZE)
    image = reference_surface(picture, renderer.gpu, Look(background="#102030")).image()
    assert (image == [16, 32, 48, 255]).all()


def test_a_head_light_shades_a_sphere_by_its_cosine(renderer: Renderer) -> None:
    look = Look(light="head", ambient=0.25, diffuse=0.75, specular=0, color_by="plain", plain="#c0c0c0")
    picture = trace(AnalyticScene((Sphere(),)), CAMERA, SIZE)
    image = reference_surface(picture, renderer.gpu, look).image()[..., :3]
    to_eye = np.array(CAMERA.eye) - picture.positions() - picture.origin
    to_eye /= np.linalg.norm(to_eye, axis=1, keepdims=True)
    facing = (to_eye * picture.normal[picture.covered]).sum(axis=1, keepdims=True)
    expected = bytes_from_linear(linear_from_bytes(np.full(3, 0xC0, np.uint8)) * (0.25 + 0.75 * facing))
    assert np.abs(image[picture.covered].astype(int) - expected).max() <= 1


def test_points_drawn_at_the_true_hits_look_the_same(
    renderer: Renderer, draw: Callable[..., Surface]
) -> None:
    look = Look(light="head")
    reference = reference_surface(trace(sphere_mesh(), CAMERA, SIZE), renderer.gpu, look)
    drawn = draw(reference.pose.cloud, CAMERA, SIZE, look=look)
    both = (drawn.coverage > 0) & (reference.coverage > 0)
    assert both.sum() > 0.8 * reference.coverage.sum()  # some fall on the edge to a neighbour's pixel
    same = both & (drawn.row == reference.row)
    difference = np.abs(drawn.image().astype(int) - reference.image().astype(int))
    assert same.sum() > 0.8 * both.sum()
    assert difference[same].max() <= 1


# --- visibility ----------------------------------------------------------------------------


@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
def test_vertices_of_a_sphere_are_visible_on_the_near_side(projection: str) -> None:
    mesh = sphere_mesh(48)
    camera = Camera(eye=(2, 1.5, 3), projection=projection)
    points = mesh.points.world()
    eye = np.array(camera.eye)
    to_eye = eye - points if projection == "perspective" else np.broadcast_to(eye, points.shape)
    facing = (points * to_eye).sum(axis=1) / np.linalg.norm(to_eye, axis=1)
    seen = visible(mesh, mesh.points.positions, camera)
    edge = np.pi / 48  # a face's size: nearer to the outline, the faces around a vertex decide
    assert seen[facing > edge].all()
    assert not seen[facing < -edge].any()


def test_a_point_behind_a_plane_is_hidden_beside_it_visible() -> None:
    scene = AnalyticScene((Plane(), Sphere(radius=0.1, center=(3, 3, -3))))
    points = np.array([[0, 0, 0.5], [0, 0, 0], [0, 0, -0.5], [1.5, 0, -0.5], [0, 0, 9]]) - scene.origin
    assert visible(scene, points, Camera(eye=(0, 0, 4))).tolist() == [True, True, False, True, False]


def test_the_tolerance_of_visibility() -> None:
    scene = AnalyticScene((Sphere(),))
    below = np.array([[0, 0, 1 - 1e-5], [0, 0, 1 - 1e-7]])
    camera = Camera(eye=(0, 0, 4))
    assert visible(scene, below, camera).tolist() == [False, True]
    assert visible(scene, below, camera, tolerance=1e-4).all()


def sees(mesh: Mesh, row: int, eye: np.ndarray) -> bool:
    """Whether no face but those around a vertex is between it and the eye: every face in float64."""
    positions = mesh.points.positions.astype(np.float64)
    step = positions[row] - eye
    a, b, c = positions[mesh.faces.T.astype(int)] - eye
    volumes = np.stack([np.cross(p, q) @ step for p, q in ((b, c), (c, a), (a, b))])
    inside = (volumes > 0).all(axis=0) | (volumes < 0).all(axis=0)
    faces = np.flatnonzero(inside & ~(mesh.faces == row).any(axis=1))
    weights = volumes[:, faces] / volumes[:, faces].sum(axis=0)
    along = (
        weights[0] * (a[faces] @ step) + weights[1] * (b[faces] @ step) + weights[2] * (c[faces] @ step)
    ) / (step @ step)
    return not ((along > 0) & (along < 1 - 1e-9)).any()


@pytest.mark.parametrize("turn", [20, *rarely(110, 200, 290)])
@pytest.mark.slow
def test_faces_that_hold_a_vertex_do_not_hide_it(data_dir: Path, turn: float) -> None:
    """Where rays are tangents, a first hit in float32 is on the vertex's own faces."""
    mesh = read_mesh(data_dir / "models" / "stanford_bunny_35947.ply")
    camera = Camera.orbit(mesh.bounds, turn, 15)
    points, eye = mesh.points.positions.astype(np.float64), np.array(camera.eye) - mesh.origin
    seen = visible(mesh, points, camera)
    hits = mesh.cast(np.broadcast_to(eye, points.shape), points - eye)
    first = hits.distance > 1 - 2e-6
    disputed = np.flatnonzero(first != seen)
    assert len(disputed) > 5
    some = np.random.default_rng(1).choice(len(seen), 100, replace=False)
    for row in (*disputed[:100], *some):
        assert seen[row] == sees(mesh, row, eye)


def test_neighbors_share_an_edge() -> None:
    mesh = sphere_mesh(8)
    across = mesh.neighbors
    face, side = np.nonzero(across != np.arange(len(across))[:, None])
    assert len(face) > 2 * len(across)
    for one, edge in zip(face, side, strict=True):
        corners = {mesh.faces[one][edge], mesh.faces[one][(edge + 1) % 3]}
        assert corners <= set(mesh.faces[across[one, edge]])
        assert one in across[across[one, edge]]


def test_distances_to_faces_are_those_to_the_nearest_of_many_places() -> None:
    rng = np.random.default_rng(2)
    mesh = Mesh(
        PointCloud.from_arrays(rng.normal(size=(9, 3)), origin=np.zeros(3)),
        np.arange(9, dtype=np.uint32).reshape(3, 3),
    )
    points, faces = rng.normal(size=(60, 3)), np.arange(60) % 3
    grid = np.stack(np.meshgrid(*[np.linspace(0, 1, 201)] * 2), axis=-1).reshape(-1, 2)
    grid = grid[grid.sum(axis=1) <= 1]
    corners = mesh.points.positions[mesh.faces].astype(np.float64)
    places = np.einsum("nk,fkc->fnc", np.c_[1 - grid.sum(axis=1), grid], corners)
    nearest = [
        np.linalg.norm(places[face] - point, axis=1).min() for face, point in zip(faces, points, strict=True)
    ]
    assert mesh.distances(faces.astype(np.uint32), points) == pytest.approx(np.array(nearest), abs=0.01)


# --- the same points in two frames ---------------------------------------------------------


def test_pairs_of_pixels_show_the_same_points() -> None:
    scene = sphere_mesh()
    first, second = trace(scene, CAMERA, SIZE), trace(scene, CAMERA.orbited(5, 3), SIZE)
    a, b = both_see(first, second)
    assert len(a) > 0.8 * first.covered.sum()
    where = np.full((*first.depth.shape, 3), np.nan)
    where[first.covered] = first.positions()
    there = np.full_like(where, np.nan)
    there[second.covered] = second.positions()
    apart = np.linalg.norm(where.reshape(-1, 3)[a] - there.reshape(-1, 3)[b], axis=1)
    assert apart.max() < 5 * second.view.footprint(second.depth[second.covered]).max()


def test_what_turns_out_of_sight_has_no_pair() -> None:
    scene = AnalyticScene((Sphere(),))
    first, second = trace(scene, CAMERA, SIZE), trace(scene, CAMERA.orbited(180, 0), SIZE)
    assert len(both_see(first, second)[0]) < 0.1 * first.covered.sum()


def test_pairs_follow_a_moving_mesh() -> None:
    mesh = sphere_mesh()
    moved = Mesh(
        PointCloud.from_arrays(mesh.points.world() + np.array([0.2, 0, 0]), origin=mesh.origin), mesh.faces
    )
    first, second = trace(mesh, CAMERA, SIZE), trace(moved, CAMERA, SIZE)
    carried = mesh.carry(first.id[first.covered], first.positions(), moved)
    a, b = both_see(first, second, carried)
    assert len(a) > 0.8 * first.covered.sum()
    turned = metrics.angles_between(first.normal.reshape(-1, 3)[a], second.normal.reshape(-1, 3)[b])
    assert np.median(turned) < 2  # the same places of the sphere, to a pixel


# --- no error against itself; sane errors of real backends ---------------------------------


def test_a_reference_has_no_error_against_itself(renderer: Renderer) -> None:
    picture = trace(sphere_mesh(), CAMERA, SIZE)
    image = reference_surface(picture, renderer.gpu).image()
    frame = {"image": image, "normal": picture.normal}
    pair = both_see(picture, picture)
    assert (pair[0] == pair[1]).all()
    assert len(pair[0]) == picture.covered.sum()
    errors = (
        metrics.coverage(picture.covered, picture.covered)
        | metrics.depth(picture.depth, picture.depth, picture.view.footprint(picture.depth), 0.01)
        | metrics.normals(picture.normal, picture.normal)
        | metrics.flicker((frame, frame), (frame, frame), pair)
    )
    assert errors.pop("closed_percent") == 100
    assert set(errors.values()) == {0}
    color = metrics.color(image, image, picture.covered)
    assert color["psnr"] == color["psnr_frame"] == math.inf
    assert color["ssim"] == color["ssim_frame"] == pytest.approx(1, abs=1e-12)
    assert not color["flip"] > 0
    seen = visible(sphere_mesh(), sphere_mesh().points.positions, CAMERA)
    assert metrics.visibility(seen, seen)["visibility_error_percent"] == 0


@pytest.mark.parametrize("backend", ["points", "surfels"])
def test_errors_of_a_drawn_sphere_are_of_its_spacing(draw: Callable[..., Surface], backend: str) -> None:
    cloud = sphere(20_000)
    picture = trace(AnalyticScene((Sphere(),)), CAMERA, SIZE)
    drawn = draw(cloud, CAMERA, SIZE, backend)
    errors = metrics.depth(drawn.depth, picture.depth, picture.view.footprint(picture.depth), 0.025)
    assert errors["depth_median"] < 0.025
    assert metrics.normals(drawn.normal, picture.normal)["normal_median"] < 3
    coverage = metrics.coverage(drawn.coverage > 0, picture.covered)
    assert coverage["boundary_mean"] < 1.5
    assert coverage["spill_percent"] < 5


class Bounds(NamedTuple):
    """Bounds of the errors of a backend."""

    backend: str
    wrong_layers: float  # percent, at most
    holes: float  # percent, at most
    psnr: tuple[float, float]
    least_ssim: float


@pytest.mark.parametrize(
    "bounds",
    [Bounds("points", 40, 60, (0, 20), 0.0), Bounds("surfels", 2, 1, (25, 100), 0.5)],
    ids=lambda bounds: bounds.backend,
)  # the far side shows between points
def test_errors_of_the_bunny_are_sane(
    data_dir: Path, renderer: Renderer, draw: Callable[..., Surface], bounds: Bounds
) -> None:
    stored = read_mesh(data_dir / "models" / "stanford_bunny_35947.ply")
    spacing = typical_spacing(stored.points)
    # A thousand of its vertices belong to no face: they have no normal.
    used, faces = np.unique(stored.faces, return_inverse=True)
    cloud = PointCloud.from_arrays(
        stored.points.world()[used],
        normals=vertex_normals(stored)[used],
        radii=np.full(len(used), 1.5 * spacing),
        origin=stored.origin,
    )
    mesh = Mesh(cloud, faces.reshape(-1, 3).astype(stored.faces.dtype))
    camera, size = Camera.orbit(mesh.bounds, 20, 10), (320, 240)
    picture, look = trace(mesh, camera, size), Look(light="head")
    drawn = draw(cloud, camera, size, bounds.backend, look=look)
    seen = visible(mesh, cloud.positions, camera)
    assert 0.3 < seen.mean() < 0.6
    depth = metrics.depth(drawn.depth, picture.depth, picture.view.footprint(picture.depth), spacing)
    assert depth["depth_median"] < spacing
    assert depth["wrong_layer_percent"] < bounds.wrong_layers
    coverage = metrics.coverage(drawn.coverage > 0, picture.covered)
    assert coverage["hole_percent"] < bounds.holes
    assert coverage["spill_percent"] < 5
    normals = metrics.normals(drawn.normal, picture.normal)
    assert normals["normal_median"] < 10
    assert normals["normal_signed_median"] == pytest.approx(normals["normal_median"], rel=0.01)
    image, true = drawn.image(), reference_surface(picture, renderer.gpu, look).image()
    color = metrics.color(image, true, picture.covered)
    assert bounds.psnr[0] < color["psnr"] < bounds.psnr[1]
    assert color["ssim"] > bounds.least_ssim


def test_a_sequence_keeps_its_faces_in_a_file_of_their_own(data_dir: Path) -> None:
    folder = data_dir / "sequences" / "crane_175"
    faces, frames = (
        read_faces(folder / "mesh_topology.ply").triangles(),
        sorted((folder / "frames").iterdir()),
    )
    first, later = (Mesh(read(frame), faces) for frame in (frames[0], frames[5]))
    camera = Camera.orbit(first.bounds)
    a, b = trace(first, camera, SIZE), trace(later, camera, SIZE)
    carried = first.carry(a.id[a.covered], a.positions(), later)
    pairs = both_see(a, b, carried)
    assert len(pairs[0]) > 0.3 * a.covered.sum()

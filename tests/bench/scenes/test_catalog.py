from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from demo_surface import surface_value
from scenes import rarely

from viewer.bench.scenes import catalog
from viewer.bench.scenes.subjects import Moment, Subject, smooth
from viewer.bench.truth.shapes import AnalyticScene
from viewer.camera import Camera
from viewer.errors import InputError
from viewer.mesh.reference import pixel_rays, trace
from viewer.mesh.triangles import Mesh
from viewer.scan.points import PointCloud
from viewer.scan.range_view import merge

ANALYTIC = ["sphere", "plane", "box", "torus"]
OWN = ["demo", "hand-before-face"]
STILL = ["bunny", "armadillo", "horse", "dragon-100k", "igea", "dragon"]
MOVING = ["crane", "horse-gallop", "owlii"]
ARRANGED = ["two-bunnies", "horses"]

# The median distance of the points to the truth, and what it may be at most, scan units.
REAL = {"dragon-scans": 2e-4, "bunny-scans": 1.5e-4, "truedepth-head": 6e-4}


def distances(moment: Moment) -> np.ndarray:
    """How far the points of a moment are from its mesh, (N,)."""
    import open3d

    scene = open3d.t.geometry.RaycastingScene()
    mesh = moment.mesh
    scene.add_triangles(*(open3d.core.Tensor(array) for array in (mesh.points.positions, mesh.faces)))
    points = (moment.pose.cloud.world() - mesh.origin).astype(np.float32)
    return scene.compute_distance(open3d.core.Tensor(points)).numpy()


@pytest.fixture
def tetrahedron(tmp_path: Path) -> Path:
    file = tmp_path / "tetra.obj"
    file.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n")
    return file


def test_all_scenes_are_listed_and_say_what_they_lack(tmp_path: Path) -> None:
    listed = catalog.scene_names(None)
    scanned = [f"{name}-{pods}" for pods in ("simulated", "pair") for name in ("torus", *OWN)]
    assert list(listed)[:7] == [*ANALYTIC, *OWN, "bunny"]
    sheets = ["sheets", "sheets-bare"]
    assert [name for name, reason in listed.items() if not reason] == [*ANALYTIC, *OWN, *sheets, *scanned]
    for pods in ("simulated", "pair"):
        assert {f"{name}-{pods}" for name in ["torus", *OWN, *STILL, *MOVING]} <= set(listed)
    assert {*REAL, *ARRANGED} <= set(listed)
    assert "models/stanford_bunny_35947.ply" in catalog.scene_names(tmp_path)["bunny"]
    assert str(tmp_path) in catalog.scene_names(tmp_path)["bunny"]


def test_all_scenes_are_there(data_dir: Path) -> None:
    assert set(catalog.scene_names(data_dir).values()) == {""}


@pytest.mark.parametrize(
    ("name", "wanted", "told"),
    [
        ("bunni", {}, "bunny"),
        ("no/such.ply", {}, "no such file"),
        ("bunny", {}, "models/stanford_bunny_35947.ply"),
        ("torus", {"noise": 0.5}, "simulated"),
        ("torus", {"count": 0}, "0 points"),
        ("torus", {"count": 10**12}, "points"),
        ("demo", {"count": 10}, "10 points"),
        ("torus-simulated", {"count": 10}, "10 points"),
        ("torus-simulated", {"noise": -1.0}, "0 or more"),
        ("torus-simulated", {"noise": float("nan")}, "0 or more"),
    ],
)
def test_what_cannot_be_had_is_told(name: str, wanted: dict, told: str) -> None:
    with pytest.raises(InputError, match=told):
        catalog.subject(name, None, **wanted)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("v 0 0 0\nv 1 0 0\n", "needs a mesh"),
        ("v 0 0 0\nv 0 0 0\nv 0 0 0\nf 1 2 3\n", "area"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "vertex"),
    ],
)
def test_files_that_are_no_scene(tmp_path: Path, text: str, told: str) -> None:
    file = tmp_path / "bad.obj"
    file.write_text(text)
    with pytest.raises(InputError, match=told):
        catalog.subject(str(file), None)


def test_a_file_is_a_scene(tetrahedron: Path) -> None:
    moment = catalog.subject(str(tetrahedron), None).moment(0)
    assert len(moment.pose.cloud) == 4
    assert moment.truth is moment.mesh
    outward = moment.pose.cloud.world() - 0.25
    assert (np.einsum("ij,ij->i", outward, moment.pose.cloud.normals) > 0).all()
    more = catalog.subject(str(tetrahedron), None, count=500).moment(0)
    assert len(more.pose.cloud) == 500
    assert distances(more).max() < 1e-6


@pytest.mark.parametrize("name", ANALYTIC)
def test_analytic_scenes_come_in_any_number_of_points(name: str) -> None:
    assert len(catalog.subject(name, None).moment(0).pose.cloud) == 100_000
    moment = catalog.subject(name, None, count=5000).moment(0)
    assert len(moment.pose.cloud) == 5000
    assert isinstance(moment.truth, AnalyticScene)
    assert distances(moment).max() < 1e-4  # of the tessellation
    camera, size = Camera((2.0, 2.2, 2.4)), (120, 90)
    exact, drawn = trace(moment.truth, camera, size), trace(moment.mesh, camera, size)
    assert np.count_nonzero(exact.covered != drawn.covered) < 10
    both = exact.covered & drawn.covered
    assert np.quantile(np.abs(exact.depth[both] - drawn.depth[both]), 0.99) < 2e-3
    assert (np.einsum("ij,ij->i", exact.normal[both], drawn.normal[both]) > 0.99).mean() > 0.99


@pytest.mark.parametrize("name", ["horse", *rarely(*(name for name in STILL if name != "horse"))])
def test_models_are_their_vertices(name: str, data_dir: Path) -> None:
    subject = catalog.subject(name, data_dir)
    moment = subject.moment(0)
    cloud = moment.pose.cloud
    assert distances(moment).max() < 1e-6 * moment.mesh.bounds.radius
    np.testing.assert_allclose(np.linalg.norm(cloud.normals, axis=1), 1, atol=1e-5)
    # Faces and normals point out: so the body has a volume.
    corners = moment.mesh.points.positions[moment.mesh.faces] - moment.mesh.points.positions.mean(axis=0)
    assert np.einsum("ij,ij->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) > 0
    flat = moment.mesh.areas()
    smooth_normals = moment.mesh.points.normals[moment.mesh.faces[:, 0]]
    assert (np.einsum("ij,ij->i", flat, smooth_normals) >= 0).mean() > 0.97
    assert subject.credit


def test_a_model_comes_in_any_number_of_points(data_dir: Path) -> None:
    moment = catalog.subject("bunny", data_dir, count=20_000).moment(0)
    assert len(moment.pose.cloud) == 20_000
    assert distances(moment).max() < 1e-6
    other = catalog.subject("bunny", data_dir, count=20_000, seed=1).moment(0)
    assert not np.array_equal(moment.pose.cloud.positions, other.pose.cloud.positions)


@pytest.mark.slow
def test_horses_hide_each_other(data_dir: Path) -> None:
    import open3d

    moment = catalog.subject("horses", data_dir).moment(0)
    assert len(moment.pose.cloud) == 120 * 8431
    picture = trace(moment.truth, Camera.orbit(moment.mesh.bounds, 30, 20), (60, 60))
    rays = np.concatenate(pixel_rays(picture.view, np.flatnonzero(picture.covered)), axis=1, dtype=np.float32)
    scene = open3d.t.geometry.RaycastingScene()
    scene.add_triangles(
        *(open3d.core.Tensor(array) for array in (moment.mesh.points.positions, moment.mesh.faces))
    )
    surfaces = scene.count_intersections(open3d.core.Tensor(rays)).numpy()
    assert surfaces.mean() > 4


def test_a_bunny_sits_on_the_head_of_a_larger_one(data_dir: Path) -> None:
    mesh = catalog.subject("two-bunnies", data_dir).moment(0).mesh
    large, small = np.split(mesh.points.world(), 2)
    assert np.ptp(small, axis=0) == pytest.approx(np.ptp(large, axis=0) / 8, rel=1e-4)
    on_top = large[large[:, 1].argmax()]
    assert (small.min(axis=0) < on_top).all()
    assert (on_top < small.max(axis=0)).all()
    assert (small[:, 1] > on_top[1]).mean() > 0.9
    np.testing.assert_array_equal(
        mesh.faces[len(mesh.faces) // 2 :], mesh.faces[: len(mesh.faces) // 2] + len(large)
    )


def test_loose_vertices_are_left_out() -> None:
    points = PointCloud.from_arrays(np.array([[9, 9, 9], [0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32))
    mesh = smooth(Mesh(points, np.array([[1, 2, 3]], np.uint32)))
    assert len(mesh.points) == 3
    np.testing.assert_array_equal(mesh.faces, [[0, 1, 2]])
    np.testing.assert_array_equal(mesh.points.normals, np.tile([0, 0, 1], (3, 1)))


@pytest.mark.parametrize("name", MOVING)
def test_sequences_carry_their_surface_where_faces_stay(name: str, data_dir: Path) -> None:
    subject = catalog.subject(name, data_dir)
    moment = subject.moment(0)
    reference = trace(moment.truth, Camera.orbit(moment.mesh.bounds, up=subject.up), (60, 40))
    moved = subject.carry(0, 1, reference)
    np.testing.assert_array_equal(subject.carry(0, 0, reference), reference.positions())
    if name == "owlii":
        assert moved is None
        return
    next_mesh = subject.moment(1).mesh
    cloud = PointCloud.from_arrays(moved + next_mesh.origin)
    there = Moment(replace(moment.pose, points=cloud), next_mesh, next_mesh)
    assert distances(there).max() < 1e-5 * next_mesh.bounds.radius


def test_two_moments_are_kept() -> None:
    loaded = []

    def load(index: int) -> Moment:
        loaded.append(index)
        return catalog.subject("plane", None, count=10).moment(0)

    subject = Subject(name="counted", load=load, moments=4)
    for index in (0, 1, 0, 1, 2, 1, 0):
        subject.moment(index)
    assert loaded == [0, 1, 2, 0]
    with pytest.raises(InputError, match="no moment 4"):
        subject.moment(4)


@pytest.mark.slow
def test_hashes_tell_subjects_apart() -> None:
    def digest(name: str, **wanted: float) -> str:
        return catalog.subject(name, None, **wanted).hash

    assert digest("torus", count=1000) == digest("torus", count=1000)
    assert len(digest("torus", count=1000)) == 16
    different = [digest("torus", count=1000), digest("torus", count=1001), digest("sphere", count=1000)]
    noisy = [digest("torus-simulated", noise=noise, seed=seed) for noise, seed in ((0, 0), (1, 0), (1, 1))]
    assert len({*different, *noisy}) == 6


@pytest.mark.slow
def test_simulated_scans_are_as_noisy_as_asked_for() -> None:
    still, noisy = (catalog.subject("torus-simulated", None, noise=noise) for noise in (0.0, 1.0))
    assert (still.tolerance, still.noise, noisy.noise) == (None, 0.0, 1.0)
    views = noisy.moment(0).pose.views
    assert [view.depth.shape for view in views] == [(480, 640)] * 4
    np.testing.assert_array_equal(noisy.moment(0).pose.cloud.positions, merge(views).positions)
    truth = still.moment(0).pose.views
    both = views[0].mask & truth[0].mask & (truth[0].confidence > 0.99)
    off = views[0].depth[both].astype(np.float64) - truth[0].depth[both]
    # The tolerance is four standard deviations at the subject's distance; what faces the pod is nearer.
    nearer = (truth[0].depth[both].mean() / np.linalg.norm(views[0].eye)) ** 2
    assert abs(off.std() / (noisy.tolerance / 4 * nearer) - 1) < 0.1
    assert distances(still.moment(0)).max() < 1e-4


@pytest.mark.parametrize(
    ("name", "turns"), [("torus-simulated", [0, 90, 180, 270]), ("torus-pair", [-27.5, 27.5])]
)
def test_pods_stand_all_round_or_left_and_right_of_the_front(name: str, turns: list[float]) -> None:
    views = catalog.subject(name, None, noise=0.0).moment(0).pose.views
    found = [np.degrees(np.arctan2(*view.eye[[0, 2]])) % 360 for view in views]
    np.testing.assert_allclose(found, np.array(turns) % 360, atol=1e-6)


@pytest.mark.slow
def test_the_demo_is_scanned_while_it_speaks() -> None:
    subject = catalog.subject("demo-pair", None, noise=0.0)
    assert subject.moments == 64
    first, later = subject.moment(0), subject.moment(20)
    assert len(first.pose.views) == 2
    assert not np.array_equal(first.pose.views[0].depth, later.pose.views[0].depth, equal_nan=True)


@pytest.mark.slow
def test_the_hand_is_before_the_face_and_shows_it_between_its_fingers() -> None:
    moment = catalog.subject("hand-before-face", None).moment(0)
    ahead = Camera((-5.0, 60.0, 600.0), (-5.0, 60.0, 0.0), projection="orthographic", height=60.0)
    picture = trace(moment.truth, ahead, (120, 60))
    depth = picture.depth[picture.covered]
    hand = depth < 600 - 150
    assert 0.1 < hand.mean() < 0.9
    assert depth[~hand].min() > depth[hand].max() + 20
    assert (
        np.einsum("ij,ij->i", moment.mesh.areas(), moment.mesh.points.normals[moment.mesh.faces[:, 0]]) >= 0
    ).mean() > 0.99
    assert len(catalog.subject("hand-before-face", None, count=5000).moment(0).pose.cloud) == 5000


def test_noise_is_half_a_footprint_unless_told() -> None:
    assert catalog.subject("torus-simulated", None).noise == 0.5


def test_the_moments_of_a_simulated_sequence(data_dir: Path) -> None:
    subject = catalog.subject("horse-gallop-simulated", data_dir, noise=0.0)
    assert subject.moments == 48
    first, second = subject.moment(3), subject.moment(4)
    assert first.pose.index == 3
    assert second.pose.time > first.pose.time
    np.testing.assert_array_equal(  # the pods stand still
        first.pose.views[2].world_to_camera, second.pose.views[2].world_to_camera
    )
    assert distances(first).max() < 1e-4
    camera = Camera.orbit(first.mesh.bounds)
    assert subject.carry(3, 4, trace(first.truth, camera, (30, 20))) is not None


@pytest.mark.parametrize("name", ["bunny-scans", *rarely("dragon-scans", "truedepth-head")])
def test_real_scans_lie_on_their_truth(name: str, data_dir: Path) -> None:
    subject = catalog.subject(name, data_dir)
    for index in {0, subject.moments - 1}:
        off = distances(subject.moment(index))
        assert np.median(off) < REAL[name]
        assert np.quantile(off, 0.9) < subject.tolerance


@pytest.mark.slow
def test_the_demo_lies_on_its_mesh_while_it_speaks() -> None:
    from viewer.scan.demo.motion import PERIOD

    subject = catalog.subject("demo", None)
    assert subject.moments == 64
    index = 20  # the mouth is open
    moment = subject.moment(index)
    off = distances(moment)
    assert np.median(off) < 0.005
    assert np.quantile(off, 0.99) < 0.1
    assert (off < subject.tolerance).mean() > 0.999
    # What is seen of the mesh is the exact surface.
    picture = trace(moment.truth, Camera.orbit(moment.mesh.bounds, 10), (60, 60))
    value = surface_value(picture.positions() + picture.origin, index / 64 * PERIOD)
    assert np.median(np.abs(value)) < 0.005
    assert np.quantile(np.abs(value), 0.98) < 0.1
    # Between the lips one looks into the mouth: nothing there spans from lip to lip.
    into = Camera((0.0, -75.0, 300.0), (0.0, -75.0, 0.0))
    assert trace(moment.truth, into, (1, 1)).depth[0, 0] > 300 - 60
    # The same faces at all times.
    first = trace(moment.truth, into, (20, 20))
    carried = subject.carry(index, 0, first)
    assert np.median(np.abs(surface_value(carried, 0.0))) < 0.01

"""The virtual scanner: its points are on the surface, its faults are those it states, and it is seeded."""

from __future__ import annotations

import csv
from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
from demo_surface import surface_value
from scenes import sphere_hits, sphere_mesh

from viewer import cli
from viewer.bench.truth.shapes import AnalyticScene, Sphere
from viewer.bounds import Bounds
from viewer.camera import Camera
from viewer.errors import InputError
from viewer.mesh.reference import trace
from viewer.mesh.triangles import Mesh, face_normals, read_mesh
from viewer.scan.demo import DemoSource
from viewer.scan.formats import exr, read, read_faces, read_points
from viewer.scan.range_view import RangeView, merge
from viewer.simulate.scanner import Faults, around, capture, rig

SIZE = (160, 120)
UNIT_BOX = Bounds(-np.ones(3), np.ones(3))
BALL = AnalyticScene((Sphere(),))
EPSILON = float(np.finfo(np.float32).eps)
FAULTY = Faults(noise=0.01, disparity=0.1, dropouts=0.1, outliers=0.05, grazing=80)


def pods(count: int = 2, size: tuple[int, int] = SIZE) -> list[Camera]:
    return rig(UNIT_BOX, around(count), aspect=size[0] / size[1])


def scan(
    faults: Faults, count: int = 2, size: tuple[int, int] = SIZE, seed: int = 0, frame: int = 0
) -> tuple[RangeView, ...]:
    """The unit sphere."""
    return capture(BALL, pods(count, size), size, [faults] * count, seed=seed, frame=frame)


def same(first: RangeView, second: RangeView) -> bool:
    """Whether two views are the same in every bit."""

    def bits(view: RangeView, name: str) -> object:
        value = getattr(view, name)
        return value.tobytes() if isinstance(value, np.ndarray) else value

    return all(bits(first, f.name) == bits(second, f.name) for f in fields(RangeView))


# --- without faults -------------------------------------------------------------------------


@pytest.mark.parametrize("count", [1, 2, 5, 8])
def test_points_are_on_the_sphere_to_the_rounding_of_their_depths(count: int) -> None:
    views = scan(Faults(), count)
    assert len(views) == count
    for view, pod in zip(views, pods(count), strict=True):
        depth, normal = sphere_hits(pod, SIZE)
        assert np.array_equal(view.valid(), np.isfinite(depth))
        assert 0.2 < view.valid().mean() < 0.8
        radius = np.linalg.norm(view.positions(), axis=1)
        assert np.abs(radius - 1).max() < pod.distance * EPSILON
        ray = view.positions() - view.eye
        cosine = -(ray * normal[view.valid()]).sum(axis=1) / np.linalg.norm(ray, axis=1)
        assert view.confidence is not None
        assert np.abs(view.confidence[view.valid()] - cosine).max() < 1e-5
        assert (view.confidence[~view.valid()] == 0).all()


def test_points_are_on_the_faces_of_a_mesh() -> None:
    mesh = sphere_mesh(32, center=(4e6, -7e6, 2e6))
    (pod,) = rig(mesh.bounds, (30.0,), aspect=4 / 3)
    (view,) = capture(mesh, [pod], SIZE, [Faults()])
    faces = trace(mesh, pod, SIZE).id[view.valid()]
    corners = mesh.points.positions[mesh.faces[faces, 0]].astype(np.float64)
    offsets = ((view.positions() - mesh.origin - corners) * face_normals(mesh)[faces]).sum(axis=1)
    assert (
        np.abs(offsets).max() < 8 * EPSILON + pod.distance * EPSILON  # of the hit, of the depth
    )


def test_colours_are_those_of_the_mesh_also_where_depth_is_lost() -> None:
    mesh = sphere_mesh()
    (pod,) = rig(mesh.bounds, (0.0,), aspect=4 / 3)
    (view,) = capture(mesh, [pod], SIZE, [Faults(dropouts=1)])
    picture = trace(mesh, pod, SIZE)
    assert not view.valid().any()
    assert view.color is not None
    assert np.array_equal(view.color, picture.color.astype(np.float16))


def test_pods_stand_around_the_subject() -> None:
    for count in range(1, 9):
        eyes = np.array([pod.eye for pod in pods(count)])
        assert len(np.unique(eyes.round(6), axis=0)) == count
    left, right = pods(2)
    assert left.eye[0] == pytest.approx(-right.eye[0])
    assert left.eye[0] < 0 < left.eye[2]
    for count in (0, 9):
        with pytest.raises(InputError, match="1 to 8 pods"):
            around(count)
        with pytest.raises(InputError, match="1 to 8 pods"):
            rig(UNIT_BOX, (0.0,) * count, aspect=1)


# --- with faults ----------------------------------------------------------------------------

LARGE = (480, 360)


def residuals(faults: Faults, seed: int = 0) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Depth errors, true depths and cosines of measured pixels, and the distance of the pod."""
    (pod,), (view,), (true,) = pods(1, LARGE), scan(faults, 1, LARGE, seed=seed), scan(Faults(), 1, LARGE)
    valid = view.valid()
    assert not (valid & ~true.valid()).any()
    depth, cosine = true.depth[valid].astype(float), true.confidence[valid].astype(float)  # type: ignore[index]
    return view.depth[valid] - depth, depth, cosine, pod.distance


def test_noise_is_as_large_as_stated() -> None:
    error, depth, cosine, distance = residuals(Faults(noise=0.01))
    sigma = 0.01 * (depth / distance) ** 2 / np.maximum(cosine, 0.1)
    scaled = error / sigma
    assert len(scaled) > 40_000
    assert abs(scaled.mean()) < 4 / np.sqrt(len(scaled))
    assert abs(scaled.std() - 1) < 4 / np.sqrt(2 * len(scaled))
    for low, high in ((0, 0.3), (0.3, 0.7), (0.7, 1)):  # at every incidence
        part = scaled[(low < cosine) & (cosine <= high)]
        assert len(part) > 2000
        assert abs(part.std() - 1) < 4 / np.sqrt(2 * len(part))
    assert np.quantile(np.abs(scaled), 0.9973) == pytest.approx(3, abs=0.1)  # Gaussian


def test_noise_may_differ_from_pod_to_pod() -> None:
    exact = scan(Faults())
    noisy = capture(BALL, pods(), SIZE, [Faults(noise=0.001), Faults(noise=0.004)])
    spread = [np.std((n.depth - e.depth)[n.valid()]) for n, e in zip(noisy, exact, strict=True)]
    assert spread[1] / spread[0] == pytest.approx(4, rel=0.1)
    assert not np.array_equal(noisy[0].depth, noisy[1].depth, equal_nan=True)  # nor is it the same chance


def test_disparity_comes_in_steps() -> None:
    step = 0.5
    error, depth, _, distance = residuals(Faults(disparity=step))
    (view,) = scan(Faults(disparity=step), 1, LARGE)
    disparities = view.fx * 0.25 * distance / (depth + error) / step
    assert np.abs(disparities - np.rint(disparities)).max() < 1e-4
    true = view.fx * 0.25 * distance / depth / step
    assert np.abs(disparities - true).max() < 0.5 + 1e-4
    assert len(np.unique(np.rint(disparities))) > 5


def test_a_disparity_that_is_rounded_to_nothing_is_a_hole() -> None:
    assert not any(view.valid().any() for view in scan(Faults(disparity=1e6)))


def test_dropouts_and_outliers_are_the_fractions_asked_for() -> None:
    seen = scan(Faults(), 1, LARGE)[0].valid().sum()
    error, depth, _, distance = residuals(Faults(dropouts=0.2))
    assert (error == 0).all()
    assert abs(len(error) / seen - 0.8) < 4 * np.sqrt(0.2 * 0.8 / seen)
    error, depth, _, distance = residuals(Faults(outliers=0.1))
    wrong = error != 0
    assert abs(wrong.mean() - 0.1) < 4 * np.sqrt(0.1 * 0.9 / seen)
    places = (depth + error)[wrong] / distance
    assert 0.5 <= places.min() < 0.51
    assert 1.49 < places.max() <= 1.5
    assert abs(places.mean() - 1) < 4 / np.sqrt(12 * len(places))


def test_nothing_is_measured_beyond_the_grazing_angle() -> None:
    _, _, every, _ = residuals(Faults())
    _, _, cosine, _ = residuals(Faults(grazing=60))
    assert cosine.min() > 0.5 - 1e-6
    assert len(cosine) == np.count_nonzero(np.degrees(np.arccos(every)) <= 60)


def test_gain_is_that_of_linear_light_and_changes_nothing_else() -> None:
    gains = (1.1, 1.0, 0.5)
    (true,), (cast,) = scan(Faults(), 1), scan(Faults(gain=gains), 1)
    assert true.color is not None
    assert cast.color is not None
    assert true.color[true.valid()].min() > 0.1
    factors = cast.color[true.valid()].astype(float) / true.color[true.valid()]
    assert np.abs(factors / gains - 1).max() < 2 * np.finfo(np.float16).eps
    assert same(replace(cast, color=true.color), true)


def test_a_wrong_calibration_turns_what_was_measured_about_the_eye() -> None:
    (true,), (wrong,) = scan(Faults(), 1), scan(Faults(calibration_error=1.0), 1)
    assert same(replace(wrong, world_to_camera=true.world_to_camera), true)
    assert np.abs(wrong.eye - true.eye).max() < 1e-12
    before, after = true.positions() - true.eye, wrong.positions() - true.eye
    assert np.abs(after[:, 1] - before[:, 1]).max() < 1e-6  # about the upright axis
    turned = np.degrees(np.arctan2(after[:, 0], -after[:, 2]) - np.arctan2(before[:, 0], -before[:, 2]))
    assert np.abs(turned + 1).max() < 1e-4  # to the left: towards -x, as seen from in front


def test_depths_that_are_none_are_holes() -> None:
    for noise in (100.0, 1e300):
        (view,) = scan(Faults(noise=noise), 1)
        assert np.array_equal(view.mask, np.isfinite(view.depth) & (np.nan_to_num(view.depth) > 0))
        assert not np.isinf(view.depth).any()


@pytest.mark.parametrize(
    ("name", "value"),
    [("noise", -1), ("noise", np.nan), ("noise", np.inf), ("disparity", -0.1), ("dropouts", 1.1),
     ("outliers", np.nan), ("grazing", 91), ("gain", (1.0, -1.0, 1.0)), ("gain", (1.0, 1.0, np.inf))],
)  # fmt: skip
def test_faults_that_cannot_be_are_one_message(name: str, value: float) -> None:
    with pytest.raises(InputError, match=f"a scanner's {name} must be"):
        Faults(**{name: value})


# --- chance ---------------------------------------------------------------------------------


def test_chance_depends_on_seed_frame_and_pod_alone() -> None:
    first = scan(FAULTY, seed=3, frame=7)
    scan(FAULTY, seed=3, frame=6)
    assert all(map(same, first, scan(FAULTY, seed=3, frame=7)))
    (alone,) = capture(BALL, pods()[:1], SIZE, [FAULTY], seed=3, frame=7)
    assert same(alone, first[0])
    for other in (scan(FAULTY, seed=4, frame=7), scan(FAULTY, seed=3, frame=8)):
        assert not any(map(same, first, other))


def test_one_fault_does_not_change_the_chances_of_another() -> None:
    noisy, holed = Faults(noise=0.01), Faults(noise=0.01, dropouts=0.3)
    (all_pixels,), (fewer,) = scan(noisy, 1), scan(holed, 1)
    assert np.array_equal(all_pixels.depth[fewer.mask], fewer.depth[fewer.mask])


def test_exr_gives_it_back_bit_for_bit(tmp_path: Path) -> None:
    views = [replace(view, unit="mm") for view in scan(FAULTY, 4)]
    exr.write_views(tmp_path / "a.exr", views)
    assert all(map(same, views, exr.read(tmp_path / "a.exr")))


# --- the command ----------------------------------------------------------------------------

Simulate = Callable[..., tuple[int, str]]


@pytest.fixture
def simulate(capsys: pytest.CaptureFixture[str]) -> Simulate:
    """simulate(scan, "-o", ...): exit code and standard error."""

    def simulate(*words: object) -> tuple[int, str]:
        code = cli.main(["simulate", *map(str, words)])
        error = capsys.readouterr().err
        assert "Traceback" not in error
        assert "internal" not in error
        return code, error

    return simulate


@pytest.fixture
def tetrahedron(tmp_path: Path) -> Path:
    path = tmp_path / "in" / "mesh.obj"
    path.parent.mkdir()
    path.write_text("v 1 1 1\nv -1 -1 1\nv -1 1 -1\nv 1 -1 -1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
    return path


def test_a_sequence_of_one_moving_mesh(simulate: Simulate, data_dir: Path, tmp_path: Path) -> None:
    horse = data_dir / "sequences" / "horse_gallop_48"
    flags = ("--size", "80x60", "--unit", "cm", "--noise", "0.001,0.002", "--seed", "5")
    assert simulate(horse, "--poses", "3:5", "-o", tmp_path / "h%04d.exr", *flags) == (0, "")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["h0003.exr", "h0004.exr", "times.csv"]
    with open(tmp_path / "times.csv", newline="", encoding="utf-8") as stream:
        rows = list(csv.reader(stream))
    assert rows == [["file", "time"], ["h0003.exr", "0.12"], ["h0004.exr", "0.16"]]
    assert exr.read_unit(tmp_path / "h0003.exr") == "cm"
    frames = [exr.read(tmp_path / f"h000{number}.exr") for number in (3, 4)]
    assert [len(views) for views in frames] == [2, 2]
    for one, other in zip(*frames, strict=True):
        assert np.array_equal(one.world_to_camera, other.world_to_camera)  # the rig stands still
        assert not np.array_equal(one.depth, other.depth, equal_nan=True)
    again = tmp_path / "again"
    again.mkdir()
    assert simulate(horse, "--poses", "3:5", "-o", again / "h%04d.exr", *flags)[0] == 0
    for number in (3, 4):
        assert all(map(same, frames[number - 3], exr.read(again / f"h000{number}.exr")))


@pytest.mark.parametrize("pattern", ["frames", "frames/*.ply", "frames/%04d.ply"])
def test_faces_are_found_from_wherever_the_frames_are_named(
    simulate: Simulate, data_dir: Path, tmp_path: Path, pattern: str
) -> None:
    horse = data_dir / "sequences" / "horse_gallop_48"
    out = ("--pose", 2, "--size", "40x30", "-o", tmp_path / "a.exr")
    assert simulate(horse / pattern, *out) == (0, "")
    named = exr.read(tmp_path / "a.exr")
    assert simulate(horse, *out, "--faces", horse / "mesh_topology.ply", "--force") == (0, "")
    assert all(map(same, named, exr.read(tmp_path / "a.exr")))


def test_frames_with_faces_of_their_own(simulate: Simulate, data_dir: Path, tmp_path: Path) -> None:
    owlii = data_dir / "sequences" / "owlii_basketball_player_10"
    done = simulate(owlii, "--pose", 1, "--size", "40x60", "--pods", 1, "-o", tmp_path / "a.exr")
    assert done == (0, "")
    (view,) = exr.read(tmp_path / "a.exr")
    assert view.valid().mean() > 0.05


def test_points_of_the_bunny_are_on_it(simulate: Simulate, data_dir: Path, tmp_path: Path) -> None:
    bunny = data_dir / "models" / "stanford_bunny_35947.ply"
    assert simulate(bunny, "-o", tmp_path / "a.ply", "--size", "120x90") == (0, "")
    cloud = read_points(tmp_path / "a.ply")
    assert cloud.normals is not None
    assert set(cloud.scalars) == {"view", "confidence"}
    mesh = read_mesh(bunny)
    offsets = distances(mesh, cloud.positions + (cloud.origin - mesh.origin).astype(np.float32))
    assert offsets.max() < 16 * EPSILON * mesh.bounds.radius + 4 * EPSILON * np.abs(mesh.bounds.high).max()
    assert simulate(bunny, "-o", tmp_path / "a.exr", "--size", "120x90") == (0, "")
    views = read(tmp_path / "a.exr")
    assert isinstance(views, tuple)
    assert np.array_equal(merge(views).positions + merge(views).origin, cloud.positions + cloud.origin)


def distances(mesh: Mesh, points: np.ndarray) -> np.ndarray:
    """How far points are from a mesh."""
    import open3d

    scene = open3d.t.geometry.RaycastingScene()
    tensor = open3d.core.Tensor.from_numpy
    scene.add_triangles(tensor(mesh.points.positions), tensor(mesh.faces))
    return np.asarray(scene.compute_distance(tensor(points.astype(np.float32))).numpy())


def test_azimuths_name_the_pods(simulate: Simulate, tetrahedron: Path, tmp_path: Path) -> None:
    out = tmp_path / "a.exr"
    flags = ("--azimuths", "-90", "0", "90", "--elevation", "-10", "--fov", "20", "--size", "32x24")
    assert simulate(tetrahedron, "-o", out, *flags) == (0, "")
    views = exr.read(out)
    assert [round(float(view.eye[0]) / 10) for view in views] == [-1, 0, 1]
    assert all(view.eye[1] < 0 for view in views)
    assert views[0].fy == pytest.approx(12 / np.tan(np.radians(10)))


def test_gain_and_calibration_error_may_differ_from_pod_to_pod(
    simulate: Simulate, tetrahedron: Path, tmp_path: Path
) -> None:
    def scanned(*flags: str) -> tuple[RangeView, ...]:
        assert simulate(tetrahedron, "-o", tmp_path / "a.exr", "--size", "32x24", "--force", *flags) == (
            0,
            "",
        )
        return exr.read(tmp_path / "a.exr")

    def colors(views: tuple[RangeView, ...]) -> list[np.ndarray]:
        return [np.asarray(view.color, float)[view.valid()].mean(axis=0) for view in views]

    true = scanned()
    cast = scanned("--gain", "0.5", "0.9,0.8,0.7", "--calibration-error", "0,2")
    for before, after, gain in zip(colors(true), colors(cast), (0.5, (0.9, 0.8, 0.7)), strict=True):
        assert np.allclose(after, before * gain, rtol=2e-3)
    assert np.array_equal(true[0].world_to_camera, cast[0].world_to_camera)
    turn = cast[1].world_to_camera[:3, :3] @ true[1].world_to_camera[:3, :3].T
    assert np.degrees(np.arccos((np.trace(turn) - 1) / 2)) == pytest.approx(2)
    both = scanned("--gain", "0.5")
    assert np.allclose(colors(both), 0.5 * np.array(colors(true)), rtol=2e-3)


@pytest.mark.parametrize(
    ("flags", "message"),
    [
        (("--pods", "9"), "1 to 8 pods, not 9"),
        (("--pods", "0"), "1 to 8 pods"),
        (("--azimuths", *"123456789"), "1 to 8 pods"),
        (("--azimuths", "nan"), "finite"),
        (("--elevation", "inf"), "finite"),
        (("--pods", "3", "--noise", "1,2"), "2 values for 3 pods"),
        (("--noise", "x"), "'x' is not a number"),
        (("--noise=-1",), "noise must be 0 or more, not -1"),
        (("--dropouts", "2"), "dropouts must be 0 to 1, not 2"),
        (("--outliers", "nan"), "outliers must be 0 to 1, not nan"),
        (("--grazing", "100"), "grazing must be 0 to 90, not 100"),
        (("--disparity=-1",), "disparity must be 0 or more, not -1"),
        (("--dropouts", "1"), "contains no points"),
        (("--gain", "1,2"), "neither one factor"),
        (("--gain", "1", "2", "3"), "3 values for 2 pods"),
        (("--gain=-1",), "gain must be 0 or more, not -1"),
        (("--calibration-error", "181"), "calibration error must be 0 to 180, not 181"),
        (("--fov", "180"), "fov_y"),
        (("--size", "0x5"), "not a size"),
        (("--size", "100000x100000"), "too large"),
        (("--seed=-1",), "not a usable seed"),
        (("--faces", "missing.ply"), "missing.ply"),
        (("--pose", "3"), "no pose 3"),
    ],
)
def test_bad_arguments_are_one_message(
    simulate: Simulate, tetrahedron: Path, tmp_path: Path, flags: tuple[str, ...], message: str
) -> None:
    code, error = simulate(tetrahedron, "-o", tmp_path / "a.exr", *flags)
    assert code == 2
    assert message in error
    assert error.count("\n") == 1
    assert not list(tmp_path.glob("*.exr"))


def test_what_cannot_be_scanned_or_written(simulate: Simulate, tetrahedron: Path, tmp_path: Path) -> None:
    out = tmp_path / "a.exr"
    points = tmp_path / "points.ply"
    assert simulate(tetrahedron, "-o", points, "--size", "16x12") == (0, "")
    for scan, target, message in (
        (points, out, "--faces"),
        ("demo:smiel", out, "variant"),
        (tmp_path / "none.ply", out, "no such file"),
        (tetrahedron, tmp_path / "a.png", "cannot write '.png'"),
        (tetrahedron, tmp_path / "none" / "a.exr", "no folder"),
    ):
        code, error = simulate(scan, "--pose", 0, "-o", target)
        assert (code, error.count("\n")) == (2, 1)
        assert message in error
    code, error = simulate(points, "-o", out, "--faces", tetrahedron)
    assert code == 0  # enough vertices for these faces
    assert len(read_faces(tetrahedron)) == 4


@pytest.mark.slow
def test_the_demo_and_its_variants_are_scanned_as_their_exact_surface(
    simulate: Simulate, tmp_path: Path
) -> None:
    """What pods measure of a frame lies on the surface of that variant at that time."""
    out = tmp_path / "sway%02d.exr"
    flags = ("--size", "96x96", "--noise", 0.1)
    assert simulate("demo:sway:1", "--poses", "3:21:17", "-o", out, *flags) == (0, "")
    source = DemoSource("demo:sway:1")
    for index in (3, 20):
        views = read(tmp_path / f"sway{index:02d}.exr")
        assert isinstance(views, tuple)
        assert len(views) == 2
        off = {
            time: np.abs(surface_value(merge(views).world(), float(source.times()[time]), source.motion))
            for time in (3, 20)
        }
        assert np.median(off[index]) < 0.2  # mm, of which the noise is at a slant
        assert np.median(off[23 - index]) > 1


def test_times_of_other_files_are_not_overwritten(
    simulate: Simulate, tetrahedron: Path, tmp_path: Path
) -> None:
    (tmp_path / "times.csv").write_text("file,time\nother.ply,0\n", encoding="utf-8")
    code, error = simulate(tetrahedron, "-o", tmp_path / "a%d.exr", "--size", "16x12")
    assert code == 2
    assert "other files" in error
    assert not list(tmp_path.glob("*.exr"))

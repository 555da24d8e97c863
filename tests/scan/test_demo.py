"""The demo scan: exact surface and normals, a closed and even cover, a motion that bends and repeats."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from demo_surface import rest_of, surface_normal, surface_value
from numpy.typing import NDArray
from scenes import rarely

from viewer.scan.demo import DemoSource, colors, head, motion
from viewer.scan.demo.asset import asset_path, rest_points
from viewer.scan.demo.dual import Dual, coordinates
from viewer.scan.demo.solids import projected
from viewer.scan.open import open_scan

REST, MOUTH_OPEN, EYES_SHUT, SMILE = 0, 20, 36, 48  # poses
TELLING = (REST, MOUTH_OPEN, EYES_SHUT, SMILE)
TWISTS = (motion.EYELID, motion.BROW, motion.JAW, motion.MOUTH_CORNER)
STEP = 1e-5  # mm, of finite differences

Rows = NDArray[np.float64]


def imported_tool() -> ModuleType:
    """The script that made the points."""
    path = Path(__file__).resolve().parents[2] / "tools" / "demo_head.py"
    spec = importlib.util.spec_from_file_location("demo_head", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


sampling = imported_tool()


@pytest.fixture(scope="module")
def demo() -> DemoSource:
    return DemoSource()


def seconds(demo: DemoSource, index: int) -> float:
    return float(demo.times()[index])


def around_the_head(count: int, seed: int = 0) -> Rows:
    """Random places (3, count) in and around the head."""
    low, high = np.transpose(sampling._BOX)[:, :, None]
    return np.random.default_rng(seed).uniform(low, high, (3, count))


def degrees_between(a: Rows, b: Rows) -> Rows:
    """Angles between unit vectors (N, 3), from chords: exact for small ones."""
    return np.degrees(2 * np.arcsin(np.clip(np.linalg.norm(a - b, axis=1) / 2, 0, 1)))


def nearest(places: Rows, points: Rows) -> tuple[NDArray[np.intp], Rows]:
    """For each of (M, 3) places its nearest of (N, 3) points and the distance, by comparing all."""
    singles = points.astype(np.float32)
    rows = np.concatenate(
        [
            sum((singles[:, k] - part[:, k, None]) ** 2 for k in range(3)).argmin(axis=1)
            for part in np.array_split(places.astype(np.float32), len(places) // 32 + 1)
        ]
    )
    return rows, np.linalg.norm(points[rows] - places, axis=1)


@pytest.mark.parametrize("formula", [head.skin, head.eyes, *(twist.weight for twist in TWISTS)])
def test_dual_numbers_give_the_gradient(formula) -> None:
    places = around_the_head(2000)
    result = formula(*coordinates(places))
    steps = STEP * np.eye(3)[:, :, None]
    slopes = [(formula(*(places + s)) - formula(*(places - s))) / (2 * STEP) for s in steps]
    np.testing.assert_array_equal(result.value, formula(*places))
    np.testing.assert_allclose(result.gradient, slopes, atol=1e-6)


def test_dual_numbers_refuse_what_they_cannot_derive() -> None:
    with pytest.raises(TypeError):
        np.cosh(Dual(np.ones(2), {0: np.ones(2)}))


@pytest.mark.parametrize("index", [MOUTH_OPEN, *rarely(REST, EYES_SHUT, SMILE)])
@pytest.mark.slow
def test_points_lie_on_the_exact_surface(demo: DemoSource, index: int) -> None:
    points = demo.load(index).world().T
    skin = rest_points().skin
    at_rest = rest_of(points[:, :skin], seconds(demo, index))
    assert np.abs(head.skin(*at_rest)).max() < 1e-4  # mm: float32
    assert np.abs(head.eyes(*points[:, skin:])).max() < 1e-4


@pytest.mark.parametrize("index", [EYES_SHUT, *rarely(REST, MOUTH_OPEN, SMILE)])
@pytest.mark.slow
def test_nearly_all_points_are_on_the_outside(demo: DemoSource, index: int) -> None:
    """Some of an eyeball's points are always behind the lids."""
    value = surface_value(demo.load(index).world(), seconds(demo, index))
    assert value.max() < 1e-4
    assert np.mean(value > -1e-4) > 0.97


@pytest.mark.parametrize("index", [MOUTH_OPEN, *rarely(REST, EYES_SHUT, SMILE)])
def test_normals_are_those_of_the_surface_and_face_outwards(demo: DemoSource, index: int) -> None:
    cloud, time = demo.load(index), seconds(demo, index)
    pick = np.random.default_rng(1).choice(rest_points().skin, 3000, replace=False)
    points, normals = cloud.world()[pick], cloud.normals[pick].astype(np.float64)
    shown = head.eyes(*points.T) > 1e-3
    points, normals = points[shown], normals[shown]
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-6)
    assert degrees_between(normals, surface_normal(points, time)).max() < 0.06  # stored in 16 bits
    difference = [surface_value(points + s, time) - surface_value(points - s, time) for s in STEP * np.eye(3)]
    slope = np.transpose(difference) / np.linalg.norm(difference, axis=0)[:, None]
    exact = surface_normal(points, time)
    assert degrees_between(exact, slope).max() < 0.01
    assert np.mean(surface_value(points + 0.02 * exact, time) > 0) > 0.998


def test_eyeballs_have_exact_normals() -> None:
    rest = rest_points()
    exact = motion.normalized(
        head.eyes(*coordinates(rest.positions[:, rest.skin :].astype(np.float64))).gradient
    )
    assert degrees_between(exact.T, rest.normals[:, rest.skin :].T).max() < 0.01


def test_the_halves_of_the_face_meet_smoothly() -> None:
    rest = rest_points().positions
    bare = (np.abs(rest[0]) < 0.7) & (head.hair_region(np.abs(rest[0]), rest[1], rest[2]) > 5)
    middle = rest[:, bare & (np.arange(rest.shape[1]) < rest_points().skin)].astype(np.float64)
    sides = []
    for side in (1e-7, -1e-7):
        middle[0] = side
        sides.append(motion.normalized(head.skin(*coordinates(middle)).gradient).T)
    assert len(middle.T) > 200
    assert degrees_between(*sides).max() < 3


@pytest.mark.parametrize("index", TELLING)
def test_motion_can_be_undone(demo: DemoSource, index: int) -> None:
    places = around_the_head(4000)
    moved, _, growth = motion.move(places, motion.normalized(places), seconds(demo, index))
    np.testing.assert_allclose(rest_of(moved, seconds(demo, index)), places, atol=1e-9)
    assert growth.min() > 0


@pytest.mark.parametrize("index", [SMILE, *rarely(REST, MOUTH_OPEN, EYES_SHUT)])
@pytest.mark.slow
def test_points_cover_the_surface(demo: DemoSource, index: int) -> None:
    """Random places of the surface are within the radius of a point that faces the same way."""
    cloud, time = demo.load(index), seconds(demo, index)
    scattered = sampling._scattered(head.skin, sampling._skin_shows, 1500, np.random.default_rng(2))
    places, normals = projected(head.skin, scattered)
    places, normals = places[:, head.eyes(*places) > 0.3], normals[:, head.eyes(*places) > 0.3]
    places, normals, _ = motion.move(places, normals, time)
    rows, distances = nearest(places.T, cloud.world())
    assert np.mean(distances < cloud.radii[rows]) > 0.999
    facing = (cloud.normals[rows] * normals.T).sum(axis=1)
    assert np.mean(facing > 0) > 0.995


@pytest.mark.slow
def test_points_are_evenly_spread() -> None:
    """Random points would have neighbours nearer than a third of the spacing at one place in ten."""
    rest = rest_points()
    points = rest.positions.T.astype(np.float64)
    pick = np.random.default_rng(3).choice(rest.skin, 800, replace=False)
    spacing = rest.radii[pick]
    apart = []
    for row in pick:
        squares = ((points - points[row]) ** 2).sum(axis=1)
        squares[row] = np.inf
        apart.append(np.sqrt(squares.min()))
    ratio = np.array(apart) / spacing
    assert np.quantile(ratio, 0.02) > 0.5
    assert 0.7 < np.median(ratio) < 1.1


def test_poses_and_attributes(demo: DemoSource) -> None:
    cloud = demo.load(7)
    assert len(demo) >= 60
    assert len(cloud) >= 60_000
    np.testing.assert_allclose(np.diff(demo.times()), 1 / demo.fps)
    assert len({demo.label(index) for index in range(len(demo))}) == len(demo)
    assert cloud.normals is not None
    assert cloud.colors is not None
    assert cloud.radii is not None
    assert cloud.ids is None
    assert (cloud.radii > 0).all()
    assert cloud.positions.dtype == cloud.normals.dtype == cloud.radii.dtype == np.float32
    assert set(cloud.scalars) == {"displacement"}
    low, high = cloud.world().min(axis=0), cloud.world().max(axis=0)
    assert 200 < high[1] - low[1] < 300  # mm
    assert np.abs(low + high).max() / 2 < 20
    np.testing.assert_allclose(cloud.world()[cloud.world()[:, 2].argmax()], (0, -30, 110), atol=4)  # the nose


def test_poses_are_deterministic_and_independent(demo: DemoSource) -> None:
    first = demo.load(MOUTH_OPEN)
    demo.load(SMILE)
    again = DemoSource().load(MOUTH_OPEN)
    for name in ("positions", "normals", "colors", "radii", "origin"):
        np.testing.assert_array_equal(getattr(first, name), getattr(again, name))


@pytest.mark.slow
def test_a_point_stays_the_same_point(demo: DemoSource) -> None:
    """Colours belong to points, and between two poses no point travels far."""
    poses = [demo.load(index) for index in range(len(demo))]
    steps = [
        float(np.linalg.norm(b.positions - a.positions, axis=1).max())
        for a, b in zip(poses, [*poses[1:], poses[0]], strict=True)
    ]
    for pose in poses[1:]:
        np.testing.assert_array_equal(pose.colors, poses[0].colors)
        np.testing.assert_array_equal(pose.origin, poses[0].origin)
    assert max(steps) < 6  # mm
    assert steps[-1] < np.median(steps)  # the last flows into the first


def test_the_motion_repeats() -> None:
    points, normals = around_the_head(500), motion.normalized(around_the_head(500, 1))
    for now, later in zip(
        motion.move(points, normals, 0.7), motion.move(points, normals, 0.7 + motion.PERIOD), strict=True
    ):
        np.testing.assert_allclose(now, later, atol=1e-9)


def test_the_motion_is_not_rigid(demo: DemoSource) -> None:
    rest = rest_points().positions.T
    moved = {index: demo.load(index).scalars["displacement"] for index in TELLING}
    lip = np.linalg.norm(rest - (0, -66, 90), axis=1) < 4
    corner = np.linalg.norm(rest - (26, -58, 80), axis=1) < 4
    brow = np.linalg.norm(rest - (28, 33, 76), axis=1) < 5
    still = (rest[:, 1] > 95) | (rest[:, 2] < -15) | (rest[:, 1] < -147)
    assert lip.any()
    assert corner.any()
    assert brow.any()
    assert moved[MOUTH_OPEN][lip].min() > 10
    assert moved[MOUTH_OPEN][brow].min() > 3
    assert moved[SMILE][corner].min() > 5
    for index in TELLING:
        assert moved[index][still].max() < 0.1


def test_displacement_is_the_distance_from_rest(demo: DemoSource) -> None:
    cloud = demo.load(SMILE)
    np.testing.assert_allclose(
        cloud.scalars["displacement"],
        np.linalg.norm(cloud.world() - rest_points().positions.T, axis=1),
        atol=1e-4,
    )


def test_the_mouth_opens_and_the_eyes_shut(demo: DemoSource) -> None:
    behind_the_lip, before_the_pupil = (0.0, -66.0, 87.0), (31.0, 11.0, 74.5)

    def inside(place: tuple[float, float, float], index: int) -> bool:
        return bool(surface_value([place], seconds(demo, index))[0] < 0)

    assert inside(behind_the_lip, REST)
    assert not inside(behind_the_lip, MOUTH_OPEN)
    assert inside(before_the_pupil, EYES_SHUT)
    assert not inside(before_the_pupil, REST)


def test_the_shipped_colours_are_those_of_the_formula() -> None:
    rest = rest_points()
    albedo = colors.albedo(rest.positions.astype(np.float64), rest.normals.astype(np.float64), rest.skin)
    off = np.abs(np.rint(255 * albedo) - rest.colors).max(axis=1)
    assert np.mean(off <= 2) > 0.999


def test_the_shipped_file_is_small() -> None:
    assert asset_path().stat().st_size < 2_000_000


@pytest.mark.slow
def test_sampling_repeats_itself() -> None:
    first, again = (sampling.sample(4000, seed=5) for _ in range(2))
    np.testing.assert_array_equal(first.positions, again.positions)
    np.testing.assert_array_equal(first.colors, again.colors)
    assert np.abs(head.skin(*first.positions[:, : first.skin].astype(np.float64))).max() < 1e-4


def test_open_scan_plays_it() -> None:
    timeline = open_scan("demo")
    assert len(timeline) == len(DemoSource())
    np.testing.assert_array_equal(timeline.times, DemoSource().times())
    assert len(timeline.pose(3).cloud) == rest_points().positions.shape[1]

"""Covering: it does what its plain twin does; spheres, one behind another, from outside and inside, uneven
density; and on scans with faces it errs less than the exact operator."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scenes import rarely, sphere

from viewer.camera import Camera
from viewer.drawing.frame import Renderer
from viewer.gpu.pose import GpuPose
from viewer.mesh.reference import visible
from viewer.mesh.triangles import read_mesh
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose
from viewer.visibility.calibration import EyeCalibration, body_of, calibrate
from viewer.visibility.covering import CLEAR, REACH, STEEP, Covering, SpacedPoints
from viewer.visibility.exact import SeenPoints, exact_visible_points, flipping, hull_rows
from viewer.visibility.search import calibrated, visible_points
from viewer.visibility.sectors import Sectors
from viewer.visibility.spacing import FEWEST, NEAREST, local_spacings, spacing_texels

COUNT = 3000
SPACING = np.sqrt(4 * np.pi / COUNT)
Flags = NDArray[np.bool_]
Floats = NDArray[np.float64]


def spread(count: int = COUNT) -> Floats:
    """Points of the unit sphere."""
    return sphere(count).positions.astype(np.float64)


def seen_of(points: Floats, eye: Floats, mode: str = "combined") -> Flags:
    seen = np.zeros(len(points), bool)
    seen[visible_points(points, eye, mode=mode)] = True
    return seen


def before_horizon(points: Floats, eye: Floats) -> Floats:
    """By how much points of the unit sphere lie before its horizon, along the way to the eye."""
    distance = np.linalg.norm(eye)
    return points @ (eye / distance) - 1 / distance


# --- the plain twin -----------------------------------------------------------------------


def apart_at(points: Floats) -> Floats:
    """How far apart points lie around each, by the distances of the nearest ones."""
    between = np.linalg.norm(points[:, None] - points[None], axis=2)
    nearest = np.sort(between, axis=1)[:, FEWEST : NEAREST + 1]
    return (nearest * np.sqrt(np.pi / np.arange(FEWEST, NEAREST + 1))).max(axis=1)


def uncovered_ones(away: Floats, spacings: Floats) -> Flags:
    """Points, offsets from the eye, that no others cover."""
    distance = np.linalg.norm(away, axis=1)
    unit, reach = away / distance[:, None], REACH * spacings / distance
    # Angles by the cross product, which is exact for small ones.
    aside = np.linalg.norm(np.cross(unit[:, None], unit[None]), axis=2)
    aside[unit @ unit.T <= 0] = np.inf
    deeper = (distance[:, None] - distance[None]) / distance[None]
    left = np.zeros(len(away), bool)
    for i, direction in enumerate(unit):
        covers = (aside[i] <= reach) & (deeper[i] > CLEAR * reach + STEEP * aside[i])
        one = np.cross(direction, np.eye(3)[np.argmin(np.abs(direction))])
        two = np.cross(direction, one)
        turns = np.sort(np.arctan2(unit[covers] @ two, unit[covers] @ one))
        gaps = np.diff(np.append(turns, turns[0] + 2 * np.pi)) if len(turns) else np.array([2 * np.pi])
        left[i] = gaps.max() > np.pi * (1 - 1 / 64)
    return left


@dataclass(frozen=True)
class Watched:
    """Points on the GPU, an eye, and what is found of them."""

    pose: GpuPose
    found: EyeCalibration

    @classmethod
    def of(cls, renderer: Renderer, points: Floats, eye: Floats, mapping: str) -> Watched:
        cloud = PointCloud.from_arrays(points)
        pose, body = GpuPose(renderer.gpu, Pose(0, 0.0, "", cloud)), body_of(cloud)
        around = Sectors.around(body.center, body.radius, eye, pose.origin)
        assert around.mapping == mapping
        return cls(pose, calibrate(cloud, around, pose.origin, 2.0))

    def seen(self, finer: float = 1.0, front: bool = True) -> Flags:
        """finer: than they usually are, the cells."""
        covering = Covering(self.pose.gpu, len(self.pose.cloud))
        covering.find(
            SpacedPoints(self.pose.array("positions"), spacing_texels(self.pose)),
            self.found.sectors,
            self.found.spacing / self.found.sectors.edge / finer,
            front=front,
        )
        seen = np.zeros(len(self.pose.cloud), bool)
        seen[covering.visible_rows()] = True
        covering.release()
        return seen


SCENES = {
    "far": (np.array([0.2, 0.3, 3.5]), "grid"),
    "near": (np.array([1.2, 0.3, 0.4]), "cube"),
    "inside": (np.array([0.1, 0.25, -0.15]), "cube"),
}


def scene() -> Floats:
    """A rough sphere, a smaller one in it, and one in its wall."""
    rng = np.random.default_rng(5)
    points = np.concatenate([spread(900), 0.4 * spread(500), spread(300) * 0.2 + [0.3, 0.5, 0.6]])
    return points * rng.uniform(0.97, 1.03, (len(points), 1))


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.slow
def test_it_does_what_its_plain_twin_does(renderer: Renderer, name: str) -> None:
    """Where gaps are half a turn to a 64th, and where rounding decides, it may differ."""
    (eye, mapping), points = SCENES[name], scene()
    got = Watched.of(renderer, points, eye, mapping).seen(front=False)
    expected = uncovered_ones(points - eye, apart_at(points))
    assert 50 < got.sum() < len(points) - 50
    assert np.count_nonzero(got != expected) <= 0.01 * len(points)


@pytest.mark.parametrize("name", SCENES)
def test_cells_do_not_matter(renderer: Renderer, name: str) -> None:
    """Discs that reach far beyond the cells that they usually reach are found all the same."""
    watched = Watched.of(renderer, scene(), *SCENES[name])
    expected = watched.seen(front=False)
    for finer in (0.3, 1.5):
        np.testing.assert_array_equal(watched.seen(finer, front=False), expected)


@pytest.mark.parametrize("name", SCENES)
def test_what_is_left_out_at_first_is_hidden(renderer: Renderer, name: str) -> None:
    """Nearly all of it: where a gap is narrower than the cells that tell the front, what no disc reaches."""
    watched = Watched.of(renderer, scene(), *SCENES[name])
    assert np.count_nonzero(watched.seen() != watched.seen(front=False)) <= 0.003 * len(scene())


def test_spacings_are_those_of_the_plain_twin() -> None:
    rng = np.random.default_rng(3)
    sparse = rng.uniform(3, 9, (200, 3))
    points = np.concatenate([spread(2000), sparse])
    cloud = PointCloud.from_arrays(points)
    np.testing.assert_allclose(local_spacings(cloud), apart_at(cloud.world()), rtol=1e-5)


# --- what is known exactly ------------------------------------------------------------------


@pytest.mark.parametrize("eye", [(0, 0, 3.0), (0.3, 1.2, -0.2), (1e3, 0, 0), (1e6, -2e5, 1e5)])
def test_of_a_sphere_the_front_is_seen_and_the_back_is_not(eye: tuple[float, float, float]) -> None:
    points, at = spread(), np.array(eye)
    seen, before = seen_of(points, at), before_horizon(points, at)
    assert seen[before > 0.5 * SPACING].all()
    assert not seen[before < -4 * SPACING].any()


def test_of_two_spheres_the_one_behind_is_hidden() -> None:
    points, at = np.concatenate([spread(), 0.5 * spread() + [0, 0, -3]]), np.array([0, 0, 4.0])
    seen = seen_of(points, at)
    assert not seen[COUNT:].any()
    assert seen[:COUNT][before_horizon(points[:COUNT], at) > 0.5 * SPACING].all()


def test_from_inside_all_of_a_sphere_is_seen_but_what_a_smaller_one_hides() -> None:
    small = 0.2 * spread(1000) + [0, 0, 0.5]
    points = np.concatenate([spread(), small])
    seen = seen_of(points, np.zeros(3))
    angle = np.arccos(spread() @ [0, 0, 1.0])
    shadow = np.arcsin(0.2 / 0.5)
    assert seen[:COUNT][angle > shadow + 2 * SPACING].all()
    assert not seen[:COUNT][angle < shadow - 2 * SPACING].any()


def test_a_bowl_is_seen_into() -> None:
    """A concave surface, of which the hull of a small radius drops most."""
    points = spread()
    points = points[points[:, 2] < -0.2]
    at = np.array([0, 0, 6.0])
    assert seen_of(points, at).mean() > 0.99
    assert len(exact_visible_points(points, at, 100.0)) < 0.7 * len(points)


def test_uneven_density_leaves_no_hole() -> None:
    """One side of the sphere has sixteen times as many points as the other."""
    rng = np.random.default_rng(2)
    points = spread(12000)
    points = points[rng.random(len(points)) < np.where(points[:, 0] > 0, 1.0, 1 / 16)]
    at = np.array([0, 0, 3.0])
    seen, before = seen_of(points, at), before_horizon(points, at)
    assert seen[before > 0.1].mean() > 0.98
    assert seen[before < -0.5].mean() < 0.02


@pytest.mark.parametrize("noise", [1.0, *rarely(2.0)])
def test_noise_hides_less_than_from_the_exact_operator(noise: float) -> None:
    """Noise in distances between points, against the exact operator at the best of some radii."""
    rng = np.random.default_rng(4)
    points, at = spread(), np.array([0.2, 0.1, 3.0])
    truth = before_horizon(points, at) > 0
    noisy = points + rng.normal(0, noise * SPACING, points.shape)
    farthest = float(np.linalg.norm(noisy - at, axis=1).max())
    exact = []
    for times in (10, 30, 100, 300, 1000, 3000):
        hull = np.zeros(COUNT, bool)
        hull[exact_visible_points(noisy, at, times * farthest)] = True
        exact.append(errors(hull, truth))
    assert errors(seen_of(noisy, at), truth) < min(exact) - 5


def test_the_same_each_time() -> None:
    rng = np.random.default_rng(7)
    points = spread() * rng.uniform(0.9, 1.1, (COUNT, 1))
    first, second = (visible_points(points, (0, 0, 3.0)) for _ in range(2))
    np.testing.assert_array_equal(first, second)


def test_of_points_in_one_place_one_is_seen() -> None:
    points, at = spread(500), np.array([0.3, 0.4, 3.0])
    order = np.random.default_rng(1).permutation(np.repeat(np.arange(500), 20))
    first = np.unique(order, return_index=True)[1]
    np.testing.assert_array_equal(
        visible_points(points[order], at), np.sort(first[visible_points(points, at)])
    )


@pytest.mark.parametrize("scale", [1e-12, 1e12])
def test_scale_does_not_matter(scale: float) -> None:
    points, at = spread(), np.array([0.4, 0.5, 3.0])
    np.testing.assert_array_equal(visible_points(points * scale, at * scale), visible_points(points, at))


# --- scans with faces ------------------------------------------------------------------------

# Percent of errors at most.
MODELS = {"stanford_armadillo_43243": 5.7, "cyberware_igea_134345": 1.4, "stanford_dragon_437645": 2.9}
RADII = (3e3, 1e4, 2e4)  # distances of the farthest point, of which the best for each view is taken
BEST, AUTOMATIC = "best", "automatic"
WANTED = 5.0  # percentage points by which the exact operator errs more
ARMADILLO, IGEA, DRAGON = MODELS
# Where it is not so many.
SHORT = {
    (ARMADILLO, BEST): "4.5 points: 4.2 % against 8.8 %",
    (ARMADILLO, AUTOMATIC): "4.6 points: 4.2 % against 8.8 %",
    (IGEA, BEST): "2.9 points: 1.1 % against 4.0 %, so that none at all would not do",
    (IGEA, AUTOMATIC): "3.6 points: 1.1 % against 4.7 %, so that none at all would not do",
    (DRAGON, BEST): "4.0 points: 2.6 % against 6.6 %",
    (DRAGON, AUTOMATIC): "4.0 points: 2.6 % against 6.6 %",
}


def errors(seen: Flags, truth: Flags) -> float:
    """Percent of the points that are rightly called visible."""
    return 100 * np.count_nonzero(seen != truth) / np.count_nonzero(seen & truth)


@cache
def errors_of(path: Path) -> tuple[float, dict[str, float]]:
    """Errors on a model, the means of two views: its own, and those of the exact operator by its radius."""
    mesh = read_mesh(path)
    found, best, automatic = [], [], []
    for azimuth, elevation in ((30, 10), (200, -20)):
        camera = Camera.orbit(mesh.points.bounds(), azimuth, elevation)
        eye = np.array(camera.eye)
        truth = visible(mesh, mesh.points.positions, camera)
        seen = SeenPoints.of(mesh.points, eye)
        farthest = float(seen.distance.max())
        radii = [calibrated(mesh.points, eye).radius, *(times * farthest for times in RADII)]
        called = [visible_points(mesh.points, eye), *(hull_rows(seen, flipping(seen, r)) for r in radii)]
        mine, *exact = (errors(np.isin(np.arange(len(truth)), rows), truth) for rows in called)
        found.append(mine)
        automatic.append(exact[0])
        best.append(min(exact))
    return float(np.mean(found)), {BEST: float(np.mean(best)), AUTOMATIC: float(np.mean(automatic))}


@pytest.mark.slow
@pytest.mark.parametrize("name", MODELS)
def test_it_errs_less_than_the_exact_operator(data_dir: Path, name: str) -> None:
    found, exact = errors_of(data_dir / "models" / f"{name}.ply")
    assert found < MODELS[name]
    assert found < 0.6 * min(exact.values())


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "radius"),
    [pytest.param(*case, marks=pytest.mark.xfail(strict=True, reason=why)) for case, why in SHORT.items()],
)
def test_the_exact_operator_errs_five_points_more(data_dir: Path, name: str, radius: str) -> None:
    found, exact = errors_of(data_dir / "models" / f"{name}.ply")
    assert exact[radius] - found >= WANTED

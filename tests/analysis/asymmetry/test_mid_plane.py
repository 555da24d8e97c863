"""The mid-plane of a subject that is symmetric but for a bump, and how far it lies from its mirror image."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from viewer.analysis.asymmetry.asymmetry_map import asymmetry_map
from viewer.analysis.asymmetry.mid_plane import MirroredPose
from viewer.analysis.landmarks.mirroring import MirrorPlane
from viewer.errors import InputError
from viewer.rigid import Rigid, rigid_matrix
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose

LEFT = np.array([1.0, 0.0, 0.0])
# Directions, heights in mm and widths of what stands off a ball on both sides, or in the middle.
BUMPS = [
    ((0, 0.1, 1), 18, 0.3),
    ((0.9, 0.2, 0.1), 9, 0.25),
    ((0.5, 0.6, 0.6), 6, 0.3),
    ((0, -0.8, 0.5), 12, 0.35),
]
ONE_SIDED = np.array([0.6, -0.4, 0.7]) / np.linalg.norm([0.6, -0.4, 0.7])
WIDTH = 0.25


def directions(count: int, seed: int) -> np.ndarray:
    found = np.random.default_rng(seed).normal(size=(count, 3))
    found = found[found[:, 2] > -0.4 * np.linalg.norm(found, axis=1)]  # a face, not a whole head
    return found / np.linalg.norm(found, axis=1)[:, None]


def smile(out: np.ndarray) -> np.ndarray:
    """How much of the one-sided bump a direction has, (N,)."""
    return np.exp(-(1 - out @ ONE_SIDED) / WIDTH**2)


def radii(out: np.ndarray, amount: float) -> np.ndarray:
    radius = 70 + 12 * out[:, 1] ** 2 + amount * smile(out)
    for direction, height, width in BUMPS:
        for side in (1, -1) if direction[0] else (1,):
            toward = np.array([side * direction[0], *direction[1:]]) / np.linalg.norm(direction)
            radius = radius + height * np.exp(-(1 - out @ toward) / width**2)
    return radius


def subject(count: int = 30_000, amount: float = 0.0, noise: float = 0.0, seed: int = 0) -> np.ndarray:
    out = directions(count, seed)
    noises = np.random.default_rng(seed + 1).normal(0, noise, len(out))
    return (radii(out, amount) + noises)[:, None] * out


def pose(points: np.ndarray) -> Pose:
    return Pose.of(0, 0.0, "head", PointCloud.from_arrays(points))


def turned(degrees: float, seed: int) -> Rigid:
    axis = np.random.default_rng(seed).normal(size=3)
    rotation = Rotation.from_rotvec(np.radians(degrees) * axis / np.linalg.norm(axis)).as_matrix()
    return Rigid(rigid_matrix(rotation, np.array([300.0, -40.0, 900.0])))


@pytest.mark.each_value
@pytest.mark.parametrize("amount", [0.0, 1.8, 4.0])
@pytest.mark.parametrize("degrees", [0.0, 30.0, 120.0])
def test_the_mid_plane_is_found_from_any_start(amount: float, degrees: float) -> None:
    motion = turned(degrees, int(degrees))
    found = MirroredPose(pose(motion.points(subject(12_000, amount, 0.1)))).mid_plane(motion.rotation @ LEFT)
    truth = MirrorPlane(LEFT, 0.0, np.nan).moved(motion)
    angle = np.degrees(np.arccos(min(1.0, float(found.plane.normal @ truth.normal))))
    middle = motion.points(np.array([0.0, 0.0, 30.0]))
    assert angle < 0.1
    assert abs(found.plane.normal @ middle - found.plane.offset) < 0.1
    assert 0 < found.turn < 0.1
    assert 0 < found.shift < 0.1
    assert found.matched > 0.7


def test_a_region_tells_the_plane_alone() -> None:
    points = subject(20_000)
    points[:, 0] -= 0.08 * np.minimum(points[:, 1], 0.0)  # a jaw that deviates to one side
    whole = MirroredPose(pose(points)).mid_plane(LEFT)
    upper = MirroredPose(pose(points), points[points[:, 1] > 10]).mid_plane(LEFT)

    def off(normal: np.ndarray) -> float:
        return float(np.degrees(np.arccos(min(1.0, abs(normal[0])))))

    assert off(upper.plane.normal) < 0.05
    assert off(whole.plane.normal) > 0.5


def test_a_plane_near_another_one_is_the_same_as_from_a_search() -> None:
    first = MirroredPose(pose(subject())).mid_plane(LEFT)
    motion = turned(4.0, 1)
    motion = Rigid(rigid_matrix(motion.rotation, np.array([3.0, 1.0, 0.0])))
    moved = MirroredPose(pose(motion.points(subject(seed=5))))
    near, anew = moved.mid_plane(LEFT, first), moved.mid_plane(LEFT)
    np.testing.assert_allclose(near.plane.normal, anew.plane.normal, atol=1e-3)
    far = turned(90.0, 1)
    jumped = MirroredPose(pose(far.points(subject(seed=5)))).mid_plane(far.rotation @ LEFT, first)
    np.testing.assert_allclose(jumped.plane.normal, far.rotation @ LEFT, atol=1e-3)


@pytest.mark.parametrize(
    "amount", [pytest.param(0.5, marks=pytest.mark.slow), 1.8, pytest.param(4.0, marks=pytest.mark.slow)]
)
def test_the_map_is_how_much_more_one_side_has(amount: float) -> None:
    points = subject(40_000, amount)
    plane = MirroredPose(pose(points)).mid_plane(LEFT).plane
    found = asymmetry_map(pose(points), plane, 20.0).values
    out = points / np.linalg.norm(points, axis=1)[:, None]
    step = 1e-4
    slopes = np.stack(
        [
            (radii(moved / np.linalg.norm(moved, axis=1)[:, None], 0.0) - radii(out, 0.0)) / step
            for moved in (out + step * np.eye(3)[axis] for axis in range(3))
        ],
        axis=1,
    )
    steep = np.sqrt(1 + np.square(slopes).sum(axis=1) / np.square(radii(out, 0.0)))
    truth = amount * (smile(out) - smile(out * [-1, 1, 1])) / steep
    inner = out[:, 2] > -0.3
    assert np.isfinite(found[inner]).mean() > 0.99
    assert np.nanmedian(np.abs(found - truth)[inner]) < 0.02 * amount
    rms, right = (np.sqrt(np.nanmean(np.square(each[inner]))) for each in (found, truth))
    assert rms == pytest.approx(right, rel=0.05)


@pytest.mark.parametrize("noise", [pytest.param(0.05, marks=pytest.mark.slow), 0.3])
def test_noise_does_not_count_as_asymmetry(noise: float) -> None:
    plane = MirrorPlane(LEFT, 0.0, np.nan)
    still, smiling = (asymmetry_map(pose(subject(40_000, each, noise)), plane, 20.0) for each in (0.0, 4.0))
    clean = asymmetry_map(pose(subject(40_000, 4.0)), plane, 20.0)
    assert np.nanstd(still.values) == pytest.approx(still.noise, rel=0.15)
    assert still.rms < 0.6 * still.noise
    assert smiling.rms == pytest.approx(clean.rms, rel=0.05)
    assert clean.noise < 0.02


def test_what_has_too_few_points_or_no_mirror_image_is_refused() -> None:
    with pytest.raises(InputError, match="too few points"):
        MirroredPose(pose(np.eye(3)))
    with pytest.raises(InputError, match="too few points"):
        MirroredPose(pose(subject()), np.full((1, 3), 1e4))

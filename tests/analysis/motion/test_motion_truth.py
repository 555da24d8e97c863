"""The motion of the demo's head, sampled anew in each frame with noise, against the exact one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from experiments.landmarks.resampled import ResampledDemo
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from viewer.analysis.motion.found import found_region
from viewer.analysis.motion.registration import RegionSurface, register_region
from viewer.analysis.motion.stabilise import (
    FrameMotion,
    MotionReference,
    MotionState,
    WeakLimits,
    moment_surface,
    stabilise,
)
from viewer.rigid import Rigid, rigid_matrix
from viewer.scan.demo.motion import NECK, HeadMotion
from viewer.scan.points import PointCloud
from viewer.scan.timeline import Timeline

pytestmark = pytest.mark.slow

NOISE = 0.1
LIMITS = WeakLimits(0.5)
# Spheres at rest: middle and radius, mm. From what holds all directions to what is nearly flat or round.
REGIONS = {
    "skull": [(0, 50, 20, 110)],
    "upper face": [(0, 35, 80, 60)],
    "eye sockets": [(30, 15, 70, 22), (-30, 15, 70, 22)],
    "ears": [(75, 0, -5, 25), (-75, 0, -5, 25)],
    "forehead, large": [(0, 50, 85, 45)],
    "temples": [(62, 25, 45, 22), (-62, 25, 45, 22)],
    "nose": [(0, -15, 105, 25)],
    "brows": [(0, 28, 90, 15), (25, 30, 85, 15), (-25, 30, 85, 15)],
    "crown": [(0, 115, 0, 40)],
    "cheek": [(45, -30, 65, 22)],
    "one temple": [(62, 25, 45, 22)],
    "back of the head": [(0, 30, -100, 25)],
    "nose bridge": [(0, 8, 95, 14)],
    "forehead, small": [(0, 55, 88, 18)],
    "forehead, tiny": [(0, 60, 85, 9)],
}


@dataclass(frozen=True)
class Heads:
    """A source of frames that are in memory, and where the head is in each."""

    source: ResampledDemo
    clouds: list[PointCloud]

    def timeline(self, change: Callable[[int, NDArray], NDArray] = lambda frame, points: points) -> Timeline:
        from experiments.landmarks.known import KeptFrames

        clouds = [
            PointCloud.from_arrays(change(frame, cloud.world()), origin=np.zeros(3), precise=False)
            for frame, cloud in enumerate(self.clouds)
        ]
        times = self.source.times()[: len(clouds)]
        return Timeline(KeptFrames("heads", clouds, times), times, "mm")

    def at(self, frame: int) -> Rigid:
        turn = self.source.demo.motion.turned(float(self.source.times()[frame]))
        return Rigid(rigid_matrix(turn, NECK - turn @ NECK))

    def truth(self, frame: int, reference: int) -> Rigid:
        return self.at(frame).after(self.at(reference).inverse)


@pytest.fixture(scope="module")
def talking() -> Heads:
    """Twenty frames of a head that turns and talks."""
    source = ResampledDemo("demo:sway:1", NOISE, 1, -25.0)
    return Heads(source, [source.load(frame) for frame in range(20)])


def off(found: Rigid, right: Rigid, middle: NDArray) -> NDArray:
    """How far a motion is off, (6,): turns in degrees, and the shift of the middle."""
    turn = Rotation.from_matrix(found.rotation @ right.rotation.T).as_rotvec(degrees=True)
    return np.concatenate([turn, found.points(middle) - right.points(middle)])


def strays(frame: int, points: NDArray) -> NDArray:
    chance = np.random.default_rng(frame)
    astray = chance.random(len(points)) < 0.05
    return points + astray[:, None] * chance.uniform(-10, 10, points.shape)


@pytest.mark.parametrize(
    ("fault", "most"),
    [(None, 0.05), ("outliers", 0.05), ("hidden", 0.1)],
    ids=["plain", "outliers", "hidden"],
)
def test_the_motion_of_a_talking_head_is_found(talking: Heads, fault: str | None, most: float) -> None:
    timeline = talking.timeline()
    rows = found_region(timeline, timeline.pose(0), 0)
    edge = np.quantile(talking.at(0).inverse.points(timeline.pose(0).cloud.world()[rows])[:, 0], 0.7)

    def hidden(frame: int, points: NDArray) -> NDArray:
        return points if not frame else points[talking.at(frame).inverse.points(points)[:, 0] < edge]

    if fault is not None:
        timeline = talking.timeline(strays if fault == "outliers" else hidden)
    reference = MotionReference.of(timeline.pose(0), rows, 0)
    known: dict[int, FrameMotion] = {}
    for _ in stabilise(timeline, reference, LIMITS.shift, known):
        pass
    middle = reference.region.patch.center + reference.origin
    errors = []
    for frame in range(1, len(timeline)):
        motion = known[frame].motion
        assert motion is not None
        errors.append(off(motion, talking.truth(frame, 0), middle))
    turns, shifts = np.linalg.norm(np.reshape(errors, (-1, 2, 3)), axis=2).T
    assert np.median(turns) <= most
    assert np.median(shifts) <= most


def test_regions_of_growing_difficulty_are_within_what_is_told() -> None:
    """A head that only turns, so that each region is rigid; three references with noise of their own."""
    values, told = {name: [] for name in REGIONS}, {name: [] for name in REGIONS}
    for seed, first in enumerate((2, 24, 45)):
        source = ResampledDemo("demo:sway:1", NOISE, seed)
        source.demo.motion = HeadMotion((), source.demo.motion.turns)
        timeline = Timeline(source, source.times(), "mm")
        pose, heads = timeline.pose(first), Heads(source, [])
        surface = moment_surface(pose, np.zeros(3))
        rest = heads.at(first).inverse.points(pose.cloud.world())
        for frame in (10, 33, 56):
            other, right = moment_surface(timeline.pose(frame), np.zeros(3)), heads.truth(frame, first)
            for name, spheres in REGIONS.items():
                inside = [((rest - sphere[:3]) ** 2).sum(axis=1) < sphere[3] ** 2 for sphere in spheres]
                region = RegionSurface.of(surface, np.flatnonzero(np.any(inside, axis=0)))
                assert region is not None
                astray = Rotation.from_rotvec([0.02, -0.02, 0.01]).as_matrix()
                middle = right.points(region.patch.center)
                start = Rigid(rigid_matrix(astray, middle + 1.5 - astray @ middle)).after(right)
                found = register_region(region, other, start)
                assert found is not None
                motion = FrameMotion(found.motion, found.covariance)
                error, spread = off(found.motion, right, region.patch.center), motion.spread(np.eye(3))
                is_close = (np.abs(error) <= 0.5).all()
                assert is_close or motion.state(np.eye(3), LIMITS) is MotionState.WEAK, name
                values[name] += list(np.abs(error))
                told[name] += list(spread)
    shares = {name: np.mean(np.array(values[name]) <= told[name]) for name in REGIONS}
    assert min(shares.values()) >= 0.8, shares
    assert 0.93 <= np.mean(list(shares.values())) <= 0.99, shares

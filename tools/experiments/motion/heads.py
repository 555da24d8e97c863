"""Heads of the demo whose motion is known exactly, sampled anew in each frame with noise."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from experiments.landmarks.known import KeptFrames
from experiments.landmarks.resampled import ResampledDemo
from viewer.analysis.motion.registration import RegionSurface, register_region
from viewer.analysis.motion.stabilise import FrameMotion, MotionReference, moment_surface, stabilise
from viewer.rigid import Rigid, rigid_matrix
from viewer.scan.demo.motion import NECK, HeadMotion
from viewer.scan.points import PointCloud
from viewer.scan.timeline import Timeline

NOISE = 0.1  # mm, standard deviation of points along the normal
BEHIND = -25.0  # mm: what is farther back is left out
ASTRAY = 1.5  # degrees and mm: standard deviation of starts
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
Float = NDArray[np.float64]
# Gives the changed points (M, 3) of a frame
Change = Callable[[int, Float], Float]


@dataclass(frozen=True, eq=False)
class Heads:
    """The frames of a source, and where the head is in each."""

    source: ResampledDemo

    @classmethod
    def of(cls, scan: str, frames: int | None = None, noise: float = NOISE) -> Heads:
        """The first frames of a demo, None: of one period, without the back of the head."""
        return cls(ResampledDemo(scan, noise, 1, BEHIND, frames=frames))

    @classmethod
    def turning(cls, seed: int) -> Heads:
        """A head that only turns, so that all of it is rigid."""
        source = ResampledDemo("demo:sway:1", NOISE, seed)
        source.demo.motion = HeadMotion((), source.demo.motion.turns)
        return cls(source)

    @cached_property
    def points(self) -> list[Float]:
        """Of each frame, (N, 3)."""
        return [self.source.load(frame).world() for frame in range(len(self.source))]

    def timeline(self, change: Change = lambda frame, points: points) -> Timeline:
        """The frames, with changed points."""
        clouds = [
            PointCloud.from_arrays(change(frame, points), origin=np.zeros(3), precise=False)
            for frame, points in enumerate(self.points)
        ]
        times = self.source.times()
        return Timeline(KeptFrames(self.source.name, clouds, times), times, "mm")

    def at(self, frame: int) -> Rigid:
        """The motion from rest to a frame."""
        turn = self.source.demo.motion.turned(float(self.source.times()[frame]))
        return Rigid(rigid_matrix(turn, NECK - turn @ NECK))

    def truth(self, frame: int, reference: int) -> Rigid:
        """The motion from a reference frame to a frame."""
        return self.at(frame).after(self.at(reference).inverse)


def rows_within(spheres: Sequence[tuple[float, float, float, float]], rest: Float) -> NDArray[np.intp]:
    """The rows of points at rest, (N, 3), that are in any of some spheres."""
    inside = [((rest - sphere[:3]) ** 2).sum(axis=1) < sphere[3] ** 2 for sphere in spheres]
    return np.flatnonzero(np.any(inside, axis=0))


def motion_error(found: Rigid, right: Rigid, middle: Float) -> Float:
    """How far a motion is off, (6,): turns in degrees, and the shift of the middle (3,) of a region."""
    from scipy.spatial.transform import Rotation

    turn = Rotation.from_matrix(found.rotation @ right.rotation.T).as_rotvec(degrees=True)
    return np.concatenate([turn, found.points(middle) - right.points(middle)])


def misplaced(right: Rigid, middle: Float, degrees: float, shift: float, seed: Sequence[int]) -> Rigid:
    """A motion that is off by chance, with standard deviations of the turn and of the shift of the middle."""
    from scipy.spatial.transform import Rotation

    chance = np.random.default_rng(list(seed))
    turn = Rotation.from_rotvec(chance.normal(0, degrees, 3), degrees=True).as_matrix()
    there = right.points(middle)
    return Rigid(rigid_matrix(turn, there + chance.normal(0, shift, 3) - turn @ there)).after(right)


def strays(frame: int, points: Float) -> Float:
    """A change that puts 5 % of the points up to 17 mm off."""
    chance = np.random.default_rng(frame)
    astray = chance.random(len(points)) < 0.05
    return points + astray[:, None] * chance.uniform(-10, 10, points.shape)


def without_side(heads: Heads, rows: NDArray[np.integer], share: float) -> Change:
    """A change that leaves a share of a region, and all beside it, out of all frames but the first. rows: of
    the region in the first frame."""
    edge = np.quantile(heads.at(0).inverse.points(heads.points[0][rows])[:, 0], 1 - share)

    def change(frame: int, points: Float) -> Float:
        return points if not frame else points[heads.at(frame).inverse.points(points)[:, 0] < edge]

    return change


class RegionMotion(NamedTuple):
    """The motion of one of the `REGIONS`, with its error, see `motion_error`."""

    region: str
    motion: FrameMotion
    error: Float


def region_motions(heads: Heads, first: int, frames: Iterable[int], seed: int) -> Iterator[RegionMotion]:
    """Register each of the `REGIONS` of a head that only turns, from a first frame to others.

    Starts are off by chance, by `ASTRAY`.
    """
    cloud = heads.source.load(first)
    surface, rest = moment_surface(cloud, np.zeros(3)), heads.at(first).inverse.points(cloud.world())
    for frame in frames:
        other, right = moment_surface(heads.source.load(frame), np.zeros(3)), heads.truth(frame, first)
        for name, spheres in REGIONS.items():
            region = RegionSurface.of(surface, rows_within(spheres, rest))
            assert region is not None
            middle = region.patch.center
            found = register_region(region, other, misplaced(right, middle, ASTRAY, ASTRAY, (frame, seed)))
            assert found is not None
            motion = FrameMotion(found.motion, found.covariance)
            yield RegionMotion(name, motion, motion_error(found.motion, right, middle))


def stabilised_errors(
    heads: Heads, timeline: Timeline, reference: MotionReference, within: float
) -> list[Float]:
    """The errors, see `motion_error`, of all frames but the first, which is the reference, and but gaps.

    within: see `stabilise`.
    """
    known: dict[int, FrameMotion] = {}
    for _ in stabilise(timeline, reference, within, known):
        pass
    motions = {frame: found.motion for frame, found in known.items() if frame}
    return [
        motion_error(motion, heads.truth(frame, 0), reference.middle)
        for frame, motion in motions.items()
        if motion is not None
    ]

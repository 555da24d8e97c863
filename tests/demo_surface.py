"""The demo's subject as an exact surface: the inverse of its motion, and its implicit function."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from viewer.bench.truth.shapes import AnalyticSurface, first_zero
from viewer.scan.demo import head
from viewer.scan.demo.dual import coordinates
from viewer.scan.demo.motion import (
    NECK,
    TALK,
    HeadMotion,
    Twist,
    column,
    mirror_factors,
    move,
    normalized,
    of_side,
    rotate,
    turn,
)
from viewer.scan.demo.shapes import Scalar

BISECTIONS = 52  # halvings that bring an angle down to the precision of float64


def undone(twist: Twist, points: NDArray, amount: Scalar) -> NDArray:
    """Points that a twist moved to (3, N), (3, N), by bisection along their circles."""
    center = column(twist.center, points)
    arm = points - center
    low, high = np.zeros(points.shape[1]), np.ones(points.shape[1])
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        origin = rotate(twist.axis, arm, -amount * middle) + center
        below = twist.weight(*origin) > middle
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    return rotate(twist.axis, arm, -0.5 * amount * (low + high)) + center


def rest_of(points: NDArray[np.float64], time: float, motion: HeadMotion = TALK) -> NDArray[np.float64]:
    """Places at rest of the skin at points (3, N) of a moment, (3, N): the inverse of `move`."""
    points = turned_back(points, time, motion)
    mirror = mirror_factors(points)
    points = points * mirror
    for twist, amounts in reversed(motion.amounts(time)):
        points = undone(twist, points, of_side(amounts, mirror))
    return points * mirror


def surface_value(points: ArrayLike, time: float, motion: HeadMotion = TALK) -> NDArray[np.float64]:
    """The exact subject at a time: negative inside, 0 on the surface, about mm near it.

    points: (N, 3), mm. Gives (N,) float64. See `surface_normal`.
    """
    p = np.asarray(points, np.float64).T
    return np.minimum(head.skin(*rest_of(p, time, motion)), head.eyes(*turned_back(p, time, motion)))


def surface_normal(points: ArrayLike, time: float, motion: HeadMotion = TALK) -> NDArray[np.float64]:
    """The exact unit normals (N, 3) of the subject at points (N, 3) of its surface at a time."""
    p = np.asarray(points, np.float64).T
    rest, back = rest_of(p, time, motion), turned_back(p, time, motion)
    skin, eyes = head.skin(*coordinates(rest)), head.eyes(*coordinates(back))
    _, of_skin, _ = move(rest, normalized(skin.gradient), time, motion)
    _, of_eyes = turn(back, normalized(eyes.gradient), time, motion)
    return np.where(skin.value < eyes.value, of_skin, of_eyes).T


def turned_back(points: NDArray[np.float64], time: float, motion: HeadMotion) -> NDArray[np.float64]:
    """Points (3, N) of a moment, where they were before the head turned."""
    if not motion.turns:
        return points
    return motion.turned(time).T @ (points - NECK[:, None]) + NECK[:, None]


@dataclass(frozen=True, kw_only=True)
class DemoHead(AnalyticSurface):
    """The subject of the demo scan at a time in seconds, in mm. About a millisecond a pixel."""

    time: float = 0.0

    @property
    def reach(self) -> float:
        return 170.0

    def distance(self, starts: NDArray[np.float64], steps: NDArray[np.float64]) -> NDArray[np.float64]:
        # Its value is a distance only roughly, and grows faster than one where the lips part.
        return first_zero(lambda points: 0.5 * surface_value(points, self.time), starts, steps, self.reach)

    def normal(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        return surface_normal(points, self.time) if len(points) else points

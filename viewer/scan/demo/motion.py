"""How the demo subject moves: rotations that fade in space, and the head turns, on a schedule that repeats.

The head at rest is an implicit surface; a pose is that surface bent by twists, one after the other, and then
turned. Both have an inverse, so the moved head is an implicit surface as well. `variants` has the
schedules besides the usual one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from . import head
from .dual import coordinates
from .shapes import Scalar, Triple, bell, length, ramp

PERIOD = 2.56  # seconds
_FAINT = 1e-8  # radians or weights that move a point by less than float32 can tell
_BATCH = 1 << 13  # points moved at a time, so that intermediate results stay in the cache
NECK = np.array((0.0, -110.0, -30.0))  # mm, about which the head turns


@dataclass(frozen=True)
class Twist:
    """A rotation about an axis by an angle that fades in space: p -> c + R(amount * weight(p)) (p - c).

    center: a point of the axis. axis: its unit direction. weight: 0..1 over the position. A point
    only slides along its own circle, and where `amount` is small enough for points of a circle
    not to pass each other, the twist is one to one.
    It works on one side of the face, x >= 0; the other side is its mirror image.
    """

    center: Triple
    axis: Triple
    weight: Callable[[Scalar, Scalar, Scalar], Scalar]

    def apply(self, points: NDArray, normals: NDArray, amount: Scalar) -> tuple[NDArray, NDArray, NDArray]:
        """Moved points (3, N), unit normals (3, N), and the growth of the surface's area (N,).

        amount: radians, for all points or (N,).
        """
        weight = self.weight(*coordinates(points))
        arm = points - column(self.center, points)
        tangent = _cross(self.axis, arm)
        # By the matrix determinant lemma and Sherman and Morrison: the Jacobian is a rotation
        # times I + tangent slope^T.
        slope = amount * weight.gradient
        growth = 1.0 + _dot(tangent, slope)
        bent = growth * normals - slope * _dot(tangent, normals)
        stretch = np.sqrt(_dot(bent, bent))
        angle = amount * weight.value
        moved = rotate(self.axis, arm, angle) + column(self.center, points)
        return moved, rotate(self.axis, bent / stretch, angle), stretch


def _eyelid(x: Scalar, y: Scalar, z: Scalar) -> Scalar:
    """The upper lid, up to the crease; the opening of the eye closes like a curtain."""
    upper, lower = head.lid_margins(x)
    height = y - head.EYE[1]
    # What lies farther out than the lid turns as the lid does, so that nothing passes anything.
    radius = length(height, z - head.EYE[2])
    level = height * 14.5 / (0.5 * (radius + 14.0 + np.sqrt(np.square(radius - 14.0) + 1.0)))
    over = 0.5 * (level - lower + np.sqrt(np.square(level - lower) + 0.04))
    past = 0.5 * (level - upper + np.sqrt(np.square(level - upper) + 0.04))
    return (over - past) / 10.5 * (1.0 - ramp(height, 6.0, 20.0)) * ramp(z, 55.0, 64.0)


def _brow(x: Scalar, y: Scalar, z: Scalar) -> Scalar:
    """The brows and the forehead above them."""
    return bell(np.square(x), 700.0, 1300.0) * bell(y, 35.0, 12.0) * ramp(z, 0.0, 60.0)


def _jaw(x: Scalar, y: Scalar, z: Scalar) -> Scalar:
    """The lower jaw: parted sharply from the upper lip and teeth, gradually from the cheeks."""
    below = head.mouth_sheet(x, z) - y
    parted = np.exp(-np.square(np.square(x / 19.0))) * ramp(z, 40.0, 62.0)
    sharp, gradual = 0.5 + 0.5 * np.tanh(below / 0.12), ramp(below, -38.0, 46.0)
    lower = gradual + parted * (sharp - gradual)
    return lower * ramp(z, -10.0, 62.0) * ramp(y, -147.0, -88.0)


def _mouth_corner(x: Scalar, y: Scalar, z: Scalar) -> Scalar:
    """The corner of the mouth and the cheek beside and above it."""
    square = np.square(x)
    near = bell(x, 28.0, 15.0) * bell(y, -54.0, 16.0) * bell(z, 80.0, 26.0)
    return 1.1 * square / (square + 100.0) * near * ramp(z, 0.0, 40.0)


def _unit(*direction: float) -> Triple:
    x, y, z = (float(v) for v in np.asarray(direction) / np.linalg.norm(direction))
    return x, y, z


EYELID = Twist(head.EYE, (1.0, 0.0, 0.0), _eyelid)
BROW = Twist((0.0, 0.0, -10.0), (-1.0, 0.0, 0.0), _brow)
JAW = Twist((0.0, -35.0, -15.0), (1.0, 0.0, 0.0), _jaw)
MOUTH_CORNER = Twist((0.0, -60.0, 18.0), _unit(-0.55, 0.78, 0.22), _mouth_corner)


@dataclass(frozen=True)
class Peak:
    """A smooth peak, once a period (von Mises). height: radians; center: in periods; sharpness: one over its
    variance, where a period is 2 pi long."""

    height: float
    center: float
    sharpness: float

    def at(self, time: float) -> float:
        """Give its value at a time in seconds."""
        angle = 2.0 * np.pi * (time / PERIOD - self.center)
        return self.height * float(np.exp(self.sharpness * (np.cos(angle) - 1.0)))


@dataclass(frozen=True)
class Bend:
    """A twist as it comes and goes. share: how much of it the left and the right side of the face have; only
    where the twist leaves the middle alone may they differ."""

    twist: Twist
    peaks: tuple[Peak, ...]
    share: tuple[float, float] = (1.0, 1.0)


@dataclass(frozen=True)
class Turn:
    """A turn of the whole head about an axis through the neck. axis: its unit direction."""

    axis: Triple
    peaks: tuple[Peak, ...]


@dataclass(frozen=True)
class HeadMotion:
    """A schedule: the bends in the order they are applied, and then the turns."""

    bends: tuple[Bend, ...]
    turns: tuple[Turn, ...] = ()

    def amounts(self, time: float) -> list[tuple[Twist, tuple[float, float]]]:
        """The twists at work at a time in seconds, with the angles of left and right side, radians."""
        angles = [(bend, _sum(bend.peaks, time)) for bend in self.bends]
        return [
            (bend.twist, (angle * bend.share[0], angle * bend.share[1]))
            for bend, angle in angles
            if abs(angle) > _FAINT
        ]

    def turned(self, time: float) -> NDArray[np.float64]:
        """The rotation of the head about the neck at a time in seconds, (3, 3)."""
        rotation = np.eye(3)
        for turn in self.turns:
            rotation = rotate(turn.axis, rotation, np.array(_sum(turn.peaks, time)))
        return rotation


TALK = HeadMotion(
    (
        Bend(EYELID, (Peak(0.72, 0.56, 30.0),)),
        Bend(BROW, (Peak(0.085, 0.30, 3.0), Peak(-0.02, 0.76, 4.0))),
        Bend(JAW, (Peak(0.27, 0.31, 4.0), Peak(0.05, 0.75, 4.0))),
        Bend(MOUTH_CORNER, (Peak(0.17, 0.75, 3.0), Peak(-0.05, 0.31, 4.0))),
    )
)


def _sum(peaks: tuple[Peak, ...], time: float) -> float:
    return sum(peak.at(time) for peak in peaks)


def move(
    points: NDArray, normals: NDArray, time: float, motion: HeadMotion = TALK
) -> tuple[NDArray, NDArray, NDArray]:
    """Points and normals of the skin at rest, moved to a time in seconds.

    points, normals: (3, N) float32 or float64. Gives both in the same shape and type, normals of
    unit length, and the growth of the surface's area at each point, (N,). Fastest where points
    that are near each other follow each other: batches that nothing moves are passed over.
    """
    twists = motion.amounts(time)
    moved, turned, growth = np.empty_like(points), np.empty_like(normals), np.empty_like(points[0])
    for start in range(0, points.shape[1], _BATCH):
        batch = slice(start, start + _BATCH)
        moved[:, batch], turned[:, batch], growth[batch] = _twisted(
            points[:, batch], normals[:, batch], twists
        )
    return *turn(moved, turned, time, motion), growth


def turn(points: NDArray, normals: NDArray, time: float, motion: HeadMotion) -> tuple[NDArray, NDArray]:
    """Points and normals, (3, N), turned as the head is at a time in seconds: all that the eyeballs do."""
    if not motion.turns:
        return points, normals
    rotation, neck = motion.turned(time).astype(points.dtype), NECK.astype(points.dtype)[:, None]
    return rotation @ (points - neck) + neck, rotation @ normals


def _twisted(
    points: NDArray, normals: NDArray, twists: list[tuple[Twist, tuple[float, float]]]
) -> tuple[NDArray, NDArray, NDArray]:
    mirror = mirror_factors(points)
    points, normals, growth = points * mirror, normals * mirror, np.ones_like(points[0])
    for twist, amounts in twists:
        if (twist.weight(*points) > _FAINT).any():
            points, normals, stretch = twist.apply(points, normals, of_side(amounts, mirror))
            growth *= stretch
    return points * mirror, normals * mirror, growth


def of_side(amounts: tuple[float, float], mirror: NDArray) -> Scalar:
    """Amounts that left and right side have, for all points or, where they differ, (N,) by their side."""
    left, right = amounts
    return left if left == right else np.where(mirror[0] > 0, left, right).astype(mirror.dtype)


def normalized(vectors: NDArray) -> NDArray:
    """Vectors (3, N) of length 1."""
    return vectors / np.sqrt(_dot(vectors, vectors))


def mirror_factors(points: NDArray) -> NDArray:
    """Factors (3, N) that bring points to the side x >= 0, and back."""
    factors = np.ones_like(points)
    factors[0] = np.copysign(1.0, points[0])
    return factors


def _dot(a: NDArray, b: NDArray) -> NDArray:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(axis: Triple, v: NDArray) -> NDArray:
    k = axis
    return np.stack([k[1] * v[2] - k[2] * v[1], k[2] * v[0] - k[0] * v[2], k[0] * v[1] - k[1] * v[0]])


def rotate(axis: Triple, v: NDArray, angle: NDArray) -> NDArray:
    """Vectors (3, N) turned about a unit axis by angles (N,) (Rodrigues)."""
    along = (axis[0] * v[0] + axis[1] * v[1] + axis[2] * v[2]) * (1.0 - np.cos(angle))
    return v * np.cos(angle) + _cross(axis, v) * np.sin(angle) + column(axis, v) * along


def column(values: Triple, like: NDArray) -> NDArray:
    """Three numbers as a column (3, 1) of the type of `like`."""
    return np.array(values, like.dtype)[:, None]

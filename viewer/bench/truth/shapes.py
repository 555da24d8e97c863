"""Analytic scenes in float64: spheres, planes, boxes and tori."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...bounds import Bounds
from ...geometry import Vector
from ...mesh.scene import PLAIN, Hits, Rays, distance_to_ball, linear

# How a ray is followed through an implicit surface, in radii of the ball around it. Where a ray is inside
# for less than the finest step it is taken to pass by: that moves a silhouette by 1e-7 radii at most.
_FINEST, _COARSEST = 1e-3, 0.25
_EXACT = 1e-13
_ROOT_STEPS = 100


@dataclass(frozen=True, kw_only=True)
class AnalyticSurface(ABC):
    """One surface. center: (3,), scan units; color: '#rrggbb'. Its methods work relative to the centre."""

    center: Vector = (0.0, 0.0, 0.0)
    color: str = PLAIN

    @property
    @abstractmethod
    def reach(self) -> float:
        """The radius of a ball about the centre that holds all of it."""

    @abstractmethod
    def distance(self, starts: Rays, steps: Rays) -> NDArray[np.float64]:
        """Distances at which rays (N, 3) first meet it, (N,), in steps; +inf: nowhere."""

    @abstractmethod
    def normal(self, points: Rays) -> Rays:
        """The unit normals (N, 3) at points (N, 3) of the surface."""


@dataclass(frozen=True, eq=False)
class AnalyticScene:
    """A scene of shapes; the face of a hit is the shape's number in the list."""

    shapes: tuple[AnalyticSurface, ...]

    @property
    def origin(self) -> NDArray[np.float64]:
        """(3,), the middle of the bounds."""
        return self.bounds.center

    @cached_property
    def bounds(self) -> Bounds:
        """The box around the balls that hold the shapes."""
        centers = np.array([shape.center for shape in self.shapes])
        reach = np.array([[shape.reach] for shape in self.shapes])
        return Bounds((centers - reach).min(axis=0), (centers + reach).max(axis=0))

    def cast(self, starts: Rays, steps: Rays) -> Hits:
        """Cast rays as `Scene.cast` does."""
        hits = Hits.none(len(starts))
        for number, shape in enumerate(self.shapes):
            local = starts - (np.array(shape.center) - self.origin)
            distance = shape.distance(local, steps)
            nearer = distance < hits.distance
            hits.distance[nearer] = distance[nearer]
            hits.normal[nearer] = shape.normal(local[nearer] + distance[nearer, None] * steps[nearer])
            hits.color[nearer] = linear(shape.color)
            hits.face[nearer] = number
        return hits


@dataclass(frozen=True, kw_only=True)
class Sphere(AnalyticSurface):
    """A sphere; its normals point outwards."""

    radius: float = 1.0

    @property
    def reach(self) -> float:
        """See `AnalyticSurface`."""
        return self.radius

    def distance(self, starts: Rays, steps: Rays) -> NDArray[np.float64]:
        """See `AnalyticSurface`."""
        a, b = _dot(steps, steps), _dot(starts, steps)
        nearest = starts - (b / a)[:, None] * steps
        root = (self.radius**2 - _dot(nearest, nearest)) / a
        half = np.sqrt(np.maximum(root, 0))
        return np.where(root >= 0, _first(-b / a - half, -b / a + half), np.inf)

    def normal(self, points: Rays) -> Rays:
        """See `AnalyticSurface`."""
        return points / self.radius


@dataclass(frozen=True, kw_only=True)
class Plane(AnalyticSurface):
    """A rectangle. right, up: (3,), from its centre to the middles of two sides, at right angles.

    Its normal is right x up.
    """

    right: Vector = (1.0, 0.0, 0.0)
    up: Vector = (0.0, 1.0, 0.0)

    @property
    def reach(self) -> float:
        """See `AnalyticSurface`."""
        return float(np.hypot(np.linalg.norm(self.right), np.linalg.norm(self.up)))

    def distance(self, starts: Rays, steps: Rays) -> NDArray[np.float64]:
        """See `AnalyticSurface`."""
        normal = np.cross(self.right, self.up)
        speed = steps @ normal
        crossing = speed != 0
        t = np.full(len(starts), np.inf)
        t[crossing] = -(starts[crossing] @ normal) / speed[crossing]
        hit = crossing & (t >= 0)
        points = starts[hit] + t[hit, None] * steps[hit]
        for side in (np.array(self.right), np.array(self.up)):
            inside = np.abs(points @ side) <= side @ side
            hit[hit], points = inside, points[inside]
        return np.where(hit, t, np.inf)

    def normal(self, points: Rays) -> Rays:
        """See `AnalyticSurface`."""
        normal = np.cross(self.right, self.up)
        return np.broadcast_to(normal / np.linalg.norm(normal), points.shape)


@dataclass(frozen=True, kw_only=True)
class Cuboid(AnalyticSurface):
    """A box along the axes; half: (3,), half its edges. Its normals point outwards."""

    half: Vector = (1.0, 1.0, 1.0)

    @property
    def reach(self) -> float:
        """See `AnalyticSurface`."""
        return float(np.linalg.norm(self.half))

    def distance(self, starts: Rays, steps: Rays) -> NDArray[np.float64]:
        """Distances along rays, by slabs (Kay and Kajiya 1986)."""
        with np.errstate(over="ignore"):
            inverse = 1 / np.where(steps == 0, 1e-300, steps)
            low, high = (-np.array(self.half) - starts) * inverse, (np.array(self.half) - starts) * inverse
        enter, leave = np.minimum(low, high).max(axis=1), np.maximum(low, high).min(axis=1)
        return np.where(enter <= leave, _first(enter, leave), np.inf)

    def normal(self, points: Rays) -> Rays:
        """See `AnalyticSurface`."""
        relative = points / np.array(self.half)
        axis = np.abs(relative).argmax(axis=1)
        rows = np.arange(len(points))
        normals = np.zeros_like(points)
        normals[rows, axis] = np.sign(relative[rows, axis])
        return normals


@dataclass(frozen=True, kw_only=True)
class Torus(AnalyticSurface):
    """A torus about a unit axis; ring, tube: their radii."""

    ring: float = 1.0
    tube: float = 0.4
    axis: Vector = (0.0, 1.0, 0.0)

    @property
    def reach(self) -> float:
        """See `AnalyticSurface`."""
        return self.ring + self.tube

    def value(self, points: Rays) -> NDArray[np.float64]:
        """The signed distance (N,) of points (N, 3)."""
        _, out, along = self._parts(points)
        return np.hypot(out - self.ring, along) - self.tube

    def distance(self, starts: Rays, steps: Rays) -> NDArray[np.float64]:
        """See `AnalyticSurface`."""
        return first_zero(self.value, starts, steps, self.reach)

    def normal(self, points: Rays) -> Rays:
        """See `AnalyticSurface`."""
        flat, out, along = self._parts(points)
        normals = flat * ((out - self.ring) / out)[:, None] + along[:, None] * np.array(self.axis)
        return normals / np.linalg.norm(normals, axis=1, keepdims=True)

    def _parts(self, points: Rays) -> tuple[Rays, NDArray[np.float64], NDArray[np.float64]]:
        along = points @ np.array(self.axis)
        flat = points - along[:, None] * np.array(self.axis)
        return flat, np.linalg.norm(flat, axis=1), along


def first_zero(
    value: Callable[[Rays], NDArray[np.float64]],
    starts: Rays,
    steps: Rays,
    reach: float,
) -> NDArray[np.float64]:
    """Distances to an implicit surface in the ball of radius `reach` about zero, along rays, (N,), in steps.

    Sphere tracing (Hart 1996) that never steps less than a thousandth of `reach`, so that it ends by
    crossing, and then closes in on the zero. A step of the value must be safe.
    """
    length = np.linalg.norm(steps, axis=1)
    found = np.full(len(starts), np.inf)
    outside = 1.001 * reach  # where the surface touches the ball it is still ahead
    t = distance_to_ball(starts, steps, outside)
    at = starts + t[:, None] * steps
    rays = np.flatnonzero(_dot(at, at) <= (1.001 * outside) ** 2)
    here = value(at[rays])
    while len(rays):
        step = np.clip(np.abs(here), _FINEST * reach, _COARSEST * reach) / length[rays]
        ahead = t[rays] + step
        points = starts[rays] + ahead[:, None] * steps[rays]
        there = value(points)
        crossed = (there < 0) != (here < 0)
        if crossed.any():
            who = rays[crossed]
            found[who] = _zero_between(
                value, starts[who], steps[who], (t[who], here[crossed]), (ahead[crossed], there[crossed])
            )
        leaving = (_dot(points, points) > outside**2) & (_dot(points, steps[rays]) > 0)
        on = ~(crossed | leaving)
        t[rays] = ahead
        rays, here = rays[on], there[on]
    return found


def _zero_between(
    value: Callable[[Rays], NDArray[np.float64]],
    starts: Rays,
    steps: Rays,
    low: tuple[NDArray[np.float64], NDArray[np.float64]],
    high: tuple[NDArray[np.float64], NDArray[np.float64]],
) -> NDArray[np.float64]:
    """The zeros between two ends (t, value) of other sign, (N,): regula falsi, Illinois' rule."""
    (a, fa), (b, fb) = low, high
    for _ in range(_ROOT_STEPS):
        c = b - fb * (b - a) / (fb - fa)
        fc = value(starts + c[:, None] * steps)
        if (np.abs(c - b) <= _EXACT * np.abs(c)).all():
            break
        other_side = (fc < 0) != (fb < 0)
        a, fa = np.where(other_side, b, a), np.where(other_side, fb, fa / 2)
        b, fb = c, fc
    return c


def _first(near: NDArray[np.float64], far: NDArray[np.float64]) -> NDArray[np.float64]:
    """The lesser of two distances that is not behind the start; +inf where both are."""
    return np.where(near >= 0, near, np.where(far >= 0, far, np.inf))


def _dot(a: Rays, b: Rays) -> NDArray[np.float64]:
    return (a * b).sum(axis=1)

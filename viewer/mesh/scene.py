"""What can be looked at exactly: a scene tells where rays meet it first."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..bounds import Bounds
from ..look import Look, rgba
from ..scan.points import NOTHING
from ..srgb import linear_from_bytes

PLAIN = Look().plain  # what a scan without colours is drawn in
Rays = NDArray[np.float64]  # (N, 3)


@dataclass(frozen=True, eq=False)
class Hits:
    """Hits of N rays: where each meets a scene first.

    distance: (N,) float64, in lengths of the ray's step; +inf: nowhere. normal: (N, 3) float64, unit
    length, world space. color: (N, 3) float64, linear. face: (N,) uint32, 0xFFFFFFFF: none. What is not
    hit has zeros for normal and colour.
    """

    distance: NDArray[np.float64]
    normal: NDArray[np.float64]
    color: NDArray[np.float64]
    face: NDArray[np.uint32]

    @classmethod
    def none(cls, count: int) -> Hits:
        """Rays that meet nothing."""
        face = np.full(count, NOTHING, np.uint32)
        return cls(np.full(count, np.inf), np.zeros((count, 3)), np.zeros((count, 3)), face)


class Scene(Protocol):
    """A mesh or analytic shapes."""

    @property
    def origin(self) -> NDArray[np.float64]:
        """(3,), what rays are relative to, so that a body far from zero loses no digits."""

    @property
    def bounds(self) -> Bounds:
        """A box around all of it, absolute."""

    def cast(self, starts: Rays, steps: Rays) -> Hits:
        """The first hits of rays start + t * step, t >= 0. starts: (N, 3), relative to the origin."""


def distance_to_ball(starts: Rays, steps: Rays, radius: float) -> NDArray[np.float64]:
    """Distances at which rays enter a ball about zero, (N,), in steps; 0 from inside it.

    A ray that misses gets its point nearest to zero. Rays that are cast from there keep their digits
    however far away the eye is.
    """
    square = (steps * steps).sum(axis=1)
    nearest = -(starts * steps).sum(axis=1) / square
    passing = starts + nearest[:, None] * steps
    half_chord = np.sqrt(np.maximum(radius**2 - (passing * passing).sum(axis=1), 0) / square)
    return np.maximum(nearest - half_chord, 0)


def linear(color: str) -> NDArray[np.float64]:
    """The linear colour (3,) of '#rrggbb'."""
    return linear_from_bytes(np.array(rgba(color)[:3], np.uint8))

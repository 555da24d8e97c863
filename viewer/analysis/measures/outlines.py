"""Closed outlines in a plane, and what lies over them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...mesh.smoothing import Points
from .planes import THROUGH, plane_of

_GRID = 48

Outline = NDArray[np.float64]  # (P, 2)


@dataclass(frozen=True, eq=False)
class Prism:
    """The prism over a polygon, without end on both sides of its plane.

    center, normal: of the plane, (3,). axes: (2, 3), in it. corners: (K, 2) along these.
    """

    center: NDArray[np.float64]
    normal: NDArray[np.float64]
    axes: NDArray[np.float64]
    corners: Outline

    @classmethod
    def over(cls, positions: Points) -> Prism | None:
        """The prism over positions (K, 3), across the plane nearest to them; None where they tell none."""
        center, normal = plane_of(positions, THROUGH)
        if not np.isfinite(normal).all():
            return None
        axes = np.linalg.svd(normal[None])[2][1:]
        return cls(center, normal, axes, (positions - center) @ axes.T)

    def flat(self, points: Points) -> NDArray[np.float64]:
        """Places of points (..., 3) in the plane, (..., 2)."""
        return (points - self.center) @ self.axes.T

    def with_corner(self, number: int, corner: Outline) -> Prism:
        """The prism over the same plane with another position of one corner, (2,)."""
        corners = self.corners.copy()
        corners[number] = corner
        return replace(self, corners=corners)

    def has(self, flat: Outline) -> NDArray[np.bool_]:
        """Whether positions in the plane, (..., 2), are in the polygon, (...)."""
        return is_within(flat.reshape(-1, 2), self.corners).reshape(flat.shape[:-1])

    def within(self) -> Outline:
        """Places of a grid of 48 x 48 over the polygon that are in it, (N, 2)."""
        low, high = self.corners.min(axis=0), self.corners.max(axis=0)
        steps = (np.stack(np.meshgrid(*2 * [np.arange(_GRID)]), axis=-1).reshape(-1, 2) + 0.5) / _GRID
        positions = low + steps * (high - low)
        return positions[is_within(positions, self.corners)]

    def around(self) -> Outline:
        """Places along the sides of the polygon, 48 on each, (48 K, 2)."""
        shares = (np.arange(_GRID)[:, None] + 0.5) / _GRID
        sides = zip(self.corners, np.roll(self.corners, -1, axis=0), strict=True)
        return np.concatenate([start + shares * (end - start) for start, end in sides])

    def beyond(self, points: Points) -> NDArray[np.float64]:
        """How far points (N, 3) are outside the prism, negative within, (N,)."""
        flat = self.flat(points)
        away = np.full(len(flat), np.inf)
        for start, end in zip(self.corners, np.roll(self.corners, -1, axis=0), strict=True):
            side = end - start
            share = np.clip((flat - start) @ side / max(side @ side, np.finfo(float).tiny), 0, 1)
            away = np.minimum(away, np.hypot(*(flat - start - share[:, None] * side).T))
        return np.where(is_within(flat, self.corners), -away, away)


def is_within(positions: Outline, outline: Outline) -> NDArray[np.bool_]:
    """Whether positions (N, 2) lie within a closed outline (P, 2): a ray to the right crosses it oddly
    often."""
    inside = np.zeros(len(positions), bool)
    near = np.flatnonzero(
        ((positions >= outline.min(axis=0)) & (positions <= outline.max(axis=0))).all(axis=1)
    )
    x, y = positions[near].T
    for start, end in zip(outline, np.roll(outline, -1, axis=0), strict=True):
        rises = (start[1] > y) != (end[1] > y)
        if rises.any():
            at = start[0] + (y[rises] - start[1]) / (end[1] - start[1]) * (end[0] - start[0])
            inside[near[rises][x[rises] < at]] ^= True
    return inside


def area_of(outline: Outline) -> float:
    """The area of a closed outline (P, 2) that does not cross itself."""
    x, y = (outline - outline.mean(axis=0)).T
    return abs(float((x * np.roll(y, -1) - y * np.roll(x, -1)).sum())) / 2


def crosses_itself(outline: Outline) -> bool:
    """Whether two sides of a closed outline (P, 2) cross each other, away from their ends."""
    start, end = outline, np.roll(outline, -1, axis=0)

    def sides(positions: Outline) -> NDArray[np.float64]:
        """On which side of each side positions are, (P, P): the sign."""
        along, offset = (end - start)[:, None], positions[None] - start[:, None]
        return np.sign(along[..., 0] * offset[..., 1] - along[..., 1] * offset[..., 0])

    parted = sides(start) * sides(end) < 0
    return bool((parted & parted.T).any())

"""Closed outlines in a plane."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Outline = NDArray[np.float64]  # (P, 2)


def is_within(places: Outline, outline: Outline) -> NDArray[np.bool_]:
    """Whether places (N, 2) lie within a closed outline (P, 2): a ray to the right crosses it oddly often."""
    inside = np.zeros(len(places), bool)
    near = np.flatnonzero(((places >= outline.min(axis=0)) & (places <= outline.max(axis=0))).all(axis=1))
    x, y = places[near].T
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

    def sides(places: Outline) -> NDArray[np.float64]:
        """On which side of each side places are, (P, P): the sign."""
        along, offset = (end - start)[:, None], places[None] - start[:, None]
        return np.sign(along[..., 0] * offset[..., 1] - along[..., 1] * offset[..., 0])

    parted = sides(start) * sides(end) < 0
    return bool((parted & parted.T).any())

"""A trunk with two arms that swing past each other, sampled at the same or at other places in each frame."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

SPACING = 1.0
LONG, THICK, APART = 40.0, 3.0, 9.0  # an arm's length and radius; from the middle
SWING = 0.5  # radians that each arm swings to either side


def angle(frame: int, side: int) -> float:
    """How far an arm, -1 or 1, is swung in a frame, radians."""
    return side * SWING * np.cos(0.6 * frame)


def arms(frame: int, points: int | None = None) -> NDArray[np.float64]:
    """Points of the trunk, along y, and of both arms, that hang from it and swing in x and z, (P, 3).

    points: which ones, by number; None: others in each frame.
    """
    chance = np.random.default_rng(frame if points is None else points)
    parts = [_tube(30.0, 6.0, chance)[:, [0, 2, 1]] - (0, -15, 0)]
    parts += [on_arm(frame, side, _tube(LONG, THICK, chance)) for side in (-1, 1)]
    return np.concatenate(parts)


def on_arm(frame: int, side: int, places: NDArray[np.float64]) -> NDArray[np.float64]:
    """Places (N, 3) of an arm as it hangs, down along z, where they are in a frame."""
    s, c = np.sin(angle(frame, side)), np.cos(angle(frame, side))
    turn = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    return places @ turn.T + (0, side * APART, 0)


def _tube(long: float, radius: float, chance: np.random.Generator) -> NDArray[np.float64]:
    """Points of a tube down along z, with a flat end, one for each spacing squared."""
    side, end = (int(area / SPACING**2) for area in (2 * np.pi * radius * long, np.pi * radius**2))
    around = chance.uniform(0, 2 * np.pi, side + end)
    out = np.append(np.full(side, radius), radius * np.sqrt(chance.uniform(0, 1, end)))
    along = np.append(chance.uniform(0, long, side), np.full(end, long))
    return np.stack([out * np.cos(around), out * np.sin(around), -along], axis=1)

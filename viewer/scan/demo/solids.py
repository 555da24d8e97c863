"""Solids as functions that are negative inside, and points brought to their surfaces."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from .dual import coordinates
from .motion import normalized
from .shapes import Scalar

Solid: TypeAlias = Callable[[Scalar, Scalar, Scalar], Scalar]
Rows: TypeAlias = NDArray[np.float64]  # (3, N) or (N,)

_BATCH = 1 << 15  # points evaluated at a time, so that intermediate results stay in the cache


def projected(
    solid: Solid, points: NDArray[np.float64], steps: int = 6, longest: float = 0.5
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Points (3, N) brought to the surface by Newton steps, and the normals there (3, N).

    longest: a step along each axis, mm.
    """
    parts = [points[:, i : i + _BATCH] for i in range(0, points.shape[1], _BATCH)]
    normals = []
    for index, part in enumerate(parts):
        for _ in range(steps):
            solid_here = solid(*coordinates(part))
            step = solid_here.gradient * (solid_here.value / np.square(solid_here.gradient).sum(axis=0))
            part = part - np.clip(step, -longest, longest)
        parts[index] = part
        normals.append(normalized(solid(*coordinates(part)).gradient))
    return np.concatenate(parts, axis=1), np.concatenate(normals, axis=1)

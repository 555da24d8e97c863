"""The points of the demo scan at rest, sampled beforehand by tools/demo_head.py and shipped as one file."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...resources import resource_path


@dataclass(frozen=True, eq=False)
class RestPoints:
    """Points on the head at rest, mm.

    positions: (3, N) float32. normals: (3, N) float32, unit length. colors: (N, 3) uint8, sRGB.
    radii: (N,) float32, the local spacing. skin: the first so many points are of skin,
    hair and mouth, the others of the eyeballs.
    """

    positions: NDArray[np.float32]
    normals: NDArray[np.float32]
    colors: NDArray[np.uint8]
    radii: NDArray[np.float32]
    skin: int


def asset_path() -> Path:
    """Path of the points that are shipped."""
    return resource_path("assets", "demo_head.npz")


@functools.cache
def rest_points() -> RestPoints:
    """The shipped points, read once."""
    with np.load(asset_path(), allow_pickle=False) as arrays:
        normals = arrays["normals"].astype(np.float32)
        return RestPoints(
            positions=arrays["positions"],
            normals=normals / np.sqrt(np.square(normals).sum(axis=0)),
            colors=arrays["colors"],
            radii=arrays["radii"].astype(np.float32),
            skin=int(arrays["skin"]),
        )

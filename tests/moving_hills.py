"""A patch of coloured hills that moves, sampled at other places in each frame."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from viewer.analysis.landmarks import Landmark
from viewer.analysis.surface_point import SurfacePoint
from viewer.errors import InputError
from viewer.scan.faces import Faces
from viewer.scan.points import PointCloud

SIDE = 40.0
SPACING = SIDE / np.sqrt(1600)


def hills(x: NDArray, y: NDArray) -> NDArray:
    """Heights of the surface at rest."""
    return 2.5 * np.sin(0.21 * x + 0.3) * np.cos(0.17 * y) + 1.2 * np.cos(0.33 * x - 0.2 * y)


def colors_of(x: NDArray, y: NDArray) -> NDArray[np.uint8]:
    """Colours of the surface."""
    waves = [np.sin(0.5 * x + 0.2 * y), np.cos(0.45 * y - 0.3 * x), np.sin(0.3 * x - 0.6 * y + 1)]
    return np.rint(128 + 60 * np.stack(waves, axis=1)).astype(np.uint8)


def moved(points: NDArray[np.float64], frame: int) -> NDArray[np.float64]:
    """Points (N, 3) at rest, where they are in a frame: they turn, sway and stretch a little."""
    a = 0.06 * frame
    turn = np.array([[np.cos(a), 0, np.sin(a)], [0, 1, 0], [-np.sin(a), 0, np.cos(a)]])
    return points * (1 + 0.01 * frame, 1, 1) @ turn.T + (0.7 * frame, -0.4 * frame, 100 + 0.5 * frame)


class MovingHills:
    """A source of frames. noise: along z at rest. hole: whether points at rest are left out of a frame."""

    name, unit = "hills", "mm"
    files: tuple[Path, ...] = ()

    def __init__(
        self,
        frames: int,
        noise: float = 0.02,
        hole: Callable[[int, NDArray, NDArray], NDArray[np.bool_]] | None = None,
        broken: frozenset[int] = frozenset(),
    ) -> None:
        self._frames, self._noise, self._hole, self._broken = frames, noise, hole, broken
        self.read: list[int] = []

    def __len__(self) -> int:
        return self._frames

    def label(self, index: int) -> str:
        return f"frame {index}"

    def times(self) -> NDArray[np.float64]:
        return np.arange(self._frames) / 25.0

    def load(self, index: int) -> PointCloud:
        self.read.append(index)
        if index in self._broken:
            raise InputError("is damaged")
        chance = np.random.default_rng(index)
        cells = np.stack(np.meshgrid(np.arange(40), np.arange(40)), axis=-1).reshape(-1, 2)
        x, y = ((cells + chance.random(cells.shape)) * SPACING - SIDE / 2).T
        if self._hole is not None:
            kept = ~self._hole(index, x, y)
            x, y = x[kept], y[kept]
        rest = np.stack([x, y, hills(x, y) + chance.normal(0, self._noise, len(x))], axis=1)
        return PointCloud.from_arrays(moved(rest, index), colors=colors_of(x, y))

    def faces(self, index: int) -> Faces:
        return Faces.joined([])


def at_rest(x: float, y: float) -> NDArray[np.float64]:
    """A place of the surface, (3,)."""
    return np.array([x, y, float(hills(np.array(x), np.array(y)))])


def truth(x: float, y: float, frames: int) -> NDArray[np.float64]:
    """Where a place of the surface is in each frame, (T, 3)."""
    return np.stack([moved(at_rest(x, y)[None], frame)[0] for frame in range(frames)])


def key(x: float, y: float, frame: int) -> SurfacePoint:
    """A place of the surface, as set exactly in a frame."""
    place = moved(at_rest(x, y)[None], frame)[0]
    where = (float(place[0]), float(place[1]), float(place[2]))
    return SurfacePoint(frame, frame / 25.0, where, None, SPACING, 0, (0.0,) * 6)


def placed(name: str, *keys: SurfacePoint) -> Landmark:
    """A landmark that was set at these."""
    return Landmark(name, keys)

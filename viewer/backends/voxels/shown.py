"""The octants that a view shows, as points: what is common to those that the CPU and the GPU found."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from ...gpu.pose import GpuPose
from ...picture.rows import Octants


class CutCounts(NamedTuple):
    """Facts about the octants that a view shows. complete: whether a later call would find the same. outside,
    facing_away: octants left out with all their children, by cause. coarsest: the least level of those that
    are drawn; that of the leaves where none is. coarseness: see `Stats`."""

    complete: bool
    outside: int
    facing_away: int
    coarsest: int
    coarseness: float = 0.0


class ShownOctants(Octants, Protocol):
    """Nodes that a view shows as points, and strays behind them."""

    @property
    def found(self) -> CutCounts:
        """Facts about them."""


class StrayPoints(NamedTuple):
    """The points outside the tree's cube, drawn as they are. rows: (n,), in the scan. positions: (n, 3),
    relative to the pose's origin. radii: (n,). normals: (n, 3), 0 where unknown. colors: (n, 4), or None."""

    rows: NDArray[np.uint32]
    positions: NDArray[np.float32]
    radii: NDArray[np.float32]
    normals: NDArray[np.float32]
    colors: NDArray[np.uint8] | None


class ScalarsOfRows(Mapping[str, NDArray[np.generic]]):
    """Scalars of each node: those of its lowest point, looked up when they are asked for."""

    def __init__(self, scalars: Mapping[str, NDArray[np.generic]], rows: NDArray[np.uint32]) -> None:
        self._scalars, self._rows = scalars, rows

    def __getitem__(self, name: str) -> NDArray[np.generic]:
        return self._scalars[name][self._rows]

    def __iter__(self) -> Iterator[str]:
        return iter(self._scalars)

    def __len__(self) -> int:
        return len(self._scalars)


def ids_of(pose: GpuPose, rows: NDArray[np.uint32]) -> NDArray[np.uint32]:
    """The indices in the file of rows of a pose, (n,)."""
    ids = pose.cloud.ids  # near first: no row is looked for by them
    return rows if ids is None else ids[rows]

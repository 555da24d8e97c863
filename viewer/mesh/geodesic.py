"""Shortest paths over a patch: edges are flipped until the path of edges is straight (Sharp and Crane 2020).

It begins with the shortest path along edges (Dijkstra), and is then the shortest of those that it can be
moved to without leaving the surface: where a bump lies between, the other way round may be shorter.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .patch import Patch

Line = NDArray[np.float64]  # (P, 3)


class Geodesics:
    """The shortest paths over one patch."""

    def __init__(self, patch: Patch) -> None:
        self.patch = patch
        self._solver: Any = None

    def path(self, start: int, end: int) -> Line | None:
        """The path from one vertex to another, (P, 3), a place at each edge that it crosses; None where the
        patch does not join them."""
        if self.patch.parts[start] != self.patch.parts[end]:
            return None
        if start == end:
            return self.patch.vertices[[start, start]]
        if self._solver is None:
            from potpourri3d import EdgeFlipGeodesicSolver

            self._solver = EdgeFlipGeodesicSolver(self.patch.vertices, self.patch.faces)
        return np.asarray(self._solver.find_geodesic_path(start, end))


def length_of(line: Line) -> float:
    """The length of a line of straight pieces, scan units."""
    return float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum())


def steps_along(line: Line, step: float) -> Line:
    """Places on a line of straight pieces, one a step or a little more, its ends among them, (M, 3)."""
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    at = np.linspace(0, along[-1], max(int(along[-1] / step), 1) + 1)
    return np.stack([np.interp(at, along, axis) for axis in line.T], axis=1)


def kinked(line: Line, step: float) -> float:
    """How far its length may be off that of a smooth line, scan units: a quarter of the lengths of its pieces
    times the squared angles between them, where pieces are a `step` long.

    A line over flat faces with corners that lie a step apart on a surface that bends by the angle t a step
    is shorter than one on that, by about t^2 / 4: it runs beneath. A zigzag that turns by t at each step is
    longer than the straight line by t^2 / 8.
    """
    pieces = np.diff(steps_along(line, step), axis=0)
    if len(pieces) < 2:
        return 0.0
    lengths = np.linalg.norm(pieces, axis=1)
    cosines = (pieces[1:] * pieces[:-1]).sum(axis=1) / np.maximum(
        lengths[1:] * lengths[:-1], np.finfo(float).tiny
    )
    squared = np.arccos(np.clip(cosines, -1, 1)) ** 2
    return float(squared.sum() * lengths.mean()) / 4

"""The surface that the points of one moment show, as tracking looks at it: here and there, as needed."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...scan.points import strided
from ...scan.pose import Pose
from ...threads import threads_for

_CELL = 2.0  # spacings
_MOST_CELLS = 1 << 22
_BODY = 0.01, 0.99  # quantiles between which the body of the points lies
_MARGIN = 0.1  # of its longest edge, that the grid reaches farther
_AROUND = 13  # points, with the one in the middle, that tell where it goes
_MOST_IN_REACH = 1 << 16  # points that a patch is chosen from
# Brightness, red against green, yellow against blue: of a byte a channel, nearly independent of each other.
_OPPONENT = np.array([[1, 1, 1], [1, -1, 0], [0.5, 0.5, -1]]) / [[3], [2], [2]] / 255

Float = NDArray[np.float64]


class MomentSurface:
    """Points of one moment in a grid, and the parabolas that have been fitted around them so far.

    spacing: between neighbours, scan units. size: the longest edge of the body of the points. held: for the
    kernels, relative to an origin that all positions share.
    """

    def __init__(
        self,
        positions: NDArray[np.floating],
        spacing: float,
        colors: NDArray[np.uint8] | None = None,
        normals: NDArray[np.float32] | None = None,
    ) -> None:
        """positions: (N, 3). colors: (N, 3 or 4). normals: (N, 3)."""
        channels = None
        if colors is not None:
            channels = colors[:, :3].astype(np.float32) @ _OPPONENT.T.astype(np.float32)
        self._hold(np.ascontiguousarray(positions, np.float64), spacing, channels, normals)

    @classmethod
    def of(cls, pose: Pose, origin: Float, spacing: float) -> MomentSurface:
        """The surface of a pose, relative to an origin, (3,)."""
        cloud = pose.cloud
        return cls(cloud.positions + (cloud.origin - origin), spacing, cloud.colors, cloud.normals)

    def _hold(
        self,
        points: Float,
        spacing: float,
        channels: NDArray[np.float32] | None,
        normals: NDArray[np.float32] | None,
    ) -> None:
        from . import surface_kernels as kernels

        count = len(points)
        if channels is None:
            channels = np.empty((count, 0), np.float32)
        low, high = np.quantile(strided(points), _BODY, axis=0) if count else np.zeros((2, 3))
        self.size, self.spacing = float((high - low).max()), spacing
        margin = _MARGIN * self.size
        if count:
            low = np.maximum(low - margin, points.min(axis=0))
            high = np.minimum(high + margin, points.max(axis=0))
        cells = np.prod(np.maximum((high - low) / (_CELL * spacing), 1.0))
        cell = _CELL * spacing * max(1.0, float(cells / _MOST_CELLS) ** (1 / 3))
        shape = np.maximum(np.ceil((high - low) / cell), 1).astype(np.int64)
        starts, order = np.empty(int(shape.prod()) + 1, np.int32), np.empty(count, np.int32)
        kernels.grid_cells(points, low, cell, shape, starts, order)
        self.held = kernels.Cells(
            points=points,
            colors=channels,
            normals=np.empty((0, 3), np.float32) if normals is None else normals,
            low=low,
            cell=cell,
            size=shape,
            starts=starts,
            order=order,
            spacing=spacing,
            state=np.zeros(count, np.int8),
            frames=np.empty((count, 3, 3), np.float32),  # memory that is taken as it is filled
            parabolas=np.empty((count, 1 + channels.shape[1], 6), np.float32),
            reaches=np.empty(count, np.float32),
        )

    def unfitted(self) -> MomentSurface:
        """The surface with no parabolas fitted yet; points and grid are shared."""
        other, held = object.__new__(MomentSurface), self.held
        other.size, other.spacing = self.size, self.spacing
        other.held = held._replace(
            state=np.zeros_like(held.state),
            frames=np.empty_like(held.frames),
            parabolas=np.empty_like(held.parabolas),
            reaches=np.empty_like(held.reaches),
        )
        return other

    @cached_property
    def around(self) -> NDArray[np.int32]:
        """The rows of the points nearest to each, itself the first, (N, 13); fewer where there are fewer."""
        from scipy.spatial import cKDTree

        points = self.held.points
        nearest = cKDTree(points).query(points, min(_AROUND, len(points)), workers=threads_for(len(points)))
        return nearest[1].reshape(len(points), -1).astype(np.int32)

    def rows_around(self, position: Float, reach: float) -> NDArray[np.int32]:
        """Rows of the points within reach of a position, increasing."""
        from .surface_kernels import rows_within

        rows, squared = np.empty(_MOST_IN_REACH, np.int32), np.empty(_MOST_IN_REACH)
        found = rows_within(self.held, position[0], position[1], position[2], reach, rows, squared)
        return np.sort(rows[:found])

    def axes_at(self, position: Float, reach: float) -> Float | None:
        """Two tangents and the normal of the surface at the point nearest to a position, (3, 3) by row; None
        where none is within reach."""
        from .surface_kernels import fit_at, nearest_within

        row = nearest_within(self.held, position[0], position[1], position[2], reach)
        return self.held.frames[row].astype(np.float64) if row >= 0 and fit_at(self.held, row) else None

    def cropped(self, position: Float, reach: float) -> MomentSurface:
        """The part of the surface within reach of a position, in arrays of its own."""
        rows = self.rows_around(position, reach)
        part, held = object.__new__(MomentSurface), self.held
        part._hold(
            held.points[rows],
            self.spacing,
            held.colors[rows],
            held.normals[rows] if len(held.normals) else None,
        )
        part.size = self.size
        return part

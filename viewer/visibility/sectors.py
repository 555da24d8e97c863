"""Sectors: the directions from the eye, divided into cells that each keep one point.

Machado e Silva 2014, 4.1. The plain twin of shaders/hpr/sectors.glsl, in float64.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..gpu.blocks import Mat4
from ..scan.points import NOTHING

# Tangent of half a face, 45 degrees: there a sector is 0.71 times as large as in the middle.
_WIDEST = 1.0
_STEPS = [(x, y) for y in (-1, 0, 1) for x in (-1, 0, 1) if x or y]


@dataclass(frozen=True)
class Sectors:
    """Sectors around an eye, as shaders have them too (`<params>`).

    mapping: "grid", one face of edge x edge sectors that covers the bounding sphere, or "cube", six faces,
    all directions: for eyes near or inside it. On each face the angles to the right and down are divided
    evenly. to_sectors: from positions on the GPU to the sectors' axes, forward, right and down, from the
    sphere's center (grid) or the eye (cube), in units of `unit` scan units. closeness: of the eye, one over
    its distance to the center in units, 0 for parallel rays. tangent: of half the angle that a face covers.
    half_angle: that angle over its tangent. lateral: from units aside, at the center, to halves of a face.
    weight: of how far a point is beside a sector's direction against how far it is from the eye; it stands
    for the radius R of the flip.

    A point's spot is what keys are computed from: (right, down, farther) with tangents as shares of that of
    half the face, and how much farther than the center it is (grid), or the offset from the eye (cube), in
    units.
    """

    to_sectors: Mat4
    edge: int
    closeness: float
    tangent: float
    half_angle: float
    lateral: float
    weight: float
    unit: float
    mapping: str

    @classmethod
    def around(
        cls,
        center: NDArray[np.float64],
        radius: float,
        eye: NDArray[np.float64],
        origin: NDArray[np.float64],
        edge: int = 1,
    ) -> Sectors:
        """Sectors for points in a sphere, seen from an eye, both (3,) in scan units. origin: what positions
        on the GPU are relative to, (3,). Their weight is set by `flipped`."""
        away = center - eye
        distance = float(np.linalg.norm(away))
        if distance <= math.sqrt(1 + 1 / _WIDEST**2) * radius:
            columns = _columns(np.eye(3), eye - origin, radius)
            return cls(columns, edge, 0.0, 1.0, math.pi / 4, 1.0, 0.0, radius, "cube")
        return cls._grid(away / distance, center - origin, radius, edge, radius / distance)

    @classmethod
    def along(
        cls,
        center: NDArray[np.float64],
        radius: float,
        forward: NDArray[np.float64],
        origin: NDArray[np.float64],
        edge: int = 1,
    ) -> Sectors:
        """Sectors for parallel rays along a unit vector, (3,)."""
        return cls._grid(forward, center - origin, radius, edge, 0.0)

    @classmethod
    def _grid(
        cls,
        forward: NDArray[np.float64],
        center: NDArray[np.float64],
        radius: float,
        edge: int,
        closeness: float,
    ) -> Sectors:
        sine = min(closeness, math.sqrt(0.5))
        tangent = sine / math.sqrt(1 - sine**2)
        half = math.atan(tangent) / tangent if tangent else 1.0
        columns = _columns(_axes(forward), center, radius)
        return cls(columns, edge, closeness, tangent, half, math.sqrt(1 - sine**2), 0.0, radius, "grid")

    @property
    def count(self) -> int:
        """How many there are, k."""
        return (1 if self.mapping == "grid" else 6) * self.edge**2

    @property
    def angle(self) -> float:
        """The angle that a sector in the middle of a face covers, radians; for parallel rays its width in
        units."""
        return 2 * self.half_angle * (self.tangent or 1.0) / self.edge

    def divided(self, edge: int) -> Sectors:
        """Sectors of these directions, so many along an edge."""
        return replace(self, edge=edge)

    @property
    def distance(self) -> float:
        """How far it is from the eye to where keys count distances from, scan units: the sphere's center, or
        the eye."""
        if self.mapping == "cube":
            return 0.0
        return self.unit / self.closeness if self.closeness else math.inf

    @property
    def farthest(self) -> float:
        """How far any point of the sphere may be from the eye, scan units."""
        return (
            (1 + math.hypot(1, 1 / _WIDEST)) * self.unit
            if self.mapping == "cube"
            else self.distance + self.unit
        )

    def flipped(self, radius: float) -> Sectors:
        """Sectors with the weight of a flip at this radius, scan units."""
        return self.weighted((radius - self.distance / 2) / self.unit * self.tangent**2)

    def weighted(self, weight: float) -> Sectors:
        """Sectors with this weight."""
        return replace(self, weight=weight)

    # --- the twin of the shader -------------------------------------------------------

    def distances(self, sector_positions: NDArray[np.float64]) -> NDArray[np.float64]:
        """Distances of sector_positions from the eye, (N,), scan units."""
        if self.mapping == "cube":
            return self.unit * np.linalg.norm(sector_positions, axis=1)
        return self.distance + self.unit * sector_positions[:, 2]

    def sector_positions(self, positions: NDArray[np.floating]) -> NDArray[np.float64]:
        """Spots of positions on the GPU, (N, 3); NaN where there is none, behind the eye or at it.

        Each picture of a turn asks for those of thousands of points: column by column, and in place, takes a
        third of the time.
        """
        columns = np.array(self.to_sectors)
        offsets = columns[:3, :3].T @ positions.T.astype(np.float64, copy=False)
        offsets += columns[3, :3, None]
        if self.mapping == "cube":
            return np.where((offsets != 0).any(axis=0), offsets, np.nan).T
        forward, right, down = offsets
        ahead = self.closeness * forward
        ahead += 1
        right_squared, down_squared = right * right, down * down
        away = forward * forward
        away += right_squared
        away += down_squared
        far = right_squared
        far += down_squared
        far *= self.closeness**2
        far += ahead * ahead
        np.sqrt(far, out=far)
        # (closeness away + 2 forward) / (far + 1)
        away *= self.closeness
        forward *= 2
        away += forward
        far += 1
        spots = np.empty_like(offsets)
        with np.errstate(invalid="ignore", divide="ignore"):
            for spot, aside in zip(spots[:2], (right, down), strict=True):
                np.multiply(self.lateral, aside, out=spot)
                spot /= ahead
            np.divide(away, far, out=spots[2])
        if not (ahead > 0).all():
            spots[:, ~(ahead > 0)] = np.nan
        return spots.T

    def sector_of(self, sector_positions: NDArray[np.float64]) -> NDArray[np.uint32]:
        """The sectors that sector_positions are in, (N,); NOTHING where in none."""
        face, tangents = self._on_face(sector_positions)
        with np.errstate(invalid="ignore"):
            at = (self.tangent or 1.0) * tangents.T
            if self.tangent:
                np.arctan(at, out=at)
                at /= self.tangent
            at /= self.half_angle
            at += 1
            at *= self.edge / 2
            np.floor(at, out=at)
            if self.mapping == "cube":
                at = np.clip(at, 0, self.edge - 1)
            inside = (at >= 0) & (at < self.edge)
        outside = np.flatnonzero(~(inside[0] & inside[1]))
        at[:, outside] = 0
        column, line = at.astype(np.int64)
        sectors = ((face * self.edge + line) * self.edge + column).astype(np.uint32)
        sectors[outside] = NOTHING
        return sectors

    def _on_face(
        self, sector_positions: NDArray[np.float64]
    ) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        if self.mapping == "grid":
            return np.zeros(len(sector_positions), np.int64), sector_positions[:, :2]
        size = np.abs(sector_positions)
        axis = np.nan_to_num(size, nan=-1.0).argmax(axis=1)
        rows = np.arange(len(sector_positions))
        forward = sector_positions[rows, axis]
        behind = forward < 0
        first, second = sector_positions[rows, (axis + 1) % 3], sector_positions[rows, (axis + 2) % 3]
        right, down = np.where(behind, second, first), np.where(behind, first, second)
        return 2 * axis + behind, np.column_stack([right, down]) / np.abs(forward)[:, None]

    def directions(self, sectors: NDArray[np.uint32]) -> NDArray[np.float64]:
        """The directions of sectors' middles, (N, 3): (1, right, down) like `sector_positions` (grid),
        or unit vectors (cube)."""
        numbers = sectors.astype(np.int64)
        at = np.column_stack([numbers % self.edge, numbers // self.edge % self.edge])
        angles = self.half_angle * ((2 * at + 1) / self.edge - 1)
        tangents = np.tan(self.tangent * angles) / self.tangent if self.tangent else angles
        if self.mapping == "grid":
            return np.column_stack([np.ones(len(at)), tangents])
        return _from_face(numbers // self.edge**2, tangents)

    def neighbors(self, sectors: NDArray[np.uint32], step: tuple[int, int]) -> NDArray[np.uint32]:
        """The sectors one step (right, down) of -1, 0, 1 beside others, (N,); NOTHING where there is none, at
        the edge of a grid and across the corners of a cube."""
        numbers, edge = sectors.astype(np.int64), self.edge
        at = np.column_stack([numbers % edge, numbers // edge % edge]) + np.array(step)
        over = (at < 0) | (at >= edge)
        face = numbers // edge**2
        found = (face * edge + at[:, 1]) * edge + at[:, 0]
        if self.mapping == "grid":
            return np.where(over.any(axis=1), NOTHING, found).astype(np.uint32)
        found = np.where(over.any(axis=1), self._across(face, at), found)
        return np.where(over.all(axis=1), NOTHING, found).astype(np.uint32)

    def _across(self, face: NDArray[np.int64], at: NDArray[np.int64]) -> NDArray[np.int64]:
        """Sectors over the edge of a face: in whole numbers of half sectors, faces being `edge` from the
        cube's middle, the one that was ahead is the first beside the edge."""
        edge = self.edge
        aside = 2 * at + 1 - edge
        over = np.abs(aside) > edge
        ahead = np.where(over.any(axis=1), edge - 1, edge)
        aside = np.where(over, np.sign(aside) * edge, aside)
        offsets = _turned(face, np.column_stack([ahead, aside]))
        axis = np.argmax(np.abs(offsets), axis=1)
        rows = np.arange(len(offsets))
        behind = offsets[rows, axis] < 0
        first, second = offsets[rows, (axis + 1) % 3], offsets[rows, (axis + 2) % 3]
        right, down = np.where(behind, second, first), np.where(behind, first, second)
        column, line = (right + edge - 1) // 2, (down + edge - 1) // 2
        return ((2 * axis + behind) * edge + line) * edge + column

    def keys(self, sector_positions: NDArray[np.float64], sectors: NDArray[np.uint32]) -> NDArray[np.float64]:
        """Keys, which are least for the point whose flip is farthest along a sector's direction, (N,).

        A point at rho u from the eye is flipped to (2R - rho) u, whose projection on d is
        (2R - rho)(1 - q/2) with q = |u - d|^2. Its largest is the least
        (R - rho0/2) q + (rho - rho0)(1 - q/2), in which nothing cancels, whatever R is. rho0: to the sphere's
        center (grid), 0 (cube).
        """
        directions = self.directions(sectors)
        if self.mapping == "cube":
            far = np.linalg.norm(sector_positions, axis=1)
            q = ((sector_positions / far[:, None] - directions) ** 2).sum(axis=1)
            return self.weight * q + far * (1 - q / 2)
        t2 = self.tangent**2
        point, aside = sector_positions[:, :2], directions[:, 1:]
        apart = point - aside
        turn = point[:, 0] * apart[:, 1] - point[:, 1] * apart[:, 0]
        both = np.sqrt((1 + t2 * (point**2).sum(axis=1)) * (1 + t2 * (aside**2).sum(axis=1)))
        squared = (apart**2).sum(axis=1) + t2 * turn**2
        q = 2 * squared / (both * (both + 1 + t2 * (point * aside).sum(axis=1)))  # |u - d|^2 / t2
        return self.weight * q + sector_positions[:, 2] * (1 - t2 * q / 2)


def _columns(axes: NDArray[np.float64], base: NDArray[np.float64], unit: float) -> Mat4:
    """Positions to units along axes (rows) from a base."""
    turned = axes / unit
    x, y, z = (tuple(column) for column in turned.T.tolist())
    return ((*x, 0.0), (*y, 0.0), (*z, 0.0), (*(-turned @ base).tolist(), 1.0))


def _axes(forward: NDArray[np.float64]) -> NDArray[np.float64]:
    """Forward, right and down, (3, 3) rows: of the scan's axes the one most aside is down."""
    down = np.eye(3)[np.argmin(np.abs(forward))]
    down = down - (down @ forward) * forward
    down /= math.sqrt(down @ down)
    (dx, dy, dz), (fx, fy, fz) = down.tolist(), forward.tolist()
    return np.array([forward, (dy * fz - dz * fy, dz * fx - dx * fz, dx * fy - dy * fx), down])


def _turned(face: NDArray[np.int64], ahead: NDArray[Any]) -> NDArray[Any]:
    """Turn (forward, right, down) of faces to the cube's axes, (N, 3)."""
    behind = face % 2 == 1
    along = np.where(behind, -ahead[:, 0], ahead[:, 0])
    first, second = np.where(behind, ahead[:, 2], ahead[:, 1]), np.where(behind, ahead[:, 1], ahead[:, 2])
    values, rows, axis = np.empty_like(ahead), np.arange(len(face)), face // 2
    for offset, value in enumerate((along, first, second)):
        values[rows, (axis + offset) % 3] = value
    return values


def _from_face(face: NDArray[np.int64], tangents: NDArray[np.float64]) -> NDArray[np.float64]:
    offsets = _turned(face, np.column_stack([np.ones(len(face)), tangents]))
    return offsets / np.linalg.norm(offsets, axis=1)[:, None]

"""The rigid motion of a region from one moment to another, and how sure it is.

The region's points are moved onto the surface of the other moment (point to plane: Chen and Medioni 1992),
weighed by Tukey's kernel, see `tracking.register_kernels`. The 6 x 6 information of the distances along the
normals tells how sure each direction is. Neighbouring distances err alike: the variance comes from their sums
over pieces of the region (clustered errors: Liang and Zeger 1986). Directions in which the surface only
slides on itself keep the prior.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...rigid import Rigid, rigid_matrix
from ..landmarks.mirroring import MirrorPlane, mirrored
from ..tracking.registration import WAYS, PatchLevel, Placement, registered, rotations
from ..tracking.surface import MomentSurface

if TYPE_CHECKING:
    from ..tracking.correspondence_kernels import Correspondences
    from ..tracking.patch_kernels import SurfacePatch

Float = NDArray[np.float64]

_POINTS = 4000  # of a region, that are registered
_COARSE = 500  # of them, that find about where it lies
_LEAST_DISTANCE = 0.01  # spacings: deviations of distances are taken to be this at least
FEWEST = 60  # that tell a motion
_PIECE = 6.0, 0.25  # spacings, and shares of its scale: edge of a piece of the region that errs alike
_SHARED = 1.5  # spacings over which parabolas through the same points make distances err alike
_TURN = 0.3  # radians, and
_SHIFT = 20.0  # spacings that a region moves between moments: standard deviations beforehand
_SLIDING = 1e-4  # of a motion's mean square along the normals, below which the surface only slides on itself
_FLOOR = 0.01  # spacings: no shift is known better, and no turn, by the shift at the scale of the region
_OF_NOISE = 4.0  # times what noise of the normals makes of that: so much is uncertain
_ALIKE = 5.0  # points whose normals are as good as one
LEVELS = (  # search in spacings
    PatchLevel(points=_COARSE, search=20.0, rounds=20, turn=_TURN),
    PatchLevel(points=_COARSE, search=6.0, rounds=15, turn=_TURN),
    PatchLevel(points=_POINTS, search=3.0, rounds=15, turn=_TURN),
)


@dataclass(frozen=True, eq=False)
class RegionSurface:
    """The surface of a region in one moment, up to 4000 points of it.

    patch: its points, around their middle, along the axes of the world. rows: (n,), those of the surface.
    pieces: (n,), the number of the piece that each is in. edge: of a piece. scale: root mean square distance
    from the middle. count: of the region's points, of which these are some. spacing: between neighbours. All
    lengths are in scan units.
    """

    patch: SurfacePatch
    rows: NDArray[np.int64]
    pieces: NDArray[np.intp]
    edge: float
    scale: float
    count: int
    spacing: float

    @classmethod
    def of(cls, surface: MomentSurface, rows: NDArray[np.integer]) -> RegionSurface | None:
        """The surface at some rows, increasing; None where too few points have a surface around them."""
        from ..tracking.deformation_kernels import fit_rows

        some = np.linspace(0, len(rows) - 1, min(len(rows), _POINTS)).astype(np.int64)
        chosen = rows[some].astype(np.int64)
        points, normals = np.empty((2, len(chosen), 3))
        fitted = np.empty(len(chosen), np.bool_)
        fit_rows(surface.held, chosen, points, normals, fitted)
        if np.count_nonzero(fitted) < FEWEST:
            return None
        return cls._around(points[fitted], normals[fitted], chosen[fitted], len(rows), surface.spacing)

    @classmethod
    def _around(
        cls, points: Float, normals: Float, rows: NDArray[np.int64], count: int, spacing: float
    ) -> RegionSurface:
        """The surface of a region with points and normals, both (n, 3)."""
        from ..tracking.patch_kernels import SurfacePatch

        middle = points.mean(axis=0)
        arms = np.ascontiguousarray(points - middle)
        away = np.linalg.norm(arms, axis=1)
        patch = SurfacePatch(
            center=middle,
            axes=np.eye(3),
            local=arms,
            normals=np.ascontiguousarray(normals),
            colors=np.empty((len(arms), 0)),
            gradients=np.empty((len(arms), 0, 3)),
            closeness=np.ones(len(arms)),
            radius=float(away.max()),
            noise=0.0,
        )
        scale = float(np.sqrt((away**2).mean()))
        edge = max(_PIECE[0] * spacing, _PIECE[1] * scale)
        cells = np.floor(arms / edge).astype(np.int64)
        pieces = np.unique(cells, axis=0, return_inverse=True)[1].reshape(-1)
        return cls(patch, rows, pieces, edge, scale, count, spacing)

    @property
    def points(self) -> Float:
        """(n, 3)."""
        return self.patch.center + self.patch.local

    def only(self, chosen: NDArray[np.bool_]) -> RegionSurface:
        """The part of the region that some of its points, (n,), show."""
        count = round(self.count * float(chosen.mean()))
        points, normals = self.points[chosen], self.patch.normals[chosen]
        return self._around(points, normals, self.rows[chosen], count, self.spacing)

    def mirrored(self, plane: MirrorPlane) -> RegionSurface:
        """The mirror image of the region."""
        normals = self.patch.normals
        turned = normals - 2 * (normals @ plane.normal)[:, None] * plane.normal
        return self._around(mirrored(self.points, plane), turned, self.rows, self.count, self.spacing)

    def some(self, count: int) -> SurfacePatch:
        """The patch with about so many of its points."""
        step = max(1, len(self.rows) // count)
        patch = self.patch
        return patch._replace(
            local=np.ascontiguousarray(patch.local[::step]),
            normals=np.ascontiguousarray(patch.normals[::step]),
            colors=patch.colors[::step],
            gradients=patch.gradients[::step],
            closeness=patch.closeness[::step],
        )


@dataclass(frozen=True, eq=False)
class RegisteredRegion:
    """A region's motion from its moment to another one.

    motion: from the one to the other. covariance: (6, 6), of the shift of the region's middle, scan units,
    and of the turn about it, radians, both along the axes of the world. matched: the share of the region that
    lies on the surface of the other moment.
    """

    motion: Rigid
    covariance: Float
    matched: float


def register_region(
    region: RegionSurface, surface: MomentSurface, start: Rigid, levels: Sequence[PatchLevel] = LEVELS
) -> RegisteredRegion | None:
    """Find the motion of a region onto the surface of another moment, from a start on; None where too few of
    its points have counterparts. levels: follow each other."""
    slack = (_SHIFT * surface.spacing) ** 2 * np.eye(3)
    placement = Placement(start.points(region.patch.center), start.rotation.copy())
    for level in levels:
        nearer = registered(region.some(level.points), surface, placement, level, slack)
        if nearer is None:
            return None
        placement = nearer
    turn = rotations(placement.turn)
    motion = Rigid(rigid_matrix(turn, placement.position - turn @ region.patch.center))
    return RegisteredRegion(motion, _covariance(region, surface, motion), placement.kept)


def distances(region: RegionSurface, surface: MomentSurface, motion: Rigid) -> Float:
    """How far the points of a moved region lie above the surface of a moment, (n,) scan units; NaN where it
    has no surface."""
    matches = _matches(region, surface, motion)
    return np.where(matches.is_matched, matches.residuals[:, 0], np.nan)


def _matches(region: RegionSurface, surface: MomentSurface, motion: Rigid) -> Correspondences:
    from ..tracking.correspondence_kernels import MovedPatch, find_correspondences, no_correspondences
    from ..tracking.robust_kernels import weigh

    matches = no_correspondences(len(region.rows), 1)
    moved = MovedPatch(motion.points(region.patch.center), motion.rotation.copy(), np.zeros(WAYS))
    find_correspondences(region.patch, surface.held, moved, LEVELS[-1].search * surface.spacing, matches)
    weigh(matches, np.array([_LEAST_DISTANCE * surface.spacing]))
    return matches


def _covariance(region: RegionSurface, surface: MomentSurface, motion: Rigid) -> Float:
    """The covariance (6, 6) of the shift and the turn of a region, as it is moved."""
    matches = _matches(region, surface, motion)
    rows = np.flatnonzero(matches.is_matched)
    weights, residuals = matches.weights[rows, 0], matches.residuals[rows, 0]
    arms = matches.arms[rows] / region.scale
    own, other = (
        np.hstack([normals, np.cross(arms, normals)])
        for normals in (matches.own_gradients[rows, 0], matches.gradients[rows, 0])
    )
    total = weights.sum()
    # Noise turns the normals, and squared that would hold what slides: of two moments it is independent.
    product = own.T @ (weights[:, None] * other) / total
    noise = float(weights @ np.square(own[:, :3] - other[:, :3]).mean(axis=1) / total) / 2
    least = _OF_NOISE * noise / np.sqrt(min(len(rows), max(region.count / _ALIKE, 1)))
    sizes, directions = np.linalg.eigh((product + product.T) / 2)
    sizes = np.maximum(sizes - least, 0.0)
    held = sizes > _SLIDING
    unit = np.concatenate([np.ones(3), np.full(3, 1 / region.scale)])
    before = np.concatenate([np.full(3, _SHIFT * surface.spacing), np.full(3, _TURN)])
    if not held.any():
        return np.diag(before**2)
    scores = (weights * residuals)[:, None] * ((own + other) / 2 @ directions[:, held])
    scores /= np.sqrt(sizes[held] * total)
    pieces = np.unique(region.pieces[rows], return_inverse=True)[1]
    sums = np.stack([np.bincount(pieces, column) for column in scores.T], axis=1)
    count, free = len(sums), held.sum()
    # Pieces cut what errs alike at their edges, so that their sums lack some of it.
    cut = (1 - _SHARED * region.spacing / region.edge) ** 2
    variance = float((sums**2).sum() / free) / cut * count / max(count - free, 1)
    known = (directions * (held * sizes * total / variance)) @ directions.T
    known = known / np.outer(unit, unit) + np.diag(before**-2.0)
    return np.linalg.inv(known) + np.diag((_FLOOR * region.spacing * unit) ** 2)

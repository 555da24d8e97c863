"""Registration of the surface around a position of one moment to that of another."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .surface import MomentSurface

if TYPE_CHECKING:
    from .patch_kernels import SurfacePatch

Float = NDArray[np.float64]

WAYS = 12  # to deform, see `register_kernels`
_LEAST_DISTANCE = 0.01  # spacings: deviations of distances are taken to be this at least
_LEAST_COLOR = 0.004  # of a byte's range, as of colours: a step of a byte


@dataclass(frozen=True)
class PatchLevel:
    """How a patch is registered.

    points: of the patch at most. search: spacings that a counterpart may be away. rounds: at most. bending:
    the standard deviation of strains and bends over the patch; 0: rigid. turn: that of the turn, radians.
    uses_color: whether colours are compared. bends_alike: whether distances are off by how the surface bends
    more than by noise, so that they tell less.
    """

    points: int
    search: float
    rounds: int
    bending: float = 0.0
    turn: float = 0.3
    uses_color: bool = True
    bends_alike: bool = False


@dataclass(frozen=True, eq=False)
class Placement:
    """A patch as it lies in another moment.

    position: (3,), of its centre. turn: (3, 3). bent: (12,) how it is deformed. covariance: (3, 3) of the
    position, from noise and from what shape and colour leave open. kept: the share of the patch, by
    closeness, that is matched. middle: that of the points next to the position. deviation: of the distances
    to the surface, scan units.
    """

    position: Float
    turn: Float = field(default_factory=lambda: np.eye(3))
    bent: Float = field(default_factory=lambda: np.zeros(WAYS))
    covariance: Float = field(default_factory=lambda: np.full((3, 3), np.nan))
    kept: float = 0.0
    middle: float = 0.0
    deviation: float = np.nan

    @property
    def misfit(self) -> float:
        """How badly the patch fits: the deviation, and more the less of it is matched."""
        return self.deviation / max(self.kept, 1e-9)

    def at(self, position: Float) -> Placement:
        """The placement moved to a position."""
        return replace(self, position=position)


def rotations(matrices: Float) -> Float:
    """The rotations nearest to matrices (..., 3, 3) (Kabsch 1976)."""
    from .rotation_kernels import nearest_rotations

    found = np.empty(matrices.shape)
    nearest_rotations(np.ascontiguousarray(matrices, np.float64).reshape(-1, 3, 3), found.reshape(-1, 3, 3))
    return found


def patch_of(surface: MomentSurface, position: Float, radius: float, points: int) -> SurfacePatch | None:
    """The patch of a surface around a position, of so many points at most; None where it has no surface
    there."""
    from .factor_kernels import RIGID
    from .patch_kernels import cut_patch

    axes = surface.axes_at(position, radius)
    if axes is None:
        return None
    rows = surface.rows_around(position, radius)
    if len(rows) > points:
        rows = rows[np.linspace(0, len(rows) - 1, points).astype(np.int64)]
    patch = cut_patch(surface.held, position, axes, radius, rows)
    return patch if len(patch.local) > 3 * RIGID else None


def placed_points(patch: SurfacePatch, placement: Placement) -> Float:
    """The points of a patch as it is placed, (n, 3)."""
    from .patch_kernels import deformed_points

    return placement.position + deformed_points(patch, placement.bent) @ patch.axes @ placement.turn.T


def registered(
    patch: SurfacePatch, surface: MomentSurface, start: Placement, level: PatchLevel, slack: Float
) -> Placement | None:
    """The patch on a surface, from a placement on; None where too few of its points have counterparts.

    slack: (3, 3), the covariance of the position from where it begins.
    """
    from .correspondence_kernels import MovedPatch
    from .register_kernels import RegistrationPrior, RegistrationRules, register_patch

    bent = start.bent.copy() if level.bending else np.zeros(WAYS)
    moved = MovedPatch(start.position.copy(), start.turn.copy(), bent)
    prior = RegistrationPrior(
        np.linalg.inv(slack).astype(np.float64), level.turn, np.full(WAYS, level.bending)
    )
    channels = patch.colors.shape[1]
    has_color = level.uses_color and surface.held.colors.shape[1] == channels
    least = [_LEAST_DISTANCE * surface.spacing, *[_LEAST_COLOR] * (channels if has_color else 0)]
    rules = RegistrationRules(
        level.search * surface.spacing, level.rounds, level.bends_alike, np.array(least)
    )
    found = register_patch(patch, surface.held, moved, prior, rules)
    if not found.rounds or not np.isfinite(moved.position).all():
        return None
    _, covariance, kept, middle, deviation = found
    return Placement(*moved, covariance, kept, middle, deviation)


def best_registered(
    patch: SurfacePatch,
    surface: MomentSurface,
    starts: Sequence[Placement],
    levels: Sequence[PatchLevel],
    slack: Float,
    enough: float = 0.0,
) -> Placement | None:
    """The patch on a surface, from that of some placements from which it fits best. Levels follow each
    other. enough: the misfit at which no other one is tried."""
    best = None
    for start in starts:
        found: Placement | None = start
        for level in levels:
            if found is not None:
                found = registered(patch, surface, found, level, slack)
        if found is not None and (best is None or found.misfit < best.misfit):
            best = found
        if best is not None and best.misfit <= enough:
            break
    return best

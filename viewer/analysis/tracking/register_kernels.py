"""Registration of a patch of one moment to the surface of another. Compiled by numba; see `registration`.

Iterated closest points, point to plane: each round finds correspondences (`correspondence_kernels`), weighs
them by a robust kernel (`robust_kernels`), and takes a step of Gauss and Newton on the factors
(`factor_kernels`) and on what is likely beforehand, until the stopping rule says that it has converged.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...compiled import compiled
from .correspondence_kernels import Correspondences, MovedPatch, find_correspondences, no_correspondences
from .factor_kernels import RIGID, add_factors, information, unknowns
from .patch_kernels import MODES, SurfacePatch
from .robust_kernels import weigh
from .surface_kernels import Cells, solve_in_place

_CONVERGED = 0.01  # spacings: a smaller step is the last one
_MIDDLE = 2.5  # spacings from the centre: what is next to it
_BELONGS = 0.1  # weight from which on a point lies on the surface

Float = NDArray[np.float64]


class RegistrationPrior(NamedTuple):
    """Prior knowledge of how a patch moves and deforms."""

    position: Float  # (3, 3), the inverse of the covariance of the position
    rotation: float  # standard deviation of the turn, radians
    deformation: Float  # (12,) standard deviations of the modes; 0: a mode is not free


class RegistrationRules(NamedTuple):
    """How a patch is registered."""

    search: float  # scan units that a counterpart may be away
    rounds: int  # at most
    bends_alike: bool  # whether distances are off by how the surface bends more than by noise
    least_scales: Float  # (1 + C,), least deviations of distances, and of each channel that is compared


class Registration(NamedTuple):
    """How well a patch is registered."""

    rounds: int  # 0: too few points match
    covariance: Float  # (3, 3) of the position
    matched: float  # share of the patch, by closeness
    middle: float  # share of the points next to the centre that are matched
    deviation: float  # of the distances, scan units


@compiled
def register_patch(
    patch: SurfacePatch, surface: Cells, moved: MovedPatch, prior: RegistrationPrior, rules: RegistrationRules
) -> Registration:
    """Move a patch onto a surface. moved: from where it begins; its arrays get what is found."""
    is_free = prior.deformation > 0.0
    count = unknowns(is_free)
    start, turned = moved.position.copy(), np.zeros(3)
    system, side = np.empty((count, count)), np.empty((count, 1))
    matches = no_correspondences(len(patch.local), len(rules.least_scales))
    failed = Registration(0, np.full((3, 3), np.nan), 0.0, 0.0, np.nan)
    rounds, is_last = 0, False
    while True:
        found, reach = find_correspondences(patch, surface, moved, rules.search, matches)
        if found < 3 * RIGID:
            return failed
        weigh(matches, rules.least_scales)
        rounds += 1
        if is_last or rounds > rules.rounds:
            break
        system[:], side[:] = 0.0, 0.0
        add_factors(patch, moved, matches, is_free, system, side)
        _add_prior(prior, moved.position - start, turned, moved.deformation, system, side)
        if not solve_in_place(system, side):
            return failed
        is_last = has_converged(_take_step(side, patch.radius, moved, turned, is_free), surface.spacing)
    # Residuals within one parabola of a bending surface are off for the same cause.
    pieces = max((patch.radius * found / reach) ** 2, 1.0)
    alike = max(found / pieces, 1.0) if rules.bends_alike else 1.0
    covariance = _covariance(information(patch, moved, matches, is_free, alike), prior)
    return _judged(patch, matches, surface.spacing, rounds, covariance)


@compiled
def has_converged(squared: float, spacing: float) -> bool:
    """The stopping rule. squared: of the step, scan units. spacing: of the surface's points."""
    return squared < (_CONVERGED * spacing) ** 2


@compiled
def _add_prior(
    prior: RegistrationPrior, shift: Float, turned: Float, deformation: Float, system: Float, side: Float
) -> None:
    """Add the prior to the normal equations. shift, turned: (3,), how the patch has been moved so far."""
    for k in range(3):
        for m in range(3):
            system[k, m] += prior.position[k, m]
            side[k, 0] -= prior.position[k, m] * shift[m]
        system[3 + k, 3 + k] += 1.0 / prior.rotation**2
        side[3 + k, 0] -= turned[k] / prior.rotation**2
    n = RIGID
    for b in range(MODES):
        if prior.deformation[b] > 0.0:
            system[n, n] += 1.0 / prior.deformation[b] ** 2
            side[n, 0] -= deformation[b] / prior.deformation[b] ** 2
            n += 1


@compiled
def _take_step(
    step: Float, radius: float, moved: MovedPatch, turned: Float, is_free: NDArray[np.bool_]
) -> float:
    """Move a patch by a step (F, 1) of its unknowns; gives the square of how far its rim goes, scan units."""
    squared = 0.0
    for k in range(3):
        moved.position[k] += step[k, 0]
        turned[k] += step[3 + k, 0]
        squared += step[k, 0] ** 2 + (radius * step[3 + k, 0]) ** 2
    _turn_by(moved.rotation, step[3, 0], step[4, 0], step[5, 0])
    n = RIGID
    for b in range(MODES):
        if is_free[b]:
            moved.deformation[b] += step[n, 0]
            squared += (radius * step[n, 0]) ** 2
            n += 1
    return squared


@compiled
def _turn_by(rotation: Float, x: float, y: float, z: float) -> None:
    """Turn a rotation (3, 3) further, by a vector of radians (Rodrigues)."""
    angle = np.sqrt(x * x + y * y + z * z)
    if angle == 0.0:
        return
    x, y, z = x / angle, y / angle, z / angle
    s, c = np.sin(angle), np.cos(angle)
    for k in range(3):
        a0, a1, a2 = rotation[0, k], rotation[1, k], rotation[2, k]
        along = (x * a0 + y * a1 + z * a2) * (1.0 - c)
        rotation[0, k] = a0 * c + (y * a2 - z * a1) * s + x * along
        rotation[1, k] = a1 * c + (z * a0 - x * a2) * s + y * along
        rotation[2, k] = a2 * c + (x * a1 - y * a0) * s + z * along


@compiled
def _covariance(information: Float, prior: RegistrationPrior) -> Float:
    """The covariance (3, 3) of the position, from the information (F, F) of factors and the prior."""
    free = len(information)
    unit = np.empty(free)  # in which priors are about 1
    for k in range(3):
        unit[k], unit[3 + k] = 1.0 / np.sqrt(prior.position[k, k]), prior.rotation
    n = RIGID
    for b in range(MODES):
        if prior.deformation[b] > 0.0:
            unit[n] = prior.deformation[b]
            n += 1
    for p in range(free):
        for q in range(free):
            information[p, q] *= unit[p] * unit[q]
    power, modes = np.linalg.eigh(information)
    known = np.eye(free)
    for k in range(3):
        for m in range(3):
            known[k, m] = prior.position[k, m] * unit[k] * unit[m]
    for p in range(free):
        for q in range(free):
            for m in range(free):
                known[p, q] += modes[p, m] * max(power[m], 0.0) * modes[q, m]
    inverse, covariance = np.linalg.inv(known), np.empty((3, 3))
    for k in range(3):
        for m in range(3):
            covariance[k, m] = inverse[k, m] * unit[k] * unit[m]
    return covariance


@compiled
def _judged(
    patch: SurfacePatch, matches: Correspondences, spacing: float, rounds: int, covariance: Float
) -> Registration:
    """How well a patch is matched, by the weights of its distances."""
    total, matched, middle, middle_matched, squares = 0.0, 0.0, 0.0, 0.0, 0.0
    near = (_MIDDLE * spacing) ** 2
    for i in range(len(patch.local)):
        closeness, weight = patch.closeness[i], matches.weights[i, 0]
        total += closeness
        is_near = patch.local[i, 0] ** 2 + patch.local[i, 1] ** 2 + patch.local[i, 2] ** 2 < near
        middle += is_near
        if matches.is_matched[i]:
            matched += closeness * weight
            squares += closeness * weight * matches.residuals[i, 0] ** 2
            middle_matched += is_near * (weight > _BELONGS)
    return Registration(
        rounds, covariance, matched / total,
        middle_matched / middle if middle > 0.0 else 1.0,
        np.sqrt(squares / matched) if matched > 0.0 else np.inf,
    )  # fmt: skip

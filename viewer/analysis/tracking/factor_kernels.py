"""Factors of registration: what the residuals of a patch say of its motion and deformation.

There are two: distances along normals (point to plane; of both surfaces, halfway: Rusinkiewicz 2019) and
steps of colour (Park, Zhou and Koltun 2017). The F unknowns are the shift of the patch's centre, its turn,
and those modes of deformation that are free. Compiled by numba; see `register_kernels`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...compiled import compiled, inlined
from .correspondence_kernels import Correspondences, MovedPatch, moved_axes
from .patch_kernels import MODES, SurfacePatch, deformation_modes

RIGID = 6  # unknowns: of the shift, and of the turn

Float = NDArray[np.float64]


@compiled
def unknowns(is_free: NDArray[np.bool_]) -> int:
    """The number of unknowns. is_free: (12,), which modes of deformation are."""
    return RIGID + int(is_free.sum())


@inlined
def point_jacobian(
    patch: SurfacePatch, i: int, axes: Float, arms: Float, is_free: NDArray[np.bool_], modes: Float,
    jacobian: Float,
) -> None:  # fmt: skip
    """Fill how a patch's point moves with each unknown, (F, 3).

    axes: (3, 3), by row, of the patch as it is moved. arms: (n, 3), from its centre to the points.
    modes: (12, 3), scratch.
    """
    x, y, z = arms[i, 0], arms[i, 1], arms[i, 2]
    for k in range(3):
        for q in range(3):
            jacobian[k, q] = 1.0 if k == q else 0.0
    jacobian[3, 0], jacobian[3, 1], jacobian[3, 2] = 0.0, -z, y
    jacobian[4, 0], jacobian[4, 1], jacobian[4, 2] = z, 0.0, -x
    jacobian[5, 0], jacobian[5, 1], jacobian[5, 2] = -y, x, 0.0
    if len(jacobian) == RIGID:
        return
    deformation_modes(patch.local[i, 0] / patch.radius, patch.local[i, 1] / patch.radius, modes)
    n = RIGID
    for b in range(MODES):
        if is_free[b]:
            for k in range(3):
                jacobian[n, k] = patch.radius * (
                    modes[b, 0] * axes[0, k] + modes[b, 1] * axes[1, k] + modes[b, 2] * axes[2, k]
                )
            n += 1


class Factor(NamedTuple):
    """A residual of a point, and how it grows with the point's position."""

    weight: float
    residual: float
    there: tuple[float, float, float]  # by the surface
    own: tuple[float, float, float]  # by the patch


@inlined
def factor(patch: SurfacePatch, matches: Correspondences, i: int, term: int) -> Factor:
    """The factor of a point's distance, term 0, or of its step in channel n - 1, term n."""
    weight = patch.closeness[i] * matches.weights[i, 0]
    if term == 0:
        a, b = matches.normals, matches.own_normals
        return Factor(
            weight / matches.scales[0] ** 2, matches.distances[i],
            (a[i, 0], a[i, 1], a[i, 2]), (b[i, 0], b[i, 1], b[i, 2]),
        )  # fmt: skip
    c, d, e = term - 1, matches.gradients, matches.own_gradients
    return Factor(
        weight * matches.weights[i, term] / matches.scales[term] ** 2, matches.color_steps[i, c],
        (d[i, c, 0], d[i, c, 1], d[i, c, 2]), (e[i, c, 0], e[i, c, 1], e[i, c, 2]),
    )  # fmt: skip


@compiled
def add_factors(
    patch: SurfacePatch, moved: MovedPatch, matches: Correspondences, is_free: NDArray[np.bool_],
    system: Float, side: Float,
) -> None:  # fmt: skip
    """Add all factors to the normal equations of Gauss and Newton: system (F, F) and side (F, 1).

    Only the lower half of the system is filled.
    """
    count = len(system)
    axes, modes = np.empty((3, 3)), np.empty((MODES, 3))
    jacobian, along = np.zeros((count, 3)), np.empty(count)
    moved_axes(patch, moved.rotation, axes)
    for i in range(len(patch.local)):
        if not (matches.is_matched[i] and matches.weights[i, 0] > 0.0):
            continue
        point_jacobian(patch, i, axes, matches.arms, is_free, modes, jacobian)
        for term in range(len(matches.scales)):
            weight, residual, there, own = factor(patch, matches, i, term)
            if weight == 0.0:
                continue
            x, y, z = 0.5 * (there[0] + own[0]), 0.5 * (there[1] + own[1]), 0.5 * (there[2] + own[2])
            for p in range(count):
                along[p] = jacobian[p, 0] * x + jacobian[p, 1] * y + jacobian[p, 2] * z
                side[p, 0] -= weight * along[p] * residual
                for q in range(p + 1):
                    system[p, q] += weight * along[p] * along[q]


@compiled
def information(
    patch: SurfacePatch, moved: MovedPatch, matches: Correspondences, is_free: NDArray[np.bool_], alike: float
) -> Float:
    """The information of all factors on the unknowns, (F, F), symmetric.

    Noise of the two surfaces is independent: products of both have none of it. alike: how many distances are
    off for one cause.
    """
    count = unknowns(is_free)
    axes, modes = np.empty((3, 3)), np.empty((MODES, 3))
    found, jacobian = np.zeros((count, count)), np.zeros((count, 3))
    along_there, along_own = np.empty(count), np.empty(count)
    moved_axes(patch, moved.rotation, axes)
    for i in range(len(patch.local)):
        if not (matches.is_matched[i] and matches.weights[i, 0] > 0.0):
            continue
        point_jacobian(patch, i, axes, matches.arms, is_free, modes, jacobian)
        for term in range(len(matches.scales)):
            weight, _, there, own = factor(patch, matches, i, term)
            if weight == 0.0:
                continue
            if term == 0:
                weight /= alike
            for p in range(count):
                along_there[p] = (
                    jacobian[p, 0] * there[0] + jacobian[p, 1] * there[1] + jacobian[p, 2] * there[2]
                )
                along_own[p] = jacobian[p, 0] * own[0] + jacobian[p, 1] * own[1] + jacobian[p, 2] * own[2]
                for q in range(p + 1):
                    found[p, q] += (
                        0.5 * weight * (along_there[p] * along_own[q] + along_own[p] * along_there[q])
                    )
    for p in range(count):
        for q in range(p):
            found[q, p] = found[p, q]
    return found

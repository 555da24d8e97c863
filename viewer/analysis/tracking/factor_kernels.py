"""Factors of registration: what the residuals of a patch say of its motion and deformation.

There are two: distances along normals (point to plane; of both surfaces, halfway: Rusinkiewicz 2019) and
steps of colour (Park, Zhou and Koltun 2017). The F unknowns are the shift of the patch's centre, its turn,
and those modes of deformation that are free. Compiled by numba; see `register_kernels`.
"""

from __future__ import annotations

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
def rigid_jacobian(x: float, y: float, z: float, jacobian: Float) -> None:
    """Fill how a point, (x, y, z) from the centre, moves with shift and turn: the first rows of (F, 3)."""
    for k in range(3):
        for q in range(3):
            jacobian[k, q] = 1.0 if k == q else 0.0
    jacobian[3, 0], jacobian[3, 1], jacobian[3, 2] = 0.0, -z, y
    jacobian[4, 0], jacobian[4, 1], jacobian[4, 2] = z, 0.0, -x
    jacobian[5, 0], jacobian[5, 1], jacobian[5, 2] = -y, x, 0.0


@inlined
def modes_jacobian(
    u: float, v: float, radius: float, axes: Float, is_free: NDArray[np.bool_], modes: Float, jacobian: Float
) -> None:
    """Fill how a point of a patch, at (u, v) radii from its centre, moves with each mode: the other rows.

    axes: (3, 3), by row, of the patch as it is moved. modes: (12, 3), scratch.
    """
    deformation_modes(u, v, modes)
    n = RIGID
    for b in range(MODES):
        if is_free[b]:
            for k in range(3):
                jacobian[n, k] = radius * (
                    modes[b, 0] * axes[0, k] + modes[b, 1] * axes[1, k] + modes[b, 2] * axes[2, k]
                )
            n += 1


@inlined
def factor_weight(closeness: float, weights: Float, i: int, term: int, scale: float) -> float:
    """The weight of a residual; a colour counts as far as its distance does. weights: (n, 1 + C)."""
    weight = closeness * weights[i, 0]
    return (weight if term == 0 else weight * weights[i, term]) / scale**2


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
    is_matched, arms, residuals, gradients, own_gradients, scales, weights = matches
    local, radius, closeness = patch.local, patch.radius, patch.closeness
    for i in range(len(local)):
        if not (is_matched[i] and weights[i, 0] > 0.0):
            continue
        u, v = local[i, 0] / radius, local[i, 1] / radius
        rigid_jacobian(arms[i, 0], arms[i, 1], arms[i, 2], jacobian)
        if count > RIGID:
            modes_jacobian(u, v, radius, axes, is_free, modes, jacobian)
        for term in range(len(scales)):
            weight = factor_weight(closeness[i], weights, i, term, scales[term])
            if weight == 0.0:
                continue
            ax, ay, az = gradients[i, term, 0], gradients[i, term, 1], gradients[i, term, 2]
            bx, by, bz = own_gradients[i, term, 0], own_gradients[i, term, 1], own_gradients[i, term, 2]
            x, y, z, residual = 0.5 * (ax + bx), 0.5 * (ay + by), 0.5 * (az + bz), residuals[i, term]
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
    is_matched, arms, _, gradients, own_gradients, scales, weights = matches
    local, radius, closeness = patch.local, patch.radius, patch.closeness
    for i in range(len(local)):
        if not (is_matched[i] and weights[i, 0] > 0.0):
            continue
        u, v = local[i, 0] / radius, local[i, 1] / radius
        rigid_jacobian(arms[i, 0], arms[i, 1], arms[i, 2], jacobian)
        if count > RIGID:
            modes_jacobian(u, v, radius, axes, is_free, modes, jacobian)
        for term in range(len(scales)):
            weight = factor_weight(closeness[i], weights, i, term, scales[term])
            if weight == 0.0:
                continue
            if term == 0:
                weight /= alike
            ax, ay, az = gradients[i, term, 0], gradients[i, term, 1], gradients[i, term, 2]
            bx, by, bz = own_gradients[i, term, 0], own_gradients[i, term, 1], own_gradients[i, term, 2]
            for p in range(count):
                along_there[p] = jacobian[p, 0] * ax + jacobian[p, 1] * ay + jacobian[p, 2] * az
                along_own[p] = jacobian[p, 0] * bx + jacobian[p, 1] * by + jacobian[p, 2] * bz
                for q in range(p + 1):
                    found[p, q] += (
                        0.5 * weight * (along_there[p] * along_own[q] + along_own[p] * along_there[q])
                    )
    for p in range(count):
        for q in range(p):
            found[q, p] = found[p, q]
    return found

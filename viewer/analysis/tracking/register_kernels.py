"""Loops of the registration of a patch of one moment to the surface of another, compiled by numba; see
`register`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...compiled import compiled
from .surface_kernels import Cells, fit_at, nearest_within, solve_in_place

RIGID = 6  # unknowns: of the place, and of the turn
BENT = 12  # of how a patch deforms, see `_bends`
_TUKEY = 4.685  # deviations at which the bisquare weight is zero
_HOLE = (
    1.6  # spacings to the nearest point beyond which there is none: 3 of 10,000 places are, of random points
)
_FACING = 0.35  # cosine of the angle between normals that still may match
_CHANNELS = 3
_MIDDLE = 2.5  # spacings from the place: what is next to it
_BELONGS = 0.1  # weight from which on a point lies on the surface

Float = NDArray[np.float64]


class SurfacePatch(NamedTuple):
    """The surface around a place of one moment.

    center: (3,) relative to the moment's origin. axes: (3, 3), rows: two tangents and the normal there.
    local: (n, 3), its points along the axes. normals: (n, 3) and gradients of colour: (n, C, 3), along the
    axes. colors: (n, C). closeness: (n,) weights, 1 in the middle, 0 at the radius. radius: scan units.
    noise: how far points are off their parabolas, root mean square, scan units.
    """

    center: Float
    axes: Float
    local: Float
    normals: Float
    colors: Float
    gradients: Float
    closeness: Float
    radius: float
    noise: float


@compiled
def _dot(a: Float, b: Float) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@compiled
def cut_patch(
    held: Cells, place: Float, axes: Float, radius: float, rows: NDArray[np.int32], count: int
) -> SurfacePatch:
    """The patch of the surface at some rows, of which `count` count, around a place. axes: (3, 3), of the
    place."""
    channels, is_signed = held.colors.shape[1], len(held.normals) > 0
    local, normals = np.empty((count, 3)), np.empty((count, 3))
    colors, gradients = np.empty((count, channels)), np.empty((count, channels, 3))
    closeness = np.empty(count)
    kept, squares = 0, 0.0
    at, normal, slope = np.empty(3), np.empty(3), np.empty(3)
    for i in range(count):
        row = rows[i]
        if not fit_at(held, row):
            continue
        f, p = held.frames[row], held.parabolas[row]
        squared, facing = 0.0, 0.0
        for k in range(3):
            at[k] = held.points[row, k] + p[0, 0] * f[2, k] - place[k]
            normal[k] = f[2, k] - p[0, 1] * f[0, k] - p[0, 2] * f[1, k]
            squared += at[k] * at[k]
            facing += normal[k] * axes[2, k]
        length = np.sqrt(normal[0] ** 2 + normal[1] ** 2 + normal[2] ** 2)
        if squared >= radius * radius:
            continue
        if not is_signed and facing < 0.0:
            length, facing = -length, -facing
        if facing < -0.2 * abs(length):  # the far side of something thin
            continue
        for k in range(3):
            local[kept, k] = _dot(axes[k], at)
            normals[kept, k] = _dot(axes[k], normal) / length
        for c in range(channels):
            colors[kept, c] = p[1 + c, 0]
            for k in range(3):
                slope[k] = p[1 + c, 1] * f[0, k] + p[1 + c, 2] * f[1, k]
            for k in range(3):
                gradients[kept, c, k] = _dot(axes[k], slope)
        closeness[kept] = (1.0 - squared / (radius * radius)) ** 2
        squares += p[0, 0] ** 2
        kept += 1
    return SurfacePatch(
        place.copy(), axes.copy(), local[:kept], normals[:kept], colors[:kept], gradients[:kept],
        closeness[:kept], radius, np.sqrt(squares / max(kept, 1)),
    )  # fmt: skip


@compiled
def _bends(u: float, v: float, bends: Float) -> None:
    """The ways to deform: what each does at a place of a patch of radius 1, (12, 3): strains along the
    surface, bending across it, strains that change over it."""
    bends[:] = 0.0
    bends[0, 0], bends[1, 1], bends[2, 0], bends[2, 1] = u, v, v, u
    bends[3, 2], bends[4, 2], bends[5, 2] = u * u, u * v, v * v
    bends[6, 0], bends[7, 0], bends[8, 0] = u * u, u * v, v * v
    bends[9, 1], bends[10, 1], bends[11, 1] = u * u, u * v, v * v


@compiled
def bent_by(patch: SurfacePatch, bent: Float) -> Float:
    """The points of a patch along its axes, deformed by bent (12,): (n, 3)."""
    local, bends = patch.local.copy(), np.empty((BENT, 3))
    for i in range(len(local)):
        _bends(patch.local[i, 0] / patch.radius, patch.local[i, 1] / patch.radius, bends)
        for b in range(BENT):
            for k in range(3):
                local[i, k] += patch.radius * bent[b] * bends[b, k]
    return local


@compiled
def _median(values: Float, count: int) -> float:
    return np.median(values[:count]) if count else 0.0


@compiled
def register_patch(
    patch: SurfacePatch,
    held: Cells,
    place: Float,
    turn: Float,
    bent: Float,
    bent_prior: Float,
    place_prior: Float,
    turn_prior: float,
    search: float,
    rounds: int,
    use_color: bool,
    bends_alike: bool,
    least_scales: Float,
    covariance: Float,
    told: Float,
) -> int:
    """Move a patch onto a surface: Gauss and Newton's steps on the distances along the normals (of both
    surfaces, halfway: Rusinkiewicz 2019) and the differences of colour (Park, Zhou and Koltun 2017), with
    bisquare weights of which the scale is found from the residuals, and with what is likely of deformation
    as a prior.

    place: (3,) where the patch's centre is taken to be; turn: (3, 3) and bent: (12,), how it is turned and
    deformed; all three get what is found. bent_prior: (12,) standard deviations, 0 where it stays as it is.
    place_prior: (3, 3), the inverse of the covariance of the place from where it begins; turn_prior: the
    standard deviation of the turn, radians. search: how far a point's counterpart may be. bends_alike:
    whether distances are off by how the surface bends more than by noise. least_scales: (1 + C,) deviations
    that residuals have at least. covariance: (3, 3) gets that of the place. told: (3,)
    gets the share of the patch that is matched, that of its middle, and the deviation of the distances.
    Gives the rounds, 0 where too few points match.
    """
    count, channels = len(patch.local), patch.colors.shape[1] if use_color else 0
    is_signed = len(held.normals) > 0
    free = RIGID
    for b in range(BENT):
        if bent_prior[b] > 0.0:
            free += 1
    start, turned = place.copy(), np.zeros(3)
    bends = np.empty((BENT, 3))
    system, side = np.zeros((free, free)), np.zeros((free, 1))
    cross = np.zeros((free, free))
    jacobian = np.zeros((free, 3))
    along, along_one, along_other = np.empty(free), np.empty(free), np.empty(free)
    distances, weights = np.empty(count), np.empty(count)
    off = np.empty((count, _CHANNELS))
    color_weights = np.empty((count, _CHANNELS))
    normals, sources = np.empty((count, 3)), np.empty((count, 3))
    slopes, own_slopes = np.empty((count, _CHANNELS, 3)), np.empty((count, _CHANNELS, 3))
    arms = np.empty((count, 3))
    matched = np.empty(count, np.int8)
    scales = least_scales.copy()
    scratch = np.empty(count)
    own = np.empty(3)
    shift = np.empty(_CHANNELS)
    axes = np.empty((3, 3))
    settled = False
    for told_round in range(rounds + 1):
        is_last = settled or told_round == rounds
        for p in range(3):  # columns: where the patch's axes point now
            for q in range(3):
                axes[q, p] = (
                    turn[p, 0] * patch.axes[q, 0]
                    + turn[p, 1] * patch.axes[q, 1]
                    + turn[p, 2] * patch.axes[q, 2]
                )
        found, reach = 0, 0.0
        for i in range(count):
            matched[i] = 0
            lu, lv, lw = patch.local[i, 0], patch.local[i, 1], patch.local[i, 2]
            if free > RIGID:
                u, v = lu / patch.radius, lv / patch.radius
                _bends(u, v, bends)
                for b in range(BENT):
                    if bent[b] != 0.0:
                        lu += patch.radius * bent[b] * bends[b, 0]
                        lv += patch.radius * bent[b] * bends[b, 1]
                        lw += patch.radius * bent[b] * bends[b, 2]
            for k in range(3):
                arms[i, k] = lu * axes[0, k] + lv * axes[1, k] + lw * axes[2, k]
            x, y, z = place[0] + arms[i, 0], place[1] + arms[i, 1], place[2] + arms[i, 2]
            row = nearest_within(held, x, y, z, search)
            if row < 0 or not fit_at(held, row):
                continue
            f, p = held.frames[row], held.parabolas[row]
            x, y, z = x - held.points[row, 0], y - held.points[row, 1], z - held.points[row, 2]
            u = f[0, 0] * x + f[0, 1] * y + f[0, 2] * z
            v = f[1, 0] * x + f[1, 1] * y + f[1, 2] * z
            w = f[2, 0] * x + f[2, 1] * y + f[2, 2] * z
            spacing = held.reaches[row] * 0.396  # of 20 points in a circle
            if u * u + v * v > (_HOLE * spacing) ** 2:
                matched[i] = -1
                continue
            hu = p[0, 1] + 2.0 * p[0, 3] * u + p[0, 4] * v
            hv = p[0, 2] + p[0, 4] * u + 2.0 * p[0, 5] * v
            height = p[0, 0] + (p[0, 1] + p[0, 3] * u + p[0, 4] * v) * u + (p[0, 2] + p[0, 5] * v) * v
            slant = np.sqrt(1.0 + hu * hu + hv * hv)
            facing = 0.0
            for k in range(3):
                own[k] = (
                    patch.normals[i, 0] * axes[0, k]
                    + patch.normals[i, 1] * axes[1, k]
                    + patch.normals[i, 2] * axes[2, k]
                )
                normals[i, k] = (f[2, k] - hu * f[0, k] - hv * f[1, k]) / slant
                facing += own[k] * normals[i, k]
            sign = 1.0
            if not is_signed and facing < 0.0:
                sign, facing = -1.0, -facing
            if facing < _FACING:
                continue
            for k in range(3):
                normals[i, k] *= sign
                sources[i, k] = own[k]
            distances[i] = sign * (w - height) / slant
            for c in range(channels):
                q = p[1 + c]
                value = q[0] + (q[1] + q[3] * u + q[4] * v) * u + (q[2] + q[5] * v) * v
                off[i, c] = value - patch.colors[i, c]
                cu, cv = q[1] + 2.0 * q[3] * u + q[4] * v, q[2] + q[4] * u + 2.0 * q[5] * v
                for k in range(3):
                    slopes[i, c, k] = cu * f[0, k] + cv * f[1, k]
                    own_slopes[i, c, k] = _dot(patch.gradients[i, c], axes[:, k])
            matched[i] = 1
            scratch[found] = abs(distances[i])
            found += 1
            reach += held.reaches[row]
        if found < 3 * RIGID:
            return 0
        scales[0] = max(1.4826 * _median(scratch, found), least_scales[0])
        for c in range(channels):
            n = 0
            for i in range(count):
                if matched[i] > 0:
                    scratch[n] = off[i, c]
                    n += 1
            shift[c] = _median(scratch, n)
            for i in range(n):
                scratch[i] = abs(scratch[i] - shift[c])
            scales[1 + c] = max(1.4826 * _median(scratch, n), least_scales[1 + c])

        # Residuals within one parabola of a bending surface are off for the same cause.
        pieces = max((patch.radius * found / reach) ** 2, 1.0)
        alike = max(found / pieces, 1.0) if bends_alike else 1.0
        system[:] = 0.0
        side[:] = 0.0
        cross[:] = 0.0
        for i in range(count):
            weights[i] = 0.0
            if matched[i] <= 0:
                continue
            share = distances[i] / (_TUKEY * scales[0])
            if abs(share) >= 1.0:
                continue
            weights[i] = (1.0 - share * share) ** 2
            for c in range(channels):
                share = (off[i, c] - shift[c]) / (_TUKEY * scales[1 + c])
                color_weights[i, c] = (1.0 - share * share) ** 2 if abs(share) < 1.0 else 0.0
            rx, ry, rz = arms[i, 0], arms[i, 1], arms[i, 2]
            # How the point moves with each unknown, (free, 3).
            for k in range(3):
                for q in range(3):
                    jacobian[k, q] = 1.0 if k == q else 0.0
            jacobian[3, 0], jacobian[3, 1], jacobian[3, 2] = 0.0, -rz, ry
            jacobian[4, 0], jacobian[4, 1], jacobian[4, 2] = rz, 0.0, -rx
            jacobian[5, 0], jacobian[5, 1], jacobian[5, 2] = -ry, rx, 0.0
            if free > RIGID:
                _bends(patch.local[i, 0] / patch.radius, patch.local[i, 1] / patch.radius, bends)
                n = RIGID
                for b in range(BENT):
                    if bent_prior[b] > 0.0:
                        for k in range(3):
                            jacobian[n, k] = patch.radius * (
                                bends[b, 0] * axes[0, k] + bends[b, 1] * axes[1, k] + bends[b, 2] * axes[2, k]
                            )
                        n += 1
            for term in range(1 + channels):
                if term == 0:
                    weight = patch.closeness[i] * weights[i] / scales[0] ** 2
                    if is_last:
                        weight /= alike
                    ax, ay, az = normals[i, 0], normals[i, 1], normals[i, 2]
                    bx, by, bz = sources[i, 0], sources[i, 1], sources[i, 2]
                    residual = distances[i]
                else:
                    c = term - 1
                    weight = patch.closeness[i] * weights[i] * color_weights[i, c] / scales[term] ** 2
                    ax, ay, az = slopes[i, c, 0], slopes[i, c, 1], slopes[i, c, 2]
                    bx, by, bz = own_slopes[i, c, 0], own_slopes[i, c, 1], own_slopes[i, c, 2]
                    residual = off[i, c] - shift[c]
                if weight == 0.0:
                    continue
                if is_last:
                    # Noise of the two surfaces is independent: products of both have none of it.
                    for p in range(free):
                        along_one[p] = jacobian[p, 0] * ax + jacobian[p, 1] * ay + jacobian[p, 2] * az
                        along_other[p] = jacobian[p, 0] * bx + jacobian[p, 1] * by + jacobian[p, 2] * bz
                        for q in range(p + 1):
                            cross[p, q] += (
                                0.5 * weight * (along_one[p] * along_other[q] + along_other[p] * along_one[q])
                            )
                    continue
                mx, my, mz = 0.5 * (ax + bx), 0.5 * (ay + by), 0.5 * (az + bz)
                for p in range(free):
                    along[p] = jacobian[p, 0] * mx + jacobian[p, 1] * my + jacobian[p, 2] * mz
                    side[p, 0] -= weight * along[p] * residual
                    for q in range(p + 1):
                        system[p, q] += weight * along[p] * along[q]
        if is_last:
            break
        for k in range(3):
            for m in range(3):
                system[k, m] += place_prior[k, m]
                side[k, 0] -= place_prior[k, m] * (place[m] - start[m])
            system[3 + k, 3 + k] += 1.0 / turn_prior**2
            side[3 + k, 0] -= turned[k] / turn_prior**2
        n = RIGID
        for b in range(BENT):
            if bent_prior[b] > 0.0:
                system[n, n] += 1.0 / bent_prior[b] ** 2
                side[n, 0] -= bent[b] / bent_prior[b] ** 2
                n += 1
        if not solve_in_place(system, side):
            return 0
        step = 0.0
        for k in range(3):
            place[k] += side[k, 0]
            turned[k] += side[3 + k, 0]
            step += side[k, 0] ** 2 + (patch.radius * side[3 + k, 0]) ** 2
        _turn_by(turn, side[3, 0], side[4, 0], side[5, 0])
        n = RIGID
        for b in range(BENT):
            if bent_prior[b] > 0.0:
                bent[b] += side[n, 0]
                step += (patch.radius * side[n, 0]) ** 2
                n += 1
        settled = step < (0.01 * held.spacing) ** 2
    _tell(
        patch,
        cross,
        bent_prior,
        place_prior,
        turn_prior,
        matched,
        weights,
        distances,
        held.spacing,
        covariance,
        told,
    )
    return told_round + 1


@compiled
def _turn_by(turn: Float, x: float, y: float, z: float) -> None:
    """Turn a rotation (3, 3) further, by a vector of radians (Rodrigues)."""
    angle = np.sqrt(x * x + y * y + z * z)
    if angle == 0.0:
        return
    x, y, z = x / angle, y / angle, z / angle
    s, c = np.sin(angle), np.cos(angle)
    for k in range(3):
        a0, a1, a2 = turn[0, k], turn[1, k], turn[2, k]
        along = (x * a0 + y * a1 + z * a2) * (1.0 - c)
        turn[0, k] = a0 * c + (y * a2 - z * a1) * s + x * along
        turn[1, k] = a1 * c + (z * a0 - x * a2) * s + y * along
        turn[2, k] = a2 * c + (x * a1 - y * a0) * s + z * along


@compiled
def _tell(
    patch: SurfacePatch,
    cross: Float,
    bent_prior: Float,
    place_prior: Float,
    turn_prior: float,
    matched: NDArray[np.int8],
    weights: Float,
    distances: Float,
    spacing: float,
    covariance: Float,
    told: Float,
) -> None:
    """The covariance of the place, and how well a patch is matched; see `register_patch`."""
    free = len(cross)
    for p in range(free):
        for q in range(p):
            cross[q, p] = cross[p, q]
    unit = np.empty(free)  # in which priors are about 1
    for k in range(3):
        unit[k], unit[3 + k] = 1.0 / np.sqrt(place_prior[k, k]), turn_prior
    n = RIGID
    for b in range(BENT):
        if bent_prior[b] > 0.0:
            unit[n] = bent_prior[b]
            n += 1
    for p in range(free):
        for q in range(free):
            cross[p, q] *= unit[p] * unit[q]
    power, modes = np.linalg.eigh(cross)
    known = np.eye(free)
    for k in range(3):
        for m in range(3):
            known[k, m] = place_prior[k, m] * unit[k] * unit[m]
    for p in range(free):
        for q in range(free):
            for m in range(free):
                known[p, q] += modes[p, m] * max(power[m], 0.0) * modes[q, m]
    inverse = np.linalg.inv(known)
    for k in range(3):
        for m in range(3):
            covariance[k, m] = inverse[k, m] * unit[k] * unit[m]
    total, kept, middle, middle_kept, squares = 0.0, 0.0, 0.0, 0.0, 0.0
    near = (_MIDDLE * spacing) ** 2
    for i in range(len(weights)):
        closeness = patch.closeness[i]
        total += closeness
        is_near = patch.local[i, 0] ** 2 + patch.local[i, 1] ** 2 + patch.local[i, 2] ** 2 < near
        middle += is_near
        if matched[i] > 0:
            kept += closeness * weights[i]
            squares += closeness * weights[i] * distances[i] ** 2
            middle_kept += is_near * (weights[i] > _BELONGS)
    told[0] = kept / total
    told[1] = middle_kept / middle if middle > 0.0 else 1.0
    told[2] = np.sqrt(squares / kept) if kept > 0.0 else np.inf

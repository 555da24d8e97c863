"""Signed distances from the surface that points show, compiled by numba; see `reference`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...compiled import compiled, inlined
from ..tracking.surface_kernels import (
    OWN_SPACING,
    Cells,
    fit_at,
    in_frame,
    nearest_within,
    parabola_height,
    parabola_slopes,
    rows_within,
)

Float = NDArray[np.float64]

_HOLE = 1.6  # own spacings from the nearest point to the foot, beyond which there is a hole
_AROUND = 3.0  # own spacings in which a point must lie beyond the foot, or the surface ends before it
_AHEAD = 0.7  # cosine of the angle to the foot, in which that point must lie
_MOST = 64  # points that are looked at for that
_AT_POINT = 1e-3  # own spacings: so near to a point, the surface is there
_EXPLAINED = 2.0  # variances of noise that are no misfit yet: about 14 degrees of freedom tell it
_FITS = 0.004  # spacings: a parabola that points leave by less fits, whatever the noise is
_STEEP = 0.3  # least cosine between the normal of a point and of the plane around it
_STEPS = 6  # of Newton's method
_FOCAL = 0.05  # of the determinant without curvature: nearer to the centre of curvature, no foot is sure


@compiled
def fit_range(surface: Cells, noise: float, first: int, last: int) -> None:
    """Fit the surface at rows first to last - 1, so that threads only read it afterwards.

    Where points leave a parabola by more than noise explains, such as at creases, the plane through the point
    itself takes its place. noise: standard deviation of the points off the surface, scan units.
    """
    rows, squared = np.empty(_MOST, np.int32), np.empty(_MOST)
    variance = max(noise, _FITS * surface.spacing) ** 2
    for row in range(first, last):
        if not fit_at(surface, row):
            continue
        f, n, parabola = surface.frames[row], surface.normals[row], surface.parabolas[row, 0]
        points = surface.points[row]
        count = rows_within(surface, points[0], points[1], points[2], surface.reaches[row], rows, squared)
        left = 0.0
        for i in range(count):
            u, v, w = in_frame(f, surface.points[rows[i]], points)
            left += (w - parabola_height(parabola, u, v)) ** 2
        ahead = f[2, 0] * n[0] + f[2, 1] * n[1] + f[2, 2] * n[2]
        excess = left / count - _EXPLAINED * variance
        if not excess > 0.0 or ahead < _STEEP:
            continue
        share = excess / (excess + variance)
        for k in range(6):
            parabola[k] *= 1.0 - share
        parabola[1] -= share * (f[0, 0] * n[0] + f[0, 1] * n[1] + f[0, 2] * n[2]) / ahead
        parabola[2] -= share * (f[1, 0] * n[0] + f[1, 1] * n[1] + f[1, 2] * n[2]) / ahead


@compiled
def signed_distances(surface: Cells, positions: Float, reach: float, found: Float) -> None:
    """Fill `found` (n,) with the distances of positions (n, 3) from the surface, which is fitted already.

    Each is the distance from the parabola around the nearest point, positive on the side of its normal. NaN
    where no point is within reach, over holes, and beyond borders.
    """
    foot = np.empty(2)
    rows, squared = np.empty(_MOST, np.int32), np.empty(_MOST)
    for i in range(len(positions)):
        found[i] = np.nan
        row = nearest_within(surface, positions[i, 0], positions[i, 1], positions[i, 2], reach)
        if row < 0 or not fit_at(surface, row):
            continue
        u, v, w = in_frame(surface.frames[row], positions[i], surface.points[row])
        if not _foot(surface.parabolas[row, 0], u, v, w, foot):
            continue
        spacing = surface.reaches[row] * OWN_SPACING
        aside = np.sqrt(foot[0] * foot[0] + foot[1] * foot[1])
        if aside > _HOLE * spacing:
            continue
        if aside > _AT_POINT * spacing and not _goes_on(surface, row, foot, aside, spacing, rows, squared):
            continue
        up = w - parabola_height(surface.parabolas[row, 0], foot[0], foot[1])
        du, dv = u - foot[0], v - foot[1]
        away = np.sqrt(du * du + dv * dv + up * up)
        if away <= reach:
            found[i] = away if up >= 0.0 else -away


@inlined
def _foot(parabola: NDArray[np.float32], u: float, v: float, w: float, foot: Float) -> bool:
    """Whether the place of a parabola that is nearest to (u, v, w) is found, by Newton's method; fills it in,
    (2,)."""
    a, b = u, v
    fuu, fuv, fvv = 2.0 * parabola[3], float(parabola[4]), 2.0 * parabola[5]
    for _ in range(_STEPS):
        over = parabola_height(parabola, a, b) - w
        fu, fv = parabola_slopes(parabola, a, b)
        gu, gv = a - u + over * fu, b - v + over * fv
        huu, huv, hvv = 1.0 + fu * fu + over * fuu, fu * fv + over * fuv, 1.0 + fv * fv + over * fvv
        size = huu * hvv - huv * huv
        if size < _FOCAL or huu + hvv <= 0.0:
            return False
        a -= (hvv * gu - huv * gv) / size
        b -= (huu * gv - huv * gu) / size
    foot[0], foot[1] = a, b
    return True


@inlined
def _goes_on(
    surface: Cells,
    row: int,
    foot: Float,
    aside: float,
    spacing: float,
    rows: NDArray[np.int32],
    squared: Float,
) -> bool:
    """Whether some point around lies as far from a point as the foot does, in the direction of the foot."""
    points = surface.points
    px, py, pz = points[row, 0], points[row, 1], points[row, 2]
    count = rows_within(surface, px, py, pz, _AROUND * spacing, rows, squared)
    if count == _MOST:  # denser than around other points
        return True
    for n in range(count):
        u, v, _ = in_frame(surface.frames[row], points[rows[n]], points[row])
        ahead = u * foot[0] + v * foot[1]
        if ahead >= aside * aside and ahead >= _AHEAD * aside * np.sqrt(u * u + v * v):
            return True
    return False

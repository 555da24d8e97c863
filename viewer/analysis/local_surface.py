"""A surface on the ray through a pixel, from the points of the cloud around: where it is, how it leans, how
sure that is.

Points on a surface say more together than the nearest of them alone. A robust paraboloid tells which of them
belong to one surface (loess: Cleveland 1979). Through these goes the surface that bends least beside a
paraboloid (a thin plate, Duchon 1977): through the points where they are exact, and between them where they
are noisy. What it leaves open is the variance of its prediction: universal kriging (Matheron 1969; Wahba 1983
shows that such intervals hold their coverage over a surface). Each ratio of noise to bending counts as much
as the points make it likely (restricted likelihood), since few points do not tell it well.
"""

from __future__ import annotations

from enum import Enum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..view import View

MOST = 24  # points that give the surface: some three rings around the middle
LEAST = 8  # two more than a paraboloid has unknowns
_SURE = 12  # from so many points on, a paraboloid tells which belong together; a plane of fewer
_BENT = 14  # from so many points on, the surface bends beside a paraboloid; beside a plane of fewer
_ROUNDS = 4  # of looking for the points nearest to the position that was found
_WINDOW = 1.5, 4.0  # spacings and deviations to each side of a surface in which its points are looked for
_BEYOND = 3.0  # times as far as it is, what lies beyond that
_DRIFT = 2.0, 4.0  # spacings and deviations from the start to the surface, at most
_REWEIGHTED = 2  # times
_CUT = 6.0  # median absolute residuals beyond which a point does not belong (Cleveland 1979)
_NORMAL = 1.4826  # standard deviation of a normal distribution, in median absolute residuals
# Points that are looked at, and the deviation across, in distances to the farthest of them, up to which they
# are a surface. More are looked at where they are not. Of points that fill space, so many have 0.19, 0.33 and
# 0.45 or more (99 %). A surface with noise of 0.6 spacings has 0.29, 0.23 and 0.16 (median).
_THICKEST = {MOST: 0.18, 2 * MOST: 0.3, 4 * MOST: 0.4}
_NOISES = (0.0, *(10.0 ** (n / 2) for n in range(-6, 5)))  # variances that are tried, of noise to bending
_EXACT = 1e-9  # of the bending, added where there is no noise: so that rounding does not count
_ROUND = 12  # nearest points that lie all round a place in the surface (99.4 % of cases by chance)
_RIDGE = 1e-13  # of the trace of normal equations, that is added to their diagonal
_CLOSENESS = 1e-9  # weight of the farthest point
_ASIDE = 0.5  # pixels to each side, between which the slope is taken
_SIDES = _ASIDE * np.array([[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]])
_TURNS = np.linspace(0, 2 * np.pi, 48, endpoint=False)
_DIRECTIONS = np.stack([np.cos(_TURNS), np.sin(_TURNS)])  # all round, (2, 48)

Float = NDArray[np.float64]


class Column(NamedTuple):
    """The points of a cloud round the ray through a pixel.

    view: of the picture. ids: (n,) indices in the file. positions: (n, 3), relative to the view's origin.
    offsets: (n, 2), pixels to the right and down from the pixel's centre. depths: (n,), in terms of the view.
    away: (n,), distances from the ray, scan units. reach: all points of the cloud that are so near to the
    ray are there, scan units. spacing: the usual distance between neighbours.
    """

    view: View
    ids: NDArray[np.intp]
    positions: Float
    offsets: Float
    depths: Float
    away: Float
    reach: float
    spacing: float


class LocalSurface(NamedTuple):
    """The surface on the ray through a pixel, as points tell it.

    depth: there, scan units. slope: (2,) change of depth per pixel to the right and down. deviation: standard
    deviation of `depth`, scan units. used: (n,) numbers of the points that gave it, the nearest first.
    spacing: distance between the points around it, scan units. doubt: the chance that another surface is seen
    there, 0 to 1, such as where this one may end before the pixel.
    """

    depth: float
    slope: Float
    deviation: float
    used: NDArray[np.intp]
    spacing: float
    doubt: float = 0.0

    def lean(self, view: View) -> float:
        """How much longer the surface is than it looks, 1 / cosine of its angle to the picture."""
        return _lean(view, self.depth, self.slope)


class Unclear(Enum):
    """Why points tell no surface: they are few; they fill space; they tell one elsewhere; the column is too
    narrow to hold those that would tell it."""

    FEW = "few"
    AWAY = "away"
    THICK = "thick"
    NARROW = "narrow"


class _Around(NamedTuple):
    """Points around the ray that may form a surface: their numbers, the nearest first; which belong; depth
    and slope of their paraboloid on the ray; deviation of the points across it, scan units; its mean
    curvature times two, 1 / scan units; how far the points reach, scan units."""

    near: NDArray[np.intp]
    belongs: NDArray[np.bool_]
    depth: float
    slope: Float
    noise: float
    curvature: float
    reach: float


def local_surface(column: Column, start: float) -> LocalSurface | Unclear:
    """The surface of the points that are nearest to the ray at a depth.

    The depth that is found may lie beside the start: the points are looked for again around it.
    """
    around: _Around | Unclear = Unclear.FEW
    for count, thickest in _THICKEST.items():
        if count == MOST or len(column.ids) > count or np.isfinite(column.reach):
            around = _around(column, start, count, thickest)
        if around is not Unclear.THICK:
            break
    if isinstance(around, Unclear):
        return around
    used = around.near[around.belongs][:MOST]
    found = _plate(column, around, used)
    if found is None:
        return Unclear.FEW
    # Noise along the normals moves points of a bent surface apart on one side and together on the other, so
    # that the mean of them lies to that side. Which way noise goes is not known.
    lean = found.lean(column.view)
    aside = around.noise**2 * around.curvature * lean
    return found._replace(deviation=float(np.hypot(found.deviation, aside)))


def _around(column: Column, start: float, count: int, thickest: float) -> _Around | Unclear:
    """The points that are nearest to the ray along their surface, by several rounds. start: where that is
    looked for at first. thickest: how noisy they may be, in terms of how far they reach."""
    view, depth, slope, noise, spacing = column.view, start, np.zeros(2), 0.0, column.spacing
    for _ in range(_ROUNDS):
        away = _distances(column, depth, slope, max(_WINDOW[0] * spacing, _WINDOW[1] * noise))
        near = _least(away, count + 1)
        if len(near) <= LEAST and np.isinf(column.reach):
            return Unclear.FEW
        reach = max(float(away[near].max(initial=0.0)), np.finfo(float).tiny)
        if reach > column.reach or (len(near) <= count and np.isfinite(column.reach)):
            return Unclear.NARROW
        near = near[:count]
        closeness = (1 - np.minimum(away[near] / reach, 1) ** 3) ** 3 + _CLOSENESS  # tricube
        factors, off, usual = _paraboloid(column.offsets[near], column.depths[near] - depth, closeness)
        slope, depth = factors[1:3], depth + float(factors[0])
        if view.perspective and depth <= 0:
            return Unclear.FEW
        lean = _lean(view, depth, slope)
        noise, spacing = _NORMAL * usual / lean, reach * float(np.sqrt(np.pi / len(near)))
    if abs(depth - start) > (_DRIFT[0] * spacing + _DRIFT[1] * noise) * lean:
        return Unclear.AWAY
    belongs = (off <= _CUT * usual) | (usual <= 0)
    if np.count_nonzero(belongs) < LEAST:
        return Unclear.FEW
    if noise > thickest * reach:
        return Unclear.THICK
    bend = 2 * float(factors[3] + factors[5]) if len(factors) > 3 else 0.0
    curvature = bend / (float(view.footprint(depth)) ** 2 * lean**3)
    return _Around(near, belongs, depth, slope, noise, curvature, reach)


def _distances(column: Column, depth: float, slope: Float, window: float) -> Float:
    """How far points are from a position on the ray, (n,): along the surface, as what lies across it within a
    window may be noise; that beyond the window counts more."""
    footprint = float(column.view.footprint(depth))
    deeper = column.depths - depth
    across = (deeper - column.offsets @ slope) / _lean(column.view, depth, slope)
    squared = (column.offsets**2).sum(axis=1) * footprint**2 + deeper**2
    along = np.sqrt(np.maximum(squared - across**2, 0))
    return np.hypot(along, _BEYOND * np.maximum(np.abs(across) - window, 0))


def _least(values: Float, count: int) -> NDArray[np.intp]:
    """Numbers of the least values, ascending."""
    if len(values) <= count:
        return np.argsort(values, kind="stable")
    some = np.sort(np.argpartition(values, count)[:count])
    return some[np.argsort(values[some], kind="stable")]


def _lean(view: View, depth: float, slope: Float) -> float:
    return float(np.hypot(1, np.linalg.norm(slope) / view.footprint(depth)))


def _paraboloid(offsets: Float, depths: Float, closeness: Float) -> tuple[Float, Float, float]:
    """A robust paraboloid (of few points, plane): its factors of 1, x, y, xx, xy, yy, how far points are off
    it, (n,), and the median of that."""
    scale = max(float(np.abs(offsets).max()), np.finfo(float).tiny)
    x, y = (offsets / scale).T
    bent = len(x) >= _SURE
    terms = [np.ones_like(x), x, y, *([x * x, x * y, y * y] if bent else [])]
    factors, weights = np.stack(terms, axis=1), closeness
    for round_ in range(_REWEIGHTED + 1):
        weighted = factors.T * weights
        square = weighted @ factors
        square.flat[:: len(square) + 1] += _RIDGE * np.trace(square)  # of points on a line
        found = np.linalg.solve(square, weighted @ depths)
        off = np.abs(depths - factors @ found)
        usual = float(np.partition(off, len(off) // 2)[len(off) // 2])
        if round_ == _REWEIGHTED or usual <= 0:
            break
        share = np.minimum(off / (_CUT * usual), 1)
        weights = closeness * (1 - share**2) ** 2  # bisquare
    found[1:3] /= scale
    found[3:] /= scale**2
    return found, off, usual


def _plate(column: Column, around: _Around, used: NDArray[np.intp]) -> LocalSurface | None:
    """The thin plate through points, on the ray; None where they lie on a line or in one place."""
    # Distances are along the surface: where it is steep, points next to each other in the picture are far
    # apart.
    footprint = float(column.view.footprint(around.depth))
    along = np.linalg.cholesky(footprint**2 * np.eye(2) + np.outer(around.slope, around.slope))
    flat = np.concatenate([column.offsets[used], _SIDES]) @ along
    count = len(used)
    doubt = _chance_of_end(flat[:count])
    scale = float(np.sqrt((flat**2).sum(axis=1).max()))
    flat /= scale
    x, y = flat.T
    terms = [np.ones_like(x), x, y, *([x * x, x * y, y * y] if count >= _BENT else [])]
    found = _predicted(
        _bending(flat, flat[:count]), np.stack(terms, axis=1), (column.depths[used] - around.depth) / scale
    )
    if found is None:
        return None
    means, variance = found
    slope = scale * np.array([means[1] - means[2], means[3] - means[4]]) / (2 * _ASIDE)
    depth = around.depth + scale * float(means[0])
    spacing = around.reach * float(np.sqrt(np.pi / len(around.near)))
    return LocalSurface(depth, slope, scale * float(np.sqrt(variance)), used, spacing, doubt)


def _predicted(bending: Float, terms: Float, values: Float) -> tuple[Float, float] | None:
    """Values at some places, and the variance of the first, by kriging.

    bending: (n + m, n), between n points and m places and the points. terms: (n + m, t), of the trend there.
    values: (n,), of the points. Each noise counts by how likely it makes the values.
    """
    count, trend = len(values), terms.shape[1]
    basis, triangle = np.linalg.qr(terms[:count], mode="complete")
    corner = np.diag(triangle)
    if np.abs(corner).min() <= _EXACT * np.abs(corner).max():
        return None  # the points do not tell the trend
    among, between = bending[:count], bending[count:].T
    free = basis[:, trend:]
    stiffness, modes = np.linalg.eigh(free.T @ among @ free)
    usual = float(stiffness.mean())
    if not usual > 0:
        return None  # all in one place
    stiffness, modes = np.maximum(stiffness, 0), free @ modes
    strength = modes.T @ values
    noises, variances, chances = _likely(stiffness, strength**2, usual)
    by_trend = basis[:, :trend] @ np.linalg.solve(triangle[:trend].T, terms[count:].T)
    aside = modes.T @ (between - among @ by_trend)
    shares = aside / (stiffness + noises[:, None])[:, :, None]  # (noises, modes, places)
    means = by_trend.T @ values + np.einsum("nmp,m->np", shares, strength)
    weights = by_trend[:, 0] + shares[:, :, 0] @ modes.T
    left = np.einsum("ni,ij,nj->n", weights, among, weights) - 2 * weights @ between[:, 0]
    left = np.maximum(left + noises * (weights**2).sum(axis=1), 0)
    mean = chances @ means
    # The variance itself is known from so many numbers: that of Student's t.
    known = len(strength)
    within = variances * left * known / (known - 2)
    return mean, float(chances @ (within + (means[:, 0] - mean[0]) ** 2))


def _likely(stiffness: Float, power: Float, usual: float) -> tuple[Float, Float, Float]:
    """(noises, variances, chances): noises in terms of bending, the variance of bending with each, and how
    likely they are."""
    noises = usual * np.maximum(np.array(_NOISES), _EXACT)
    stiff = stiffness + noises[:, None]
    variances = np.maximum((power / stiff).mean(axis=1), np.finfo(float).tiny)
    likely = -0.5 * (len(power) * np.log(variances) + np.log(stiff).sum(axis=1))
    chances = np.exp(np.maximum(likely - likely.max(), -700.0))
    return noises, variances, chances / chances.sum()


def _chance_of_end(flat: Float) -> float:
    """The chance that a surface ends between its points (n, 2) and the origin. 0 where they lie all round.

    Points by chance, one per s^2, leave out a strip of length s and width d in exp(-d / s) of cases.
    """
    nearest = flat[np.argsort((flat**2).sum(axis=1))[:_ROUND]]
    beyond = float((-nearest @ _DIRECTIONS).min(axis=0).max())  # the way to where points are
    area = 4 * np.pi * np.sqrt(max(float(np.linalg.det(np.cov(flat.T))), 0.0))  # of an even ellipse
    if beyond <= 0 or area <= 0:
        return 0.0
    return float(-np.expm1(-beyond / np.sqrt(area / len(flat))))


def _bending(some: Float, others: Float) -> Float:
    """r^2 ln r for each of some places (M, 2) and others (N, 2), (M, N)."""
    squared = ((some[:, None] - others) ** 2).sum(axis=2)
    return 0.5 * squared * np.log(np.where(squared > 0, squared, 1.0))

"""A surface on the ray through a pixel, from the points of the cloud around: where the ray meets it, how it
leans, how sure that is.

Points on a surface say more together than the nearest of them alone. A robust paraboloid over their own plane
tells which of them belong to one surface (loess: Cleveland 1979), and where the ray meets it: twice, once or
not at all. That plane turns with the surface, so that a surface seen edge on is no special case. Through the
points goes the surface that bends least beside a paraboloid (a thin plate, Duchon 1977): through the points
where they are exact, and between them where they are noisy. What it leaves open is the variance of its
prediction: universal kriging (Matheron 1969; Wahba 1983 shows that such intervals hold their coverage over a
surface). Each ratio of noise to bending counts as much as the points make it likely (restricted likelihood),
since few points do not tell it well.
"""

from __future__ import annotations

import math
from enum import Enum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..scan.rays import Ray
from ..view import View

MOST = 24  # points that give the surface: some three rings around the middle
LEAST = 8  # two more than a paraboloid has unknowns
_SURE = 12  # from so many points on, a paraboloid tells which belong together; a plane of fewer
_BENT = 14  # from so many points on, the surface bends beside a paraboloid; beside a plane of fewer
_ROUNDS = 4  # of looking for the points nearest to the position that was found
_WINDOW = 1.0, 3.0  # spacings and deviations to each side of a plane in which its points are looked for
_BEYOND = 3.0  # times as far as it is, what lies beyond that
_DRIFT = 2.0, 4.0  # spacings and deviations across the surface, from the start to it, at most
_REWEIGHTED = 2  # times
_CUT = 6.0  # median absolute residuals beyond which a point does not belong (Cleveland 1979)
_NORMAL = 1.4826  # standard deviation of a normal distribution, in median absolute residuals
# Points that are looked at, and the deviation across, in distances to the farthest of them, up to which they
# are a surface. More are looked at where they are not. Of points that fill space, so many have 0.19, 0.33 and
# 0.45 or more (99 %). A surface with noise of 0.6 spacings has 0.29, 0.23 and 0.16 (median).
_THICKEST = {MOST: 0.18, 2 * MOST: 0.3, 4 * MOST: 0.4}
# Two sides of a thin part: spacings between them, at least, and the variance that is left where each has a
# mean of its own, at most, in each turn of looking for them. Of one side, 0.25 and more are left.
_APART, _LEFT = 0.4, (0.3, 0.2, 0.12)
_NOISES = (0.0, *(10.0 ** (n / 2) for n in range(-6, 5)))  # variances that are tried, of noise to bending
_EXACT = 1e-9  # of the bending, added where there is no noise: so that rounding does not count
_ROUND = 12  # nearest points that lie all round a place in the surface (99.4 % of cases by chance)
_RIDGE = 1e-13  # of the trace of normal equations, that is added to their diagonal
_CLOSENESS = 1e-9  # weight of the farthest point
_ASIDE = 0.25  # spacings to each side, between which the slope is taken
_SIDES = _ASIDE * np.array([[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]])
_FARTHER = 1.5  # distances to the farthest point, that a ray meets the plate at, at most
_TINY = float(np.finfo(float).tiny)
_GRAZING = 0.1  # least cosine of the angle between ray and normal, that slopes are taken with
_TURNS = np.linspace(0, 2 * np.pi, 48, endpoint=False)
_DIRECTIONS = np.stack([np.cos(_TURNS), np.sin(_TURNS)])  # all round, (2, 48)

Float = NDArray[np.float64]


class Column(NamedTuple):
    """The points of a cloud round the ray through a pixel.

    view: of the picture. ray: through the pixel's centre; it starts at depth 0, and each step of it adds 1 to
    the depth. ids: (n,) indices in the file. positions: (n, 3), relative to the view's origin, like the ray.
    offsets: (n, 2), pixels to the right and down from the pixel's centre. depths: (n,), in terms of the view.
    away: (n,), distances from the ray, scan units. reach: all points of the cloud that are so near to the
    ray are there, scan units. spacing: the usual distance between neighbours.
    """

    view: View
    ray: Ray
    ids: NDArray[np.intp]
    positions: Float
    offsets: Float
    depths: Float
    away: Float
    reach: float
    spacing: float

    @property
    def rate(self) -> float:
        """How fast depth grows along the ray."""
        return 1 / float(np.linalg.norm(self.ray.step))

    @property
    def ahead(self) -> Float:
        """The direction of the ray, (3,)."""
        return self.ray.step * self.rate


class LocalSurface(NamedTuple):
    """The surface on the ray through a pixel, as points tell it.

    depth: where the ray meets it, scan units; where it misses it, of the place nearest to it. slope: (2,)
    change of depth per pixel to the right and down. deviation: standard deviation of `depth`, scan units.
    used: (n,) numbers of the points that gave it, the nearest first. spacing: distance between the points
    around it, scan units. doubt: the chance that another surface is seen there, 0 to 1, such as where this
    one may end before the pixel, or the ray may pass it by.
    """

    depth: float
    slope: Float
    deviation: float
    used: NDArray[np.intp]
    spacing: float
    doubt: float = 0.0


class Unclear(Enum):
    """Why points tell no surface: they are few; they fill space; they tell one elsewhere; the column is too
    narrow to hold those that would tell it."""

    FEW = "few"
    AWAY = "away"
    THICK = "thick"
    NARROW = "narrow"


class _Crossing(NamedTuple):
    """How high a ray is above a paraboloid: `bend` t^2 + `rise` t + `height`, t along the ray."""

    bend: float
    rise: float
    height: float

    def first(self, reach: float) -> float | None:
        """The first place within reach where the ray meets the paraboloid; else the nearest such place; None
        if it misses the paraboloid."""
        if abs(self.bend) * reach <= _EXACT * abs(self.rise):
            return -self.height / self.rise
        below = self.rise**2 - 4 * self.bend * self.height
        if below < 0:
            return None
        # Without differences of nearly equal numbers:
        larger = -0.5 * (self.rise + math.copysign(math.sqrt(below), self.rise))
        places = sorted([larger / self.bend, *([self.height / larger] if larger else [])])
        return next((t for t in places if abs(t) <= reach), min(places, key=abs))

    @property
    def nearest(self) -> float:
        """The place where the ray runs along the paraboloid: deepest in it, or nearest to it."""
        return -self.rise / (2 * self.bend) if self.bend else math.inf

    def at(self, t: float) -> float:
        """The height at a place."""
        return (self.bend * t + self.rise) * t + self.height

    def steepness(self, t: float) -> float:
        """How fast the height grows at a place: the cosine of the angle to the normal there, about."""
        return self.rise + 2 * self.bend * t

    def moved(self, up: float) -> _Crossing:
        """That of the paraboloid moved up."""
        return self._replace(height=self.height - up)


class _Patch(NamedTuple):
    """A robust paraboloid of points around a place on the ray, in a frame that has that place for its origin.

    depth: of the place. axes: (3, 3), two along the surface and one across. near: (n,) numbers of the points,
    the nearest first. flat, up: (n, 2), (n,) where they lie. belongs: (n,) whether they are of the surface.
    factors: (6,) of 1, x, y, xx, xy, yy. noise: deviation of the points across. reach: how far they lie. All
    but the depth in scan units.
    """

    depth: float
    axes: Float
    near: NDArray[np.intp]
    flat: Float
    up: Float
    belongs: NDArray[np.bool_]
    factors: Float
    noise: float
    reach: float

    @property
    def spacing(self) -> float:
        """The distance between the points."""
        return self.reach * math.sqrt(math.pi / len(self.near))

    @property
    def curvature(self) -> float:
        """The mean curvature times two."""
        return 2 * float(self.factors[3] + self.factors[5])

    def crossing(self, ahead: Float) -> _Crossing:
        """How the ray crosses it. ahead: (3,) its direction."""
        x, y, z = (self.axes @ ahead).tolist()
        level, a, b, xx, xy, yy = self.factors.tolist()
        return _Crossing(-(xx * x * x + xy * x * y + yy * y * y), z - a * x - b * y, -level)

    def normal(self, flat: Float) -> Float:
        """The unit normal of the paraboloid at a place, (3,)."""
        x, y = flat.tolist()
        _, a, b, xx, xy, yy = self.factors.tolist()
        across = np.array([-(a + 2 * xx * x + xy * y), -(b + 2 * yy * y + xy * x), 1.0]) @ self.axes
        return across / np.linalg.norm(across)


def local_surface(column: Column, start: float) -> LocalSurface | Unclear:
    """The surface of the points that are nearest to a place on the ray, at a depth.

    The depth that is found may lie beside the start: the points are looked for again around it.
    """
    patch: _Patch | Unclear = Unclear.FEW
    for count, thickest in _THICKEST.items():
        if count == MOST or len(column.ids) > count or np.isfinite(column.reach):
            patch = _patch(column, start, count, thickest)
        if patch is not Unclear.THICK:
            break
    return patch if isinstance(patch, Unclear) else _plate(column, patch)


def _patch(column: Column, start: float, count: int, thickest: float) -> _Patch | Unclear:
    """The points that are nearest to the ray along their surface, by several rounds, and their paraboloid.

    start: depth at which that is looked for at first. thickest: how noisy they may be, in terms of how far
    they reach.
    """
    depth, noise, spacing, normal = start, 0.0, column.spacing, None
    ahead, rate, before = column.ahead, column.rate, np.empty(0, np.intp)
    for round_ in range(_ROUNDS):
        apart = column.positions - (column.ray.start + depth * column.ray.step)
        normal = _across(apart) if normal is None else normal
        normal = normal * math.copysign(1.0, normal @ ahead)  # away from the eye
        near, away = _nearest(apart, normal, count, max(_WINDOW[0] * spacing, _WINDOW[1] * noise))
        if len(near) <= LEAST and np.isinf(column.reach):
            return Unclear.FEW
        if away[-1] > column.reach or (len(near) <= count and np.isfinite(column.reach)):
            return Unclear.NARROW
        patch = _paraboloid_over(apart, near[:count], away, normal)._replace(depth=depth)
        noise, spacing = patch.noise, patch.spacing
        along = _way(patch, ahead)
        if round_ == _ROUNDS - 1 or np.array_equal(near, before):
            break
        depth, before = depth + along * rate, near
        normal = patch.normal(along * patch.axes[:2] @ ahead)
    if np.count_nonzero(patch.belongs) < LEAST or (column.view.perspective and depth <= 0):
        return Unclear.FEW
    if noise > thickest * patch.reach:
        return Unclear.THICK
    drift = (depth + along * rate - start) / rate
    across = abs(patch.crossing(ahead).steepness(along) * drift)
    is_there = abs(along) < patch.reach and across <= _DRIFT[0] * spacing + _DRIFT[1] * noise
    return patch if is_there else Unclear.AWAY


def _way(patch: _Patch, ahead: Float) -> float:
    """The way along the ray from the place of a patch to its paraboloid, as far as the points reach."""
    crossing = patch.crossing(ahead)
    first = crossing.first(patch.reach)
    return float(np.clip(crossing.nearest if first is None else first, -patch.reach, patch.reach))


def _across(apart: Float) -> Float:
    """The normal of the plane of the points nearest to the origin, (3,). apart: (n, 3)."""
    squared = np.einsum("ij,ij->i", apart, apart)
    near = _least(squared, MOST)[:MOST]
    weights = 1 - squared[near] / (1.1 * squared[near].max(initial=_TINY))
    off = apart[near] - weights @ apart[near] / max(weights.sum(), _TINY)
    return np.linalg.eigh((off.T * weights) @ off)[1][:, 0]


def _nearest(apart: Float, normal: Float, count: int, window: float) -> tuple[NDArray[np.intp], Float]:
    """The numbers of the points (n, 3) nearest to the origin, one more than count, and how far they are:
    along the surface, as what lies across it within a window may be noise; beyond that it counts more."""
    across = apart @ normal
    along = np.sqrt(np.maximum(np.einsum("ij,ij->i", apart, apart) - across**2, 0))
    away = np.hypot(along, _BEYOND * np.maximum(np.abs(across) - window, 0))
    near = _least(away, count + 1)
    return near, away[near]


def _least(values: Float, count: int) -> NDArray[np.intp]:
    """Numbers of the least values, ascending."""
    if len(values) <= count:
        return np.argsort(values, kind="stable")
    some = np.sort(np.argpartition(values, count)[:count])
    return some[np.argsort(values[some], kind="stable")]


def _paraboloid_over(apart: Float, near: NDArray[np.intp], away: Float, normal: Float) -> _Patch:
    """The paraboloid of the points that are near, over the plane through the origin; of those on the lower
    side alone where they are of two. away: how far these and the next are, ascending."""
    axes = _axes_of(normal)
    framed = apart[near] @ axes.T
    flat, up = framed[:, :2], framed[:, 2]
    reach = max(float(away[-1]), _TINY)
    closeness = (1 - np.minimum(away[: len(near)] / reach, 1) ** 3) ** 3 + _CLOSENESS  # tricube
    factors, off = _robust(flat, up, closeness)
    lower = _lower_side(flat / reach, up, closeness, _APART * reach * math.sqrt(math.pi / len(near)))
    if lower is not None:
        off = np.full(len(near), np.inf)
        factors, off[lower] = _robust(flat[lower], up[lower], closeness[lower])
    usual = _median(np.abs(off[np.isfinite(off)]))
    belongs = (np.abs(off) <= _CUT * usual) | ((usual <= 0) & np.isfinite(off))
    return _Patch(0.0, axes, near, flat, up, belongs, factors, _NORMAL * usual, reach)


def _axes_of(normal: Float) -> Float:
    """Two unit vectors across a unit vector (3,), and itself, (3, 3): rows of the reflection that moves the
    first axis to it (Householder 1958)."""
    x, y, z = normal.tolist()
    sign, bent = math.copysign(1.0, x), 1 / (1 + abs(x))
    one = [-sign * y, 1 - y * y * bent, -y * z * bent]
    other = [-sign * z, -y * z * bent, 1 - z * z * bent]
    return np.array([one, other, [x, y, z]])


def _robust(flat: Float, up: Float, closeness: Float) -> tuple[Float, Float]:
    """A robust paraboloid (of few points, plane): its factors of 1, x, y, xx, xy, yy, and how far points are
    above it, (n,)."""
    scale = max(float(np.abs(flat).max()), _TINY)
    terms = _terms(flat / scale, is_bent=len(flat) >= _SURE)
    weights = closeness
    for round_ in range(_REWEIGHTED + 1):
        weighted = terms.T * weights
        found = _solved(weighted @ terms, weighted @ up)
        off = up - terms @ found
        usual = _median(np.abs(off))
        if round_ == _REWEIGHTED or usual <= 0:
            break
        share = np.minimum(np.abs(off) / (_CUT * usual), 1)
        weights = closeness * (1 - share**2) ** 2  # bisquare
    factors = np.zeros(6)
    factors[: len(found)] = found
    return factors / scale ** np.array([0, 1, 1, 2, 2, 2]), off


def _solved(square: Float, sides: Float) -> Float:
    """The solution of normal equations, of points on a line too."""
    diagonal = square.reshape(-1)[:: len(square) + 1]
    diagonal += _RIDGE * diagonal.sum()
    found: Float = np.linalg.solve(square, sides).astype(np.float64, copy=False)
    return found


def _terms(flat: Float, *, is_bent: bool) -> Float:
    """1, x, y of places (n, 2), and xx, xy, yy of a bent surface, (n, 3 or 6)."""
    x, y = flat.T
    terms = np.empty((len(flat), 6 if is_bent else 3))
    terms[:, 0] = 1
    terms[:, 1:3] = flat
    if is_bent:
        terms[:, 3], terms[:, 4], terms[:, 5] = x * x, x * y, y * y
    return terms


def _median(values: Float) -> float:
    """The middle one; the upper one of two."""
    return float(np.partition(values, len(values) // 2)[len(values) // 2])


def _lower_side(flat: Float, up: Float, closeness: Float, apart: float) -> NDArray[np.bool_] | None:
    """The lower points of two surfaces of one shape that lie so far apart, (n,), by turns of which points are
    whose and what their shape is (switching regression: Quandt 1958); None where they are one surface.

    flat, up: (n, 2), (n,) where points lie. closeness: (n,) their weights.
    """
    heights, lower = up, None
    for most_left in _LEFT:
        lower = _lower_group(heights, most_left, apart)
        if lower is None:
            return None
        terms = np.column_stack([_terms(flat, is_bent=True), lower])
        weighted = terms.T * closeness
        heights = up - terms[:, :-1] @ _solved(weighted @ terms, weighted @ up)[:-1]
    return lower


def _lower_group(off: Float, most_left: float, apart: float) -> NDArray[np.bool_] | None:
    """The lower of two groups, (n,), of heights (n,) whose means lie so far apart and leave at most a share
    of their variance; None where they are one (two means: MacQueen 1967)."""
    order = np.argsort(off)
    values = off[order] - off.mean()
    counts = np.arange(LEAST, len(values) - LEAST + 1)
    total = float(values @ values)
    if not len(counts) or not total > 0:
        return None
    sums = np.cumsum(values)[counts - 1]
    each = 1 / counts + 1 / (len(values) - counts)
    best = int((sums**2 * each).argmax())
    if sums[best] ** 2 * each[best] < (1 - most_left) * total or abs(sums[best]) * each[best] < apart:
        return None
    lower = np.zeros(len(off), np.bool_)
    lower[order[: counts[best]]] = True
    return lower


def _plate(column: Column, patch: _Patch) -> LocalSurface | Unclear:
    """The thin plate through the points of a patch, where the ray meets it."""
    used = np.flatnonzero(patch.belongs)[:MOST]
    foot = patch.axes[:2] @ column.ahead * _way(patch, column.ahead)
    flat = patch.flat[used] - foot
    scale = max(float(np.sqrt((flat**2).sum(axis=1).max())), _TINY)
    places = np.concatenate([flat, patch.spacing * _SIDES]) / scale
    level = float(_terms(foot[None], is_bent=True)[0] @ patch.factors)
    found = _predicted(
        _bending(places, places[: len(used)]),
        _terms(places, is_bent=len(used) >= _BENT),
        (patch.up[used] - level) / scale,
    )
    if found is None:
        return Unclear.FEW
    means, variance = scale * found[0], scale**2 * found[1]
    # Noise along the normals moves points of a bent surface apart on one side and together on the other, so
    # that the mean of them lies to that side. Which way noise goes is not known.
    deviation = math.hypot(math.sqrt(variance), patch.noise**2 * patch.curvature)
    crossing = patch.crossing(column.ahead).moved(float(means[0]))
    way, meets, off = _crossed(crossing, patch.reach, deviation)
    leaning = np.array([means[1] - means[2], means[3] - means[4]]) / (2 * _ASIDE * patch.spacing)
    depth = patch.depth + way * column.rate
    return LocalSurface(
        depth,
        _slope(column, depth, np.append(-leaning, 1.0) @ patch.axes),
        off * column.rate,
        patch.near[used],
        patch.spacing,
        1 - (1 - _chance_of_end(flat)) * meets,
    )


def _crossed(crossing: _Crossing, reach: float, deviation: float) -> tuple[float, float, float]:
    """The place where a ray meets a paraboloid, the chance that it does, and the standard deviation of the
    place if the paraboloid may be higher or lower by a deviation."""
    first = crossing.first(_FARTHER * reach)
    way = crossing.nearest if first is None else first
    deepest = way + float(np.clip(crossing.nearest - way, -reach, reach))
    depth = abs(crossing.at(deepest)) * (-1 if first is None else 1)
    meets = 0.5 * math.erfc(-depth / max(deviation, _EXACT * reach) / math.sqrt(2))
    moved = [crossing.moved(up).first(_FARTHER * reach) for up in (deviation, -deviation)]
    off = max(abs((crossing.nearest if each is None else each) - way) for each in moved)
    return way, meets, off


def _slope(column: Column, depth: float, across: Float) -> Float:
    """Change of depth per pixel to the right and down, (2,), of a surface with a normal, (3,)."""
    across = across / np.linalg.norm(across)
    facing = float(across @ column.ahead)
    facing = math.copysign(max(abs(facing), _GRAZING), facing)
    aside = column.view.rotation[:2] @ across * np.array([1, -1])
    return -aside * float(column.view.footprint(depth)) * column.rate / facing


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

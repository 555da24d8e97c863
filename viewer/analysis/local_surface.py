"""The surface in a pixel, from the points that are seen around: where it is, how it leans, how sure it is.

Points on a surface say more together than the nearest of them alone. A robust parabola tells which of them
belong to one surface (loess: Cleveland 1979). Through these goes the surface that bends least (a thin plate,
Duchon 1977) as they are exact, or beside them as they are noisy, whichever is more likely (restricted maximum
likelihood), and what it leaves open is the variance of its prediction: universal kriging (Matheron 1969; for
thin plates Wahba 1983, whose intervals hold their coverage over a surface).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..view import View

MOST = 24  # points that are looked at, the nearest: some three rings around the middle
LEAST = 8  # two more than a parabola has unknowns
_SURE = 12  # from so many points on, a parabola tells which belong together; a plane of fewer
_ROUNDS = 3  # of looking for the points nearest to the place that was found
_BEHIND = 3  # surfaces that are looked for behind one that ends before the pixel
_REWEIGHTED = 2  # times
_CUT = 6.0  # median absolute residuals beyond which a point does not belong (Cleveland 1979)
# Standard deviation across, in distances to the farthest point that is looked at, beyond which points fill
# space: those that do have 0.22 and more (95 %), a surface with noise of 0.5 spacings has 0.17 (median).
_THICK = 0.2
_NOISES = (0.0, *(10.0 ** (n / 2) for n in range(-6, 5)))  # variances that are tried, of noise to bending
_EXACT = 1e-9  # of the bending, added where there is no noise: so that rounding does not count
_ASIDE = 0.5  # pixels to each side, between which the slope is taken
_TURNS = np.linspace(0, 2 * np.pi, 48, endpoint=False)
_DIRECTIONS = np.stack([np.cos(_TURNS), np.sin(_TURNS)])  # all round, (2, 48)

Float = NDArray[np.float64]


class LocalSurface(NamedTuple):
    """The surface in the direction of a pixel, as points tell it.

    depth: there, scan units. slope: (2,) change of depth per pixel to the right and down. deviation: standard
    deviation of `depth`, scan units. used: (n,) numbers of the points that gave it, the nearest first.
    doubt: the chance that another surface is seen there, 0 to 1: the pixel lies beyond points of this one,
    which may end before it, or of one before it, which may not. `deviation` holds how far apart they are.
    """

    depth: float
    slope: Float
    deviation: float
    used: NDArray[np.intp]
    doubt: float = 0.0


def local_surface(
    view: View, pixel: Float, about: Float, positions: Float, seen: int | None = None
) -> LocalSurface | None:
    """The surface in the direction of a pixel; None where the points do not tell.

    pixel: (2,) coordinates, the centre being at a half. about: (3,) a place of the surface near there, the
    nearest points to which are looked at first. positions: (N, 3), in front of the eye; both relative to the
    view's origin. seen: the number of the point that has to belong to it. Where that surface ends or bends
    away before the pixel, which a splat beyond its edge shows, it is the one behind. Where it may end there,
    it is the likelier of both.
    """
    if len(positions) < LEAST:
        return None
    pixels, depths = view.project(positions)
    front = None
    for _ in range(_BEHIND + 1):
        found, reach = _fitted(view, pixel, about, positions, pixels - pixel, depths, seen)
        if front is not None:
            return _either(front, found)
        if found is not None:
            if not found.doubt:
                return found
            front = found
        if not reach:
            break
        # Of what lies farther back, what the picture has nearest to the pixel.
        behind = depths > (view.depths(about) if front is None else front.depth) + reach
        if not behind.any():
            break
        seen = int(np.where(behind, np.hypot(*(pixels - pixel).T), np.inf).argmin())
        about = positions[seen]
    return front


def _either(front: LocalSurface, behind: LocalSurface | None) -> LocalSurface:
    """The likelier of a surface that may end before the pixel and the one behind it. That it may be the other
    adds to the variance as much as they are apart, squared, by its chance."""
    if behind is None:
        return front
    likelier, doubt = (front, front.doubt) if front.doubt <= 0.5 else (behind, 1 - front.doubt)
    apart = np.sqrt(doubt) * (behind.depth - front.depth)
    return likelier._replace(deviation=float(np.hypot(likelier.deviation, apart)), doubt=doubt)


def _fitted(
    view: View,
    pixel: Float,
    about: Float,
    positions: Float,
    offsets: Float,
    depths: Float,
    seen: int | None,
) -> tuple[LocalSurface | None, float]:
    """The surface about a place; and, where it is not met in the direction of the pixel, how far its points
    reach, else 0."""
    start, place, is_seen = float(view.depths(about)), about, seen is None
    for _ in range(_ROUNDS):
        distances = np.linalg.norm(positions - place, axis=1)
        near = np.argsort(distances, kind="stable")[: MOST + 1]
        reach = max(float(distances[near[-1]]), np.finfo(float).tiny)
        near = near[:MOST]
        closeness = (1 - np.minimum(distances[near] / reach, 1) ** 3) ** 3  # tricube
        slope, off, belongs, deeper = _parabola(offsets[near], depths[near] - start, closeness)
        is_seen |= seen in near[belongs]
        if view.perspective and start + deeper <= 0:
            return None, 0.0
        place = view.unproject(pixel[None], np.array([start + deeper]))[0]
        if np.linalg.norm(place - about) > reach:
            return None, reach
    used = near[belongs]
    if len(used) < LEAST or not is_seen:
        return None, 0.0
    # Across the surface rather than along the ray.
    lean = np.hypot(1, np.linalg.norm(slope) / view.footprint(start))
    if np.sqrt(np.mean(off[belongs] ** 2)) / lean > _THICK * reach:
        return None, 0.0  # they fill space
    return _plate(view, offsets[used], depths[used], start, slope, used), reach


def _parabola(
    offsets: Float, depths: Float, closeness: Float
) -> tuple[Float, Float, NDArray[np.bool_], float]:
    """Slope at the middle of a robust parabola (of few points, plane), how far points are off, (n,), which
    belong, and the depth at the middle."""
    scale = max(float(np.abs(offsets).max()), np.finfo(float).tiny)
    x, y = (offsets / scale).T
    terms = [np.ones_like(x), x, y, *([x * x, x * y, y * y] if len(x) >= _SURE else [])]
    factors, weights = np.stack(terms, axis=1), closeness
    for round_ in range(_REWEIGHTED + 1):
        root = np.sqrt(weights)
        found = np.linalg.lstsq(factors * root[:, None], depths * root, rcond=None)[0]
        off = np.abs(depths - factors @ found)
        usual = float(np.median(off))
        if round_ == _REWEIGHTED or usual <= 0:
            break
        share = np.minimum(off / (_CUT * usual), 1)
        weights = closeness * (1 - share**2) ** 2  # bisquare
    return found[1:3] / scale, off, weights > 0, float(found[0])


def _plate(
    view: View, offsets: Float, depths: Float, start: float, slope: Float, used: NDArray[np.intp]
) -> LocalSurface | None:
    """The thin plate through the points, at the middle."""
    # Distances are along the surface: where it is steep, points next to each other in the picture are far
    # apart.
    footprint = view.footprint(start)
    along = np.linalg.cholesky(footprint**2 * np.eye(2) + np.outer(slope, slope))
    sides = _ASIDE * np.array([[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]])
    flat = np.concatenate([offsets, sides]) @ along
    doubt = _chance_of_end(flat[: len(offsets)])
    scale = float(np.sqrt((flat**2).sum(axis=1).max()))
    flat, count = flat / scale, len(offsets)
    bending = _bending(flat, flat[:count])
    lines = np.column_stack([np.ones(len(flat)), flat])
    values = (depths - start) / scale

    free = np.linalg.qr(lines[:count], mode="complete")[0][:, 3:]  # what no plane explains
    stiffness, modes = np.linalg.eigh(free.T @ bending[:count] @ free)
    usual = float(stiffness.mean())
    if not usual > 0:
        return None  # all in one place
    power = (modes.T @ (free.T @ values)) ** 2
    noise, variance = _likeliest(np.maximum(stiffness, 0), power, usual)

    system = np.zeros((count + 3, count + 3))
    system[:count, :count] = bending[:count] + noise * np.eye(count)
    system[:count, count:], system[count:, :count] = lines[:count], lines[:count].T
    asked = np.concatenate([bending[count:].T, lines[count:].T])
    try:
        weights = np.linalg.solve(system, asked)
    except np.linalg.LinAlgError:
        return None  # on a line
    found = weights[:count].T @ values
    open_ = max(0.0, -float(weights[:, 0] @ asked[:, 0]))
    # The variance itself is known from so many numbers: that of Student's t.
    known = len(power)
    deviation = scale * np.sqrt(variance * open_ * known / (known - 2))
    slope = scale * np.array([found[1] - found[2], found[3] - found[4]]) / (2 * _ASIDE)
    return LocalSurface(start + scale * float(found[0]), slope, float(deviation), used, doubt)


def _chance_of_end(flat: Float) -> float:
    """The chance that a surface ends between its points (n, 2) and the origin. 0 where they lie all round.

    Points by chance, one per s^2, leave out a strip of length s and width d in exp(-d / s) of cases.
    """
    beyond = float((-flat @ _DIRECTIONS).min(axis=0).max())  # the way to where points are
    area = 4 * np.pi * np.sqrt(max(float(np.linalg.det(np.cov(flat.T))), 0.0))  # of an even ellipse
    if beyond <= 0 or area <= 0:
        return 0.0
    return float(-np.expm1(-beyond / np.sqrt(area / len(flat))))


def _bending(some: Float, others: Float) -> Float:
    """r^2 ln r for each of some places (M, 2) and others (N, 2), (M, N)."""
    squared = ((some[:, None] - others) ** 2).sum(axis=2)
    return 0.5 * squared * np.log(np.where(squared > 0, squared, 1.0))


def _likeliest(stiffness: Float, power: Float, usual: float) -> tuple[float, float]:
    """(noise, variance): the noise in terms of bending that is most likely, and the bending's variance."""
    noises = usual * np.maximum(np.array(_NOISES), _EXACT)[:, None]
    variances = np.maximum((power / (stiffness + noises)).mean(axis=1), np.finfo(float).tiny)
    unlikely = len(power) * np.log(variances) + np.log(stiffness + noises).sum(axis=1)
    best = int(unlikely.argmin())
    return float(noises[best, 0]), float(variances[best])

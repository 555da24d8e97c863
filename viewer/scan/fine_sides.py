"""The side of normals by winding numbers, where links and the view from outside are unsure; see `sides`.

If the normals of a closed surface point out, the winding number at its points is 1/2. `better_sides` finds
the sides of all patches that agree best with links, the view from outside and this number (Xu et al. 2023 and
Lin et al. 2024 use the number alone). A group of points turns only if the number gains, and the view from
outside does not object, so open surfaces stay as they are.

Two sides of a sheet that is thinner than the distance between points have the same neighbours. Scan4D tells
them apart by fits of two surfaces instead of one.
"""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..task import checkpoint
from ..threads import together
from .patches import patches_of, summed
from .winding import WindingField, clusters_of

Vectors = NDArray[np.float64]  # (N, 3)

_UNSURE = 0.001  # of the weights of links
_PATCHES = 1000  # about so many
_MOST_PATCHES = 2000  # all pairs of them are looked at; smaller ones beyond stay as they are
_SMALLEST = 10  # points of a patch, at most, in a small cloud
_TARGETS = 6000  # points at which the winding number is looked at, at most
_WEIGHT = 2.0  # of the winding number, against that of a link
_SOFT = 0.5  # in distances between points: nearer points count as so near
_AREA_OF = 12  # neighbours that tell the area of a point
_SPACING_OF = 6  # neighbours that tell the distance between points
# What two sheets explain: below the first, one is as good; from the second, two are sure.
_TWO_SHEETS = 0.85, 0.95
_TRUSTED = 2.0  # so that half of the trust decides a link
_FAR = 3.0  # radii of a patch, the distance from which its cluster stands for its points
# Cosine from which normals are those of two sides of something flat, unless neighbours on the same side lie
# off the plane by more than such a share of their distance.
_OPPOSITE, _BENT = -0.8, 0.25
_STEERS = 5  # rounds in which normals follow the winding number
_STEERED_SOFT = 0.4  # in distances between points
_PART = 128  # points of a group whose cluster stands for them, at most
_AT_ONCE = 1 << 8  # targets of one call of a compiled loop
_ROWS = 1 << 13  # points of one
_TURNS = 20  # rounds in which points turn, one by one
_GROUPS = 200  # that may turn, the largest ones
# A group turns round where this much is gained for each of its points, in the square of how far the winding
# number is off, and where the view from outside, in links, does not object.
_GAIN, _OBJECTION = 0.1, -0.05
# Where links gain so much for each point, the two sides of a thin sheet part: that one faces the front says
# nothing then.
_PARTED, _PARTED_GAIN = 1.0, 0.05


class Bonds(NamedTuple):
    """Links between points, and the view from outside, which tell sides.

    links: (L, 2). weights: (L,), from 1, where the normals as they are point to the same side, to -1. seen:
    (N,), how much more the sides of the normals are seen from outside than the others, or face the front.
    outside: (N,), the first of the two alone.
    """

    links: NDArray[np.int32]
    weights: NDArray[np.floating]
    seen: NDArray[np.floating]
    outside: NDArray[np.floating]


def is_unsure(weights: NDArray[np.floating]) -> bool:
    """Whether the links that contradict the normals weigh much. weights: (L,), below 0 where they do."""
    return float(np.maximum(-weights, 0).sum()) > _UNSURE * float(np.abs(weights).sum())


def better_sides(
    points: Vectors, normals: NDArray[np.float32], near: NDArray[np.int32], bonds: Bonds
) -> NDArray[np.int8]:
    """1 or -1 for each point, (N,): -1 where a normal should turn round.

    points, normals: (N, 3). near: (N, K), each point and its nearest others. bonds: of the normals as they
    are.
    """
    from . import side_kernels

    if near.shape[1] <= _AREA_OF:
        return np.ones(len(points), np.int8)
    facing = normals.astype(np.float64)
    bonds = bonds._replace(weights=_told_apart(points, facing, near, bonds))
    field = _Field(points, facing, near)
    signs = _of_all_patches(field, bonds)
    side_kernels.settle(bonds.links, bonds.weights, bonds.seen, _TURNS, signs)
    return _accepted(field, bonds, signs)


def one_sided_normals(
    points: Vectors, normals: NDArray[np.float32], near: NDArray[np.int32]
) -> NDArray[np.float32]:
    """The normals, (N, 3), where neighbours lie on both sides of something thin those of planes through one
    side. points, normals: (N, 3). near: (N, K), each point and its nearest others."""
    from . import sheet_kernels

    fitted = normals.copy()

    def fit(start: int) -> None:
        checkpoint()
        rows = (start, min(start + _ROWS, len(points)))
        sheet_kernels.fit_one_side(points, normals, near, rows, fitted)

    together(len(points), [partial(fit, start) for start in range(0, len(points), _ROWS)])
    return fitted


def steered_normals(
    points: Vectors, normals: NDArray[np.float32], near: NDArray[np.int32], linked: int
) -> NDArray[np.float32]:
    """The normals, (N, 3), where one of the nearest leans to the other side: those along which the winding
    number of the neighbours falls fastest (Lin et al. 2024), since a plane through both sides says nothing.

    points, normals: (N, 3). near: (N, K), each point and its nearest others. linked: how many are nearest.
    """
    from .winding_kernels import fall_fastest

    if near.shape[1] <= _AREA_OF:
        return normals
    cosines = np.einsum("ij,ikj->ik", normals, normals[near[:, :linked]])
    steps, is_beside = points[near[:, :linked]] - points[:, None], cosines > 0
    heights = (np.einsum("ij,ikj->ik", normals, steps) ** 2 * is_beside).sum(axis=1)
    is_bent = heights > _BENT**2 * ((steps**2).sum(axis=2) * is_beside).sum(axis=1)
    leans = (cosines < 0) & ((cosines > _OPPOSITE) | is_bent[:, None])
    rows = np.flatnonzero(leans.any(axis=1))
    area = np.pi * np.linalg.norm(points[near[:, _AREA_OF]] - points, axis=1) ** 2 / (_AREA_OF + 0.5)
    soft = (_STEERED_SOFT * np.linalg.norm(points[near[rows, _SPACING_OF]] - points[rows], axis=1)) ** 2
    steered = normals.astype(np.float64)
    directions = np.empty((len(rows), 3))
    for _ in range(_STEERS):
        checkpoint()
        fall_fastest(points, steered * area[:, None], near, rows, soft, directions)
        steered[rows] = directions
    return steered.astype(np.float32)


def _told_apart(
    points: Vectors, normals: Vectors, near: NDArray[np.int32], bonds: Bonds
) -> NDArray[np.floating]:
    """The weights of links, (L,), where those between two sheets bind normals that point apart."""
    from . import sheet_kernels

    explained, sides = np.zeros(len(points)), np.zeros(near.shape, np.int8)

    def fit(start: int) -> None:
        checkpoint()
        rows = (start, min(start + _ROWS, len(points)))
        sheet_kernels.split_in_sheets(points, normals, near, rows, explained, sides)

    together(len(points), [partial(fit, start) for start in range(0, len(points), _ROWS)])
    least, most = _TWO_SHEETS
    trust = np.clip((explained[near].mean(axis=1) - least) / (most - least), 0, 1)
    links = bonds.links
    doubtful = np.flatnonzero((trust > 0)[links].any(axis=1))
    votes, trusted = np.zeros(len(doubtful)), np.zeros(len(doubtful))
    sheet_kernels.count_votes(near, trust, sides, links[doubtful], votes, trusted)
    share = np.minimum(_TRUSTED * trusted, 1)
    cosines = np.einsum("ij,ij->i", *(normals[links[doubtful, end]] for end in (0, 1)))
    weights = bonds.weights.copy()
    weights[doubtful] = weights[doubtful] * (1 - share) + share * votes * cosines
    return weights


class _Field:
    """The winding number at some points of a cloud, the targets.

    points, vectors: (N, 3), area times normal. targets: (T,), rows. soft: (T,), see `winding_kernels.fields`.
    """

    def __init__(self, points: Vectors, normals: Vectors, near: NDArray[np.int32]) -> None:
        """near: (N, K), each point and its nearest others, nearest first."""
        reach, step = (
            np.linalg.norm(points[near[:, place]] - points, axis=1) for place in (_AREA_OF, _SPACING_OF)
        )
        self.points = points
        self.vectors = normals * (np.pi * reach**2 / (_AREA_OF + 0.5))[:, None]
        self.targets = np.linspace(0, len(points) - 1, min(len(points), _TARGETS)).astype(np.int64)
        self.soft = (_SOFT * step[self.targets]) ** 2 * (np.pi / _SPACING_OF)

    @property
    def scale(self) -> float:
        """The number of points that each target stands for."""
        return len(self.points) / len(self.targets)

    def whole(self) -> NDArray[np.float64]:
        """The winding number of all points at the targets, (T,)."""
        return WindingField(self.points, self.vectors).at(self.points[self.targets], self.soft)

    def of_groups(
        self, group: NDArray[np.integer], count: int, signs: NDArray[np.integer] | None = None
    ) -> NDArray[np.float32]:
        """The winding number of each group alone at the targets, (T, count). group: (N,), from 0; points of
        group `count` belong to none. signs: (N,), of the normals; None: as they are."""
        from .winding_kernels import Groups, fields

        order = group.argsort(kind="stable")
        cuts = np.searchsorted(group[order], np.arange(count + 1))
        first, part_of = _parts(cuts)
        vectors = self.vectors if signs is None else self.vectors * signs[:, None]
        groups = Groups(self.points, vectors, order, np.column_stack([first[:-1], first[1:]]))
        clusters, found = clusters_of(groups), np.zeros((len(self.targets), count), np.float32)

        def part(start: int) -> None:
            checkpoint()
            some = slice(start, start + _AT_ONCE)
            fields(groups, clusters, self.targets[some], self.soft[some], part_of, found[some], _FAR)

        together(len(self.points), [partial(part, start) for start in range(0, len(found), _AT_ONCE)])
        return found


def _parts(cuts: NDArray[np.integer]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """First rows of parts of groups, and the end, (P + 1,), and the group of each part, (P,).

    Only near parts are looked at point by point. cuts: (C + 1,), first rows of groups, and the end.
    """
    parts = -(-np.diff(cuts) // _PART)
    part_of = np.repeat(np.arange(len(parts)), parts)
    number = np.arange(len(part_of)) - np.repeat(np.cumsum(parts) - parts, parts)
    return np.append(cuts[part_of] + number * _PART, cuts[-1]), part_of


def _of_all_patches(field: _Field, bonds: Bonds) -> NDArray[np.int8]:
    """1 or -1 for each point, (N,): patches that together agree best with bonds and the winding number."""
    from . import fine_kernels

    links, weights, seen, _ = bonds
    largest = max(len(seen) // _PATCHES, _SMALLEST)
    patch, agreeing = patches_of(links, weights, len(seen), tuple(sorted({_SMALLEST, largest})))
    patch, count = _largest(patch, _MOST_PATCHES)
    fields = field.of_groups(patch, count, agreeing)
    inside = (patch < count)[links].all(axis=1)
    links, weights = links[inside], weights[inside]
    pairs, sums = summed(patch[links], weights * agreeing[links].prod(axis=1), count)
    strength = np.zeros(
        (count + 1, count + 1)
    )  # of pairs of patches, the last of which is the view from outside
    strength[pairs[:, 0], pairs[:, 1]] = sums
    strength += strength.T
    weight = _WEIGHT * field.scale
    strength[:count, :count] -= 2 * weight * (fields.T @ fields)
    alone = np.bincount(patch, seen * agreeing, count + 1)[:count]
    alone += weight * fields.sum(axis=0, dtype=np.float64)
    strength[count, :count] = strength[:count, count] = alone
    np.fill_diagonal(strength, 0)
    checkpoint()
    signs = fine_kernels.contract(strength.copy())
    signs *= signs[count]
    fine_kernels.climb(strength, signs)
    return np.where(patch < count, agreeing * signs[patch], 1).astype(np.int8)


def _largest(patch: NDArray[np.int32], most: int) -> tuple[NDArray[np.int32], int]:
    """The patches of points, (N,), and their number, where only so many count: those with the most points.
    Points of the others have this number."""
    sizes = np.bincount(patch)
    if len(sizes) <= most:
        return patch, len(sizes)
    number = np.full(len(sizes), most, np.int32)
    number[np.argsort(-sizes, kind="stable")[:most]] = np.arange(most)
    return number[patch], most


def _accepted(field: _Field, bonds: Bonds, signs: NDArray[np.int8]) -> NDArray[np.int8]:
    """The signs, (N,), of those connected groups of -1 that gain enough by it; 1 elsewhere."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    links, weights, seen, outside = bonds
    turned = signs < 0
    rows = np.flatnonzero(turned)
    if not len(rows):
        return signs
    inside, across = (test[links] for test in (turned, ~turned))
    within, border = inside.all(axis=1), inside.any(axis=1) & across.any(axis=1)
    one, other = links[within].T
    shape = (len(signs), len(signs))
    linked = coo_array((np.ones(len(one), np.int8), (one, other)), shape=shape)
    found = connected_components(linked, directed=False)[1][rows]
    found = np.unique(found, return_inverse=True)[1]
    sizes = np.bincount(found)
    largest = np.argsort(-sizes, kind="stable")[:_GROUPS]
    number = np.full(len(sizes), len(largest))
    number[largest] = np.arange(len(largest))
    group = np.full(len(signs), len(largest))
    group[rows] = number[found]
    sizes = sizes[largest].astype(np.float64)
    ends = links[border]
    of_border = np.where(turned[ends[:, 0]], group[ends[:, 0]], group[ends[:, 1]])
    by_links = -2 * np.bincount(of_border, weights[border], len(sizes) + 1)[:-1] / sizes
    by_view, from_outside = (
        -2 * np.bincount(group[rows], view[rows], len(sizes) + 1)[:-1] / sizes for view in (seen, outside)
    )
    by_field = _gain(field, group, len(sizes)) / sizes
    is_parted = by_links >= _PARTED
    gains = by_field >= np.where(is_parted, _PARTED_GAIN, _GAIN)
    accepted = gains & (np.where(is_parted, from_outside, by_view) >= _OBJECTION)
    accepted = np.append(accepted, False)
    return np.where(turned & accepted[group], -1, 1).astype(np.int8)


def _gain(field: _Field, group: NDArray[np.integer], count: int) -> NDArray[np.float64]:
    """How much less the winding number is off 1/2, squared, over all points, if one group turns: (count,)."""
    whole = field.whole()[:, None]
    alone = field.of_groups(group, count)
    return field.scale * ((whole - 0.5) ** 2 - (whole - 2 * alone - 0.5) ** 2).sum(axis=0, dtype=np.float64)

"""On which side of a surface its normals point: outwards, or towards the front.

Two things tell it. From far around, the side is seen that is outside, unless other parts hide it. And normals
of neighbours agree. Both are sums: the points become patches within which normals certainly agree, then the
two patches that all links between them bind most firmly become one, again and again, and the view from
outside is a patch among them (a greedy way to the least frustration of a signed graph; see Schertler et al.
2017 and Keuper et al. 2015). Then patches of many sizes, and at last single points, turn round where that
makes the sum higher.
"""

from __future__ import annotations

import heapq
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..task import checkpoint
from .patches import joined_things, summed

if TYPE_CHECKING:
    from .fine_sides import Bonds

Vectors = NDArray[np.float64]  # (N, 3)
Method = Literal["quick", "fine"]

LINKED = 9  # neighbours that are linked, the point itself included
# The outside of a surface is the side that more views see, from both ends of each axis.
_AXES = 13
_FRONT_BONUS = 0.5  # so that a sheet which is seen from both sides faces the front
_CELL = 1.0  # of a view's grid, in reaches: wide enough to leave few holes in a surface
_DEPTH = 1.4  # in reaches: so far behind the first point of its cell a point counts as seen less and less
_GRID = 1024  # cells along an axis at most
# Points at most of patches, of patches of these, ...: small enough at first that a wrong link spoils little;
# and in other sizes again, since what must turn as a whole may not be one patch.
_PATCHES = ((10, 40, 160), (10, 40, 160, 640), (5, 20, 80, 320))
_SEEN = 0.1  # that a view from outside weighs in links
_TURNS = 20  # rounds in which points or patches turn, one by one
_DOUBTFUL = 0.1  # the weight of a link from which it makes a side doubtful
_OFTEN = 1 << 12  # steps between checkpoints


class SeenFrom(NamedTuple):
    """Sums of the directions from which nothing hides a point, (N, 3). outside: all of them count alike.
    front: what those towards the front count more."""

    outside: NDArray[np.float32]
    front: NDArray[np.float32]


class FoundSides(NamedTuple):
    """How Scan4D found the sides of normals. doubtful: the share of the points that have links to neighbours
    which contradict their sides, 0 to 1."""

    method: Method
    doubtful: float


def facing_out(
    points: Vectors, normals: NDArray[np.float32], near: NDArray[np.int32], method: Method | None = None
) -> tuple[NDArray[np.float32], FoundSides]:
    """The normals, turned round where they point into the surface or away from the front, (N, 3).

    points, normals: (N, 3), the points distinct. near: (N, K), each point and its nearest others, nearest
    first. method: "quick" uses links and the view from outside; "fine" also uses the winding number, see
    `fine_sides`; None: "fine" if many links contradict each other.
    """
    from . import fine_sides

    linked = np.ascontiguousarray(near[:, :LINKED])
    reach = float(np.median(np.linalg.norm(points[linked[:, -1]] - points, axis=1)))
    seen_from = _seen_from(points, reach)
    oriented, bonds = _linked_sides(points, normals, linked, seen_from)
    method = method or ("fine" if fine_sides.is_unsure(bonds.weights) else "quick")
    held = bonds.weights
    if method == "fine":
        refitted = fine_sides.one_sided_normals(points, oriented, near)
        oriented, bonds = _linked_sides(points, refitted, linked, seen_from)
        turned = fine_sides.better_sides(points, oriented, near, bonds)
        oriented = fine_sides.steered_normals(points, oriented * turned[:, None], near, LINKED)
        held = bonds.weights * turned[bonds.links].prod(axis=1)
    is_doubtful = np.zeros(len(points), bool)
    is_doubtful[bonds.links[held < -_DOUBTFUL]] = True
    return oriented, FoundSides(method, float(is_doubtful.mean()))


def _linked_sides(
    points: Vectors, normals: NDArray[np.float32], linked: NDArray[np.int32], seen_from: SeenFrom
) -> tuple[NDArray[np.float32], Bonds]:
    """The normals, (N, 3), on the sides that links and the view from outside tell, and their bonds.

    linked: (N, K), each point and its neighbours.
    """
    from . import fine_sides, side_kernels

    normals = facing(normals, np.array([[1e-6, 1e-3, 1.0]]))  # whichever sign they came with
    outside, front = (_SEEN * np.einsum("ij,ij->i", normals, sums) for sums in seen_from)
    seen = outside + front
    most = len(linked) * (linked.shape[1] - 1)
    links, weights = np.empty((most, 2), np.int32), np.empty(most, np.float32)
    found = side_kernels.link(points, normals, linked, links, weights)
    links, weights = links[:found], weights[:found]
    signs = _agreeing(links, weights, seen)
    held = weights * signs[links].prod(axis=1)
    return normals * signs[:, None], fine_sides.Bonds(links, held, seen * signs, outside * signs)


def facing(normals: NDArray[np.float32], directions: NDArray[np.floating]) -> NDArray[np.float32]:
    """The normals, (N, 3), turned round where they point away from their direction."""
    away = (normals * directions).sum(axis=1) < 0
    return np.where(away[:, None], -normals, normals)


def _agreeing(
    links: NDArray[np.int32], weights: NDArray[np.floating], seen: NDArray[np.floating]
) -> NDArray[np.int8]:
    """1 or -1 for each point, (N,), so that the weights between equal ones, less those between others, and
    `seen`, (N,), signed, have a high sum. links: (L, 2). weights: (L,)."""
    sizes = np.ones(len(seen), np.int32)
    signs = _in_patches(links, weights, seen, sizes, _PATCHES[0], anew=True)
    for patches in _PATCHES[1:]:
        held = weights * signs[links].prod(axis=1)  # above 0 where the two agree
        signs = signs * _in_patches(links, held, seen * signs, sizes, patches, anew=False)
    return signs


def _in_patches(
    links: NDArray[np.int32],
    weights: NDArray[np.floating],
    seen: NDArray[np.floating],
    sizes: NDArray[np.int32],
    patches: tuple[int, ...],
    anew: bool,
) -> NDArray[np.int8]:
    """1 or -1 for each thing, (N,), as `_agreeing` has it for points: by patches of at most so many points,
    and patches of these, each turned as a whole before its parts are.

    sizes: points of each thing, (N,). anew: from nothing; else only what agrees is joined, and the sum is
    never less than with 1 everywhere.
    """
    from . import side_kernels

    checkpoint()
    if patches:
        joined, agreeing = joined_things(links, weights, sizes, patches[0], anew)
        larger = np.bincount(joined, sizes).astype(np.int32)
        bonds = summed(joined[links], weights * agreeing[links].prod(axis=1), len(larger))
        seen_of = np.bincount(joined, seen * agreeing).astype(np.float64)
        of_patches = _in_patches(*bonds, seen_of, larger, patches[1:], anew)
        signs = agreeing * of_patches[joined]
    elif anew:
        outside = len(sizes)  # the view, beside all patches
        pairs = np.concatenate([links, np.column_stack([np.arange(outside), np.full(outside, outside)])])
        signs = _agreement(pairs, np.concatenate([weights, seen]))
        signs = signs[:-1] * signs[-1]
    else:
        signs = np.ones(len(sizes), np.int8)
    side_kernels.settle(links, weights, seen, _TURNS, signs)
    return signs


def _agreement(pairs: NDArray[np.intp], bonds: NDArray[np.float64]) -> NDArray[np.int8]:
    """1 or -1 for each thing, (M,), so that bonds between equal ones are above 0 as far as can be.

    pairs: (P, 2) of things 0..M-1. bonds: (P,). The pair with the strongest bond becomes one, whose bonds are
    the sums of theirs, and so on.
    """
    bound: list[dict[int, float]] = [{} for _ in range(int(pairs.max()) + 1)]
    for (one, other), bond in zip(pairs.tolist(), bonds.tolist(), strict=True):
        bound[one][other] = bound[other][one] = bond
    strongest = [(-abs(bond), *pair) for pair, bond in zip(pairs.tolist(), bonds.tolist(), strict=True)]
    heapq.heapify(strongest)
    joined: list[tuple[int, int, int]] = []
    while strongest:
        strength, kept, gone = heapq.heappop(strongest)
        bond = bound[kept].get(gone)
        if bond is None or abs(bond) != -strength:
            continue  # it has changed since
        if len(joined) % _OFTEN == 0:
            checkpoint()
        if len(bound[kept]) < len(bound[gone]):
            kept, gone = gone, kept
        sign = 1 if bond >= 0 else -1
        joined.append((gone, kept, sign))
        del bound[gone][kept], bound[kept][gone]
        for other, of_gone in bound[gone].items():
            del bound[other][gone]
            total = bound[kept].get(other, 0.0) + sign * of_gone
            bound[kept][other] = bound[other][kept] = total
            heapq.heappush(strongest, (-abs(total), min(kept, other), max(kept, other)))
        bound[gone] = {}
    agreeing = np.ones(len(bound), np.int8)
    for gone, kept, sign in reversed(joined):
        agreeing[gone] = sign * agreeing[kept]
    return agreeing


def _seen_from(points: Vectors, reach: float) -> SeenFrom:
    """Sums for each point of the directions from which nothing hides it."""
    center = np.median(points, axis=0)
    half = 2 * np.quantile(np.linalg.norm(points - center, axis=1), 0.98)  # strays beyond go to the rim
    cell = max(_CELL * reach, 2 * half / _GRID) or 1.0
    local = np.clip((points - center) / cell, -_GRID, _GRID).astype(np.float32)  # in cells
    outside, front = np.zeros_like(local), np.zeros_like(local)
    for axis in _half_sphere(_AXES).astype(np.float32):
        checkpoint()
        from_front, from_back = _visible(local, axis, side=int(2 * half / cell) + 1)
        outside += (from_front - from_back)[:, None] * axis
        front += (_FRONT_BONUS * axis[2] * (from_front + from_back))[:, None] * axis
    return SeenFrom(outside, front)


def _visible(
    points: NDArray[np.float32], axis: NDArray[np.float32], side: int
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """How far each point is seen from the two ends of an axis, the positive one first, 0 to 1, (N,).

    points: in cells. A view looks at side x side cells; in each the first point is seen, and those behind it
    the less the farther they are: of the two sides of something thin, the one in front counts more.
    """
    from . import side_kernels

    across = np.cross(axis, np.eye(3, dtype=np.float32)[np.abs(axis).argmin()])
    across /= np.linalg.norm(across)
    x, y, depth = (points @ np.stack([across, np.cross(axis, across), axis], axis=1)).T
    front, back = np.empty(len(points), np.float32), np.empty(len(points), np.float32)
    side_kernels.see(x, y, depth, side, np.float32(_DEPTH / _CELL), front, back)
    return front, back


def _half_sphere(count: int) -> Vectors:
    """Directions spread evenly over the half sphere around +z, (count, 3)."""
    step = np.arange(count) + 0.5
    z = step / count
    turn = step * np.pi * (3 - np.sqrt(5))  # the golden angle
    return np.stack([np.sqrt(1 - z * z) * np.cos(turn), np.sqrt(1 - z * z) * np.sin(turn), z], axis=1)

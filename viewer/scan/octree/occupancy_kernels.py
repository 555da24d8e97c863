"""The inner loops that code which children nodes have, compiled by numba.

A node has a single child, which is one symbol of eight, or several, a binary decision each. Situations of
several contexts add up to a score, which is a logarithm of odds, and each learns from the error (logistic
regression). The contexts are nodes and children nearby, as in MPEG's G-PCC, and a plane through the nodes
around the parent. All that a probability depends on is whole numbers, and sums, products, quotients and
roots, which all processors round alike.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...compiled import compiled, inlined

MOST = 20  # bytes that a node takes, and a level beside

_SELF = 13  # of 3 x 3 x 3 nodes around one, x fastest, itself
_STEPS = 32  # of a node's edge
_FEWEST = 4  # nodes that tell of a plane
_DISTANCE = 20  # steps of a distance for each edge of a node
_FINER = 8  # bits of a distance below a step, while it is summed
_FARTHEST, _FARTHEST_OTHER = 31, 15  # steps
_BLOCK = 512  # planes that are fitted together
_STEEP = 1e-9  # the least that eigenvalues tell of a plane
_WIDE, _WIDER = 0.2, 0.6  # squared widths of the nodes around, in edges of a child

# Where the situations of each context begin.
_SAME = 0  # as expected: children expected and nodes around
_FACES = _SAME + (16 << 4)  # single: nodes at faces and quality of the plane
_CROWD = _FACES + (8 << 4)  # nodes around and children of the parent
_OFF = _CROWD + (32 << 3)  # distance from the plane and its quality
_SIDES_OF_ONE = _OFF + (16 << 4)  # which child: nodes beside it
_PLANE_OF_ONE = _SIDES_OF_ONE + (1 << 14)  # its distance from the plane
_TOUCHED = _PLANE_OF_ONE + (1 << 11)  # whether a child: children that touch it
_PLANE = _TOUCHED + (1 << 16)  # its distance from the plane, and those of children behind
_KNOWN = _PLANE + (1 << 17)  # children before it, and nodes at faces
_LIKELY = _KNOWN + (64 << 8)  # whether it is expected, and what else of the mask
_EXPECTED_OF_ONE = _LIKELY + (16 << 5)  # which child: the mask that is expected
_RECENT = _EXPECTED_OF_ONE + (512 << 3)  # as expected: whether the nodes before it were
SITUATIONS = _RECENT + (16 << 4)

_COUNT = 31  # up to which a situation counts
_SCORE = 12  # bits of a score below a step
_GROWTH = 257 / 256  # of odds for a step of a score
_LARGEST = 2048  # steps of a score


class Occupied(NamedTuple):
    """Nodes of a level. masks, first: (n + 1,), children and the first child of each, and of none. around:
    (n, 27), the nodes around each, x fastest, n: none. beside: (n,), which of these exist, as bits."""

    masks: NDArray[np.uint8]
    first: NDArray[np.int32]
    around: NDArray[np.int32]
    beside: NDArray[np.int32]


class Coded(NamedTuple):
    """The level that is coded. beside: as of a `Occupied`. expected: (n,), masks that are expected, 0: none.
    agrees: (m,), whether the masks of the level above are as expected. masks: (n + 1,), the last for none."""

    beside: NDArray[np.int32]
    expected: NDArray[np.uint8]
    agrees: NDArray[np.bool_]
    masks: NDArray[np.uint8]


# --- tables -------------------------------------------------------------------------------


def _middles() -> NDArray[np.int64]:
    """(256, 3): the mean position of the children in a mask, from the middle of their node, in steps."""
    places = _OCTANTS * (_STEPS // 2) - _STEPS // 4
    counts = np.maximum(_CHILDREN.sum(axis=1, keepdims=True), 1)
    return (2 * _CHILDREN @ places + counts) // (2 * counts)


def _moments() -> NDArray[np.int32]:
    """(27, 256, 10): of each node around one, by its mask: weight by distance, first and second moments."""
    x, y, z = places = np.moveaxis(_AROUND[:, None] * _STEPS + _middles(), -1, 0)
    weights = 2**20 // (16 + ((places**2).sum(axis=0) >> 6)) ** 2
    terms = 1 + 0 * x, x, y, z, x * x, y * y, z * z, x * y, x * z, y * z
    return np.ascontiguousarray(weights[..., None] * np.stack(terms, axis=-1), np.int32)


def _as_cells(places: NDArray[np.int64]) -> NDArray[np.int64]:
    """(256,): children in a mask as bits of 3 x 3 x 3 cells. places: (8, 3), of each child there, from 0."""
    is_there = ((places >= 0) & (places < 3)).all(axis=1)
    return _CHILDREN @ np.where(is_there, 1 << np.maximum(places, 0) @ _CUBE, 0)


def _corner(cells: NDArray[np.int64]) -> NDArray[np.int64]:
    """The first 2 x 2 x 2 of 3 x 3 x 3 bits."""
    return cells & 3 | cells >> 1 & 12 | cells >> 5 & 48 | cells >> 6 & 192


def _beside(octant: int, cells: NDArray[np.int64]) -> NDArray[np.int64]:
    """The seven other bits of 2 x 2 x 2, by the axes along which each lies from one. octant: the child of the
    node that they touch."""
    others = [7 ^ octant ^ bit for bit in range(1, 8)]
    return _CHILDREN[cells][..., others] @ (1 << np.arange(7))


def _sides() -> NDArray[np.int64]:
    """(3, 512, 8): for each child, bits of the 7 nodes that touch it, and of the 7 opposite, of those around
    its node; of each 9 of these."""
    cells = np.arange(512) << 9 * np.arange(3)[:, None]
    near = [_beside(child, _corner(cells >> corner)) for child, corner in enumerate(_CORNERS)]
    far = [_beside(7 - child, _corner(cells >> _SELF - corner)) for child, corner in enumerate(_CORNERS)]
    return np.stack(near, axis=-1) << 7 | np.stack(far, axis=-1)


def _together(values: NDArray[np.int64], width: int) -> NDArray[np.int64]:
    """Values of a last axis as one number, with so many bits for each."""
    return (values << width * np.arange(values.shape[-1])).sum(axis=-1)


def _touching(cells: NDArray[np.int64]) -> NDArray[np.int64]:
    """The children, as cells, that touch each child from before: 8 bits for each."""
    return _together(np.stack([_corner(cells >> corner) & 127 for corner in _CORNERS], axis=-1), 8)


def _moves() -> NDArray[np.int64]:
    """(8, 27): the nodes around a child in an octant: 8 times which is its parent, of 27, and its octant."""
    places = _AROUND + _OCTANTS[:, None]
    return 8 * (_SELF + (places >> 1) @ _CUBE) + (places & 1) @ np.array([1, 2, 4])


def _rates(gain: float) -> NDArray[np.int64]:
    """How far a situation learns, by its count, in 2^-16 of the score; the lowest bit says that it counts."""
    counts = np.arange(_COUNT + 1)
    rates = np.rint(gain * np.maximum(1 / (counts + 1.5), 0.04) * 2**15).astype(np.int64)
    return 2 * rates + (counts < _COUNT)


_CUBE = np.array([1, 3, 9])  # of 3 x 3 x 3, x fastest
_AROUND = np.indices((3, 3, 3))[::-1].reshape(3, 27).T - 1
_OCTANTS = np.indices((2, 2, 2))[::-1].reshape(3, 8).T  # x fastest
_CHILDREN = np.unpackbits(np.arange(256, dtype=np.uint8)[:, None], axis=1, bitorder="little").astype(np.int64)
_HOW_MANY = np.bitwise_count(np.arange(512)).astype(np.int64)
_LOWEST = np.array([max((mask & -mask).bit_length() - 1, 0) for mask in range(256)], np.int64)
_RANKS = _HOW_MANY[np.arange(256)[:, None] & (1 << np.arange(8)) - 1]  # of a child, by mask
_HASH = 0x077CB531  # a bit times this has five bits of its own (de Bruijn)
_BITS = np.argsort([(_HASH << bit & 0xFFFFFFFF) >> 27 for bit in range(32)])
_MOMENTS = _moments()
_CORNERS = _OCTANTS @ _CUBE  # of 2 x 2 x 2 among 3 x 3 x 3
_MOVES = _moves()
_BLOCKS = _SELF + ((2 * _OCTANTS[:, None] - 1) * _OCTANTS) @ _CUBE  # 2 x 2 x 2 of 27 nodes around a child
# Of 27 nodes around a child in an octant, those that are children of each of 2 x 2 x 2 nodes, by its mask.
_REACHED = np.stack(
    [[_as_cells(2 * block * (2 * own - 1) - own + _OCTANTS + 1) for block in _OCTANTS] for own in _OCTANTS]
)
_SIDES = np.stack([_together(_sides()[..., :4], 16), _together(_sides()[..., 4:], 16)], axis=-1)
# Of a node before another, by its number, children that touch those of this one.
_FROM_BEFORE = np.stack([_touching(_as_cells(_OCTANTS + 1 - 2 * before)) for before in _OCTANTS])
_FROM_WITHIN = _touching(1 << _SELF + _CORNERS)
_ODDS = np.cumprod(np.full(_LARGEST, _GROWTH))
_ODDS = np.concatenate([1 / _ODDS[::-1], [1.0], _ODDS[:-1]])  # of each score
_WEIGHTS = np.maximum(np.rint(64 * _ODDS), 1).astype(np.int32)
_CHANCES = np.clip(np.rint(65536 * _ODDS / (1 + _ODDS)), 64, 65536 - 64).astype(np.uint16)
_FOR_ONE, _FOR_SOME = _rates(1.5), _rates(2.0)


# --- what is around -----------------------------------------------------------------------


@inlined
def _whole(value: Any) -> Any:
    """A number with a sign: numba makes floating point of sums with unsigned ones."""
    return np.int64(value)


@inlined
def _lowest(bits: int) -> np.uint32:
    """Number of the lowest bit that is set."""
    return np.uint32(_BITS[np.uint32((bits & -bits) * _HASH >> 27 & 31)])


@compiled
def look_around(above: Occupied, nodes: tuple[int, int], beside: NDArray[np.int32]) -> None:
    """Fill what is `beside` the children of some nodes. nodes: the first, and one behind the last."""
    masks, first, around = above.masks, above.first, above.around
    for node in range(nodes[0], nodes[1]):
        left, child = _whole(masks[node]), first[node]
        while left:
            octant = _LOWEST[np.uint32(left)]
            left &= left - 1
            bits = 0
            for block in range(8):
                other = np.uint32(around[node, np.uint32(_BLOCKS[octant, block])])
                bits |= _REACHED[octant, block, masks[other]]
            beside[child] = bits
            child += 1


@compiled
def go_down(
    above: Occupied, beside: NDArray[np.int32], nodes: tuple[int, int], below: NDArray[np.int32]
) -> None:
    """Fill what is `around` the children of some nodes, (m, 27), from what is `beside` them, (m,)."""
    masks, first, around = above.masks, above.first, above.around
    for node in range(nodes[0], nodes[1]):
        left, child = _whole(masks[node]), first[node]
        while left:
            octant = _LOWEST[np.uint32(left)]
            left &= left - 1
            below[child] = len(below)
            bits = _whole(beside[child])
            while bits:
                i = _lowest(bits)
                bits &= bits - 1
                move = _MOVES[octant, i]
                other = np.uint32(around[node, np.uint32(move >> 3)])
                below[child, i] = first[other] + _RANKS[masks[other], np.uint32(move & 7)]
            child += 1


@compiled
def fit_planes(above: Occupied, nodes: tuple[int, int], planes: NDArray[np.int32]) -> None:
    """Fit planes to the middles of what is in the 27 nodes around some nodes.

    planes: (5, n), of each a quarter of the unit normal; how far it is from the middle of its node, against
    the normal; both by edges of a child, in parts of steps; and its quality from 1 to 12, 0: there is none.
    """
    masks, around, beside = above.masks, above.around, above.beside
    sums, found = np.zeros((10, _BLOCK), np.int64), np.zeros((5, _BLOCK), np.int32)
    for start in range(nodes[0], nodes[1], _BLOCK):
        stop = min(start + _BLOCK, nodes[1])
        for node in range(start, stop):
            _sum_up(masks, around[node], _whole(beside[node]), sums, node - start)
        _fit(sums, found, stop - start)
        planes[:, start:stop] = found[:, : stop - start]


@inlined
def _sum_up(
    masks: NDArray[np.uint8], around: NDArray[np.int32], bits: int, sums: NDArray[np.int64], at: int
) -> None:
    """Sum the moments of the nodes around one, (27,), of which bits exist. No sum of weights: too few."""
    count, total, x, y, z = 0, 0, 0, 0, 0
    xx, yy, zz, xy, xz, yz = 0, 0, 0, 0, 0, 0
    while bits:
        i = _lowest(bits)
        bits &= bits - 1
        mask = masks[np.uint32(around[i])]
        count += 1
        total += _MOMENTS[i, mask, 0]
        x += _MOMENTS[i, mask, 1]
        y += _MOMENTS[i, mask, 2]
        z += _MOMENTS[i, mask, 3]
        xx += _MOMENTS[i, mask, 4]
        yy += _MOMENTS[i, mask, 5]
        zz += _MOMENTS[i, mask, 6]
        xy += _MOMENTS[i, mask, 7]
        xz += _MOMENTS[i, mask, 8]
        yz += _MOMENTS[i, mask, 9]
    sums[0, at], sums[1, at], sums[2, at], sums[3, at] = total if count >= _FEWEST else 0, x, y, z
    sums[4, at], sums[5, at], sums[6, at] = xx, yy, zz
    sums[7, at], sums[8, at], sums[9, at] = xy, xz, yz


@compiled
def _fit(sums: NDArray[np.int64], planes: NDArray[np.int32], count: int) -> None:
    """Fit planes to moments. Straight on, so that the processor works on several at a time."""
    for i in range(count):
        share = np.divide(2.0 / _STEPS, np.float64(max(sums[0, i], 1)))
        ax, ay, az = sums[1, i] * share, sums[2, i] * share, sums[3, i] * share
        share *= 2.0 / _STEPS
        cxx, cyy = sums[4, i] * share - ax * ax, sums[5, i] * share - ay * ay
        czz, cxy = sums[6, i] * share - az * az, sums[7, i] * share - ax * ay
        cxz, cyz = sums[8, i] * share - ax * az, sums[9, i] * share - ay * az
        # The adjugate of the covariance, whose largest eigenvector is that of its smallest eigenvalue.
        a, b, c = cyy * czz - cyz * cyz, cxx * czz - cxz * cxz, cxx * cyy - cxy * cxy
        d, e, f = cxz * cyz - cxy * czz, cxy * cyz - cxz * cyy, cxy * cxz - cxx * cyz
        pairs = a + b + c  # of eigenvalues, their products
        for _ in range(2):  # to the fourth power
            a, b, c, d, e, f = (
                a * a + d * d + e * e,
                b * b + d * d + f * f,
                c * c + e * e + f * f,
                a * d + d * b + e * f,
                a * e + d * f + e * c,
                d * e + b * f + f * c,
            )
        is_first, is_second = a >= max(b, c), b >= c
        nx = a if is_first else d if is_second else e
        ny = d if is_first else b if is_second else f
        nz = e if is_first else f if is_second else c
        is_plane = (sums[0, i] > 0) & (pairs > _STEEP)
        share = np.divide(1.0, np.sqrt(nx * nx + ny * ny + nz * nz)) if is_plane else 0.0
        nx, ny, nz = nx * share, ny * share, nz * share
        thick = nx * (cxx * nx + 2 * (cxy * ny + cxz * nz)) + ny * (cyy * ny + 2 * cyz * nz) + czz * nz * nz
        rest = cxx + cyy + czz - thick
        both = pairs - thick * rest  # the product of the other two, whose sum is the rest
        width = _whole((rest > 2 * _WIDE) & (both >= _WIDE * (rest - _WIDE)))
        width += _whole((rest > 2 * _WIDER) & (both >= _WIDER * (rest - _WIDER)))
        quality = 1 + _whole(thick >= 1 / 64) + _whole(thick >= 4 / 64) + _whole(thick >= 9 / 64)
        scale = _DISTANCE << _FINER
        planes[0, i], planes[1, i] = np.int32(nx * scale / 4), np.int32(ny * scale / 4)
        planes[2, i] = np.int32(nz * scale / 4)
        planes[3, i] = np.int32(-scale * (nx * ax + ny * ay + nz * az))
        planes[4, i] = quality + 4 * width if is_plane else 0


@compiled
def follow(
    masks: NDArray[np.uint8],
    before: NDArray[np.uint8],
    counterparts: NDArray[np.int32],
    agrees: NDArray[np.bool_],
    below: NDArray[np.int32],
) -> None:
    """Find the children of nodes in the tree before.

    masks, before: (n + 1,), (m + 1,), of the nodes of a level and of the tree before, the last of none.
    counterparts: (n,), the same octants there, -1: none. Filled are agrees, (n,): whether both masks are the
    same; below: (k,), counterparts of the children.
    """
    first = np.empty(len(before), np.int32)
    total = 0
    for node in range(len(before)):
        first[node] = total
        total += _HOW_MANY[before[node]]
    child = 0
    for node in range(len(masks) - 1):
        other = _whole(counterparts[node])
        there = _whole(before[np.uint32(other if other >= 0 else len(before) - 1)])
        agrees[node] = there == masks[node]
        left = _whole(masks[node])
        while left:
            octant = _LOWEST[np.uint32(left)]
            left &= left - 1
            is_there = there >> octant & 1
            below[child] = first[other] + _RANKS[there, np.uint32(octant)] if is_there else -1
            child += 1


# --- coding -------------------------------------------------------------------------------


@compiled
def code_part(
    above: Occupied,
    planes: NDArray[np.int32],
    nodes: tuple[int, int],
    coded: Coded,
    learnt: NDArray[np.int32],
    stored: NDArray[np.uint8],
    decodes: bool,
) -> int:
    """Code the masks of the children of some nodes, or decode them from what is stored. Returns the bytes
    taken.

    planes: see `fit_planes`. learnt: (SITUATIONS,), score and count of each situation. stored: to code, MOST
    bytes for each node and as many more; to decode, what lies beyond its end counts as zeros.
    """
    masks = coded.masks
    begin = _whole(above.first[nodes[0]])
    corners, distances, sides, weights = _eight(), _eight(), _eight(), _eight()
    recent = _whole(0)  # whether each of the last nodes was as expected, a bit each
    state = 1 << 48, _whole(0), 0  # the span that is left, the place in it, bytes
    if decodes:
        state = 1 << 48, _start(stored), 6
    for parent in range(nodes[0], nodes[1]):
        children, node = _whole(above.masks[parent]), _whole(above.first[parent])
        off, quality = _whole(planes[3, parent]), _whole(planes[4, parent])
        for child in range(8):
            corners[child] = _toward(planes, parent, child)
        agrees = _whole(coded.agrees[parent])
        left = children
        while left:
            octant = _LOWEST[np.uint32(left)]
            left &= left - 1
            beside, expected, mask = (
                _whole(coded.beside[node]), _whole(coded.expected[node]), _whole(masks[node])
            )  # fmt: skip
            faces, crowd = _spread(beside, sides)
            if expected:
                likely = _HOW_MANY[expected] * 2 + agrees - 2
                a, b = (
                    np.uint32(_SAME + (likely << 4) + min(crowd, 15)),
                    np.uint32(_RECENT + (likely << 4) + recent),
                )
                expected |= agrees << 8
                chance = _whole(_CHANCES[_score(_whole(learnt[a]) + _whole(learnt[b]))])
                state, bit = _decide(state, chance, mask == expected & 255, stored, decodes)
                error = (bit << 16) - chance
                _learn(learnt, a, error, _FOR_SOME)
                _learn(learnt, b, error, _FOR_SOME)
                recent = (recent << 1 | bit) & 15
                if bit:
                    masks[node] = expected & 255
                    node += 1
                    continue
            middle = off + 2 * corners[np.uint32(octant)]
            for child in range(8):
                distances[child] = min(abs(middle + corners[child]) >> _FINER, _FARTHEST)
            a = np.uint32(_FACES + (_HOW_MANY[faces] << 4) + quality)
            b = np.uint32(_CROWD + (crowd << 3) + _HOW_MANY[children] - 1)
            c = np.uint32(_OFF + (min(abs(middle) >> _FINER + 1, 15) << 4) + quality)
            chance = _whole(_CHANCES[_score(_whole(learnt[a]) + _whole(learnt[b]) + _whole(learnt[c]))])
            state, bit = _decide(state, chance, (mask != 0) & (mask & mask - 1 == 0), stored, decodes)
            error = (bit << 16) - chance
            _learn(learnt, a, error, _FOR_SOME)
            _learn(learnt, b, error, _FOR_SOME)
            _learn(learnt, c, error, _FOR_SOME)
            if bit:
                total = _weigh(learnt, sides, distances, expected, quality, weights)
                state, child = _choose(state, weights, total, _LOWEST[mask], stored, decodes)
                _learn_child(learnt, sides, distances, expected, weights, child)
                masks[node] = 1 << child
            else:
                touched = _before(above, parent, octant, beside, begin, masks)
                known = _whole(_KNOWN + (faces << 8))
                _look_behind(distances, expected, quality)
                around = touched, known, sides, distances
                state, found = _code_several(state, learnt, around, (expected, mask), stored, decodes)
                masks[node] = found
            node += 1
    return state[2] if decodes else _finished(stored, state)


@inlined
def _eight() -> NDArray[np.int64]:
    return np.zeros(8, np.int64)


@inlined
def _toward(planes: NDArray[np.int32], parent: int, child: int) -> int:
    """How far a child is along the normal of a plane from the middle of its node."""
    x, y, z = _whole(planes[0, parent]), _whole(planes[1, parent]), _whole(planes[2, parent])
    return (x if child & 1 else -x) + (y if child & 2 else -y) + (z if child & 4 else -z)


@inlined
def _spread(beside: int, sides: NDArray[np.int64]) -> tuple[int, int]:
    """Nodes around each child on both its sides, 14 bits. Returns those at the node's faces, six bits, and
    how many there are around it."""
    low, middle, high = np.uint32(beside & 511), np.uint32(beside >> 9 & 511), np.uint32(beside >> 18)
    first = _SIDES[0, low, 0] | _SIDES[1, middle, 0] | _SIDES[2, high, 0]
    second = _SIDES[0, low, 1] | _SIDES[1, middle, 1] | _SIDES[2, high, 1]
    for child in range(4):
        sides[child] = first >> 16 * child & 0x3FFF
        sides[child + 4] = second >> 16 * child & 0x3FFF
    faces = (
        beside >> 4 & 1 | beside >> 9 & 2 | beside >> 10 & 4 | beside >> 11 & 8 | beside >> 12 & 16
        | beside >> 17 & 32
    )  # fmt: skip
    return faces, _HOW_MANY[low] + _HOW_MANY[middle] + _HOW_MANY[high]


@inlined
def _expectation(expected: int, child: int) -> int:
    """0: no mask is expected; 1: one without this child; 2, 3: with it, if the node above is as expected."""
    return 1 + (expected >> child & 1) * (1 + (expected >> 8)) if expected else 0


@inlined
def _weigh(
    learnt: NDArray[np.int32],
    sides: NDArray[np.int64],
    distances: NDArray[np.int64],
    expected: int,
    quality: int,
    weights: NDArray[np.int64],
) -> int:
    """Weights of the children to be the single one. Returns their sum. Sides and distances become their
    situations."""
    total = 0
    for child in range(8):
        plane = (distances[child] << 4 | quality) << 2 | _expectation(expected, child)
        sides[child] += _SIDES_OF_ONE
        distances[child] = _PLANE_OF_ONE + plane
        a, b = np.uint32(sides[child]), np.uint32(distances[child])
        score = _whole(learnt[a]) + _whole(learnt[b])
        if expected:
            score += _whole(learnt[np.uint32(_EXPECTED_OF_ONE + (expected << 3 | child))])
        weights[child] = _whole(_WEIGHTS[_score(score)])
        total += weights[child]
    return total


@inlined
def _choose(
    state: tuple[int, int, int],
    weights: NDArray[np.int64],
    total: int,
    child: int,
    stored: NDArray[np.uint8],
    decodes: bool,
) -> tuple[tuple[int, int, int], int]:
    """Code the single child. Weights become probabilities, of 2^16."""
    share = _whole(np.divide(65528.0 * 2**20, np.float64(total)))
    for i in range(8):
        weights[i] = 1 + (weights[i] * share >> 20)
    span, place, at = state
    part = span >> 16
    if decodes:
        child = 0
        while child < 7 and place >= part * weights[child]:
            place -= part * weights[child]
            child += 1
    else:
        for i in range(child):
            place += part * weights[i]
    return _renewed(part * weights[child], place, at, stored, decodes), child


@inlined
def _learn_child(
    learnt: NDArray[np.int32],
    sides: NDArray[np.int64],
    distances: NDArray[np.int64],
    expected: int,
    weights: NDArray[np.int64],
    child: int,
) -> None:
    weights[child] -= 1 << 16
    if expected:
        for i in range(8):
            _learn(learnt, np.uint32(_EXPECTED_OF_ONE + (expected << 3 | i)), -weights[i], _FOR_ONE)
    for i in range(8):
        _learn(learnt, np.uint32(sides[i]), -weights[i], _FOR_ONE)
        _learn(learnt, np.uint32(distances[i]), -weights[i], _FOR_ONE)


@inlined
def _before(
    above: Occupied, parent: int, octant: int, beside: int, begin: int, masks: NDArray[np.uint8]
) -> int:
    """Children that touch those of a node, of nodes before it, from the first of the part on."""
    touched = 0
    for before in range(1, 8):
        there = _SELF - _CORNERS[before]
        move = _MOVES[octant, there]
        beyond = np.uint32(above.around[parent, np.uint32(move >> 3)])
        other = _whole(above.first[beyond]) + _RANKS[above.masks[beyond], np.uint32(move & 7)]
        if beside >> there & 1 == 0 or other < begin:
            other = len(masks) - 1
        touched |= _FROM_BEFORE[before, masks[np.uint32(other)]]
    return touched


@inlined
def _look_behind(distances: NDArray[np.int64], expected: int, quality: int) -> None:
    """Distances become situations, with the least of the children behind each."""
    least = _FARTHEST_OTHER
    for child in range(7, -1, -1):
        distance = distances[child]
        both = (distance << 4 | least) << 4 | quality
        distances[child] = _PLANE + (both << 4 | _expectation(expected, child) << 2)
        least = min(distance, least)


@inlined
def _code_several(
    state: tuple[int, int, int],
    learnt: NDArray[np.int32],
    around: tuple[int, int, NDArray[np.int64], NDArray[np.int64]],
    masks: tuple[int, int],
    stored: NDArray[np.uint8],
    decodes: bool,
) -> tuple[tuple[int, int, int], int]:
    """Code a mask that has not a single child. around: children that touch those of the node; where the
    situations of the nodes at its faces begin; sides and distances of each child. masks: the one that is
    expected, and this one."""
    (touched, known, sides, distances), (expected, mask), found, count = around, masks, 0, 0
    for child in range(8):
        if child == 7 and count < 2:
            found |= count << 7  # a single child is no case here
            break
        near = (touched >> 8 * child & 127) << 7 | sides[child] >> 7
        a = np.uint32(_TOUCHED + (near << 2 | count))
        b = np.uint32(distances[child] | count)
        c = np.uint32(known + (1 << child | found))
        wrong = min(_HOW_MANY[(found ^ expected) & (1 << child) - 1], 3)
        likely = (_HOW_MANY[expected & 255] << 2 | wrong) << 1 | expected >> child & 1
        d = np.uint32(_LIKELY + (likely << 2 | count))
        score = _score(_whole(learnt[a]) + _whole(learnt[b]) + _whole(learnt[c]) + _whole(learnt[d]))
        chance = _whole(_CHANCES[score])
        state, bit = _decide(state, chance, mask >> child & 1, stored, decodes)
        error = (bit << 16) - chance
        _learn(learnt, a, error, _FOR_SOME)
        _learn(learnt, b, error, _FOR_SOME)
        _learn(learnt, c, error, _FOR_SOME)
        _learn(learnt, d, error, _FOR_SOME)
        if bit:
            found |= 1 << child
            count = min(count + 1, 2)
            touched |= _FROM_WITHIN[child]
    return state, found


@inlined
def _score(total: int) -> np.uint32:
    """The number of the score that a sum of situations is."""
    return np.uint32(min(max((total >> _SCORE + 5) + _LARGEST, 0), 2 * _LARGEST - 1))


@inlined
def _learn(learnt: NDArray[np.int32], situation: np.uint32, error: int, rates: NDArray[np.int64]) -> None:
    """Score and count of a situation, after an error of 2^-16."""
    value = _whole(learnt[situation])
    rate = rates[np.uint32(value & _COUNT)]
    learnt[situation] = value + (error * rate >> 12 << 5) + (rate & 1)


@inlined
def _decide(
    state: tuple[int, int, int], chance: int, bit: int, stored: NDArray[np.uint8], decodes: bool
) -> tuple[tuple[int, int, int], int]:
    """Code a bit. chance: that it is 1, of 2^16."""
    span, place, at = state
    split = (span >> 16) * chance
    found = _whole(place < split) if decodes else _whole(bit)
    if found:
        span = split
    else:
        span -= split
        place += -split if decodes else split
    return _renewed(span, place, at, stored, decodes), found


@inlined
def _renewed(
    span: int, place: int, at: int, stored: NDArray[np.uint8], decodes: bool
) -> tuple[int, int, int]:
    """The state with a span of more than 32 bits."""
    if span >> 32 == 0:
        if decodes:
            place = place << 16 | _byte(stored, at) << 8 | _byte(stored, at + 1)
        else:
            place = _emit(stored, at, place)
        span, at = span << 16, at + 2
    return span, place, at


@inlined
def _byte(stored: NDArray[np.uint8], at: int) -> int:
    return _whole(stored[at]) if at < len(stored) else _whole(0)


@compiled
def _start(stored: NDArray[np.uint8]) -> int:
    """The first place in a span of 48 bits."""
    place = _whole(0)
    for at in range(6):
        place = place << 8 | _byte(stored, at)
    return place


@compiled
def _emit(stored: NDArray[np.uint8], at: int, place: int) -> int:
    """Write the upper 16 of 48 bits, and what is carried over. Returns the rest."""
    if place >> 48:
        back = at - 1
        while stored[back] == 255:
            stored[back] = 0
            back -= 1
        stored[back] += 1
    stored[at], stored[at + 1] = place >> 40 & 255, place >> 32 & 255
    return (place & 0xFFFFFFFF) << 16


@compiled
def _finished(stored: NDArray[np.uint8], state: tuple[int, int, int]) -> int:
    """Write the fewest bytes within the span, with zeros behind; one at least for a level. Returns the bytes
    in all."""
    span, place, at = state
    for count in range(1 if at == 0 else 0, 7):
        end = place + span - 1 >> 48 - 8 * count << 48 - 8 * count
        if end >= place:
            for i in range(0, 6, 2):
                end = _emit(stored, at + i, end)
            return at + count
    return at + 6

"""The inner loops that code which children nodes have, compiled by numba.

Each child is a binary decision, whose probability is mixed from what several contexts have seen (Mahoney
2005, Adaptive Weighing of Context Models for Lossless Data Compression). The contexts are nodes and children
nearby, as in MPEG's G-PCC, and a plane through the nodes around the parent. All that a probability depends on
is whole numbers, and sums, products, quotients and roots, which all processors round alike.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...compiled import compiled, inlined

CONTEXTS = 5
_OF_BESIDE, _OF_PLANES, _OF_CHILDREN = 1 << 16, 2 << 16, 3 << 16  # where the situations of each begin
_OF_EXPECTED = _OF_CHILDREN + (64 << 8)
SITUATIONS = _OF_EXPECTED + 9 * 32
WEIGHTS = 8 * 3 * 2 * CONTEXTS
MOST = 16  # bytes that a node takes, and a level beside

_SELF = 13  # of 3 x 3 x 3 nodes around one, x fastest, itself
_COUNT = 255  # up to which a situation counts
_RATE = 80  # of learning weights
_STEPS = 32  # of a node's edge
_FEWEST = 4  # nodes that tell of a plane
_DISTANCE = 20  # steps of a distance for each edge of a node
_FARTHEST, _FARTHEST_OTHER = 31, 15  # steps


class Surroundings(NamedTuple):
    """Surroundings of some consecutive nodes of a level.

    before: (n, 7) int32, nodes that touch each where no coordinate is larger: less by one along the axes
    whose bits their number from 1 on has. Counted from the first node; less than 0: none. faces: (n,) uint8,
    bits of the nodes at its faces. sides: (n, 8) uint16, for each child bits of the 7 nodes that touch it,
    and of the 7 opposite. planes: (n, 8) uint16, how far each child is from the plane nearby, the least of
    the children after it, and the quality of the plane.
    """

    before: NDArray[np.int32]
    faces: NDArray[np.uint8]
    sides: NDArray[np.uint16]
    planes: NDArray[np.uint16]

    @classmethod
    def empty(cls, nodes: int) -> Surroundings:
        """Arrays for so many nodes."""
        each = np.empty((2, nodes, 8), np.uint16)
        return cls(np.empty((nodes, 7), np.int32), np.empty(nodes, np.uint8), each[0], each[1])


class Models(NamedTuple):
    """Models of what is likely.

    seen: (SITUATIONS,) uint32, probability, of 2^24, and count of each situation. weights: (WEIGHTS,) int64,
    of 2^16, of contexts by child, by how many children before it are there, and by whether there is a mask
    that is expected.
    """

    seen: NDArray[np.uint32]
    weights: NDArray[np.int64]

    @classmethod
    def new(cls) -> Models:
        """Models that have seen nothing."""
        return cls(np.full(SITUATIONS, 5 << 28, np.uint32), np.full(WEIGHTS, 20_000, np.int64))


# --- tables -------------------------------------------------------------------------------


def _squashed() -> NDArray[np.int16]:
    """4096 / (1 + exp(-x / 256)) of x + 2048, lines between 33 values."""
    knots = np.array(
        [1, 2, 3, 6, 10, 16, 27, 45, 73, 120, 194, 310, 488, 747, 1101, 1546, 2047, 2549, 2994, 3348, 3607,
         3785, 3901, 3975, 4022, 4050, 4068, 4079, 4085, 4089, 4092, 4093, 4094]
    )  # fmt: skip
    left, part = np.divmod(np.arange(4096), 128)
    return ((knots[left] * (128 - part) + knots[left + 1] * part + 64) >> 7).astype(np.int16)


def _middles() -> NDArray[np.int64]:
    """(256, 3): the mean position of the children in a mask, from the middle of their node, in steps."""
    places = _OCTANTS * (_STEPS // 2) - _STEPS // 4
    counts = np.maximum(_CHILDREN.sum(axis=1, keepdims=True), 1)
    return (2 * _CHILDREN @ places + counts) // (2 * counts)


def _as_cells(places: NDArray[np.int64]) -> NDArray[np.uint32]:
    """(256,): children in a mask as bits of 3 x 3 x 3 cells. places: (8, 3), of each child there, from 0."""
    is_there = ((places >= 0) & (places < 3)).all(axis=1)
    return (_CHILDREN @ np.where(is_there, 1 << np.maximum(places, 0) @ _CUBE, 0)).astype(np.uint32)


def _mirrored(octant: int) -> NDArray[np.uint8]:
    """(256,): 2 x 2 x 2 bits without that of a node, the others by the axes along which they are beside it.
    octant: the child of the node that they touch."""
    others = [7 ^ octant ^ bit for bit in range(1, 8)]
    return (_CHILDREN[:, others] @ (1 << np.arange(7))).astype(np.uint8)


def _moves() -> NDArray[np.int64]:
    """(8, 27): the nodes around a child in an octant: 8 times which is its parent, of 27, and its octant."""
    places = np.indices((3, 3, 3))[::-1].reshape(3, 27).T - 1 + _OCTANTS[:, None]
    return 8 * (_SELF + (places >> 1) @ _CUBE) + (places & 1) @ np.array([1, 2, 4])


_CUBE = np.array([1, 3, 9])  # of 3 x 3 x 3, x fastest
_OCTANTS = np.indices((2, 2, 2))[::-1].reshape(3, 8).T  # x fastest
_CHILDREN = np.unpackbits(np.arange(256, dtype=np.uint8)[:, None], axis=1, bitorder="little").astype(np.int64)
_SQUASH = _squashed()
_STRETCH = (np.searchsorted(_SQUASH, np.arange(4096)) - 2048).astype(np.int16)
_RATES = 2**17 // (2 * np.arange(_COUNT + 1) + 3)  # 2^16 / (count + 1.5)
_NEAR = 2**20 // (16 + np.arange(4 * 48)) ** 2  # weights by squared distance, 64 square steps each
_LOWEST = np.array([max((mask & -mask).bit_length() - 1, 0) for mask in range(256)], np.int64)
_HOW_MANY = np.bitwise_count(np.arange(256, dtype=np.uint8)).astype(np.int64)
_MIDDLES = _middles()
_CORNERS = _OCTANTS @ _CUBE  # of 2 x 2 x 2 among 3 x 3 x 3
_MIRRORED = np.stack([_mirrored(octant) for octant in range(8)])
# Of a node before another, by its number, children that touch this one: of 3 x 3 x 3 that end with its own.
_TOUCHING = np.stack([_as_cells(_OCTANTS + 1 - 2 * before) for before in _OCTANTS])
_MOVES = _moves()
_BLOCKS = _SELF + ((2 * _OCTANTS[:, None] - 1) * _OCTANTS) @ _CUBE  # 2 x 2 x 2 of 27 nodes around a child
_PLACES = _OCTANTS - 0.5  # of a node from the middle of its parent, in its edges
# Of 27 nodes around a child in an octant, those that are children of each of 2 x 2 x 2 nodes, by its mask.
_REACHED = np.stack(
    [[_as_cells(2 * block * (2 * own - 1) - own + _OCTANTS + 1) for block in _OCTANTS] for own in _OCTANTS]
)


# --- what is around -----------------------------------------------------------------------


@compiled
def go_down(
    masks: NDArray[np.uint8],
    first: NDArray[np.int32],
    around: NDArray[np.int32],
    nodes: tuple[int, int],
    below: NDArray[np.int32],
) -> None:
    """Fill the nodes around each child of some nodes of a level, (m, 27), from those around each, (n, 27).

    masks, first: (n,), children and the first child of each node. nodes: the first, and one behind the last.
    """
    for node in range(nodes[0], nodes[1]):
        left, child = masks[node], first[node]
        while left:
            octant = _LOWEST[left]
            left &= left - 1
            for i in range(27):
                move = _MOVES[octant, i]
                parent, other = around[node, move >> 3], -1
                if parent >= 0 and masks[parent] >> (move & 7) & 1:
                    other = first[parent] + _HOW_MANY[masks[parent] & ((1 << (move & 7)) - 1)]
                below[child, i] = other
            child += 1


@compiled
def survey(
    masks: NDArray[np.uint8],
    first: NDArray[np.int32],
    around: NDArray[np.int32],
    nodes: tuple[int, int],
    found: Surroundings,
) -> None:
    """Fill what is around the children of some nodes of a level, see `go_down`."""
    plane = np.zeros(4)
    for node in range(nodes[0], nodes[1]):
        if masks[node]:
            quality = _fit_plane(masks, around[node], plane)
            _look_around(masks, first, around[node], first[nodes[0]], plane, quality, found)


@compiled
def _look_around(
    masks: NDArray[np.uint8],
    first: NDArray[np.int32],
    around: NDArray[np.int32],
    base: int,
    plane: NDArray[np.float64],
    quality: int,
    found: Surroundings,
) -> None:
    """Fill what is around the children of the node in the middle. around: (27,) nodes of a level, of which
    are the masks and first children. base: the first child of all. plane, quality: see `_fit_plane`."""
    befores, faces, sides, planes = found.before, found.faces, found.sides, found.planes
    left, node = masks[around[_SELF]], first[around[_SELF]] - base
    while left:
        octant = _LOWEST[left]
        left &= left - 1
        beside = 0
        for block in range(8):
            other = around[_BLOCKS[octant, block]]
            if other >= 0:
                beside |= int(_REACHED[octant, block, masks[other]])
        faces[node] = (
            beside >> 4 & 1 | beside >> 9 & 2 | beside >> 10 & 4 | beside >> 11 & 8 | beside >> 12 & 16
            | beside >> 17 & 32
        )  # fmt: skip
        for before in range(1, 8):
            befores[node, before - 1] = -1
            if beside >> (_SELF - _CORNERS[before]) & 1:
                move = _MOVES[octant, _SELF - _CORNERS[before]]
                other = around[move >> 3]
                rank = _HOW_MANY[masks[other] & ((1 << (move & 7)) - 1)]
                befores[node, before - 1] = first[other] + rank - base
        least = _FARTHEST_OTHER
        for child in range(7, -1, -1):
            corner = _CORNERS[child]
            near = int(_MIRRORED[child, _corner(beside >> corner)])
            far = int(_MIRRORED[7 - child, _corner(beside >> (_SELF - corner))])
            sides[node, child] = near << 7 | far
            off = plane[3]
            for axis in range(3):
                off += plane[axis] * (_PLACES[octant, axis] + 0.5 * _PLACES[child, axis])
            distance = min(int(abs(off) * _DISTANCE), _FARTHEST) if quality else 0
            planes[node, child] = (distance << 4 | least) << 4 | quality
            least = min(least, distance)
        node += 1


@compiled
def _fit_plane(masks: NDArray[np.uint8], around: NDArray[np.int32], plane: NDArray[np.float64]) -> int:
    """Fit a plane to the middles of what is in 27 nodes. Returns its quality, 1 to 12, 0: there is none.

    plane: (4,), its unit normal, and how far the plane is from the middle of the node in the middle, against
    the normal, in edges of its children.
    """
    count, total, x, y, z = 0, 0, 0, 0, 0
    xx, yy, zz, xy, xz, yz = 0, 0, 0, 0, 0, 0
    for i in range(27):
        if around[i] >= 0:
            mask = masks[around[i]]
            a = _STEPS * (i % 3 - 1) + _MIDDLES[mask, 0]
            b = _STEPS * (i // 3 % 3 - 1) + _MIDDLES[mask, 1]
            c = _STEPS * (i // 9 - 1) + _MIDDLES[mask, 2]
            weight = _NEAR[(a * a + b * b + c * c) >> 6] * _HOW_MANY[mask]
            count, total = count + 1, total + weight
            x, y, z = x + weight * a, y + weight * b, z + weight * c
            xx, yy, zz = xx + weight * a * a, yy + weight * b * b, zz + weight * c * c
            xy, xz, yz = xy + weight * a * b, xz + weight * a * c, yz + weight * b * c
    if count < _FEWEST or total == 0:
        return 0
    share = 2.0 / (total * _STEPS)
    ax, ay, az = x * share, y * share, z * share
    share *= 2.0 / _STEPS
    cxx, cyy, czz = xx * share - ax * ax, yy * share - ay * ay, zz * share - az * az
    cxy, cxz, cyz = xy * share - ax * ay, xz * share - ax * az, yz * share - ay * az
    # The adjugate of the covariance, whose largest eigenvector is that of its smallest eigenvalue.
    a, b, c = cyy * czz - cyz * cyz, cxx * czz - cxz * cxz, cxx * cyy - cxy * cxy
    d, e, f = cxz * cyz - cxy * czz, cxy * cyz - cxz * cyy, cxy * cxz - cxx * cyz
    pairs = a + b + c  # of eigenvalues, their products
    if not pairs > 1e-9:
        return 0
    for _ in range(2):  # to the fourth power
        share = 1.0 / (a + b + c)
        a, b, c, d, e, f = a * share, b * share, c * share, d * share, e * share, f * share
        a, b, c, d, e, f = (
            a * a + d * d + e * e,
            b * b + d * d + f * f,
            c * c + e * e + f * f,
            a * d + d * b + e * f,
            a * e + d * f + e * c,
            d * e + b * f + f * c,
        )
    if a >= b and a >= c:
        nx, ny, nz = a, d, e
    elif b >= c:
        nx, ny, nz = d, b, f
    else:
        nx, ny, nz = e, f, c
    share = 1.0 / math.sqrt(nx * nx + ny * ny + nz * nz)
    nx, ny, nz = nx * share, ny * share, nz * share
    plane[0], plane[1], plane[2] = nx, ny, nz
    plane[3] = -(nx * ax + ny * ay + nz * az)
    thick = nx * (cxx * nx + 2 * (cxy * ny + cxz * nz)) + ny * (cyy * ny + 2 * cyz * nz) + czz * nz * nz
    rest = cxx + cyy + czz - thick
    width = 0.5 * (rest - math.sqrt(max(rest * rest - 4 * (pairs - thick * rest), 0.0)))
    return 1 + min(int(math.sqrt(max(thick, 0.0)) * 8), 3) + 4 * (int(width >= 0.2) + int(width >= 0.6))


# --- coding -------------------------------------------------------------------------------


@compiled
def code_part(
    found: Surroundings,
    known: NDArray[np.uint8],
    models: Models,
    stored: NDArray[np.uint8],
    masks: NDArray[np.uint8],
    decodes: bool,
) -> int:
    """Code the masks (n,) of these nodes, or decode them from what is stored. Returns the bytes taken.

    known: (n,), masks that are expected, 0: none. Models learn. stored: to code, MOST bytes for each node and
    as many more; to decode, what lies beyond its end counts as zeros.
    """
    befores, faces, sides, planes = found.before, found.faces, found.sides, found.planes
    seen, weights = models.seen, models.weights
    low, high, value, at, end = 0, 0xFFFFFFFF, 0, 0, len(stored)
    if decodes:
        for at in range(4):
            value = value << 8 | (int(stored[at]) if at < end else 0)
        at = 4
    for node in range(len(masks)):
        cells, whole, mask, count = 0, int(masks[node]), 0, 0
        for before in range(7):
            other = befores[node, before]
            if other >= 0:
                cells |= int(_TOUCHING[before + 1, masks[other]])
        expected = int(known[node])
        children = _OF_CHILDREN + (int(faces[node]) << 8)
        likely = _OF_EXPECTED + int(_HOW_MANY[expected]) * 32
        wrong = 0
        for child in range(8):
            corner = _CORNERS[child]
            side = int(sides[node, child])
            a = np.uint32((_corner(cells >> corner) & 127) << 9 | side >> 7 << 2 | count)
            b = np.uint32(_OF_BESIDE + (side << 2 | count))
            c = np.uint32(_OF_PLANES + (int(planes[node, child]) << 2 | count))
            d = np.uint32(children + (1 << child | mask))
            e = np.uint32(likely + ((expected >> child & 1) << 4 | wrong << 2 | count))
            w = np.uint32(((child * 3 + count) * 2 + (expected > 0)) * CONTEXTS)
            seen_a, seen_b, seen_c = int(seen[a]), int(seen[b]), int(seen[c])
            seen_d, seen_e = int(seen[d]), int(seen[e])
            chance_a, chance_b = int(_STRETCH[seen_a >> 20]), int(_STRETCH[seen_b >> 20])
            chance_c, chance_d = int(_STRETCH[seen_c >> 20]), int(_STRETCH[seen_d >> 20])
            chance_e = int(_STRETCH[seen_e >> 20])
            mixed = (
                weights[w] * chance_a + weights[w + 1] * chance_b + weights[w + 2] * chance_c
                + weights[w + 3] * chance_d + weights[w + 4] * chance_e
            ) >> 16  # fmt: skip
            chance = int(_SQUASH[np.uint32(min(max(mixed, -2047), 2047) + 2048)])
            middle = low + ((high - low) * chance >> 12)
            bit = int(value <= middle) if decodes else whole >> child & 1
            if bit:
                high = middle
            else:
                low = middle + 1
            while (low ^ high) >> 24 == 0:
                if decodes:
                    value = (value << 8 & 0xFFFFFFFF) | (int(stored[at]) if at < end else 0)
                else:
                    stored[at] = high >> 24
                low, high, at = low << 8 & 0xFFFFFFFF, (high << 8 & 0xFFFFFFFF) | 255, at + 1
            error = ((bit << 12) - chance) * _RATE
            weights[w] += (chance_a * error + 0x8000) >> 16
            weights[w + 1] += (chance_b * error + 0x8000) >> 16
            weights[w + 2] += (chance_c * error + 0x8000) >> 16
            weights[w + 3] += (chance_d * error + 0x8000) >> 16
            weights[w + 4] += (chance_e * error + 0x8000) >> 16
            seen[a], seen[b] = _learnt(seen_a, bit), _learnt(seen_b, bit)
            seen[c], seen[d], seen[e] = _learnt(seen_c, bit), _learnt(seen_d, bit), _learnt(seen_e, bit)
            wrong = min(wrong + (bit ^ (expected >> child & 1)), 2)
            mask |= bit << child
            count = min(count + bit, 2)
            cells |= bit << (_SELF + corner)
        masks[node] = mask
    return at if decodes else _finished(stored, at, low, high)


@inlined
def _corner(cells: int) -> int:
    """The first 2 x 2 x 2 of 3 x 3 x 3 bits."""
    return cells & 3 | cells >> 1 & 12 | cells >> 5 & 48 | cells >> 6 & 192


@inlined
def _learnt(value: int, bit: int) -> int:
    """Probability and count of a situation, after this bit."""
    count, chance = value & 255, value >> 8
    chance += ((bit << 24) - bit - chance) * _RATES[np.uint32(count)] >> 16
    return chance << 8 | min(count + 1, _COUNT)


@compiled
def _finished(stored: NDArray[np.uint8], at: int, low: int, high: int) -> int:
    """Write the fewest bytes between low and high, with zeros behind; one at least for a level. Returns the
    bytes in all."""
    for count in range(1 if at == 0 else 0, 5):
        end = high >> (32 - 8 * count) << (32 - 8 * count)
        if end >= low:
            for i in range(count):
                stored[at + i] = end >> (24 - 8 * i) & 255
            return at + count
    return at

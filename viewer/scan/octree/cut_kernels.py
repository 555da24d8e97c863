"""The inner loops of cutting an octree by what a view shows, compiled by numba.

A node is a place, x | y << 21 | z << 42 of its cell among those of its level, with bit 63 set where it lies
within all planes, and an index, which node of its level it is. Positions are relative to the cube's lowest
corner.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...compiled import compiled

_HALF_DIAGONAL = math.sqrt(3) / 2  # of a cube of edge 1


def _families() -> NDArray[np.uint64]:
    """(8, 256): for the child nearest to the eye and a mask, the children there are, nearest first.

    Six bits each, the first of them lowest: which octant, and how many of the mask's come before it in
    memory. From bit 48 on: how many there are.
    """
    table = np.zeros((8, 256), np.uint64)
    for nearest in range(8):
        for mask in range(256):
            order = [turn ^ nearest for turn in range(8) if mask >> (turn ^ nearest) & 1]
            entries = [child | (mask & ((1 << child) - 1)).bit_count() << 3 for child in order]
            table[nearest, mask] = sum(entry << 6 * k for k, entry in enumerate(entries)) | len(order) << 48
    return table


_FAMILIES = _families()
_OFFSETS = np.array([i & 1 | (i >> 1 & 1) << 21 | i >> 2 << 42 for i in range(8)], np.uint64)
_NONE, _ONE, _THREE, _SEVEN = np.uint64(0), np.uint64(1), np.uint64(3), np.uint64(7)
_COUNT, _TWO = np.uint64(48), np.uint64(12)
_WITHIN, _CELL = np.uint64(1 << 63), np.uint64((1 << 21) - 1)
_Y, _Z = np.uint64(21), np.uint64(42)


@compiled
def _center(place: np.uint64, edge: float) -> tuple[float, float, float]:
    x, y, z = np.int64(place & _CELL), np.int64(place >> _Y & _CELL), np.int64(place >> _Z & _CELL)
    return (x + 0.5) * edge, (y + 0.5) * edge, (z + 0.5) * edge


class Nodes(NamedTuple):
    """Nodes of one level, or room for them."""

    places: NDArray[np.uint64]  # (n,)
    indices: NDArray[np.uint32]  # (n,)


class LevelArrays(NamedTuple):
    """All nodes of a level; cones (0,): not asked."""

    masks: NDArray[np.uint8]
    first_child: NDArray[np.uint32]
    normals: NDArray[np.float32]
    cones: NDArray[np.float32]


class SightArrays(NamedTuple):
    """A view of the cube; positions are relative to its lowest corner."""

    planes: NDArray[np.float64]  # (p, 4): inward unit normals and offsets
    eye: NDArray[np.float64]  # (3,)
    back: NDArray[np.float64]  # (3,), opposite to the view's direction


class SightLens(NamedTuple):
    """How large a view shows nodes of a level."""

    perspective: bool
    scale: float  # pixels per unit, at depth 1 or everywhere
    near: float
    least: float  # size in pixels; smaller nodes are not divided
    margin: float  # how far a node is seen beyond its sphere


class Descent(NamedTuple):
    """How many nodes are children, done, outside and facing away."""

    followed: int
    shown: int
    outside: int
    away: int


@compiled
def descend(
    nodes: Nodes, edge: float, level: LevelArrays, sight: SightArrays, lens: SightLens, children: Nodes,
    done: Nodes,
) -> Descent:  # fmt: skip
    """Sort some nodes (n,) of a level into those that are done and those whose children are looked at next.

    edge: of a node. level: without masks, its nodes have no children. Children, up to (8 n,) and one more,
    and nodes done (n,) are written from the beginnings of those arrays; children nearest to the eye first.
    """
    places, indices = nodes
    masks, first_child, normals, cones = level
    planes, eye, back = sight
    child_places, child_indices = children
    done_places, done_indices = done
    last = len(masks) == 0
    perspective, scale, near, least, margin = lens
    if not perspective:
        near = 1.0  # what sizes are divided by
    radius = _HALF_DIAGONAL * edge
    nearest_child = (back[0] >= 0) | (back[1] >= 0) << 1 | (back[2] >= 0) << 2
    followed, shown, outside, away = 0, 0, 0, 0
    for i in range(len(places)):
        place, index = places[i], indices[i]
        x, y, z = _center(place, edge)
        inside = place >= _WITHIN
        if not inside:
            nearest = np.inf
            for p in range(len(planes)):
                nearest = min(nearest, planes[p, 0] * x + planes[p, 1] * y + planes[p, 2] * z + planes[p, 3])
            if nearest < -radius - margin:
                outside += 1
                continue
            inside = nearest >= radius + margin
        to_x, to_y, to_z = eye[0] - x, eye[1] - y, eye[2] - z
        if len(cones) and _faces_away(
            normals, cones, index, (to_x, to_y, to_z), back, radius if perspective else -1.0
        ):
            away += 1
            continue
        small = last or masks[index] == 0
        if least > 0 and not small:
            depth = back[0] * to_x + back[1] * to_y + back[2] * to_z - radius if perspective else 1.0
            small = scale * edge < least * max(depth, near)
        if small:
            done_places[shown], done_indices[shown] = place, index
            shown += 1
            continue
        if perspective:
            nearest_child = (to_x >= 0) | (to_y >= 0) << 1 | (to_z >= 0) << 2
        corner = place << _ONE | (_WITHIN if inside else _NONE)
        family = _FAMILIES[nearest_child, masks[index]]
        first, end = first_child[index], followed + int(family >> _COUNT)
        while followed < end:  # by twos, without asking: loops of unforeseen length are slow
            for k in range(2):
                entry = family >> np.uint64(6 * k)
                child_places[followed + k] = corner | _OFFSETS[entry & _SEVEN]
                child_indices[followed + k] = first + np.uint32(entry >> _THREE & _SEVEN)
            followed += 2
            family >>= _TWO
        followed = end
    return Descent(followed, shown, outside, away)


@compiled
def _faces_away(
    normals: NDArray[np.float32],
    cones: NDArray[np.float32],
    node: int,
    to_eye: tuple[float, float, float],
    back: NDArray[np.float64],
    radius: float,
) -> bool:
    """Whether no position of the node's sphere with a normal in its cone faces the eye.

    With a the angle between the mean normal and the direction to the eye, c the half angle of the cone and s
    that of the sphere as the eye sees it: a > 90 degrees + c + s. radius below 0: the eye is infinitely far.
    """
    to_x, to_y, to_z = to_eye
    cosine = np.float64(cones[node])
    x, y, z = np.float64(normals[node, 0]), np.float64(normals[node, 1]), np.float64(normals[node, 2])
    if cosine <= 0:
        return False
    sine = math.sqrt(1 - cosine * cosine)
    if radius < 0:
        return bool(x * back[0] + y * back[1] + z * back[2] < -sine)
    towards = x * to_x + y * to_y + z * to_z
    squared = to_x * to_x + to_y * to_y + to_z * to_z - radius * radius
    if towards >= 0 or squared <= 0:
        return False
    reach = math.sqrt(squared)  # from the eye to where it touches the sphere
    return bool(cosine * reach > sine * radius and towards < -(sine * reach + cosine * radius))


@compiled
def find_positions(
    places: NDArray[np.uint64],
    indices: NDArray[np.uint32],
    edge: float,
    low: NDArray[np.float64],
    offsets: NDArray[np.uint16],
    positions: NDArray[np.float32],
) -> None:
    """Positions (n, 3) of nodes (n,) of one level. low: (3,), the cube's corner, from where positions count.
    offsets: of all nodes of the level, as `Attributes` has them; (0, 3): centres are wanted."""
    step, x, y, z = edge / 65536, 0.0, 0.0, 0.0
    middle = edge / 2 - step / 2
    for i in range(len(places)):
        center_x, center_y, center_z = _center(places[i], edge)
        if len(offsets):
            at = indices[i]
            x, y, z = (
                offsets[at, 0] * step - middle,
                offsets[at, 1] * step - middle,
                offsets[at, 2] * step - middle,
            )
        positions[i, 0], positions[i, 1], positions[i, 2] = (
            center_x + x + low[0],
            center_y + y + low[1],
            center_z + z + low[2],
        )

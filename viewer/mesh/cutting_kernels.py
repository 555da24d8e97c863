"""The inner loops of cutting patches along lines, compiled by numba; see `cutting`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..compiled import compiled

_TINY = 2.3e-308

Weights = NDArray[np.float64]  # (3,) of the corners of a face


@compiled
def _nearest(
    vertices: NDArray[np.float64], face: NDArray[np.int64], place: NDArray[np.float64], found: Weights
) -> float:
    """Fill in the weights of the corners of a face at its place nearest to another, (3,), and tell how far it
    is away; see `nearest_weights` for all faces at once."""
    corners = np.empty((3, 3))
    for corner in range(3):
        corners[corner] = vertices[face[corner]] - place
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    area = max(np.dot(normal, normal), _TINY)
    is_inside = True
    for corner in range(3):
        one, other = corners[(corner + 1) % 3], corners[(corner + 2) % 3]
        found[corner] = np.dot(np.cross(one, other), normal) / area
        is_inside = is_inside and found[corner] >= 0
    if not is_inside:
        best = np.inf
        for corner in range(3):
            start, edge = corners[corner], corners[(corner + 1) % 3] - corners[corner]
            share = min(max(-np.dot(start, edge) / max(np.dot(edge, edge), _TINY), 0.0), 1.0)
            off = start + share * edge
            squared = np.dot(off, off)
            if squared < best:
                best = squared
                found[corner], found[(corner + 1) % 3], found[(corner + 2) % 3] = 1 - share, share, 0.0
    off = found[0] * corners[0] + found[1] * corners[1] + found[2] * corners[2]
    return float(np.sqrt(np.dot(off, off)))


class PatchArrays(NamedTuple):
    """A patch as compiled loops have it; the faces at each vertex are around[firsts[vertex] : firsts[vertex +
    1]]."""

    vertices: NDArray[np.float64]  # (V, 3)
    faces: NDArray[np.int64]  # (F, 3)
    firsts: NDArray[np.int64]  # (V + 1,)
    around: NDArray[np.int64]


@compiled
def faces_under(
    patch: PatchArrays,
    line: NDArray[np.float64],
    same: float,
    found: NDArray[np.int64],
    weights: NDArray[np.float64],
) -> None:
    """Walk along a line from a vertex on, (P, 3), and fill in the face that each of its pieces crosses,
    (P - 1,), -1 for pieces without length, and the weights of its corners at both ends, (P - 1, 2, 3).

    same: weights below it are none.
    """
    vertices, faces, firsts, around = patch
    start, least = 0, np.inf
    for vertex in range(len(vertices)):
        off = vertices[vertex] - line[0]
        squared = np.dot(off, off)
        if squared < least:
            start, least = vertex, squared
    place = np.full(3, -1)  # the corners of the face or edge that the walk is on
    place[0] = start
    count = 1
    one, other = np.empty(3), np.empty(3)
    for piece in range(len(line) - 1):
        found[piece] = -1
        if (line[piece] == line[piece + 1]).all():
            continue
        best = np.inf
        for number in range(firsts[place[0]], firsts[place[0] + 1]):
            face = around[number]
            has_all = True
            for corner in range(1, count):
                has_all = has_all and (faces[face] == place[corner]).any()
            if not has_all:
                continue
            off = _nearest(vertices, faces[face], (line[piece] + line[piece + 1]) / 2, one)
            off += _nearest(vertices, faces[face], line[piece + 1], other)
            if off < best:
                best, found[piece] = off, face
        face = found[piece]
        for end in range(2):
            _nearest(vertices, faces[face], line[piece + end], one)
            for corner in range(3):
                one[corner] = 0.0 if one[corner] < same else one[corner]
            weights[piece, end] = one / one.sum()
        count = 0
        for corner in range(3):
            if weights[piece, 1, corner] > 0:
                place[count] = faces[face, corner]
                count += 1

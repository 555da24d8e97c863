"""Patches cut along closed lines that run over them, and by planes."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from .geodesic import Line
from .manifold import Rows, joined
from .patch import Patch
from .smoothing import Points

_SAME = 1e-7  # weights below which a place in a face is on its edge, and shares of an edge that are none
_ROUNDED = 1e-9  # of weights: the least of a place that is off a chord is some `_SAME`
_HALF_EDGES = ((0, 1), (1, 2), (2, 0))

Weights = tuple[float, float, float]  # of the corners of a face
Chord = tuple[Weights, Weights]
Polygon = list[Weights]


@dataclass(frozen=True, eq=False)
class Piece:
    """A piece of a patch. vertices: (V, 3). faces: (F, 3) int64. sources: (F,) the patch's face that each
    is a part of."""

    vertices: Points
    faces: Rows
    sources: Rows

    @classmethod
    def joined(cls, pieces: Sequence[Piece]) -> Piece:
        """Pieces of one patch as one, at least one."""
        counts = np.cumsum([0, *(len(piece.vertices) for piece in pieces)])
        return cls(
            np.concatenate([piece.vertices for piece in pieces]),
            np.concatenate([piece.faces + before for piece, before in zip(pieces, counts, strict=False)]),
            np.concatenate([piece.sources for piece in pieces]),
        )

    def of_faces(self, chosen: NDArray[np.bool_]) -> Piece:
        """The piece of the chosen faces alone, (F,)."""
        return Piece(self.vertices, self.faces[chosen], self.sources[chosen])

    @property
    def corners(self) -> NDArray[np.float64]:
        """The corners of the faces, (3, F, 3)."""
        return self.vertices[self.faces.T]

    @property
    def areas(self) -> NDArray[np.float64]:
        """The area of each face, (F,), squared scan units."""
        a, b, c = self.corners
        return np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2


def pieces_along(patch: Patch, lines: Sequence[Line]) -> list[Piece]:
    """The pieces that lines cut out of a patch, those that the lines run along alone.

    lines: each (P, 3), from one vertex of the patch to another, a place at each edge that it crosses, as
    `Geodesics.path` has them; together they are closed.
    """
    chords, blocked = _chords(patch, lines)
    of_face, polygons = _divided(patch, chords)
    one, other = _links(patch, chords, blocked, of_face, polygons)
    whole = np.setdiff1d(np.arange(len(patch.faces)), list(chords))
    names = np.concatenate([whole, np.arange(len(patch.faces), len(patch.faces) + len(polygons))])
    _, part = joined(one, other, len(patch.faces) + len(polygons))
    beside = np.unique([part[len(patch.faces) + n] for n in range(len(polygons))])
    edges = [face for edge in blocked for face in patch.faces_at(*edge).tolist()]
    beside = np.union1d(beside, [part[face] for face in edges if face not in chords]).astype(int)
    return [_piece(patch, names[part[names] == number], polygons) for number in beside]


def _chords(
    patch: Patch, lines: Sequence[Line]
) -> tuple[dict[int, list[Chord]], dict[tuple[int, int], list[tuple[float, float]]]]:
    """Face -> the lines' pieces that cross it, as weights of its corners; and edge -> what of it lines run
    along, from and to shares of it."""
    chords: dict[int, list[Chord]] = defaultdict(list)
    along: dict[tuple[int, int], list[tuple[float, float]]] = defaultdict(list)
    for line in lines:
        for face, ends in zip(*_under(patch, line), strict=True):
            if face < 0:
                continue
            empty = np.flatnonzero((ends == 0).all(axis=0))
            if len(empty):
                low, high = sorted(np.delete(patch.faces[face], empty[0]).tolist())
                share = sorted(ends[:, patch.faces[face] == high].ravel().tolist())
                along[low, high].append((share[0], share[1]))
            else:
                start, end = map(tuple, ends.tolist())
                chords[face].append((start, end))
    return chords, along


def _under(patch: Patch, line: Line) -> tuple[list[int], NDArray[np.float64]]:
    """The face that each piece of a line crosses, -1: of no length, and the weights of its corners at both
    ends, (P - 1, 2, 3)."""
    from .cutting_kernels import PatchArrays, faces_under

    found, weights = np.empty(len(line) - 1, np.int64), np.empty((len(line) - 1, 2, 3))
    arrays = PatchArrays(patch.vertices, patch.faces, *patch.around)
    faces_under(arrays, line, _SAME, found, weights)
    return found.tolist(), weights


def length_over(patch: Patch, line: Line, first: int) -> float:
    """How much of a line, (P, 3), as of `pieces_along`, runs over the faces from a number on, scan units;
    what runs along an edge of another face does not."""
    total = 0.0
    for face, ends, a, b in zip(*_under(patch, line), line[:-1], line[1:], strict=True):
        beside = [face]
        if (ends == 0).all(axis=0).any():
            beside = patch.faces_at(*patch.faces[face][(ends != 0).any(axis=0)].tolist()).tolist()
        if min(beside) >= first:
            total += math.dist(a, b)
    return total


def _side(chord: Chord, place: Weights) -> float:
    """How far a place of the same face is off a chord, by weights; the sign tells on which side. In plain
    numbers: arrays of three take longer."""
    (a, b, c), (d, e, f), (x, y, z) = *chord, place
    volume = a * (e * z - f * y) - b * (d * z - f * x) + c * (d * y - e * x)
    return volume / math.sqrt((d - a) ** 2 + (e - b) ** 2 + (f - c) ** 2)


def _middle(polygon: Polygon) -> Weights:
    x, y, z = zip(*polygon, strict=True)
    return sum(x) / len(x), sum(y) / len(y), sum(z) / len(z)


def _divided(
    patch: Patch, chords: dict[int, list[Chord]]
) -> tuple[dict[int, dict[tuple[bool, ...], int]], list[tuple[int, Polygon]]]:
    """Faces that are crossed as convex polygons: face -> sides of its chords -> number; and the polygons with
    their faces."""
    of_face: dict[int, dict[tuple[bool, ...], int]] = {}
    polygons: list[tuple[int, Polygon]] = []
    for face, across in chords.items():
        parts: list[Polygon] = [[(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)]]
        for chord in across:
            parts = [half for part in parts for half in _halves(part, chord) if len(half) > 2]
        of_face[face] = {}
        for part in parts:
            middle = _middle(part)
            of_face[face][tuple(_side(chord, middle) > 0 for chord in across)] = len(polygons)
            polygons.append((face, part))
    return of_face, polygons


def _halves(polygon: Polygon, chord: Chord) -> tuple[Polygon, Polygon]:
    """A convex polygon on both sides of a chord's line."""
    sides = [_side(chord, corner) for corner in polygon]
    sides = [0.0 if abs(side) < _ROUNDED else side for side in sides]
    halves: tuple[Polygon, Polygon] = ([], [])
    for number, (corner, side) in enumerate(zip(polygon, sides, strict=True)):
        after, further = polygon[(number + 1) % len(polygon)], sides[(number + 1) % len(polygon)]
        for half, sign in zip(halves, (1, -1), strict=True):
            if sign * side >= 0:
                half.append(corner)
            if side * further < 0:
                (a, b, c), (d, e, f), width = corner, after, side - further
                half.append(
                    (
                        (side * d - further * a) / width,
                        (side * e - further * b) / width,
                        (side * f - further * c) / width,
                    )
                )
    kept = [
        half if any(s * side > 0 for side in sides) else [] for half, s in zip(halves, (1, -1), strict=True)
    ]
    return kept[0], kept[1]


def _links(
    patch: Patch,
    chords: dict[int, list[Chord]],
    blocked: dict[tuple[int, int], list[tuple[float, float]]],
    of_face: dict[int, dict[tuple[bool, ...], int]],
    polygons: list[tuple[int, Polygon]],
) -> tuple[Rows, Rows]:
    """Pairs of what lies beside each other with no line between: faces by number, polygons after them."""
    before, after = patch.pairs
    corner = patch.faces.ravel()
    ends = np.sort(np.stack([corner[before], corner[after]], axis=1), axis=1)
    crossed = np.zeros(len(patch.faces), bool)
    crossed[list(chords)] = True
    odd = crossed[before // 3] | crossed[after // 3]
    for edge in blocked:
        odd |= (ends == edge).all(axis=1)
    met = _met(patch, chords)
    one, other = (before // 3)[~odd].tolist(), (after // 3)[~odd].tolist()
    for half, opposite, (low, high) in zip(
        before[odd].tolist(), after[odd].tolist(), ends[odd].tolist(), strict=True
    ):
        faces = half // 3, opposite // 3
        shares = {0.0, 1.0, *met[faces[0], low, high], *met[faces[1], low, high]}
        for start, end in pairwise(sorted(shares)):
            middle = (start + end) / 2
            if end - start < 2 * _SAME or any(a <= middle <= b for a, b in blocked.get((low, high), ())):
                continue
            for face, links in zip(faces, (one, other), strict=True):
                if face not in chords:
                    links.append(face)
                    continue
                weight = {low: 1 - middle, high: middle}
                a, b, c = patch.faces[face].tolist()
                place = weight.get(a, 0.0), weight.get(b, 0.0), weight.get(c, 0.0)
                links.append(len(patch.faces) + _which(place, chords[face], of_face[face], polygons))
    return np.array(one, np.int64), np.array(other, np.int64)


def _met(patch: Patch, chords: dict[int, list[Chord]]) -> dict[tuple[int, int, int], list[float]]:
    """Face and edge, by its vertices, the lower first -> the shares of it at which chords of the face end."""
    met: dict[tuple[int, int, int], list[float]] = defaultdict(list)
    for face, across in chords.items():
        corners = patch.faces[face].tolist()
        for end in (end for chord in across for end in chord):
            ends = sorted((vertex, weight) for vertex, weight in zip(corners, end, strict=True) if weight)
            if len(ends) == 2:
                met[face, ends[0][0], ends[1][0]].append(ends[1][1])
    return met


def _which(
    place: Weights,
    across: list[Chord],
    of_sides: dict[tuple[bool, ...], int],
    polygons: list[tuple[int, Polygon]],
) -> int:
    """The number of the polygon of a face that holds a place on its edge. across, of_sides: its chords, and
    its polygons by their sides of these."""
    found = of_sides.get(tuple(_side(chord, place) > 0 for chord in across))
    if found is None:  # of rounding: the polygon whose corners lie nearest
        found = min(
            of_sides.values(),
            key=lambda number: math.dist(_middle(polygons[number][1]), place),
        )
    return found


def _piece(patch: Patch, names: Rows, polygons: list[tuple[int, Polygon]]) -> Piece:
    """Faces and polygons by number, these as fans."""
    count = len(patch.faces)
    whole, crossed = names[names < count], [polygons[name - count] for name in names[names >= count]]
    sizes = np.array([len(polygon) for _, polygon in crossed], np.int64)
    sources = np.array([face for face, _ in crossed], np.int64)
    weights = np.array([corner for _, polygon in crossed for corner in polygon]).reshape(-1, 3)
    added = (weights[..., None] * patch.vertices[patch.faces[np.repeat(sources, sizes)]]).sum(axis=1)
    first = np.repeat(len(patch.vertices) + np.cumsum(sizes) - sizes, sizes - 2)
    step = np.arange(len(first)) - np.repeat(np.cumsum(sizes - 2) - (sizes - 2), sizes - 2)
    fans = np.stack([first, first + step + 1, first + step + 2], axis=1)
    return Piece(
        np.concatenate([patch.vertices, added]),
        np.concatenate([patch.faces[whole], fans]),
        np.concatenate([whole, np.repeat(sources, sizes - 2)]),
    )


def plane_section(patch: Patch, point: NDArray[np.float64], normal: NDArray[np.float64]) -> list[Line]:
    """The lines in which a plane cuts a patch, each (P, 3); closed ones end where they begin.

    point, normal: (3,), of the plane. A vertex in it counts as before it.
    """
    heights = (patch.vertices - point) @ normal
    above = heights >= 0
    cut = above[patch.faces]
    crossed = np.flatnonzero(cut.any(axis=1) & ~cut.all(axis=1))
    if not len(crossed):
        return []
    ends = np.stack([patch.faces[crossed][:, list(pair)] for pair in _HALF_EDGES], axis=1)
    is_cut = above[ends[..., 0]] != above[ends[..., 1]]
    pairs = np.sort(ends[is_cut], axis=1)
    edges, which = np.unique(pairs, axis=0, return_inverse=True)
    low, high = heights[edges[:, 0]], heights[edges[:, 1]]
    share = (low / (low - high))[:, None]
    places = (1 - share) * patch.vertices[edges[:, 0]] + share * patch.vertices[edges[:, 1]]
    beside: dict[int, list[int]] = defaultdict(list)
    for one, other in which.reshape(-1, 2).tolist():
        beside[one].append(other)
        beside[other].append(one)
    lines = []
    for first in sorted(beside, key=lambda place: (len(beside[place]), place)):  # ends before what is closed
        walk = [first]
        while beside[walk[-1]]:
            after = beside[walk[-1]].pop(0)
            beside[after].remove(walk[-1])
            walk.append(after)
        if len(walk) > 1:
            lines.append(places[walk])
    return lines

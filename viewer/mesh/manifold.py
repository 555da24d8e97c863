"""Faces made such that a walk over them is told at every edge: oriented alike, two an edge, a fan a
vertex."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Rows = NDArray[np.int64]


def manifold(faces: NDArray[np.integer]) -> tuple[Rows, Rows]:
    """Oriented faces (G, 3) of vertices (V,) that are used, and which of the given ones each of these is a
    copy of.

    faces: (F, 3), of any kind. The result lacks faces with a corner twice, repeated faces, what an edge has
    beyond two, and one of two faces that run along each other at their edge. Where turning faces leaves fewer
    of these, those that run against the faces across their edges are turned, the first of each part as it
    is. A vertex in which several fans of faces meet becomes one for each.
    """
    kept = _two_an_edge(_distinct(np.asarray(faces, np.int64).reshape(-1, 3)))
    wrong = _conflicts(kept)
    if len(wrong):
        turned = _turned(kept)
        still_wrong = _conflicts(turned)
        if len(still_wrong) < len(wrong):
            kept, wrong = turned, still_wrong
    return _one_fan_a_vertex(np.delete(kept, wrong, axis=0))


def across_edges(faces: Rows) -> tuple[Rows, Rows]:
    """Pairs of half-edges (P,) that share an edge, by number: 3 f + c is the one of face f from corner c on.

    Of an edge with more than two faces, pairs of those that follow each other.
    """
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    edge = np.minimum(start, end) * (end.max(initial=0) + 1) + np.maximum(start, end)
    order = np.argsort(edge, kind="stable")
    same = np.flatnonzero(edge[order[1:]] == edge[order[:-1]])
    return order[same], order[same + 1]


def joined(one: Rows, other: Rows, count: int) -> tuple[int, NDArray[np.int32]]:
    """How many parts `count` things fall into that pairs of numbers join, and the part of each, (count,)."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    links = coo_array((np.ones(len(one), bool), (one, other)), shape=(count, count))
    parts, part = connected_components(links, directed=False)
    return int(parts), part


def _distinct(faces: Rows) -> Rows:
    corners = np.sort(faces, axis=1)
    faces, corners = (rows[(corners[:, 1:] != corners[:, :-1]).all(axis=1)] for rows in (faces, corners))
    order = np.lexsort(corners.T)
    is_first = np.append(True, (np.diff(corners[order], axis=0) != 0).any(axis=1))[: len(order)]
    return faces[np.sort(order[is_first])]


def _two_an_edge(faces: Rows) -> Rows:
    before, after = across_edges(faces)
    has_before = np.zeros(3 * len(faces), bool)
    has_before[after] = True
    return np.delete(faces, after[has_before[before]] // 3, axis=0)


def _turned(faces: Rows) -> Rows:
    """Faces turned to run against those across their edges. Each face gets two sides; a spanning tree of the
    faces joins these: the same ones where both faces run against each other along the edge."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import minimum_spanning_tree

    count = len(faces)
    before, after = across_edges(faces)
    pairs, first = np.unique(np.stack([before // 3, after // 3], axis=1), axis=0, return_index=True)
    graph = coo_array(
        (first + 1.0, (pairs[:, 0], pairs[:, 1])), shape=(count, count)
    )  # the tree has the first
    kept = minimum_spanning_tree(graph.tocsr()).data.astype(np.int64) - 1
    same = faces.ravel()[before[kept]] != faces.ravel()[after[kept]]
    f, g = before[kept] // 3, after[kept] // 3
    other = np.where(same, g, g + count), np.where(same, g + count, g)
    _, side = joined(np.concatenate([f, f + count]), np.concatenate(other), 2 * count)
    turned = side[:count] > side[count:]
    return np.where(turned[:, None], faces[:, ::-1], faces)


def _conflicts(faces: Rows) -> Rows:
    """The face of the higher number of each two that run along each other at their edge."""
    before, after = across_edges(faces)
    return after[faces.ravel()[before] == faces.ravel()[after]] // 3


def _one_fan_a_vertex(faces: Rows) -> tuple[Rows, Rows]:
    before, after = across_edges(faces)

    def following(half: Rows) -> Rows:
        return half - half % 3 + (half + 1) % 3

    one = np.concatenate([before, following(before)])
    other = np.concatenate([following(after), after])
    count, vertex = joined(one, other, faces.size)
    source = np.zeros(count, np.int64)
    source[vertex] = faces.ravel()
    return vertex.astype(np.int64).reshape(-1, 3), source

from __future__ import annotations

import numpy as np
import pytest

from viewer.mesh.manifold import across_edges, manifold


def is_walkable(faces: np.ndarray) -> bool:
    """Each edge has two faces at most, which run along it against each other; each vertex has one fan."""
    half = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2)
    if len(np.unique(half, axis=0)) < len(half):
        return False
    for vertex in np.unique(faces):
        around = [face for face in faces.tolist() if vertex in face]
        reached = {0}
        for _ in around:
            reached |= {
                n for n, face in enumerate(around) for m in reached if len({*face} & {*around[m]} - {vertex})
            }
        if len(reached) < len(around):
            return False
    return True


@pytest.mark.parametrize(
    ("faces", "kept", "vertices"),
    [
        ([[0, 1, 2], [1, 3, 2]], 2, 4),
        ([[0, 1, 2], [1, 2, 3]], 2, 4),  # one runs the wrong way round
        ([[0, 1, 2], [2, 3, 4]], 2, 6),  # two fans in a vertex
        ([[0, 1, 2], [2, 1, 0], [0, 1, 2]], 1, 3),
        ([[0, 1, 2], [0, 0, 2], [1, 1, 1]], 1, 3),
        ([[0, 1, 2], [1, 0, 3], [0, 1, 4]], 2, 4),  # three at an edge
        ([[0, 1, 2], [1, 2, 3], [2, 3, 4], [3, 4, 0], [4, 0, 1]], 4, 6),  # a Moebius strip
        (np.empty((0, 3), int), 0, 0),
    ],
)
def test_any_faces_become_walkable(faces: list[list[int]], kept: int, vertices: int) -> None:
    found, sources = manifold(np.array(faces))
    assert len(found) == kept
    assert len(sources) == vertices == len(np.unique(found))
    assert is_walkable(found)
    given = {frozenset(face) for face in np.array(faces).tolist()}
    assert {frozenset(face) for face in sources[found].tolist()} <= given


def test_the_first_face_of_each_part_keeps_its_side() -> None:
    found, sources = manifold(np.array([[2, 1, 0], [1, 2, 3], [5, 6, 7], [7, 6, 8]]))
    assert sources[found][[0, 2]].tolist() == [[2, 1, 0], [5, 6, 7]]
    assert is_walkable(found)


def test_random_faces_become_walkable() -> None:
    rng = np.random.default_rng(0)
    for _ in range(20):
        found, sources = manifold(rng.integers(0, 9, (12, 3)))
        assert is_walkable(found)
        assert np.array_equal(np.unique(found), np.arange(len(sources)))


def test_half_edges_know_what_lies_across() -> None:
    one, other = across_edges(np.array([[0, 1, 2], [2, 1, 3]]))
    assert list(zip(one.tolist(), other.tolist(), strict=True)) == [(1, 3)]

from __future__ import annotations

import numpy as np
import pytest

from viewer.mesh.cutting import pieces_along, plane_section
from viewer.mesh.geodesic import Geodesics, length_of
from viewer.mesh.patch import Patch


def plane_of(count: int, seed: int = 0, jitter: float = 0.3) -> Patch:
    """A flat patch of count x count squares, its vertices moved about within it but for the rim."""
    y, x = (rows.ravel().astype(float) for rows in np.mgrid[: count + 1, : count + 1])
    inner = (x > 0) & (y > 0) & (x < count) & (y < count)
    shift = jitter * np.random.default_rng(seed).uniform(-1, 1, (2, len(x))) * inner
    number = np.arange(len(x)).reshape(count + 1, count + 1)
    a, b, c, d = (n.ravel() for n in (number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]))
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return Patch.of(np.stack([x + shift[0], y + shift[1], np.zeros(len(x))], axis=1), faces)


def loop(patch: Patch, corners: np.ndarray) -> tuple[Patch, list[np.ndarray]]:
    """The patch with these vertices, and the paths that join them in a circle."""
    numbers = []
    for corner in corners:
        patch, number = patch.with_point(patch.nearest(corner))
        numbers.append(number)
    paths, lines = Geodesics(patch), []
    for start, end in zip(numbers, numbers[1:] + numbers[:1], strict=True):
        line = paths.path(start, end)
        assert line is not None
        lines.append(line)
    return patch, lines


def polygon_area(corners: np.ndarray) -> float:
    x, y = corners[:, 0], corners[:, 1]
    return abs(float((x * np.roll(y, -1) - y * np.roll(x, -1)).sum()) / 2)


@pytest.mark.parametrize("jitter", [0.0, 0.3])
@pytest.mark.parametrize(
    "corners",
    [
        [(3.1, 3.3), (8.2, 2.7), (9.4, 9.1)],
        [(2, 2), (8, 2), (8, 8), (2, 8)],  # along edges, where nothing is moved
        [(2, 2), (9, 9), (2, 9)],
        [(2.2, 2.1), (10.3, 3.2), (6.1, 5.2), (9.7, 9.9), (3.3, 8.4)],  # bent inwards
        [(5.1, 5.1), (5.4, 5.1), (5.3, 5.4)],  # within few faces
        [(0, 0), (12, 0), (12, 5), (0, 5)],  # along the rim
    ],
)
def test_pieces_of_a_plane_are_polygons(corners: list[tuple[float, float]], jitter: float) -> None:
    flat = np.array([(*corner, 0.0) for corner in corners])
    for seed in range(3):
        patch, lines = loop(plane_of(12, seed, jitter), flat)
        pieces = pieces_along(patch, lines)
        areas = sorted(float(piece.areas.sum()) for piece in pieces)
        assert len(pieces) == 2
        assert areas[0] == pytest.approx(min(polygon_area(flat), 144 - polygon_area(flat)), rel=1e-6)
        assert sum(areas) == pytest.approx(144)


def test_a_line_that_crosses_itself_cuts_more() -> None:
    corners = np.array([(2.2, 2.1, 0), (9.3, 9.2, 0), (9.1, 2.3, 0), (2.4, 9.4, 0)])
    patch, lines = loop(plane_of(12), corners)
    pieces = pieces_along(patch, lines)
    assert len(pieces) == 3
    assert sum(piece.areas.sum() for piece in pieces) == pytest.approx(144)


def test_parts_that_no_line_reaches_are_no_pieces() -> None:
    patch = plane_of(6)
    two = Patch.of(
        np.concatenate([patch.vertices, patch.vertices + np.array([0, 0, 9])]),
        np.concatenate([patch.faces, patch.faces + len(patch.vertices)]),
    )
    cut, lines = loop(two, np.array([(1.5, 1.5, 0), (4.5, 1.6, 0), (3.2, 4.4, 0)]))
    assert sum(piece.areas.sum() for piece in pieces_along(cut, lines)) == pytest.approx(36)


def test_a_plane_cuts_a_box_in_a_closed_line() -> None:
    corners = np.array([(x, y, z) for x in (0, 1) for y in (0, 2) for z in (0, 3)], float)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = [face for a, b, c, d in quads for face in ((a, b, c), (a, c, d))]
    box = Patch.of(corners, np.array(faces))
    (line,) = plane_section(box, np.array([0, 0, 1.2]), np.array([0, 0, 1.0]))
    assert length_of(line) == pytest.approx(6)
    assert (line[0] == line[-1]).all()
    assert plane_section(box, np.array([0, 0, 4.0]), np.array([0, 0, 1.0])) == []
    through = plane_section(box, np.array([0, 0, 0.0]), np.array([1.0, 1, 0]))  # along an edge, and beyond
    assert sum(map(length_of, through)) < 1e-9


def test_a_plane_cuts_an_open_sheet_in_open_lines() -> None:
    (line,) = plane_section(plane_of(12), np.array([6.1, 0, 0]), np.array([1.0, 0, 0]))
    assert length_of(line) == pytest.approx(12)
    assert sorted(line[[0, -1], 1]) == pytest.approx([0, 12])

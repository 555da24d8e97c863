"""Measures of surfaces against analytic ones: of points, of faces, and where there is none."""

from __future__ import annotations

import numpy as np
import pytest
from shapes import found, pose_of, refused, sphere_points

from viewer.analysis.measures.outlines import Prism
from viewer.analysis.measures.prism import area_through
from viewer.analysis.measures.surface import PoseSurface
from viewer.mesh.patch import Patch

R = 20.0
AWAY = np.array([3e5, -2e5, 1e5])
CAP = 0.6  # radians from its pole to its rim


def rim(count: int) -> np.ndarray:
    """Landmarks around a cap of the sphere, (K, 3)."""
    turns = 2 * np.pi * np.arange(count) / count
    place = [np.sin(CAP) * np.cos(turns), np.sin(CAP) * np.sin(turns), np.full(count, np.cos(CAP))]
    return R * np.stack(place, axis=1)


@pytest.fixture(scope="module")
def ball() -> PoseSurface:
    points = sphere_points(6000, R)
    return PoseSurface(pose_of(points + AWAY, normals=points / R))


def test_a_path_is_an_arc(ball: PoseSurface) -> None:
    ends = rim(4)[[0, 2]]
    path = found(ball, "path", ends + AWAY)
    assert path.value == pytest.approx(2 * R * CAP, rel=2e-3)
    along = np.array([[np.cos(CAP), 0, -np.sin(CAP)], [-np.cos(CAP), 0, -np.sin(CAP)]])
    assert path.gradient == pytest.approx(along, abs=0.1)
    assert abs(path.value - 2 * R * CAP) < 2 * path.deviation < 0.2
    (line,) = path.lines
    assert line[0] == pytest.approx(ends[0] + AWAY, abs=0.05)
    outwards = np.array([line[0] - line[1], line[-1] - line[-2]])
    outwards /= np.linalg.norm(outwards, axis=1, keepdims=True)
    assert path.gradient == pytest.approx(outwards, abs=1e-6), "of the line's first and last piece"
    assert np.linalg.norm(line - AWAY, axis=1) == pytest.approx(R, rel=5e-3)
    there = found(ball, "path", np.concatenate([ends, ends[:1]]) + AWAY)
    closed = found(ball, "path", ends + AWAY, closed="yes")
    assert there.value == closed.value == pytest.approx(2 * path.value)
    assert closed.gradient == pytest.approx(there.gradient[:2] + np.array([there.gradient[2], [0, 0, 0]]))


def test_a_region_is_a_cap(ball: PoseSurface) -> None:
    """Whose rim is a polygon of great circles: area by Girard, volume by its cone less that of the plane."""
    count = 24
    corners = rim(count)
    a, b, c = corners[-1] / R, corners[0] / R, corners[1] / R
    leaving = [side - b * (side @ b) for side in (a, c)]
    angle = np.arccos(leaving[0] @ leaving[1] / np.prod(np.linalg.norm(leaving, axis=1)))
    area = R**2 * (count * angle - (count - 2) * np.pi)
    for kind, expected, rel in (
        ("area", area, 3e-3),
        ("perimeter", count * R * np.arccos(b @ c), 3e-3),
        ("volume", np.pi * R**3 * (2 - 3 * np.cos(CAP) + np.cos(CAP) ** 3) / 3, 3e-2),
    ):
        region = found(ball, kind, corners + AWAY)
        assert region.value == pytest.approx(expected, rel=rel)
        assert region.gradient.shape == (count, 3)
        assert len(region.lines) == count
    turned = found(ball, "area", corners[::-1] + AWAY)
    assert turned.value == pytest.approx(area, rel=3e-3)


def test_all_in_a_prism_is_on_both_sides(ball: PoseSurface) -> None:
    """What lies over a polygon about the pole lies beneath it as well: two caps of the sphere."""
    corners = rim(24)
    front = found(ball, "area", corners + AWAY)
    through = found(ball, "area", corners + AWAY, depth="through")
    around = found(ball, "perimeter", corners + AWAY, depth="through")
    shadow = 12 * (R * np.sin(CAP)) ** 2 * np.sin(np.pi / 12)  # of the polygon, in its plane
    assert shadow < through.value / 2 < front.value
    cap = 2 * np.pi * R**2 * (1 - np.cos(CAP))
    assert through.value == pytest.approx(2 * cap * shadow / (np.pi * (R * np.sin(CAP)) ** 2), rel=5e-3)
    assert around.value == pytest.approx(2 * 2 * np.pi * R * np.sin(CAP), rel=5e-3)
    assert {bool(line[0, 2] > AWAY[2]) for line in around.lines} == {True, False}
    outward = corners * (1, 1, 0) / np.linalg.norm(corners * (1, 1, 0), axis=1, keepdims=True)
    grown = found(ball, "area", corners + 0.5 * outward + AWAY, depth="through")
    widened = float((0.5 * outward * through.gradient).sum())
    assert grown.value - through.value == pytest.approx(widened, rel=0.1)


def test_over_a_square_of_small_faces_there_is_its_area() -> None:
    """Faces are a tenth of a unit wide, so that each length in the measure has to be in spacings."""
    places = np.stack(np.meshgrid(np.arange(-30, 31), np.arange(-30, 31)), axis=-1).reshape(-1, 2) / 10
    row, column = (each.ravel() for each in np.mgrid[:60, :60])
    a = row * 61 + column
    faces = np.concatenate([np.stack([a, a + 1, a + 61], axis=1), np.stack([a + 1, a + 62, a + 61], axis=1)])
    surface = PoseSurface(pose_of(np.pad(places, ((0, 0), (0, 1)))), faces.astype(np.uint32))
    square = np.array([[-1.02, -1.02, 0], [1.02, -1.02, 0], [1.02, 1.02, 0], [-1.02, 1.02, 0]])
    area = found(surface, "area", square, depth="through")
    assert area.value == pytest.approx(2.04**2, rel=4e-3)
    assert area.gradient == pytest.approx(square, abs=0.12), "half the diagonal across, outwards"
    patch = Patch.of(surface._points, faces)
    areas = area_through(patch, Prism.over(square))
    assert areas.sum() == pytest.approx(2.04**2, rel=4e-3), "however far the patch reaches"


@pytest.mark.parametrize("kind", ["area", "perimeter", "volume", "path"])
def test_gradients_are_of_values(ball: PoseSurface, kind: str) -> None:
    """As a landmark slides along the surface."""
    corners = rim(4) if kind != "path" else rim(4)[:2]
    here = found(ball, kind, corners + AWAY)
    step = 0.02 * R
    for side in (np.array([np.cos(CAP), 0, -np.sin(CAP)]), np.array([0, 1.0, 0])):
        values = []
        for sign in (1, -1):
            moved = corners.copy()
            moved[0] += sign * step * side
            moved[0] *= R / np.linalg.norm(moved[0])
            there = found(ball, kind, moved + AWAY)
            values.append(there.value)
        slope = (values[0] - values[1]) / (2 * step)
        size = np.linalg.norm(here.gradient[0])
        assert here.gradient[0] @ side == pytest.approx(slope, abs=(0.15 if kind == "volume" else 0.1) * size)


def test_a_section_is_a_circle(ball: PoseSurface) -> None:
    section = found(ball, "section", rim(3) + AWAY)
    assert section.value == pytest.approx(2 * np.pi * R * np.sin(CAP), rel=3e-3)
    slope = 2 * np.pi / np.tan(CAP)  # of the length, as the plane moves along its normal; a third by each
    assert section.gradient == pytest.approx(np.tile([0, 0, -slope / 3], (3, 1)), abs=0.6)


def test_noise_is_smoothed_away() -> None:
    points = sphere_points(6000, R, noise=0.2, seed=1)
    surface = PoseSurface(pose_of(points, normals=points / R))
    assert surface.noise == pytest.approx(0.2, rel=0.15)
    path = found(surface, "path", rim(4)[[0, 2]])
    assert path.value == pytest.approx(2 * R * CAP, rel=5e-3)


@pytest.mark.slow
@pytest.mark.parametrize(("noise", "most"), [(0.0, 2e-3), (0.2, 5e-3)])
def test_paths_on_a_sphere_of_100_mm_of_40_000_points_are_as_long_as_great_circles(
    noise: float, most: float
) -> None:
    """Ends by chance, 35 to 120 mm apart. noise: mm."""
    surface = PoseSurface(pose_of(sphere_points(40_000, 100.0, noise, seed=2)))
    rng = np.random.default_rng(3)
    for turn in (0.35, 0.7, 1.2):
        one, other = np.linalg.qr(rng.standard_normal((3, 2)))[0].T
        ends = 100 * np.array([one, np.cos(turn) * one + np.sin(turn) * other])
        path = found(surface, "path", ends)
        assert path.value == pytest.approx(100 * turn, rel=most)
        assert abs(path.value - 100 * turn) < 3 * path.deviation


def box_of_faces(count: int) -> tuple[np.ndarray, np.ndarray]:
    """An open box of edge 10, its five sides of count x count squares."""
    quads: list[list[int]] = []
    numbers: dict[tuple[float, ...], int] = {}
    step = 10 / count
    sides = [
        ((0, 0, 1), (1, 0, 0), (0, 1, 0)),
        ((0, 0, 0), (0, 0, 1), (0, 1, 0)),
        ((1, 0, 1), (0, 0, -1), (0, 1, 0)),
        ((0, 1, 1), (1, 0, 0), (0, 0, -1)),
        ((0, 0, 0), (1, 0, 0), (0, 0, 1)),
    ]
    for start, right, up in np.array(sides):
        for i, j in np.ndindex(count, count):
            quad = []
            for a, b in ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)):
                place = tuple((10 * start + step * (a * right + b * up)).round(6).tolist())
                quad.append(numbers.setdefault(place, len(numbers)))
            quads.append(quad)
    corners = np.array(list(numbers), float)
    return corners, np.array([(q[0], q[k], q[k + 1]) for q in quads for k in (1, 2)])


def test_faces_of_the_scan_are_used() -> None:
    """Paths fold over the edges of a box as over that of paper."""
    corners, faces = box_of_faces(5)
    surface = PoseSurface(pose_of(corners), faces.astype(np.uint32))
    path = found(surface, "path", np.array([[5.0, 5, 10], [10, 5, 3]]))
    assert path.value == pytest.approx(12)
    oblique = found(surface, "path", np.array([[9.0, 5, 10], [10, 1, 8]]))
    assert oblique.value == pytest.approx(5)
    area = found(surface, "area", np.array([[2.0, 2, 10], [8, 2, 10], [8, 8, 10], [2, 8, 10]]))
    assert area.value == pytest.approx(36)
    assert area.deviation == pytest.approx(0, abs=1e-6)
    section = found(surface, "section", np.array([[0.0, 5, 4], [10, 5, 4], [5, 10, 4]]))
    assert section.value == pytest.approx(40)


def test_faces_whose_points_were_dropped_are_left_out() -> None:
    corners, faces = box_of_faces(5)
    hole = np.linalg.norm(corners - [6, 6, 10], axis=1).argmin()
    corners[hole] = np.nan
    surface = PoseSurface(pose_of(corners), faces.astype(np.uint32))
    path = found(surface, "path", np.array([[2.0, 6, 10], [9, 6, 10]]))
    assert 7.2 < path.value < 9


def test_where_there_is_no_surface_the_reason_is_told() -> None:
    patch = sphere_points(4000, R)
    two = np.concatenate([patch, patch + np.array([60, 0, 0])])
    surface = PoseSurface(pose_of(two, normals=np.concatenate([patch, patch]) / R))
    assert refused(surface, "path", np.array([[0, 0, R], [60, 0, R]])) == "no surface connects 0 and 1"
    assert refused(surface, "path", np.array([[0, 0, R], [0, 0, 2 * R]])) == "1 is off the surface"
    assert refused(surface, "area", np.array([[0, 0, R], [0, R, 0], [30, 0, 0]])) == "2 is off the surface"
    in_a_line = np.array([[0.0, 0, R], [0, 0, 0], [0, 0, -R]])
    assert "define no plane" in refused(surface, "section", in_a_line)
    few = PoseSurface(pose_of(np.eye(3)[:2]))
    assert refused(few, "path", np.eye(3)[:2]) == "there is no surface near 0"

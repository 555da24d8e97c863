"""Landmarks of files on a scan."""

from __future__ import annotations

import numpy as np

from viewer.analysis.landmarks import Landmark
from viewer.analysis.landmarks.landmark_set import LandmarkSet
from viewer.analysis.landmarks.placed import landmarks_of, surface_point_at, why_beside
from viewer.analysis.surface_point import followed
from viewer.analysis.track import Known
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose

GRID = np.stack(np.meshgrid(np.arange(20.0), np.arange(20.0), [0.0]), axis=-1).reshape(-1, 3)
STEP = np.array([3.0, -1.0, 2.0])
POSES = [Pose(n, n / 10, "", PointCloud.from_arrays(GRID + n * STEP)) for n in range(4)]


def test_a_place_follows_the_points_around_it() -> None:
    place = np.array([7.3, 8.8, 0.0])
    spot = surface_point_at(place, POSES[1], 0.2)
    spot = surface_point_at(place + STEP, POSES[1], 0.2)
    assert (spot.frame, spot.time, len(spot.neighbors)) == (1, 0.1, 8)
    assert spot.uncertainty is not None
    np.testing.assert_allclose(spot.uncertainty, 1.96 * 0.2)
    later = followed(spot, POSES[3])
    assert later is not None
    np.testing.assert_allclose(later.position, place + 3 * STEP, atol=1e-6)


def test_a_place_beside_the_surface_follows_nothing() -> None:
    spot = surface_point_at(np.array([7.0, 8.0, 40.0]), POSES[0])
    assert spot.id is None
    assert spot.neighbors == ()
    assert spot.spread is not None
    np.testing.assert_allclose(np.diag(spot.spread), 40.0**2)


def test_what_a_file_has_becomes_keys() -> None:
    known = np.full((3, 3), Known.TRACKED, np.uint8)
    known[0, 0] = known[2, 0] = Known.PLACED
    known[1, 1] = Known.GAP
    known[:, 2] = Known.PENDING
    positions = GRID[[[30, 40, 50]]] + np.arange(3)[:, None, None] * STEP
    found = LandmarkSet.of(["chL", "chR", "later"], positions, known=known, frames=[0, 1, 7])
    kept = (Landmark("later", partner="sooner", about="at the end"),)
    left, right, later = landmarks_of(found, POSES.__getitem__, len(POSES), 0, kept)
    assert [key.frame for key in left.keys] == [0]  # frame 7 is none of the scan's
    assert [key.frame for key in right.keys] == [0]  # of tracked ones, where nothing was placed
    assert (left.partner, right.partner, later.partner) == ("chR", "chL", "sooner")
    assert (later.state, later.about) == ("not placed", "at the end")


def test_one_moment_is_of_the_frame_that_is_shown() -> None:
    found = LandmarkSet.of(["a"], GRID[[[3]]] + 2 * STEP)
    (landmark,) = landmarks_of(found, POSES.__getitem__, len(POSES), 2)
    assert [key.frame for key in landmark.keys] == [2]


def test_landmarks_beside_the_surface_are_told() -> None:
    places = GRID[None, 100:110] + [[0.0, 0.0, 2.0]]
    names = [f"p{n}" for n in range(10)]
    for lifted, is_told in ((2, False), (3, True)):
        places[0, :lifted, 2] = 9.0
        made = landmarks_of(LandmarkSet.of(names, places), POSES.__getitem__, len(POSES), 0)
        told = why_beside(made)
        assert (told is not None) == is_told
    assert told is not None
    assert told.startswith("3 of 10 landmarks do not lie on the surface (p0, p1, p2)")
    assert why_beside([Landmark("a")]) is None


def test_a_title_has_the_name_in_words_where_one_is_known() -> None:
    assert Landmark("sn", about="Subnasale: where the nose meets the lip").title == "Subnasale (sn)"
    assert Landmark("vertex", about="Vertex: the highest point of the head").title == "vertex"
    assert Landmark("mine", about="left of the scar").title == Landmark("mine").title == "mine"

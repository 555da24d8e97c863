"""Points that recur from frame to frame are found again, and nothing that only looks like them is."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest
from experiments.landmarks.known import KeptFrames
from numpy.typing import NDArray
from swinging_arms import LONG, SPACING, THICK, arms, on_arm

from viewer.analysis.landmarks import Landmark
from viewer.analysis.surface_point import SurfacePoint
from viewer.analysis.track import Known, Track
from viewer.analysis.tracking import track_landmarks
from viewer.analysis.tracking.pattern import ExpectedPoints, PointPattern, RecurringPoints
from viewer.analysis.tracking.surface import MomentSurface
from viewer.geometry import vector
from viewer.scan.points import PointCloud
from viewer.scan.timeline import Timeline

Float = NDArray[np.float64]

WIDE = 26.0  # of the sheet, spacings
NOWHERE = np.empty((0, 3))


def scattered(seed: int) -> Float:
    """Places of a sheet (N, 2) at random, one for each unit of its area."""
    return np.random.default_rng(seed).uniform(0, WIDE, (int(WIDE**2), 2))


def lattice(slide: float = 0.0) -> Float:
    """The places of a grid (N, 2) that slides along the sheet."""
    steps = np.arange(WIDE) + slide
    return np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)


def sheet(places: Float, bend: float, motion: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Float:
    """Places (N, 2) of a sheet that is bent, and moved, as points (N, 3)."""
    u, v = places.T
    return np.stack([u, v, bend * ((u - 13) ** 2 - 0.5 * (v - 13) ** 2) / 26], axis=1) + motion


def matched(before: Float, now: Float) -> NDArray[np.int64]:
    surfaces = MomentSurface(before, 1.0), MomentSurface(now, 1.0)
    return RecurringPoints(*surfaces, NOWHERE, NOWHERE).matches


def test_hundreds_of_copies_of_a_point_are_passed_over() -> None:
    points = sheet(scattered(0), 0.3)
    copied = np.concatenate([points, np.tile(points[300], (600, 1))])
    assert (matched(points, copied)[:300] >= 0).mean() > 0.9
    surface = MomentSurface(copied, 1.0)
    assert surface.axes_at(points[300], 1.0) is None
    assert PointPattern.around(surface, points[300]) is None


@pytest.mark.parametrize(("missing", "least"), [(0.0, 0.97), (0.1, 0.9)])
def test_points_in_another_order_are_matched_although_some_are_missing(missing: float, least: float) -> None:
    chance, places = np.random.default_rng(1), scattered(0)
    before = np.flatnonzero(chance.random(len(places)) >= missing)
    now = chance.permutation(np.flatnonzero(chance.random(len(places)) >= missing))
    found = matched(sheet(places[before], 0.3), sheet(places[now], 0.6, (2.0, 1.0, 0.5)))
    is_found = found >= 0
    assert (now[found[is_found]] == before[is_found]).mean() > 0.99
    assert is_found[np.isin(before, now)].mean() > least


def test_a_part_of_the_surface_is_matched_where_the_other_frame_has_it() -> None:
    places = scattered(0)
    kept = np.flatnonzero(places[:, 0] > 10)
    found = matched(sheet(places, 0.3), sheet(places[kept], 0.5))
    is_found = found >= 0
    assert (kept[found[is_found]] == np.flatnonzero(is_found)).mean() > 0.99
    assert is_found[kept].mean() > 0.9


def test_noise_takes_matches_and_makes_few_wrong_ones() -> None:
    places, shares = scattered(0), []
    for noise in (0.0, 0.05, 0.1, 0.3):
        chance = np.random.default_rng(2)
        one, other = (sheet(places, bend) + chance.normal(0, noise, (len(places), 3)) for bend in (0.3, 0.5))
        found = matched(one, other)
        right = found == np.arange(len(places))
        assert (~right & (found >= 0)).mean() < 0.05
        shares.append(right.mean())
    assert shares[0] > 0.97
    assert shares[3] < 0.02
    assert (np.diff(shares) <= 0).all()


def test_a_way_that_is_known_about_tells_noisy_points() -> None:
    """The search from nothing finds none of these; a way that is off by a spacing, or a few matches, do."""
    chance = np.random.default_rng(0)
    places = scattered(0)
    one = sheet(places, 0.3) + chance.normal(0, 0.09, (len(places), 3))
    orders = chance.permutation(len(places))
    other = (sheet(places, 0.5, (9.0, 0.0, 0.0)) + chance.normal(0, 0.09, (len(places), 3)))[orders]
    right = np.argsort(orders)
    assert (matched(one, other) < 0).all()
    surfaces = MomentSurface(one, 1.0), MomentSurface(other, 1.0)
    maps = np.tile(np.eye(3), (len(one), 1, 1))
    none = np.full(len(one), -1)
    few = np.where(places[:, 0] < 4, right, -1)
    for known, off in ((none, 0.7), (few, 0.0)):
        there = one + np.array([9.0 + off, off, 0.0])
        expected = ExpectedPoints(known, there, maps)
        found = RecurringPoints(*surfaces, NOWHERE, NOWHERE, expected).matches
        assert (found == right).mean() > 0.25
        assert ((found >= 0) & (found != right)).mean() < 0.05


@pytest.mark.each_value
@pytest.mark.parametrize("jitter", [0.0, 0.05])
@pytest.mark.parametrize("slide", [0.0, 0.3, 1.0])
def test_a_grid_that_slides_over_the_surface_is_not_taken_for_matter(slide: float, jitter: float) -> None:
    chance = np.random.default_rng(3)
    one, other = (
        sheet(places + chance.normal(0, jitter, places.shape), 0.4) for places in (lattice(), lattice(slide))
    )
    assert (matched(one, other) < 0).all()


def test_points_at_other_places_are_not_taken_for_the_same() -> None:
    assert (matched(sheet(scattered(0), 0.3), sheet(scattered(1), 0.3)) < 0).all()


def test_the_pattern_of_points_at_random_is_hardly_ever_found_elsewhere() -> None:
    surface, other = (MomentSurface(sheet(scattered(seed), 0.3), 1.0) for seed in (5, 6))
    for place in sheet(np.random.default_rng(7).uniform(4, WIDE - 4, (150, 2)), 0.3):
        pattern = PointPattern.around(surface, place)
        assert pattern is not None
        assert pattern.found(other, place, np.eye(3)) is None


FRAMES = 4
AROUND = np.random.default_rng(8).uniform(0, 2 * np.pi, 4)
RINGS = np.stack([THICK * np.cos(AROUND), THICK * np.sin(AROUND), np.linspace(-10, 4 - LONG, 4)], axis=1)
PATHS = np.array([[*on_arm(n, -1, RINGS), *on_arm(n, 1, RINGS)] for n in range(FRAMES)])


def tracks_of_arms(noise: float, kept: float = 1.0, scale: float = 1.0) -> Mapping[str, Track]:
    """Tracks of landmarks of both arms, whose points come back in another order in each frame.

    noise: of each point in each frame, standard deviation. kept: share of the points that a frame has.
    """
    clouds = []
    for frame in range(FRAMES):
        chance, points = np.random.default_rng(frame), arms(frame, 0)
        points = points[chance.permutation(len(points))[: int(kept * len(points))]]
        clouds.append(PointCloud.from_arrays(scale * (points + chance.normal(0, noise, points.shape))))
    landmarks = [
        Landmark(f"{n}").with_key(SurfacePoint(0, 0.0, vector(place), None, scale * SPACING, 0, (0.0,) * 6))
        for n, place in enumerate(scale * PATHS[0])
    ]
    source = KeptFrames("arms", clouds, np.arange(float(FRAMES)))
    with Timeline(source, source.times(), "mm") as scan:
        return track_landmarks(scan, landmarks)


@pytest.mark.slow
def test_the_unit_of_a_scan_changes_lengths_alone() -> None:
    scale = 64.0  # changes the exponents of numbers, and no digit
    tracks, scaled = tracks_of_arms(0.05), tracks_of_arms(0.05, scale=scale)
    for name, track in tracks.items():
        np.testing.assert_array_equal(scaled[name].known, track.known)
        np.testing.assert_allclose(scaled[name].positions, scale * track.positions, rtol=1e-6)
        np.testing.assert_allclose(scaled[name].sigmas, scale * track.sigmas, rtol=1e-6)


def judged(tracks: Mapping[str, Track]) -> tuple[Float, Float]:
    """The errors of what is tracked and their standard deviations, (n,) each."""
    off, sigmas = [], []
    for n, track in enumerate(tracks.values()):
        told = track.known == Known.TRACKED
        off.append(np.linalg.norm(track.positions - PATHS[:, n], axis=1)[told])
        sigmas.append(track.sigmas[told])
    return np.concatenate(off), np.concatenate(sigmas)


def test_landmarks_go_along_with_points_that_come_back_in_most_frames() -> None:
    off, sigmas = judged(tracks_of_arms(0.0, 0.9))
    assert len(off) == len(PATHS[0]) * (FRAMES - 1), "there are gaps"
    assert off.max() < 0.15 * SPACING
    assert (off <= 2 * sigmas).mean() > 0.9
    assert sigmas.max() < 0.3 * SPACING


def test_noise_of_the_points_is_told() -> None:
    off, sigmas = judged(tracks_of_arms(0.05))
    assert len(off) > 0.9 * len(PATHS[0]) * (FRAMES - 1)
    assert (off <= 2 * sigmas).mean() >= 0.9
    assert np.median(sigmas) < 0.15 * SPACING

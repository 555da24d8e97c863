"""Measures over all frames: gaps, poses read once, and standard deviations that are right."""

from __future__ import annotations

import numpy as np
import pytest
from shapes import Frames, sphere_points, track_of

from viewer.analysis.measures import Measure, Series
from viewer.analysis.measures.series import all_series, lines_of, series_of
from viewer.analysis.track import Known, Track
from viewer.errors import InputError
from viewer.mesh.geodesic import length_of
from viewer.scan.faces import Faces
from viewer.scan.points import PointCloud
from viewer.task import Cancelled, Task

R = 20.0


def tracks_of(positions: dict[str, list], **options: float) -> dict[str, Track]:
    return {name: track_of(there, **options) for name, there in positions.items()}


def test_values_are_known_where_all_landmarks_are() -> None:
    tracks = {
        "näsal ✓": track_of([(0, 0, 0)] * 4, gaps=[1]),
        "b": track_of([(3, 4, 0), (3, 4, 0), (6, 8, 0), (0, 0, 5)], gaps=[3]),
    }
    tracks["b"].known[2] = Known.PLACED
    found = series_of(Measure("m", "distance", ("näsal ✓", "b")), tracks)
    assert found.quantity == "length"
    assert found.values == pytest.approx([5, np.nan, 10, np.nan], nan_ok=True)
    assert found.known.tolist() == [Known.TRACKED, Known.GAP, Known.TRACKED, Known.GAP]
    assert found.sigmas == pytest.approx(
        [0.1 * np.sqrt(2), np.nan, 0.1 * np.sqrt(2), np.nan], rel=1e-3, nan_ok=True
    )
    assert (found.times == tracks["b"].times).all()


def test_landmarks_that_are_nowhere_leave_it_open() -> None:
    tracks = tracks_of({"a": [(0, 0, 0)] * 3})
    found = series_of(Measure("m", "distance", ("a", "b")), tracks)
    assert (found.known == Known.PENDING).all()
    assert np.isnan(found.values).all()
    empty = series_of(Measure("m", "distance", ("a", "b")), {})
    assert len(empty.values) == 0


def test_a_value_that_there_is_not_is_a_gap() -> None:
    tracks = tracks_of(
        {"a": [(0, 0, 0), (0, 0, 0)], "b": [(0, 0, 0), (1, 0, 0)], "c": [(1, 0, 0), (0, 1, 0)]}
    )
    found = series_of(Measure("m", "angle", ("a", "b", "c")), tracks)
    assert found.known.tolist() == [Known.GAP, Known.TRACKED]
    same = series_of(Measure("m", "angle", ("a", "a", "c")), tracks)
    assert same.known.tolist() == [Known.GAP, Known.GAP]


def test_covariances_that_nobody_knows_leave_the_deviation_open() -> None:
    tracks = tracks_of({"a": [(0, 0, 0)] * 2, "b": [(1, 0, 0)] * 2})
    tracks["a"].covariances[0] = np.nan
    found = series_of(Measure("m", "distance", ("a", "b")), tracks)
    assert np.isfinite(found.sigmas).tolist() == [False, True]


def test_the_scanners_noise_adds_to_all() -> None:
    tracks = tracks_of({"a": [(0, 0, 0)], "b": [(9, 0, 0)]}, deviation=0.3)
    found = series_of(Measure("m", "distance", ("a", "b")), tracks, noise=0.4)
    assert found.sigmas[0] == pytest.approx(0.5 * np.sqrt(2), rel=1e-2)


@pytest.mark.parametrize(
    ("kind", "count"),
    [("distance", 2), ("angle", 3), ("plane_angle", 5), ("plane_distance", 5), ("curve", 4)],
)
def test_two_deviations_cover_what_chance_does(kind: str, count: int) -> None:
    """Of landmarks in many places, each off by its own covariance: 80 to 98 %."""
    rng, frames = np.random.default_rng(0), 2000
    names = [str(number) for number in range(count)]
    true, tracks = {}, {}
    for name in names:
        spread = rng.standard_normal((frames, 3, 3)) * rng.uniform(0.05, 0.5, (frames, 1, 3))
        covariances = spread @ spread.transpose(0, 2, 1)
        there = rng.uniform(-30, 30, (frames, 3))
        off = there + np.einsum("tij,tj->ti", spread, rng.standard_normal((frames, 3)))
        known = np.full(frames, Known.TRACKED, np.uint8)
        true[name] = Track(np.arange(float(frames)), there, 0 * covariances, known, {})
        tracks[name] = Track(np.arange(float(frames)), off, covariances, known, {})
    measure = Measure("m", kind, tuple(names))
    found, expected = series_of(measure, tracks), series_of(measure, true)
    within = np.abs(found.values - expected.values) <= 2 * found.sigmas
    assert 0.9 < within.mean() < 0.98
    assert expected.sigmas == pytest.approx(0)


def test_a_landmark_named_twice_moves_once() -> None:
    tracks = tracks_of({"a": [(0, 0, 0)], "b": [(9, 0, 0)], "c": [(9, 3, 0)]}, deviation=0.2)
    there = series_of(Measure("m", "curve", ("a", "b", "a"), {"shape": "straight"}), tracks)
    assert there.values[0] == pytest.approx(18)
    assert there.sigmas[0] == pytest.approx(2 * 0.2 * np.sqrt(2), rel=1e-3)


def sphere_frames(count: int = 3) -> Frames:
    clouds = []
    for number in range(count):
        points = sphere_points(3000, R, seed=number)
        clouds.append(PointCloud.from_arrays(points, normals=points / R))
    return Frames(clouds)


MEASURES = (
    Measure("way", "path", ("a", "b")),
    Measure("cheek", "area", ("a", "b", "c")),
    Measure("straight", "distance", ("a", "b")),
)


def on_sphere(frames: int, deviation: float = 0.1) -> dict[str, Track]:
    places = R * np.array([[1.0, 0, 0], [0.8, 0.6, 0], [0.8, 0, 0.6]])
    return {n: track_of([place] * frames, deviation) for n, place in zip("abc", places, strict=True)}


def test_each_pose_is_read_once_for_all_that_need_it() -> None:
    source, tracks = sphere_frames(), on_sphere(3)
    tracks["b"].known[1] = Known.GAP
    with source.timeline() as timeline:
        task = Task("measuring")
        with task.current():
            found = all_series(MEASURES, tracks, timeline)
        assert source.loaded == [1, 0, 1]
        assert task.progress is not None
        assert found["way"].values[[0, 2]] == pytest.approx(R * np.arccos(0.8), rel=5e-3)
        assert found["way"].known.tolist() == [Known.TRACKED, Known.GAP, Known.TRACKED]
        assert found["way"].sigmas[0] == pytest.approx(0.1 * np.sqrt(2), rel=0.1)
        assert found["cheek"].quantity == "area"
        assert found["straight"].values[0] == pytest.approx(R * np.sqrt(0.4))
        one = all_series(MEASURES[:1], tracks, timeline, frames=[2])["way"]
        assert np.isfinite(one.values).tolist() == [False, False, True]
    (line,) = lines_of(MEASURES[0], found["way"], tracks, 2)
    assert np.linalg.norm(line, axis=1) == pytest.approx(R, rel=0.01)
    assert length_of(line) == pytest.approx(found["way"].values[2], rel=1e-3)
    assert lines_of(MEASURES[0], found["way"], tracks, 1) == ()
    assert len(lines_of(MEASURES[1], found["cheek"], tracks, 0)) == 3


def test_what_is_known_is_told_frame_by_frame_in_the_order_asked_for() -> None:
    told: list[dict[str, Series]] = []
    with sphere_frames().timeline() as timeline:
        order = [2, 0, 1]
        whole = all_series(MEASURES, on_sphere(3), timeline, 0.0, order, told.append)
    assert [np.isfinite(found["way"].values).tolist() for found in told] == [
        [False, False, True], [True, False, True], [True, True, True],
    ]  # fmt: skip
    assert told[0]["way"].known.tolist() == [Known.PENDING, Known.PENDING, Known.TRACKED]
    assert np.isfinite(told[0]["straight"].values).all()
    assert set(told[0]["way"].lines) == {2}
    np.testing.assert_array_equal(told[-1]["way"].values, whole["way"].values)


def test_lines_of_landmarks_alone_lie_where_they_are_measured() -> None:
    places = {"a": (3.0, 4, 0), "b": (0.0, 0, 0), "c": (1.0, 0, 0), "d": (0.0, 1, 0), "e": (7.0, 8, 9)}
    tracks = {name: track_of([place], 0.1) for name, place in places.items()}

    def lines(kind: str, *names: str, **options: str) -> list[list[list[float]]]:
        measure = Measure("m", kind, names, options)
        found = lines_of(measure, series_of(measure, tracks), tracks, 0)
        return [np.round(line, 9).tolist() for line in found]

    a, b, c, _, e = map(list, places.values())
    assert lines("distance", "a", "b") == [[a, b]]
    assert lines("angle", "a", "b", "c") == [[a, b, c]]
    assert lines("curve", "a", "b", "c", shape="straight", closed="yes") == [[a, b, c, a]]
    (smooth,) = lines("curve", "a", "b", "c")
    assert len(smooth) == 65
    assert smooth[0] == a
    assert smooth[32] == b
    down, on = lines("plane_distance", "e", "b", "c", "d")
    assert down == [e, [7, 8, 0]]
    assert on == [[7, 8, 0], [round(1 / 3, 9), round(1 / 3, 9), 0]]
    assert lines("plane_angle", "b", "e", "b", "c", "d") == [[b, e], [b, [7, 8, 0]]]


def test_measuring_is_cancelled() -> None:
    with sphere_frames().timeline() as timeline:
        task = Task("measuring")
        task.cancel()
        with task.current(), pytest.raises(Cancelled):
            all_series(MEASURES, on_sphere(3), timeline)


def test_a_frame_without_the_surface_is_a_gap() -> None:
    source, tracks = sphere_frames(2), on_sphere(2)
    tracks["a"].positions[1] += 30
    with source.timeline() as timeline:
        found = all_series(MEASURES[:1], tracks, timeline)["way"]
    assert found.known.tolist() == [Known.TRACKED, Known.GAP]
    assert np.isnan(found.values[1])
    assert np.isnan(found.sigmas[1])


def test_a_broken_frame_is_a_gap() -> None:
    class Broken(Frames):
        def load(self, index: int) -> PointCloud:
            if index == 1:
                raise InputError("is damaged")
            return super().load(index)

    source = Broken(sphere_frames(3)._clouds)
    with source.timeline() as timeline:
        found = all_series(MEASURES[:1], on_sphere(3), timeline)["way"]
        assert timeline.messages
    assert found.known.tolist() == [Known.TRACKED, Known.GAP, Known.TRACKED]


def test_faces_that_change_midway_are_each_used() -> None:
    """A square of two faces, then another of three points less: paths go over what there is."""
    square = np.array([[0, 0, 0], [4, 0, 0], [4, 4, 0], [0, 4, 0]], float)
    roof = np.array([[0, 0, 0], [4, 0, 0], [4, 4, 0], [0, 4, 0], [2, 2, 3]], float)
    frames = [(square, [[0, 1, 2], [0, 2, 3]]), (roof, [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])]

    class Meshes(Frames):
        def faces(self, index: int) -> Faces:
            return Faces.of(np.array(frames[index][1]))

    clouds = [PointCloud.from_arrays(points) for points, _ in frames]
    for number, cloud in enumerate(clouds):
        object.__setattr__(cloud, "topology", f"topology {number}")
    tracks = tracks_of({"a": [(1, 2, 0), (1, 2, 1.5)], "b": [(3, 2, 0), (3, 2, 1.5)]})
    with Meshes(clouds).timeline() as timeline:
        found = series_of(Measure("way", "path", ("a", "b")), tracks, timeline)
    assert found.values[0] == pytest.approx(2)
    assert 2 < found.values[1] <= 2 * np.hypot(1, 1.5) + 1e-9


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "names"), [("path", "ab"), ("area", "abc"), ("perimeter", "abc")])
def test_two_deviations_cover_errors_on_noisy_surfaces(kind: str, names: str) -> None:
    """Landmarks that are off along a sphere of points with noise, of which scanners do not tell."""
    frames, deviation = 60, 0.15
    rng = np.random.default_rng(5)
    clouds = []
    for number in range(frames):
        points = sphere_points(4000, R, noise=0.1, seed=number)
        clouds.append(PointCloud.from_arrays(points, normals=points / R))
    exact = on_sphere(frames)
    tracks = {}
    for name, track in exact.items():
        normal = track.positions[0] / R
        flat = deviation**2 * (np.eye(3) - np.outer(normal, normal))
        off = track.positions + deviation * rng.standard_normal((frames, 3)) @ (
            np.eye(3) - np.outer(normal, normal)
        )
        tracks[name] = Track(track.times, off, np.tile(flat, (frames, 1, 1)), track.known, {})
    with Frames(clouds).timeline() as timeline:
        found = series_of(Measure("m", kind, tuple(names)), tracks, timeline)
    a, b, c = (track.positions[0] / R for track in exact.values())
    sides = [np.arccos(one @ other) for one, other in ((b, c), (a, c), (a, b))]
    half = sum(sides) / 2
    excess = 4 * np.arctan(np.sqrt(np.tan(half / 2) * np.prod([np.tan((half - side) / 2) for side in sides])))
    true = {"path": R * sides[2], "perimeter": R * sum(sides), "area": R**2 * excess}[kind]  # L'Huilier
    within = np.abs(found.values - true) <= 2 * found.sigmas
    assert 0.8 <= within.mean() <= 1.0
    assert np.abs(found.values - true).std() > 0.3 * np.median(found.sigmas)  # nor far too wide

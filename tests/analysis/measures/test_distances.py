"""Distances, and a table of them that reads back into the places of their ends."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import numpy as np
import pytest

from viewer.analysis.curves import Smoothing
from viewer.analysis.measures.curves import MeasureCurve
from viewer.analysis.measures.distances import (
    COLUMNS,
    Ends,
    distance_of,
    distance_rows,
    is_distance_table,
    read_distances,
)
from viewer.analysis.measures.series import all_series
from viewer.analysis.pick import Neighbor
from viewer.analysis.surface_point import SurfacePoint, followed
from viewer.analysis.track import Known, Track
from viewer.analysis.words import with_uncertainty
from viewer.csv_text import save_rows, to_text
from viewer.document.landmarks import Landmarks
from viewer.errors import InputError
from viewer.geometry import vector
from viewer.output.plots import line_of_curve, plot_over_time
from viewer.rigid import Rigid
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose
from viewer.scan.units import Scale

FAR = np.array([1e7, -2e7, 1e7])
POINTS = FAR + np.random.default_rng(3).random((200, 3))
SCAN, MM = 'the "left", ear', Scale("mm")
FRAMES = range(3)


def at(position: tuple[float, float, float], *deviations: float) -> SurfacePoint:
    x, y, z = (deviation**2 for deviation in deviations or (math.nan,) * 3)
    return SurfacePoint(0, 0.0, position, 0, 0.1, 0, (x, 0, 0, y, 0, z) if deviations else None)


# --- ± --------------------------------------------------------------------------------------


def test_independent_errors_along_the_line_add_in_squares() -> None:
    one, other = at((0, 0, 0), 0.05, 0.05, 0.3), at((0, 0, 50), 0.07, 0.07, 0.4)
    assert distance_of(one, other) == pytest.approx((50, 0.5), rel=1e-5)
    assert math.isnan(distance_of(one, at((0, 8, 6)))[1]), "where one end does not know"
    close = at((0, 0, 1), 7, 7, 0.4)
    assert distance_of(at((0, 0, 0), 5, 5, 0.3), close)[1] > math.hypot(5, 7), "not told apart"


def test_the_uncertainty_covers_what_ends_that_err_give() -> None:
    """Its formula against draws: ends that deviate differently in each direction."""
    rng, tilted = np.random.default_rng(1), np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))[0]
    spreads = [tilted @ np.diag([0.3, 0.1, 0.02]) ** 2 @ tilted.T, np.diag([0.05, 0.2, 0.1]) ** 2]
    places = np.array([[0.0, 0, 0], [20, 30, -10]])
    ends = [
        SurfacePoint(0, 0.0, vector(place), 0, 0.1, 0, tuple(matrix[np.triu_indices(3)].tolist()))
        for place, matrix in zip(places, spreads, strict=True)
    ]
    drawn = [rng.multivariate_normal(place, m, 100_000) for place, m in zip(places, spreads, strict=True)]
    off = np.linalg.norm(drawn[1] - drawn[0], axis=1) - math.dist(*places)
    _, sigma = distance_of(*ends)
    assert np.mean(np.abs(off) <= 1.96 * sigma) == pytest.approx(0.95, abs=0.003)


# --- as a table -----------------------------------------------------------------------------


def pose(index: int) -> Pose:
    """The points, turned and moved a little further with each frame."""
    angle = 0.3 * index
    turn = np.eye(4)
    turn[:2, :2] = [[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]]
    points = Rigid(turn).points(POINTS - FAR) + FAR
    return Pose(index, 0.5 * index, f"{index}", PointCloud.from_arrays(points))


def end(row: int, frame: int = 0) -> SurfacePoint:
    """An end beside a point, as clicks set them: it follows the points around."""
    points = pose(frame).cloud.world()
    position = points[row] + np.array([0.01, 0.02, -0.01])
    nearest = np.argsort(np.linalg.norm(points - position, axis=1))[:8]
    neighbors = tuple(Neighbor(int(n), vector(points[n] - position)) for n in nearest)
    spread = np.diag([1e-4, 4e-4, 1e-4])
    covariance = tuple(spread[np.triu_indices(3)].tolist())
    return SurfacePoint(frame, 0.5 * frame, vector(position), row, 0.1, 0, covariance, neighbors)


MADE = Landmarks().with_distance([end(3)], [end(50)]).with_distance([end(7, 1)], [end(90, 1)], "=lips")


def track(spot: SurfacePoint) -> Track:
    """An end through all frames, in the last of which it is a gap."""
    there = [followed(spot, pose(frame)) for frame in FRAMES]
    found = Track.pending(np.array([0.5 * frame for frame in FRAMES]))
    for frame, one in enumerate(there[:-1]):
        assert one is not None
        found.positions[frame], found.covariances[frame] = one.position, one.spread
        found.known[frame] = Known.PLACED if frame == spot.frame else Known.TRACKED
    found.known[-1] = Known.GAP
    return found


def rows(scale: Scale = MM, frames: range = FRAMES) -> list[list[object]]:
    tracks = {one.name: track(one.keys[0]) for one in MADE.all}
    landmarks, series = {one.name: one for one in MADE.all}, all_series(MADE.measures, tracks)
    return distance_rows(MADE.distances, landmarks, tracks, series, SCAN, scale, frames)


def saved(path: Path) -> Path:
    save_rows(path, rows())
    return path


def read(path: Path) -> dict[str, Ends]:
    return read_distances(path, SCAN, "mm", len(FRAMES), pose)


def test_a_table_has_a_row_for_each_frame_in_which_a_distance_is_known(tmp_path: Path) -> None:
    file = saved(tmp_path / "a.csv")
    assert file.read_bytes().count(b"\r\n") == 5
    with open(file, newline="", encoding="utf-8") as stream:
        table = list(csv.DictReader(stream))
    assert tuple(table[0]) == COLUMNS
    assert [(row["measure"], row["frame"], row["time"]) for row in table] == [
        ("Distance 1", "1", "0.0"), ("Distance 1", "2", "0.5"),
        ("'=lips", "1", "0.0"), ("'=lips", "2", "0.5"),
    ]  # fmt: skip
    distance, sigma = distance_of(end(3), end(50))
    first, second, *_ = table
    assert (float(first["distance"]), float(first["uncertainty"])) == pytest.approx((distance, 1.96 * sigma))
    assert float(second["distance"]) == pytest.approx(distance, rel=1e-6), "the scan moves in one piece"
    for number, spot in ((1, end(3)), (2, end(50))):
        assert (first[f"state_{number}"], int(first[f"point_{number}"])) == ("placed", spot.id)
        assert (second[f"state_{number}"], second[f"point_{number}"]) == ("tracked", "")
        assert tuple(float(first[f"{axis}_{number}"]) for axis in "xyz") == spot.position
        assert float(first[f"uncertainty_{number}"]) == pytest.approx(spot.uncertainty)
        assert (float(first[f"spacing_{number}"]), first[f"level_{number}"]) == (0.1, "0")


def test_a_plot_and_the_table_of_distances_state_the_same_uncertainty() -> None:
    series = all_series(MADE.measures, {one.name: track(one.keys[0]) for one in MADE.all})
    table = {(row[1], row[2]): row for row in rows()[1:]}
    for measure in MADE.distances:
        curve = MeasureCurve.of(series[measure.name], MM, Smoothing())
        line = line_of_curve(curve, 0, 0)
        plotted = plot_over_time(curve.times, np.arange(len(curve.times)), [line]).rows()[1:]
        for frame in (0, 1):
            row = table[measure.name, frame + 1]
            value, uncertainty = row[COLUMNS.index("distance")], row[COLUMNS.index("uncertainty")]
            assert plotted[frame][2:4] == pytest.approx([value, uncertainty], rel=1e-8)
            shown = with_uncertainty(float(curve.values[frame]), float(curve.sigmas[frame]))
            assert f"± {uncertainty:.1g}" in shown


def test_a_table_tells_lengths_in_the_unit_that_it_names_and_has_the_frames_that_are_wanted() -> None:
    millimetres, micrometres = (
        dict(zip(COLUMNS, rows(scale, range(1))[1], strict=True)) for scale in (MM, Scale("um", 1000.0))
    )
    lengths = {"distance", "uncertainty"} | {
        f"{name}_{number}" for number in (1, 2) for name in ("x", "y", "z", "uncertainty", "spacing")
    }
    for name in COLUMNS:
        if name in lengths:
            assert micrometres[name] == pytest.approx(1000.0 * millimetres[name]), name
        elif name != "unit":
            assert micrometres[name] == millimetres[name], name
    text = to_text(rows(MM, range(1)), "\t")
    assert [len(line.split("\t")) for line in text.splitlines()] == [len(COLUMNS)] * 3


def test_ends_come_back_where_they_were_placed_and_follow_their_points(tmp_path: Path) -> None:
    again = read(saved(tmp_path / "a.csv"))
    assert list(again) == [measure.name for measure in MADE.distances]
    for measure in MADE.distances:
        for name, found in zip(measure.landmarks, again[measure.name], strict=True):
            ((one,), (other,)) = MADE.named(name).keys, found
            assert (other.frame, other.time, other.position) == (one.frame, one.time, one.position)
            assert other.uncertainty == pytest.approx(one.uncertainty)
            assert {near.id for near in other.neighbors} == {near.id for near in one.neighbors}
            there, expected = followed(other, pose(2)), followed(one, pose(2))
            np.testing.assert_allclose(there.position, expected.position, rtol=0, atol=1e-6)


def test_lengths_are_converted(tmp_path: Path) -> None:
    points = POINTS / 10

    def in_cm(index: int) -> Pose:
        return Pose(index, 0.0, "0", PointCloud.from_arrays(points))

    again = read_distances(saved(tmp_path / "a.csv"), SCAN, "cm", 3, in_cm)
    ((one,), (other,)) = again["Distance 1"]
    distance, sigma = distance_of(end(3), end(50))
    assert math.dist(one.position, other.position) == pytest.approx(distance / 10)
    assert distance_of(one, other)[1] >= 0.999 * sigma / 10, "never surer than it was"


@pytest.mark.parametrize(
    ("former", "new", "words"),
    [
        ("ear", "nose", "belongs to the scan 'the \"left\", nose', not to"),
        ("mm", "furlong", "lengths are in 'furlong'"),
        (",placed,", ",", "too few or too many columns"),
        ("Distance 1,1,", "Distance 1,4,", "'frame' is 4, but must be from 1 to 3"),
        ("Distance 1,1,", "Distance 1,1.5,", "'frame' is 1.5"),
        (",placed,3,", ",placed,3,nan,", "too few or too many columns"),
        (",placed,", ",tracked,", "has no position for one end of the distance 'Distance 1'"),
    ],
)
def test_what_cannot_be_used_is_one_message(former: str, new: str, words: str, tmp_path: Path) -> None:
    path = saved(tmp_path / "a.csv")
    text = path.read_text("utf-8")
    assert former in text
    path.write_text(text.replace(former, new), "utf-8", newline="")
    assert is_distance_table(path)
    with pytest.raises(InputError) as caught:
        read(path)
    assert words in str(caught.value)
    assert "a.csv" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_damaged_tables_are_messages(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    for data in (b"", ",".join(COLUMNS).encode(), b"\xff\xfe", b'scan,"meas', b"a\r\n\0"):
        path.write_bytes(data)
        with pytest.raises(InputError):
            read(path)
    with pytest.raises(InputError, match="cannot be read"):
        read(tmp_path / "none.csv")


def test_other_tables_hold_no_distances(tmp_path: Path) -> None:
    (tmp_path / "points.csv").write_text("x,y,z\n1,2,3\n")
    assert not is_distance_table(tmp_path / "points.csv")
    assert not is_distance_table(tmp_path / "none.csv")
    assert not is_distance_table(saved(tmp_path / "a.txt"))

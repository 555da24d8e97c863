"""Measurements come back from the table that they were saved as, and nothing else does."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from viewer.analysis.measure import COLUMNS, Measurement, reading_of, table
from viewer.analysis.measured_table import is_measurement_table, read_measurements
from viewer.analysis.pick import Neighbor
from viewer.analysis.spot import Spot
from viewer.csv_text import save_rows
from viewer.errors import InputError
from viewer.geometry import vector
from viewer.rigid import Rigid
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose

FAR = np.array([1e7, -2e7, 1e7])
POINTS = FAR + np.random.default_rng(3).random((200, 3))
SCAN = 'the "left", ear'


def pose(index: int) -> Pose:
    """The points, turned and moved a little further with each frame."""
    angle = 0.3 * index
    turn = np.eye(4)
    turn[:2, :2] = [[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]]
    points = Rigid(turn).points(POINTS - FAR) + FAR
    return Pose(index, 0.5 * index, f"{index}", PointCloud.from_arrays(points))


def end(row: int, frame: int = 0) -> Spot:
    """An end beside a point, as clicks set them: it follows the points around."""
    points = pose(frame).cloud.world()
    position = points[row] + np.array([0.01, 0.02, -0.01])
    nearest = np.argsort(np.linalg.norm(points - position, axis=1))[:8]
    neighbors = tuple(Neighbor(int(n), vector(points[n] - position)) for n in nearest)
    spread = np.diag([1e-4, 4e-4, 1e-4])
    covariance = tuple(spread[np.triu_indices(3)].tolist())
    return Spot(frame, 0.5 * frame, vector(position), "surface", row, 0.1, 0, covariance, neighbors)


MADE = (Measurement(end(3), end(50)), Measurement(end(7, 1), end(90, 1)))


def saved(path: Path) -> Path:
    """The measurements as they stand in frame 2, with a second row each, as the window saves them."""
    rows = []
    for number, made in enumerate(MADE, 1):
        rows += [(number, reading_of(made, pose(frame), True)) for frame in (made.first.frame, 2)]
    save_rows(path, table(rows, SCAN, "mm"))
    return path


def read(path: Path) -> tuple[Measurement, ...]:
    return read_measurements(path, SCAN, "mm", 3, pose)


def test_they_come_back_as_they_were_made_and_follow_their_points(tmp_path: Path) -> None:
    again = read(saved(tmp_path / "a.csv"))
    assert len(again) == len(MADE)
    for made, found in zip(MADE, again, strict=True):
        for one, other in zip(made.ends, found.ends, strict=True):
            for name in ("frame", "time", "position", "id", "spacing", "level", "snapped"):
                assert getattr(other, name) == getattr(one, name), name
            assert other.uncertainty == pytest.approx(one.uncertainty)
            assert {near.id for near in other.neighbors} == {near.id for near in one.neighbors} | {one.id}
        assert found.uncertainty >= 0.999 * made.uncertainty, "never surer than it was"
        there, expected = reading_of(found, pose(2), True), reading_of(made, pose(2), True)
        assert there.fixed is None
        for one, other in zip(expected.measurement.ends, there.measurement.ends, strict=True):
            np.testing.assert_allclose(other.position, one.position, rtol=0, atol=1e-6)


def test_lengths_are_converted(tmp_path: Path) -> None:
    points = pose(0).cloud.world() / 10

    def in_cm(index: int) -> Pose:
        return Pose(0, 0.0, "0", PointCloud.from_arrays(points))

    for made, found in zip(
        MADE, read_measurements(saved(tmp_path / "a.csv"), SCAN, "cm", 3, in_cm), strict=True
    ):
        assert found.distance == pytest.approx(made.distance / 10)
        assert found.first.spacing == pytest.approx(0.01)


@pytest.mark.parametrize(
    ("former", "new", "words"),
    [
        ("ear", "nose", "is of 'the \"left\", nose', not of"),
        ("mm", "furlong", "lengths are in 'furlong'"),
        (",surface,", ",", "a column is missing"),
        (",1,0.0,3,", ",4,0.0,3,", "'frame_1' is 4, and not from 1 to 3"),
        (",1,0.0,3,", ",1.5,0.0,3,", "'frame_1' is 1.5"),
        (",1,0.0,3,", ",1,nan,3,", "'time_1' is no number but 'nan'"),
        (",1,0.0,3,", ",1,0.0,three,", "'id_1' is no number but 'three'"),
    ],
)
def test_what_cannot_be_used_is_one_message(former: str, new: str, words: str, tmp_path: Path) -> None:
    path = saved(tmp_path / "a.csv")
    text = path.read_text("utf-8")
    assert former in text
    path.write_text(text.replace(former, new), "utf-8", newline="")
    assert is_measurement_table(path)
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


def test_other_tables_are_none_of_measurements(tmp_path: Path) -> None:
    (tmp_path / "points.csv").write_text("x,y,z\n1,2,3\n")
    assert not is_measurement_table(tmp_path / "points.csv")
    assert not is_measurement_table(tmp_path / "none.csv")
    assert not is_measurement_table(saved(tmp_path / "a.txt"))

"""Roles of columns: by names of other programs, by suffixes, by values; tables of several moments."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from viewer.scan.reading import columns
from viewer.scan.reading.corrections import Corrections

RANDOM = np.random.default_rng(7)
POINTS = RANDOM.normal(size=(50, 3)) * 100


def unit_rows(count: int = 50) -> NDArray[np.float64]:
    rows = RANDOM.normal(size=(count, 3))
    return rows / np.linalg.norm(rows, axis=1, keepdims=True)


def roles(*blocks: NDArray, suffix: str = ".txt") -> str:
    table = np.hstack([block.reshape(len(block), -1) for block in blocks])
    return " ".join(columns.decide(table, suffix).value)


COLORS = RANDOM.integers(0, 256, (50, 3)).astype(float)


@pytest.mark.parametrize(
    ("names", "expected", "unit"),
    [
        ('"Points:0" "Points:1" "Points:2" RGB:0 RGB:1 RGB:2', "x y z red green blue", None),
        ("Points_0 Points_1 Points_2 Normals_0 Normals_1 Normals_2", "x y z nx ny nz", None),
        ("Points[0] Points[1] Points[2]", "x y z", None),
        ("//X Y Z Rf Gf Bf", "x Y Z red green blue", None),
        ("x[mm] y[mm] z[mm] Intensity", "x y z Intensity", "mm"),
        ("X(m) Y(m) Z(m)", "x y z", "m"),
        ("x_cm y_cm z_cm", "x y z", "cm"),
        ("X/m Y/m Z/m", "x y z", "m"),
        ("Easting Northing Elevation", "x y z", None),
        ("position.x position.y position.z", "x y z", None),
        ("x y z Points:0 Points:1 Points:2", "x y z Points:0 Points:1 Points:2", None),
        ("x y z r_m scale_0 rot_1", "x y z r_m scale_0 rot_1", None),
    ],
)
def test_names_of_other_programs(names: str, expected: str, unit: str | None) -> None:
    found = [name.strip('"') for name in names.split()]
    canonical = columns.canonical_names(found)
    assert [name.lstrip("/").lower() for name in canonical] == expected.lower().split()
    assert columns.unit_in_names(found) == unit


def test_rows_of_length_1_are_normals() -> None:
    floor = np.tile([0.0, 0, 1], (50, 1))
    assert roles(POINTS, floor) == "x y z nx ny nz"
    assert roles(POINTS, unit_rows()) == "x y z nx ny nz"
    assert roles(POINTS, unit_rows(), COLORS) == "x y z nx ny nz r g b"
    assert roles(POINTS, COLORS, floor) == "x y z r g b nx ny nz"
    some = unit_rows()
    some[:10] = 0  # as programs write where they have none
    assert roles(POINTS, some) == "x y z nx ny nz"


def test_a_suffix_states_the_columns() -> None:
    floor = np.tile([0.0, 0, 1], (50, 1))
    assert roles(POINTS, floor, suffix=".xyzrgb") == "x y z r g b"
    assert roles(POINTS, COLORS, suffix=".xyzn") == "x y z nx ny nz"
    assert columns.decide(np.hstack([POINTS, floor]), ".xyzrgb").source == "file"


def test_a_count_in_front() -> None:
    count = np.arange(50.0)
    for start in (0, 1):
        assert roles(count + start, POINTS) == "number x y z"
        assert roles(count + start, POINTS, COLORS) == "number x y z r g b"
    assert roles(count * 3 + 100, POINTS) == "number x y z"  # ids of points that were cut out
    assert roles(count / 50, POINTS) == "x y z intensity"
    assert roles(1716383012.5 + count / 50, POINTS) == "time x y z"
    assert roles(count + 2, POINTS[:, 0], np.zeros(50), POINTS[:, 1]) == "x y z intensity"  # a profile
    assert roles(count[:, None], POINTS, COLORS[:, :2] * 3) == "number x y z intensity column_6"
    assert roles(count, POINTS, unit_rows(), suffix=".xyzn") == "number x y z nx ny nz"
    assert roles(count, count, count, POINTS[:, 0]) == "x y z intensity"  # a line of points
    assert roles(count, POINTS[:, 1:], COLORS) == "x y z r g b"


def test_row_and_column_in_front() -> None:
    row, column = (grid.ravel().astype(float) for grid in np.mgrid[0:6, 0:8])
    scan = np.stack([column * 2 + 10, row * 2 - 5, 700 + row * column], axis=1)
    assert roles(row, column, scan) == "row column x y z"
    assert roles(column, row, scan) == "row column x y z"
    floor = np.stack([row, column, 0 * row], axis=1)
    assert roles(floor, np.tile([0.0, 0, 1], (48, 1))) == "x y z nx ny nz"
    assert roles(row, column, RANDOM.normal(size=(48, 3))) == "x y z intensity column_5"


def test_a_column_of_zeros_does_not_shift_the_colors() -> None:
    assert roles(POINTS, np.zeros(50), COLORS) == "x y z intensity r g b"
    blue = np.tile([0.0, 0, 255], (50, 1))
    assert roles(POINTS, blue) == "x y z r g b"


def test_colors_of_other_ranges() -> None:
    assert roles(POINTS, COLORS * 257) == "x y z r g b"
    assert roles(POINTS, COLORS + 0.25 * (COLORS < 255)) == "x y z r g b"
    assert roles(POINTS, COLORS / 255) == "x y z r g b"


def test_assumptions_have_alternatives_that_can_be_stated() -> None:
    decision = columns.decide(np.hstack([POINTS, unit_rows()]))
    assert decision.is_marked
    assert decision.alternatives[0] == "x y z r g b"
    for text in decision.alternatives:
        stated = columns.decide(np.hstack([POINTS, unit_rows()]), "", Corrections.parse({"columns": text}))
        assert (list(stated.value), stated.source) == (text.split(), "user")


def test_three_columns_are_no_assumption() -> None:
    assert columns.decide(POINTS).source == "file"


# --- several moments ----------------------------------------------------------------------------


def test_frames_with_ids_in_any_order() -> None:
    frame, id = np.array([0, 0, 1, 1, 3, 3.0]), np.array([1, 0, 0, 1, 1, 0.0])
    moments = columns.moments_of(frame, None, id)
    assert moments is not None
    assert moments.order.tolist() == [1, 0, 2, 3, 5, 4]
    assert moments.starts.tolist() == [0, 2, 4, 6]
    assert moments.numbers.tolist() == [0, 1, 3]
    assert moments.ids is not None
    assert moments.ids.tolist() == [0, 1, 0, 1, 0, 1]
    assert moments.times is None


def test_times_of_frames_in_their_unit() -> None:
    frame, time = np.repeat([1.0, 2, 3], 2), np.repeat([0.0, 40, 90], 2)
    for seconds in (1e-3, None):  # stated, or found as steps of a film
        moments = columns.moments_of(frame, time, None, seconds)
        assert moments is not None
        np.testing.assert_allclose(moments.times, [0, 0.04, 0.09])


@pytest.mark.parametrize(
    ("frame", "time"),
    [
        ([0, 1, 2, 3, 4, 5], None),  # the path of one point
        ([7, 7, 7, 7, 7, 7], None),
        ([0, 0, 1.5, 1.5, 2, 2], None),
        (None, [0.1, 0.1, 0.2, 0.2, 0.2, 0.3]),  # pulses of a laser scanner
        (None, [0.1, 0.2, 0.3, 0.4, 0.5, 0.6]),
        ([0, 0, 1, 1, np.nan, 2], None),
    ],
)
def test_tables_of_one_moment(frame: list[float] | None, time: list[float] | None) -> None:
    as_column = (None if values is None else np.array(values, float) for values in (frame, time))
    assert columns.moments_of(*as_column, None) is None


def test_names_of_columns_of_moments() -> None:
    found = columns.moment_columns(["Frame", "time [ms]", "ID", "x", "y", "z"])
    assert found == (0, 1, 2, 1e-3)
    assert not columns.moment_columns(["x", "y", "z", "GPS Time"]).can_split


@pytest.mark.parametrize(
    "names",
    [
        "coordsX coordsY coordsZ", "PosX PosY PosZ", "X-Koordinate Y-Koordinate Z-Koordinate",
        "Koordinate_X Koordinate_Y Koordinate_Z", "x-wert y-wert z-wert", "Rechtswert Hochwert Höhe",
        "Rechts Hoch Hoehe", "Ost Nord Höhe", "E N H", "east north up", "Abscisse Ordonnée Altitude",
        "coordonnée_X coordonnée_Y coordonnée_Z", "_x _y _z", "x0 y0 z0", "X Y Höhe", "Pos.X Pos.Y Pos.Z",
        "Points:0 Points:1 Points:2", "Points_0 Points_1 Points_2", "p_x p_y p_z",
    ],
)  # fmt: skip
def test_positions_as_people_call_them(names: str) -> None:
    assert columns.canonical_names(names.split()) == ["x", "y", "z"]


@pytest.mark.parametrize(
    ("names", "roles"),
    [
        ("x y z Rot Grün Blau", "x y z red green blue"), ("x y z Rouge Vert Bleu", "x y z red green blue"),
        ("x y z colorR colorG colorB", "x y z red green blue"),
        ("x y z NormalX NormalY NormalZ", "x y z nx ny nz"), ("x y z u v", "x y z u v"),
        ("x y u v", "x y u v"),
        ("lat lon alt", "lat lon alt"),
    ],
)  # fmt: skip
def test_other_columns_as_people_call_them(names: str, roles: str) -> None:
    assert columns.canonical_names(names.split()) == roles.split()

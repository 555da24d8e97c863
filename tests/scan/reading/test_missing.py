"""Values that mean "not measured", and points at the origin that were."""

from __future__ import annotations

import numpy as np
import pytest

from viewer.scan.reading import missing
from viewer.scan.reading.cloud import cloud_of
from viewer.scan.reading.corrections import Corrections
from viewer.scan.reading.sequence import Decided

RNG = np.random.default_rng(4)
FACE = RNG.random((800, 3)) * (150, 200, 190) + (-75, -100, 805)


def with_zeros(points: np.ndarray, count: int) -> np.ndarray:
    return np.vstack([points, np.zeros((count, 3))])


@pytest.mark.parametrize("dtype", ["f4", "f8", "i4"])
def test_zeros_far_from_all_points_were_not_measured(dtype: str) -> None:
    found = missing.unmeasured_points(with_zeros(FACE, 500).astype(dtype))
    assert found is not None
    assert found.value == "0 0 0"
    assert found.rows.sum() == 500
    assert found.rows[800:].all()


@pytest.mark.parametrize(
    "points",
    [
        with_zeros(FACE, 7),  # too few
        with_zeros(np.tile(FACE, (10, 1)), 100),  # 1.2 %
        with_zeros(FACE - (0, 0, 900), 500),  # round the origin
        np.zeros((50, 3)),  # nothing else
        FACE,
        with_zeros(FACE, 500) * (1, 1, np.nan),
    ],
)
def test_zeros_that_may_be_points_stay(points: np.ndarray) -> None:
    assert missing.unmeasured_points(points) is None


def test_a_surface_through_the_origin_stays() -> None:
    x, y = np.meshgrid(np.arange(40.0), np.arange(40.0))
    plane = np.column_stack([x.ravel(), y.ravel(), np.zeros(1600)])
    assert missing.unmeasured_points(with_zeros(plane, 100)) is None


def test_not_finite_points_do_not_hide_zeros() -> None:
    points = with_zeros(np.vstack([FACE, np.full((20, 3), np.nan)]), 500)
    found = missing.unmeasured_points(points)
    assert found is not None
    assert found.rows.sum() == 500


@pytest.mark.parametrize("value", [9999, -9999, 32767, 65535, 65504, 1e10, -32768])
def test_a_value_far_from_all_others_was_not_measured(value: float) -> None:
    heights = np.append(RNG.random(500) * 30 + 200, np.full(40, value))
    assert missing.unmeasured_value(heights) == value
    assert missing.unmeasured_value(np.append(heights, np.nan)) == value
    points = np.column_stack([np.arange(540.0), np.arange(540.0), heights]).astype(np.float32)
    found = missing.unmeasured_points(points)
    assert found is not None
    assert found.rows.sum() == 40
    assert found.value == f"{value:g}"


def test_rows_of_such_a_value_count_however_few() -> None:
    points = np.vstack([RNG.random((500, 3)), np.full((2, 3), -9999.0)])
    found = missing.unmeasured_points(points)
    assert found is not None
    assert (found.value, found.rows.sum()) == ("-9999", 2)
    points[-1] = (1, 2, -9999)  # one odd height may be measured
    points[-2] = (1, 2, 3)
    assert missing.unmeasured_points(points) is None


@pytest.mark.parametrize(
    "values",
    [
        np.append(RNG.random(500) * 30 + 200, np.full(40, 5000.0)),  # not a value that programs use
        np.append(RNG.random(500) * 30 + 200, np.full(3, 9999.0)),  # too few
        np.append(RNG.random(500) * 9000 + 900, np.full(40, 9999.0)),  # near the others
        np.full(50, 65504.0),
        np.array([np.inf] * 50 + [1.0] * 50),
        np.empty(0),
    ],
)
def test_a_value_that_may_be_measured_stays(values: np.ndarray) -> None:
    assert missing.unmeasured_value(values) is None


@pytest.mark.parametrize("dtype", ["f4", "f8", "i4"])
def test_points_at_minus_one_far_from_all_others_were_not_measured(dtype: str) -> None:
    found = missing.unmeasured_points(np.vstack([FACE, np.full((40, 3), -1)]).astype(dtype))
    assert found is not None
    assert (found.value, found.rows.sum()) == ("-1 -1 -1", 40)
    assert missing.unmeasured_points(np.vstack([FACE, np.full((7, 3), -1)])) is None  # too few


def test_a_floor_at_minus_one_stays() -> None:
    x, y = np.meshgrid(np.arange(-20.0, 20.0), np.arange(-20.0, 20.0))
    floor = np.column_stack([x.ravel(), y.ravel(), np.full(1600, -1.0)])
    assert missing.unmeasured_points(np.vstack([floor, np.full((100, 3), -1.0)])) is None
    assert missing.unmeasured_points(np.vstack([floor, FACE])) is None


@pytest.mark.parametrize(
    ("value", "named"),
    [
        (np.nan, "not finite"),
        (np.inf, "not finite"),
        (-np.inf, "not finite"),
        (1e30, "1e+30"),
        (-np.finfo(np.float32).max, "-3.40282e+38"),
    ],
)
def test_the_record_names_what_is_no_position(value: float, named: str) -> None:
    points = np.vstack([FACE, np.full((40, 3), value)]).astype(np.float32)
    decided = Decided()
    assert len(cloud_of([points], {}, {}, decided=decided)) == 800
    decision = decided.reading["missing"]
    assert decision.value == named
    assert "40 points" in decision.why


def test_the_record_counts_zeros_and_points_that_are_not_finite() -> None:
    decided = Decided()
    cloud_of([with_zeros(np.vstack([FACE, np.full((20, 3), np.nan)]), 500)], {}, {}, decided=decided)
    decision = decided.reading["missing"]
    assert (decision.value, decision.source) == ("0 0 0", "assumed")
    assert "500 points" in decision.why
    assert "20 points" in decision.why


@pytest.mark.parametrize("place", [0, -1])
def test_a_later_frame_may_have_fewer_points_at_the_place(place: int) -> None:
    decided = Decided()
    for count in (100, 3):
        points = np.vstack([FACE, np.full((count, 3), place)])
        assert len(cloud_of([points], {}, {}, decided=decided.at(count))) == 800


@pytest.mark.parametrize(
    ("text", "removed"), [("none", 0), ("0,0,0", 500), ("0", 500), ("805", 0), ("5 6 7", 0)]
)
def test_the_user_states_the_value(text: str, removed: int) -> None:
    corrections = Corrections.parse({"missing": text})
    found = missing.find(with_zeros(FACE, 500), corrections)
    assert (0 if found is None else found.rows.sum()) == removed
    assert missing.decide(found, corrections).source == "user"


def test_the_record_says_what_was_removed() -> None:
    decision = missing.decide(missing.find(with_zeros(FACE, 500)))
    assert (decision.value, decision.source, decision.alternatives) == ("0 0 0", "assumed", ("none",))
    assert "500 points" in decision.why
    assert missing.decide(missing.find(FACE)).value is None

"""Which numbers of a depth picture were measured."""

from __future__ import annotations

import numpy as np
import pytest

from viewer.scan.reading.corrections import Corrections
from viewer.scan.reading.depths import measured_depths
from viewer.scan.reading.sequence import Decided


@pytest.mark.parametrize("far", [65504, 1e10, 1e30, np.inf, np.nan, -9999, -999, -1])
def test_far_values_were_not_measured(far: float) -> None:
    depth = np.linspace(1, 2, 48, dtype=np.float32).reshape(6, 8)
    depth[2] = far
    decided = Decided()
    assert measured_depths(depth, decided).all(axis=1).tolist() == [True, True, False, True, True, True]
    decision = decided.reading["missing"]
    expected = (f"{far:g}", "assumed") if np.isfinite(far) else ("not finite", "file")
    assert (decision.value, decision.source) == expected
    assert "8 pixels" in decision.why
    assert measured_depths(depth, Decided(Corrections.parse({"missing": "none"}))).sum() == 40 + 8 * bool(
        np.isfinite(far)
    )


def test_minus_one_is_a_depth_beside_others_that_are_not_ahead() -> None:
    heights = np.linspace(-2, 2, 48).reshape(6, 8)
    heights[2] = -1
    assert measured_depths(heights, Decided()).all()


def test_plain_depth_is_all_measured() -> None:
    decided = Decided()
    assert measured_depths(np.linspace(0, 65504, 48, dtype=np.float32).reshape(6, 8), decided).all()
    assert decided.reading["missing"].value is None


def test_whole_numbers_that_always_mean_nothing() -> None:
    depth = np.array([[0, 5, 65535, 7]], np.uint16)
    decided = Decided()
    assert measured_depths(depth, decided, (0, 65535)).tolist() == [[False, True, False, True]]
    assert decided.reading["missing"].value == "0, 65535"
    assert measured_depths(depth, Decided(Corrections.parse({"missing": "5"}))).tolist() == [
        [True, False, True, True]
    ]

"""Statistics over time: whole and of a region, kept in a file, and as curves with gaps."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from viewer.analysis.deviation.over_time import (
    FrameDeviation,
    FramePlace,
    KeptDeviations,
    deviation_curves,
)
from viewer.analysis.track import Known
from viewer.rigid import STILL, Rigid, rigid_matrix
from viewer.scan.points import PointCloud

CLOUD = PointCloud.from_arrays(np.array([[x, 0.0, 0.0] for x in range(5)]))
VALUES = np.array([1.0, -1, 2, np.nan, 4], np.float32)
REGION = np.array([[11.0, 0, 0, 1.2]])
ASIDE = FramePlace(STILL, Rigid(rigid_matrix(np.eye(3), np.array([10.0, 0, 0]))))


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))


def test_a_region_counts_where_it_was_painted() -> None:
    found = FrameDeviation.of(VALUES, CLOUD, REGION, ASIDE)
    assert (found.whole.mean, found.whole.max, found.whole.share) == (1.5, 4, 0.8)
    assert found.region is not None
    assert (found.region.mean, found.region.max) == (pytest.approx(2 / 3), 2), "of points 0 to 2"
    assert FrameDeviation.of(VALUES, CLOUD, REGION[:0], ASIDE).region is None


def test_statistics_are_kept_for_the_same_question_only(tmp_path: Path) -> None:
    found = {
        (0, ASIDE.key): FrameDeviation.of(VALUES, CLOUD, REGION, ASIDE),
        (0, "other"): FrameDeviation.of(VALUES[3:4], CLOUD, REGION[:0], ASIDE),
    }
    KeptDeviations({"scan": "a"}).save(found)
    again = KeptDeviations({"scan": "a"}).read()
    assert again[0, ASIDE.key] == found[0, ASIDE.key]
    assert np.isnan(again[0, "other"].whole.rms)
    assert KeptDeviations({"scan": "b"}).read() == {}
    (file,) = tmp_path.rglob("*.json")
    for damaged in ("{", "[]", file.read_text().replace("frames", "times")):
        file.write_text(damaged)
        assert KeptDeviations({"scan": "a"}).read() == {}


def test_curves_have_gaps_where_no_point_has_a_deviation() -> None:
    known = {
        0: FrameDeviation.of(VALUES, CLOUD, REGION, ASIDE),
        2: FrameDeviation.of(np.full(5, np.nan), CLOUD, REGION, ASIDE),
    }
    curves = deviation_curves(known, np.arange(4) / 25)
    assert list(curves)[:2] == ["Deviation, mean", "Deviation, RMS"]
    assert len(curves) == 8
    one = curves["Deviation of region, maximum"]
    np.testing.assert_array_equal(one.values, [2, np.nan, np.nan, np.nan])
    assert one.known.tolist() == [Known.TRACKED, Known.PENDING, Known.GAP, Known.PENDING]
    assert "no point" in one.note(2)
    whole = {0: FrameDeviation.of(VALUES, CLOUD, REGION[:0], ASIDE)}
    assert len(deviation_curves(whole, np.arange(1.0))) == 4

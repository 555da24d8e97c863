"""Whether the ground of a terrain is in degrees: as the user, the file or the numbers say."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from viewer import open_scan
from viewer.scan.reading.corrections import Corrections
from viewer.scan.reading.ground import DEGREES, LENGTHS, are_degrees, decide_ground

ALPS = ((-84.4, 36.7), (0.33, -0.29), 840.0)


@pytest.mark.parametrize(
    ("corner", "size", "span", "found"),
    [
        (*ALPS, True),
        ((0.0, 0.0), (30.0, -30.0), 5.0, False),  # a room
        ((376_000.0, 3_808_000.0), (36_000.0, -19_000.0), 2000.0, False),
        ((0.0, 89.9), (0.3, 0.3), 840.0, False),  # beyond the pole
    ],
)
def test_degrees_differ_from_lengths(
    corner: tuple[float, float], size: tuple[float, float], span: float, found: bool
) -> None:
    assert are_degrees(corner, size, span) == found
    decision = decide_ground(None, corner, size, span)
    assert decision.value == (DEGREES if found else LENGTHS)
    assert decision.is_marked


def test_the_file_counts_more_than_the_numbers_and_the_user_more_than_the_file() -> None:
    by_file = decide_ground(LENGTHS, *ALPS)
    assert (by_file.value, by_file.source, by_file.is_marked) == (LENGTHS, "file", False)
    by_user = decide_ground(LENGTHS, *ALPS, Corrections.parse({"ground": "degrees"}))
    assert (by_user.value, by_user.source) == (DEGREES, "user")


def test_the_user_corrects_the_ground_of_a_terrain(tmp_path: Path) -> None:
    path = tmp_path / "pyramid.npz"
    heights = np.add.outer(np.arange(5), np.arange(6)) * 20.0
    np.savez(path, elevation=heights, xmin=10.0, xmax=16.0, ymin=45.0, ymax=40.0)
    with open_scan(path) as scan:
        assumed = np.ptp(scan.pose(0).cloud.world(), axis=0)
        assert scan.reading["ground"].is_marked
    with open_scan(path, read={"ground": "lengths"}) as scan:
        assert np.ptp(scan.pose(0).cloud.world(), axis=0) == pytest.approx([5, 4, 180])
        assert scan.reading["ground"].source == "user"
    assert assumed[0] > 400_000

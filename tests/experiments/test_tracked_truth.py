"""Tracked landmarks against exactly known motion, on scans whose frames have no points in common."""

from __future__ import annotations

from pathlib import Path

import pytest
from experiments.landmarks.known import resampled_demo, resampled_mesh, scanned_demo
from experiments.landmarks.landmark_judge import judge_tracking

from viewer.analysis.tracking import track_landmarks
from viewer.scan.open import find_source


@pytest.mark.slow
def test_a_few_frames_of_a_face_are_tracked() -> None:
    """The mouth and the nose alone, while the smile is fastest."""
    told = judge_tracking(resampled_demo("demo:smile:1", 0.1, range(22, 27), behind=60.0), track_landmarks)
    assert told.median <= 0.15  # mm, where points are 1.1 mm apart
    assert told.p95 <= 0.5
    assert told.gaps_false < 0.1


@pytest.mark.slow
@pytest.mark.parametrize("variant", ["smile", "sway", "cough"])
def test_faces_that_pods_see_are_tracked_as_well_as_asked(variant: str) -> None:
    (known,) = scanned_demo(f"demo:{variant}:1", [0.1])
    told = judge_tracking(known, track_landmarks)
    assert told.frames == 64
    assert told.median <= 0.15  # mm
    assert told.p95 <= 0.5
    assert told.within >= 0.8
    assert told.gaps_false < 0.05
    assert not told.hidden or told.gaps_hit >= 0.95


@pytest.mark.slow
def test_what_no_pod_sees_is_a_gap() -> None:
    """One pod, from the front: the sides of the head come and go as it turns."""
    (known,) = scanned_demo("demo:sway:1", [0.1], pods=1)
    told = judge_tracking(known, track_landmarks)
    assert told.hidden > 50
    assert told.gaps_hit >= 0.95


@pytest.mark.slow
@pytest.mark.parametrize("folder", ["horse_gallop_48", "crane_175"])
def test_bodies_are_tracked_to_a_spacing_at_most_places(data_dir: Path, folder: str) -> None:
    known = resampled_mesh(find_source(data_dir / "sequences" / folder), folder)
    told = judge_tracking(known, track_landmarks)
    assert told.median <= 0.5 * told.spacing

"""Tracked landmarks against exactly known motion, on scans that do not tell which points are the same."""

from __future__ import annotations

from pathlib import Path

import pytest

from viewer.analysis.tracking import track_landmarks
from viewer.bench.tracking.known import resampled_demo, resampled_mesh
from viewer.bench.tracking.landmark_judge import Judgement, judge_tracking
from viewer.scan.open import find_source

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module", params=["demo:smile:1", "demo:sway:1", "demo:cough:1"])
def face(request: pytest.FixtureRequest) -> Judgement:
    """A face whose points are others in each frame, with noise of 0.1 mm."""
    return judge_tracking(resampled_demo(request.param, 0.1, behind=-25.0), track_landmarks)


def test_landmarks_of_a_face_are_followed(face: Judgement) -> None:
    assert face.frames == 64
    assert face.median <= 0.15
    assert face.p95 <= 0.5


def test_errors_are_within_what_is_told(face: Judgement) -> None:
    assert 0.8 <= face.within <= 0.98


@pytest.mark.parametrize("name", ["crane_175", "horse_gallop_48"])
def test_errors_of_bodies_are_a_spacing(data_dir: Path, name: str) -> None:
    """95 % <= 1 point spacing away from fast self-contact."""
    found = judge_tracking(resampled_mesh(find_source(data_dir / "sequences" / name), name), track_landmarks)
    assert found.p95 <= found.spacing
    assert 0.8 <= found.within <= 0.98

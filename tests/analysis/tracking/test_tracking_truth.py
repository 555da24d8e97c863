"""Tracked landmarks against exactly known motion, on scans that do not tell which points are the same."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import pytest
from experiments.landmarks.known import resampled_demo, resampled_mesh, shuffled_mesh
from experiments.landmarks.landmark_judge import Judgement, judge_tracking

from viewer.analysis.tracking import track_landmarks
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


@cache
def judged(folder: Path) -> Judgement:
    """A body whose points are others in each frame, without fast self-contact."""
    return judge_tracking(resampled_mesh(find_source(folder), folder.name), track_landmarks)


def falls_short(reason: str) -> pytest.MarkDecorator:
    return pytest.mark.xfail(strict=True, reason=reason)


@pytest.mark.parametrize(
    "name",
    [
        pytest.param("crane_175", marks=falls_short("1.005: skin slides along limbs")),
        pytest.param("horse_gallop_48", marks=falls_short("1.89: skin slides along legs and trunk")),
    ],
)
def test_95_percent_of_errors_of_bodies_are_a_spacing(data_dir: Path, name: str) -> None:
    found = judged(data_dir / "sequences" / name)
    assert found.p95 <= found.spacing


@pytest.mark.parametrize("name", ["crane_175", "horse_gallop_48"])
def test_errors_of_bodies_are_within_what_is_told(data_dir: Path, name: str) -> None:
    assert 0.8 <= judged(data_dir / "sequences" / name).within <= 0.98


@cache
def followed(folder: Path, seed: int) -> Judgement:
    """A body whose points come back in another order, with landmarks of a file that gives no deviations."""
    known = shuffled_mesh(find_source(folder), folder.name, seed=seed)
    return judge_tracking(known, track_landmarks, from_file=True)


SHUFFLED = [("crane_175", 0), ("horse_gallop_48", 0), ("horse_gallop_48", 1)]


@pytest.mark.parametrize(("name", "seed"), SHUFFLED)
def test_landmarks_of_files_are_followed_where_points_come_back(data_dir: Path, name: str, seed: int) -> None:
    found = followed(data_dir / "sequences" / name, seed)
    assert found.gaps_false <= 0.15
    assert found.p95 <= found.spacing
    assert found.wrong <= 0.005
    assert found.within >= 0.93


@falls_short("99.7 to 100 %: the deviation of the key, a spacing, is larger than errors of a tenth of one")
@pytest.mark.parametrize(("name", "seed"), SHUFFLED)
def test_deviations_of_landmarks_of_files_are_no_larger_than_errors(
    data_dir: Path, name: str, seed: int
) -> None:
    assert followed(data_dir / "sequences" / name, seed).within <= 0.98

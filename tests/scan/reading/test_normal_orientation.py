"""The side on which estimated normals point: recorded, corrected, used wherever normals are estimated."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from viewer.analysis.measures.surface import PoseSurface
from viewer.drawing.steps import _bare
from viewer.scan import formats
from viewer.scan.estimate import cloud_normals, estimate, with_estimates
from viewer.scan.open import open_scan
from viewer.scan.points import ORIENTATIONS, PointCloud
from viewer.scan.reading.orientation import complete
from viewer.scan.reading.sequence import Decided
from viewer.scan.sides import FoundSides


def lens(count: int = 1500, flatness: float = 0.5) -> NDArray[np.float64]:
    """Points at random on a flat ellipsoid."""
    points = np.random.default_rng(1).normal(size=(count, 3))
    return points / np.linalg.norm(points, axis=1, keepdims=True) * [1, 1, flatness]


@pytest.fixture
def bare(tmp_path: Path) -> Path:
    """A scan of two frames without normals. The second one is so flat that its sides are doubtful."""
    for number, points in enumerate((lens(), lens(3000, 0.02))):
        formats.write(tmp_path / f"{number}.ply", PointCloud.from_arrays(points))
    return tmp_path


def test_it_is_assumed_until_normals_are_estimated_and_then_says_how(bare: Path) -> None:
    with open_scan(bare) as timeline:
        pose = timeline.pose(0)
        before = timeline.reading["orientation"]
        assert (before.value, before.source, before.is_marked) == ("auto", "assumed", False)
        assert before.alternatives == ORIENTATIONS[1:]
        with_estimates(pose, ["normals"])
        sure = timeline.reading["orientation"]
        assert (sure.value, sure.source, sure.is_marked) == ("quick", "assumed", False)
        assert "0.0% of the points are doubtful" in sure.why
        with_estimates(timeline.pose(1), ["normals"])
        unsure = timeline.reading["orientation"]
        assert (unsure.value, unsure.is_marked) == ("fine", True)
        with_estimates(pose, ["normals"])
        assert timeline.reading["orientation"] == unsure, "the frame with the most doubt counts"


@pytest.mark.parametrize("orientation", ORIENTATIONS)
def test_a_correction_holds_wherever_normals_are_estimated(bare: Path, orientation: str) -> None:
    with open_scan(bare, read={"orientation": orientation}) as timeline:
        pose = timeline.pose(0)
        expected = cloud_normals(PointCloud.from_arrays(lens()), orientation=orientation)  # type: ignore[arg-type]
        outwards = np.einsum("ij,ij->i", expected, lens()) > 0
        assert outwards.all() != orientation.endswith("flipped")
        for found in (
            cloud_normals(pose.cloud),
            estimate(pickle.loads(pickle.dumps(_bare(pose))), ["normals"]).arrays["normals"],
            with_estimates(pose, ["normals"]).cloud.normals,
        ):
            np.testing.assert_array_equal(found, expected)
        decision = timeline.reading["orientation"]
        assert (decision.value, decision.source) == (orientation, "user")
        assert "doubtful" in decision.why
        assert not any(message.kind == "correction" for message in timeline.messages)


def test_measures_take_the_side_that_the_user_states(bare: Path) -> None:
    sums = []
    for orientation in ("auto", "auto-flipped"):
        with open_scan(bare, read={"orientation": orientation}) as timeline:
            patch = PoseSurface(timeline.pose(0)).patch(
                lambda points: np.linalg.norm(points - [0, 0, 0.5], axis=1) - 0.3
            )
            sums.append(float(patch.vertex_normals.sum(axis=0)[2]))
    assert sums[0] > 0 > sums[1]


def test_normals_face_a_scanner_that_the_file_states_unless_the_user_says_else(tmp_path: Path) -> None:
    path = tmp_path / "seen.pcd"
    formats.write(path, PointCloud.from_arrays(lens(), viewpoint=(0, 0, 9)))
    with open_scan(path) as timeline:
        pose = with_estimates(timeline.pose(0), ["normals"])
        decision = timeline.reading["orientation"]
        assert (decision.value, decision.source, decision.shown) == (
            "viewpoint",
            "file",
            "Towards the scanner",
        )
        towards = pose.cloud.normals
    for orientation, expected in (("auto", towards), ("auto-flipped", -towards)):  # type: ignore[operator]
        with open_scan(path, read={"orientation": orientation}) as timeline:
            np.testing.assert_array_equal(cloud_normals(timeline.pose(0).cloud), expected)
    with open_scan(path, read={"orientation": "quick"}) as timeline:
        assert np.einsum("ij,ij->i", cloud_normals(timeline.pose(0).cloud), lens()).min() > 0


def test_stored_normals_need_none(tmp_path: Path) -> None:
    path = tmp_path / "oriented.ply"
    cloud = PointCloud.from_arrays(lens(), normals=lens())
    formats.write(path, cloud)
    with open_scan(path, read={"orientation": "fine"}) as timeline:
        timeline.pose(0)
        assert timeline.reading["orientation"].value is None
        assert any("orientation=fine does not apply" in message.text for message in timeline.messages)
    with open_scan(path, read={"normals": "none"}) as timeline:
        timeline.pose(0)
        assert timeline.reading["orientation"].value == "auto"


def test_a_record_without_the_question_stays_without_it() -> None:
    decided = Decided()
    complete(decided, FoundSides("fine", 0.5))
    assert decided.reading["orientation"].value is None

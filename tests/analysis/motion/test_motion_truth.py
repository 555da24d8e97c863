"""Motions of the demo's head and of animated meshes, sampled anew in each frame, against the exact ones."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from experiments.landmarks.known import KeptFrames
from experiments.landmarks.resampled import ResampledMesh
from experiments.motion.heads import REGIONS, Heads, region_motions, stabilised_errors, strays, without_side
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from viewer.analysis.motion.found import found_region
from viewer.analysis.motion.rest import mean_of_rest
from viewer.analysis.motion.stabilise import FrameMotion, MotionReference, MotionState, WeakLimits, stabilise
from viewer.errors import InputError
from viewer.scan.open import find_source
from viewer.scan.timeline import Timeline

pytestmark = pytest.mark.slow

LIMITS = WeakLimits(0.5)


@pytest.fixture(scope="module")
def talking() -> Heads:
    """Twenty frames of a head that turns and talks."""
    return Heads.of("demo:sway:1", 20)


@pytest.mark.parametrize(
    ("fault", "most"),
    [(None, 0.05), ("outliers", 0.05), ("hidden", 0.1)],
    ids=["plain", "outliers", "hidden"],
)
def test_the_motion_of_a_talking_head_is_found(talking: Heads, fault: str | None, most: float) -> None:
    timeline = talking.timeline()
    rows = found_region(timeline, timeline.pose(0), 0)
    if fault is not None:
        timeline = talking.timeline(strays if fault == "outliers" else without_side(talking, rows, 0.3))
    reference = MotionReference.of(timeline.pose(0), rows, 0)
    errors = stabilised_errors(talking, timeline, reference, LIMITS.shift)
    assert len(errors) == len(timeline) - 1, "there are no gaps"
    turns, shifts = np.linalg.norm(np.reshape(errors, (-1, 2, 3)), axis=2).T
    assert np.median(turns) <= most
    assert np.median(shifts) <= most


def test_the_mean_of_rest_frames_has_less_noise_and_gives_the_same_motions() -> None:
    heads, count = Heads.of("demo:smile:1", 20), 6
    timeline = heads.timeline()
    pose = timeline.pose(0)
    rows = found_region(timeline, pose, 0)
    first = MotionReference.of(pose, rows, 0)
    mean = mean_of_rest(timeline, pose, first, range(count))
    exact = heads.source.paths(0, [0])[0]
    off = pose.cloud.world() - exact
    length = np.linalg.norm(off, axis=1)
    noisy = length > 1e-9
    normals = off[noisy] / length[noisy, None]
    left = np.abs(((mean.pose.cloud.world() - exact)[noisy] * normals).sum(axis=1))
    assert np.median(left) < np.median(length) / np.sqrt(count)
    starts = first, MotionReference.of(mean.pose, rows, None)
    errors = [stabilised_errors(heads, timeline, start, LIMITS.shift) for start in starts]
    before, after = (
        np.median(np.linalg.norm(np.reshape(each, (-1, 2, 3)), axis=2), axis=0) for each in errors
    )
    assert (after < 1.2 * before).all()


def test_errors_of_regions_of_growing_difficulty_are_within_the_spread() -> None:
    """A head that only turns, so that each region is rigid; three references with noise of their own."""
    values, told = {name: [] for name in REGIONS}, {name: [] for name in REGIONS}
    for seed, first in enumerate((2, 24, 45)):
        for name, motion, error in region_motions(Heads.turning(seed), first, (10, 33, 56), seed):
            is_close = (np.abs(error) <= 0.5).all()
            assert is_close or motion.state(np.eye(3), LIMITS) is MotionState.WEAK, name
            values[name] += list(np.abs(error))
            told[name] += list(motion.spread(np.eye(3)))
    shares = {name: np.mean(np.array(values[name]) <= told[name]) for name in REGIONS}
    assert min(shares.values()) >= 0.8, shares
    assert 0.93 <= np.mean(list(shares.values())) <= 0.99, shares


def sampled(folder: Path, frames: range) -> tuple[Timeline, list[NDArray]]:
    """Some frames of meshes, sampled anew without faces, and their vertices (V, 3)."""
    source = find_source(folder)
    anew = ResampledMesh(source, 30_000)
    times = np.arange(len(frames)) / 25
    kept = KeptFrames(folder.name, [anew.load(frame) for frame in frames], times)
    return Timeline(kept, times, "m"), [source.load(frame).world() for frame in frames]


def test_the_trunk_of_a_galloping_horse_is_found(data_dir: Path) -> None:
    timeline, vertices = sampled(data_dir / "sequences" / "horse_gallop_48", range(12))
    pose = timeline.pose(0)
    rows = found_region(timeline, pose, 0)
    reference = MotionReference.of(pose, rows, 0)
    trunk = np.unique(cKDTree(vertices[0]).query(pose.cloud.world()[rows])[1])
    known: dict[int, FrameMotion] = {}
    for frame in stabilise(timeline, reference, LIMITS.shift / 1000, known):
        motion = known[frame].motion
        assert motion is not None
        off = np.linalg.norm(motion.points(vertices[0][trunk]) - vertices[frame][trunk], axis=1)
        assert np.median(off) <= 0.5 * reference.surface.spacing


def test_a_dancing_body_has_no_rigid_part(data_dir: Path) -> None:
    timeline, _ = sampled(data_dir / "sequences" / "crane_175", range(0, 175, 8))
    with pytest.raises(InputError, match="no region that stays rigid"):
        found_region(timeline, timeline.pose(0), 0)

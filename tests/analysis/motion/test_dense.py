"""Every point of a reference frame, followed through frames whose motion is known."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from experiments.landmarks.known import KeptFrames
from moving_hills import SIDE, colors_of, hills, moved
from numpy.typing import NDArray

from viewer.analysis.motion.dense import DensePoints, PointState, TrackedFrame, follow_points
from viewer.analysis.motion.displacements import Displacements
from viewer.analysis.motion.partial_frames import PartialFrames
from viewer.errors import InputError
from viewer.scan.points import PointCloud
from viewer.scan.timeline import Timeline

POINTS, FRAMES = 1600, 3
Float = NDArray[np.float64]


def places(seed: int) -> Float:
    """Places of the patch at rest, (N, 2)."""
    return np.random.default_rng(seed).uniform(-SIDE / 2, SIDE / 2, (POINTS, 2))


def frame_of(where: Float, frame: int) -> PointCloud:
    """The points at places of the patch in a frame."""
    x, y = where.T
    return PointCloud.from_arrays(moved(np.column_stack([x, y, hills(x, y)]), frame), colors=colors_of(x, y))


def scan(where: list[Float]) -> Timeline:
    clouds = [frame_of(each, frame) for frame, each in enumerate(where)]
    source = KeptFrames("hills", clouds, np.arange(float(len(clouds))))
    return Timeline(source, source.times(), "mm")


class Kept(dict[int, TrackedFrame]):
    """Frames in memory."""

    read = dict.__getitem__
    save = dict.__setitem__


def followed(timeline: Timeline, reference: int = 0) -> Kept:
    kept = Kept()
    with timeline:
        points = DensePoints(timeline.pose(reference))
        assert sorted(follow_points(timeline, points, reference, kept)) == list(range(len(timeline)))
    return kept


def off(found: TrackedFrame, where: Float, frame: int, reference: int = 0) -> Float:
    """How far points are from where they are, (N,)."""
    right = frame_of(where, frame).world() - frame_of(where, reference).world()
    return np.linalg.norm(found.displacement - right, axis=1)


@pytest.fixture(scope="module")
def sampled_anew() -> tuple[Kept, list[Float]]:
    """Frames of a patch that turns and stretches, each with points of its own; the second one begins."""
    where = [places(seed) for seed in range(FRAMES)]
    return followed(scan(where), 1), where


def test_points_are_followed_where_frames_share_none(sampled_anew: tuple[Kept, list[Float]]) -> None:
    kept, where = sampled_anew
    for frame in (0, 2):
        error, seen = off(kept[frame], where[1], frame, 1), kept[frame].state == PointState.SEEN
        assert seen.mean() > 0.9
        assert np.median(error[seen]) < 0.1
        assert np.quantile(error[seen], 0.95) < 0.4
        assert (error[seen] < 2 * kept[frame].sigma[seen]).mean() > 0.9


def test_the_reference_frame_is_at_rest(sampled_anew: tuple[Kept, list[Float]]) -> None:
    found = sampled_anew[0][1]
    assert not found.displacement.any()
    assert (found.state == PointState.SEEN).all()


def test_points_that_recur_in_another_order_are_found_exactly() -> None:
    where = places(0)
    orders = [np.arange(POINTS), *(np.random.default_rng(n).permutation(POINTS) for n in range(2))]
    kept = followed(scan([where[order] for order in orders]))
    for frame, order in enumerate(orders):
        known = kept[frame].rows >= 0
        assert known.mean() > 0.9
        assert (order[kept[frame].rows[known]] == np.flatnonzero(known)).mean() > 0.995
        assert np.median(off(kept[frame], where, frame)) < 1e-5


def test_a_hidden_part_is_predicted_and_less_sure() -> None:
    where = places(0)
    there = [where, *(places(n)[places(n)[:, 0] < 10] for n in (1, 2))]
    found = followed(scan(there))[2]
    hidden, inside = where[:, 0] > 13, where[:, 0] < 8
    assert (found.state[hidden] != PointState.SEEN).mean() > 0.95
    assert (found.state[inside] == PointState.SEEN).mean() > 0.95
    assert np.median(found.sigma[hidden]) > 1.5 * np.median(found.sigma[inside])
    far = where[:, 0] > 17
    assert np.median(found.sigma[far]) > np.median(found.sigma[hidden & ~far])
    error = off(found, where, 2)
    assert (error[hidden] < 2 * found.sigma[hidden]).mean() > 0.9


def parted(where: Float, frame: int) -> PointCloud:
    """The points in a frame of a patch whose halves touch at rest, and part."""
    x, y = where.T
    rest = np.column_stack([x, y - 2.0 * frame * (y < 0), hills(x, y)])
    return PointCloud.from_arrays(rest, colors=colors_of(x, y))


def test_halves_that_touch_at_rest_part() -> None:
    where = [places(seed) for seed in range(5)]
    clouds = [parted(each, frame) for frame, each in enumerate(where)]
    source = KeptFrames("parted", clouds, np.arange(5.0))
    found = followed(Timeline(source, source.times(), "mm"))[4]
    y = where[0][:, 1]
    error = np.linalg.norm(found.displacement - np.column_stack([0 * y, -8.0 * (y < 0), 0 * y]), axis=1)
    assert np.median(error) < 0.1
    assert np.quantile(error[np.abs(y) > 4], 0.8) < 0.3


def test_points_that_a_file_names_are_exact_and_missing_ones_lost() -> None:
    where = places(0)
    clouds = [frame_of(where, frame) for frame in range(2)]
    clouds = [replace(cloud, topology="one") for cloud in clouds]
    clouds[1] = clouds[1].of_rows(np.arange(10, POINTS))
    source = KeptFrames("hills", clouds, np.arange(2.0))
    found = followed(Timeline(source, source.times(), "mm"))[1]
    assert found.pose is None
    assert (found.state[:10] == PointState.LOST).all()
    assert np.isnan(found.displacement[:10]).all()
    assert not found.sigma[10:].any()
    assert off(found, where, 1)[10:].max() < 1e-4


def test_frames_without_colors_are_followed_by_their_shape() -> None:
    where = [places(seed) for seed in range(3)]
    clouds = [frame_of(each, frame) for frame, each in enumerate(where)]
    source = KeptFrames("hills", [clouds[0], *(replace(c, colors=None) for c in clouds[1:])], np.arange(3.0))
    kept = followed(Timeline(source, source.times(), "mm"))
    assert np.median(off(kept[2], where[0], 2)) < 0.3


@pytest.mark.parametrize("count", [1, 3, 30])
def test_a_few_points_are_lost_or_followed(count: int) -> None:
    where = places(0)[:count]
    kept = followed(scan([where, where]))
    assert kept[1].displacement.shape == (count, 3)
    assert np.isfinite(kept[1].displacement[kept[1].state != PointState.LOST]).all()


class Torn(KeptFrames):
    """A source that cannot read one frame."""

    def load(self, index: int) -> PointCloud:
        if index == 1:
            raise InputError("is torn")
        return super().load(index)


def test_a_frame_that_cannot_be_read_is_lost_and_the_next_one_is_not() -> None:
    where = [places(seed) for seed in range(3)]
    clouds = [frame_of(each, frame) for frame, each in enumerate(where)]
    source = Torn("hills", clouds, np.arange(3.0))
    kept = followed(Timeline(source, source.times(), "mm"))
    assert (kept[1].state == PointState.LOST).all()
    assert np.isnan(kept[1].displacement).all()
    assert np.median(off(kept[2], where[0], 2)) < 0.1


def test_frames_are_kept_in_a_folder(tmp_path: Path, sampled_anew: tuple[Kept, list[Float]]) -> None:
    kept, _ = sampled_anew
    (tmp_path / "part").mkdir()  # as an interruption can leave it
    folder = PartialFrames(tmp_path / "part", {"scan": "hills"})
    folder.save(2, kept[2])
    same = PartialFrames(tmp_path / "part", {"scan": "hills"})
    assert (2 in same, 3 in same) == (True, False)
    assert np.array_equal(same.read(2).displacement, kept[2].displacement)
    assert same.read(2).pose is not None
    (tmp_path / "part" / "frame_000002.npz").write_bytes(b"no")
    with pytest.raises(InputError, match="does not hold the points of a frame"):
        same.read(2)
    assert 2 not in PartialFrames(tmp_path / "part", {"scan": "other"})


def stretched(a: float, b: float) -> Displacements:
    """A bent patch, and how it is after a stretch by a along x and b along y, and a turn."""
    x, y = places(0).T
    rest = np.column_stack([x, y, 0.02 * x])
    turn = np.array([[0.8, -0.6, 0], [0.6, 0.8, 0], [0, 0, 1.0]])
    along = np.array([1, 0, 0.02]) / np.hypot(1, 0.02)
    there = rest + a * (rest @ along)[:, None] * along + b * y[:, None] * [0, 1, 0]
    ways = (there @ turn.T - rest)[None].astype(np.float32)
    shape = ways.shape[:2]
    return Displacements(rest, ways, np.zeros(shape, np.float32), np.zeros(shape, np.uint8))


@pytest.mark.parametrize(("a", "b"), [(0.1, 0.0), (0.25, -0.1), (-0.05, -0.2)])
def test_the_strain_of_a_known_stretch(a: float, b: float) -> None:
    found = stretched(a, b).strain(0)
    assert np.allclose(found.first, max(a, b), atol=1e-3)
    assert np.allclose(found.second, min(a, b), atol=1e-3)
    assert np.allclose(found.area, (1 + a) * (1 + b) - 1, atol=1e-3)


def test_the_path_of_a_position_and_of_a_region() -> None:
    held = stretched(0.1, 0.0)
    right = held.reference[7] + held.displacement[0, 7]
    assert np.allclose(held.path(held.reference[7])[0], right, atol=0.05)
    rows = np.array([3, 4, 5])
    mean = (held.reference[rows] + held.displacement[0, rows]).mean(axis=0)
    held.sigma[0, rows] = [0.1, 0.3, 0.5]
    path = held.mean_path(rows)
    assert np.allclose(path.positions[0], mean, atol=1e-5)
    assert (path.sigma[0], path.seen[0]) == (pytest.approx(0.3), 1.0)
    held.state[0, rows[1:]] = [PointState.HIDDEN, PointState.LOST]
    path = held.mean_path(rows)
    assert (path.sigma[0], path.seen[0]) == (pytest.approx(0.2), pytest.approx(1 / 3))
    held.state[0, :] = PointState.LOST
    assert np.isnan(held.mean_path(rows).positions).all()
    assert np.isnan(held.mean_path(rows).sigma).all()
    assert np.isnan(held.path(held.reference[7])).all()
    assert np.isnan(held.strain(0).first).all()

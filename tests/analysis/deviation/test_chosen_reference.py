"""References that a user chooses: a frame, the mean of frames, a file; and the way of a frame to them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from rigid_hills import RigidHills, opened, pose_of_head, truth

from viewer.analysis.deviation.chosen import ReferenceChoice, moved_to_reference
from viewer.errors import InputError
from viewer.rigid import Rigid
from viewer.scan import formats
from viewer.scan.points import PointCloud

TRIANGLE = "v -99 -99 1\nv 99 -99 1\nv 0 150 1\nf 1 2 3\n"


def test_deviations_from_a_frame_are_what_has_risen() -> None:
    timeline = opened(RigidHills(3, noise=0.0, rise=0.5))
    deviations = ReferenceChoice(1, 1).read(timeline)
    cloud = timeline.pose(2).cloud
    found = deviations.of(cloud, truth(2, 1).inverse)
    assert found.dtype == np.float32
    x = pose_of_head(2).inverse.points(cloud.world())[:, 0]
    sizes = np.abs(found)
    assert np.nanquantile(sizes[x < 6], 0.95) < 0.05
    assert np.nanmedian(sizes[x > 10]) == pytest.approx(0.5, rel=0.2), "the hills are steep"


def test_the_mean_of_frames_has_less_noise() -> None:
    timeline = opened(RigidHills(6, noise=0.1))
    plain = opened(RigidHills(1, noise=0.0)).pose(0).cloud
    alone, mean = (np.nanstd(ReferenceChoice(0, last).read(timeline).of(plain, Rigid())) for last in (0, 5))
    assert mean < 0.75 * alone
    with pytest.raises(InputError, match="before its first"):
        ReferenceChoice(2, 1).read(timeline)


def test_a_mesh_or_another_scan_can_be_the_reference(tmp_path: Path) -> None:
    timeline = opened(RigidHills(2, noise=0.0))
    mesh = tmp_path / "plane.obj"
    mesh.write_text(TRIANGLE)
    cloud = timeline.pose(0).cloud
    found = ReferenceChoice(file=str(mesh)).read(timeline).of(cloud, Rigid())
    heights = cloud.world()[:, 2] - 1
    reach = 0.1 * 249
    np.testing.assert_allclose(found, np.where(np.abs(heights) < reach, heights, np.nan), atol=1e-4)
    other = tmp_path / "other.npz"
    formats.write(other, PointCloud.from_arrays(cloud.world()))
    own = ReferenceChoice(file=str(other)).read(timeline).of(cloud, Rigid())
    assert np.nanmax(np.abs(own)) < 0.01
    with pytest.raises(InputError):
        ReferenceChoice(file=str(tmp_path / "gone.ply")).read(timeline)


def test_a_frame_goes_to_the_reference_as_both_are_shown() -> None:
    shown, start, own = pose_of_head(3), pose_of_head(1), ReferenceChoice(1, 1)
    moved = moved_to_reference(own, shown, start)
    assert moved is not None
    np.testing.assert_allclose(moved.matrix, np.linalg.inv(start.matrix) @ shown.matrix, atol=1e-12)
    assert moved_to_reference(own, None, start) is None, "a gap"
    assert moved_to_reference(own, shown, None) is None
    assert moved_to_reference(ReferenceChoice(file="a.ply"), shown, None) is shown

"""M3C2: equal to its definition and to py4dgeo, levels of detection that hold, and cylinders that stop."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from viewer.analysis.deviation.m3c2 import M3C2Distances, M3C2Reference
from viewer.analysis.deviation.statistics import detected_share
from viewer.errors import InputError
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose

RADIUS, REACH = 2.5, 6.0


def pose(points: np.ndarray, normals: np.ndarray | None = None) -> Pose:
    attributes = {} if normals is None else {"normals": normals}
    return Pose.of(0, 0.0, "reference", PointCloud.from_arrays(points, **attributes))


def sheet(seed: int, height: float = 0.0, noise: float = 0.1, count: int = 3600) -> np.ndarray:
    """Random points of a square, 60 wide, with noise."""
    rng = np.random.default_rng(seed)
    return np.column_stack([rng.uniform(0, 60, (count, 2)), rng.normal(height, noise, count)])


def hill(seed: int) -> np.ndarray:
    points = sheet(seed)
    points[:, 2] += 8 * np.exp(-np.square(points[:, :2] - 30).sum(axis=1) / 200) + 0.02 * points[:, 0]
    return points


def up(points: np.ndarray) -> np.ndarray:
    return np.broadcast_to([0, 0, 1.0], points.shape)


def plain(core: np.ndarray, axis: np.ndarray, cloud: np.ndarray) -> np.ndarray:
    """The heights of all points in the whole cylinder, as the paper has it."""
    apart = cloud - core
    along = apart @ axis
    aside = np.linalg.norm(apart - along[:, None] * axis, axis=1)
    return along[(aside <= RADIUS) & (np.abs(along) <= REACH)]


def test_whole_cylinders_are_as_the_paper_defines_them() -> None:
    before, after = hill(1), hill(2)
    found = M3C2Reference(pose(before, up(before)), RADIUS, is_whole=True).distances(after, REACH)
    told = found.detectable(0.05)
    for i in range(0, len(after), 40):
        axis = found.directions[i]
        a, b = plain(after[i], axis, before), plain(after[i], axis, after)
        if min(len(a), len(b)) < 5:
            assert np.isnan(found.values[i])
            continue
        assert found.values[i] == pytest.approx(b.mean() - a.mean(), abs=1e-6)
        error = np.sqrt(a.var(ddof=1) / len(a) + b.var(ddof=1) / len(b))
        assert told[i] == pytest.approx(1.96 * (error + 0.05), abs=1e-6)


def test_values_equal_those_of_py4dgeo(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)  # py4dgeo writes a log where it is imported
    py4dgeo = pytest.importorskip("py4dgeo", reason="py4dgeo, which distances are compared with, is missing")
    before, after = hill(1), hill(2)
    reference = M3C2Reference(pose(before, up(before)), RADIUS, 4.0, is_whole=True)
    found = reference.distances(after, REACH)
    known = np.isfinite(found.values)
    theirs = py4dgeo.M3C2(
        epochs=(py4dgeo.Epoch(before), py4dgeo.Epoch(after)), corepoints=after[known], cyl_radius=RADIUS,
        corepoint_normals=found.directions[known], max_distance=REACH,
    )  # fmt: skip
    values, told = theirs.run()
    np.testing.assert_allclose(found.values[known], values, atol=1e-6)
    np.testing.assert_allclose(found.detectable()[known], told["lodetection"], atol=1e-6)


@pytest.mark.parametrize("is_whole", [False, True])
@pytest.mark.parametrize("shift", [0.0, -0.5, 4.0])
def test_a_shift_is_found_and_told_from_noise(shift: float, is_whole: bool) -> None:
    before, after = sheet(3), sheet(4, shift)
    found = M3C2Reference(pose(before, up(before)), RADIUS, is_whole=is_whole).distances(after, REACH)
    inner = ((after[:, :2] > 4) & (after[:, :2] < 56)).all(axis=1)
    assert np.isfinite(found.values[inner]).all()
    assert abs(found.values[inner].mean() - shift) < 0.02
    share = detected_share(found.values[inner], found.detectable()[inner])
    assert 0.02 < share < 0.09 if shift == 0 else share > 0.99
    still = detected_share(found.values[inner] - shift, found.detectable()[inner])
    assert 0.02 < still < 0.09, "95 % of what does not move"
    assert detected_share(found.values[inner], found.detectable(10.0)[inner]) == 0


def test_a_cylinder_that_grows_does_not_reach_the_back_of_a_thin_part() -> None:
    def part(seed: int, shift: float) -> np.ndarray:
        return np.concatenate([sheet(seed, shift), sheet(seed + 1, -4.5)])

    before, after = part(5, 0.0), part(7, 0.3)
    normals = up(before).copy()
    normals[len(before) // 2 :] *= -1
    inner = ((after[:, :2] > 4) & (after[:, :2] < 56)).all(axis=1)
    inner[len(after) // 2 :] = False
    values = {
        is_whole: M3C2Reference(pose(before, normals), RADIUS, is_whole=is_whole).signed(after, REACH)[inner]
        for is_whole in (False, True)
    }
    assert abs(values[False].mean() - 0.3) < 0.02
    assert values[False].std() < 0.1
    assert values[True].std() > 0.3


@pytest.mark.parametrize("origin", [0.0, 1e6])
def test_values_stay_the_same_far_from_the_origin(origin: float) -> None:
    before, after = hill(1), hill(2)
    found = M3C2Reference(pose(before + origin, up(before)), RADIUS).signed(after + origin, REACH)
    near = M3C2Reference(pose(before, up(before)), RADIUS).signed(after, REACH)
    assert np.isfinite(near).mean() > 0.9
    np.testing.assert_allclose(found, near, atol=1e-4)


def test_without_points_there_is_nothing_to_compare() -> None:
    with pytest.raises(InputError, match="no points"):
        M3C2Reference(pose(np.zeros((0, 3))))
    reference = M3C2Reference(pose(hill(1), up(hill(1))))
    assert isinstance(reference.distances(np.zeros((0, 3)), REACH), M3C2Distances)
    assert np.isnan(reference.signed(np.array([[30.0, 30.0, 100.0]]), REACH)).all()
    assert np.isnan(detected_share(np.array([np.nan]), np.array([np.nan])))

"""The search for the nearest points: by numpy and compiled, in any order of the file."""

from __future__ import annotations

import numpy as np
import pytest

from viewer.scan import spacing
from viewer.scan.noise import noise_of
from viewer.scan.points import PointCloud
from viewer.scan.spacing import nearest_rows, roughness, spacings

_ROWS = [0, 17, 20_000, 49_999]


def clouds() -> dict[str, PointCloud]:
    """Points by chance, in order, with copies, on a grid whose distances are all alike, and few."""
    rng = np.random.default_rng(5)
    points = rng.random((50_000, 3)).astype(np.float32)
    grid = np.stack(np.meshgrid(*[np.arange(37.0)] * 3), axis=-1).reshape(-1, 3)[:50_000]
    return {
        name: PointCloud.from_arrays(each)
        for name, each in {
            "by chance": points,
            "in order": points[np.argsort(points[:, 1])],
            "copies": np.repeat(points[:50], 1000, axis=0),
            "grid": grid,
            "few": points[:40],
        }.items()
    }


@pytest.fixture
def loading(monkeypatch: pytest.MonkeyPatch) -> pytest.MonkeyPatch:
    """For tests that choose from how many distances on the compiled loop searches."""
    monkeypatch.setattr(spacing, "_compared", 0)
    return monkeypatch


@pytest.mark.parametrize("name", clouds())
@pytest.mark.parametrize("count", [1, 12, 128])
def test_both_searches_find_the_same_rows_in_the_same_order(
    name: str, count: int, loading: pytest.MonkeyPatch
) -> None:
    cloud = clouds()[name]
    rows = [row for row in _ROWS if row < len(cloud)]
    loading.setattr(spacing, "_RUN", 2 * spacing._CHUNK)
    found = []
    for limit in (1 << 60, 0):
        loading.setattr(spacing, "_LOADING", limit)
        found.append(nearest_rows(cloud, rows, count))
    for by_numpy, compiled in zip(*found, strict=True):
        assert by_numpy.tolist() == compiled.tolist()


@pytest.mark.parametrize("name", ["by chance", "copies"])
def test_the_nearest_rows_are_those_of_all_distances(name: str, loading: pytest.MonkeyPatch) -> None:
    cloud = clouds()[name]
    for limit in (1 << 60, 0):
        loading.setattr(spacing, "_LOADING", limit)
        for row, found in zip(_ROWS, nearest_rows(cloud, _ROWS, 12), strict=True):
            away = np.linalg.norm(cloud.positions - cloud.positions[row], axis=1)
            assert np.sort(away[found]) == pytest.approx(np.sort(away)[:12], rel=1e-5)


def test_estimates_are_the_same_to_the_bit(loading: pytest.MonkeyPatch) -> None:
    found = []
    for limit in (1 << 60, 0):
        loading.setattr(spacing, "_LOADING", limit)
        cloud = clouds()["by chance"]
        found.append((noise_of(cloud), spacings(cloud).tobytes(), roughness(cloud)))
    assert found[0] == found[1]


def test_a_first_picture_does_not_load_numba(loading: pytest.MonkeyPatch) -> None:
    """Estimates of one pose of a million points take less time than numba takes to load; of many, more."""
    assert not spacing._is_compiling_worth(24_000_000)
    assert any(spacing._is_compiling_worth(8_000_000) for _ in range(20))

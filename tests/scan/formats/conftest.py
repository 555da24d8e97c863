"""Clouds that hold every attribute."""

from __future__ import annotations

import numpy as np
import pytest

from viewer.scan.points import PointCloud

UTM = np.array([665187.25, 5648349.5, 241.75])


def make_cloud(offset: np.ndarray, count: int = 50) -> PointCloud:
    """A body about 2 units wide around `offset`, with all attributes and several scalar types."""
    rng = np.random.default_rng(7)
    normals = rng.normal(size=(count, 3))
    return PointCloud.from_arrays(
        rng.random((count, 3)) * 2 + offset,
        normals=normals / np.linalg.norm(normals, axis=1, keepdims=True),
        colors=rng.integers(0, 256, (count, 4), np.uint8),
        radii=rng.random(count),
        scalars={
            "intensity": rng.random(count, np.float32),
            "gps_time": rng.random(count) + 1e9,
            "label": rng.integers(0, 256, count, np.uint8),
            "ring": rng.integers(0, 2**16, count, np.uint16),
            "change": rng.integers(-(2**31), 2**31, count, np.int32),
        },
    )


@pytest.fixture(scope="session")
def near_cloud() -> PointCloud:
    return make_cloud(np.zeros(3))


@pytest.fixture(params=["near zero", "at UTM coordinates"])
def full_cloud(request: pytest.FixtureRequest, near_cloud: PointCloud) -> PointCloud:
    return make_cloud(UTM) if request.param == "at UTM coordinates" else near_cloud

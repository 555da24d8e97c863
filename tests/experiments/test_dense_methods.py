"""Methods that dense tracking is compared with do what their papers say, on small motions."""

from __future__ import annotations

import numpy as np
from experiments.motion.methods import coherent_point_drift


def test_coherent_point_drift_follows_a_bend() -> None:
    points = np.random.default_rng(0).uniform(-10, 10, (120, 3)) * (1, 1, 0.1)
    there = points + np.column_stack([0 * points[:, :2], 0.02 * points[:, 0] ** 2])
    found = coherent_point_drift(points, there[::-1])
    assert np.median(np.linalg.norm(found - there, axis=1)) < 0.1

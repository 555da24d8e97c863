from __future__ import annotations

import numpy as np

from viewer.bench.scenes import samples
from viewer.bench.scenes.registration import OrientedPoints, register
from viewer.rigid import rigid_matrix, rotation_about

# An ellipsoid: a sphere, squeezed, so that turning it shows.
UNIT = samples.on_sphere(6000)["positions"]
AXES = np.array([1.0, 0.7, 0.5])


def target() -> OrientedPoints:
    normals = UNIT / AXES
    return OrientedPoints(UNIT * AXES, normals / np.linalg.norm(normals, axis=1, keepdims=True))


def moved(rotation: list[float], translation: list[float]) -> np.ndarray:
    return rigid_matrix(rotation_about(np.array(rotation)), np.array(translation))


def test_a_known_motion_is_found() -> None:
    motion = moved([0.1, -0.2, 0.15], [0.05, 0.1, -0.04])
    away = (UNIT[::5] * AXES - motion[:3, 3]) @ motion[:3, :3]  # the motion undone
    found, rms, share = register(away, target(), np.eye(4), (1.0, 0.1))
    np.testing.assert_allclose(found, motion, atol=1e-6)
    assert rms < 1e-6
    assert share == 1


def test_points_out_of_reach_do_not_count() -> None:
    motion = moved([0.0, 0.05, 0.0], [0.02, 0.0, 0.0])
    away = (UNIT[::5] * AXES - motion[:3, 3]) @ motion[:3, :3]
    background = np.tile([5.0, 5.0, 5.0], (len(away), 1))
    found, _, share = register(np.concatenate([away, background]), target(), np.eye(4), (0.5, 0.1))
    np.testing.assert_allclose(found, motion, atol=1e-6)
    assert share == 0.5


def test_nothing_in_reach_says_so() -> None:
    found, rms, share = register(UNIT[::50] + 100, target(), np.eye(4), (0.1,))
    assert (rms, share) == (np.inf, 0)
    np.testing.assert_array_equal(found, np.eye(4))


def test_it_is_the_same_every_time() -> None:
    away = UNIT[::5] * AXES @ rotation_about(np.array([0.1, 0.0, 0.0]))
    first, second = (register(away, target(), np.eye(4), (0.5, 0.1))[0] for _ in range(2))
    np.testing.assert_array_equal(first, second)

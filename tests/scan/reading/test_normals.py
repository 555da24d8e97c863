"""Normals that can be used: zeros and NaN are none, whatever their type and length."""

from __future__ import annotations

import numpy as np
import pytest

from viewer.scan.reading.corrections import Corrections
from viewer.scan.reading.normals import decide, fill_from_neighbours, usable_normals

RNG = np.random.default_rng(3)


@pytest.mark.parametrize("dtype", ["f2", "f4", "f8", "i1", "i4"])
@pytest.mark.parametrize("value", [0, np.nan, np.inf])
def test_normals_that_are_all_bad_are_none(dtype: str, value: float) -> None:
    if dtype[0] == "i" and value != 0:
        pytest.skip("whole numbers are finite")
    found = usable_normals(np.full((300, 3), value, dtype))
    assert found.normals is None
    assert (found.bad, decide(found).value) == (300, "dropped")


def test_some_bad_normals_become_zero_and_the_others_stay() -> None:
    normals = RNG.normal(size=(500_000, 3)).astype(np.float32)
    normals[7], normals[400_000] = 0, (np.nan, 0, 1)
    found = usable_normals(normals)
    bad = np.array([7, 400_000])
    assert found.bad == 2
    assert decide(found).value == "partly"
    assert not found.normals[bad].any()
    np.testing.assert_array_equal(np.delete(found.normals, bad, axis=0), np.delete(normals, bad, axis=0))


def test_missing_normals_follow_the_points_around() -> None:
    sphere = RNG.normal(size=(5000, 3)).astype(np.float32)
    sphere /= np.linalg.norm(sphere, axis=1, keepdims=True)
    for sign in (1, -1):
        normals = 3 * sign * sphere
        normals[::7] = 0
        fill_from_neighbours(normals, sphere)
        found = normals[::7]
        np.testing.assert_allclose(np.linalg.norm(found, axis=1), 1, rtol=1e-5)
        assert (np.einsum("ij,ij->i", found, sign * sphere[::7]) > 0.98).all()
        np.testing.assert_array_equal(normals[1::7], 3 * sign * sphere[1::7])


@pytest.mark.parametrize("count", [2, 3, 20])
def test_missing_normals_of_points_in_a_line_are_those_beside(count: int) -> None:
    line = np.stack([np.arange(count), 0 * np.arange(count), 0 * np.arange(count)], axis=1).astype(np.float32)
    normals = np.tile(np.array([0, 0, 1], np.float32), (count, 1))
    normals[1] = 0
    fill_from_neighbours(normals, line)
    np.testing.assert_allclose(normals[1], (0, 0, 1), atol=1e-6)


def test_the_user_retains_normals_as_they_are() -> None:
    normals = np.array([[0, 0, 1], [0, 0, 0]], np.float32)
    decision = decide(usable_normals(normals), Corrections.parse({"normals": "stored"}))
    assert (decision.value, decision.source) == ("stored", "user")


@pytest.mark.parametrize("length", [1e-30, 1e-12, 3, 1e30])
def test_normals_of_any_length_stay_as_they_are(length: float) -> None:
    normals = np.tile(np.array([0, 0, length], np.float32), (20, 1))
    found = usable_normals(normals)
    assert found.normals is normals
    assert decide(found).value == "stored"


def test_the_user_leaves_normals_out() -> None:
    found = usable_normals(np.ones((3, 3)))
    decision = decide(found, Corrections.parse({"normals": "none"}))
    assert (decision.value, decision.source) == ("none", "user")
    assert decide(None).value is None

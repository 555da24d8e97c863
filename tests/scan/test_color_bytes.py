"""Colours of files as 8 bit: scales, rounding, and what is no number."""

from __future__ import annotations

import numpy as np
import pytest

from viewer.scan.colors import full_scale, rgba8


@pytest.mark.parametrize("factor", [256, 257])
def test_16_bit_colors_give_the_bytes_that_they_were_made_of(factor: int) -> None:
    values = np.arange(256)
    colors = np.column_stack([values] * 3).astype(np.uint16) * np.uint16(factor)
    np.testing.assert_array_equal(rgba8(colors, 65535)[:, 0], values)


def test_16_bit_colors_are_rounded_and_never_get_darker_as_they_grow() -> None:
    values = np.arange(65536)
    found = rgba8(np.column_stack([values] * 3).astype(np.uint16), 65535)[:, 0].astype(int)
    assert (np.diff(found) >= 0).all()
    assert np.abs(found - values / 257).max() <= 1
    assert [found[250], found[200], found[100]] == [1, 1, 0]


@pytest.mark.parametrize("dtype", ["u1", "u2", "i4", "u4", "i8", "f4", "f8"])
@pytest.mark.parametrize("full", [255, 65535])
def test_the_scale_counts_and_not_the_type(dtype: str, full: int) -> None:
    top = min(full, 255 if dtype == "u1" else full)
    colors = np.array([[0, top // 2, top]], dtype)
    wanted = colors[0].astype(float) * 255 / full
    np.testing.assert_allclose(rgba8(colors, full)[0, :3], wanted, atol=0.51)


def test_numbers_outside_the_scale_are_clipped_and_nan_is_black() -> None:
    floats = np.array([[np.nan, -1, 1.02], [np.inf, -np.inf, 0.5]])
    np.testing.assert_array_equal(rgba8(floats, 1), [[0, 0, 255, 255], [255, 0, 128, 255]])
    np.testing.assert_array_equal(rgba8(floats * 255, 255), [[0, 0, 255, 255], [255, 0, 128, 255]])
    np.testing.assert_array_equal(rgba8(np.array([[-5, 70000, 255]]), 255), [[0, 255, 255, 255]])


def test_types_have_a_scale_by_themselves() -> None:
    assert [full_scale(np.zeros(1, kind)) for kind in ("f4", "f8", "u2", "u1", "i4", "?")] == [
        1, 1, 65535, 255, 255, 1,
    ]  # fmt: skip

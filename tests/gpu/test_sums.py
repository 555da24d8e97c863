"""Sums per cell, against numpy."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from viewer.drawing.renderer import Renderer
from viewer.errors import InputError
from viewer.gpu.context import Gpu, Program
from viewer.gpu.scatter import CellSums, FixedPoint, Visits

PARTS = Path(__file__).resolve().parent / "shaders"
Array = NDArray[np.float64]


def sums_of(cells: NDArray[np.int64], numbers: Array, count: int, fixed: FixedPoint) -> Array:
    """The sums of each cell, (count, channels): the plain version."""
    out = np.zeros((count, len(fixed.limits)))
    for cell, values in zip(cells, numbers, strict=True):
        steps = np.array(fixed.steps)
        out[cell] += np.rint(np.clip(values, -np.array(fixed.limits), fixed.limits) / steps) * steps
    return out


def summed(gpu: Gpu, cells: NDArray[np.int64], numbers: Array, count: int, fixed: FixedPoint) -> Array:
    buffers = [
        gpu.ctx.buffer(array if array.size else bytes(4))
        for array in (cells.astype(np.uint32), numbers.astype(np.float32))
    ]

    def bind(_: Program) -> None:
        buffers[0].bind_to_storage_buffer(6)
        buffers[1].bind_to_storage_buffer(7)

    sums = CellSums(gpu, count, len(fixed.limits))
    sums.clear()
    sums.add(Visits(f"{PARTS}/giving.glsl", len(cells), bind), fixed)
    out = sums.read(fixed)
    gpu.discard(sums, *buffers)
    return out


def some_numbers(items: int, limits: tuple[float, ...], seed: int = 0) -> Array:
    """Numbers of either sign, some beyond the limits, as float32 has them."""
    rng = np.random.default_rng(seed)
    return (rng.uniform(-1.2, 1.2, (items, len(limits))) * limits).astype(np.float32).astype(float)


@pytest.mark.parametrize("channels", [1, 2, 7])
@pytest.mark.parametrize(
    ("items", "cells"), [(0, 5), (1, 1), (5000, 1), (3001, 17), (257, 70_003), (256, 256)]
)
def test_sums_are_those_of_numpy(renderer: Renderer, items: int, cells: int, channels: int) -> None:
    fixed = FixedPoint((1.0, 512.0, 0.01, 3e4, 1.0, 2.0, 255.0)[:channels], (2.0**-20,) * channels, items)
    places = np.random.default_rng(items).integers(0, cells, items)
    numbers = some_numbers(items, fixed.limits)
    got = summed(renderer.gpu, places, numbers, cells, fixed)
    np.testing.assert_array_equal(got, sums_of(places, numbers, cells, fixed))


@given(st.lists(st.tuples(st.integers(0, 4), st.floats(-50, 50, width=32)), max_size=60))
def test_sums_of_any_numbers(renderer: Renderer, items: list[tuple[int, float]]) -> None:
    fixed = FixedPoint((40.0,), (0.25,), 60)
    places = np.array([cell for cell, _ in items], np.int64)
    numbers = np.array([number for _, number in items]).reshape(-1, 1)
    got = summed(renderer.gpu, places, numbers, 5, fixed)
    np.testing.assert_array_equal(got, sums_of(places, numbers, 5, fixed))


@pytest.mark.parametrize("sign", [-1, 1])
def test_the_largest_sum_does_not_wrap(renderer: Renderer, sign: int) -> None:
    items, limit = 70_000, 512.0
    fixed = FixedPoint((limit,), (2.0**-20,), items)
    assert items * limit / fixed.steps[0] <= 2**31 - 1 < 2 * items * limit / fixed.steps[0]
    numbers = np.full((items, 1), 2 * sign * limit)
    got = summed(renderer.gpu, np.zeros(items, np.int64), numbers, 1, fixed)
    assert got[0, 0] == sign * items * limit


def test_sums_do_not_depend_on_the_order(renderer: Renderer) -> None:
    fixed = FixedPoint((1.0, 1e-3), (2.0**-24, 2.0**-24), 20_000)
    places = np.random.default_rng(1).integers(0, 9, 20_000)
    numbers = some_numbers(20_000, fixed.limits)
    one, other = (
        summed(renderer.gpu, places[order], numbers[order], 9, fixed)
        for order in (np.arange(20_000), np.random.default_rng(2).permutation(20_000))
    )
    np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize(
    ("limit", "finest", "most", "step"),
    [
        (1.0, 1.0, 2**31 - 1, 1.0),
        (512.0, 1.0, 2**22 - 1, 1.0),
        (512.0, 1.0, 2**22, 2.0),
        (255.0, 1.0, 8_421_504, 1.0),
        (255.0, 1.0, 8_421_505, 2.0),
        (1.0, 2.0**-10, 2**21 - 1, 2.0**-10),
        (1.0, 0.3, 10, 0.5),
        (1e-3, 1e-6, 0, 2.0**-19),
    ],
)
def test_steps_are_as_fine_as_sums_allow(limit: float, finest: float, most: int, step: float) -> None:
    assert FixedPoint((limit,), (finest,), most).steps == (step,)


def test_sums_that_cannot_be_held_are_refused(renderer: Renderer) -> None:
    with pytest.raises(InputError, match="do not fit into 32 bits"):
        FixedPoint((1.0,), (0.5,), 2**31)
    for limit, finest in ((0.0, 1.0), (np.inf, 1.0), (1.0, 0.0), (1.0, 2.0), (np.nan, 1.0)):
        with pytest.raises(ValueError, match="must be above 0, and at most the"):
            FixedPoint((limit,), (finest,), 1)
    with pytest.raises(ValueError, match="must be 0 or more, not -1"):
        FixedPoint((1.0,), (1.0,), -1)
    with pytest.raises(ValueError, match="at least 1 channel, not 3 and 0"):
        CellSums(renderer.gpu, 3, 0)
    with pytest.raises(InputError, match="too large"):
        CellSums(renderer.gpu, renderer.gpu.max_storage_bytes, 1)
    sums = CellSums(renderer.gpu, 3, 2)
    with pytest.raises(ValueError, match="1 limits for 2 channels"):
        sums.add(Visits(f"{PARTS}/counting.glsl", 1, lambda _: None), FixedPoint((1.0,), (1.0,), 1))
    sums.release()


def test_no_cells_have_no_sums(renderer: Renderer) -> None:
    sums = CellSums(renderer.gpu, 0, 3)
    sums.clear()
    assert sums.read(FixedPoint((1.0,) * 3, (1.0,) * 3, 0)).shape == (0, 3)
    sums.release()


def test_more_items_than_one_dimension_of_a_dispatch_takes(renderer: Renderer) -> None:
    gpu, items, cells = renderer.gpu, 65_537 * 256, 1 << 18

    def bind(program: Program) -> None:
        gpu.set(program, modulus=cells)

    fixed = FixedPoint((1.0, 2.0), (1.0, 1.0), items // cells + 1)
    sums = CellSums(gpu, cells, 2)
    sums.clear()
    sums.add(Visits(f"{PARTS}/counting.glsl", items, bind), fixed)
    counts = np.full(cells, items // cells)
    counts[: items % cells] += 1
    np.testing.assert_array_equal(sums.read(fixed), np.column_stack([counts, -2 * counts]))
    sums.release()

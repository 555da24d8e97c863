"""Lists per cell, and the best per cell, against numpy."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from viewer.drawing.renderer import Renderer
from viewer.errors import InputError
from viewer.gpu import gl
from viewer.gpu.bins import Bins
from viewer.gpu.context import Gpu, Program
from viewer.gpu.scatter import Visits, scatter

PARTS = Path(__file__).resolve().parent / "shaders"
NONE, NO_KEY = 0xFFFFFFFF, 0x7F800000

Made = NDArray[np.uint32]  # (N, 4): first cell, how many cells in a row, key, item


def some_visits(count: int, cells: int, most: int = 3, seed: int = 0) -> Made:
    """Items that visit up to `most` cells each, some none."""
    rng = np.random.default_rng(seed)
    first = rng.integers(0, cells, count)
    many = np.minimum(rng.integers(0, most + 1, count), cells - first)
    return np.column_stack([first, many, rng.integers(0, 50, count), np.arange(count)]).astype(np.uint32)


def lists_of(visits: Made, cells: int) -> list[list[int]]:
    """The list of each cell, in the items' order: the plain version."""
    lists: list[list[int]] = [[] for _ in range(cells)]
    for first, many, _, item in visits.tolist():
        for cell in range(first, first + many):
            lists[cell].append(item)
    return lists


def filled(gpu: Gpu, visits: Made, cells: int, ordered: bool, bins: Bins | None = None) -> list[list[int]]:
    own = bins or Bins(gpu, cells, ordered)
    texels = gl.BufferTexture(gpu.ctx.buffer(visits if len(visits) else bytes(16)), gl.RGBA32UI)
    given = Visits(f"{PARTS}/given.glsl", len(visits), lambda _: texels.bind(0))
    own.count(given)
    own.fill(given)
    starts = np.frombuffer(own.starts.buffer.read(), np.uint32)
    items = np.frombuffer(own.items.buffer.read(), np.uint32)
    lists = [items[starts[cell] : starts[cell + 1]].tolist() for cell in range(cells)]
    assert own.length() == starts[cells] == int(visits[:, 1].sum())
    texels.release()
    if bins is None:
        own.release()
    return lists


CASES = {
    "nothing": (0, 5, 1),
    "one item in the only cell": (1, 1, 1),
    "all in one cell": (70_001, 1, 1),
    "fewer cells than items": (3000, 17, 3),
    "more cells than items": (300, 70_003, 3),
    "runs that end within a block": (2049, 257, 2),
    "many visits each": (50, 4000, 2000),
}


@pytest.mark.parametrize("case", CASES)
def test_lists_hold_the_visitors_of_each_cell(renderer: Renderer, case: str) -> None:
    count, cells, most = CASES[case]
    visits = some_visits(count, cells, most)
    got = filled(renderer.gpu, visits, cells, ordered=False)
    assert [sorted(items) for items in got] == lists_of(visits, cells)


@pytest.mark.parametrize("case", CASES)
def test_ordered_lists_keep_the_order_of_the_items(renderer: Renderer, case: str) -> None:
    count, cells, most = CASES[case]
    visits = some_visits(count, cells, most)
    visits[:, 3] = np.random.default_rng(1).permutation(count)  # the order is that of visits, not of numbers
    assert filled(renderer.gpu, visits, cells, ordered=True) == lists_of(visits, cells)


@given(st.lists(st.tuples(st.integers(0, 40), st.integers(0, 3)), max_size=80))
def test_ordered_lists_of_any_visits(renderer: Renderer, pairs: list[tuple[int, int]]) -> None:
    visits = np.array([(cell, many, 0, i) for i, (cell, many) in enumerate(pairs)], np.uint32).reshape(-1, 4)
    assert filled(renderer.gpu, visits, 44, ordered=True) == lists_of(visits, 44)


@pytest.mark.parametrize("ordered", [False, True])
def test_the_same_bins_for_one_picture_after_another(renderer: Renderer, ordered: bool) -> None:
    bins = Bins(renderer.gpu, 100, ordered)
    for number, count in enumerate((500, 0, 40_000, 30)):
        visits = some_visits(count, 100, seed=number)
        lists = filled(renderer.gpu, visits, 100, ordered, bins)
        assert [sorted(items) for items in lists] == lists_of(visits, 100)
    held = bins.nbytes
    bins.reserve(30)
    assert bins.nbytes < held, "room for 40 000 is given up"
    bins.release()


def by_number(gpu: Gpu, count: int, modulus: int) -> Visits:
    def bind(program: Program) -> None:
        gpu.set(program, modulus=modulus)

    return Visits(f"{PARTS}/modulo.glsl", count, bind)


@pytest.mark.slow
def test_as_many_items_as_one_dimension_of_a_dispatch_does_not_take(renderer: Renderer) -> None:
    gpu, cells, count = renderer.gpu, 1 << 20, 65_537 * 256
    visits = by_number(gpu, count, cells)
    bins = Bins(gpu, cells)
    bins.count(visits)
    bins.fill(visits)
    starts = np.frombuffer(bins.starts.buffer.read(), np.uint32)
    counts = np.full(cells, count // cells)
    counts[: count % cells] += 1
    np.testing.assert_array_equal(np.diff(starts), counts)
    items = np.frombuffer(bins.items.buffer.read(), np.uint32)[:count]
    np.testing.assert_array_equal(items % cells, np.repeat(np.arange(cells), counts))
    np.testing.assert_array_equal(np.sort(items), np.arange(count))
    bins.release()


def test_lists_too_long_for_a_buffer_are_refused(renderer: Renderer) -> None:
    gpu = renderer.gpu
    visits = by_number(gpu, 9, 3)
    bins = Bins(gpu, 3)
    bins.count(visits)
    with pytest.raises(InputError, match="too long"):
        bins.fill(visits, length=gpu.max_storage_bytes // 4 + 1)
    bins.release()


def best_of(visits: Made, cells: int) -> tuple[NDArray[np.uint32], NDArray[np.uint32]]:
    """The least key of each cell and the lowest item that has it: the plain version."""
    best = np.full((cells, 2), (NO_KEY, NONE))
    for first, many, key, item in visits.tolist():
        for cell in range(first, first + many):
            best[cell] = min(tuple(best[cell]), (key, item))
    return best[:, 0].astype(np.uint32), best[:, 1].astype(np.uint32)


@pytest.mark.parametrize(("count", "cells"), [(0, 3), (1, 1), (5000, 1), (3000, 17), (300, 70_003)])
def test_the_best_of_any_number_of_cells(renderer: Renderer, count: int, cells: int) -> None:
    gpu = renderer.gpu
    visits = some_visits(count, cells)
    texels = gl.BufferTexture(gpu.ctx.buffer(visits if count else bytes(16)), gl.RGBA32UI)
    keys, best = (gl.BufferTexture(gpu.ctx.buffer(reserve=4 * cells), gl.R32UI) for _ in range(2))
    scatter(gpu, Visits(f"{PARTS}/given.glsl", count, lambda _: texels.bind(0)), keys, best)
    got = [np.frombuffer(t.buffer.read(), np.uint32) for t in (keys, best)]
    np.testing.assert_array_equal(got, best_of(visits, cells))
    gpu.discard(texels, keys, best)

"""Prefix sums and the lists that come of them, against numpy."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scenes import rarely

from viewer.drawing.renderer import Renderer
from viewer.gpu import gl
from viewer.gpu.compact import MOST_WORDS, IndexList, list_flagged, prefix_sums, scan_words
from viewer.gpu.context import Gpu, Program

PARTS = Path(__file__).resolve().parent / "shaders"
BLOCK = 2048  # words of a work group on hardware; on software drivers up to 65536
COUNTS = (0, 1, 7, 255, 257, BLOCK - 1, BLOCK, BLOCK + 1, 65_536, 65_537, 100_003, BLOCK * BLOCK + 1)


@pytest.fixture(params=["software", "hardware"])
def gpu(request: pytest.FixtureRequest, renderer: Renderer, monkeypatch: pytest.MonkeyPatch) -> Gpu:
    """A context, with words shared out among invocations as on either kind of driver."""
    monkeypatch.setattr(renderer.gpu, "software", request.param == "software")
    return renderer.gpu


def sums_before(words: NDArray[np.uint32]) -> NDArray[np.uint32]:
    """Exclusive prefix sums modulo 2^32, as numpy has them."""
    return np.cumsum(words, dtype=np.uint32) - words


def summed(gpu: Gpu, words: NDArray[np.uint32]) -> NDArray[np.uint32]:
    buffer = gpu.ctx.buffer(words if words.size else bytes(4))
    prefix_sums(gpu, buffer, len(words))
    out = np.frombuffer(buffer.read(), np.uint32)[: len(words)]
    buffer.release()
    return out


@pytest.mark.parametrize("count", COUNTS)
def test_prefix_sums_are_those_of_numpy(gpu: Gpu, count: int) -> None:
    words = np.random.default_rng(count).integers(0, 1000, count, np.uint32)
    np.testing.assert_array_equal(summed(gpu, words), sums_before(words))


@pytest.mark.parametrize("place", [0, BLOCK - 1, BLOCK, 5 * BLOCK])
def test_a_word_alone_is_before_all_that_follow(gpu: Gpu, place: int) -> None:
    words = np.zeros(5 * BLOCK + 1, np.uint32)
    words[place] = 0xFFFFFFFF
    np.testing.assert_array_equal(summed(gpu, words), sums_before(words))


@given(st.lists(st.integers(0, 0xFFFFFFFF), max_size=600))
def test_prefix_sums_of_any_words_wrap(renderer: Renderer, words: list[int]) -> None:
    array = np.array(words, np.uint32)
    np.testing.assert_array_equal(summed(renderer.gpu, array), sums_before(array))


def test_words_behind_the_last_stay(renderer: Renderer) -> None:
    buffer = renderer.gpu.ctx.buffer(np.full(10, 3, np.uint32))
    prefix_sums(renderer.gpu, buffer, 4)
    assert np.frombuffer(buffer.read(), np.uint32).tolist() == [0, 3, 6, 9, 3, 3, 3, 3, 3, 3]
    buffer.release()


def flagged(gpu: Gpu, flags: NDArray[np.bool_]) -> NDArray[np.uint32]:
    """What `list_flagged` lists."""
    words = gpu.ctx.buffer(flags.astype(np.uint32) if flags.size else bytes(4))
    listed = IndexList(gpu, max(len(flags), 1))
    list_flagged(gpu, f"{PARTS}/flags.glsl", len(flags), listed, lambda _: words.bind_to_storage_buffer(0))
    indices = np.frombuffer(listed.texels.buffer.read(), np.uint32)[: len(listed)]
    listed.release()
    words.release()
    return indices


@pytest.mark.parametrize("share", [0.0, *rarely(0.01, 1.0), 0.5])
@pytest.mark.parametrize("count", COUNTS)
def test_flagged_items_are_listed_in_their_order(gpu: Gpu, count: int, share: float) -> None:
    flags = np.random.default_rng(count).random(count) < share
    np.testing.assert_array_equal(flagged(gpu, flags), np.flatnonzero(flags))


def test_a_list_runs_as_many_invocations_as_it_has_items(renderer: Renderer) -> None:
    gpu = renderer.gpu
    flags = np.arange(1000) % 3 == 0
    words, marks = gpu.ctx.buffer(flags.astype(np.uint32)), gpu.ctx.buffer(reserve=4000)
    gl.clear_words(marks, 0)
    listed = IndexList(gpu, 1000)
    list_flagged(gpu, f"{PARTS}/flags.glsl", 1000, listed, lambda _: words.bind_to_storage_buffer(0))
    marks.bind_to_storage_buffer(0)
    listed.run(gpu.compute(f"{PARTS}/mark.comp"))
    gpu.ctx.memory_barrier()
    np.testing.assert_array_equal(np.frombuffer(marks.read(), np.uint32), flags)
    for each in (listed, words, marks):
        each.release()


@pytest.mark.slow
@pytest.mark.parametrize("gpu", ["hardware"], indirect=True)
def test_as_many_blocks_as_one_dimension_of_a_dispatch_does_not_take(gpu: Gpu) -> None:
    every = 1_000_003
    expected = np.arange(every - 1, MOST_WORDS, every)
    found = gpu.ctx.buffer(reserve=4 * len(expected))

    def bind(program: Program) -> None:
        gpu.set(program, every=every)
        found.bind_to_storage_buffer(0)

    scan_words(gpu, f"{PARTS}/every.glsl", MOST_WORDS, bind)
    assert -(-MOST_WORDS // BLOCK) > 65535
    np.testing.assert_array_equal(np.frombuffer(found.read(), np.uint32), expected)
    found.release()


def test_more_than_there_is_room_for_is_refused(renderer: Renderer) -> None:
    gpu = renderer.gpu
    listed, words = IndexList(gpu, 10), gpu.ctx.buffer(reserve=4)
    with pytest.raises(ValueError, match="room for 11"):
        list_flagged(gpu, f"{PARTS}/flags.glsl", 11, listed, lambda _: None)
    with pytest.raises(ValueError, match="the limit is"):
        prefix_sums(gpu, words, MOST_WORDS + 1)
    listed.release()
    words.release()

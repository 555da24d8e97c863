"""Filling buffers with a word: by a shader and by the driver the same, and nothing else changes."""

from __future__ import annotations

import numpy as np
import pytest

from viewer.drawing.renderer import Renderer
from viewer.gpu.bindings import Storage
from viewer.gpu.compact import prefix_sums
from viewer.gpu.constants import NO_DEPTH, NOTHING


@pytest.mark.parametrize("by_shader", [False, True])
@pytest.mark.parametrize("count", [0, 1, 5, 1023, 70_000, None])
def test_the_first_words_are_filled(
    count: int | None, by_shader: bool, renderer: Renderer, monkeypatch: pytest.MonkeyPatch
) -> None:
    gpu, before = renderer.gpu, np.arange(100_003, dtype=np.uint32)
    monkeypatch.setattr(gpu, "clears_by_shader", by_shader)
    buffer = gpu.buffer(before)
    for word in (NOTHING, NO_DEPTH, 0):
        gpu.clear(buffer, word, count)
        expected = before.copy()
        expected[:count] = word
        assert (gpu.read(buffer, np.uint32) == expected).all()
    buffer.release()


def test_a_fill_leaves_bindings_alone(renderer: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    gpu, count = renderer.gpu, 5000
    monkeypatch.setattr(gpu, "clears_by_shader", True)
    words, other = gpu.buffer(np.ones(count, np.uint32)), gpu.buffer(reserve=64)
    words.bind_to_storage_buffer(Storage.WORDS)
    gpu.clear(other, 7)
    prefix_sums(gpu, words, count)
    assert (gpu.read(words, np.uint32) == np.arange(count)).all()
    for buffer in (words, other):
        buffer.release()

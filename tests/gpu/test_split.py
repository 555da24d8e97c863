"""Quotients and means of whole numbers (shaders/common/split.glsl), against integers of 64 bits."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from viewer.drawing.renderer import Renderer

PROBES = Path(__file__).resolve().parent / "shaders"


def test_means_are_those_of_whole_numbers(renderer: Renderer) -> None:
    """To the last of their 12 bits, also next to whole steps, and of sums up to the 32nd bit."""
    gpu, random = renderer.gpu, np.random.default_rng(0)
    counts = np.concatenate([np.arange(1, 5000), random.integers(1, 1 << 20, 50_000), [(1 << 20) - 1] * 100])
    steps = random.integers(0, 4095 << 12, len(counts))
    next_to = -(-steps * counts >> 12)
    sums = np.concatenate([next_to, np.maximum(next_to - 1, 0), random.integers(0, 4095 * counts + 1)])
    counts = np.tile(counts, 3)
    buffers = [gpu.ctx.buffer(array.astype(np.uint32)) for array in (sums, counts, counts)]
    for binding, buffer in enumerate(buffers):
        buffer.bind_to_storage_buffer(binding)
    gpu.dispatch(gpu.compute(str(PROBES / "means.comp")), len(counts))
    np.testing.assert_array_equal(
        np.frombuffer(buffers[2].read(), np.float32) * 4096.0, (sums << 12) // counts
    )


def test_remainders_and_quotients_are_those_of_whole_numbers(renderer: Renderer) -> None:
    """Also next to multiples that floats do not tell from the numbers beside them."""
    gpu, random = renderer.gpu, np.random.default_rng(0)
    divisors = random.integers(8, 5000, 20_000)
    multiples = random.integers(1, (1 << 26) // divisors) * divisors
    numbers = np.concatenate([multiples - 1, multiples, multiples + 1])
    divisors = np.tile(divisors, 3)
    given = numbers, divisors, np.zeros(2 * len(numbers))
    buffers = [gpu.ctx.buffer(array.astype(np.int32)) for array in given]
    for binding, buffer in enumerate(buffers):
        buffer.bind_to_storage_buffer(binding)
    gpu.dispatch(gpu.compute(str(PROBES / "split.comp")), len(numbers))
    remainders, quotients = np.frombuffer(buffers[2].read(), np.int32).reshape(-1, 2).T
    np.testing.assert_array_equal(quotients, numbers // divisors)
    np.testing.assert_array_equal(remainders, numbers % divisors)

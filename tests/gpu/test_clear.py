"""Filling buffers with a word: by a shader and by the driver the same, and nothing else changes."""

from __future__ import annotations

import numpy as np
import pytest

from viewer.camera import Camera
from viewer.drawing.frame import render_frame
from viewer.drawing.renderer import Renderer
from viewer.drawing.request import Request
from viewer.gpu.bindings import Storage
from viewer.gpu.compact import prefix_sums
from viewer.gpu.constants import NO_DEPTH, NOTHING
from viewer.gpu.context import Fill
from viewer.picture.surface import Surface
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose


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


@pytest.mark.parametrize("by_shader", [False, True])
def test_several_buffers_are_filled_at_once(
    by_shader: bool, renderer: Renderer, monkeypatch: pytest.MonkeyPatch
) -> None:
    gpu = renderer.gpu
    monkeypatch.setattr(gpu, "clears_by_shader", by_shader)
    counts = (7, None, 0, 600, 129, None)
    before = np.arange(70_000, dtype=np.uint32)
    buffers = [gpu.buffer(before[: 70_000 >> number]) for number in range(len(counts))]
    gpu.fill(*(Fill(buffer, 11 * number, counts[number]) for number, buffer in enumerate(buffers)))
    for number, (buffer, count) in enumerate(zip(buffers, counts, strict=True)):
        expected = before[: buffer.size // 4].copy()
        expected[:count] = 11 * number
        assert (gpu.read(buffer, np.uint32) == expected).all()
        buffer.release()


def test_depths_rows_and_picture_are_filled_at_once(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch
) -> None:
    surface, filled, fill = Surface(renderer.gpu, (64, 48)), list[set[object]](), renderer.gpu.fill

    def noted(*fills: Fill) -> None:
        filled.append({each.buffer for each in fills})
        fill(*fills)

    monkeypatch.setattr(renderer.gpu, "fill", noted)
    monkeypatch.setattr(renderer.gpu, "wide_atomics", False)  # which clear neither depths nor rows
    points = np.random.default_rng(0).normal(size=(3000, 3))
    pose = Pose(0, 0.0, "some", PointCloud.from_arrays(points))
    pixels = {surface.depths.buffer, surface.rows.buffer, surface.picture}
    for name in ("points", "surfels", "voxels", "pyramidal"):
        render_frame(renderer, Request(pose, Camera.orbit(pose.bounds), name), surface)
        assert [buffers for buffers in filled if buffers & pixels] == [pixels]
        filled.clear()


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

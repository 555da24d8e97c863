"""Reading buffers: what comes is what shaders wrote, by each way, and drivers move no buffer for it."""

from __future__ import annotations

import numpy as np
import pytest

from viewer.backends import backends
from viewer.camera import Camera
from viewer.drawing.renderer import Renderer
from viewer.gpu import gl, staging
from viewer.gpu.staging import Staging
from viewer.testing.scenes import draw, sphere

COUNT = 5000


@pytest.fixture(params=["copy", "get", "map"])
def reading(request: pytest.FixtureRequest, renderer: Renderer, monkeypatch: pytest.MonkeyPatch) -> Staging:
    """Staging of the shared context that reads in each way, by parts of a few bytes."""
    gpu, way = renderer.gpu, request.param
    if way == "copy" and not gl.has_mapped_buffers(gpu.ctx):
        pytest.skip("this driver has no buffers that stay mapped")
    monkeypatch.setattr(staging, "_MOST", 64)
    monkeypatch.setattr(staging, "_LEAST", 16)
    made = Staging(gpu.ctx, gpu.software)
    made.reading = way
    return made


def test_bytes_come_as_they_are(reading: Staging, renderer: Renderer) -> None:
    numbers = np.random.default_rng(0).integers(0, 2**32, COUNT, np.uint32)
    buffer = renderer.gpu.buffer(numbers)
    for first, count in ((0, COUNT), (0, 1), (COUNT - 1, 1), (3, 100), (7, 0)):
        found = reading.read(buffer, 4 * count, 4 * first)
        assert (found.view(np.uint32) == numbers[first : first + count]).all()
    assert reading.reads == 5
    buffer.release()


@pytest.mark.parametrize("by_copy", [True, False])
def test_much_data_comes_as_it_is(by_copy: bool, renderer: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    """By more slices than are on their way at once, and by several threads."""
    gpu = renderer.gpu
    if by_copy and not gl.has_mapped_buffers(gpu.ctx):
        pytest.skip("this driver has no buffers that stay mapped")
    monkeypatch.setattr(staging, "_SLOT", 1 << 18)
    monkeypatch.setattr(staging, "_MUCH", 1 << 16)
    monkeypatch.setattr(staging, "_LIKE_POINTS", 1)
    made = Staging(gpu.ctx, gpu.software)
    made.writes_by_copy = by_copy
    numbers = np.random.default_rng(0).integers(0, 2**32, (400_000, 3), np.uint32)
    buffer = gpu.buffer(reserve=numbers.nbytes + 8)
    for first, data in ((8, numbers), (8, numbers[:30_000][::-1].copy()), (16, numbers[:3])):
        made.write(buffer, data, first)
        found = gpu.read(buffer, np.uint32, data.size, first)
        assert (found.reshape(-1, 3) == data).all()
    found = gpu.read(buffer, np.uint32, 3 * 370_000, 8 + 12 * 30_000)
    assert (found.reshape(-1, 3) == numbers[30_000:]).all()
    buffer.release()


def test_what_was_read_stays_when_more_is_read(reading: Staging, renderer: Renderer) -> None:
    first, second = (renderer.gpu.buffer(np.full(4, value, np.uint32)) for value in (1, 2))
    found = reading.read(first, 16, 0)
    reading.read(second, 16, 0)
    assert found.view(np.uint32).tolist() == [1] * 4


@pytest.mark.parametrize("backend", [name for name, each in backends().items() if each.rows == "points"])
def test_no_picture_moves_a_buffer_or_is_an_error(backend: str, renderer: Renderer) -> None:
    """Moves are those of graphics cards, whose drivers report them."""
    cloud = sphere(2000)
    for turn in (20, 40):
        camera = Camera.orbit(cloud.bounds(), turn, 15)
        with gl.debug_messages() as messages:
            surface = draw(cloud, camera, (64, 48), backend)
            surface.image()
        assert np.isfinite(surface.depth).any()
        assert [each for each in messages if "moved from VIDEO" in each or each.startswith("error")] == []

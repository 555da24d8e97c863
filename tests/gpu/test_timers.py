"""Passes of a frame: a pass within another counts once, clears are timed, and all add up to the frame."""

from __future__ import annotations

import time
from collections.abc import Iterator

import numpy as np
import pytest

from viewer.backends import backends
from viewer.camera import Camera
from viewer.drawing.renderer import Renderer
from viewer.drawing.request import Request
from viewer.drawing.timing import pass_ms
from viewer.gpu import gl
from viewer.gpu.timers import Timers
from viewer.picture.surface import Surface
from viewer.scan.pose import Pose
from viewer.testing.scenes import sphere


@pytest.fixture(params=["finish", "query"])
def timers(request: pytest.FixtureRequest, renderer: Renderer) -> Timers:
    """Timers of both kinds, whatever the driver."""
    made = Timers(renderer.gpu.ctx, software=request.param == "finish")
    made.enabled = True
    made.start_frame()
    return made


@pytest.fixture
def filling(renderer: Renderer) -> Iterator[object]:
    """Something that the GPU needs a while for."""
    buffer = renderer.gpu.buffer(reserve=1 << 24)
    yield lambda: gl.clear_words(buffer, 1)
    buffer.release()


def test_a_pass_within_another_counts_once(timers: Timers, filling) -> None:
    with timers.measure("outer"):
        filling()
        with timers.measure("inner"):
            for _ in range(8):
                filling()
        with timers.measure("alone", only_alone=True):
            filling()
    found, frame = dict(timers.passes()), timers.frame_ms()
    assert list(found) == ["inner", "outer"]
    assert min(found.values()) >= 0
    assert sum(found.values()) <= frame
    with timers.measure("alone", only_alone=True):
        filling()
    assert [name for name, _ in timers.passes()] == ["inner", "outer", "alone"]


def test_queries_are_used_again_in_the_next_frame(timers: Timers, filling) -> None:
    counts = []
    for _ in range(4):
        timers.start_frame()
        for _ in range(20):
            with timers.measure("fill"):
                filling()
        assert len(timers.passes()) == 20
        counts.append(len(timers._queries))
    assert len(set(counts)) == 1


def test_a_pass_that_fails_ends_and_nothing_is_timed_while_paused(timers: Timers) -> None:
    with pytest.raises(ZeroDivisionError), timers.measure("outer"), timers.measure("fails"):
        _ = 1 / 0
    with timers.paused(), timers.measure("never"):
        pass
    with timers.measure("after"):
        pass
    assert [name for name, _ in timers.passes()] == ["fails", "outer", "after"]


@pytest.mark.parametrize("name", [name for name, each in backends().items() if each.rows == "points"])
def test_timing_passes_is_no_error(name: str, renderer: Renderer) -> None:
    """As queries within each other are."""
    cloud, timers = sphere(2000), renderer.gpu.timers
    camera = Camera.orbit(cloud.bounds(), 20, 15)
    request = Request(Pose(0, 0.0, "timed", cloud), camera, name)
    kind, timers.kind = timers.kind, "query"
    try:
        with gl.debug_messages() as messages:
            (found, _) = pass_ms(renderer, [request] * 2, Surface(renderer.gpu, (64, 48)))
    finally:
        timers.kind = kind
    assert [each for each in messages if each.startswith("error")] == []
    assert all(ms >= 0 for ms in found.values())


def test_the_passes_of_a_picture_are_the_frame(renderer: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    """All but what the CPU does between them, as far as the GPU waits for it."""
    monkeypatch.setattr(renderer.gpu, "wide_atomics", False)  # these clear in the pass that shades
    cloud, timers = sphere(400_000), renderer.gpu.timers
    surface = Surface(renderer.gpu, (1200, 800))
    shares = []
    for turn in range(5):
        request = Request(Pose(0, 0.0, "timed", cloud), Camera.orbit(cloud.bounds(), turn, 15), "points")
        start = time.perf_counter()
        (found,) = pass_ms(renderer, [request], surface)
        frame = surface.stats.frame_ms
        assert frame <= 1e3 * (time.perf_counter() - start)
        assert "clear" in found
        shares.append(sum(found.values()) / frame)
    least = 0.7 if renderer.gpu.software else 0.0  # a graphics card waits for the CPU between short passes
    assert least <= np.median(shares) <= 1.0
    assert not timers.enabled

"""The CPU's work for a frame, as counts: programs before the first picture, then calls, reads, clears."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import NamedTuple

import pytest
from scenes import sphere

from viewer.backends.voxels import cuts
from viewer.camera import Camera
from viewer.drawing.frame import render_frame
from viewer.drawing.renderer import Renderer
from viewer.drawing.request import Request, backend_for
from viewer.gpu.context import headless
from viewer.look import Look
from viewer.picture.surface import Surface
from viewer.scan.pose import Pose

SIZE = (60, 40)
LOOK = Look(light="flat", eye_dome=False)


class Most(NamedTuple):
    """Limits of a backend's pictures. programs: compiled before the first picture. calls: of Python functions
    in a picture from another view, whatever the number of points. reads, clears: in the same."""

    programs: int
    calls: int
    reads: int
    clears: int


MOST = {
    "points": Most(6, 1000, 0, 3),
    "surfels": Most(30, 2600, 4, 8),
    "codeword": Most(12, 1350, 3, 8),
    "voxels": Most(30, 4200, 6, 8),
}


@contextmanager
def counted_calls() -> Iterator[list[int]]:
    """Count the calls of Python functions of this thread meanwhile."""
    calls, before = [0], sys.getprofile()

    def note(frame: FrameType, event: str, argument: object) -> None:
        calls[0] += event == "call"

    sys.setprofile(note)
    try:
        yield calls
    finally:
        sys.setprofile(before)


@pytest.fixture
def fresh() -> Iterator[Renderer]:
    """A renderer whose programs are all still to be compiled."""
    renderer = Renderer(headless())
    yield renderer
    renderer.release()


@pytest.mark.parametrize("name", MOST)
def test_a_frame_costs_few_calls_whatever_the_number_of_points(
    fresh: Renderer, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    gpu, most = fresh.gpu, MOST[name]
    monkeypatch.setattr(cuts, "BY_SHADERS", True)
    clears: list[int] = []
    clear = gpu.clear
    monkeypatch.setattr(gpu, "clear", lambda *args: (clears.append(1), clear(*args))[1])
    found = []
    for count in (2000, 16_000):
        cloud = sphere(count)
        pose, surface = Pose(0, 0.0, "", cloud), Surface(gpu, SIZE)
        backend, params = backend_for(pose, name, {})

        def draw(azimuth: float, cloud=cloud, pose=pose, surface=surface, how=(backend, params)) -> None:
            camera = Camera.orbit(cloud.bounds(), azimuth, 20, aspect=1.5)
            assert not render_frame(fresh, Request(pose, camera, *how, LOOK), surface)

        draw(0)
        if not found:
            assert gpu.programs <= most.programs
        for azimuth in (10, 20):
            draw(azimuth)
        reads = gpu.staging.reads
        clears.clear()
        with counted_calls() as calls:
            draw(30)
        found.append(Most(gpu.programs, calls[0], gpu.staging.reads - reads, len(clears)))
    for one in found:
        assert one.calls <= most.calls, found
        assert one.reads <= most.reads, found
        assert one.clears <= most.clears, found

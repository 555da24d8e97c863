"""Drawing for the command line: which pictures of which poses, and from where."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from .. import frame
from ..camera import Camera
from ..gpu.context import headless
from ..gpu.surface import Surface
from ..renderer import Renderer
from ..scan.points import Bounds
from ..scan.timeline import Timeline
from ..scan.times import DEFAULT_FPS


@dataclass(frozen=True)
class Shot:
    """One picture. number: its file's. pose: an index. azimuth: degrees on the turntable."""

    number: int
    pose: int
    azimuth: float = 0.0


def shots(indices: Sequence[int], turntable: int | None = None) -> list[Shot]:
    """The pictures of these poses. turntable: how many make a turn; a single pose gets a whole one."""
    if turntable is None:
        return [Shot(index, index) for index in indices]
    if len(indices) == 1:
        return [Shot(k, indices[0], 360 * k / turntable) for k in range(turntable)]
    return [Shot(index, index, 360 * k / turntable) for k, index in enumerate(indices)]


def turntable_camera(
    bounds: Bounds, azimuths: Sequence[float], aspect: float, up: str
) -> Callable[[Shot], Camera]:
    """A camera for each shot, at the one distance that shows the whole bounds from all azimuths."""
    distance = max(Camera.orbit(bounds, azimuth, aspect=aspect, up=up).distance for azimuth in azimuths)
    return lambda shot: Camera.orbit(bounds, shot.azimuth, distance=distance, up=up)


def film_rate(timeline: Timeline, indices: Sequence[int], fps: float | None) -> float:
    """Pictures a second: `fps` where given, else as fast as the poses follow each other."""
    if fps is not None:
        return fps
    steps = np.diff(timeline.times[list(indices)])
    return 1 / float(np.median(steps)) if len(steps) else DEFAULT_FPS


def renderer(device: int | None) -> Renderer:
    """A headless renderer on this device; None: the one that `viewer.render` uses."""
    return frame.shared_renderer() if device is None else Renderer(headless(device))


@contextmanager
def canvas(device: int | None, size: tuple[int, int]) -> Iterator[tuple[Renderer, Surface]]:
    """A headless renderer and a surface to draw to."""
    its_renderer = renderer(device)
    surface = Surface(its_renderer.gpu, size)
    try:
        yield its_renderer, surface
    finally:
        surface.release()

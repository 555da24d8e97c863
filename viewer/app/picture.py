"""The picture in the window: drawn anew only where another one is asked for."""

from __future__ import annotations

import logging
import math
import time
from collections import deque
from typing import Any

from ..errors import Scan4DError
from ..frame import Request, render_frame
from ..gpu.context import Gpu
from ..gpu.present import Presenter
from ..gpu.surface import Surface
from ..pick import Picked, pick
from ..renderer import Renderer
from ..scan.points import Bounds
from ..scan.pose import Pose

log = logging.getLogger(__name__)
_RATE_SPAN = 1.0  # seconds over which pictures are counted
_PREPARED_LATER = 0.1  # seconds until drawing again may find what a worker prepares


class Picture:
    """Draws requests into a Surface of the view's size.

    request: what was drawn last, None before. problem: why it could not be drawn, None
    where it could. better_at: by the clock, when drawing the same again may give a better
    picture; infinite where it cannot.
    """

    def __init__(self, gpu: Gpu) -> None:
        self.gpu = gpu
        self.renderer = Renderer(gpu)
        self._presenter = Presenter(gpu)
        self.surface: Surface | None = None
        self.request: Request | None = None
        self.problem: Scan4DError | None = None
        self.better_at = math.inf
        self._drawn: Any = None
        self._bounded: tuple[Pose, Bounds] | None = None
        self._times: deque[float] = deque()
        self._picked: tuple[tuple[int, int], Picked | None] | None = None

    def draw(self, request: Request, size: tuple[int, int], moving: bool) -> bool:
        """Draw a request, unless the picture already shows it; whether it did. size: pixels."""
        wanted = (
            request.pose, request.camera, request.backend, request.params, request.look, size,
            self.gpu.timers.enabled,
        )  # fmt: skip
        if wanted == self._drawn and time.monotonic() < self.better_at:
            return False
        self._drawn, self.request, self.problem, self.better_at = wanted, request, None, math.inf
        self._picked = None
        try:
            surface = self._surface_of(size)
            refinable = render_frame(self.renderer, request, surface, wait=False, moving=moving)
        except Scan4DError as problem:
            self.problem = problem
            return True
        drew = surface.stats.backend
        self._times.append(time.monotonic())
        if refinable:
            self.better_at = self._times[-1] + (0 if drew == request.backend else _PREPARED_LATER)
        log.debug("drew frame %d with %s, %dx%d pixels", request.pose.index, drew, *size)
        return True

    def _surface_of(self, size: tuple[int, int]) -> Surface:
        if self.surface is None or self.surface.size != size:
            if self.surface is not None:
                self.surface.release()
                self.surface = None
            self.surface = Surface(self.gpu, size)
        return self.surface

    @property
    def is_there(self) -> bool:
        """Whether there is a picture to show."""
        return self.surface is not None and self.request is not None and self.problem is None

    def present(self, left: int, bottom: int) -> None:
        """Copy it to the window. left, bottom: its corner, pixels from the window's lower left."""
        if self.surface is not None:
            self._presenter.present(self.surface, left, bottom)

    def pick(self, pixel: tuple[int, int]) -> Picked | None:
        """What a pixel shows, without its spacing; read from the GPU once for each place and picture."""
        if self.surface is None or not self.is_there:
            return None
        if self._picked is None or self._picked[0] != pixel:
            self._picked = pixel, pick(self.surface, *pixel, spacing=False)
        return self._picked[1]

    def clear(self) -> None:
        """Show nothing until the next request."""
        self._drawn = self.request = self.problem = self._bounded = self._picked = None
        self.better_at = math.inf

    def bounds(self, pose: Pose) -> Bounds:
        """The robust bounds of a pose, found once; also of one that is too large to draw."""
        if self._bounded is None or self._bounded[0] is not pose:
            self._bounded = pose, pose.cloud.bounds()
        return self._bounded[1]

    @property
    def rate(self) -> float:
        """Pictures drawn in the last second."""
        while self._times and self._times[0] < time.monotonic() - _RATE_SPAN:
            self._times.popleft()
        return len(self._times) / _RATE_SPAN

    def release(self) -> None:
        """Let go of everything on the GPU."""
        if self.surface is not None:
            self.surface.release()
        self._presenter.release()
        self.renderer.release()

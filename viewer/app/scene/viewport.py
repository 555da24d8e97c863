"""A viewport: a picture in the window, drawn anew only where another one is asked for."""

from __future__ import annotations

import logging
import math
import time
from collections import defaultdict, deque
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...analysis.pick import Picked, before_gap, pick
from ...backends import backends
from ...bounds import Bounds
from ...drawing.frame import bring, is_prepared, prepare, render_frame, reshade, supersample
from ...drawing.renderer import Renderer
from ...drawing.request import Request, colorable, fallback
from ...errors import Scan4DError
from ...look import SAMPLES
from ...output.labels import covered_cells
from ...picture.present import Presenter
from ...picture.soften import soften
from ...picture.surface import Surface
from ...scan.pose import Pose
from ...scan.times import frame_in_words
from ..failures import failure_in_words
from .detail import Budget, Detail
from .motion import Motion

log = logging.getLogger(__name__)
_RATE_SPAN = 1.0  # seconds over which pictures are counted
_PREPARED_LATER = 0.1  # seconds until drawing again may find what a worker prepares
_DIMMED = 0.3  # of the light of an image
_UPLOAD_MS = 20.0  # that one turn of the window's loop may spend on uploading a pose


class Viewport:
    """A rectangle of the window and the picture in it: what a camera sees of a pose.

    Several share a renderer, so that what they show of one pose is uploaded once; surfaces, motion and what
    is drawn meanwhile are each one's own.

    place: the rectangle: left, bottom, width, height, pixels from the window's lower left; the next picture
    is as large. request: what was drawn last, None before: pose, camera and how it is shown. problem: why it
    could not be drawn, None where it could; the image before stays then. size: of the picture, pixels. While
    it moves, a picture may be a preview, of fewer points and pixels and softened, which is drawn in full at
    rest, and then refined (see `refine`). surface: what the picture shows, smaller than `size` where it is a
    preview. number: of pictures drawn so far.
    shown_at: by the clock, when the last one was there.
    """

    def __init__(self, renderer: Renderer, place: tuple[int, int, int, int] = (0, 0, 1, 1)) -> None:
        self.renderer = renderer
        self.place = place
        self._presenter = Presenter(renderer.gpu)
        self.size = place[2:]
        self.number = 0
        self.shown_at = -math.inf
        self.surface: Surface | None = None
        self._surfaces: dict[str, Surface] = {}  # one in full, one for previews
        self._detail = Detail()  # that was drawn last
        self.request: Request | None = None
        self.problem: Scan4DError | None = None
        self._prepared_at = math.inf  # by the clock, when what is being prepared may be there
        self._is_rough = False  # whether it can be refined when it is at rest
        self._drawn: Any = None
        self._asked_for: Request | None = None  # the last one that was drawn as it says
        self._motion = Motion()
        self._budgets: dict[str, Budget] = {}  # by the backend's name
        self._simplifies: defaultdict[str, bool] = defaultdict(bool)  # whether it does in motion, the same
        self._bounded: tuple[Pose, Bounds] | None = None
        self._times: deque[float] = deque()
        self._picked: tuple[tuple[int, int], Picked | None] | None = None
        self._covered: tuple[int, NDArray[np.bool_]] | None = None  # by the number of the picture

    @property
    def aspect(self) -> float:
        """The rectangle's width / height."""
        return self.place[2] / self.place[3]

    def draw(self, request: Request, *, playing: bool = False, held: bool = False) -> bool:
        """Draw a request, unless the picture already shows it; whether it did.

        Nothing is waited for: while workers prepare what it needs, the picture before stays where it shows
        another pose, and plain points are drawn where there is none.

        playing: other poses will follow in time. held: the camera is dragged or turns.
        """
        size = self.place[2:]
        wanted = (
            request.pose, request.camera, request.backend, request.params, request.look, request.layers, size,
            self.renderer.gpu.timers.enabled,
        )  # fmt: skip
        now, before = time.monotonic(), self.surface
        if wanted != self._drawn:
            self._motion.change(now, playing or held)
        elif now < self.better_at(playing):
            return False
        try:
            if not bring(self.renderer, request, size, _UPLOAD_MS):
                later = 0.0 if self.renderer.preparing is None else _PREPARED_LATER
                self._prepared_at = now + later  # until then the picture before stays
                return False
            drawn = self._to_draw(request, size)
            is_there = drawn is request and is_prepared(self.renderer, request, size)
            if drawn is None or not (is_there or wanted != self._drawn or self.is_preview):
                self._prepared_at = now + _PREPARED_LATER  # the same again would be the same
                return False
            self._drawn, self.request, self._picked = wanted, request, None
            self._is_rough = False
            self.problem, self._prepared_at = None, math.inf
            if size != self.size:  # what was drawn for the other goes with whoever has it still
                self._surfaces.clear()
            self.size = size
            moving = playing or now < self._motion.ends
            full = self._surfaces.get("full")
            is_kept = full is not None and full.size == size and drawn is request
            if full is not None and is_kept and reshade(self.renderer, request, full):
                self._detail, self.surface = Detail(), full
                self._note_drawn(request, full, as_asked=True, refinable=False)
                return True
            self._detail = self._budget(request).detail if moving else Detail()
            self.surface = surface = self._surface_of(self._detail)
            share = self._detail.share
            refinable = render_frame(
                self.renderer, drawn, surface, wait=False, share=share, moving=moving, before=before
            )
            if self._detail.scale < 1:
                soften(surface)
        except Exception as error:  # whatever a scan brings, the window stays
            self._drawn, self.request, self.problem = wanted, request, _problem(request, error)
            self._is_rough = False
            self.surface, self._prepared_at = before if before in self._surfaces.values() else None, math.inf
            return True
        if moving:
            self._simplifies[surface.stats.backend] = surface.stats.simplified
        self._note_drawn(request, surface, drawn is request, refinable)
        return True

    def _to_draw(self, request: Request, size: tuple[int, int]) -> Request | None:
        """The request, where all is there but what its view alone needs. Else, for as long as workers are at
        it, the pose as the one before was drawn, or None where that needs work too and the picture before
        stays; plain points where there is none."""
        if is_prepared(self.renderer, request) or prepare(self.renderer, request, size):
            return request
        before = self._as_before(request)
        is_other = self.is_there and self.request is not None and self.request.pose is not request.pose
        return None if before is None and is_other else before or fallback(request)

    def _note_drawn(self, request: Request, surface: Surface, as_asked: bool, refinable: bool) -> None:
        drew, count = surface.stats.backend, request.pose.count - surface.stats.left_out
        as_asked &= drew == str(request.backend)
        if as_asked:
            self._asked_for = request
        now = self.shown_at = time.monotonic()
        self.number += 1
        self._times.append(now)
        self._motion.show(now)
        if not as_asked:
            self._prepared_at = now + _PREPARED_LATER
        elif refinable and not self.is_preview:
            self._prepared_at = now
        has_samples = SAMPLES[request.look.quality] > 1
        self._is_rough = has_samples and as_asked and not (refinable or self.is_preview)
        pixels = surface.size
        log.debug("drew frame %d with %s, %dx%d pixels, %d points", request.pose.index, drew, *pixels, count)

    def without_preparing(self, request: Request) -> Request:
        """A request to show instead, for which nothing has to be prepared: as before, or plain points."""
        return self._as_before(request) or fallback(request)

    def _as_before(self, request: Request) -> Request | None:
        """The request, drawn as the last one was that got what it asked for; None where that needs work."""
        if self._asked_for is None:
            return None
        before = replace(self._asked_for, pose=request.pose, camera=request.camera, layers=request.layers)
        before = colorable(before)
        return before if is_prepared(self.renderer, before, self.size) else None

    def refine(self) -> bool:
        """Draw one more sample of each pixel (see `frame.supersample`), or go on with one; whether the
        picture is another one then. Does nothing where `refines_at` says never."""
        surface, request = self.surface, self.request
        if not self._is_rough or surface is None or request is None:
            return False
        before = surface.stats.samples
        try:
            self._is_rough = supersample(self.renderer, request, surface, wait=False)
        except Scan4DError as error:  # as where memory is short; the picture is whole without
            self._is_rough = False
            log.debug("not refined: %s", error)
        self.renderer.gpu.ctx.finish()  # so that a turn of the window's loop takes no more than this
        return surface.stats.samples != before

    def refines_at(self, playing: bool) -> float:
        """The time by the clock from which `refine` may go on; infinite: never."""
        is_ready = self._is_rough and not playing and math.isinf(self.better_at(playing))
        return self._motion.ends if is_ready else math.inf

    def finish(self) -> None:
        """Draw the picture in full, where it is a preview."""
        if self.is_preview and self.request is not None:
            self._motion.end()
            self.draw(self.request)

    def rest(self) -> None:
        """Draw the next picture in full, however soon it comes."""
        self._motion.end()

    @property
    def is_preview(self) -> bool:
        """Whether points or pixels were left out to be in time, or it was drawn more simply in motion."""
        surface = self.surface if self.is_there else None
        if surface is None:
            return False
        return surface.stats.left_out > 0 or surface.stats.simplified or surface.size != self.size

    @property
    def is_complete(self) -> bool:
        """Whether drawing the same again would change nothing."""
        return self.request is not None and math.isinf(self.better_at(playing=False))

    @property
    def is_refined(self) -> bool:
        """Whether it is complete, and `refine` has nothing left to do."""
        return self.is_complete and not self._is_rough

    def better_at(self, playing: bool) -> float:
        """The time by the clock when drawing the same again may give a better picture; infinite: never."""
        rest = self._motion.ends if self.is_preview and not playing else math.inf
        return min(self._prepared_at, rest)

    def took(self, ms: float, goal_ms: float) -> None:
        """Say how long the window took to show what was drawn last, and how long it may take."""
        self._motion.show(time.monotonic())
        surface, request = self.surface, self.request
        if self.problem is not None or surface is None or request is None or "draw" in surface.stats.skipped:
            return
        is_typical = surface.stats.simplified or not self._simplifies[str(request.backend)]  # of motion
        if surface.stats.backend == str(request.backend) and is_typical:
            pixels = math.prod(self.size)
            self._budget(request).note(ms, self._detail, goal_ms, request.pose.count, pixels)

    def _budget(self, request: Request) -> Budget:
        name = str(request.backend)
        if name not in self._budgets:
            self._budgets[name] = Budget(name in backends() and backends()[name].accumulates)
        return self._budgets[name]

    def _surface_of(self, detail: Detail) -> Surface:
        """The surface for a detail; one in full and one for previews are kept."""
        width, height = (max(1, round(pixels * detail.scale)) for pixels in self.size)
        kind = "full" if detail.scale == 1 else "preview"
        surface = self._surfaces.get(kind)
        if surface is None or surface.size != (width, height):
            # The one before may be what the next picture goes on from: it goes with whoever has it still.
            surface = self._surfaces[kind] = Surface(self.renderer.gpu, (width, height))
        return surface

    @property
    def is_there(self) -> bool:
        """Whether there is a picture to show."""
        return self.surface is not None and self.request is not None and self.problem is None

    @property
    def is_visible(self) -> bool:
        """Whether there is an image to show: where the last request was not drawn, the one before."""
        return self.surface is not None

    @property
    def shows_another_scan(self) -> bool:
        """Whether nothing of the open scan was drawn yet, so that an image is of the one before."""
        return self.request is None

    def present(self, dimmed: bool = False) -> None:
        """Copy it to its place in the window. dimmed: as what is not what was asked for."""
        if self.surface is not None:
            light = _DIMMED if dimmed else 1.0
            self._presenter.present(self.surface, *self.place[:2], self.size, light)

    def pick(self, pixel: tuple[int, int]) -> Picked | None:
        """The place that a pixel shows, without its spacing, never through a gap (`before_gap`).

        Read from the GPU once for each place and picture.
        """
        if self.surface is None or not self.is_there:
            return None
        if self._picked is None or self._picked[0] != pixel:
            at = self.pixel_of_picture(pixel)
            meant = before_gap(self.surface, *at)
            self._picked = pixel, pick(self.surface, *at, shown=meant, spacing=False)
        return self._picked[1]

    def pixel_of_picture(self, pixel: tuple[int, int]) -> tuple[int, int]:
        """The pixel of the picture that shows the middle of one of the view, of which a preview has fewer."""
        if self.surface is None:
            return pixel
        (x, y), (width, height), (wide, high) = pixel, self.surface.size, self.size
        return math.floor((x + 0.5) * width / wide), math.floor((y + 0.5) * height / high)

    def shows_near(self, pixel: tuple[int, int], reach: int) -> bool:
        """Whether the picture shows something at most so many pixels of the view beside one of them, across
        or down."""
        if self.surface is None or not self.is_there:
            return False
        away = max(1, round(reach * self.surface.size[1] / self.size[1]))
        return bool(np.isfinite(self.surface.depth_around(*self.pixel_of_picture(pixel), away)).any())

    @property
    def covered(self) -> NDArray[np.bool_] | None:
        """The cells of the picture that show the subject (see `labels.covered_cells`), None without a
        picture.

        Read from the GPU once for each picture.
        """
        if self.surface is None or not self.is_there:
            return None
        if self._covered is None or self._covered[0] != self.number:
            self._covered = self.number, covered_cells(self.surface)
        return self._covered[1]

    @property
    def image(self) -> int | None:
        """The OpenGL texture that the picture was shown from last, its first row at 0; None before."""
        return self._presenter.image if self.is_visible else None

    def pick_in_full(self) -> Picked | None:
        """The last `pick` once more, in the picture in full; None where that was before another picture."""
        pixel = self._picked and self._picked[0]
        self.finish()
        return self.pick(pixel) if pixel else None

    def clear(self) -> None:
        """Forget what is shown, whose image stays until the next request is drawn."""
        self._drawn = self.request = self.problem = self._bounded = self._picked = self._asked_for = None
        self._prepared_at, self._is_rough = math.inf, False

    def bounds(self, pose: Pose) -> Bounds:
        """The robust bounds of a pose, unmoved, found once; also of one that is too large to draw."""
        if self._bounded is None or self._bounded[0] is not pose:
            self._bounded = pose, pose.bounds
        return self._bounded[1]

    @property
    def rate(self) -> float:
        """Pictures drawn in the last second."""
        while self._times and self._times[0] < time.monotonic() - _RATE_SPAN:
            self._times.popleft()
        return len(self._times) / _RATE_SPAN

    def release(self) -> None:
        """Let go of what is its own on the GPU."""
        for surface in self._surfaces.values():
            surface.release()
        self._presenter.release()


def _problem(request: Request, error: Exception) -> Scan4DError:
    """Why there is no picture, as users read it."""
    if isinstance(error, Scan4DError):
        return error
    problem = Scan4DError(failure_in_words(f"Drawing {frame_in_words(request.pose.index)}", error))
    problem.__cause__ = error
    return problem

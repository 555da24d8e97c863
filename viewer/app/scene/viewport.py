"""A viewport: a picture in the window, drawn anew only where another one is asked for."""

from __future__ import annotations

import logging
import math
import time
from collections import defaultdict, deque
from dataclasses import replace
from typing import Any

from ...bounds import Bounds
from ...drawing.frame import draw_plan, reshade, scaled_size, supersample
from ...drawing.jobs import Stage
from ...drawing.plan import Effort, Failed, Plan, Ready, Waiting, make_plan
from ...drawing.renderer import Renderer
from ...drawing.request import Request, colorable, fallback
from ...errors import Scan4DError, failure_in_words
from ...look import SAMPLES, rgba
from ...picture.present import Presenter
from ...picture.soften import soften
from ...picture.surface import Surface
from ...scan.pose import Pose
from ...scan.times import frame_in_words
from .detail import Budget, Detail
from .motion import Motion
from .probe import Probe

log = logging.getLogger(__name__)
_RATE_SPAN = 1.0  # seconds over which pictures are counted
_PREPARED_LATER = 0.1  # seconds until drawing again may find what a worker prepares
_DIMMED = 0.3  # of the light of an image
_UPLOAD_MS = 20.0  # that one turn of the window's loop may spend on uploading a pose


class Viewport:
    """A rectangle of the window and the picture in it: what a camera sees of a pose.

    Several share a renderer, so that what they show of one pose is uploaded once; surfaces, motion and what
    is drawn meanwhile are each one's own.

    rectangle: left, bottom, width, height, pixels from the window's lower left; the next picture
    is as large. request: what was drawn last, None before: pose, camera and how it is shown. problem: why it
    could not be drawn, None where it could; the image before stays then. size: of the picture, pixels. While
    it moves, a picture may be a preview, of fewer points and pixels and softened, which is drawn in full at
    rest, and then refined (see `refine`). surface: what the picture shows, smaller than `size` where it is a
    preview. number: of pictures drawn so far.
    shown_at: by the clock, when the last one was there.
    """

    def __init__(self, renderer: Renderer, rectangle: tuple[int, int, int, int] = (0, 0, 1, 1)) -> None:
        self.renderer = renderer
        self.rectangle = rectangle
        self._presenter = Presenter(renderer.gpu)
        self.size = rectangle[2:]
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
        self.probe = Probe(self)

    @property
    def aspect(self) -> float:
        """The rectangle's width / height."""
        return self.rectangle[2] / self.rectangle[3]

    def draw(self, request: Request, *, playing: bool = False, held: bool = False) -> bool:
        """Draw a request, unless the picture already shows it; whether it did.

        Nothing is waited for: while workers prepare what it needs, the picture before stays where it shows
        another pose, and plain points are drawn where there is none.

        playing: other poses will follow in time. held: the camera is dragged or turns.
        """
        size = self.rectangle[2:]
        wanted = (
            request.pose, request.camera, request.backend, request.params, request.look, request.layers, size,
            self.renderer.gpu.timers.enabled,
        )  # fmt: skip
        now, before, is_new = time.monotonic(), self.surface, wanted != self._drawn
        if is_new:
            self._motion.change(now, playing or held)
        elif now < self.better_at(playing):
            return False
        moving = playing or now < self._motion.ends
        detail = self._budget(request).detail if moving else Detail()
        try:
            asked = make_plan(
                self.renderer, request, scaled_size(size, detail.scale), Effort.BEGIN, _UPLOAD_MS
            )
            planned = self._drawable(asked)
            would_be_same = not (is_new or self.is_preview or isinstance(asked, Ready))
            if planned is None or would_be_same:
                is_uploading = isinstance(asked, Waiting) and asked.stage is Stage.UPLOAD
                self._prepared_at = now + (0.0 if is_uploading else _PREPARED_LATER)
                return False
            self._drawn, self.request = wanted, request
            self.probe.forget()
            self._is_rough = False
            self.problem, self._prepared_at = None, math.inf
            if size != self.size:  # what was drawn for the other goes with whoever has it still
                self._surfaces.clear()
            self.size = size
            self._draw_plan(planned, planned is asked, detail, moving)
        except Exception as error:  # whatever a scan brings, the window stays
            self._drawn, self.request, self.problem = wanted, request, _problem(request, error)
            self._is_rough = False
            self.surface, self._prepared_at = before if before in self._surfaces.values() else None, math.inf
        return True

    def _drawable(self, asked: Plan) -> Ready | Waiting | None:
        """The plan to draw now; None: the picture before stays.

        While workers prepare the pose, that is the pose drawn as the last one was. If that needs work too,
        the picture before stays if it shows another pose; else plain points stand in. Raises the error of a
        plan that failed.
        """
        if isinstance(asked, Failed):
            raise asked.error
        if isinstance(asked, Ready) or asked.stage is Stage.DERIVE_VIEW:
            return asked
        if asked.stage in (Stage.MERGE, Stage.UPLOAD):
            return None
        is_other = self.is_there and self.request is not None and self.request.pose is not asked.request.pose
        return self._as_before(asked.request, asked.size) or (None if is_other else asked)

    def _draw_plan(self, planned: Ready | Waiting, as_asked: bool, detail: Detail, moving: bool) -> None:
        """Draw a plan at a detail. as_asked: whether it is of the last request."""
        request, before, full = planned.request, self.surface, self._surfaces.get("full")
        ready = planned if as_asked and isinstance(planned, Ready) else None
        if ready is not None and full is not None and reshade(ready, full):
            self._detail, self.surface = Detail(), full
            self._note_drawn(request, full, as_asked=True, refinable=False)
            return
        self._detail, self.surface = detail, self._surface_of(detail)
        surface = self.surface
        refinable = draw_plan(planned, surface, share=detail.share, moving=moving, before=before)
        if detail.scale < 1:
            soften(surface)
        if moving:
            self._simplifies[surface.stats.backend] = surface.stats.simplified
        self._note_drawn(request, surface, ready is not None, refinable)

    def _note_drawn(self, request: Request, surface: Surface, as_asked: bool, refinable: bool) -> None:
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
        count, drew = request.pose.count - surface.stats.left_out, surface.stats.backend
        pixels = surface.size
        log.debug("drew frame %d with %s, %dx%d pixels, %d points", request.pose.index, drew, *pixels, count)

    def without_preparing(self, request: Request) -> Request:
        """A request to show instead, for which nothing has to be prepared: as before, or plain points."""
        before = self._as_before(request, self.size)
        return fallback(request) if before is None else before.request

    def _as_before(self, request: Request, size: tuple[int, int]) -> Ready | None:
        """The plan of the pose, drawn as the last one was that got what it asked for; None if that needs
        work."""
        if self._asked_for is None:
            return None
        before = replace(self._asked_for, pose=request.pose, camera=request.camera, layers=request.layers)
        found = make_plan(self.renderer, colorable(before), size, Effort.NONE)
        return found if isinstance(found, Ready) else None

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
        is_typical = surface.stats.simplified or not self._simplifies[request.backend.name]  # of motion
        if surface.stats.backend == request.backend.name and is_typical:
            pixels = math.prod(self.size)
            self._budget(request).note(ms, self._detail, goal_ms, request.pose.count, pixels)

    def _budget(self, request: Request) -> Budget:
        backend = request.backend
        if backend.name not in self._budgets:
            self._budgets[backend.name] = Budget(backend.accumulates)
        return self._budgets[backend.name]

    def _surface_of(self, detail: Detail) -> Surface:
        """The surface for a detail; one in full and one for previews are kept."""
        size = scaled_size(self.size, detail.scale)
        kind = "full" if detail.scale == 1 else "preview"
        surface = self._surfaces.get(kind)
        if surface is None or surface.size != size:
            # The one before may be what the next picture goes on from: it goes with whoever has it still.
            surface = self._surfaces[kind] = Surface(self.renderer.gpu, size)
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
        """Copy it to its rectangle of the window. dimmed: as what is not what was asked for."""
        if self.surface is not None:
            light = _DIMMED if dimmed else 1.0
            self._presenter.present(self.surface, *self.rectangle[:2], self.size, light)

    def present_nothing(self) -> None:
        """Fill its rectangle of the window with the background of the last picture, for an empty frame."""
        if self.request is not None:
            ctx = self.renderer.gpu.ctx
            ctx.screen.use()
            red, green, blue = (part / 255 for part in rgba(self.request.look.background)[:3])
            ctx.clear(red, green, blue, viewport=self.rectangle)

    @property
    def image(self) -> int | None:
        """The OpenGL texture that the picture was shown from last, its first row at 0; None before."""
        return self._presenter.image if self.is_visible else None

    def clear(self) -> None:
        """Forget what is shown, whose image stays until the next request is drawn."""
        self._drawn = self.request = self.problem = self._bounded = self._asked_for = None
        self.probe.forget()
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

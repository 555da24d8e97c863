"""The life of one frame."""

from __future__ import annotations

import math
import time
from collections.abc import Set
from dataclasses import replace
from functools import cache
from typing import Any

from ..camera import Camera
from ..gpu.context import Gpu
from ..gpu.pose import GpuPose
from ..look import SAMPLES, Look
from ..picture.frame_view import Before, FrameView
from ..picture.mean import PictureMean
from ..picture.shade import shade
from ..picture.stats import Stats
from ..picture.surface import Surface
from ..scan.layers import NO_LAYERS, Layers
from ..scan.pods import first_camera
from ..scan.points import PointCloud
from ..scan.pose import Pose
from ..view import View
from .plan import Effort, Failed, Ready, Waiting, make_plan
from .renderer import Renderer, shared_renderer
from .request import Request, backend_for, view_of

_BUDGET_MS = 15.0  # of a frame for what a backend can go on with in the next


def render_frame(
    renderer: Renderer,
    request: Request,
    surface: Surface,
    *,
    wait: bool = True,
    share: float = 1.0,
    moving: bool = False,
    before: Surface | None = None,
) -> bool:
    """Draw a request into `surface`; True if a later call would refine it.

    wait: whether to wait for estimated attributes and derived data. Without it, workers make them, plain
    points are drawn meanwhile, and a backend that finds its result bit by bit draws what it has. Other
    parameters: see `draw_plan`. Raises InputError for what the scan or the parameters do not allow.
    """
    planned = make_plan(renderer, request, surface.size, Effort.WAIT if wait else Effort.BEGIN)
    if isinstance(planned, Failed):
        surface.stats = Stats(backend=str(request.backend))
        raise planned.error
    budget_ms = None if wait else _BUDGET_MS
    return draw_plan(planned, surface, budget_ms=budget_ms, share=share, moving=moving, before=before)


def draw_plan(
    planned: Ready | Waiting,
    surface: Surface,
    *,
    budget_ms: float | None = _BUDGET_MS,
    share: float = 1.0,
    moving: bool = False,
    shift: tuple[float, float] = (0.0, 0.0),
    before: Surface | None = None,
) -> bool:
    """Draw a plan for a picture of the surface's size; True if a later call would refine it.

    While a plan waits, plain points are drawn. budget_ms: see `FrameView`. share: of the points to draw; a
    call with 1 refines a preview with less. moving: whether other pictures follow at once. shift: pixels
    right and down by which the picture is moved within its edges, at most half a pixel. before: the last
    picture, perhaps of another size or this surface itself. A moving picture of a share may go on from it,
    and then depends on it.
    """
    ready = planned if isinstance(planned, Ready) else planned.stand_in
    pose, request = ready.pose, ready.request
    backend, params = request.backend, request.params
    view = _view_of(ready, surface.size)
    if shift != view.shift:
        view = replace(view, shift=shift)
    pose.center(view.origin)
    asked = getattr(params, "share", None) or 1.0
    goes_on = _before(ready, before) if moving and asked == 1 else None
    last = before or surface
    coarsest = last.stats.coarseness if last.drawn else math.inf
    surface.start(pose, view, request.look, request.layers, backend.values, request.needs)
    stats = surface.stats
    stats.backend, stats.asked = backend.name, asked
    if planned is not ready:
        stats.skipped[planned.request.backend.name] = "Scan4D is still preparing data for this picture"
    drawn = {**_drawn(ready), "camera": view.key, "size": surface.size, "values": surface.values_key}
    changed = surface.take_changes(drawn)
    frame = FrameView(
        view, params, ready.derived, share * asked, budget_ms, changed, moving, goes_on, coarsest
    )
    refinable = backend.draw(pose, frame, surface)
    surface.drawn = drawn
    is_stand_in = planned is not ready
    surface.is_whole = not (refinable or is_stand_in or stats.simplified or stats.is_sample)
    shade(surface, request.look)
    _note_times(stats, {pose, surface.pose}, ready.start)
    return refinable or is_stand_in


def reshade(ready: Ready, surface: Surface) -> bool:
    """Shade the surface again in the plan's look if it shows everything else of the plan already; whether it
    did.

    Nothing is drawn or derived for it. `draw_plan` does the rest, a plan with the same look included.
    """
    request = ready.request
    if not surface.is_whole or request.look == surface.look:
        return False
    before, layers = surface.drawn, surface.layers
    wanted = {**_drawn(ready), "camera": _view_of(ready, surface.size).key, "size": surface.size}
    same_numbers = layers is request.layers or not (layers.scalars or request.layers.scalars)
    if any(before.get(name) != value for name, value in wanted.items()) or not same_numbers:
        return False
    if not surface.take_look(request.look):
        return False
    surface.drawn = {**before, "values": surface.values_key}
    shade(surface, request.look)
    stats = surface.stats
    stats.skipped["draw"] = "the visible surface is the same as in the last picture"
    stats.samples = 1
    _note_times(stats, {ready.pose}, ready.start)
    return True


def _view_of(ready: Ready, size: tuple[int, int]) -> View:
    """The plan's view, in a picture of this size, pixels."""
    is_same = ready.view is not None and ready.view.size == size
    return ready.view if is_same else view_of(ready.request, size)  # type: ignore[return-value]


def _drawn(ready: Ready) -> dict[str, object]:
    """The parts of `Surface.drawn` beside the view, by name."""
    return {"pose": ready.pose, "parameters": (ready.request.backend, ready.request.params)}


def _before(ready: Ready, surface: Surface | None) -> Before | None:
    """The picture before, if the backend can go on from it."""
    if surface is None or not ready.request.backend.accumulates:
        return None
    same = all(surface.drawn.get(name) == value for name, value in _drawn(ready).items())
    return Before(surface, surface.stats.known) if same else None


def _note_times(stats: Stats, poses: Set[GpuPose], start: float) -> None:
    """Note what a frame took, and what was uploaded and derived of its poses since their last pictures."""
    spent = [pose.take_spent() for pose in poses]
    stats.upload_ms = sum(each.upload_ms for each in spent)
    stats.derive_ms = sum(each.derive_ms for each in spent)
    stats.uploaded_bytes = sum(each.nbytes for each in spent)
    stats.shared = tuple(name for each in spent for name in each.shared)
    timers = next(iter(poses)).gpu.timers
    stats.frame_ms, stats.passes = timers.frame_ms(), timers.passes()
    stats.gpu_ms = sum(ms for _, ms in stats.passes)
    stats.cpu_ms = (time.perf_counter() - start) * 1e3


def supersample(renderer: Renderer, request: Request, surface: Surface, *, wait: bool = True) -> bool:
    """Draw one more sample of each pixel of the picture that `render_frame` has completed for this request;
    True until the picture is the mean of as many samples as the look's quality says.

    The samples are pictures of their own, shifted by less than a pixel, so they work with every backend.
    Edges become as smooth as the pixel is covered. Only `surface.picture` changes, after each four samples.
    Measurements, picks and exported numbers stay those of the pixels' middles. wait: see `render_frame`;
    without it, one sample may take several calls. Raises InputError like `render_frame`.
    """
    samples = SAMPLES[request.look.quality]
    if samples == 1:
        return False
    state = surface.cached(_Samples)
    if state.of is not surface.drawn:
        state.begin(surface)
    if state.mean.count < samples:
        look = request.look
        if surface.color_range is not None:
            look = replace(look, low=surface.color_range[0], high=surface.color_range[1])
        shift = sample_shifts(samples)[state.mean.count]
        effort = Effort.WAIT if wait else Effort.BEGIN
        planned = make_plan(renderer, replace(request, look=look), surface.size, effort)
        if isinstance(planned, Failed):
            raise planned.error
        if draw_plan(planned, state.sample, budget_ms=None if wait else _BUDGET_MS, shift=shift):
            return True
        state.mean.add(state.sample.picture)
        if state.mean.count % 4 == 1:
            state.mean.write(surface.take_picture())
            surface.stats.samples = state.mean.count
    return state.mean.count < samples


@cache
def sample_shifts(samples: int) -> tuple[tuple[float, float], ...]:
    """The shifts of 1, 5 or 17 samples of each pixel, pixels, the middle first: a square lattice, turned so
    that each has a column and a row of its own. The first one and each four that follow are centred."""
    step = math.isqrt(samples - 1)  # whose square is -1, modulo their number: a quarter turn
    firsts = {1: (), 5: (1,), 17: (2, 3, 6, 1)}[samples]
    turned = [0, *(first * step**turns % samples for first in firsts for turns in range(4))]

    def centered(number: int) -> float:
        return ((number + samples // 2) % samples - samples // 2) / samples

    return tuple((centered(number), centered(number * step)) for number in turned)


class _Samples:
    """Samples of a surface's pixels, kept with it. of: the `drawn` of the picture that they are of."""

    def __init__(self, gpu: Gpu, size: tuple[int, int]) -> None:
        self.sample = Surface(gpu, size)
        self.mean = PictureMean(gpu, size)
        self.of: dict[str, object] | None = None

    def begin(self, surface: Surface) -> None:
        """Begin with the picture that the surface has."""
        self.of = surface.drawn
        self.mean.clear()
        self.mean.add(surface.picture)

    @property
    def nbytes(self) -> int:
        """Bytes held on the GPU."""
        return self.sample.nbytes + self.mean.nbytes

    def release(self) -> None:
        """Delete what it holds on the GPU."""
        self.sample.release()
        self.mean.release()


def scaled_size(size: tuple[int, int], scale: float) -> tuple[int, int]:
    """The size, pixels, that a picture is drawn at on a scale of its width and height."""
    return max(1, round(size[0] * scale)), max(1, round(size[1] * scale))


def render(
    pose: Pose | PointCloud,
    camera: Camera | None,
    size: tuple[int, int],
    backend: str | None,
    look: Look | None,
    params: dict[str, Any],
    layers: Layers | None = None,
) -> Surface:
    """The work of `viewer.render`: one picture, on a headless context that later calls share."""
    if isinstance(pose, PointCloud):
        pose = Pose(0, 0.0, "points", pose)
    renderer, layers = shared_renderer(), layers or NO_LAYERS
    name, chosen = backend_for(pose, backend, params)
    views = pose.views if layers.world_from_pose.is_identity else ()
    bounds = layers.world_from_pose.bounds(pose.drawn_bounds())
    camera = camera or first_camera(views, bounds, size[0] / size[1], pose.upright)
    request = Request(pose, camera, name, chosen, look, layers)
    surface = Surface(renderer.gpu, size)
    while render_frame(renderer, request, surface):
        pass
    while supersample(renderer, request, surface):
        pass
    return surface

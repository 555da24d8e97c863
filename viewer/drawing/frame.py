"""The life of one frame."""

from __future__ import annotations

import math
import time
from collections.abc import Iterable
from dataclasses import replace
from functools import cache
from typing import Any

from ..backends import FrameView, missing_source
from ..backends import backend as find_backend
from ..camera import Camera
from ..gpu.context import Gpu
from ..gpu.pose import GpuPose
from ..look import SAMPLES, Look
from ..picture.frame_view import Before
from ..picture.mean import PictureMean
from ..picture.shade import shade
from ..picture.stats import Stats
from ..picture.surface import Surface
from ..scan.layers import NO_LAYERS, Layers
from ..scan.pods import first_camera
from ..scan.points import PointCloud
from ..scan.pose import Pose
from ..view import View
from .renderer import Renderer, Want
from .request import FALLBACK, Request, backend_for, colorable, fallback, view_of

_BUDGET_MS = 15.0  # of a frame for what a backend can go on with in the next


def render_frame(
    renderer: Renderer,
    request: Request,
    surface: Surface,
    *,
    wait: bool = True,
    share: float = 1.0,
    moving: bool = False,
    shift: tuple[float, float] = (0.0, 0.0),
    before: Surface | None = None,
) -> bool:
    """Draw what is asked for into `surface`; True if a later call would refine it.

    wait: whether to wait for estimated attributes and derived data; while they are made on
    a worker, plain points are drawn instead, and what a backend finds bit by bit is drawn as far as
    it is. share: of the points that need to be drawn; a preview with less than 1 is refined by a call
    with 1. moving: whether other pictures will follow at once. shift: pixels right and down by which the
    picture is moved within its edges, up to half of one. before: the picture before, perhaps of another size
    or this surface itself: while it moves, one of a share of the points may go on from what that one shows,
    so that it depends on it. Raises InputError for what the scan
    or the parameters do not allow.
    """
    start = time.perf_counter()
    timers = renderer.gpu.timers
    timers.start_frame()

    pose = renderer.resident(request.pose)
    request.layers.check(request.pose)
    backend, params = chosen = request.chosen
    view = view_of(request, surface.size)
    pose.center(view.origin)
    prepared = renderer.prepare(pose, backend, params, request.look, wait, view)
    look = request.look
    if prepared is None:
        plain = fallback(request)
        backend, params, look = find_backend(FALLBACK), plain.params, plain.look

    view = replace(view, shift=shift)
    goes_on = None
    asked = getattr(params, "share", None) or 1.0
    if moving and backend.accumulates and before is not None and asked == 1:
        drawn_as = before.drawn.get("pose"), before.drawn.get("parameters")
        goes_on = Before(before, before.stats.known) if drawn_as == (pose, (backend, params)) else None
    surface.start(pose, view, look, request.layers, backend.values, backend.needs(pose.pose, params))
    stats = surface.stats
    stats.backend, stats.asked = backend.name, asked
    if colorable(request) is not request:
        names = request.layers.names(pose.overview.scalars)
        raise missing_source(request.look.color_by, chosen[0], names)
    if prepared is None:
        stats.skipped[str(request.backend or "look")] = "Scan4D is still preparing what it needs"
    budget_ms = None if wait else _BUDGET_MS
    drawn = {
        "pose": pose,
        "camera": view.key,
        "parameters": (backend, params),
        "size": surface.size,
        "values": surface.values_key,
    }
    changed = surface.take_changes(drawn)
    share *= asked
    derived = prepared and prepared.derived
    frame = FrameView(view, params, derived, share, budget_ms, changed, moving, goes_on)
    refinable = backend.draw(pose, frame, surface)
    surface.drawn = drawn
    surface.is_whole = not (refinable or prepared is None or stats.simplified or stats.is_sample)
    shade(surface, look)

    _tell_uploads(stats, {pose, surface.pose})
    stats.derive_ms = pose.take_ms("derive")
    stats.passes = timers.passes()
    stats.gpu_ms = sum(ms for _, ms in stats.passes)
    stats.cpu_ms = (time.perf_counter() - start) * 1e3
    return refinable or prepared is None


def reshade(renderer: Renderer, request: Request, surface: Surface) -> bool:
    """Shade the surface anew where it shows the request already, in another look at most; whether it did.

    Nothing is drawn or derived for it. What it does not take up, the same look among it, `render_frame` does.
    """
    if not surface.is_whole or request.look == surface.look or colorable(request) is not request:
        return False
    start = time.perf_counter()
    pose, before, layers = renderer.resident(request.pose), surface.drawn, surface.layers
    wanted = {
        "pose": pose,
        "camera": view_of(request, surface.size).key,
        "parameters": request.chosen,
        "size": surface.size,
    }
    same_numbers = layers is request.layers or not (layers.scalars or request.layers.scalars)
    if any(before.get(name) != value for name, value in wanted.items()) or not same_numbers:
        return False
    if not surface.take_look(request.look):
        return False
    renderer.gpu.timers.start_frame()
    surface.drawn = {**before, "values": surface.values_key}
    shade(surface, request.look)
    stats = surface.stats
    stats.skipped["draw"] = "the visible surface is the same"
    stats.samples = 1
    _tell_uploads(stats, {pose})
    stats.derive_ms = 0.0
    stats.passes = renderer.gpu.timers.passes()
    stats.gpu_ms = sum(ms for _, ms in stats.passes)
    stats.cpu_ms = (time.perf_counter() - start) * 1e3
    return True


def _tell_uploads(stats: Stats, poses: Iterable[GpuPose]) -> None:
    """Count what was uploaded of poses since their last pictures."""
    stats.upload_ms = sum(pose.take_ms("upload") for pose in poses)
    uploaded = [pose.take_uploaded() for pose in poses]
    stats.uploaded_bytes = sum(each.nbytes for each in uploaded)
    stats.shared = tuple(name for each in uploaded for name in each.shared)


def supersample(renderer: Renderer, request: Request, surface: Surface, *, wait: bool = True) -> bool:
    """Draw one more sample of each pixel of the picture that `render_frame` has completed for this request;
    True until it shows the mean of as many as the look's quality says.

    The samples are pictures of their own, shifted by less than a pixel, so every backend does, and edges
    become smooth by how much of a pixel is covered. Only `surface.picture` changes, after each four; what
    is measured, picked or exported as numbers stays that of the middles of pixels. wait: see `render_frame`;
    without, it may take several calls to draw one.
    """
    samples = SAMPLES[request.look.quality]
    if samples == 1:
        return False
    state = surface.keep(_Samples)
    if state.of is not surface.drawn:
        state.begin(surface)
    if state.mean.count < samples:
        look = request.look
        if surface.color_range is not None:
            look = replace(look, low=surface.color_range[0], high=surface.color_range[1])
        shift = sample_shifts(samples)[state.mean.count]
        if render_frame(renderer, replace(request, look=look), state.sample, wait=wait, shift=shift):
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


def bring(renderer: Renderer, request: Request, size: tuple[int, int], budget_ms: float) -> bool:
    """Upload what the backend reads of the pose for a picture of this size, pixels, for as long as that;
    whether all of it is there. Points of range views are merged by a worker before.

    A window calls it again and again before `render_frame`, so that it is stopped by neither.
    """
    pose = renderer.resident(request.pose)
    backend, params = request.chosen
    if not backend.draws_samples(request.pose, params) and not renderer.merge(pose):
        return False
    pose.center(view_of(request, size).origin)
    return pose.upload(pose.names_of(backend.needs(request.pose, params)), budget_ms)


def is_prepared(renderer: Renderer, request: Request, size: tuple[int, int] | None = None) -> bool:
    """Whether nothing has to be merged, estimated or derived for a picture of this size, pixels; or what has
    to be cannot, which drawing it will tell. size: None leaves out what is derived for one view alone."""
    by_camera = size is not None and request.chosen.backend.derived_by_camera
    return renderer.is_prepared(_want(request, view_of(request, size) if by_camera and size else None))


def prepare(renderer: Renderer, request: Request, size: tuple[int, int]) -> bool:
    """Have workers make what a picture of this size needs, before anything else; whether it is there. Raises
    what that has failed with."""
    pose, (backend, params) = renderer.resident(request.pose), request.chosen
    view = view_of(request, size)
    return renderer.prepare(pose, backend, params, request.look, wait=False, view=view) is not None


def prepare_ahead(renderer: Renderer, requests: Iterable[Request], afresh: bool = False) -> None:
    """Have workers make what pictures of these will need, the first before others; all but what depends on
    the view. A window calls it again and again, see `Renderer.prepare_ahead`."""
    renderer.prepare_ahead((_want(request, None) for request in requests), afresh)


def _want(request: Request, view: View | None) -> Want:
    return Want(request.pose, *request.chosen, request.look, view)


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
    resident = renderer.resident(pose)
    name, chosen = backend_for(pose, backend, params)
    views = pose.views if layers.world_from_pose.is_identity else ()
    bounds = layers.world_from_pose.bounds(resident.bounds)
    request = Request(
        pose=pose,
        camera=camera or first_camera(views, bounds, size[0] / size[1], pose.upright),
        backend=name,
        params=chosen,
        look=look or Look(),
        layers=layers,
    )
    surface = Surface(renderer.gpu, size)
    while render_frame(renderer, request, surface):
        pass
    while supersample(renderer, request, surface):
        pass
    return surface


@cache
def shared_renderer() -> Renderer:
    """The headless renderer that `viewer.render` and the command line draw with."""
    return Renderer()

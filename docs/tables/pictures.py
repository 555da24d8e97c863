"""What scripts of tables share: where pages and data are, pictures, their errors, and what they take."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path

from viewer.backends import backend
from viewer.bench import metrics
from viewer.bench.judge import Judge
from viewer.bench.report.page import three_digits
from viewer.bench.scenes.subjects import Subject
from viewer.bench.scenes.viewpoints import viewpoints
from viewer.camera import Camera
from viewer.drawing.frame import render_frame
from viewer.drawing.renderer import Renderer
from viewer.drawing.request import Request
from viewer.look import Look
from viewer.picture.surface import Surface
from viewer.scan.pose import Pose

DOCS = Path(__file__).resolve().parents[1]
DATA = DOCS.parents[1] / "shared" / "data"
SHADING = Look(light="head", color_by="plain")
Size = tuple[int, int]


@cache
def renderer() -> Renderer:
    """The one that all pictures are drawn by."""
    return Renderer()


def draw(request: Request, surface: Surface, *, moving: bool = False) -> None:
    """Draw until nothing is left to refine."""
    while render_frame(renderer(), request, surface, moving=moving):
        pass


def drawn(request: Request, size: Size) -> Surface:
    """One finished picture."""
    surface = Surface(renderer().gpu, size)
    draw(request, surface)
    return surface


def request(
    pose: Pose, camera: Camera, drawn_by: str, params: Mapping[str, object], look: Look = SHADING
) -> Request:
    """A picture to draw. params: by name; the others are the backend's defaults."""
    return Request(pose, camera, drawn_by, backend(drawn_by).params(params), look)


def processor_ms(work: Callable[[], object]) -> float:
    """Processor time that all threads take until it is done, the driver's included."""
    renderer().gpu.ctx.finish()
    start = time.process_time()
    work()
    renderer().gpu.ctx.finish()
    return 1e3 * (time.process_time() - start)


def errors_of(
    subject: Subject, drawn_by: str, settings: Sequence[Mapping[str, object]], views: int, size: Size
) -> list[metrics.Errors]:
    """Errors of a subject's first moment with each of some parameters, means over views all round."""
    moment = subject.moment(0)
    told: list[list[metrics.Errors]] = [[] for _ in settings]
    for camera in viewpoints(moment.mesh, views, size, up=subject.up):
        gpu, cloud = renderer().gpu, moment.pose.cloud
        judge = Judge.of(gpu, moment.truth, camera, size, SHADING, cloud, subject.tolerance)
        for errors, params in zip(told, settings, strict=True):
            errors.append(judge.errors(drawn(request(moment.pose, camera, drawn_by, params), size)))
    return [metrics.aggregate({name: [e[name] for e in errors] for name in errors[0]}) for errors in told]


def error_cells(errors: metrics.Errors) -> list[str]:
    """What is open (empty, or a farther sheet is seen), wrong layer, spill, normals and PSNR."""
    open_percent = errors["hole_percent"] + errors["through_percent"]
    shares = (open_percent, errors["wrong_layer_percent"], errors["spill_percent"])
    return [
        *(f"{three_digits(share)} %" for share in shares),
        f"{errors['normal_median']:.1f}°",
        f"{errors['psnr']:.1f} dB",
    ]


ERROR_NAMES = ("open", "wrong layer", "spill", "normals", "PSNR")

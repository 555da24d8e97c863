"""Pictures that experiments draw outside of suites: one renderer, finished pictures and their errors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache

from experiments.tables import Row
from viewer.backends import backend
from viewer.bench import metrics
from viewer.bench.judge import Judge
from viewer.bench.report.page import three_digits
from viewer.bench.scenes import catalog
from viewer.bench.scenes.subjects import Subject
from viewer.bench.scenes.viewpoints import viewpoints
from viewer.camera import Camera
from viewer.commands._measuring import data_folder
from viewer.drawing.frame import render_frame
from viewer.drawing.renderer import Renderer
from viewer.drawing.request import Request
from viewer.look import Look
from viewer.picture.surface import Surface
from viewer.scan.pose import Pose

SHADING = Look(light="head", color_by="plain")
Size = tuple[int, int]


@cache
def renderer() -> Renderer:
    """The one that draws all pictures."""
    return Renderer(budget_bytes=4 << 30)


def scene(name: str, count: int | None = None) -> Subject:
    """A scene of the benchmark. Raises InputError."""
    return catalog.subject(name, data_folder(), count=count)


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


def errors_of(
    subject: Subject, drawn_by: str, settings: Sequence[Mapping[str, object]], views: int, size: Size
) -> list[metrics.Errors]:
    """Errors of a subject's first moment with each of some parameters, means over views all round."""
    moment = subject.moment(0)
    found: list[list[metrics.Errors]] = [[] for _ in settings]
    for camera in viewpoints(moment.mesh, views, size, up=subject.up):
        gpu, cloud = renderer().gpu, moment.pose.cloud
        judge = Judge.of(gpu, moment.truth, camera, size, SHADING, cloud, subject.tolerance)
        for errors, params in zip(found, settings, strict=True):
            errors.append(judge.errors(drawn(request(moment.pose, camera, drawn_by, params), size)))
    return [metrics.aggregate({name: [e[name] for e in errors] for name in errors[0]}) for errors in found]


def error_cells(errors: metrics.Errors, prefix: str = "") -> Row:
    """The cells of errors, below titles with a prefix. Open: empty, or a farther sheet is seen."""
    shares = {
        "open": errors["hole_percent"] + errors["through_percent"],
        "wrong layer": errors["wrong_layer_percent"],
        "spill": errors["spill_percent"],
    }
    return {
        **{f"{prefix}{name}": f"{three_digits(share)} %" for name, share in shares.items()},
        f"{prefix}normals": f"{errors['normal_median']:.1f}°",
        f"{prefix}PSNR": f"{errors['psnr']:.1f} dB",
    }

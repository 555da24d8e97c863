"""Code words measured: time beside other renderers, pixels beside surfels of the same radii, tables.

The paper's model, a bone of 25,816 elements, is not to be had: scenes are surfaces with as many. Processor
time is of all threads, the driver's included: what the work takes where OpenGL is software; wall time counts
where it is a card. They take turns, from a camera that moves between pictures.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import cycle
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.suite import row_of, subjects
from experiments.tables import Row
from experiments.timing import by_turns
from viewer.backends import backend
from viewer.bench.run import LOOK, Bench
from viewer.bench.truth.surface import reference_surface
from viewer.camera import PROJECTIONS, Camera
from viewer.codewords.engine import CodePicture, draw_words
from viewer.codewords.stream import WordStream
from viewer.codewords.tables import PAPER, Steps, shape_table
from viewer.drawing.frame import render_frame
from viewer.drawing.request import Request, view_of
from viewer.drawing.timing import draw
from viewer.gpu.constants import NOTHING
from viewer.mesh.reference import Reference, trace
from viewer.picture.surface import Surface
from viewer.scan import code_words as words
from viewer.scan.pose import Pose
from viewer.srgb import bytes_from_light, light_from_bytes

SCENES = ("torus", "horse", "armadillo")
TRUTH_SCENES = ("torus", "bunny", "horse", "armadillo")
COUNT = 25_816  # elements of the paper's bone, Fig. 6
QUALITIES = ("table", "planes", "exact")
TRUTH_SIZE = (320, 240)
_TRUE_SAMPLES = 4  # along the edge of a pixel
SIZES = ((640, 480), (1024, 768))
BACKEND = "codeword"
WITHOUT_GL = "without OpenGL"
_SEEN_FROM = (30.0, 20.0)  # degrees
_STEP = 0.5  # degrees from one picture to the next
_TABLES = {"paper": PAPER, "finer": Steps(sizes=65, size_parts=8, normals=121, normal_parts=10)}


@dataclass(frozen=True)
class Drawing:
    """How a picture is drawn. backend: its name; empty: code words on the CPU alone. params: of the
    backend."""

    name: str
    backend: str
    params: dict[str, Any]


_ONE_PASS = {"passes": "one", "surface": "nearest"}
DRAWINGS = (
    Drawing("codeword", BACKEND, {}),
    Drawing("codeword, lighting own", BACKEND, {"lighting": "own"}),
    Drawing("codeword, exact", BACKEND, {"quality": "exact"}),
    Drawing(WITHOUT_GL, "", {}),
    Drawing(f"{WITHOUT_GL}, exact", "", {"quality": "exact"}),
    Drawing("surfels, one pass", "surfels", {**_ONE_PASS, "radius": "own", "epsilon": 0.0}),
    Drawing("points", "points", {}),
)


def measure_times(
    bench: Bench, scenes: Sequence[str] = SCENES, count: int = COUNT, sizes: Sequence[tuple[int, int]] = SIZES
) -> Iterator[Row]:
    """Yield a row for each scene and picture size: medians of processor and wall time a picture, ms."""
    for subject in subjects(bench, scenes, count):
        pose = subject.moment(0).pose
        for size in sizes:
            surface, camera = Surface(bench.renderer.gpu, size), _camera(pose, size, subject.up)
            cameras = [camera, camera.orbited(_STEP, 0)]

            def drawn(
                drawing: Drawing, camera: Iterator[Camera], pose: Pose = pose, surface: Surface = surface
            ) -> None:
                _draw(bench, drawing, pose, next(camera), surface)

            works = {drawing.name: partial(drawn, drawing, cycle(cameras)) for drawing in DRAWINGS}
            taken = by_turns(works, bench.settings.repeat, warm=2)
            surface.release()
            yield {
                **row_of(bench, scene=subject.name, n=pose.count, size=list(size)),
                "busy_ms": {name: each.busy for name, each in taken.items()},
                "wall_ms": {name: each.wall for name, each in taken.items()},
            }


def measure_pixels(
    bench: Bench, scenes: Sequence[str] = SCENES, count: int = COUNT, size: tuple[int, int] = SIZES[0]
) -> Iterator[Row]:
    """Yield a row for each scene, projection and quality: how code words differ from surfels in one pass
    without blending, with the same radii."""
    surfels = next(drawing for drawing in DRAWINGS if drawing.backend == "surfels")
    for subject in subjects(bench, scenes, count):
        pose = subject.moment(0).pose
        for projection in PROJECTIONS:
            camera = _camera(pose, size, subject.up, projection)
            discs = _surface(bench, surfels.backend, surfels.params, pose, camera, size)
            stream = words.words_of(pose, discs.view, LOOK, words.Params())
            for quality in QUALITIES:
                drawn = _surface(bench, BACKEND, {"quality": quality}, pose, camera, size)
                yield {
                    **row_of(bench, scene=subject.name, n=pose.count, size=list(size)),
                    "projection": projection,
                    "quality": quality,
                    **pixel_errors(drawn, discs, pose),
                    "nearest": nearest_to_a_step(drawn, discs, stream),
                }
                drawn.release()
            discs.release()


def pixel_errors(drawn: Surface, discs: Surface, pose: Pose) -> dict[str, float]:
    """Differences of a picture from that of discs.

    ids, covered: percent of the pixels that either covers. depth: largest difference where both show one
    point, of the scan's radius. normal: median angle where both show any, degrees.
    """
    ids, others = drawn.id, discs.id
    either, both = (ids != NOTHING) | (others != NOTHING), (ids != NOTHING) & (others != NOTHING)
    same = both & (ids == others)
    off = np.abs(drawn.depth[same] - discs.depth[same])
    cosines = np.einsum("...i,...i", drawn.normal[both], discs.normal[both])
    return {
        "ids": round(100 * float((ids != others)[either].mean()), 3),
        "covered": round(100 * float(1 - both[either].mean()), 3),
        "depth": float(f"{off.max(initial=0) / pose.bounds.radius:.2g}"),
        "normal": round(float(np.degrees(np.arccos(np.clip(np.median(cosines), -1, 1)))), 2),
    }


def nearest_to_a_step(drawn: Surface, discs: Surface, stream: WordStream) -> float:
    """Percent of the pixels that both cover whose point is the nearest up to a step of Z: its disc, where the
    pixel's ray meets the plane, is no more than that before or behind the nearest of all discs. stream: whose
    Z."""
    both, view, cloud = (drawn.row != NOTHING) & (discs.row != NOTHING), drawn.view, drawn.pose.cloud
    pixels, rows = np.argwhere(both)[:, ::-1] + 0.5, drawn.row[both]
    starts, ends = (view.unproject(pixels, np.full(len(pixels), depth)) for depth in (1.0, 2.0))
    assert cloud.normals is not None
    normals = cloud.normals[rows].astype(np.float64)
    points = cloud.positions[rows] + (cloud.origin - view.origin)
    with np.errstate(divide="ignore", invalid="ignore"):  # of planes seen edge on, which are not near
        met = 1 + np.vecdot(points - starts, normals) / np.vecdot(ends - starts, normals)
        steps = stream.steps_of(met + view.base) - stream.steps_of(discs.depth[both])
    return round(100 * float((np.abs(steps) <= 1).mean()), 2)


def measure_truth(
    bench: Bench, scenes: Sequence[str] = TRUTH_SCENES, count: int = COUNT, size: tuple[int, int] = TRUTH_SIZE
) -> Iterator[Row]:
    """Yield a row for each scene, quality and number of samples: errors of pictures without OpenGL against
    the ray-traced surface, whose pixels are means of `_TRUE_SAMPLES` squared samples."""
    for subject in subjects(bench, scenes, count):
        moment = subject.moment(0)
        camera = _camera(moment.pose, size, subject.up)
        fine = (size[0] * _TRUE_SAMPLES, size[1] * _TRUE_SAMPLES)
        reference = trace(moment.truth, camera, fine)
        surface = reference_surface(reference, bench.renderer.gpu, LOOK)
        light = _means(light_from_bytes(surface.image()[..., :3]).astype(np.float64))
        true = bytes_from_light(light).astype(np.float64)
        covered = _means(reference.covered[..., None].astype(np.float64))[..., 0]
        surface.release()
        view = view_of(Request(moment.pose, camera), size)
        for quality in QUALITIES:
            for samples in (1, 2, 4):
                params = words.Params(quality=quality)
                stream = words.words_of(moment.pose, view, LOOK, params, samples=samples)
                picture = draw_words(stream)
                squares = np.square(picture.image[..., :3] - true).mean(axis=2)
                yield {
                    **row_of(bench, scene=subject.name, n=moment.pose.count, size=list(size)),
                    "quality": quality,
                    "samples": samples**2,
                    "psnr": _psnr(squares[covered > 0]),
                    "psnr_edges": _psnr(squares[(covered > 0) & (covered < 1)]),
                    "normal": _normal_error(picture, reference, moment.pose),
                }


def _means(samples: NDArray[np.float64]) -> NDArray[np.float64]:
    """The means of the samples of each pixel, (H, W, C)."""
    height, width, channels = samples.shape
    parts = samples.reshape(height // _TRUE_SAMPLES, _TRUE_SAMPLES, width // _TRUE_SAMPLES, -1, channels)
    return parts.mean(axis=(1, 3))


def _psnr(squares: NDArray[np.float64]) -> float:
    return round(float(10 * np.log10(255**2 / squares.mean())), 2)


def _normal_error(picture: CodePicture, reference: Reference, pose: Pose) -> float:
    """Median angle between the normals of the shown points and those of the surface, degrees."""
    middle = slice(_TRUE_SAMPLES // 2, None, _TRUE_SAMPLES)
    true, is_true = reference.normal[middle, middle], reference.covered[middle, middle]
    both = picture.covered & is_true
    assert pose.cloud.normals is not None
    shown = pose.cloud.normals[picture.ids()[both]]
    cosines = np.abs(np.vecdot(shown, true[both])).clip(0, 1)
    return round(float(np.degrees(np.arccos(np.median(cosines)))), 2)


def measure_tables(bench: Bench, scenes: Sequence[str] = ()) -> Iterator[Row]:
    """Yield a row for each set of steps: how long its table takes, and bytes of it and of bitmaps. scenes:
    any, tables are of none."""
    for name, steps in _TABLES.items():
        table = shape_table(steps)
        made = partial(shape_table.__wrapped__, steps)  # past the cache
        taken = by_turns({"table": made}, max(bench.settings.repeat, 1), warm=0)["table"]
        yield {
            "steps": name,
            "sizes": steps.sizes,
            "normals": steps.normals,
            "busy_ms": {"table": taken.busy},
            "nbytes": table.nbytes,
            "bitmap_bytes": table.bitmap_bytes,
            **bench.where(),
        }


def _camera(pose: Pose, size: tuple[int, int], up: str, projection: str = "perspective") -> Camera:
    return Camera.orbit(pose.bounds, *_SEEN_FROM, aspect=size[0] / size[1], up=up, projection=projection)


def _draw(bench: Bench, drawing: Drawing, pose: Pose, camera: Camera, surface: Surface) -> None:
    """A picture, ready to be looked at."""
    if drawing.backend:
        params = backend(drawing.backend).params(drawing.params)
        draw(bench.renderer, Request(pose, camera, drawing.backend, params, LOOK), surface)
        bench.renderer.gpu.ctx.finish()
    else:
        view = view_of(Request(pose, camera), surface.size)
        draw_words(words.words_of(pose, view, LOOK, words.Params(**drawing.params)))


def _surface(
    bench: Bench, name: str, params: dict[str, Any], pose: Pose, camera: Camera, size: tuple[int, int]
) -> Surface:
    surface = Surface(bench.renderer.gpu, size)
    render_frame(bench.renderer, Request(pose, camera, name, backend(name).params(params), LOOK), surface)
    return surface

"""Random views, drawn with each configuration that the automatic choice knows, and the model fitted to them.

`measure_ways` measures the time and error of each configuration. `laws_of` fits a model to such rows.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..camera import Camera
from ..choice.configurations import SCALES, Configuration, configurations
from ..choice.model import CAP, Law, Measured, fit
from ..choice.seen import ScanInView
from ..drawing.frame import scaled_size
from ..drawing.request import Request, view_of
from ..drawing.timing import draw, undisturbed_ms
from ..errors import InputError
from ..look import Look
from ..mesh.reference import first_hits
from ..mesh.scene import Scene
from ..picture.surface import Surface
from .plan import Group
from .report.results import Row
from .run import Bench, undisturbed
from .scenes.subjects import Moment, Subject
from .scenes.viewpoints import viewpoints

# With normals, bare, uneven, noisy, thin, large, moving, and range views.
SCENES = (
    "sphere", "torus", "box", "demo", "bunny", "armadillo", "horse", "dragon-100k", "igea", "dragon",
    "horse-gallop", "owlii", "armadillo-ramp", "sheets", "bunny-bare", "igea-bare", "horse-noise-0.5",
    "bunny-ramp-bare", "sheets-bare", "bunny-scans", "torus-simulated",
)  # fmt: skip
_LOOKED_AT = 20_000  # pixels of a picture whose errors are found
_CLOSEST = 8.0  # times as large as a picture of the whole
_CLOSER = 3  # of so many views one looks closely
_SIZES = (1.0, 2 / 3, 0.5)  # of width and height of the largest pictures, by turns


@dataclass(frozen=True, eq=False)
class Truth:
    """Depths that some pixels of a picture truly see. pixels: (N, 2) int, from the left and the top. depth:
    (N,), +inf where nothing is. footprint: (N,), of a pixel there, scan units."""

    pixels: NDArray[np.intp]
    depth: NDArray[np.float64]
    footprint: NDArray[np.float64]

    @classmethod
    def of(cls, scene: Scene, camera: Camera, size: tuple[int, int], seed: int = 0) -> Truth:
        """The truth at pixels chosen by chance."""
        rng = np.random.default_rng(seed)
        pixels = np.stack([rng.integers(edge, size=_LOOKED_AT) for edge in size], axis=1)
        hits = first_hits(scene, camera, size, pixels + 0.5)
        depth = -((hits - np.array(camera.eye)) @ camera.rotation()[2])
        pixel = camera.view_height / size[1]
        perspective = camera.projection == "perspective"
        footprint = pixel * depth / camera.distance if perspective else np.full(len(depth), pixel)
        return cls(pixels, np.where(np.isfinite(depth), depth, np.inf), footprint)

    def error(self, surface: Surface) -> float:
        """How far off what a surface shows is, pixels: see docs/guide/automatic.md."""
        few, many = np.array(surface.size), np.array(surface.shown)
        nearest = (2 * self.pixels + 1) * few // (2 * many)
        aside = np.linalg.norm((nearest + 0.5) * many / few - (self.pixels + 0.5), axis=1)
        drawn = surface.depth[nearest[:, 1], nearest[:, 0]].astype(np.float64)
        is_drawn, is_there = np.isfinite(drawn), np.isfinite(self.depth)
        off = np.full(len(drawn), CAP)
        both = is_drawn & is_there
        away = (drawn[both] - self.depth[both]) / self.footprint[both]
        off[both] = np.minimum(np.hypot(away, aside[both]), CAP)
        seen = is_drawn | is_there
        return float(off[seen].mean()) if seen.any() else 0.0


def measure_ways(bench: Bench, scenes: Sequence[str] = SCENES) -> Iterator[Row]:
    """Yield a row for each view and each configuration. scenes: names, or files of meshes; what cannot be
    had is noted and left out."""
    settings = bench.settings
    for scene in scenes:
        try:
            subject = bench.subject(Group(scene, ()))
            frames = list(_frames(bench, subject))
        except InputError as error:
            bench.note(f"the benchmark leaves out {scene}: {error}")
            continue
        for view, (moment, camera) in enumerate(frames):
            size = scaled_size(settings.size, _SIZES[view % len(_SIZES)])
            for row in _measured(bench, moment, camera, size):
                yield {
                    "scene": subject.name,
                    "view": view,
                    **row,
                    "size": list(size),
                    "views": settings.views,
                    "repeat": settings.repeat,
                    "seed": settings.seed,
                    **bench.where(),
                }


def _frames(bench: Bench, subject: Subject) -> Iterator[tuple[Moment, Camera]]:
    """Views by chance: all round, covering a quarter to most of the picture, and some closely, through a
    longer lens."""
    settings, moment = bench.settings, subject.moment(0)
    cameras = viewpoints(moment.mesh, settings.views, settings.size, up=subject.up, seed=settings.seed)
    rng = np.random.default_rng(settings.seed)
    for camera in cameras:
        zoom = _CLOSEST ** rng.random()
        if rng.random() < 1 / _CLOSER:
            tangent = np.tan(np.radians(camera.fov_y) / 2) / zoom
            camera = replace(camera, fov_y=float(np.degrees(2 * np.arctan(tangent))))
        yield moment, camera


def _measured(bench: Bench, moment: Moment, camera: Camera, size: tuple[int, int]) -> Iterator[Row]:
    """The part of a row that each configuration has."""
    renderer, pose = bench.renderer, moment.pose
    truth = Truth.of(moment.truth, camera, size, bench.settings.seed)
    seen = ScanInView.of(pose, view_of(Request(pose, camera), size))
    for scale in SCALES:
        surface = Surface(renderer.gpu, scaled_size(size, scale), size)
        for one in configurations(pose, (scale,)):
            request = Request(pose, camera, one.backend, one.params, Look(quality="fast"))
            with undisturbed():
                if scale == SCALES[0]:
                    draw(renderer, request, surface)  # what is prepared at the first one, no number holds
                ms = undisturbed_ms(renderer, request, surface, bench.settings.repeat)
            yield {
                "key": one.key, "backend": one.backend, "values": dict(one.values), "scale": scale,
                "ms": round(ms, 3), "error": round(truth.error(surface), 5), "seen": asdict(seen),
            }  # fmt: skip
        surface.release()


def measured_of(row: Row) -> Measured:
    """Picture that a row tells of, as models are fitted to it."""
    seen = ScanInView(**row["seen"]).of_share(configuration_of(row).share)
    return Measured(seen, row["scale"], row["ms"], row["error"])


def configuration_of(row: Row) -> Configuration:
    """The configuration of a row."""
    return Configuration(row["backend"], row["values"], row["scale"])


def laws_of(rows: Sequence[Row]) -> dict[str, Law]:
    """A law for each configuration in rows, whatever its scale. Raises InputError where there is none."""
    if not rows:
        raise InputError(
            "the results contain no measured pictures, which Scan4D needs to predict drawing times"
        )
    by_key: dict[str, list[Any]] = {}
    for row in rows:
        by_key.setdefault(row["key"], []).append(measured_of(row))
    return {key: fit(some) for key, some in sorted(by_key.items())}

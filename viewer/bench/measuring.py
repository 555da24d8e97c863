"""Distances between pixels chosen by chance, against what is truly there: how often ± holds the truth.

Pixels are picked as a click would. What was meant is somewhere in the pixel: a place in it is chosen by
chance too, and the truth is what a ray through that place meets.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..analysis.measures.distances import distance_of
from ..analysis.pick import SURE, before_gap, pick
from ..analysis.spot import Spot
from ..backends import backend
from ..camera import Camera
from ..drawing.frame import render_frame
from ..drawing.renderer import Renderer
from ..drawing.request import Request
from ..errors import InputError
from ..geometry import vector
from ..mesh.reference import first_hits, trace
from ..mesh.scene import Scene
from ..picture.surface import Surface
from ..scan.pose import Pose
from .plan import Group
from .report import measurement
from .report.measurement import markdown_table, write_measurement
from .report.page import three_digits
from .report.results import DISTANCES, Row, read_rows
from .run import Bench

NAME, PAGE = "measuring", "measuring.md"
SCENES = ("bunny", "armadillo", "horse", "igea", "dragon-100k")
COUNT = 300_000  # points of each, spread by chance
ZOOMS = (1.0, 4.0, 16.0)  # of a picture of the whole
# As scans open with them: points by themselves are squares that touch.
DRAWN: dict[str, dict[str, Any]] = {
    "points": {"point_size": 0}, "surfels": {}, "voxels": {}, "auto_splats": {},
}  # fmt: skip
PAIRS = 400  # of each scene, renderer and zoom: of 95 % come out 92.9 to 97.1, in 95 % of cases
_SMALL = (80, 60)  # pixels of the picture in which a place to look at is chosen
_ELEVATIONS = (-30.0, 50.0)  # degrees


@dataclass(frozen=True, eq=False)
class Distances:
    """Distances that were measured. off: (n,), by how much, scan units. uncertainty: (n,), what ± said, NaN
    where it said nothing. pitch: distance between points, pixels."""

    off: NDArray[np.float64]
    uncertainty: NDArray[np.float64]
    pitch: float

    def with_others(self, other: Distances) -> Distances:
        """The distances and others, as of one picture."""
        return Distances(
            np.append(self.off, other.off), np.append(self.uncertainty, other.uncertainty), self.pitch
        )

    @property
    def covered(self) -> float:
        """The share that ± holds, of those of which it says something; percent."""
        told = np.isfinite(self.uncertainty)
        return 100.0 * float(np.mean(np.abs(self.off[told]) <= self.uncertainty[told]))


def measure_distances(bench: Bench, scenes: Sequence[str] = SCENES) -> Iterator[Row]:
    """Yield a row for each scene, zoom and renderer. scenes: names, or files of meshes; what cannot be had is
    noted and left out."""
    settings = bench.settings
    for scene in scenes:
        try:
            subject = bench.subject(Group(scene, (), count=COUNT))
            moment = subject.moment(0)
        except InputError as error:
            bench.note(f"{scene} is left out: {error}")
            continue
        for zoom in ZOOMS:
            cameras = zoomed(moment.truth, zoom, settings.views, settings.size, subject.up, settings.seed)
            for name, values in DRAWN.items():
                found = measured_in(
                    bench.renderer, moment.pose, moment.truth, cameras, settings.size, name, values
                )
                yield {
                    "scene": subject.name,
                    "n": moment.pose.count,
                    "backend": name,
                    "params": values,
                    "zoom": zoom,
                    "pitch": round(found.pitch, 3),
                    "pairs": len(found.off),
                    "untold": int(np.count_nonzero(np.isnan(found.uncertainty))),
                    "covered": round(found.covered, 2),
                    "uncertainty": round(float(np.nanmedian(found.uncertainty)) / moment.pose.spacing, 4),
                    "views": settings.views,
                    "size": list(settings.size),
                    "repeat": settings.repeat,
                    "seed": settings.seed,
                    **bench.where(),
                }


def zoomed(
    scene: Scene, zoom: float, count: int, size: tuple[int, int], up: str = "+y", seed: int = 0
) -> list[Camera]:
    """Cameras from directions by chance, each at a place that is seen, through a lens that shows so much less
    than the whole. size: (width, height), pixels."""
    rng = np.random.default_rng(seed)
    cameras = []
    for _ in range(count):
        camera = Camera.orbit(
            scene.bounds,
            float(rng.uniform(0, 360)),
            float(rng.uniform(*_ELEVATIONS)),
            aspect=size[0] / size[1],
            up=up,
        )
        seen = trace(scene, camera, _SMALL)
        target = (seen.positions() + seen.origin)[rng.integers(np.count_nonzero(seen.covered))]
        if zoom != 1:
            tangent = np.tan(np.radians(camera.fov_y) / 2) / zoom
            camera = replace(camera, target=vector(target), fov_y=float(np.degrees(2 * np.arctan(tangent))))
        cameras.append(camera)
    return cameras


def measured_in(
    renderer: Renderer,
    pose: Pose,
    truth: Scene,
    cameras: Sequence[Camera],
    size: tuple[int, int],
    name: str,
    values: dict[str, Any],
    pairs: int = PAIRS,
) -> Distances:
    """Distances between pairs of pixels that show a point, in pictures of a scan by a backend. values: its
    parameters. pairs: of all pictures together. A pair of which one place meets nothing is left out."""
    drawn_by, surface = backend(name), Surface(renderer.gpu, size)
    params, off, uncertainty, pitches = drawn_by.params(values), [], [], []
    for number, camera in enumerate(cameras):
        while render_frame(renderer, Request(pose, camera, drawn_by, params), surface):
            pass
        rng = np.random.default_rng([number, len(cameras)])
        depth = surface.depth
        rows, columns = np.nonzero(surface.level == 0)
        chosen = rng.integers(len(rows), size=2 * (pairs // len(cameras)))
        pixels = np.stack([columns[chosen], rows[chosen]], axis=1)
        view = surface.view
        pitches.append(
            pose.spacing * view.scale / (np.median(depth[rows, columns]) if view.perspective else 1)
        )
        meant = first_hits(truth, camera, size, pixels + rng.uniform(size=pixels.shape))
        ends = [_end(surface, pose, x, y) for x, y in pixels.tolist()]
        for place in range(0, len(ends), 2):
            if np.isfinite(meant[place : place + 2]).all():
                distance, sigma = distance_of(*ends[place : place + 2])
                off.append(distance - float(np.linalg.norm(meant[place] - meant[place + 1])))
                uncertainty.append(SURE * sigma)
    surface.release()
    return Distances(np.array(off), np.array(uncertainty), float(np.median(pitches)))


def _end(surface: Surface, pose: Pose, x: int, y: int) -> Spot:
    """The end that a click sets."""
    picked = pick(surface, x, y, shown=before_gap(surface, x, y))
    assert picked is not None
    return Spot.of(picked, pose, filled=True)


# --- as a table -----------------------------------------------------------------------


def write_measuring(folder: Path) -> Path:
    """Make measuring.json and measuring.md of the results in a folder; gives the page."""
    rows = read_rows(folder / DISTANCES)
    kept = ("scene", "backend", "zoom", "pitch", "pairs", "untold", "covered", "uncertainty")
    made = measurement.digest(rows, NAME, {"rows": [{key: row[key] for key in kept} for row in rows]})
    return write_measurement(folder, NAME, made, "\n\n".join(tables([made]).values()) + "\n")


def read_measurement(path: Path) -> measurement.Measurement:
    """A measurement as it was written. Raises InputError for what is none."""
    return measurement.read_measurement(path, ["rows"], NAME)


def tables(measurements: Sequence[measurement.Measurement]) -> dict[str, str]:
    """The part of the page: "coverage", a line for each scene and zoom of one machine."""
    rows = measurements[0]["rows"]
    head = ["scene", "zoom", "points apart, px", *(f"`{name}`" for name in DRAWN), "±, spacings"]
    lines = []
    for (scene, zoom), some in groupby(rows, key=lambda row: (row["scene"], row["zoom"])):
        by_name = {row["backend"]: row for row in some}
        any_row = next(iter(by_name.values()))
        shares = [f"{by_name[name]['covered']:.1f}" if name in by_name else "" for name in DRAWN]
        sizes = sorted(row["uncertainty"] for row in by_name.values())
        lines.append(
            [
                f"`{scene}`",
                f"{zoom:g}",
                three_digits(any_row["pitch"]),
                *shares,
                f"{three_digits(sizes[0])} to {three_digits(sizes[-1])}",
            ]
        )
    return {"coverage": markdown_table(head, lines, left=("scene",))}

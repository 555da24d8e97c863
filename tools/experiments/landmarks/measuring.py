"""Distances between pixels chosen by chance, against what is truly there: how often ± holds the truth.

Pixels are picked as a click would. What was meant is somewhere in the pixel: a random position in it is
chosen, and the truth is what a ray through this position meets.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.suite import Part, Suite, row_of, subjects
from experiments.tables import Column, Row, StoredRun, Table, at, code, grouped
from viewer.analysis.measures.distances import distance_of
from viewer.analysis.pick import before_gap, pick
from viewer.analysis.surface_point import SurfacePoint
from viewer.analysis.words import SURE
from viewer.backends import backend
from viewer.bench.report.page import three_digits
from viewer.bench.run import Bench, BenchSettings
from viewer.bench.scenes.subjects import Moment
from viewer.camera import Camera
from viewer.drawing.frame import render_frame
from viewer.drawing.renderer import Renderer
from viewer.drawing.request import Request
from viewer.geometry import vector
from viewer.mesh.reference import first_hits, trace
from viewer.mesh.scene import Scene
from viewer.picture.surface import Surface
from viewer.scan.pose import Pose

SCENES = ("bunny", "armadillo", "horse", "igea", "dragon-100k")
COUNT = 300_000  # points of each, spread by chance
ZOOMS = (1.0, 4.0, 16.0)  # of a picture of the whole
# As scans open with them: points by themselves are squares that touch.
DRAWN: dict[str, dict[str, Any]] = {
    "points": {"point_size": 0}, "surfels": {}, "voxels": {}, "auto_splats": {},
}  # fmt: skip
PAIRS = 400  # of each scene, renderer and zoom: of 95 % come out 92.9 to 97.1, in 95 % of cases
_SMALL = (80, 60)  # pixels of the picture in which a position to look at is chosen
_ELEVATIONS = (-30.0, 50.0)  # degrees


@dataclass(frozen=True, eq=False)
class Distances:
    """Distances that were measured. off: (n,), by how much, scan units. uncertainty: (n,), what ± said, NaN
    where it said nothing. pitch: distance between points, pixels."""

    off: NDArray[np.float64]
    uncertainty: NDArray[np.float64]
    pitch: float

    @property
    def covered(self) -> float:
        """The share that ± holds, of those of which it says something; percent."""
        stated = np.isfinite(self.uncertainty)
        return 100.0 * float(np.mean(np.abs(self.off[stated]) <= self.uncertainty[stated]))


def measure_distances(bench: Bench, scenes: Sequence[str] = SCENES) -> Iterator[Row]:
    """Yield a row for each scene, zoom and renderer. scenes: names, or files of meshes; what cannot be had is
    noted and left out."""
    settings = bench.settings
    for subject in subjects(bench, scenes, COUNT):
        moment = subject.moment(0)
        for zoom in ZOOMS:
            cameras = zoomed(moment.truth, zoom, settings.views, settings.size, subject.up, settings.seed)
            for name, values in DRAWN.items():
                found = measured_in(bench.renderer, moment, cameras, settings.size, name, values)
                yield row_of(
                    bench,
                    scene=subject.name,
                    n=moment.pose.count,
                    backend=name,
                    params=values,
                    zoom=zoom,
                    pitch=found.pitch,
                    pairs=len(found.off),
                    untold=int(np.count_nonzero(np.isnan(found.uncertainty))),
                    covered=found.covered,
                    uncertainty=float(np.nanmedian(found.uncertainty)) / moment.pose.spacing,
                )


def zoomed(
    scene: Scene, zoom: float, count: int, size: tuple[int, int], up: str = "+y", seed: int = 0
) -> list[Camera]:
    """Cameras from directions by chance, each at a position that is seen, through a lens that shows so much
    less than the whole. size: (width, height), pixels."""
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
    moment: Moment,
    cameras: Sequence[Camera],
    size: tuple[int, int],
    name: str,
    values: dict[str, Any],
    pairs: int = PAIRS,
) -> Distances:
    """Distances between pairs of pixels that show a point, in pictures of a scan by a backend. values: its
    parameters. pairs: of all pictures together. A pair of which one ray meets nothing is left out."""
    drawn_by, surface, pose = backend(name), Surface(renderer.gpu, size), moment.pose
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
        meant = first_hits(moment.truth, camera, size, pixels + rng.uniform(size=pixels.shape))
        ends = [_end(surface, pose, x, y) for x, y in pixels.tolist()]
        for first in range(0, len(ends), 2):
            if np.isfinite(meant[first : first + 2]).all():
                distance, sigma = distance_of(*ends[first : first + 2])
                off.append(distance - float(np.linalg.norm(meant[first] - meant[first + 1])))
                uncertainty.append(SURE * sigma)
    surface.release()
    return Distances(np.array(off), np.array(uncertainty), float(np.median(pitches)))


def _end(surface: Surface, pose: Pose, x: int, y: int) -> SurfacePoint:
    """The end that a click sets, the second one where the first says that it is in doubt."""
    picked = pick(surface, x, y, shown=before_gap(surface, x, y))
    assert picked is not None
    return SurfacePoint.of(picked, pose, filled=True, doubtful=True)


# --- as a table -----------------------------------------------------------------------


def _coverage(runs: Sequence[StoredRun]) -> Iterator[Row]:
    """A line for each scene and zoom of one machine."""
    for (scene, zoom), rows in grouped(runs[0]["rows"], "scene", "zoom").items():
        sizes = sorted(row["uncertainty"] for row in rows)
        yield {
            "scene": scene,
            "zoom": zoom,
            "pitch": rows[0]["pitch"],
            "share": {row["backend"]: row["covered"] for row in rows},
            "±, spacings": f"{three_digits(sizes[0])} to {three_digits(sizes[-1])}",
        }


EXPERIMENT = Suite(
    page="measuring.md",
    parts={
        "rows": Part(
            ("scene", "backend", "zoom", "pitch", "pairs", "untold", "covered", "uncertainty"),
            measure_distances,
            by_scene=True,
        )
    },
    tables=[
        Table(
            "coverage",
            [
                code("scene"), Column("zoom", form="{:g}"), Column("points apart, px", "pitch"),
                *(Column(f"`{name}`", at("share", name), "{:.1f}") for name in DRAWN),
                Column("±, spacings"),
            ],
            _coverage,
        )
    ],
    scenes=SCENES,
    usual=BenchSettings(size=(400, 300), views=8, frames=0),
)  # fmt: skip

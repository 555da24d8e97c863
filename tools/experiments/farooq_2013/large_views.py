"""Table 7.2 of Farooq 2013: how fast two views of 3000 x 4500 samples are drawn, from far and from near.

The thesis' heads are not published: the demo's head stands in, scanned by a virtual pair of pods, each of
which sees little more than the face. Samples are counted as there: all pixels of both views, whatever is
drawn of them.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from experiments.farooq_2013 import pyramids
from experiments.suite import row_of
from experiments.tables import Row
from experiments.timing import by_turns
from viewer.bench.run import LOOK, Bench
from viewer.bench.scenes.viewpoints import pod_camera, sample_near
from viewer.bench.truth.head_mesh import head_mesh
from viewer.camera import Camera
from viewer.drawing.request import Request
from viewer.drawing.timing import call_ms, draw
from viewer.picture.surface import Surface
from viewer.scan.formats.exr import write_views
from viewer.scan.open import open_scan
from viewer.scan.pose import Pose
from viewer.scan.range_view import RangeView
from viewer.simulate.scanner import Faults, around, capture, rig
from viewer.unfinished import temporary_folder

_CLOSER = 0.72  # of the field of view that the whole head needs: pods see the face
_EXTREME = 8.0  # pixels a sample: the widest holes that five levels close (4.1.2)
_MEDIUM = 2.0  # times as near as the full view: half of the subject is outside
MIDDLE = np.array([0.5, 0.5])  # of a pod's picture


@dataclass(frozen=True)
class _Scenario:
    """A line of Table 7.2. zoom: pixels of the picture for a sample, which the camera sees so."""

    name: str
    levels: int
    zoom: float
    camera: Camera


def scan_head(size: tuple[int, int]) -> tuple[RangeView, ...]:
    """Range views of a pair of pods, (width, height) samples each: half a minute for those of the thesis."""
    head = head_mesh(0.0)
    pods = rig(head.bounds, around(2), aspect=size[0] / size[1])
    pods = [replace(pod, fov_y=_CLOSER * pod.fov_y) for pod in pods]
    views = [capture(head, [pod], size, [Faults()], unit="mm")[0] for pod in pods]  # one at a time: memory
    return tuple(replace(view, name=name, confidence=None) for view, name in zip(views, "LR", strict=True))


def measure_large_views(bench: Bench, view_size: tuple[int, int] | None = None) -> Iterator[Row]:
    """Table 7.2: a row for each line and primitive, with and without skipping what the picture does not need.

    view_size: samples of a view, (width, height); None: the thesis'. Pictures have the thesis' size, times
    are of the call that draws one and brings it to memory, ms.
    """
    paper = pyramids.PAPER
    size, view_size = tuple(paper["size"]), view_size or tuple(paper["view_size"])
    with temporary_folder() as folder:
        file = folder / "head.exr"
        views = scan_head(view_size)
        write_views(file, views)
        scenarios = list(_scenarios(views[0], size))
        del views
        opened, pose = _open(bench, file, scenarios[-1], size)
        for scenario in scenarios:
            for primitive in pyramids.PRIMITIVES:
                named = {"scenario": scenario.name, "levels": scenario.levels, "zoom": scenario.zoom}
                found = _timed(bench, pose, scenario, primitive, size)
                yield row_of(bench, **opened, **named, primitive=primitive, size=list(size), **found)


def _scenarios(view: RangeView, size: tuple[int, int]) -> Iterator[_Scenario]:
    """The lines of the table, as a pod's view is seen in pictures of a size."""
    full = size[1] / view.depth.shape[0]
    zooms = {"full": full, "medium": _MEDIUM * full, "extreme": _EXTREME}
    middle = sample_near(view, MIDDLE)
    for line in pyramids.PAPER["scenarios"]:
        zoom = zooms[line["scenario"].split()[0]]
        yield _Scenario(line["scenario"], line["levels"], zoom, pod_camera(view, middle, zoom, size))


def _open(bench: Bench, file: Path, full: _Scenario, size: tuple[int, int]) -> tuple[Row, Pose]:
    """The scan's pose, how long it takes until its first picture is there, and how much it takes on the GPU.

    Shaders are compiled before, by a picture of the same scan.
    """
    surface = Surface(bench.renderer.gpu, size)
    for _ in range(2):
        start = time.perf_counter()
        with open_scan(file) as timeline:
            pose = timeline.pose(0)
        read = time.perf_counter()
        draw(bench.renderer, _request(pose, full, pyramids.PRIMITIVES[0]), surface)
        surface.image()
        done = time.perf_counter()
    samples = sum(view.depth.size for view in pose.views)
    surface.release()
    return {
        "samples": samples,
        "measured": pose.count,
        "open_ms": 1e3 * (done - start),
        "read_ms": 1e3 * (read - start),
        "bytes_per_sample": bench.renderer.bytes_of(pose) / samples,
    }, pose


def _timed(
    bench: Bench, pose: Pose, scenario: _Scenario, primitive: str, size: tuple[int, int]
) -> dict[str, Any]:
    """The median time of a picture with and without skipping, ms, by turns; and what of it is covered."""
    surface, repeat = Surface(bench.renderer.gpu, size), bench.settings.repeat
    requests = {
        "ms": _request(pose, scenario, primitive),
        "unskipped_ms": _request(pose, scenario, primitive, lod=False, skip=False),
    }
    works = {name: partial(call_ms, bench.renderer, [each], surface) for name, each in requests.items()}
    found = by_turns(works, repeat)
    covered = 100 * float((surface.coverage > 0).mean())
    surface.release()
    return {**{name: each.wall for name, each in found.items()}, "covered": covered}


def _request(pose: Pose, scenario: _Scenario, primitive: str, **others: Any) -> Request:
    params = pyramids.with_levels(scenario.levels, primitive, **others)
    return Request(pose, scenario.camera, pyramids.BACKEND, params, LOOK)

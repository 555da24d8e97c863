"""How far the points of real scans lie off their truths. It needs the data folder."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Iterator

import numpy as np
import open3d

from experiments.pictures import scene
from experiments.script import Script
from experiments.tables import Row
from viewer.bench.scenes.subjects import Moment

MOMENTS = 5  # of a sequence
SCENES = {"demo": 1, "dragon-scans": 1000, "bunny-scans": 1000, "truedepth-head": 1000}  # with mm a scan unit


def distances(_: Namespace) -> Iterator[Row]:
    """Distances from points to the truth's triangles, of some moments, and what visibility tolerates."""
    for name, mm in SCENES.items():
        subject = scene(name)
        some = range(0, subject.moments, max(1, subject.moments // MOMENTS))
        off = np.quantile(np.concatenate([off_the_truth(subject.moment(n)) for n in some]), [0.5, 0.95])
        cells = [f"{value * mm:.2g} mm" for value in (*off, subject.tolerance or 0.0)]
        titles = ("median", "95 %", "tolerance of visibility")
        yield {"scene": f"`{name}`", **dict(zip(titles, cells, strict=True))}


def off_the_truth(moment: Moment) -> np.ndarray:
    """How far each point is from the nearest triangle, (N,), scan units."""
    mesh, cloud = moment.mesh, moment.pose.cloud
    scene = open3d.t.geometry.RaycastingScene()
    scene.add_triangles(
        *(open3d.core.Tensor.from_numpy(np.ascontiguousarray(a)) for a in (mesh.points.positions, mesh.faces))
    )
    points = (cloud.positions + (cloud.origin - mesh.origin)).astype(np.float32)
    return scene.compute_distance(open3d.core.Tensor.from_numpy(points)).numpy()


EXPERIMENT = Script([distances], page="benchmark.md")

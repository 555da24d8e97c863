"""The table of docs/developing/benchmark.md that no suite makes: how far scans lie off their truths.

    python docs/tables/benchmark.py

It gives the same figures on any machine. It needs the data folder.
"""

from __future__ import annotations

import numpy as np
import open3d
from pictures import DATA, DOCS

from viewer.bench.report.measurement import markdown_table, remeasure_tables
from viewer.bench.scenes import catalog
from viewer.bench.scenes.subjects import Moment

PAGE = DOCS / "developing" / "benchmark.md"
MOMENTS = 5  # of a sequence
SCENES = {"demo": 1, "dragon-scans": 1000, "bunny-scans": 1000, "truedepth-head": 1000}  # with mm a scan unit


def distances() -> str:
    """Distances from points to the truth's triangles, of some moments, and what visibility tolerates."""
    rows = []
    for name, mm in SCENES.items():
        subject = catalog.subject(name, DATA)
        some = range(0, subject.moments, max(1, subject.moments // MOMENTS))
        off = np.quantile(np.concatenate([off_the_truth(subject.moment(n)) for n in some]), [0.5, 0.95])
        told = [f"{value * mm:.2g} mm" for value in (*off, subject.tolerance or 0.0)]
        rows.append([f"`{name}`", *told])
    return markdown_table(["scene", "median", "95 %", "tolerance of visibility"], rows, left=("scene",))


def off_the_truth(moment: Moment) -> np.ndarray:
    """How far each point is from the nearest triangle, (N,), scan units."""
    mesh, cloud = moment.mesh, moment.pose.cloud
    scene = open3d.t.geometry.RaycastingScene()
    scene.add_triangles(
        *(open3d.core.Tensor.from_numpy(np.ascontiguousarray(a)) for a in (mesh.points.positions, mesh.faces))
    )
    points = (cloud.positions + (cloud.origin - mesh.origin)).astype(np.float32)
    return scene.compute_distance(open3d.core.Tensor.from_numpy(points)).numpy()


if __name__ == "__main__":
    remeasure_tables(PAGE, distances)

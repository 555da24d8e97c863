"""Deviations of Scan4D beside those of CloudCompare and py4dgeo, on a torus, whose distances are known."""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from argparse import Namespace
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.script import Script
from experiments.tables import Row
from viewer.analysis.deviation.m3c2 import M3C2Reference
from viewer.analysis.deviation.reference import PointReference
from viewer.mesh.nearest import NearestOnMesh
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose

Float = NDArray[np.float64]

RING, TUBE = 60.0, 25.0  # mm, radii of the torus
POINTS = 40_000  # of the reference: about 1.2 mm apart
COMPARED = 20_000
WAVE = 2.0  # mm: the compared points lie up to that far off
STEPS = 600, 240  # of the mesh, around the ring and the tube
REACH = 8.0  # mm; with 6, py4dgeo halves its cylinders, and drops the point itself on the cut
NEAREST = 20  # points that CloudCompare fits its surface to, as many as Scan4D
CLOSE = 0.01  # mm


@dataclass(frozen=True, eq=False)
class Toruses:
    """A reference, and points that lie off it by a wave. noise: of both along the normal, mm."""

    noise: float

    @cached_property
    def reference(self) -> tuple[Float, Float]:
        """Points and normals, (N, 3) each."""
        places, normals = _torus(np.random.default_rng(1), POINTS)
        return places + self._noise(2, POINTS) * normals, normals

    @cached_property
    def compared(self) -> Float:
        """(M, 3)."""
        rng = np.random.default_rng(3)
        places, normals = _torus(rng, COMPARED)
        wave = WAVE * np.sin(3 * np.arctan2(places[:, 1], places[:, 0]))
        return places + (wave[:, None] + self._noise(4, COMPARED)) * normals

    @cached_property
    def truth(self) -> Float:
        """Signed distances of the compared points from the torus, (M,)."""
        x, y, z = self.compared.T
        return np.hypot(np.hypot(x, y) - RING, z) - TUBE

    def _noise(self, seed: int, count: int) -> Float:
        return np.random.default_rng(seed).normal(0, self.noise, (count, 1))


# Measures signed distances, (M,); CloudCompare's from points have no sign
Program = Callable[[Toruses], Float]


def deviations(_: Namespace) -> Iterator[Row]:
    """Each program on the same points. CloudCompare is called as `CloudCompare -SILENT -O ... -C2C_DIST`."""
    clean, noisy = Toruses(0.0), Toruses(0.1)
    methods: Sequence[tuple[str, Toruses, Sequence[tuple[str, Program]]]] = (
        ("faces", clean, (("Scan4D", _on_mesh), ("CloudCompare, C2M", _c2m))),
        ("points", clean, (("Scan4D", _on_points), ("CloudCompare, C2C, quadric", _c2c))),
        ("points, noise 0.1 mm", noisy, (("Scan4D", _on_points), ("CloudCompare, C2C, quadric", _c2c))),
        (
            "M3C2, noise 0.1 mm",
            noisy,
            (("Scan4D, whole cylinder", _m3c2), ("py4dgeo", _py4dgeo), ("Scan4D, default", _m3c2_growing)),
        ),
    )
    for title, scene, programs in methods:
        ours: Float | None = None
        for name, program in programs:
            try:
                found = program(scene)
            except (ImportError, FileNotFoundError) as error:
                yield {"reference": title, "program": name, "error, median": str(error)}
                continue
            yield {
                "reference": title,
                "program": name,
                **_row(found, ours, scene.truth),
            }
            ours = found if ours is None else ours


def _row(found: Float, ours: Float | None, truth: Float) -> Row:
    has_sign = (found[np.isfinite(found)] < 0).any()
    apart = np.abs(found - (truth if has_sign else np.abs(truth)))
    cells = {
        "error, median": _length(apart, 50),
        "95 %": _length(apart, 95),
        "with a value": _share(np.isfinite(found)),
    }
    if ours is None:
        return {**cells, "from the first, median": "", "95 % from it": "", "within 0.01 mm of it": ""}
    between = np.abs(found - (ours if has_sign else np.abs(ours)))
    both = between[np.isfinite(between)]
    return {
        **cells,
        "from the first, median": _length(between, 50),
        "95 % from it": _length(between, 95),
        "within 0.01 mm of it": _share(both <= CLOSE),
    }


def _length(values: Float, percent: int) -> str:
    return f"{np.nanpercentile(values, percent):.2g} mm"


def _share(flags: NDArray[np.bool_]) -> str:
    return f"{flags.mean():.1%}".replace("%", " %")


def _on_mesh(scene: Toruses) -> Float:
    places, faces = _mesh()
    return NearestOnMesh(PointCloud.from_arrays(places), faces).signed(scene.compared, REACH)


def _on_points(scene: Toruses) -> Float:
    return PointReference(_pose(scene)).signed(scene.compared, REACH)


def _m3c2(scene: Toruses) -> Float:
    return M3C2Reference(_pose(scene), is_whole=True).signed(scene.compared, REACH)


def _m3c2_growing(scene: Toruses) -> Float:
    return M3C2Reference(_pose(scene)).signed(scene.compared, REACH)


def _py4dgeo(scene: Toruses) -> Float:
    """Along the directions of Scan4D. Raises ImportError."""
    py4dgeo: Any = import_module("py4dgeo")
    reference = M3C2Reference(_pose(scene), is_whole=True)
    directions = reference.distances(scene.compared, REACH).directions
    known: NDArray[np.bool_] = np.isfinite(directions[:, 0])
    epochs = tuple(py4dgeo.Epoch(points) for points in (scene.reference[0], scene.compared))
    values = np.full(len(known), np.nan)
    values[known], _ = py4dgeo.M3C2(
        epochs=epochs, corepoints=scene.compared[known], cyl_radius=reference.cylinder,
        corepoint_normals=directions[known], max_distance=REACH,
    ).run()  # fmt: skip
    return values


def _c2m(scene: Toruses) -> Float:
    return _cloudcompare(scene.compared, _mesh(), ["-C2M_DIST", "-MAX_DIST", str(REACH)])


def _c2c(scene: Toruses) -> Float:
    model = ["-C2C_DIST", "-MAX_DIST", str(REACH), "-MODEL", "HF", "KNN", str(NEAREST)]
    return _cloudcompare(scene.compared, (scene.reference[0], None), model)


def _cloudcompare(
    points: Float, reference: tuple[Float, NDArray[np.int64] | None], words: list[str]
) -> Float:
    """The distances that CloudCompare finds. Raises FileNotFoundError where it is not installed."""
    program = shutil.which("CloudCompare")
    if program is None:
        raise FileNotFoundError("CloudCompare is not installed")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        _write(folder / "points.ply", points, None)
        _write(folder / "reference.ply", *reference)
        command = [program, "-SILENT", "-AUTO_SAVE", "OFF", "-C_EXPORT_FMT", "ASC", "-PREC", "9"]
        command += ["-O", "points.ply", "-O", "reference.ply", *words, "-SAVE_CLOUDS", "FILE"]
        saved = ["found.asc", "other.asc"] if reference[1] is None else ["found.asc"]
        subprocess.run([*command, " ".join(saved)], cwd=folder, check=True, capture_output=True)
        return np.loadtxt(folder / "found.asc")[:, 3]


def _write(path: Path, points: Float, faces: NDArray[np.int64] | None) -> None:
    """A binary PLY file in float32."""
    lines = ["ply", "format binary_little_endian 1.0", f"element vertex {len(points)}"]
    lines += [f"property float {axis}" for axis in "xyz"]
    body = points.astype("<f4").tobytes()
    if faces is not None:
        lines += [f"element face {len(faces)}", "property list uchar int vertex_indices"]
        rows = np.empty(len(faces), [("count", "u1"), ("corners", "<i4", 3)])
        rows["count"], rows["corners"] = 3, faces
        body += rows.tobytes()
    path.write_bytes("\n".join([*lines, "end_header\n"]).encode() + body)


def _torus(rng: np.random.Generator, count: int) -> tuple[Float, Float]:
    """Random points, spread evenly over the torus, and their normals."""
    tube = rng.uniform(0, 2 * np.pi, 3 * count)
    kept = rng.uniform(0, RING + TUBE, len(tube)) < RING + TUBE * np.cos(tube)
    return _places(rng.uniform(0, 2 * np.pi, count), tube[kept][:count])


def _places(ring: Float, tube: Float) -> tuple[Float, Float]:
    """Points of the torus at angles, and their normals, (N, 3) each."""
    out = np.stack([np.cos(ring), np.sin(ring), np.zeros_like(ring)], axis=1)
    normals = np.cos(tube)[:, None] * out + np.sin(tube)[:, None] * [0.0, 0.0, 1.0]
    return RING * out + TUBE * normals, normals


def _mesh() -> tuple[Float, NDArray[np.int64]]:
    """Places and faces of the torus, which run around counterclockwise outside."""
    around, over = STEPS
    i, j = (part.ravel() for part in np.meshgrid(np.arange(around), np.arange(over), indexing="ij"))
    places, _ = _places(2 * np.pi * i / around, 2 * np.pi * j / over)
    right, up = (i + 1) % around, (j + 1) % over
    a, b, c, d = i * over + j, right * over + j, right * over + up, i * over + up
    return places, np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


def _pose(scene: Toruses) -> Pose:
    points, normals = scene.reference
    return Pose.of(0, 0.0, "torus", PointCloud.from_arrays(points, normals=normals.astype(np.float32)))


EXPERIMENT = Script([deviations], page="how-it-works/deviation.md")

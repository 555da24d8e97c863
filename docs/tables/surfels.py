"""The tables of docs/surfels.md, measured anew.

    PYTHONPATH=tests:tests/backends python docs/tables/surfels.py [NAME ...]

All but `speed` give the same figures on any machine with the same driver. `flicker` and `speed` need the data
folder.
"""

from __future__ import annotations

import time
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scenes import sphere as even_sphere
from test_elliptical_surfaces import cylinder, holes_and_spill
from test_surfel_passes import seen_by

from viewer.backends import FrameView, backend
from viewer.bench import metrics
from viewer.bench.judge import Judge, Walk
from viewer.bench.report.measurement import markdown_table, remeasure_tables, spaced
from viewer.bench.scenes import samples
from viewer.bench.scenes.subjects import smooth
from viewer.bench.truth.head_mesh import head_mesh
from viewer.bench.truth.shapes import AnalyticScene, Sphere
from viewer.bench.truth.surface import reference_surface
from viewer.camera import Camera
from viewer.frame import Request, render_frame
from viewer.gpu.pose import GpuPose
from viewer.gpu.surface import Surface
from viewer.look import Look
from viewer.mesh.reference import trace
from viewer.mesh.triangles import read_mesh
from viewer.renderer import Renderer
from viewer.scan.open import open_scan
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose
from viewer.scan.spacing import typical_spacing
from viewer.simulate.scanner import Faults, around, capture, rig
from viewer.view import View

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "surfels.md"
DATA = ROOT.parent / "shared" / "data" / "models"
SURFELS = backend("surfels")
SHADING = Look(light="head", color_by="plain")


@cache
def renderer() -> Renderer:
    """The one that all pictures are drawn by."""
    return Renderer()


def drawn(
    cloud: PointCloud, camera: Camera, size: tuple[int, int], look: Look | None = None, **params: object
) -> Surface:
    """One finished picture."""
    surface = Surface(renderer().gpu, size)
    request = Request(Pose(0, 0.0, "", cloud), camera, "surfels", SURFELS.params(params), look or Look())
    while render_frame(renderer(), request, surface):
        pass
    return surface


def covered(surface: Surface) -> NDArray[np.bool_]:
    """Which pixels (H, W) show something."""
    return np.isfinite(surface.depth)


def pods() -> str:
    """Holes, spill and outlines of what two pods see of the demo's head, without and with enlarging."""
    mesh, size = head_mesh(0.0), (960, 640)
    seers = rig(mesh.bounds, around(2), aspect=4 / 3, up="+y")
    scans = capture(mesh, seers, (640, 480), [Faults(noise=0.5)] * 2, seed=0, frame=0)
    cloud = Pose.of(0, 0.0, "", scans).cloud
    rows = []
    for name, azimuth, elevation in (
        ("front", 0, 0),
        ("40° left, 10° up", -40, 10),
        ("70° right", 70, 0),
        ("50° up", 0, 50),
    ):
        camera = Camera.orbit(mesh.bounds, azimuth, elevation, aspect=1.5)
        truth = trace(mesh, camera, size)
        seen, outline = seen_by(mesh, truth, seers), np.count_nonzero(metrics._outline(truth.covered))
        holes, spill, apart = [], [], []
        for enlarge in (1.0, 2.0):
            shown = covered(drawn(cloud, camera, size, passes="two", enlarge=enlarge))
            holes.append(f"{100 * np.count_nonzero(seen & ~shown) / np.count_nonzero(seen):.3f} %")
            spill.append(f"{np.count_nonzero(shown & ~truth.covered) / outline:.2f} px")
            apart.append(f"{metrics.coverage(shown, truth.covered)['boundary_mean']:.2f} px")
        rows.append([name, *holes, *spill, *apart])
    head = ["view", "holes d", "holes f", "spill d", "spill f", "distance of outlines d", "f"]
    return markdown_table(head, rows, left=("view",))


def sphere() -> str:
    """PSNR of shading."""
    rows = []
    ways = {
        "`one`": ("one", 1.0),
        "`two`, 1": ("two", 1.0),
        "`two`, 2": ("two", 2.0),
        "`sorted`": ("sorted", 1.0),
    }
    for count in (5_000, 20_000, 100_000):
        cloud, size = even_sphere(count), (480, 360)
        camera = Camera.orbit(cloud.bounds(), 40, 25, aspect=4 / 3)
        truth = trace(AnalyticScene((Sphere(),)), camera, size)
        found = []
        for passes, enlarge in ways.values():
            surface = drawn(cloud, camera, size, SHADING, passes=passes, enlarge=enlarge)
            reference = reference_surface(truth, surface.gpu, SHADING).image()
            found.append(f"{metrics.color(surface.image(), reference, truth.covered)['psnr']:.1f}")
        rows.append([spaced(count), *found])
    return markdown_table(["points", *ways], rows, left=())


def ellipses() -> str:
    """Pixels that stay open of a cylinder, and pixels beside it."""
    ellipse = cylinder(8, 60)
    along, across = ellipse.axes[0, 1], ellipse.axes[0, 3]  # type: ignore[index]

    def circles(cloud: PointCloud, radius: float) -> PointCloud:
        return replace(cloud, axes=None, radii=np.full(len(cloud), radius, np.float32))

    splats = {
        "ellipses": ellipse,
        "circles of their area": circles(ellipse, np.sqrt(along * across)),
        "circles as large as they are long": circles(ellipse, along),
        **{f"such circles in {n} rings": circles(cylinder(n, 60), 0.75 * 4 / n) for n in (20, 40)},
    }
    draw = lambda cloud, camera, size, **params: drawn(cloud, camera, size, **params)  # noqa: E731
    rows = [
        [name, str(len(cloud)), *map(str, holes_and_spill(draw, cloud))] for name, cloud in splats.items()
    ]
    return markdown_table(["splats", "points", "open", "beside"], rows, left=("splats",))


def flicker() -> str:
    """Flicker of normals and PSNR of shading of Igea, by how large splats are."""
    mesh = smooth(read_mesh(DATA / "cyberware_igea_134345.ply"))
    cameras = [Camera.orbit(mesh.bounds, 10 + 2 * step, 10, aspect=1.5) for step in range(4)]
    ways = {
        "nearest": {"passes": "one", "epsilon": 0.0},
        "`one`": {"passes": "one"},
        "`two`, 1": {"passes": "two", "enlarge": 1.0},
        "`two`, 2": {"passes": "two", "enlarge": 2.0},
    }
    rows = []
    for count, size in ((140_000, (480, 320)), (560_000, (480, 320)), (560_000, (240, 160))):
        bare = samples.on_mesh(mesh, count, 0)
        radius = 1.5 * typical_spacing(bare)
        cloud = replace(bare, radii=np.full(count, radius, np.float32))
        judges = [Judge.of(renderer().gpu, mesh, camera, size, SHADING, cloud, None) for camera in cameras]
        walk = Walk(judges, [None] * (len(judges) - 1))
        view = View.of(cameras[0], size, cloud.origin, cloud.bounds())
        pixels = radius * view.scale / cameras[0].distance
        found = []
        for params in ways.values():
            frames = [drawn(cloud, camera, size, SHADING, **params) for camera in cameras]
            more = walk.flicker(iter(frames), "orbit")["flicker_orbit_normal"]
            inside = judges[0].reference.covered
            psnr = metrics.color(frames[0].image(SHADING), judges[0].image, inside)["psnr"]
            found.append(f"{more:.2f}°, {psnr:.1f} dB")
        rows.append([f"{pixels:.2f} pixels", *found])
    return markdown_table(["radius", *ways], rows, left=())


def speed() -> str:
    """Processor time of each way, the least of three, in turns."""
    size = (1280, 800)
    ways = {
        "`one`": {"passes": "one"},
        "`two`, 1": {"passes": "two", "enlarge": 1.0},
        "`two`, 2": {"passes": "two", "enlarge": 2.0},
        "`one` by `gs`": {"passes": "one", "instancing": "gs"},
        "`two`, 2 by `gs`": {"passes": "two", "enlarge": 2.0, "instancing": "gs"},
    }
    dragon = smooth(read_mesh(DATA / "stanford_dragon_100250.ply")).points
    shells = [even_sphere(20_000, radius) for radius in (1.0, 0.9, 0.8, 0.7, 0.6)]
    clouds = {
        "demo, 86 361 points": open_scan("demo").pose(0).cloud,
        "dragon, 100 250": dragon,
        "five spheres in one another, 100 000": PointCloud.from_arrays(
            np.concatenate([shell.positions for shell in shells]),
            normals=np.concatenate([shell.normals for shell in shells]),
            radii=np.concatenate([shell.radii for shell in shells]),
        ),
        "sphere, 1 million": even_sphere(1_000_000),
    }
    rows = []
    for name, cloud in clouds.items():
        for cull_back in (False, True):
            times = [f"{ms:.0f} ms" for ms in _least(cloud, size, list(ways.values()), cull_back)]
            rows.append([name, "culled" if cull_back else "", *times])
    return markdown_table(["scene", "back faces", *ways], rows, left=("scene", "back faces"))


def _least(cloud: PointCloud, size: tuple[int, int], ways: list[dict], cull_back: bool) -> list[float]:
    gpu = renderer().gpu
    pose, surface = GpuPose(gpu, Pose(0, 0.0, "", cloud)), Surface(gpu, size)
    camera = Camera.orbit(cloud.bounds(), 30, 15, aspect=size[0] / size[1])
    surface.start(pose, View.of(camera, size, pose.origin, pose.bounds))
    least = [np.inf] * len(ways)
    for turn in range(4):
        for number, params in enumerate(ways):
            chosen = SURFELS.params({"instancing": "tiles", "cull_back": cull_back, **params})
            gpu.ctx.finish()
            start = time.process_time()
            SURFELS.draw(pose, FrameView(surface.view, chosen), surface)
            gpu.ctx.finish()
            if turn:
                least[number] = min(least[number], (time.process_time() - start) * 500)
    return least


if __name__ == "__main__":
    remeasure_tables(PAGE, pods, sphere, flicker, ellipses, speed)

"""The tables of docs/how-it-works/surfels.md, measured anew.

    python docs/tables/surfels.py [NAME ...]

All but `costs`, `speed` and the times of `near_and_far` give the same figures on any machine with the same
driver. `pods`, `sphere` and `ellipses` need no data folder.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray
from pictures import (
    DATA,
    DOCS,
    ERROR_NAMES,
    SHADING,
    draw,
    drawn,
    error_cells,
    errors_of,
    processor_ms,
    renderer,
    request,
)

from viewer.backends import FrameView, backend
from viewer.bench import metrics
from viewer.bench.judge import Judge, Walk
from viewer.bench.report.measurement import markdown_table, remeasure_tables, spaced
from viewer.bench.scenes import catalog, samples
from viewer.bench.scenes.defects import changed, thinned
from viewer.bench.scenes.subjects import Subject, smooth
from viewer.bench.truth.head_mesh import head_mesh
from viewer.bench.truth.shapes import AnalyticScene, Sphere
from viewer.bench.truth.surface import reference_surface
from viewer.camera import Camera
from viewer.gpu.pose import GpuPose
from viewer.look import Look
from viewer.mesh.reference import trace, visible_pixels
from viewer.mesh.triangles import Mesh, read_mesh
from viewer.picture.surface import Surface
from viewer.scan.open import open_scan
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose
from viewer.scan.spacing import typical_spacing
from viewer.simulate.scanner import Faults, around, capture, rig
from viewer.view import View

PAGE = DOCS / "how-it-works" / "surfels.md"
SURFELS = backend("surfels")
THINNED = "-ramp"
SCANS = ("armadillo", "bunny", "horse", "igea", "crane")
UNEVEN = ("armadillo", "horse", "igea", "crane")


def picture(
    cloud: PointCloud, camera: Camera, size: tuple[int, int], look: Look = SHADING, **params: object
) -> Surface:
    """One finished picture."""
    return drawn(request(Pose(0, 0.0, "", cloud), camera, "surfels", params, look), size)


def covered(surface: Surface) -> NDArray[np.bool_]:
    """Which pixels (H, W) show something."""
    return np.isfinite(surface.depth)


def scan(name: str) -> Subject:
    """A scan of the benchmark; with the name of another and `THINNED`, that thinned from end to end."""
    whole = catalog.subject(name.removesuffix(THINNED), DATA)
    return changed(whole, name, [thinned]) if name.endswith(THINNED) else whole


def even_sphere(count: int, radius: float = 1.0) -> PointCloud:
    """Discs on a sphere about the origin, of 1.5 spacings."""
    arrays = samples.on_sphere(count)
    scaled = {name: radius * arrays[name] for name in ("positions", "radii")}
    return PointCloud.from_arrays(**{**arrays, **scaled})


def defaults() -> str:
    """Errors of one radius for all and the nearest disc, then of the defaults."""
    settings: list[dict[str, object]] = [{"radius": "uniform", "passes": "one"}, {}]
    rows = []
    for name in (*SCANS, *(name + THINNED for name in UNEVEN)):
        subject = scan(name)
        told = errors_of(subject, "surfels", settings, 4, (400, 300))
        title = f"{name.replace(THINNED, ', thinned')}, {spaced(len(subject.moment(0).pose.cloud))}"
        rows.append([title, *(cell for errors in told for cell in error_cells(errors))])
    return markdown_table(["scan", *ERROR_NAMES, *ERROR_NAMES], rows, left=("scan",))


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
        seen, outline = visible_pixels(mesh, truth, seers), np.count_nonzero(metrics._outline(truth.covered))
        holes, spill, apart = [], [], []
        for enlarge in (1.0, 2.0):
            shown = covered(picture(cloud, camera, size, passes="two", enlarge=enlarge))
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
            surface = picture(cloud, camera, size, SHADING, passes=passes, enlarge=enlarge)
            reference = reference_surface(truth, surface.gpu, SHADING).image()
            found.append(f"{metrics.color(surface.image(), reference, truth.covered)['psnr']:.1f}")
        rows.append([spaced(count), *found])
    return markdown_table(["points", *ways], rows, left=())


def ellipses() -> str:
    """Pixels that stay open of a cylinder, but for its ends, and pixels beside it."""
    camera, size = Camera((0.0, 0.0, 6.0), (0, 0, 0), fov_y=45), (320, 240)
    truth = trace(tall_cylinder(), camera, size)
    body = truth.covered.copy()
    body[truth.covered] = np.abs(truth.positions()[:, 1]) < 1.5
    ellipse = PointCloud.from_arrays(**samples.rings(8, 60))
    along, across = ellipse.axes[0, 1], ellipse.axes[0, 3]  # type: ignore[index]

    def circles(cloud: PointCloud, radius: float) -> PointCloud:
        return replace(cloud, axes=None, radii=np.full(len(cloud), radius, np.float32))

    def in_rings(count: int) -> PointCloud:
        return circles(PointCloud.from_arrays(**samples.rings(count, 60)), 0.75 * 4 / count)

    splats = {
        "ellipses": ellipse,
        "circles of their area": circles(ellipse, np.sqrt(along * across)),
        "circles as large as they are long": circles(ellipse, along),
        **{f"such circles in {count} rings": in_rings(count) for count in (20, 40)},
    }
    rows = []
    for name, cloud in splats.items():
        shown = covered(picture(cloud, camera, size, cull_back=True))
        counts = np.count_nonzero(body & ~shown), np.count_nonzero(shown & ~truth.covered)
        rows.append([name, str(len(cloud)), *map(str, counts)])
    return markdown_table(["splats", "points", "open", "beside"], rows, left=("splats",))


def tall_cylinder(around: int = 2000) -> Mesh:
    """About the y axis, one in radius, to a millionth, and higher than any picture of it."""
    turn = np.arange(around) * 2 * np.pi / around
    ends = [np.column_stack([np.cos(turn), np.full(around, y), np.sin(turn)]) for y in (-50.0, 50.0)]
    low = np.arange(around)
    after = (low + 1) % around
    faces = [
        np.column_stack(corners)
        for corners in ((low, low + around, after), (after, low + around, after + around))
    ]
    return Mesh(
        PointCloud.from_arrays(np.concatenate(ends), origin=np.zeros(3)),
        np.concatenate(faces).astype(np.uint32),
    )


def flicker() -> str:
    """Flicker of normals and PSNR of shading of Igea, by how large splats are."""
    mesh = smooth(read_mesh(DATA / "models" / "cyberware_igea_134345.ply"))
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
            frames = [picture(cloud, camera, size, SHADING, **params) for camera in cameras]
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
    dragon = smooth(read_mesh(DATA / "models" / "stanford_dragon_100250.ply")).points
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
        pose, camera = _on_gpu(cloud), Camera.orbit(cloud.bounds(), 30, 15, aspect=size[0] / size[1])
        for culled in (False, True):
            usual = {"instancing": "tiles", "cull_back": culled}
            times = _least([_drawing(pose, camera, size, {**usual, **way})[0] for way in ways.values()])
            one, two, enlarged = times[:3]
            ratios = [f"{enlarged / least:.1f}" for least in (two, one)]
            cells = [*(f"{ms:.0f} ms" for ms in times), *ratios]
            rows.append([name, "culled" if culled else "", *cells])
    head = ["scene", "back faces", *ways, "`two`, 2 : `two`, 1", "`two`, 2 : `one`"]
    return markdown_table(head, rows, left=("scene", "back faces"))


def near_and_far() -> str:
    """Processor time of one pass by the rasteriser and by tiles; how many points these sent to their pixels,
    and how many pixels show another point."""
    small, large = (480, 320), (960, 640)
    along, low = Camera((0.2, 0.1, 0), (0.1, 0, -1), fov_y=60), Camera((0, 0.06, 1), (0, 0.03, 0), fov_y=60)
    end, close = Camera((0, 0, 9), (0, 0, 0), fov_y=40), Camera((0, 0, 1.3), (0, 0, 0), fov_y=60)
    hall, more = (PointCloud.from_arrays(**samples.hall(count)) for count in (600_000, 1_800_000))
    scenes = [
        ("round hall", hall, along, small),
        ("round hall", hall, along, large),
        ("round hall", more, along, large),
        ("hills seen along", PointCloud.from_arrays(**samples.hills(3_000_000)), low, large),
        ("ellipsoid 1:6 from its end", long_ellipsoid(1_000_000), end, small),
        ("sphere from close by", even_sphere(3_000_000), close, large),
    ]
    rows = []
    for name, cloud, camera, size in scenes:
        pose = _on_gpu(cloud)
        ways = [_drawing(pose, camera, size, {"passes": "one", "instancing": way}) for way in ("gs", "tiles")]
        times = [f"{ms:.0f} ms" for ms in _least([draw for draw, _ in ways])]
        by_quads, by_tiles = (surface for _, surface in ways)
        sent = by_tiles.stats.skipped.get("lists of small splats", "").partition(" ")[0].replace(",", "")
        others = np.count_nonzero(by_quads.row != by_tiles.row)
        title = f"{name}, {spaced(len(cloud))}"
        rows.append([title, f"{size[0]}x{size[1]}", *times, spaced(int(sent or 0)), spaced(others)])
    head = ["scene", "size", "rasterised", "tiles", "points sent", "other points"]
    return markdown_table(head, rows, left=("scene", "size"))


def long_ellipsoid(count: int) -> PointCloud:
    """Six times as long along z as wide, its points dense at the ends."""
    arrays = samples.on_sphere(count)
    normals = arrays["normals"] / [1.0, 1.0, 6.0]
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    radii = arrays["radii"] * 6**0.5  # as large as the area of a point in the mean
    return PointCloud.from_arrays(arrays["positions"] * [1.0, 1.0, 6.0], normals=normals, radii=radii)


def costs() -> str:
    """Processor time of the first picture of a pose and of those that follow, the least of five, in turns."""
    size = (960, 640)
    ways: dict[str, tuple[dict[str, object], bool]] = {
        "one for all, nearest": ({"radius": "uniform", "passes": "one"}, False),
        "at rest": ({}, False),
        "in motion": ({}, True),
    }
    rows = []
    for name in ("armadillo", "igea"):
        pose = scan(name).moment(0).pose
        camera = Camera.orbit(pose.bounds, 30, 15, aspect=1.5)
        least = np.full((len(ways), 2), np.inf)
        for turn in range(6):
            for number, (params, moving) in enumerate(ways.values()):
                unseen = request(replace(pose), camera, "surfels", params)  # by the renderer
                work = partial(draw, unseen, Surface(renderer().gpu, size), moving=moving)
                times = [processor_ms(work) / 2 for _ in range(2)]
                least[number] = np.minimum(least[number], times) if turn else np.inf
        title = f"{name}, {spaced(len(pose.cloud))}"
        rows.append([title, *(f"{first:.0f}, {later:.0f} ms" for first, later in least)])
    return markdown_table(["scan", *ways], rows, left=("scan",))


def _on_gpu(cloud: PointCloud) -> GpuPose:
    return GpuPose(renderer().gpu, Pose(0, 0.0, "", cloud))


def _drawing(
    pose: GpuPose, camera: Camera, size: tuple[int, int], params: dict[str, object]
) -> tuple[Callable[[], object], Surface]:
    """What draws a pose, and onto what."""
    surface = Surface(renderer().gpu, size)
    surface.start(pose, View.of(camera, size, pose.origin, pose.bounds))
    return partial(SURFELS.draw, pose, FrameView(surface.view, SURFELS.params(params)), surface), surface


def _least(works: Sequence[Callable[[], object]]) -> list[float]:
    """Processor time of each over two cores, ms: the least of three, in turns."""
    least = [np.inf] * len(works)
    for turn in range(4):
        for number, work in enumerate(works):
            ms = processor_ms(work) / 2
            least[number] = min(least[number], ms) if turn else np.inf
    return least


if __name__ == "__main__":
    remeasure_tables(PAGE, defaults, costs, pods, sphere, flicker, ellipses, speed, near_and_far)

"""Surfels: errors of radii and passes, holes, flicker, and time by instancing.

`costs`, `speed` and the times of `near_and_far` differ between machines; the rest is the same with the same
driver. `pods`, `sphere` and `ellipses` need no data folder."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from experiments.pictures import SHADING, draw, drawn, error_cells, errors_of, renderer, request, scene
from experiments.script import Script
from experiments.tables import Row, spaced
from experiments.timing import CORES, Taken, by_turns
from viewer.backends import FrameView, backend
from viewer.bench import metrics
from viewer.bench.judge import Judge, Walk
from viewer.bench.scenes import samples
from viewer.bench.scenes.defects import changed, thinned
from viewer.bench.scenes.subjects import Subject
from viewer.bench.truth.head_mesh import head_mesh
from viewer.bench.truth.shapes import AnalyticScene, Sphere
from viewer.bench.truth.surface import reference_surface
from viewer.camera import Camera
from viewer.gpu.pose import GpuPose
from viewer.look import Look
from viewer.mesh.reference import trace, visible_pixels
from viewer.mesh.triangles import Mesh
from viewer.picture.surface import Surface
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose
from viewer.scan.spacing import typical_spacing
from viewer.simulate.scanner import Faults, around, capture, rig
from viewer.view import View

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
    whole = scene(name.removesuffix(THINNED))
    return changed(whole, name, [thinned]) if name.endswith(THINNED) else whole


def cloud_of(arrays: samples.Arrays) -> PointCloud:
    """The points of a sample."""
    return PointCloud.from_arrays(**arrays)  # type: ignore[arg-type]


def even_sphere(count: int, radius: float = 1.0) -> PointCloud:
    """Discs on a sphere about the origin, of 1.5 spacings."""
    arrays = samples.on_sphere(count)
    scaled = {name: radius * arrays[name] for name in ("positions", "radii")}
    return cloud_of({**arrays, **scaled})


def defaults(_: Namespace) -> Iterator[Row]:
    """Errors of one radius for all and the nearest disc, then of the defaults."""
    settings: list[dict[str, object]] = [{"radius": "uniform", "passes": "one"}, {}]
    for name in (*SCANS, *(name + THINNED for name in UNEVEN)):
        subject = scan(name)
        one, usual = errors_of(subject, "surfels", settings, 4, (400, 300))
        title = f"{name.replace(THINNED, ', thinned')}, {spaced(len(subject.moment(0).pose.cloud))}"
        yield {"scan": title, **error_cells(one), **error_cells(usual, "default: ")}


def pods(_: Namespace) -> Iterator[Row]:
    """Holes, spill and outlines of what two pods see of the demo's head, without and with enlarging."""
    mesh, size = head_mesh(0.0), (960, 640)
    seers = rig(mesh.bounds, around(2), aspect=4 / 3, up="+y")
    scans = capture(mesh, seers, (640, 480), [Faults(noise=0.5)] * 2, seed=0, frame=0)
    cloud = Pose.of(0, 0.0, "", scans).cloud
    for name, azimuth, elevation in (
        ("front", 0, 0),
        ("40° left, 10° up", -40, 10),
        ("70° right", 70, 0),
        ("50° up", 0, 50),
    ):
        camera = Camera.orbit(mesh.bounds, azimuth, elevation, aspect=1.5)
        truth = trace(mesh, camera, size)
        seen, outline = visible_pixels(mesh, truth, seers), np.count_nonzero(metrics._outline(truth.covered))
        row = {"view": name}
        for form, enlarge in (("d", 1.0), ("f", 2.0)):
            shown = covered(picture(cloud, camera, size, passes="two", enlarge=enlarge))
            row[f"holes {form}"] = f"{100 * np.count_nonzero(seen & ~shown) / np.count_nonzero(seen):.3f} %"
            row[f"spill {form}"] = f"{np.count_nonzero(shown & ~truth.covered) / outline:.2f} px"
            apart = metrics.coverage(shown, truth.covered)["boundary_mean"]
            row[f"distance of outlines {form}"] = f"{apart:.2f} px"
        yield row


def sphere(_: Namespace) -> Iterator[Row]:
    """PSNR of shading."""
    variants = {
        "`one`": ("one", 1.0),
        "`two`, 1": ("two", 1.0),
        "`two`, 2": ("two", 2.0),
        "`sorted`": ("sorted", 1.0),
    }
    for count in (5_000, 20_000, 100_000):
        cloud, size = even_sphere(count), (480, 360)
        camera = Camera.orbit(cloud.bounds(), 40, 25, aspect=4 / 3)
        truth = trace(AnalyticScene((Sphere(),)), camera, size)
        row = {"points": spaced(count)}
        for name, (passes, enlarge) in variants.items():
            surface = picture(cloud, camera, size, SHADING, passes=passes, enlarge=enlarge)
            reference = reference_surface(truth, surface.gpu, SHADING).image()
            row[name] = f"{metrics.color(surface.image(), reference, truth.covered)['psnr']:.1f}"
        yield row


def ellipses(_: Namespace) -> Iterator[Row]:
    """Pixels that stay open of a cylinder, but for its ends, and pixels beside it."""
    camera, size = Camera((0.0, 0.0, 6.0), (0, 0, 0), fov_y=45), (320, 240)
    truth = trace(tall_cylinder(), camera, size)
    body = truth.covered.copy()
    body[truth.covered] = np.abs(truth.positions()[:, 1]) < 1.5
    ellipse = cloud_of(samples.rings(8, 60))
    along, across = ellipse.axes[0, 1], ellipse.axes[0, 3]  # type: ignore[index]

    def circles(cloud: PointCloud, radius: float) -> PointCloud:
        return replace(cloud, axes=None, radii=np.full(len(cloud), radius, np.float32))

    def in_rings(count: int) -> PointCloud:
        return circles(cloud_of(samples.rings(count, 60)), 0.75 * 4 / count)

    splats = {
        "ellipses": ellipse,
        "circles of their area": circles(ellipse, np.sqrt(along * across)),
        "circles as large as they are long": circles(ellipse, along),
        **{f"such circles in {count} rings": in_rings(count) for count in (20, 40)},
    }
    for name, cloud in splats.items():
        shown = covered(picture(cloud, camera, size, cull_back=True))
        counts = np.count_nonzero(body & ~shown), np.count_nonzero(shown & ~truth.covered)
        yield {
            "splats": name,
            "points": str(len(cloud)),
            **dict(zip(("open", "beside"), map(str, counts), strict=True)),
        }


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


def flicker(_: Namespace) -> Iterator[Row]:
    """Flicker of normals and PSNR of shading of Igea, by how large splats are."""
    mesh = scene("igea").moment(0).mesh
    cameras = [Camera.orbit(mesh.bounds, 10 + 2 * step, 10, aspect=1.5) for step in range(4)]
    variants: dict[str, dict[str, object]] = {
        "nearest": {"passes": "one", "epsilon": 0.0},
        "`one`": {"passes": "one"},
        "`two`, 1": {"passes": "two", "enlarge": 1.0},
        "`two`, 2": {"passes": "two", "enlarge": 2.0},
    }
    for count, size in ((140_000, (480, 320)), (560_000, (480, 320)), (560_000, (240, 160))):
        bare = samples.on_mesh(mesh, count, 0)
        radius = 1.5 * typical_spacing(bare)
        cloud = replace(bare, radii=np.full(count, radius, np.float32))
        judges = [Judge.of(renderer().gpu, mesh, camera, size, SHADING, cloud, None) for camera in cameras]
        walk = Walk(judges, [None] * (len(judges) - 1))
        view = View.of(cameras[0], size, cloud.origin, cloud.bounds())
        pixels = radius * view.scale / cameras[0].distance
        row = {"radius": f"{pixels:.2f} pixels"}
        for name, params in variants.items():
            frames = [picture(cloud, camera, size, SHADING, **params) for camera in cameras]
            more = walk.flicker(iter(frames), "orbit")["flicker_orbit_normal"]
            inside = judges[0].reference.covered
            psnr = metrics.color(frames[0].image(SHADING), judges[0].image, inside)["psnr"]
            row[name] = f"{more:.2f}°, {psnr:.1f} dB"
        yield row


def speed(_: Namespace) -> Iterator[Row]:
    """Processor time of each variant, the least of three, in turns."""
    size = (1280, 800)
    variants: dict[str, dict[str, object]] = {
        "`one`": {"passes": "one"},
        "`two`, 1": {"passes": "two", "enlarge": 1.0},
        "`two`, 2": {"passes": "two", "enlarge": 2.0},
        "`one` by `gs`": {"passes": "one", "instancing": "gs"},
        "`two`, 2 by `gs`": {"passes": "two", "enlarge": 2.0, "instancing": "gs"},
    }
    shells = [even_sphere(20_000, radius) for radius in (1.0, 0.9, 0.8, 0.7, 0.6)]
    clouds = {
        "demo, 86 361 points": scene("demo").moment(0).pose.cloud,
        "dragon, 100 250": scene("dragon-100k").moment(0).pose.cloud,
        "five spheres in one another, 100 000": PointCloud.from_arrays(
            np.concatenate([shell.positions for shell in shells]),
            normals=np.concatenate([shell.normals for shell in shells]),
            radii=np.concatenate([shell.radii for shell in shells]),
        ),
        "sphere, 1 million": even_sphere(1_000_000),
    }
    for name_of_cloud, cloud in clouds.items():
        pose, camera = _on_gpu(cloud), Camera.orbit(cloud.bounds(), 30, 15, aspect=size[0] / size[1])
        for culled in (False, True):
            usual = {"instancing": "tiles", "cull_back": culled}
            works = {
                name: _drawing(pose, camera, size, {**usual, **params})[0]
                for name, params in variants.items()
            }
            busy = {name: taken.busy / CORES for name, taken in _least(works).items()}
            ratios = {
                f"`two`, 2 : {name}": f"{busy['`two`, 2'] / busy[name]:.1f}" for name in ("`two`, 1", "`one`")
            }
            times = {name: f"{ms:.0f} ms" for name, ms in busy.items()}
            yield {"scene": name_of_cloud, "back faces": "culled" if culled else "", **times, **ratios}


def near_and_far(_: Namespace) -> Iterator[Row]:
    """Processor time of one pass by the rasteriser and by tiles; how many points these sent to their pixels,
    and how many pixels show another point."""
    small, large = (480, 320), (960, 640)
    along, low = Camera((0.2, 0.1, 0), (0.1, 0, -1), fov_y=60), Camera((0, 0.06, 1), (0, 0.03, 0), fov_y=60)
    end, close = Camera((0, 0, 9), (0, 0, 0), fov_y=40), Camera((0, 0, 1.3), (0, 0, 0), fov_y=60)
    hall, more = (cloud_of(samples.hall(count)) for count in (600_000, 1_800_000))
    scenes = [
        ("round hall", hall, along, small),
        ("round hall", hall, along, large),
        ("round hall", more, along, large),
        ("hills seen along", cloud_of(samples.hills(3_000_000)), low, large),
        ("ellipsoid 1:6 from its end", long_ellipsoid(1_000_000), end, small),
        ("sphere from close by", even_sphere(3_000_000), close, large),
    ]
    for name, cloud, camera, size in scenes:
        pose = _on_gpu(cloud)
        feeds = {"rasterised": "gs", "tiles": "tiles"}
        drawings = {
            name: _drawing(pose, camera, size, {"passes": "one", "instancing": feed})
            for name, feed in feeds.items()
        }
        least = _least({name: work for name, (work, _) in drawings.items()})
        by_quads, by_tiles = (surface for _, surface in drawings.values())
        sent = by_tiles.stats.skipped.get("lists of small splats", "").partition(" ")[0].replace(",", "")
        others = int(np.count_nonzero(by_quads.row != by_tiles.row))
        named = {"scene": f"{name}, {spaced(len(cloud))}", "size": f"{size[0]}x{size[1]}"}
        times = {feed: f"{taken.busy / CORES:.0f} ms" for feed, taken in least.items()}
        yield {**named, **times, "points sent": spaced(int(sent or 0)), "other points": spaced(others)}


def long_ellipsoid(count: int) -> PointCloud:
    """Six times as long along z as wide, its points dense at the ends."""
    arrays = samples.on_sphere(count)
    normals = arrays["normals"] / [1.0, 1.0, 6.0]
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    radii = arrays["radii"] * 6**0.5  # as large as the area of a point in the mean
    return PointCloud.from_arrays(arrays["positions"] * [1.0, 1.0, 6.0], normals=normals, radii=radii)


def costs(_: Namespace) -> Iterator[Row]:
    """Processor time of the first picture of a pose and of those that follow, the least of five, in turns."""
    size = (960, 640)
    variants: dict[str, tuple[dict[str, object], bool]] = {
        "one for all, nearest": ({"radius": "uniform", "passes": "one"}, False),
        "at rest": ({}, False),
        "in motion": ({}, True),
    }
    for scan_name in ("armadillo", "igea"):
        pose = scan(scan_name).moment(0).pose
        camera = Camera.orbit(pose.bounds, 30, 15, aspect=1.5)
        works: dict[str, Callable[[], object]] = {}
        for name, (params, moving) in variants.items():
            works |= _first_and_later(pose, camera, size, name, params, moving)
        busy = {name: taken.busy / CORES for name, taken in _least(works, 5).items()}
        times = {title: f"{busy[title]:.0f}, {busy[f'{title}, later']:.0f} ms" for title in variants}
        yield {"scan": f"{scan_name}, {spaced(len(pose.cloud))}", **times}


def _first_and_later(
    pose: Pose, camera: Camera, size: tuple[int, int], name: str, params: dict[str, object], moving: bool
) -> dict[str, Callable[[], object]]:
    """Works by name: a picture of a pose that the renderer has not seen, and the same once more."""
    last: list[tuple[object, Surface]] = []

    def first() -> None:
        last[:] = [(request(replace(pose), camera, "surfels", params), Surface(renderer().gpu, size))]
        later()

    def later() -> None:
        draw(*last[0], moving=moving)  # type: ignore[arg-type]

    return {name: first, f"{name}, later": later}


def _on_gpu(cloud: PointCloud) -> GpuPose:
    return GpuPose(renderer().gpu, Pose(0, 0.0, "", cloud))


def _drawing(
    pose: GpuPose, camera: Camera, size: tuple[int, int], params: dict[str, object]
) -> tuple[Callable[[], object], Surface]:
    """What draws a pose, and onto what."""
    surface = Surface(renderer().gpu, size)
    surface.start(pose, View.of(camera, size, pose.origin, pose.bounds))
    return partial(SURFELS.draw, pose, FrameView(surface.view, SURFELS.params(params)), surface), surface


def _least(works: dict[str, Callable[[], object]], rounds: int = 3) -> dict[str, Taken]:
    """The least times of works, in turns."""
    return by_turns(works, rounds, renderer().gpu.ctx.finish, of="least")


EXPERIMENT = Script(
    [defaults, costs, pods, sphere, flicker, ellipses, speed, near_and_far], page="surfels.md"
)

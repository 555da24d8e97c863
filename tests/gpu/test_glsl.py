"""Shaders as they reach the driver: every file of them, in the variants that pictures take."""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from dataclasses import replace
from functools import partial
from itertools import islice, product
from pathlib import Path
from typing import Any

import filling
import finding
import numpy as np
import packed
import pytest
import sampling
from range_scenes import sphere_view
from scenes import DRAWS_POINTS, sphere, sphere_mesh
from test_bins import filled, some_visits
from test_compact import flagged
from test_pyramid import FILTERS, chain, picture
from test_range_samples import held, probe, seen_by, stepped_view

from viewer.backends import Backend, backend, backends
from viewer.backends.voxels import cuts
from viewer.bench import baselines
from viewer.camera import Camera
from viewer.drawing.frame import render_frame, supersample
from viewer.drawing.renderer import Renderer
from viewer.drawing.request import Request
from viewer.gpu import chunks, gl
from viewer.gpu.bindings import Storage, Texture, UniformBlock
from viewer.gpu.context import Gpu, headless
from viewer.gpu.pyramid import Image, expand
from viewer.gpu.scatter import OnePass
from viewer.gpu.shader import Source
from viewer.look import Look
from viewer.picture.present import Presenter
from viewer.picture.soften import soften
from viewer.picture.surface import Surface
from viewer.resources import resource_path
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose
from viewer.splatting.amplify import FEEDS
from viewer.splatting.packed import VARIANTS, draw_splats
from viewer.task import Task

TESTS_OWN = str(Path(__file__).resolve().parents[1])  # where tests have shaders of their own
SIZE = (96, 64)
PASSES = ("one", "two", "one_blended", "one_no_depth", "visibility", "two_large", "sorted", "as_printed")
CAMERA = {"azimuth": 30.0, "elevation": 20.0, "aspect": SIZE[0] / SIZE[1]}
LOOKS = [
    *(Look(color_by=color) for color in ("plain", "normal", "depth", "height", "height_of", "id", "level")),
    *(Look(light=light, eye_dome=dome) for light, dome in product(("flat", "head", "fixed"), (False, True))),
    Look(holes=True),
]


def clouds() -> Iterator[PointCloud]:
    """Points with all that a scan may have, a splat being large; the same with half-axes; and with little."""
    cloud = sphere(1500)
    assert cloud.normals is not None
    assert cloud.radii is not None
    positions, radii = cloud.positions.copy(), cloud.radii.copy()
    positions[-1] = np.nan  # left out: those that stay have ids of their own
    eye = Camera.orbit(cloud.bounds(), **CAMERA).eye
    radii[np.argmin(np.abs(cloud.normals @ eye))] = 100.0  # on edge, so that it hides little
    axes = np.column_stack([np.cross(cloud.normals, [0.0, 0.6, 0.8]) * radii[:, None], 0.5 * radii])
    numbers = {"height_of": cloud.normals[:, 1]}
    for some_axes in (None, axes):
        yield PointCloud.from_arrays(
            positions,
            normals=cloud.normals,
            colors=cloud.colors,
            radii=radii,
            axes=some_axes,
            scalars=numbers,
        )
    yield PointCloud.from_arrays(cloud.positions, normals=cloud.normals, scalars=numbers)


def range_poses() -> Iterator[Pose]:
    """Range views of one kind, and of several, with lens distortion and measured x and y."""
    pods = tuple(sphere_view(eye) for eye in ((0, 0, 3), (3, 0, 0)))
    yield Pose.of(0, 0.0, "one kind", pods)
    heights = stepped_view((40, 30), "height", measured=True)
    bent = replace(pods[1], kind="range", distortion=(0.1, -0.02, 0.001, 0.002), color=None)
    yield Pose.of(0, 0.0, "several", (pods[0], heights, bent))


def settings() -> Iterator[tuple[str, dict[str, object]]]:
    """Each backend with its defaults, and with each word and switch of one of its parameters."""
    for one in backends().values():
        yield one.name, {}
        for parameter in one.parameters:
            for value in parameter.choices or ((True, False) if parameter.type is bool else ()):
                yield one.name, {parameter.name: value}


def draw_all(renderer: Renderer, whole: bool) -> None:
    """A picture of each kind, so that each program is built. Not whole: one setting after the other, of
    a scan with much in it."""
    surface = Surface(renderer.gpu, SIZE)
    flat = Pose(0, 0.0, "test", sphere(100))
    request = Request(flat, Camera.orbit(flat.bounds, **CAMERA), "points")
    render_frame(renderer, request, surface)
    supersample(renderer, request, surface)
    touching = replace(request, params=backend("points").params({"point_size": 0}))
    render_frame(renderer, touching, surface)
    render_frame(renderer, touching, surface, share=0.5, moving=True, before=surface)
    soften(surface)

    def draw(
        scanned: PointCloud | Pose,
        which: str | Backend,
        look: Look = LOOKS[0],
        projection: str = "perspective",
        share: float = 1.0,
        **params: object,
    ) -> None:
        pose = scanned if isinstance(scanned, Pose) else Pose(0, 0.0, "test", scanned)
        camera = Camera.orbit(pose.bounds, projection=projection, **CAMERA)
        given = backend(which).params(params) if isinstance(which, str) else None
        render_frame(renderer, Request(pose, camera, which, given, look), surface, share=share)

    rich, *others = clouds()
    for cloud in (rich, *others) if whole else (rich,):
        draw_points(draw, cloud)
        if whole:
            draw_pairs(draw, renderer, cloud)
    draw(others[-1], "surfels")  # whose radii are not known
    for pose in islice(range_poses(), 0 if whole else 1, None):
        draw_range_views(draw, pose, whole)
    draw(sphere(1500), "surfels", radius_scale=0.01)
    mesh = sphere_mesh(16)
    draw(mesh.points, baselines.mesh(mesh))
    Presenter(renderer.gpu).release()


def draw_points(draw: Callable[..., None], cloud: PointCloud) -> None:
    """Pictures of points, each with one setting other than the default."""
    for name, setting in settings():
        if name in DRAWS_POINTS:
            draw(cloud, name, **setting)
    for look in LOOKS:
        draw(cloud, "points", look)
        draw(cloud, filling.BACKEND, look)
    for instancing, shape in product(("tiles", *FEEDS), ("discs", "cubes", "flat_cubes")):
        draw(cloud, "voxels", instancing=instancing, shape=shape)
    draw(cloud, "voxels", shape="cubes", least=1.4)  # of all sizes
    draw(cloud, baselines.gl_points())
    for one in (*backends().values(), finding.BACKEND):
        for name in one.values:
            draw(cloud, one, Look(color_by=name))


def draw_range_views(draw: Callable[..., None], pose: Pose, whole: bool) -> None:
    """Pictures of range views. whole: also with several settings other than the defaults."""
    for name, setting in settings():
        if name in ("pyramidal", "laplacian"):
            draw(pose, name, **setting)
    draw(pose, "laplacian", Look(light="flat"), detail=2.0)
    if not whole:
        return
    draw(pose, "pyramidal", Look(light="flat"), primitive="points", fill=False, hide=False)
    draw(pose, "pyramidal", projection="orthographic", primitive="points", cull_back=True)
    for mode, kernel in product(("table", "analytic"), ("3x3", "5x5")):
        draw(pose, "pyramidal", primitive="points", antialias=mode, kernel=kernel)


def draw_pairs(draw: Callable[..., None], renderer: Renderer, cloud: PointCloud) -> None:
    """Pictures of points for which several settings are other than the defaults."""
    for instancing, passes, share in product(("tiles", *FEEDS), ("one", "two"), (1.0, 0.5)):
        draw(cloud, "surfels", instancing=instancing, passes=passes, share=share)
    for instancing, passes in product(("tiles", "gs"), PASSES):
        draw(cloud, "surfels", projection="orthographic", instancing=instancing, passes=passes)
        draw(cloud, "surfels", instancing=instancing, passes=passes, cull_back=True)
    for passes, projection in product(("one", "two"), ("perspective", "orthographic")):
        with pytest.MonkeyPatch.context() as patched:
            patched.setattr(renderer.gpu, "software", False)  # how tiles are shared out on hardware
            draw(cloud, "surfels", projection=projection, instancing="tiles", passes=passes)
    draw(cloud, "surfels", radius="uniform", radius_scale=0.01)  # of about a pixel
    for size, share in product((1, 3), (1.0, 0.5)):
        draw(cloud, "points", share=share, point_size=size)
    for look in LOOKS:
        draw(cloud, "surfels", look, passes="two")


def draw_samples(renderer: Renderer) -> None:
    """Pictures whose rows are samples, of views that need little of the shaders and of some that need all."""
    view, measured = stepped_view((7, 5)), stepped_view((7, 5), "height", True)
    bent = replace(stepped_view((7, 5), "range"), distortion=(-0.1, 0.0, 0.0, 0.0))
    surface = Surface(renderer.gpu, SIZE)
    for views in ((view,), (view, measured, bent)):
        pose = Pose.of(0, 0.0, "test", views)
        camera = Camera.orbit(pose.bounds, **CAMERA)
        for look in (look for look in LOOKS if look.color_by != "height_of"):
            render_frame(renderer, Request(pose, camera, sampling.BACKEND, look=look), surface)
            for channel in ("color", "normal", "value"):
                surface.resolve(channel)


def draw_packed(renderer: Renderer, whole: bool) -> None:
    """Pictures of splats that a compute pass packed; not whole: without what a splat may lack."""
    surface = Surface(renderer.gpu, SIZE)
    large = list(clouds())[1]
    for cloud, listed in product((sphere(1500), large), (True, False)) if whole else ((large, True),):
        splats = packed.Packed.of(cloud)
        few = replace(splats, rows=np.arange(len(cloud), dtype=np.uint32)) if listed else splats
        kinds = product((cloud.colors, None), (True, False)) if whole else ((cloud.colors, True),)
        for colors, ellipses in kinds:
            bare = PointCloud.from_arrays(cloud.positions, colors=colors)
            pose = Pose(0, 0.0, "test", bare)
            camera = Camera.orbit(pose.bounds, **CAMERA)
            for way, two, refine in product(VARIANTS, (True, False), (True, False)):
                drawing = partial(draw_splats, instancing=way, two=two, refine=refine)
                render_frame(renderer, Request(pose, camera, packed.backend(few, drawing, ellipses)), surface)


def at_once(_: Task, work: Callable[[], Any]) -> Future[Any]:
    """Work that is done before the next picture."""
    future: Future[Any] = Future()
    future.set_result(work())
    return future


def draw_chunks(renderer: Renderer) -> None:
    """Pictures of points of which chunks are left out, in the order of the file and in another one."""
    cloud, (_, rich, *_) = sphere(1500), clouds()
    for ordered, size in product((chunks.in_file_order, chunks.in_coarse_order), (1, 9)):
        with pytest.MonkeyPatch.context() as patched:
            patched.setattr(chunks, "LEAST", 1)
            patched.setattr(chunks, "_SCATTERED", 2.0)
            patched.setattr(chunks, "_LOOSE", 2.0)
            patched.setattr(chunks, "in_file_order", ordered)
            patched.setattr(chunks, "in_background", at_once)
            pose, surface = Pose(0, 0.0, "test", cloud), Surface(renderer.gpu, (40, 30))
            camera = Camera.orbit(pose.bounds, **CAMERA)
            for shown in (False, False, True):
                params = backend("points").params({"point_size": size, "hide_hidden": shown})
                render_frame(renderer, Request(pose, camera, "points", params), surface)
            assert surface.stats.counted
            if size > 1:
                continue
            for scan, params in ((cloud, {}), (rich, {"instancing": "gs", "cull_back": True})):
                pose = Pose(0, 0.0, "test", scan)
                for _ in range(3):
                    splats = Request(pose, camera, "surfels", backend("surfels").params(params))
                    render_frame(renderer, splats, surface)
                assert surface.stats.counted


def draw_noisy(renderer: Renderer) -> None:
    """Pictures of a noisy surface: of the local surface, by tiles and by a feed, and of steadied planes."""
    cloud, rng = sphere(1500), np.random.default_rng(1)
    noisy = replace(cloud, positions=cloud.positions + rng.normal(0, 2, (len(cloud), 3)).astype(np.float32))
    surface = Surface(renderer.gpu, (40, 30))
    for name, values in (("surfels", {}), ("surfels", {"instancing": "gs"}), ("auto_splats", {})):
        pose = Pose(0, 0.0, "noisy", noisy)
        request = Request(pose, Camera.orbit(pose.bounds, **CAMERA), name, backend(name).params(values))
        render_frame(renderer, request, surface)
    assert "local" in surface.stats.chosen["surface"]


def draw_nodes(renderer: Renderer) -> None:
    """Octants that shaders find, as graphics cards do, with all that they may have."""
    _, rich, *_ = clouds()
    surface = Surface(renderer.gpu, (40, 30))
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(cuts, "BY_SHADERS", True)
        pose = Pose(0, 0.0, "test", rich)
        request = Request(pose, Camera.orbit(pose.bounds, **CAMERA), "voxels", backend("voxels").params())
        render_frame(renderer, request, surface)


def use_primitives(gpu: Gpu) -> None:
    """What backends may use of each primitive, whether one does or not."""
    gpu.activate()
    gpu.clears_by_shader = True
    gpu.clear(gpu.buffer(reserve=64), 0)
    cells = [gl.BufferTexture(gpu.buffer(reserve=64), gl.R32UI) for _ in range(2)]
    nearest = OnePass(gpu, *cells)
    nearest.show_keys()
    nearest.finish(None)
    flagged(gpu, np.arange(5000) % 3 == 0)
    for ordered in (False, True):
        filled(gpu, some_visits(100, 30), 30, ordered)
    for channels, how in product(range(1, 5), FILTERS.values()):
        levels = chain(gpu, *picture((5, 3), channels), how)
        fine, coarse = levels.levels[:2]
        result = Image(gpu, fine.size, channels)
        expand(gpu, coarse, result, how)
        gpu.discard(levels, result)
    view, measured = stepped_view((7, 5)), stepped_view((7, 5), "height", True)
    bent = replace(stepped_view((7, 5), "range"), distortion=(-0.1, 0.0, 0.0, 0.0))
    for views, how in product(((view,), (view, measured, bent)), FILTERS.values()):
        samples = held(gpu, views, how=how)
        for tiles in (True, False):
            probe(samples, seen_by(view), 0, 0, tiles)
        samples.release()


@pytest.fixture(scope="module", params=["most", pytest.param("all", marks=pytest.mark.slow)])
def programs(request: pytest.FixtureRequest) -> list[list[Source]]:
    """The stages of each program that pictures take, and primitives. Most: of a scan with much in it and one
    setting after the other, which has all files; all: of what scans lack too, and of settings together."""
    whole = request.param == "all"
    renderer = Renderer(headless())
    draw_all(renderer, whole)
    draw_samples(renderer)
    draw_packed(renderer, whole)
    draw_chunks(renderer)
    draw_noisy(renderer)
    draw_nodes(renderer)
    use_primitives(renderer.gpu)
    renderer.release()
    return [program.extra.sources for program in renderer.gpu._programs.values()]


def test_every_shader_file_is_built(programs: list[list[Source]]) -> None:
    folder = Path(str(resource_path("shaders")))
    files = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}
    used = {file for program in programs for stage in program for file in stage.files}
    own = {file for file in used if not file.startswith(("<", TESTS_OWN)) and not Path(file).is_absolute()}
    assert own == files


def test_the_reference_compiler_takes_every_program(programs: list[list[Source]], tmp_path: Path) -> None:
    validator = shutil.which("glslangValidator")
    if validator is None:
        pytest.skip("no glslangValidator; Debian has it in glslang-tools")
    # It knows of fewer texture units than OpenGL 4.3 has at least.
    limits = tmp_path / "limits.conf"
    told = subprocess.run([validator, "-c"], capture_output=True, text=True, check=True).stdout
    limits.write_text(re.sub(r"(MaxCombinedTextureImageUnits) \d+", r"\1 96", told), encoding="utf-8")
    stages: dict[str, Source] = {}
    alone, linked = [], []  # arguments
    for number, program in enumerate(programs):
        paths = [str(tmp_path / f"{number}{Path(stage.name).suffix}") for stage in program]
        for path, stage in zip(paths, program, strict=True):
            Path(path).write_text(stage.text, encoding="utf-8")
            stages[path] = stage
        if len(program) == 1:
            alone += paths
        else:
            linked.append(["-l", *paths])
    complaints = set()
    for arguments in (alone, *linked):
        done = subprocess.run(
            [validator, str(limits), *arguments], capture_output=True, text=True, check=False
        )
        assert done.returncode == 0 or done.stdout, done.stderr
        for line in done.stdout.splitlines():
            stage = stages.get(line, stage)  # it names a file, then tells of it
            if line.startswith(("ERROR", "WARNING")):
                complaints.add(f"{stage.name}: {stage.explain(line)}")
    assert not complaints


def test_no_program_uses_a_binding_for_two_things(programs: list[list[Source]]) -> None:
    """Of all that its stages name, in parts that were compiled or not."""
    for program in programs:
        text = "".join(stage.body for stage in program)
        for kind, table in (("TEXTURE", Texture), ("STORAGE", Storage), ("BLOCK", UniformBlock)):
            names = set(re.findall(rf"\bbinding = {kind}_(\w+)", text))
            numbers = {table[name] for name in names}
            assert len(numbers) == len(names), f"{[stage.name for stage in program]}: {sorted(names)}"


def test_no_stage_reads_more_textures_than_every_driver_has(programs: list[list[Source]]) -> None:
    for stage in {stage.text: stage for program in programs for stage in program}.values():
        names = set(re.findall(r"\bbinding = TEXTURE_(\w+)", stage.body))
        assert len(names) <= 16, f"{stage.name}: {sorted(names)}"


def test_no_shader_has_an_array_of_bool(programs: list[list[Source]]) -> None:
    """Mesa's Zink reads them as integers of one bit, which SPIR-V lacks: tests/drivers/zink_bool_array.py."""
    texts = "".join({stage.text for program in programs for stage in program})
    assert not re.findall(r"^\s*bool\s+\w+\s*\[.*$", texts, re.MULTILINE)

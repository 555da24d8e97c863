"""The scenes of the benchmark by name, and meshes of your own."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Literal

import numpy as np

from ...errors import InputError, unknown_name
from ...mesh.triangles import Mesh, read_mesh
from ...scan.demo import DemoSource
from ...scan.open import find_source
from ...scan.points import PointCloud
from ...scan.pose import Pose
from ...scan.reading.times import counted_times
from ...scan.sources import FrameSource
from ...scan.spacing import typical_spacing
from ...scan.times import DEFAULT_FPS
from ..truth import tessellation
from ..truth.shapes import AnalyticScene, AnalyticSurface, Cuboid, Plane, Sphere, Torus
from . import samples
from .arrangements import in_lattice, on_its_head, outside_sheets, with_sheets
from .defects import SIGMAS, Change, by_turns, changed, noisy, thinned, with_strays, without_normals
from .real_scans import DepthFrames
from .samples import Sampler
from .simulated import simulated
from .subjects import Moment, Subject, smooth, with_rows

_STANFORD = "Stanford Computer Graphics Laboratory"
_CYBERWARE = "Cyberware"
_COUNT = 100_000  # points of an analytic scene
_NOISE = 0.5  # of a virtual scanner, in footprints of its pixels
_NOISES = (0.2, 0.5)  # of scans made noisy, in the points' spacing
_SHEETS_COUNT = 50_000  # before those inside the body are left out
_HEAD_TOLERANCE = 0.5  # mm: 99 % of the mesh is within 0.07 mm of the exact surface
_PHONE = "range/truedepth_head_30"
_PHONE_TOLERANCE = 2e-3  # m
_MOST_POINTS = 100_000_000

Sweep = Literal["n", "noise"]  # what may vary of a scene


@dataclass(frozen=True)
class _Request:
    """A scene that is asked for. paths: what it needs; noise: in pixel footprints of the scanner."""

    name: str
    paths: tuple[Path, ...]
    count: int | None
    noise: float
    seed: int


@dataclass(frozen=True)
class _Scene:
    """How a scene is made. needs: what of the data folder; counts: whether it comes in any number of points.

    count: how many it has unless stated; None: that is known when it is read. noise: what the scanner's is
    unless stated; None: there is no virtual scanner.
    """

    make: Callable[[_Request], Subject]
    needs: tuple[str, ...] = ()
    counts: bool = False
    count: int | None = None
    noise: float | None = None


def _analytic(shape: AnalyticSurface, sampler: Sampler, mesh: Callable[[], Mesh]) -> _Scene:
    def make(request: _Request) -> Subject:
        def load(_: int) -> Moment:
            cloud = samples.cloud(sampler, request.count or _COUNT)
            return Moment(Pose(0, 0.0, request.name, cloud), AnalyticScene((shape,)), mesh())

        return Subject(name=request.name, load=load)

    return _Scene(make, counts=True, count=_COUNT)


def _one_mesh(load: Callable[[_Request], Mesh], *needs: str, credit: str = "", up: str = "+y") -> _Scene:
    """A mesh that does not move."""

    def make(request: _Request) -> Subject:
        def moment(_: int) -> Moment:
            return _of_mesh(load(request), request, 0, 0.0, request.name)

        return Subject(name=request.name, load=moment, up=up, credit=credit)

    return _Scene(make, needs, counts=True)


def _stored(request: _Request, inside_out: bool = False) -> Mesh:
    """The mesh of a file. inside_out: whether its faces run clockwise as stored."""
    stored = read_mesh(request.paths[0])
    return smooth(Mesh(stored.points, stored.faces[:, ::-1]) if inside_out else stored)


def _model(file: str, credit: str, up: str = "+y", inside_out: bool = False) -> _Scene:
    return _one_mesh(partial(_stored, inside_out=inside_out), f"models/{file}", credit=credit, up=up)


def _file(request: _Request) -> Subject:
    """A mesh file that a user names: read at once, so that an error in it appears at once."""
    made = _one_mesh(_stored).make(request)
    try:
        made.moment(0)
    except InputError as error:
        hint = error.hint or (
            "Use a file with faces: a scene needs a mesh, not only points"
            if "no faces" in error.what
            else None
        )
        raise InputError(error.what, error.where or request.name, hint) from error
    return made


def _sequence(folder: str, credit: str, up: str = "+y") -> _Scene:
    """A mesh that moves: a folder of frames, their faces in the frames or once beside them."""

    def make(request: _Request) -> Subject:
        (path,) = request.paths
        source = find_source(path)
        labels = [source.label(index) for index in range(len(source))]
        times = counted_times(labels, DEFAULT_FPS)

        def load(index: int) -> Moment:
            return _of_mesh(_frame(source, index), request, index, float(times[index]), labels[index])

        return Subject(name=request.name, load=load, moments=len(source), up=up, credit=credit)

    return _Scene(make, (f"sequences/{folder}",), counts=True)


def _frame(source: FrameSource, index: int) -> Mesh:
    """The mesh of a frame."""
    points = source.load(index)
    assert isinstance(points, PointCloud), "a file with faces must also contain points"
    return smooth(Mesh(points, source.faces(index).triangles()))


def _of_mesh(mesh: Mesh, request: _Request, index: int, time: float, label: str) -> Moment:
    """The moment of a mesh whose vertices, or as many points of it as are asked for, are the scan.

    A vertex without a normal, between faces back to back, has no side and is no point of the scan.
    """
    assert mesh.points.normals is not None
    sided = np.flatnonzero(mesh.points.normals.any(axis=1))
    if not len(sided):
        raise InputError("all faces of the mesh have an area of zero", label)
    if request.count is None:
        cloud = with_rows(mesh.points, sided)
    else:
        cloud = samples.on_mesh(mesh, request.count, request.seed)
    return Moment(Pose(index, time, label, cloud), mesh, mesh)


def _demo(request: _Request) -> Subject:
    """The demo scan. Its points are exact, its truth is a mesh of the exact surface."""
    from ..truth.head_mesh import head_mesh

    source = DemoSource()
    times = source.times()

    def load(index: int) -> Moment:
        time, mesh = float(times[index]), head_mesh(float(times[index]))
        return Moment(Pose(index, time, source.label(index), source.load(index)), mesh, mesh)

    return Subject(name=request.name, load=load, moments=len(source), tolerance=_HEAD_TOLERANCE)


def _hand(_: _Request) -> Mesh:
    """The demo's head with a hand before its face."""
    from ..truth.hand_mesh import hand_before_face

    return hand_before_face()


def _laser(folder: str, model: str, tolerance: float) -> _Scene:
    """Laser scans, put together as they were for the model that was made of them."""

    def make(request: _Request) -> Subject:
        scans, truth = request.paths
        source = find_source(scans)

        def load(index: int) -> Moment:
            mesh = smooth(read_mesh(truth))
            return Moment(Pose.of(index, 0.0, source.label(index), source.load(index)), mesh, mesh)

        return Subject(name=request.name, load=load, tolerance=tolerance, credit=_STANFORD)

    return _Scene(make, (f"range/{folder}", f"models/{model}"))


def _phone(request: _Request) -> Subject:
    """A phone's depth images, a moment each."""
    frames = DepthFrames(*request.paths)
    return Subject(
        name=request.name,
        load=frames.moment,
        moments=len(frames),
        tolerance=_PHONE_TOLERANCE,
        credit="StandardCyborg",
    )


def _simulated(name: str, scene: _Scene, pods: int) -> _Scene:
    """A scene of what a virtual scanner sees of another scene."""

    def make(request: _Request) -> Subject:
        scanned = scene.make(replace(request, name=name))
        return simulated(scanned, request.name, pods, request.noise, request.seed)

    return replace(scene, make=make, counts=False, noise=_NOISE)


def _lattice(folder: str, counts: tuple[int, int, int], credit: str) -> _Scene:
    """The moments of a sequence of meshes side by side, at one moment."""

    def load(request: _Request) -> Mesh:
        source = find_source(request.paths[0])
        return in_lattice([_frame(source, index) for index in range(len(source))], counts)

    return _one_mesh(load, f"sequences/{folder}", credit=credit)


def _two_scales(file: str, credit: str) -> _Scene:
    """A model with itself on its head."""
    return _one_mesh(lambda request: on_its_head(_stored(request)), f"models/{file}", credit=credit)


def _spoilt(name: str, scene: _Scene, changes: Sequence[Change], noise: float = 0.0) -> _Scene:
    """Another scene with its points changed. noise: how far they are moved, in their spacing."""

    def make(request: _Request) -> Subject:
        sound = scene.make(replace(request, name=name))
        reach = SIGMAS * noise * typical_spacing(sound.moment(0).pose.cloud) if noise else None
        return changed(sound, request.name, changes, request.seed, reach)

    return replace(scene, make=make)


def _spoilt_in_all_ways(name: str, scene: _Scene) -> dict[str, _Scene]:
    """A mesh's scan without normals, of uneven density, and noisy."""
    return {
        f"{name}-bare": _spoilt(name, scene, [without_normals]),
        f"{name}-ramp": _spoilt(name, scene, [thinned]),
        f"{name}-ramp-bare": _spoilt(name, scene, [thinned, without_normals]),
        **{
            f"{name}-noise-{spacings}": _spoilt(name, scene, [noisy(spacings), without_normals], spacings)
            for spacings in _NOISES
        },
    }


def _sheets(request: _Request) -> Subject:
    """A body with thin parts."""

    def load(_: int) -> Moment:
        truth, mesh = with_sheets()
        cloud = outside_sheets(truth, samples.on_mesh(mesh, request.count or _SHEETS_COUNT, request.seed))
        return Moment(Pose(0, 0.0, request.name, cloud), truth, mesh)

    return Subject(name=request.name, load=load)


def _merged(folder: str, model: str, tolerance: float) -> _Scene:
    """Laser scans as one cloud, with normals of each scan: right, turned around, missing, by turns."""
    scene = _laser(folder, model, tolerance)

    def make(request: _Request) -> Subject:
        scanned = scene.make(request)

        def load(index: int) -> Moment:
            moment = scanned.moment(index)
            normals = by_turns([view.normals() for view in moment.pose.views])
            cloud = replace(moment.pose.cloud, normals=normals)
            return replace(moment, pose=replace(moment.pose, points=cloud))

        return replace(scanned, load=load)

    return replace(scene, make=make)


_ANALYTIC = {
    "sphere": _analytic(Sphere(), samples.on_sphere, tessellation.sphere_mesh),
    "plane": _analytic(Plane(), samples.on_square, tessellation.square_mesh),
    "box": _analytic(Cuboid(), samples.on_cube, tessellation.cube_mesh),
    "torus": _analytic(Torus(), samples.on_torus, tessellation.torus_mesh),
    "demo": _Scene(_demo),
    "hand-before-face": _one_mesh(_hand),
}
_MESHES = {
    "bunny": _model("stanford_bunny_35947.ply", _STANFORD),
    "armadillo": _model("stanford_armadillo_43243.ply", _STANFORD),
    "horse": _model("cyberware_horse_48485.ply", _CYBERWARE, up="+z", inside_out=True),
    "dragon-100k": _model("stanford_dragon_100250.ply", _STANFORD),
    "igea": _model("cyberware_igea_134345.ply", _CYBERWARE),
    "dragon": _model("stanford_dragon_437645.ply", _STANFORD),
    "crane": _sequence("crane_175", "Vlasic et al., MIT CSAIL"),
    "horse-gallop": _sequence("horse_gallop_48", "Sumner and Popovic"),
    "owlii": _sequence("owlii_basketball_player_10", "Owlii"),
}
_ARRANGED = {
    "two-bunnies": _two_scales("stanford_bunny_35947.ply", _STANFORD),
    "horses": _lattice("horse_gallop_48", (10, 4, 3), "Sumner and Popovic"),
}
_SCANNED = {name: _ANALYTIC[name] for name in ("torus", "demo", "hand-before-face")} | _MESHES
_SIMULATED = {
    f"{name}-{suffix}": _simulated(name, scene, pods)
    for suffix, pods in (("simulated", 4), ("pair", 2))
    for name, scene in _SCANNED.items()
}
_REAL = {
    "dragon-scans": _laser("stanford_dragon_stand_scans", "stanford_dragon_437645.ply", 1e-3),
    "bunny-scans": _laser("stanford_bunny_scans", "stanford_bunny_35947.ply", 2e-3),
    "truedepth-head": _Scene(_phone, (_PHONE, f"{_PHONE}/fused_reference_45428.ply")),
}
_SHEETS = _Scene(_sheets)
_SPOILT = {
    **{
        spoilt: scene
        for name in ("bunny", "armadillo", "horse", "igea")
        for spoilt, scene in _spoilt_in_all_ways(name, _MESHES[name]).items()
    },
    "bunny-strays": _spoilt("bunny", _MESHES["bunny"], [with_strays]),
    "bunny-strays-bare": _spoilt("bunny", _MESHES["bunny"], [with_strays, without_normals]),
    "sheets": _SHEETS,
    "sheets-bare": _spoilt("sheets", _SHEETS, [without_normals]),
    "bunny-scans-merged": _merged("stanford_bunny_scans", "stanford_bunny_35947.ply", 2e-3),
}
_SCENES: dict[str, _Scene] = _ANALYTIC | _MESHES | _ARRANGED | _SPOILT | _SIMULATED | _REAL


_FILE = _Scene(_file, counts=True)  # of a user's own mesh


def scene_names(data: Path | None) -> dict[str, str]:
    """Every scene by name, with the reason why it cannot be had; "" where it can.

    data: the folder of real scans, None: there is none.
    """
    return {name: _missing(scene, data) for name, scene in _SCENES.items()}


def subject(
    name_or_file: str,
    data: Path | None,
    *,
    count: int | None = None,
    noise: float | None = None,
    seed: int = 0,
) -> Subject:
    """The subject of a scene's name, or of a file with faces.

    count: of points; None: as many as it has. noise: standard deviation of depth of a virtual scanner, in
    footprints of its pixels; None: 0.5. seed: of all chance. Raises InputError.
    """
    scene = _SCENES.get(name_or_file)
    if scene is None:
        if not Path(name_or_file).is_file():
            if Path(name_or_file).is_dir():
                raise InputError(
                    "is a folder, not a mesh", name_or_file, "Give the path of a PLY, OBJ or NPZ file"
                )
            if Path(name_or_file).name != name_or_file or Path(name_or_file).suffix:
                raise InputError("no such file", name_or_file)
            raise unknown_name("scene", name_or_file, list(_SCENES))
        scene, needs = _FILE, [Path(name_or_file)]
    elif reason := _missing(scene, data):
        raise InputError(reason, name_or_file)
    else:
        needs = [Path(data or "") / need for need in scene.needs]
    if count is not None and not (scene.counts and 1 <= count <= _MOST_POINTS):
        known = f"1 to {_MOST_POINTS:,}" if scene.counts else "only as many points as the scanner measured"
        raise InputError(f"is not available with {count:,} points", name_or_file, f"The scene has {known}")
    if noise and scene.noise is None:
        raise InputError("has no noise", name_or_file, "Only simulated scans have noise: use NAME-simulated")
    if noise is not None and not (0 <= noise < np.inf):
        raise InputError(f"the noise of a scanner must be 0 or more, not {noise}", name_or_file)
    noise = (scene.noise or 0.0) if noise is None else noise
    name = name_or_file if name_or_file in _SCENES else Path(name_or_file).name
    return scene.make(_Request(name, tuple(needs), count, noise, seed))


def varies(name_or_file: str, what: Sweep) -> bool:
    """Whether a scene can be had with any number of points ("n"), or with any noise."""
    scene = _scene(name_or_file)
    return scene.counts if what == "n" else scene.noise is not None


def usual(name_or_file: str, what: Sweep) -> float | None:
    """The number of points or the noise of a scene unless another is asked for; None: not known yet."""
    scene = _scene(name_or_file)
    return scene.count if what == "n" else scene.noise


def is_bare(name_or_file: str) -> bool:
    """Whether its points come as a scanner gives them, without normals."""
    scene = _scene(name_or_file)
    return scene.noise is not None or any(need.startswith("range/") for need in scene.needs)


def _scene(name_or_file: str) -> _Scene:
    return _SCENES.get(name_or_file, _FILE)


def _missing(scene: _Scene, data: Path | None) -> str:
    """The files that a scene lacks; "": none."""
    for need in scene.needs:
        if data is None:
            return f"needs {need} from the folder of real scans (--data)"
        if not (data / need).exists():
            return f"no {need} in {data}"
    return ""

"""What a frame costs on this device, beside what its passes cost and what the plainest programs need.

A dented sphere turns: each picture has a new view. All cameras, requests and views are made before
anything is timed. Medians of some pictures, by turns with nothing else:

done     milliseconds from the call until the GPU is done, the picture not read
picture  the same with the picture in numpy
CPU      milliseconds until the call returns, with whatever it waits for
GPU      what the passes take on the GPU, by queries; on software drivers between finishes
first    milliseconds of the first picture of this cloud, which compiles, uploads and derives
longest  milliseconds of the longest frame from the second on, while the order of points is still found
maps     how often a frame maps a buffer that shaders write; reads: copies to the CPU of any kind
moved    messages of the driver in ten frames that a buffer moved from the memory of the card

sketch, GL_POINTS and CUDA draw the same points with nothing beside: a plain compute shader in the same
context, points of OpenGL, a kernel by CuPy. Rows whose name begins with "new" bring other points with
each picture, which the CPU has prepared as during playback. "cold" is the time to the first picture in a
process of its own, once without and once with what the process before stored. "cpu" is what the CPU does for
a picture outside the driver, at any number of points, and how many programs the first picture compiles: the
driver does nothing meanwhile, so that its threads disturb nothing. "frame" is the time of a frame on the GPU,
with what is in no pass. "loading" draws as a window does while a pose comes: "uploading", "first" and "later"
are its longest frames before, at and after the first picture.

--rows chooses rows by how their names begin, --sizes the numbers of points; --huge adds 100 million. --limit
ends each table after so many seconds. --json prints each row as it comes. To compare, --reading takes one of
copy, get and map for buffers that the CPU reads, --writing one of copy and driver, --clearing one of shader
and driver, --atomics one of 32 and 64. --order file draws all points without chunks. --hidden always or never
looks for hidden chunks of points on graphics cards.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import threading
import time
from argparse import Namespace
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cache, partial
from itertools import count as counter
from pathlib import Path
from typing import Any, Protocol

import moderngl
import numpy as np

from experiments.pictures import renderer
from experiments.script import Script
from experiments.speed.idle_driver import Driver
from experiments.speed.sketches import CudaScatter, GlPoints, Sketch, elapsed_ms, has_cuda
from experiments.tables import Column, Row, Table, at, code
from viewer.backends import backend as find_backend
from viewer.backends.voxels import cuts
from viewer.camera import Camera
from viewer.drawing.frame import draw_plan, render_frame
from viewer.drawing.plan import Effort, Ready, make_plan
from viewer.drawing.request import Request
from viewer.drawing.timing import pass_ms
from viewer.errors import Scan4DError
from viewer.gpu import chunks, gl
from viewer.look import Look
from viewer.picture.surface import Surface
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose
from viewer.splatting import culling
from viewer.threads import give_way
from viewer.view import View

LOOK = Look(light="flat", eye_dome=False, background="#000000")
HUGE = 100_000_000
_ONE_SIZE = 1_000_000  # points of the backends that are drawn at one size
_SPLATS_UP_TO = 10_000_000
_STEPS = 20  # pictures of a turn
_WARM = 3
_TURN_SECONDS = 3.0  # that the pictures of one figure take at most
_POSES = 6  # of a series
_PIECE = 1 << 20  # points that are made at a time
_SETTLED = 3  # frames without work in the background, after which nothing is prepared any more
_SETTLING_SECONDS = 60.0
_UPLOAD_MS = 20.0  # of a frame, as in windows
_LONG_MS = 30.0  # frames that a window should not have
_ENOUGH_TO_ORDER = 5_000_000  # points


@cache
def camera(step: int) -> Camera:
    """One of the views of a turn. Each is made once, before anything is timed."""
    turn, height = np.radians(30 + 360 * step / _STEPS), np.radians(20)
    eye = 3.4 * np.array([np.cos(height) * np.cos(turn), np.cos(height) * np.sin(turn), np.sin(height)])
    return Camera(eye=tuple(eye.tolist()), target=(0, 0, 0), up=(0, 0, 1), fov_y=40.0)


@cache
def shape(count: int, seed: int = 0) -> PointCloud:
    """Points of a dented sphere in random order, with colours, normals and radii of 1.5 spacings."""
    rng = np.random.default_rng(seed)
    positions, normals = np.empty((2, count, 3), np.float32)
    colors = np.empty((count, 4), np.uint8)
    for start in range(0, count, _PIECE):
        part = slice(start, min(start + _PIECE, count))
        away = rng.standard_normal((part.stop - start, 3), dtype=np.float32)
        away /= np.linalg.norm(away, axis=1, keepdims=True)
        size = 1 + 0.15 * np.sin(7 * away[:, :1] + 0.2 * seed) * np.cos(5 * away[:, 1:2])
        positions[part], normals[part] = away * size, away
        colors[part, :3], colors[part, 3] = np.clip(away * 102 + 128, 0, 255), 255
    return PointCloud.from_arrays(
        positions,
        normals=normals,
        colors=colors,
        radii=np.full(count, spacing(count) * 1.5),
        origin=np.zeros(3),
    )


def spacing(count: int) -> float:
    """The distance of neighbours, scan units."""
    return float(np.sqrt(4 * np.pi / count))


_DISCS = ("colors", "normals", "radii")


@dataclass(frozen=True)
class Case:
    """A backend and what it draws. of: the attributes of the cloud. params: other than the defaults. most:
    points up to which it is drawn. moving: see `render_frame`."""

    backend: str
    of: tuple[str, ...] = ("colors",)
    params: Mapping[str, object] = field(default_factory=dict)
    most: int = _ONE_SIZE
    moving: bool = False

    def cloud(self, count: int, seed: int = 0) -> PointCloud:
        """The points as it has them."""
        whole = shape(count, seed)
        lacking: dict[str, Any] = {name: None for name in _DISCS if name not in self.of}
        return replace(whole, **lacking)


CASES = {
    "points": Case("points", most=HUGE),
    "surfels": Case("surfels", _DISCS, most=_SPLATS_UP_TO),
    "surfels one pass": Case("surfels", _DISCS, {"passes": "one"}, _SPLATS_UP_TO),
    "auto_splats": Case("auto_splats"),
    "codeword": Case("codeword", _DISCS),
    "voxels": Case("voxels", ("colors", "normals")),
    "hpr": Case("hpr"),
}
NEW = {
    "points": CASES["points"],
    "surfels": replace(CASES["surfels"], moving=True),
    "voxels": CASES["voxels"],
    "auto_splats": CASES["auto_splats"],
}


class Contender(Protocol):
    """Something that draws."""

    def submit(self, step: int) -> None:
        """Draw a view, without waiting."""

    def read(self) -> object:
        """Read the picture."""

    def gpu_ms(self, step: int) -> dict[str, float]:
        """Milliseconds of its passes on the GPU."""

    def finish(self) -> None:
        """Wait for the GPU."""

    def release(self) -> object:
        """Free what it holds."""


class Drawn:
    """A backend that draws a pose."""

    def __init__(self, case: Case, pose: Pose, size: tuple[int, int]) -> None:
        self.case = case
        self.params = find_backend(case.backend).params(case.params)
        self.surface = Surface(renderer().gpu, size)
        self.show(pose)

    def show(self, pose: Pose) -> None:
        """Draw this pose from now on."""
        self.pose = pose
        self._requests = [self._request(step) for step in range(_STEPS)]

    def _request(self, step: int) -> Request:
        return Request(self.pose, camera(step), self.case.backend, self.params, LOOK)

    def request(self, step: int) -> Request:
        """The picture of a view, made before."""
        return self._requests[step % _STEPS]

    def submit(self, step: int) -> None:
        """Draw a view, without waiting."""
        self.draw(self.request(step))

    def draw(self, request: Request) -> None:
        """Draw a picture, without waiting."""
        while render_frame(renderer(), request, self.surface, moving=self.case.moving):
            pass

    def read(self) -> object:
        """Read the picture."""
        return self.surface.image()

    def gpu_ms(self, step: int) -> dict[str, float]:
        """Milliseconds of its passes on the GPU."""
        (found,) = pass_ms(renderer(), [self.request(step)], self.surface)
        self.frame_ms = self.surface.stats.frame_ms
        return {name: float(ms) for name, ms in found.items()}

    def finish(self) -> None:
        """Wait for the GPU."""
        renderer().gpu.ctx.finish()

    def release(self) -> None:
        """Free what it holds."""
        self.surface.release()


class Plain:
    """One of the sketches."""

    def __init__(self, sketch: Any, cloud: PointCloud, size: tuple[int, int]) -> None:
        self.sketch = sketch
        self.read, self.release = sketch.read, sketch.release
        self._views = [view(cloud, size, step) for step in range(_STEPS)]

    def submit(self, step: int) -> None:
        """Draw a view, without waiting."""
        self.sketch.submit(self._views[step % _STEPS])

    def gpu_ms(self, step: int) -> dict[str, float]:
        """Milliseconds on the GPU."""
        if hasattr(self.sketch, "passes"):
            return {"all": self.sketch.passes(self._views[step % _STEPS])}
        return {"all": elapsed_ms(renderer().gpu, partial(self.submit, step))}

    def finish(self) -> None:
        """Wait for the GPU."""
        getattr(self.sketch, "finish", renderer().gpu.ctx.finish)()


def view(cloud: PointCloud, size: tuple[int, int], step: int) -> View:
    """The view of a step."""
    return View.of(camera(step), size, cloud.origin, cloud.bounds())


# --- rows -----------------------------------------------------------------------------


class Limit:
    """The rows that are wanted, while there is time."""

    def __init__(self, options: Namespace) -> None:
        self._names = tuple(options.rows)
        self._end = time.perf_counter() + (options.limit or np.inf)

    def wants(self, name: str) -> bool:
        """Whether a row is wanted, and time is left."""
        return self.left > 0 and (not self._names or name.startswith(self._names))

    @property
    def left(self) -> float:
        """Seconds left."""
        return self._end - time.perf_counter()


def orbit(options: Namespace) -> Iterator[Row]:
    """Each backend and each sketch, from a new view in each picture."""
    limit = Limit(options)
    _threads_at_rest()
    _choose(options)
    for points in _sizes(options):
        for name, case in CASES.items():
            is_drawn = points <= case.most and (case.most != _ONE_SIZE or points == _one_size(options))
            if is_drawn and limit.wants(name):
                yield from _row(name, points, _drawn(case, points, options), options, limit)
        for name, make in _sketches(points, options).items():
            if limit.wants(name):
                yield from _row(name, points, make, options, limit)
        shape.cache_clear()
        renderer().gpu.collect()


def cpu(options: Namespace) -> Iterator[Row]:
    """The CPU's own work for a picture, with a driver that does nothing; the programs of the first one."""
    limit, gpu = Limit(options), renderer().gpu
    _threads_at_rest()
    _choose(options)
    cuts.BY_SHADERS = True  # as on graphics cards: else the CPU does a work of the driver's
    for points in _sizes(options):
        for name, case in CASES.items():
            if points > case.most or not limit.wants(name):
                continue
            drawn, before = (
                Drawn(case, Pose(0, 0.0, "turning", case.cloud(points)), options.size),
                gpu.programs,
            )
            drawn.submit(0)
            programs = gpu.programs - before
            _settle(drawn, limit)
            new = _own_work(drawn, [drawn.request(step) for step in range(_STEPS)], options.pictures)
            same = _own_work(drawn, [drawn.request(0)] * _STEPS, options.pictures)
            drawn.release()
            yield {
                "row": name,
                "points": points,
                **{f"new view, {what}": value for what, value in new.items()},
                **{f"same view, {what}": value for what, value in same.items()},
                "new programs": programs,
            }
        shape.cache_clear()


def _own_work(drawn: Drawn, requests: list[Request], rounds: int) -> dict[str, float]:
    """Milliseconds of the processor that a picture takes with a driver that does nothing, the least of some
    rounds; and how often it calls the driver. Medians of these pictures, each after the one before."""
    driver = Driver(renderer().gpu.staging)
    calls, least = [], np.full(len(requests), np.inf)
    with driver.watched():
        for request in requests:
            before = driver.calls.total()
            drawn.draw(request)
            calls.append(driver.calls.total() - before)
    with driver.idle():
        for _ in range(rounds):
            for number, request in enumerate(requests):
                start = time.thread_time()
                drawn.draw(request)
                least[number] = min(least[number], time.thread_time() - start)
    return {"CPU, ms": 1e3 * float(np.median(least)), "calls": float(np.median(calls))}


def loading(options: Namespace) -> Iterator[Row]:
    """The longest frames of a window while a pose is uploaded, drawn for the first time and put in order."""
    limit = Limit(options)
    _choose(options)
    for points in _sizes(options):
        for name, case in CASES.items():
            if points <= case.most and limit.wants(name):
                _longest_frames(case, min(points, _ENOUGH_TO_ORDER), options, limit)  # compiles
                yield from _guarded(name, points, partial(_longest_frames, case, points, options, limit))
        shape.cache_clear()


def _longest_frames(case: Case, points: int, options: Namespace, limit: Limit) -> Row:
    """Milliseconds of the longest frame of each kind, drawn as a window does."""
    drawn = Drawn(case, Pose(0, 0.0, "loading", replace(case.cloud(points))), options.size)
    renderer().work.prepare(drawn.request(0))
    at_rest = threading.active_count()
    end = time.perf_counter() + min(_SETTLING_SECONDS, max(limit.left, 0))
    longest, over, quiet = dict.fromkeys(("uploading, ms", "first, ms", "later, ms"), 0.0), 0, 0
    kind = "uploading, ms"
    for step in counter():
        start = time.perf_counter()
        planned = make_plan(renderer(), drawn.request(step), options.size, Effort.BEGIN, _UPLOAD_MS)
        if isinstance(planned, Ready):
            kind = "first, ms" if kind == "uploading, ms" else "later, ms"
            draw_plan(planned, drawn.surface)
        drawn.finish()
        now = time.perf_counter()
        longest[kind] = max(longest[kind], 1e3 * (now - start))
        over += 1e3 * (now - start) > _LONG_MS
        quiet = 0 if threading.active_count() > at_rest else quiet + 1
        if (kind == "later, ms" and quiet > _SETTLED) or now > end:
            break
    drawn.release()
    return {**longest, "frames over 30 ms": over, "frames": step}


def new_pose(options: Namespace) -> Iterator[Row]:
    """Each backend with other points in each picture."""
    limit, points = Limit(options), _one_size(options)
    _choose(options)
    for name, case in NEW.items():
        if limit.wants(f"new {name}"):
            yield from _guarded(f"new {name}", points, partial(_series, case, points, options))
    for bits in (64, 32):
        if limit.wants(f"new sketch {bits}"):
            yield from _guarded(f"new sketch {bits}", points, partial(_sketch_series, bits, points, options))
    shape.cache_clear()


def cold(options: Namespace) -> Iterator[Row]:
    """The first picture of a process, without and with what was stored before."""
    limit, points = Limit(options), _one_size(options)
    for name in CASES:
        if limit.wants(f"cold {name}"):
            with tempfile.TemporaryDirectory() as folder:
                found = [first_picture(name, points, Path(folder), options.size) for _ in range(2)]
            first, second = found
            yield {
                "row": f"cold {name}",
                "points": points,
                "nothing stored, ms": first["picture"],
                "stored, ms": second["picture"],
                "context, ms": second["context"],
                "second picture, ms": second["second"],
            }


def _choose(options: Namespace) -> None:
    """Take the ways of reading and clearing that are to be measured; threads give way as a window's do."""
    give_way()
    gpu = renderer().gpu
    if options.reading:
        gpu.staging.reading = options.reading
    if options.writing:
        gpu.staging.writes_by_copy = options.writing == "copy"
    if options.clearing:
        gpu.clears_by_shader = options.clearing == "shader"
    if options.atomics:
        gpu.wide_atomics = options.atomics == "64"
    if options.order == "file":
        chunks.LEAST = 1 << 40
    if options.hidden:
        culling._PAYS = {"always": 0.0, "never": 2.0}[options.hidden]


def _sizes(options: Namespace) -> list[int]:
    return [*options.sizes, *([HUGE] if options.huge and HUGE not in options.sizes else [])]


def _one_size(options: Namespace) -> int:
    """The number of points that backends are drawn with that are drawn at one size."""
    return max([size for size in options.sizes if size <= _ONE_SIZE], default=min(options.sizes))


def _drawn(case: Case, points: int, options: Namespace) -> Callable[[], Contender]:
    return lambda: Drawn(case, Pose(0, 0.0, "turning", case.cloud(points)), options.size)


def _sketches(points: int, options: Namespace) -> dict[str, Callable[[], Contender]]:
    """What draws beside the backends."""
    size, gpu = options.size, renderer().gpu

    def plain(make: Callable[..., Any], *args: object) -> Contender:
        return Plain(make(shape(points), *args), shape(points), size)

    radius = 1.5 * spacing(points)
    made: dict[str, Callable[[], Contender]] = {
        "sketch 64": partial(plain, partial(Sketch, gpu), size, 64),
        "sketch 32": partial(plain, partial(Sketch, gpu), size, 32),
        "GL_POINTS": partial(plain, partial(GlPoints, gpu), view(shape(points), size, 0)),
    }
    if has_cuda():
        made["CUDA"] = partial(plain, CudaScatter, size)
    if points <= _SPLATS_UP_TO:
        made["sketch discs 64"] = partial(plain, partial(Sketch, gpu), size, 64, radius)
        if has_cuda():
            made["CUDA discs"] = partial(plain, CudaScatter, size, radius)
    return made


def _row(
    name: str, points: int, make: Callable[[], Contender], options: Namespace, limit: Limit
) -> Iterator[Row]:
    yield from _guarded(name, points, lambda: _figures(make(), options, limit))


def _guarded(name: str, points: int, figures: Callable[[], Row]) -> Iterator[Row]:
    """The row, or why there is none."""
    start = time.perf_counter()
    try:
        found = figures()
    except (Scan4DError, moderngl.Error, MemoryError, ImportError) as error:
        reason = str(error).strip().splitlines() or [type(error).__name__]
        found = {"left out": reason[0][:120]}
    yield {"row": name, "points": points, **found, "measured in, s": time.perf_counter() - start}


def _figures(drawn: Contender, options: Namespace, limit: Limit) -> Row:
    """All figures of a contender."""
    start = time.perf_counter()
    drawn.submit(0)
    drawn.read()
    first = 1e3 * (time.perf_counter() - start)
    longest = _settle(drawn, limit)
    parts = _timed(drawn, options.pictures, limit)
    passes = [drawn.gpu_ms(step) for step in range(_WARM, _WARM + 5)][1:]
    names = list(passes[0])
    medians = {name: float(np.median([each.get(name, 0.0) for each in passes])) for name in names}
    with counted_reads() as counts:
        drawn.submit(1)
        drawn.read()
    with gl.debug_messages() as messages:
        for step in range(10):
            drawn.submit(step)
            drawn.read()
        drawn.finish()
    drawn.release()
    return {
        **parts,
        "GPU, ms": float(np.median([sum(each.values()) for each in passes])),
        "frame, ms": getattr(drawn, "frame_ms", None),
        "first, ms": first,
        "longest, ms": longest,
        **counts,
        "moved": sum("moved from VIDEO" in message for message in messages),
        "errors": sum(message.startswith("error") for message in messages),
        "passes": ", ".join(f"{name} {ms:.3f}" for name, ms in medians.items()),
    }


def _settle(drawn: Contender, limit: Limit) -> float:
    """Draw until nothing works in the background; milliseconds of the longest frame."""
    end = time.perf_counter() + min(_SETTLING_SECONDS, max(limit.left, 0))
    longest, quiet = 0.0, 0
    for step in counter(1):
        start = time.perf_counter()
        drawn.submit(step)
        drawn.finish()
        now = time.perf_counter()
        longest = max(longest, 1e3 * (now - start))
        quiet = 0 if threading.active_count() > _threads_at_rest() else quiet + 1
        if (quiet > _SETTLED and step > _WARM) or now > end:
            break
    return longest


@cache
def _threads_at_rest() -> int:
    """The threads of this process that are always there: asked before anything is drawn."""
    return threading.active_count()


def _timed(drawn: Contender, pictures: int, limit: Limit) -> Row:
    """Times without and with the picture read, and how long the call takes."""
    end = time.perf_counter() + min(_TURN_SECONDS, max(limit.left, 0))
    done: list[float] = []
    called: list[float] = []
    pictured: list[float] = []
    for step in range(pictures + _WARM):
        for is_read in (False, True):
            drawn.finish()
            start = time.perf_counter()
            drawn.submit(2 * step + is_read)
            submitted = time.perf_counter()
            if is_read:
                drawn.read()
            else:
                drawn.finish()
            ms = 1e3 * (time.perf_counter() - start)
            (pictured if is_read else done).append(ms)
            if not is_read:
                called.append(1e3 * (submitted - start))
        if time.perf_counter() > end and step >= _WARM:
            break
    figures = {"done, ms": done, "picture, ms": pictured, "CPU, ms": called}
    return {name: float(np.median(times[_WARM:])) for name, times in figures.items()}


def _series(case: Case, points: int, options: Namespace) -> Row:
    """Figures of a backend with another pose in each picture."""
    shapes = [case.cloud(points, seed) for seed in range(_POSES)]
    drawn = Drawn(case, Pose(0, 0.0, "first", shapes[0]), options.size)
    drawn.submit(0)
    taken: dict[str, list[float]] = {}
    end = time.perf_counter() + 2 * _TURN_SECONDS
    for number in range(2, 2 + 2 * _POSES):
        cloud = replace(shapes[number % _POSES], **{name: getattr(shapes[number % _POSES], name).copy()
                                                    for name in ("positions", *case.of)})  # fmt: skip
        drawn.show(Pose(number, 0.1 * number, "new", cloud))
        renderer().work.prepare(drawn.request(number))  # as a player does before the pose is due
        drawn.finish()
        start = time.perf_counter()
        drawn.submit(number)
        called = time.perf_counter()
        drawn.finish()
        done = time.perf_counter()
        drawn.read()
        stats = drawn.surface.stats
        times = {
            "done, ms": done - start,
            "picture, ms": time.perf_counter() - start,
            "CPU, ms": called - start,
            "upload, ms": stats.upload_ms / 1e3,
            "derive, ms": stats.derive_ms / 1e3,
        }
        for name, seconds in times.items():
            taken.setdefault(name, []).append(1e3 * seconds)
        if time.perf_counter() > end and number > _WARM:
            break
    drawn.release()
    return {name: float(np.median(times[2:] or times)) for name, times in taken.items()}


def _sketch_series(bits: int, points: int, options: Namespace) -> Row:
    """Figures of the plain scatter, whose buffers are written anew."""
    shapes = [shape(points, seed) for seed in range(_POSES)]
    sketch = Sketch(renderer().gpu, shapes[0], options.size, bits)
    drawn = Plain(sketch, shapes[0], options.size)
    done, pictured = [], []
    for number in range(2 * _POSES):
        drawn.finish()
        start = time.perf_counter()
        sketch.fill(shapes[number % _POSES])
        drawn.submit(number)
        drawn.finish()
        done.append(1e3 * (time.perf_counter() - start))
        drawn.read()
        pictured.append(1e3 * (time.perf_counter() - start))
    drawn.release()
    return {"done, ms": float(np.median(done[2:])), "picture, ms": float(np.median(pictured[2:]))}


@contextmanager
def counted_reads() -> Iterator[dict[str, int]]:
    """Count how often buffers are mapped, and read in whichever way, meanwhile."""
    counts, staging = {"maps": 0, "reads": 0}, renderer().gpu.staging
    before = staging.reads
    maps = {name: getattr(moderngl.Buffer, name) for name in ("read", "read_into")}

    def counting(name: str) -> Callable[..., Any]:
        def read(*args: Any, **kwargs: Any) -> Any:
            counts["maps"] += 1
            return maps[name](*args, **kwargs)

        return read

    for name in maps:
        setattr(moderngl.Buffer, name, counting(name))
    try:
        yield counts
        staged = staging.reads - before
        counts["reads"] = staged + counts["maps"] * (staging.reading != "map" or not staged)
    finally:
        for name, function in maps.items():
            setattr(moderngl.Buffer, name, function)


# --- a process of its own -------------------------------------------------------------


def first_picture(name: str, points: int, folder: Path, size: tuple[int, int]) -> dict[str, float]:
    """Milliseconds of the first picture of a case in a new process, which stores what it finds and compiles
    in a folder."""
    environment = {
        **os.environ,
        "XDG_CACHE_HOME": str(folder),
        "__GL_SHADER_DISK_CACHE_PATH": str(folder),
        "MESA_SHADER_CACHE_DIR": str(folder),
        "PYTHONPATH": os.pathsep.join(filter(None, [*map(str, _PATHS), os.environ.get("PYTHONPATH", "")])),
    }
    command = [sys.executable, "-m", "experiments.speed.hardware", name, str(points), *map(str, size)]
    done = subprocess.run(command, env=environment, stdout=subprocess.PIPE, text=True, check=True)
    found: dict[str, float] = json.loads(done.stdout.splitlines()[-1])
    return found


_PATHS = (Path(__file__).parents[2], Path(__file__).parents[3])


def _first_picture(name: str, points: int, size: tuple[int, int]) -> dict[str, float]:
    """The same in this process."""
    case = CASES[name]
    pose = Pose(0, 0.0, "first", case.cloud(points))
    _ = pose.bounds  # which the loader finds
    times = [time.perf_counter()]
    renderer()
    times.append(time.perf_counter())
    drawn = Drawn(case, pose, size)
    for step in range(2):
        drawn.submit(step)
        drawn.read()
        times.append(time.perf_counter())
    context, picture, second = 1e3 * np.diff(times)
    return {"context": context, "picture": picture, "second": second}


_EMPTY = "No run is stored yet."
_TIMES = ("done, ms", "picture, ms", "CPU, ms")
_COUNTS = ("maps", "reads", "moved")


def _columns(*titles: str) -> list[Column]:
    return [code("row"), Column("points"), *(Column(title, at(title)) for title in titles)]


TABLES = [
    Table(
        "hardware_orbit",
        _columns(*_TIMES, "GPU, ms", "first, ms", "longest, ms", *_COUNTS),
        "orbit",
        empty=_EMPTY,
    ),
    Table("hardware_new_pose", _columns(*_TIMES, "upload, ms", "derive, ms"), "new_pose", empty=_EMPTY),
    Table("hardware_cold", _columns("nothing stored, ms", "stored, ms", "context, ms"), "cold", empty=_EMPTY),
]
EXPERIMENT = Script(
    [orbit, loading, new_pose, cold, cpu],
    {
        "sizes": [100_000, 1_000_000, 10_000_000],
        "huge": False,
        "size": (1920, 1280),
        "pictures": 25,
        "rows": [],
        "limit": 0.0,
        "reading": "",
        "writing": "",
        "clearing": "",
        "atomics": "",
        "order": "",
        "hidden": "",
    },
    described=TABLES,
    described_page="speed.md",
    needs_card=True,
)

if __name__ == "__main__":
    print(json.dumps(_first_picture(sys.argv[1], int(sys.argv[2]), (int(sys.argv[3]), int(sys.argv[4])))))

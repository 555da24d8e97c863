"""Measuring: contenders take turns on the views of a scene, each timed and judged.

Three things are timed: the first picture of a pose, a new view of it, and the same view again. A new view is
the main one: the eye moves by a degree between pictures, so that no backend draws what it found before.
Judging is outside of all times.
"""

from __future__ import annotations

import gc
import os
import re
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field, replace
from datetime import date
from functools import lru_cache
from itertools import pairwise, product
from math import nan
from pathlib import Path
from typing import Literal

from .. import __version__
from ..backends import Backend, backend
from ..camera import Camera
from ..drawing.renderer import Renderer
from ..drawing.request import Request
from ..drawing.timing import call_ms, draw, new_views, pass_ms, peak_rss, reset_peak_rss
from ..errors import InputError
from ..files import output_folder, whole_file
from ..look import Look
from ..mesh.range_mesh import triangulated
from ..picture.surface import Surface
from ..signals import Interrupts
from . import baselines, numerics, surface_suite
from .baselines import CEILING, FLOOR, RANGE_MESH
from .judge import Judge, Walk
from .metrics import Errors, aggregate
from .plan import Contender, Group
from .report.pictures import picture_path, side_by_side
from .report.results import SPREADS, Row, spread
from .scenes import catalog
from .scenes.subjects import Moment, Subject
from .scenes.viewpoints import pod_viewpoints, viewpoints
from .stability import Difference

LOOK = Look(light="head")  # the same for all: what "auto" takes depends on the scan
_ORBIT_STEP = 2.0  # degrees from frame to frame of an orbit
# What takes longer is not repeated as often: it stands out of the noise.
_SLOW = 250.0  # ms
_TIMES = ("gpu_ms", "cpu_ms", "busy_ms", "same_ms")  # of each view
PREPARED = 5  # views that prepare a pose anew in any case

Kind = Literal["orbit", "pose"]
Frame = tuple[Moment, Camera]


@dataclass(frozen=True)
class BenchSettings:
    """How it is measured.

    size: of the pictures, pixels. views: of each scene. repeat: draws that a view's time is the median of,
    where they are faster than 250 ms. frames: of a walk, for flicker; less than two: none is walked. seed: of
    viewpoints, samples and noise. data: the folder of real scans.
    """

    size: tuple[int, int] = (1920, 1280)
    views: int = 20
    repeat: int = 3
    frames: int = 6
    seed: int = 0
    data: Path | None = None

    def subject(self, group: Group) -> Subject:
        """Load what a group looks at. Raises InputError."""
        return catalog.subject(group.scene, self.data, count=group.count, noise=group.noise, seed=self.seed)


@dataclass
class _Tally:
    """Measurements of one contender, a value a view; of a slow preparation, a value for the first."""

    gpu_ms: list[float] = field(default_factory=list)
    cpu_ms: list[float] = field(default_factory=list)
    busy_ms: list[float] = field(default_factory=list)
    same_ms: list[float] = field(default_factory=list)
    first_ms: list[float] = field(default_factory=list)
    derive_ms: list[float] = field(default_factory=list)
    upload_ms: list[float] = field(default_factory=list)
    passes: list[dict[str, float]] = field(default_factory=list)
    bytes_gpu: list[int] = field(default_factory=list)
    peak_rss: list[int | None] = field(default_factory=list)
    covered: list[float] = field(default_factory=list)  # percent of the picture
    errors: list[Errors] = field(default_factory=list)
    flicker: Errors = field(default_factory=dict)

    @property
    def knows_preparation(self) -> bool:
        """Whether it is so slow that a few samples will do."""
        known = self.derive_ms
        return len(known) >= PREPARED and spread(known)["median"] > _SLOW

    def numbers(self, views: int) -> Row:
        """Values that a row holds of the first views."""
        runs = self.passes[:views]
        names = dict.fromkeys(name for run in runs for name in run)  # a view may need others than the first
        passes = {name: spread([run.get(name, 0.0) for run in runs]) for name in names}
        by_view = {name: [errors[name] for errors in self.errors[:views]] for name in self.errors[0]}
        memory = [peak for peak in self.peak_rss[:views] if peak is not None]
        return {
            **{name: spread(getattr(self, name)[:views]) for name in SPREADS},
            "passes": passes,
            "bytes_gpu": max(self.bytes_gpu[:views]),
            "peak_rss": max(memory, default=None),
            "errors": aggregate(by_view) | self.flicker,
            "errors_by_view": by_view,
            "covered_by_view": self.covered[:views],
            "times_by_view": {name: getattr(self, name)[:views] for name in _TIMES},
        }


class Bench:
    """Measures groups, one after another. renderer: what draws. folder: where comparing pictures go.

    Raises InputError for pictures that are too large for the driver.
    """

    def __init__(self, renderer: Renderer, settings: BenchSettings, folder: Path | None = None) -> None:
        Surface(renderer.gpu, settings.size).release()  # raises before anything is traced
        self.renderer, self.settings, self.folder = renderer, settings, folder
        self.tick: Callable[[], object] = int  # called after each step
        self.interrupts = Interrupts()  # let in while something is measured
        self.stopped = False
        self.notes: list[str] = []
        self.subject = lru_cache(maxsize=1)(settings.subject)
        self._looked_at: tuple[Moment, float | None, list[Camera]] | None = None
        self._triangulated = lru_cache(maxsize=1)(triangulated)

    def measure(self, group: Group) -> list[Row]:
        """The rows of a group. Where Ctrl-C stopped it, of the views that all have seen; `stopped` is set.

        A contender that cannot draw the scene is left out, and `notes` says why. Calls `tick` as often as
        `steps` says. Raises InputError for scenes that cannot be had.
        """
        subject = self.subject(group)
        tallies = {contender: _Tally() for contender in group.contenders}
        try:
            with self.interrupts.let_in():
                self._measure(group, subject, tallies)
        except KeyboardInterrupt:
            self.stopped = True
        return self._rows(group, subject, tallies)

    def _measure(self, group: Group, subject: Subject, tallies: dict[Contender, _Tally]) -> None:
        """Fill the tallies, view by view."""
        for view in range(self.settings.views):
            self._view(group, subject, view, tallies)
        for kind, frames, walk in self._walks(group, subject):
            for contender, tally in tallies.items():
                try:
                    tally.flicker |= walk.flicker(self._drawn(contender, frames), kind)
                except InputError as error:
                    self.note(f"{subject.name}: cannot measure the flicker of {contender.backend}: {error}")
                self.tick()

    def steps(self, group: Group) -> int:
        """How often measuring a group ticks."""
        return len(group.contenders) * (self.settings.views + self.walks(group))

    def walks(self, group: Group) -> int:
        """How many walks of frames a group has at most; none where it is zoomed."""
        if not group.judged or group.zoom is not None or self.settings.frames < 2:
            return 0
        return 2 if self.subject(group).moments > 1 else 1

    def until_stopped(self, rows: Iterator[Row]) -> Iterator[Row]:
        """The rows as they are found, with a `tick` after each; Ctrl-C ends them, `stopped` is set."""
        while not self.stopped:
            try:
                with self.interrupts.let_in():
                    row = next(rows, None)
            except KeyboardInterrupt:
                self.stopped = True
                return
            if row is None:
                return
            yield row
            self.tick()

    def note(self, text: str) -> None:
        """Say once what is not as it was asked for."""
        if text not in self.notes:
            self.notes.append(text)

    def numerics(self, names: Sequence[str]) -> Iterator[Row]:
        """The lines of the stability suite, for each backend; what one cannot draw is its limit."""
        for name, row in product(names, numerics.rows()):
            if not row.is_for(backend(name)):
                continue
            try:
                outcome = row.compare(self.renderer, backend(name))
                found, held = outcome.found, outcome.held
                limit = outcome.limit.reason if outcome.limit and outcome.allowed else ""
            except InputError as error:
                found, held, limit = Difference(nan, nan, nan), False, str(error)
            yield {
                "row": row.name,
                "backend": name,
                **asdict(found),
                "bound": asdict(row.tolerance.bound),
                "held": held,
                "limit": limit,
                "reason": row.tolerance.reason,
                **self.where(),
            }

    def surface(self, names: Sequence[str], models: Sequence[str], points: int, picks: int) -> Iterator[Row]:
        """The rows of the suite "surface", for each condition, scene and backend; a scene that cannot be had
        is noted. models: scenes of the conditions that have none of their own. points, picks: as in
        `surface_suite.Amount`."""
        settings = self.settings
        amount = surface_suite.Amount(points, settings.views, picks, settings.size)
        for condition in surface_suite.CONDITIONS:
            for scene in surface_suite.scenes_of(condition, models):
                try:
                    subject = self.subject(Group(scene, ()))
                    found = surface_suite.measure_condition(
                        self.renderer, subject, condition, names, amount, settings.seed
                    )
                    for name, errors in found:
                        yield {
                            "condition": condition.name,
                            "scene": subject.name,
                            "backend": name,
                            "points": points,
                            "size": list(settings.size),
                            "views": settings.views,
                            "seed": settings.seed,
                            "errors": errors,
                            **self.where(),
                        }
                except InputError as error:
                    self.note(f"the suite surface leaves out {scene}, {condition.name}: {error}")

    def where(self) -> Row:
        """The part of a row that says where and when it was measured."""
        gpu = self.renderer.gpu
        return {
            "timer": gpu.timers.kind,
            "device": gpu.device,
            "driver": gpu.driver,
            "processors": os.cpu_count(),
            "version": __version__,
            "date": date.today().isoformat(),
        }

    # --- one view ---------------------------------------------------------------------

    def _view(self, group: Group, subject: Subject, view: int, tallies: dict[Contender, _Tally]) -> None:
        """Let all contenders draw a view, time them and judge them."""
        moment, camera = self.seen(subject, view, group.zoom)
        judge = self._judge(subject, moment, camera) if group.judged else None
        turn = view % max(1, len(tallies))  # who is first changes, so that drift hits all alike
        for contender in (*list(tallies)[turn:], *list(tallies)[:turn]):
            surface, tally = Surface(self.renderer.gpu, self.settings.size), tallies[contender]
            anew = not tally.knows_preparation  # then of a pose that the renderer has not seen
            shown = replace(moment, pose=replace(moment.pose)) if anew else moment
            try:
                request = self._request(contender, shown, camera)
                self._time(request, surface, tally, anew)
            except InputError as error:
                self.note(f"{subject.name}: the benchmark leaves out {contender.backend}: {error}")
                del tallies[contender]
                for _ in range(self.settings.views - view + self.walks(group)):
                    self.tick()  # of what it will not be drawn for
                continue
            tally.covered.append(100 * float((surface.coverage > 0).mean()))
            tally.errors.append(judge.errors(surface) if judge else {})
            pictured = view == 0 and not (group.sweep or contender.sweep)
            if self.folder and judge and pictured:
                _save_comparison(picture_path(self.folder, subject.name, contender.backend), judge, surface)
            surface.release()
            self.tick()

    def _judge(self, subject: Subject, moment: Moment, camera: Camera) -> Judge:
        pose, size = moment.pose, self.settings.size
        return Judge.of(self.renderer.gpu, moment.truth, camera, size, LOOK, pose, subject.tolerance)

    def _time(self, request: Request, surface: Surface, tally: _Tally, anew: bool) -> None:
        """Add what one view takes: the first picture of a pose that is new to the GPU, new views of it, and
        the same view again, which the surface shows in the end."""
        renderer, repeat = self.renderer, self.settings.repeat
        with undisturbed():
            reset_peak_rss()
            (first,) = call_ms(renderer, [request], surface)
            if anew:
                tally.first_ms.append(first)
                tally.upload_ms.append(surface.stats.upload_ms)
                tally.derive_ms.append(surface.stats.derive_ms)
                tally.bytes_gpu.append(renderer.bytes_of(request.pose) + surface.nbytes)
            if repeat > 1 and min(call_ms(renderer, new_views(request, 2, 2 * repeat), surface)) >= _SLOW:
                repeat = 1
            runs = pass_ms(renderer, new_views(request, repeat, repeat), surface)
            start = time.process_time()
            calls = call_ms(renderer, new_views(request, repeat), surface)
            tally.busy_ms.append((time.process_time() - start) * 1e3 / repeat)
            again = call_ms(renderer, [request] * repeat, surface)
        tally.cpu_ms.append(spread(calls)["median"])
        tally.same_ms.append(spread(again)["median"])
        tally.gpu_ms.append(spread([run.total() for run in runs])["median"])
        tally.passes.append({name: spread([run[name] for run in runs])["median"] for name in runs[0]})
        tally.peak_rss.append(peak_rss())

    def seen(self, subject: Subject, view: int, zoom: float | None = None) -> Frame:
        """The moment that a view shows, and from where; zoom as `Group` has it."""
        moment = subject.moment(view * subject.moments // self.settings.views)
        return moment, self._cameras(subject, moment, zoom)[view]

    def _cameras(self, subject: Subject, moment: Moment, zoom: float | None) -> list[Camera]:
        """Cameras of all views, which look to where the subject is at a moment."""
        if self._looked_at is None or self._looked_at[0] is not moment or self._looked_at[1] != zoom:
            views, size, seed = self.settings.views, self.settings.size, self.settings.seed
            try:
                if zoom is None:
                    cameras = viewpoints(moment.mesh, views, size, up=subject.up, seed=seed)
                else:
                    pods = moment.pose.views
                    cameras = pod_viewpoints(pods, zoom, views, size, up=subject.up, seed=seed)
            except InputError as error:
                raise InputError(error.what, subject.name) from error
            self._looked_at = moment, zoom, cameras
        return self._looked_at[2]

    # --- from frame to frame ----------------------------------------------------------

    def _walks(self, group: Group, subject: Subject) -> Iterator[tuple[Kind, list[Frame], Walk]]:
        """An orbit about the first moment; some moments of a sequence whose points are known in all.

        None where the group has none.
        """
        if not self.walks(group):
            return
        first, frames = subject.moment(0), self.settings.frames
        start = self._cameras(subject, first, None)[0]
        orbit = [(first, start.orbited(_ORBIT_STEP * frame, 0)) for frame in range(frames)]
        judges = [self._judge(subject, *frame) for frame in orbit]
        yield "orbit", orbit, Walk(judges, [None] * (frames - 1))

        if subject.moments < 2:
            return
        indices = [index % subject.moments for index in range(frames)]
        moments = [subject.moment(index) for index in indices]
        size = self.settings.size
        camera = Camera.orbit(first.mesh.bounds, 30, 10, aspect=size[0] / size[1], up=subject.up)
        playing = [(moment, camera) for moment in moments]
        judges = [self._judge(subject, *frame) for frame in playing]
        moved = [
            subject.carry(index, following, judge.reference)
            for (index, following), judge in zip(pairwise(indices), judges, strict=False)
        ]
        if not any(hits is None for hits in moved):
            yield "pose", playing, Walk(judges, moved)

    def _drawn(self, contender: Contender, frames: list[Frame]) -> Iterator[Surface]:
        """One Surface, drawn anew for each frame."""
        surface = Surface(self.renderer.gpu, self.settings.size)
        for moment, camera in frames:
            draw(self.renderer, self._request(contender, moment, camera), surface)
            yield surface
        surface.release()

    def _request(self, contender: Contender, moment: Moment, camera: Camera) -> Request:
        """The request that draws a contender. Raises InputError where the moment has not what it draws."""
        pose = moment.pose
        drawn: str | Backend = contender.backend
        if contender.drawn is not None:
            cloud, drawn = contender.drawn(pose.cloud, camera)
            pose = replace(pose, points=cloud)
        elif contender.backend in (CEILING, RANGE_MESH):
            mesh = moment.mesh if contender.backend == CEILING else self._triangulated(pose.views)
            pose, drawn = replace(pose, points=mesh.points), baselines.mesh(mesh, contender.backend)
        elif contender.backend == FLOOR:
            drawn = baselines.gl_points()
        return Request(pose, camera, drawn, contender.params, LOOK)

    # --- rows -------------------------------------------------------------------------

    def _rows(self, group: Group, subject: Subject, tallies: dict[Contender, _Tally]) -> list[Row]:
        """The rows of a group, of the views that all its contenders have seen."""
        views = min((len(tally.errors) for tally in tallies.values()), default=0)
        if not views:
            return []
        settings, cloud = self.settings, subject.moment(0).pose.cloud
        return [
            {
                "backend": contender.backend,
                "scene": subject.name,
                "scene_hash": subject.hash,
                "credit": subject.credit,
                "n": len(cloud),
                "noise": subject.noise,
                "zoom": group.zoom,
                "params": {} if contender.params is None else asdict(contender.params),
                "sweep": contender.sweep or group.sweep,
                "size": list(settings.size),
                "seed": settings.seed,
                "views": views,
                "repeat": settings.repeat,
                "frames": settings.frames,
                **tally.numbers(views),
                **self.where(),
            }
            for contender, tally in tallies.items()
        ]


def _save_comparison(path: Path, judge: Judge, surface: Surface) -> None:
    """The picture of reference, backend and differences."""
    from PIL import Image

    reference = judge.reference
    true = {"image": judge.image, "depth": reference.depth, "normal": reference.normal}
    drawn = {"image": surface.image(), "depth": surface.depth, "normal": surface.normal}
    panels = side_by_side(true, drawn, reference.view.footprint(reference.depth))
    output_folder(path.parent)
    with whole_file(path) as temporary:
        Image.fromarray(panels).save(temporary)


@contextmanager
def undisturbed() -> Iterator[None]:
    """No garbage collection within."""
    gc.disable()
    try:
        yield
    finally:
        gc.enable()


def slug(device: str) -> str:
    """A device's name as a part of a file's: what stands before the first bracket or slash."""
    return re.sub(r"[^a-z0-9]+", "-", re.split(r"[(/]", device)[0].lower()).strip("-")

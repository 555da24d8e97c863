"""Which of several variants is the fastest on this device: measured once, then remembered for this user.

A process of its own measures, so that no picture waits for it. What it finds counts from the next start on:
variants may round differently, and a frame has the same bits each time
(docs/developing/decisions/007-instancing.md).
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..camera import Camera
from ..errors import InputError, Scan4DError
from ..files import whole_file
from ..folders import cache_folder
from ..gpu.context import Gpu, headless
from ..gpu.pose import GpuPose
from ..helper import Helper
from ..picture.surface import Surface
from ..scan.points import PointCloud
from ..scan.pose import Pose
from ..task import Task, in_background
from ..view import View

_TURNS = 3
_TRIAL_POINTS, _TRIAL_SIZE = 100_000, (1920, 1280)


def fastest(
    gpu: Gpu,
    task: str,
    names: Sequence[str],
    variants: Callable[[], Mapping[str, Callable[[], object]]],
    file: Path | None = None,
) -> str:
    """The name of the fastest way of doing a task on this device with this driver.

    names: of the variants. variants: makes them, each to be called several times; only where nothing is
    remembered. One that the driver does not compile is left out. file: what is remembered; None: in
    the user's cache folder. A damaged file counts as none, and one that cannot be written is passed over.
    """
    file = file or _file()
    found = _remembered(gpu, task, names, file)
    if found is None:
        with gpu.timers.paused():
            times = _times(gpu, variants())
        found = min(times, key=lambda name: times[name], default=names[0])
        remembered = {**_read(file), _key(gpu, task, names): found}
        with suppress(InputError), whole_file(file) as temporary:
            temporary.write_text(json.dumps(remembered, indent=1), encoding="utf-8")
    return found


def _key(gpu: Gpu, task: str, names: Sequence[str]) -> str:
    return f"{gpu.device}, {gpu.driver}: {task} by {', '.join(names)}"


def _remembered(gpu: Gpu, task: str, names: Sequence[str], file: Path) -> str | None:
    """The name that was found earlier; None where there is none."""
    found = _read(file).get(_key(gpu, task, names))
    return found if found in names else None


Variants = Callable[[GpuPose, Surface], Mapping[str, Callable[[], object]]]


def instancing_for(
    surface: Surface, setting: str, presumed: str, task: str, names: Sequence[str], variants: Variants
) -> str:
    """Resolve a parameter `instancing`. Where it is "auto", and told in the statistics: what was found to be
    the `fastest` of the variants on a graphics card; `presumed` on software drivers, and as long as nothing
    was found. variants: makes them for a trial; a function of a module, or a `partial` of one."""
    if setting != "auto":
        return setting
    gpu, chosen = surface.gpu, presumed
    if not gpu.software:
        chosen = gpu.cached(_Choices).choose(presumed, _Trial(task, tuple(names), variants))
    surface.stats.chosen["instancing"] = chosen
    return chosen


@dataclass(frozen=True)
class _Trial:
    """Variants of a task that another process measures; see `fastest`."""

    task: str
    names: tuple[str, ...]
    variants: Variants


class _Choices:
    """The variant of each task on a device, as far as one was asked for. What it says never changes.

    trials: the results of those that run or ran in another process.
    """

    def __init__(self, gpu: Gpu) -> None:
        self._gpu = gpu
        self._chosen: dict[str, str] = {}
        self._waiting: set[str] = set()
        self._helper = Helper()
        self.trials: dict[str, Future[None]] = {}

    def choose(self, presumed: str, trial: _Trial) -> str:
        """The variant of a task. The second picture that asks begins the trial of what nobody measured."""
        task = trial.task
        if task not in self._chosen:
            found = _remembered(self._gpu, task, trial.names, _file())
            self._chosen[task] = found or presumed
            if not found:
                self._waiting.add(task)
        elif task in self._waiting:
            self._waiting.remove(task)
            self._begin(trial)
        return self._chosen[task]

    def _begin(self, trial: _Trial) -> None:
        job = Task("Measuring which method draws splats fastest")
        given = (_file(), trial.task, trial.names, trial.variants, _TRIAL_POINTS, _TRIAL_SIZE)

        def run() -> None:
            try:
                self._helper.call(job, measure, *given)
            finally:
                self._helper.close()  # it holds memory of the card

        self.trials[trial.task] = in_background(job, run)


def measure(
    file: Path, task: str, names: Sequence[str], variants: Variants, points: int, size: tuple[int, int]
) -> None:
    """Find the `fastest` way of a task on a context of its own, by a picture of so many points and pixels,
    for `file` to remember."""
    gpu = headless()
    fastest(gpu, task, names, lambda: variants(*_trial(gpu, points, size)), file)
    gpu.ctx.release()


def _file() -> Path:
    return cache_folder() / "fastest.json"


def _trial(gpu: Gpu, count: int, size: tuple[int, int]) -> tuple[GpuPose, Surface]:
    """Splats to try variants on: a sphere of points in random order, and a picture of it begun."""
    i = np.arange(count) + 0.5
    polar, turn = np.arccos(1 - 2 * i / count), np.pi * (1 + 5**0.5) * i
    points = np.stack([np.cos(turn) * np.sin(polar), np.cos(polar), np.sin(turn) * np.sin(polar)], axis=1)
    points = np.random.default_rng(0).permutation(points)
    radii = np.full(count, 1.5 * (4 * np.pi / count) ** 0.5)
    cloud = PointCloud.from_arrays(points, normals=points, colors=0.5 * points + 0.5, radii=radii)
    pose, surface = GpuPose(gpu, Pose(0, 0.0, "trial", cloud)), Surface(gpu, size)
    camera = Camera.orbit(pose.bounds, aspect=size[0] / size[1])
    surface.start(pose, View.of(camera, size, cloud.origin, pose.bounds))
    return pose, surface


def _read(file: Path) -> dict[str, str]:
    """Names that are remembered; empty where the file is not there or is damaged."""
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return content if isinstance(content, dict) else {}


def _times(gpu: Gpu, variants: Mapping[str, Callable[[], object]]) -> dict[str, float]:
    """The least seconds of each variant, taking turns after one warm-up."""
    times: dict[str, float] = {}
    for turn in range(_TURNS + 1):
        for name, variant in variants.items():
            if turn and name not in times:
                continue
            gpu.ctx.finish()
            start = time.perf_counter()
            with suppress(Scan4DError):
                variant()
                gpu.ctx.finish()
                seconds = time.perf_counter() - start
                times[name] = min(times[name], seconds) if turn > 1 else seconds
    return times

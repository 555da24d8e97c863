"""Which of several variants is the fastest on this device: measured once, then remembered for this user.

As long as the file that remembers it stays, a frame has the same bits each time. Variants may round
differently (docs/developing/decisions/007-instancing.md).
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path

import numpy as np

from ..camera import Camera
from ..errors import InputError, Scan4DError
from ..files import whole_file
from ..folders import cache_folder
from ..gpu.context import Gpu
from ..gpu.pose import GpuPose
from ..picture.surface import Surface
from ..scan.points import PointCloud
from ..scan.pose import Pose
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
    file = file or cache_folder() / "fastest.json"
    remembered = _read(file)
    key = f"{gpu.device}, {gpu.driver}: {task} by {', '.join(names)}"
    if remembered.get(key) not in names:
        with gpu.timers.paused():
            times = _times(gpu, variants())
        remembered[key] = min(times, key=lambda name: times[name], default=names[0])
        with suppress(InputError), whole_file(file) as temporary:
            temporary.write_text(json.dumps(remembered, indent=1), encoding="utf-8")
    return remembered[key]


def instancing_for(
    surface: Surface,
    setting: str,
    on_software: str,
    task: str,
    names: Sequence[str],
    variants: Callable[[GpuPose, Surface], Mapping[str, Callable[[], object]]],
) -> str:
    """Resolve a parameter `instancing`. Where it is "auto", and told in the statistics: `on_software` on
    software drivers, on others what is the `fastest` of the variants, which are made for a trial."""
    if setting != "auto":
        return setting
    gpu, chosen = surface.gpu, on_software
    if not gpu.software:
        known = gpu.cached(_choices)
        if task not in known:
            known[task] = fastest(gpu, task, names, lambda: variants(*_trial(gpu)))
        chosen = known[task]
        surface.bind_view()  # in place of the trial's
    surface.stats.chosen["instancing"] = chosen
    return chosen


def _choices(_: Gpu) -> dict[str, str]:
    """The fastest way of each task on a device, as far as it was asked for."""
    return {}


def _trial(gpu: Gpu) -> tuple[GpuPose, Surface]:
    """Splats to try variants on: a sphere of points in random order, and a picture of it begun."""
    i = np.arange(_TRIAL_POINTS) + 0.5
    polar, turn = np.arccos(1 - 2 * i / _TRIAL_POINTS), np.pi * (1 + 5**0.5) * i
    points = np.stack([np.cos(turn) * np.sin(polar), np.cos(polar), np.sin(turn) * np.sin(polar)], axis=1)
    points = np.random.default_rng(0).permutation(points)
    radii = np.full(_TRIAL_POINTS, 1.5 * (4 * np.pi / _TRIAL_POINTS) ** 0.5)
    cloud = PointCloud.from_arrays(points, normals=points, colors=0.5 * points + 0.5, radii=radii)
    pose, surface = GpuPose(gpu, Pose(0, 0.0, "trial", cloud)), Surface(gpu, _TRIAL_SIZE)
    camera = Camera.orbit(pose.bounds, aspect=_TRIAL_SIZE[0] / _TRIAL_SIZE[1])
    surface.start(pose, View.of(camera, _TRIAL_SIZE, cloud.origin, pose.bounds))
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

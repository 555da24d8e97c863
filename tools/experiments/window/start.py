"""Where the time from the command to the first picture in the window goes.

Scans are the demo and a million points as PLY unless some are named. The window runs under Xvfb, each time
with a home of its own, as at a first start. `cold` is with no shader compiled before, but all of Python's
modules; `warm` the median of the starts that follow. Each row is when a stage is over: wall time since the
process was asked for, and processor time of all its threads, both in ms. `imports`: the modules that take
longest to import, by themselves."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import tempfile
import time
from argparse import Namespace
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from virtual_screen import Screen, virtual_screen

from experiments.script import Script
from experiments.speed.clouds import dented_sphere
from experiments.tables import Row
from viewer.scan import formats

ROOT = Path(__file__).resolve().parents[3]
_POINTS = 1_000_000
_SLOWEST = 25  # modules that are listed


@dataclass(frozen=True)
class Start:
    """One start. stages: ms of wall and of processor time by name. shaders_ms: of them; shaders: how many."""

    stages: dict[str, tuple[float, float]]
    shaders_ms: float
    shaders: int


def started(screen: Screen, scan: str, shaders: Path, options: tuple[str, ...] = ()) -> tuple[Start, str]:
    """Start the window on a scan; and what was written to standard error. shaders: the driver's cache."""
    with tempfile.TemporaryDirectory() as home:
        homes = {name: str(Path(home, name)) for name in ("XDG_CONFIG_HOME", "XDG_STATE_HOME")}
        environment = {
            **screen.env,
            **homes,
            "MESA_SHADER_CACHE_DIR": str(shaders),
            "PYTHONDONTWRITEBYTECODE": "",
            "PYTHONPYCACHEPREFIX": str(shaders.parent / "compiled"),
            "PYTHONPATH": str(ROOT),
        }
        begin = time.monotonic()
        done = subprocess.run(
            [sys.executable, *options, str(Path(__file__).with_name("started.py")), scan],
            env=environment,
            capture_output=True,
            text=True,
            check=False,
        )
    if done.returncode:
        raise SystemExit(f"{scan}: the window ended with {done.returncode}:\n{done.stderr[-2000:]}")
    stated: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    stages = {name: ((at - begin) * 1e3, busy * 1e3) for name, at, busy in stated["stages"]}
    return Start(stages, stated["shaders"][0] * 1e3, stated["shaders"][1]), done.stderr


@contextmanager
def screen_and_scans(options: Namespace) -> Iterator[tuple[Screen, Path, list[str]]]:
    """A screen, a folder for what the driver compiles, and the scans, for which Python's files are
    compiled."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "screen").mkdir()
        scans = list(options.scans)
        if not scans:
            scan = folder / "million.ply"
            formats.write(scan, dented_sphere(_POINTS))
            scans = ["demo", str(scan)]
        with virtual_screen(folder / "screen", options.size) as screen:
            for scan in scans:
                started(screen, scan, folder / "before")
            yield screen, folder, scans


def start(options: Namespace) -> Iterator[Row]:
    """When each stage of a start is over."""
    with screen_and_scans(options) as (screen, folder, scans):
        for scan in scans:
            shaders = folder / f"shaders-{Path(scan).name}"
            cold, _ = started(screen, scan, shaders)
            warm = [started(screen, scan, shaders)[0] for _ in range(options.rounds)]
            for stage, (wall, busy) in cold.stages.items():
                walls, busies = np.median([each.stages[stage] for each in warm], axis=0).tolist()
                times = {
                    "cold, ms": wall,
                    "processor, ms": busy,
                    "warm, ms": walls,
                    "warm processor, ms": busies,
                }
                yield {"scan": Path(scan).name, "stage over": stage, **times}
            programs = f"of that {cold.shaders} programs"
            median = float(np.median([each.shaders_ms for each in warm]))
            times = {"cold, ms": cold.shaders_ms, "processor, ms": None, "warm, ms": median}
            yield {"scan": Path(scan).name, "stage over": programs, **times}


def imports(options: Namespace) -> Iterator[Row]:
    """The modules that take longest, as `-X importtime` has them."""
    with screen_and_scans(options) as (screen, folder, scans):
        log = started(screen, scans[0], folder / "shaders", ("-X", "importtime"))[1]
    times = re.findall(r"import time:\s+(\d+) \|\s+(\d+) \| *(\S+)", log)
    for own, all_of_it, name in sorted(times, key=lambda each: -int(each[0]))[:_SLOWEST]:
        yield {"module": name, "ms": int(own) / 1e3, "with what it imports, ms": int(all_of_it) / 1e3}


EXPERIMENT = Script([start, imports], {"scans": [], "size": (1280, 720), "rounds": 5})

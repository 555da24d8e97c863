"""Where the time from the command to the first picture in the window goes. Prints a table for each scan.

    python tests/speed/start.py [--rounds 5] [--size 1280x720] [--imports] [SCAN ...]

Scans are the demo and a million points as PLY unless some are named. The window runs under Xvfb, each time
with a home of its own, as at a first start. `cold` is with no shader compiled before, but all of Python's
modules; `warm` the median of the starts that follow. Each line is when a stage is over: wall time since the
process was asked for, and in brackets processor time of all its threads, both in ms. --imports: the modules
that take longest to import, by themselves.
"""

from __future__ import annotations

import argparse
import json
import re
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "app"))
from points import cloud_of
from virtual_screen import Screen, virtual_screen

from viewer.scan import formats

ROOT = Path(__file__).resolve().parents[2]
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
    told: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    stages = {name: ((at - begin) * 1e3, busy * 1e3) for name, at, busy in told["stages"]}
    return Start(stages, told["shaders"][0] * 1e3, told["shaders"][1]), done.stderr


def print_starts(scan: str, cold: Start, warm: list[Start]) -> None:
    """Print how far a start is when."""
    print(f"\n{scan}\n{'stage over':28} {'cold':>16} {'warm':>16}")
    for stage, (wall, busy) in cold.stages.items():
        walls, busies = np.median([start.stages[stage] for start in warm], axis=0)
        print(f"{stage:28} {wall:8.0f} ({busy:5.0f}) {walls:8.0f} ({busies:5.0f})")
    told = [cold.shaders_ms, float(np.median([start.shaders_ms for start in warm]))]
    print(f"{f'of that {cold.shaders} programs':28} {told[0]:8.0f}         {told[1]:8.0f}", flush=True)


def print_imports(log: str) -> None:
    """Print the modules that take longest, of what `-X importtime` has written."""
    times = re.findall(r"import time:\s+(\d+) \|\s+(\d+) \| *(\S+)", log)
    total = sum(int(own) for own, *_ in times) / 1e3
    print(f"\n{len(times)} modules, {total:.0f} ms\n{'ms':>8} {'with what it imports':>22}")
    for own, all_of_it, name in sorted(times, key=lambda each: -int(each[0]))[:_SLOWEST]:
        print(f"{int(own) / 1e3:8.1f} {int(all_of_it) / 1e3:22.1f}  {name}")


def main() -> None:
    arguments = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    arguments.add_argument("--rounds", type=int, default=5)
    arguments.add_argument("--size", default="1280x720")
    arguments.add_argument("--imports", action="store_true")
    arguments.add_argument("scans", nargs="*", metavar="SCAN")
    options = arguments.parse_args()
    width, height = (int(n) for n in options.size.split("x"))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "screen").mkdir()
        scans = options.scans
        if not scans:
            scan = folder / "million.ply"
            formats.write(scan, cloud_of(_POINTS))
            scans = ["demo", str(scan)]
        with virtual_screen(folder / "screen", (width, height)) as screen:
            for scan in scans:
                started(screen, scan, folder / "before")  # so that all of Python's files are compiled
                shaders = folder / f"shaders-{Path(scan).name}"
                cold, _ = started(screen, scan, shaders)
                warm = [started(screen, scan, shaders)[0] for _ in range(options.rounds)]
                print_starts(scan, cold, warm)
                if options.imports:
                    print_imports(started(screen, scan, shaders, ("-X", "importtime"))[1])


if __name__ == "__main__":
    main()

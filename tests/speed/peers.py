"""Scan4D beside other viewers of points, in one run. Prints a table.

    python3 -m venv ENVIRONMENT
    ENVIRONMENT/bin/pip install pyvista vispy PyOpenGL polyscope open3d-cpu
    python tests/speed/peers.py --python ENVIRONMENT/bin/python [--rounds 7] [--size 1920x1280]
                                [--points 100000 1000000 10000000] [--splats 100000 1000000]
                                [--peers pyvista vispy polyscope open3d] [--pictures FOLDER]

The viewers are no dependencies of Scan4D: they stand in an environment of their own, the one of `--python`,
and each runs in a process of its own (`peer.py` has what each is asked for), without a window. All are shown
the same arrays, in random order, and draw them from the same eye, which moves a little for each picture, in
turns; the picture is read back. A new cloud counts from its arrays in memory. Splats have a size in the
scene; Open3D has none such, and draws squares of one size in pixels. Medians of wall time and of processor
time of all threads. Coverage is the share of the pixels that show something, of the first picture: where it
differs from Scan4D's by more than --apart, of itself, that is told, and the exit status is 1. A viewer that
is not there or does not work here is named with the reason.
"""

from __future__ import annotations

import argparse
import json
import math
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

import numpy as np
from peer import DISTANCE, FOV, PEERS
from points import cloud_of
from splats import sphere

_STEP = 0.004  # radians that the eye moves on by with each picture


class Failed(Exception):
    """A viewer that cannot do what it is asked for."""


class Process:
    """A viewer in its process."""

    def __init__(self, python: str, name: str, size: str, log: IO[str]) -> None:
        self.name = name
        self._log = log
        self._process = subprocess.Popen(
            [python, str(Path(__file__).with_name("peer.py")), name, size],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=log,
            text=True,
        )

    def ask(self, command: str, **given: Any) -> dict[str, Any]:
        """Have a command done; raises Failed with the reason where it cannot be."""
        assert self._process.stdin
        assert self._process.stdout
        try:
            print(json.dumps([command, given]), file=self._process.stdin, flush=True)
            line = self._process.stdout.readline()
        except BrokenPipeError:
            line = ""
        if not line:
            raise Failed(f"its process ended with {self._process.wait()}: {self._last_words()}")
        answer: dict[str, Any] = json.loads(line)
        if "error" in answer:
            raise Failed(answer["error"])
        return answer

    def _last_words(self) -> str:
        self._log.seek(0)
        return (self._log.read().strip().splitlines() or ["nothing was said"])[-1]

    def close(self) -> None:
        """End it."""
        self._process.communicate()


@dataclass
class Measured:
    """Pictures of one viewer in one case. failed: why there are none."""

    ms: list[float] = field(default_factory=list)
    busy_ms: list[float] = field(default_factory=list)
    coverage: float = math.nan
    failed: str | None = None


@dataclass(frozen=True)
class Case:
    """What is drawn. fresh: another cloud for each picture. splats: of 1.5 spacings' radius."""

    count: int
    splats: bool = False
    fresh: bool = False

    def __str__(self) -> str:
        kind = "splats" if self.splats else "points"
        return f"{self.count:,} {kind}{', new each picture' if self.fresh else ''}"

    @property
    def radius(self) -> float:
        """In scan units; 0 of points."""
        return 1.5 * (4 * math.pi / self.count) ** 0.5 if self.splats else 0.0

    def write(self, folder: Path, seed: int) -> str:
        """Make the arrays that are shown, and return where."""
        cloud = sphere(self.count, "random") if self.splats else cloud_of(self.count, seed)
        colors = np.clip(cloud.positions * 0.4 + 0.5, 0, 1)
        place = folder / f"{self.count}-{self.splats}-{seed}"
        place.mkdir(exist_ok=True)
        np.save(place / "positions.npy", cloud.positions)
        np.save(place / "colors.npy", colors.astype(np.float32))
        return str(place)


def eye_at(turn: int) -> tuple[float, float, float]:
    """Where picture number `turn` is seen from."""
    around, up = math.radians(20) + turn * _STEP, math.radians(15)
    flat = DISTANCE * math.cos(up)
    return flat * math.sin(around), DISTANCE * math.sin(up), flat * math.cos(around)


def measure(
    case: Case, processes: list[Process], rounds: int, folder: Path, pictures: Path | None
) -> dict[str, Measured]:
    """Have all draw it, in turns, a picture of each before the first that counts."""
    clouds = [case.write(folder, seed) for seed in range(rounds + 1 if case.fresh else 1)]
    result = {process.name: Measured() for process in processes}
    for turn in range(rounds + 1):
        for process in processes:
            told = result[process.name]
            if told.failed:
                continue
            first = turn == 0
            saved = pictures and str(pictures / f"{process.name}-{str(case).replace(' ', '-')}.png")
            try:
                if first:
                    process.ask("show", folder=clouds[0], radius=case.radius)
                new = clouds[turn] if case.fresh and not first else None
                drawn = process.ask("draw", eye=eye_at(turn), folder=new, save=saved if first else None)
            except Failed as why:
                told.failed = str(why)
                continue
            if first:
                told.coverage = drawn["coverage"]
            else:
                told.ms.append(drawn["ms"])
                told.busy_ms.append(drawn["busy_ms"])
    return result


def print_case(case: Case, result: dict[str, Measured], apart: float) -> bool:
    """Print its rows; whether all pictures cover as much as Scan4D's."""
    ours = result["scan4d"]
    equal = True
    for name, told in result.items():
        if told.failed:
            print(f"{case!s:36} {name:10} failed: {told.failed}")
            continue
        ms, busy = float(np.median(told.ms)), float(np.median(told.busy_ms))
        ratios = ""
        if not ours.failed:
            ratios = f"{ms / np.median(ours.ms):7.1f} {busy / np.median(ours.busy_ms):7.1f}"
            off = told.coverage / ours.coverage - 1
            if abs(off) > apart:
                equal = False
                ratios += f"  covers {off:+.1%}"
        print(f"{case!s:36} {name:10} {ms:9.1f} {busy:9.1f} {told.coverage:9.2%} {ratios}", flush=True)
    return equal


@contextmanager
def running(python: str, names: list[str], size: str) -> Iterator[list[Process]]:
    """The viewers that work here, Scan4D first; others are told with the reason."""
    started: list[Process] = []
    with ExitStack() as stack:
        for name in ("scan4d", *names):
            log = stack.enter_context(tempfile.TemporaryFile("w+", errors="replace"))
            process = Process(sys.executable if name == "scan4d" else python, name, size, log)
            stack.callback(process.close)
            try:
                about = process.ask("about")
            except Failed as why:
                print(f"{name}: left out: {why}")
                continue
            started.append(process)
            print(f"{name} {about['version']}: {about['points']}; {about['splats']}")
        yield started


def main() -> int:
    """0 where all that work here cover the same."""
    arguments = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    arguments.add_argument(
        "--python", required=True, help="the interpreter of the other viewers' environment"
    )
    arguments.add_argument("--rounds", type=int, default=7)
    arguments.add_argument("--size", default="1920x1280")
    arguments.add_argument("--points", type=int, nargs="*", default=[100_000, 1_000_000, 10_000_000])
    arguments.add_argument("--new", type=int, nargs="*", default=[100_000])
    arguments.add_argument("--splats", type=int, nargs="*", default=[100_000, 1_000_000])
    others = [name for name in PEERS if name != "scan4d"]
    arguments.add_argument("--peers", nargs="*", choices=others, default=others)
    arguments.add_argument("--pictures", type=Path, help="the first of each, as PNG, into this folder")
    arguments.add_argument("--apart", type=float, default=0.05)
    options = arguments.parse_args()
    if options.pictures:
        options.pictures.mkdir(parents=True, exist_ok=True)

    cases = [Case(count) for count in options.points]
    cases += [Case(count, fresh=True) for count in options.new]
    cases += [Case(count, splats=True) for count in options.splats]
    equal = True
    with running(options.python, options.peers, options.size) as processes:
        print(f"\n{options.size}, {FOV:g} degrees, medians of {options.rounds} pictures")
        print(f"{'':36} {'':10} {'ms':>9} {'busy ms':>9} {'coverage':>9} {'/ Scan4D':>7} {'busy':>6}")
        for case in cases:
            with tempfile.TemporaryDirectory() as folder:
                result = measure(case, processes, options.rounds, Path(folder), options.pictures)
            equal &= print_case(case, result, options.apart)
    return 0 if equal else 1


if __name__ == "__main__":
    sys.exit(main())

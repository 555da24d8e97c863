"""Scan4D beside other viewers of points.

    python3 -m venv ENVIRONMENT
    ENVIRONMENT/bin/pip install pyvista vispy PyOpenGL polyscope open3d-cpu
    python tools/experiment.py peers --python ENVIRONMENT/bin/python

The viewers are no dependencies of Scan4D: they stand in an environment of their own, and each runs in a
process of its own (`peer.py` has what each is asked for), without a window. All draw the same arrays, in
random order, from the same eye, which moves a little for each picture, in turns; the picture is read back. A
new cloud counts from its arrays in memory. Splats have a size in the scene; Open3D has none such, and draws
squares of one size in pixels. Medians of wall time and of processor time of all threads. Coverage is the
share of the pixels that show something, of the first picture. Where it differs from Scan4D's by more than
--apart, of itself, the experiment fails. A viewer that is not there or does not work here is named with the
reason."""

from __future__ import annotations

import json
import math
import subprocess
import sys
import tempfile
from argparse import Namespace
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

import numpy as np

from experiments.script import Failed, Script
from experiments.speed.clouds import dented_sphere, even_sphere
from experiments.speed.peer import DISTANCE, PEERS
from experiments.tables import Row

_STEP = 0.004  # radians that the eye moves on by with each picture


class NoPicture(Exception):
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
        """Have a command done; raises NoPicture with the reason where it cannot be."""
        assert self._process.stdin
        assert self._process.stdout
        try:
            print(json.dumps([command, given]), file=self._process.stdin, flush=True)
            line = self._process.stdout.readline()
        except BrokenPipeError:
            line = ""
        if not line:
            raise NoPicture(f"its process ended with {self._process.wait()}: {self._last_words()}")
        answer: dict[str, Any] = json.loads(line)
        if "error" in answer:
            raise NoPicture(answer["error"])
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
        cloud = even_sphere(self.count, "random") if self.splats else dented_sphere(self.count, seed)
        colors = np.clip(cloud.positions * 0.4 + 0.5, 0, 1)
        arrays = folder / f"{self.count}-{self.splats}-{seed}"
        arrays.mkdir(exist_ok=True)
        np.save(arrays / "positions.npy", cloud.positions)
        np.save(arrays / "colors.npy", colors.astype(np.float32))
        return str(arrays)


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
            found = result[process.name]
            if found.failed:
                continue
            first = turn == 0
            saved = pictures and str(pictures / f"{process.name}-{str(case).replace(' ', '-')}.png")
            try:
                if first:
                    process.ask("show", folder=clouds[0], radius=case.radius)
                new = clouds[turn] if case.fresh and not first else None
                drawn = process.ask("draw", eye=eye_at(turn), folder=new, save=saved if first else None)
            except NoPicture as why:
                found.failed = str(why)
                continue
            if first:
                found.coverage = drawn["coverage"]
            else:
                found.ms.append(drawn["ms"])
                found.busy_ms.append(drawn["busy_ms"])
    return result


@contextmanager
def running(python: str, names: list[str], size: str) -> Iterator[list[Process]]:
    """The viewers that work here, Scan4D first; others are reported with the reason."""
    started: list[Process] = []
    with ExitStack() as stack:
        for name in ("scan4d", *names):
            log = stack.enter_context(tempfile.TemporaryFile("w+", errors="replace"))
            process = Process(sys.executable if name == "scan4d" else python, name, size, log)
            stack.callback(process.close)
            try:
                about = process.ask("about")
            except NoPicture as why:
                print(f"{name}: left out: {why}", file=sys.stderr)
                continue
            started.append(process)
            print(f"{name} {about['version']}: {about['points']}; {about['splats']}", file=sys.stderr)
        yield started


def peers(options: Namespace) -> Iterator[Row]:
    """Times and coverage of each viewer in each case. Raises Failed where pictures cover less or more than
    ours."""
    if options.pictures:
        options.pictures.mkdir(parents=True, exist_ok=True)
    cases = [Case(count) for count in options.points]
    cases += [Case(count, fresh=True) for count in options.new]
    cases += [Case(count, splats=True) for count in options.splats]
    apart = []
    size = "x".join(map(str, options.size))
    with running(str(options.python), options.peers, size) as processes:
        for case in cases:
            with tempfile.TemporaryDirectory() as folder:
                result = measure(case, processes, options.rounds, Path(folder), options.pictures)
            ours = result["scan4d"]
            for name, found in result.items():
                row: Row = {"case": str(case), "viewer": name}
                if found.failed:
                    print(f"{case}, {name}: failed: {found.failed}", file=sys.stderr)
                    continue
                ms, busy = float(np.median(found.ms)), float(np.median(found.busy_ms))
                row |= {"ms": ms, "processor, ms": busy, "coverage": f"{found.coverage:.2%}"}
                if not ours.failed:
                    ratios = ms / np.median(ours.ms), busy / np.median(ours.busy_ms)
                    row |= {"times ours": float(ratios[0]), "processor, times ours": float(ratios[1])}
                    if abs(found.coverage / ours.coverage - 1) > options.apart:
                        apart.append(f"{case}, {name}: covers {found.coverage / ours.coverage - 1:+.1%}")
                yield row
    if apart:
        raise Failed("\n".join(apart))


EXPERIMENT = Script(
    [peers],
    {
        "python": sys.executable,
        "rounds": 7,
        "size": (1920, 1280),
        "points": [100_000, 1_000_000, 10_000_000],
        "new": [100_000],
        "splats": [100_000, 1_000_000],
        "peers": [name for name in PEERS if name != "scan4d"],
        "pictures": None,
        "apart": 0.05,
    },
)

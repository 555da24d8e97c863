"""Measure run time against error: every renderer, on scenes whose truth is known.

Writes into DIR: report.html, one page that holds all of it; results.jsonl, a row for each scene,
backend and setting; numerics.jsonl, the stability suite; plots and pictures.
Ctrl-C stops it and keeps what was measured.
"""

from __future__ import annotations

import os
import re
from argparse import ArgumentParser, ArgumentTypeError, Namespace
from collections.abc import Sequence
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

from ..backends import backend, backends
from ..bench import numerics
from ..bench.plan import Group, plan
from ..bench.report.page import write_report
from ..bench.report.results import NOTES, NUMERICS, RESULTS, compare, read_rows, write_row
from ..bench.run import Bench, Settings
from ..bench.scenes import catalog
from ..errors import InputError
from ..files import whole_file
from . import drawing
from .console import progress, warn

_SUITES = ("scenes", "numerics")
_BESIDE = Path(__file__).resolve().parents[3] / "shared" / "data"  # of a checkout
_LIBRARIES = ("jinja2", "matplotlib", "scipy", "skimage")
# Enough to see whether a change helps, in two minutes on two cores.
_QUICK = Settings(size=(384, 256), views=4, repeat=1, frames=3)
_QUICK_SCENES = ("torus", "bunny", "demo", "torus-simulated")
_QUICK_COUNTS = (10_000, 1_000_000)
_QUICK_NOISES = (2.0,)
_LEAST = 32  # pixels of a picture's edge, for metrics that look at windows


def add_arguments(parser: ArgumentParser) -> None:
    """The arguments of `scan4d bench`."""
    parser.add_argument(
        "-o",
        "--output",
        dest="out",
        metavar="DIR",
        type=Path,
        required=True,
        help="the folder of the results",
    )
    parser.add_argument(
        "--backend", nargs="+", metavar="NAME", help="default: all; gl-points and mesh are always in"
    )
    parser.add_argument(
        "--scene",
        nargs="+",
        metavar="NAME|FILE",
        help="scenes by name, or meshes (PLY, OBJ); default: all there are",
    )
    parser.add_argument("--suite", choices=_SUITES, help="only this part; default: both")
    parser.add_argument(
        "--quick", action="store_true", help="few scenes, few views, small pictures: two minutes"
    )
    parser.add_argument(
        "--data", type=Path, metavar="DIR",
        help="the folder of real scans; default: SCAN4D_DATA, or shared/data beside the checkout",
    )  # fmt: skip
    parser.add_argument(
        "--compare", type=Path, metavar="OLD", help="say what got slower or worse than in these results"
    )
    parser.add_argument("--size", type=_size, metavar="WxH", help="of the pictures, default 1920x1280")
    parser.add_argument("--views", type=_count, metavar="N", help="of each scene, default 20")
    parser.add_argument("--seed", type=int, metavar="N", help="of viewpoints, samples and noise, default 0")


def run(args: Namespace) -> int:
    """Measure, report, compare. 1 where Ctrl-C stopped it."""
    _check_libraries()
    old = read_rows(args.compare) if args.compare else None
    names = args.backend or list(backends())
    for name in names:
        backend(name)  # wrong names are told before anything is drawn
    settings, notes = _settings(args), list[str]()
    groups = _groups(args, settings, names, notes) if args.suite != "numerics" else []
    tested = names if args.suite != "scenes" else []
    _prepare_folder(args.out, [*([RESULTS] if groups else []), *([NUMERICS] if tested else [])])

    bench = Bench(drawing.renderer(args.device), settings, args.out)
    stopped = False
    try:
        _foretell(bench, groups, tested)
        _measure(bench, groups, args.out)
        _test(bench, tested, args.out)
    except KeyboardInterrupt:
        stopped = True
        notes.append("Stopped before the end.")
    _write_notes(args.out, [*notes, *bench.notes])
    print(write_report(args.out))
    if old is not None:
        print(*compare(old, read_rows(args.out)), sep="\n")
    return int(stopped)


def _measure(bench: Bench, groups: Sequence[Group], out: Path) -> None:
    """Write the rows of all groups, those that Ctrl-C stopped too."""
    if not groups:
        return
    with (
        open(out / RESULTS, "w", encoding="utf-8") as stream,
        progress(sum(bench.steps(group) for group in groups)) as tick,
    ):
        for group in groups:
            for row in bench.measure(group, tick):
                write_row(stream, row)
            if bench.stopped:
                raise KeyboardInterrupt


def _test(bench: Bench, names: Sequence[str], out: Path) -> None:
    """Write the lines of the stability suite."""
    if not names:
        return
    with open(out / NUMERICS, "w", encoding="utf-8") as stream, progress(_lines(names)) as tick:
        for line in bench.numerics(names, tick):
            write_row(stream, line)


def _lines(names: Sequence[str]) -> int:
    return len(names) * sum(1 for _ in numerics.rows())


def _foretell(bench: Bench, groups: Sequence[Group], tested: Sequence[str]) -> None:
    """Say how much there is to do and how long it will take, from one view of a sphere."""
    if groups:
        seconds = bench.foretell(groups)
        rows = sum(len(group.contenders) for group in groups)
        minutes = f"{seconds / 60:.0f} minutes" if seconds >= 100 else f"{seconds:.0f} seconds"
        scenes = len({group.scene for group in groups})
        print(f"{rows} rows on {scenes} scenes: about {minutes}", flush=True)
    if tested:
        print(f"{_lines(tested)} rows of the stability suite: some seconds a backend", flush=True)


def _settings(args: Namespace) -> Settings:
    """How to measure; `--quick`, and what was said."""
    beside = str(_BESIDE) if _BESIDE.is_dir() else None
    data = args.data or os.environ.get("SCAN4D_DATA") or beside
    if data is not None and not Path(data).is_dir():
        raise InputError("is no folder of real scans", data, "Name one with --data")
    told = {"size": args.size, "views": args.views, "seed": args.seed, "data": data and Path(data)}
    return replace(_QUICK if args.quick else Settings(), **{k: v for k, v in told.items() if v is not None})


def _groups(args: Namespace, settings: Settings, names: Sequence[str], notes: list[str]) -> list[Group]:
    """What to measure; what cannot be had is noted, unless it was asked for by name."""
    missing = catalog.names(settings.data)
    scenes = args.scene or [name for name in (_QUICK_SCENES if args.quick else missing) if not missing[name]]
    if args.quick:
        groups = plan(scenes, names, _QUICK_COUNTS, _QUICK_NOISES, swept_scenes=1)
    else:
        groups = plan(scenes, names)
    for group in groups:
        settings.subject(group)  # raises where it cannot be had
    if not args.scene:
        notes += [f"{name} is left out: {reason}" for name, reason in missing.items() if reason]
    for note in notes:
        warn(note)
    return groups


def _prepare_folder(out: Path, files: Sequence[str]) -> None:
    """Make the folder; results of an earlier run that will be made anew stay beside as old-*."""
    try:
        out.mkdir(parents=True, exist_ok=True)
        for name in files:
            if (out / name).exists():
                (out / name).replace(out / f"old-{name}")
    except OSError as error:
        raise InputError(f"cannot be written: {error.strerror or error}", out) from error


def _write_notes(out: Path, notes: Sequence[str]) -> None:
    with whole_file(out / NOTES) as path:
        path.write_text("".join(f"{note}\n" for note in notes), encoding="utf-8")


def _check_libraries() -> None:
    missing = [name for name in _LIBRARIES if find_spec(name) is None]
    if missing:
        raise InputError(
            f"the benchmark needs {', '.join(missing)}", hint="Install them: pip install 'scan4d[bench]'"
        )


def _size(text: str) -> tuple[int, int]:
    match = re.fullmatch("([0-9]{1,5})[xX]([0-9]{1,5})", text)
    if not match or min(int(match[1]), int(match[2])) < _LEAST:
        raise ArgumentTypeError(f"'{text}' is no size of at least {_LEAST} pixels, such as 1920x1280")
    return int(match[1]), int(match[2])


def _count(text: str) -> int:
    if not text.isdecimal() or int(text) < 1:
        raise ArgumentTypeError(f"'{text}' is no number of at least 1")
    return int(text)

"""Measure the run time and the error of every renderer.

The scenes have a known truth. DIR receives report.html, one page with all results; results.jsonl, a row for
each scene, renderer and setting; numerics.jsonl, the results of the stability suite; plots and pictures.
Ctrl-C stops the run and keeps the results so far.
"""

from __future__ import annotations

import os
from argparse import ArgumentParser, Namespace
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import chain, count, product
from pathlib import Path

from ..backends import backend, backends
from ..bench import numerics
from ..bench.choosing import SCENES, laws_of, measure_ways
from ..bench.forecast import forecast
from ..bench.plan import Group, plan
from ..bench.report.page import PAGE, write_report
from ..bench.report.pictures import picture_path
from ..bench.report.results import (
    NOTES,
    NUMERICS,
    RESULTS,
    WAYS,
    Row,
    compare,
    read_rows,
    write_row,
)
from ..bench.run import Bench, BenchSettings
from ..bench.scenes import catalog
from ..bench.suites import PAGE_SUITES
from ..choice.known import keep_model
from ..errors import InputError, explained
from ..files import output_folder, whole_file
from ..imports import require
from ..signals import held_interrupts
from . import _arguments as arguments
from . import _drawing as drawing
from ._console import progress, tell, warn
from ._outputs import add_force_argument, claim

_SUITES = ("scenes", "numerics", *PAGE_SUITES)
_BESIDE = Path(__file__).resolve().parents[3] / "shared" / "data"  # of a checkout
_LIBRARIES = ("jinja2", "matplotlib", "scipy", "skimage")
# Enough to see whether a change helps, in two minutes on two cores.
_QUICK = BenchSettings(size=(384, 256), views=4, repeat=1, frames=3)
_QUICK_SCENES = ("torus", "bunny", "demo", "torus-simulated")
_QUICK_COUNTS = (10_000, 1_000_000)
_QUICK_NOISES = (2.0,)
_CALIBRATION = BenchSettings(views=4, repeat=2, frames=0)
_QUICK_CALIBRATION = ("torus", "box", "sheets-bare", "torus-simulated")
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
        help="folder for the results",
    )
    add_force_argument(parser)
    parser.add_argument(
        "--backend",
        nargs="+",
        action="extend",
        metavar="NAME",
        help="measure only these renderers; gl-points and mesh are always included",
    )
    parser.add_argument(
        "--scene",
        nargs="+",
        action="extend",
        metavar="NAME|FILE",
        help="measure only these scenes: names, or meshes (PLY, OBJ, NPZ)",
    )
    parser.add_argument("--suite", choices=_SUITES, help="one suite; default: scenes and numerics")
    parser.add_argument(
        "--calibrate", action="store_true",
        help="measure only what the automatic choice needs on this device, and store it for this user",
    )  # fmt: skip
    parser.add_argument(
        "--quick", action="store_true", help="few scenes, few views, small pictures: two minutes"
    )
    parser.add_argument(
        "--report", action="store_true", help="measure nothing; make the report from the rows in DIR"
    )
    parser.add_argument(
        "--data", type=Path, metavar="DIR",
        help="folder of real scans; default: SCAN4D_DATA, or shared/data beside the checkout",
    )  # fmt: skip
    parser.add_argument(
        "--compare", type=Path, metavar="OLD", help="list what got slower or worse than these results"
    )
    parser.add_argument(
        "--size", type=arguments.size, metavar="WxH", help="size of the pictures; default 1920x1280"
    )
    parser.add_argument("--views", type=arguments.count, metavar="N", help="views of each scene; default 20")
    parser.add_argument(
        "--seed", type=arguments.seed, metavar="N", help="seed of viewpoints, samples and noise; default 0"
    )


def run(args: Namespace) -> int:
    """Measure, report, compare, or only report. 1 where Ctrl-C stopped it."""
    require(*_LIBRARIES, *(("DracoPy",) if args.suite == "octrees" else ()))
    if args.calibrate:
        return _calibrate(args)
    if args.report:
        if args.compare or args.backend or args.scene:
            hint = "Leave out --compare, --backend and --scene"
            raise InputError("measures nothing: it reports all rows in DIR", "--report", hint)
        claim(_report_files(args), [], args.force)
        _report(args)
        return 0
    if args.compare and args.suite == "numerics":
        raise InputError("--compare applies only to scenes", "--suite numerics")
    suite = PAGE_SUITES.get(args.suite)
    if suite is not None and (args.backend or (args.scene and suite.scenes is None)):
        own, hint = ("scenes and renderer", "--scene and ") if suite.scenes is None else ("renderers", "")
        raise InputError(f"defines its own {own}", f"--suite {args.suite}", f"Leave out {hint}--backend")
    old = read_rows(args.compare) if args.compare else None
    names = list(dict.fromkeys(args.backend or backends()))
    for name in names:
        backend(name)  # wrong names are told before anything is drawn
    settings = _settings(args)
    groups, missing = _groups(args, settings, names)
    tested = names if args.suite in (None, "numerics") else []
    bench = Bench(drawing.renderer(args.device), settings, args.out)
    _claim(args, settings, groups, bool(tested))
    output_folder(args.out)
    for name in missing:
        warn(name)

    _foretell(bench, groups, tested, _others(args))
    steps = sum(map(bench.steps, groups))
    measured: list[bool] = []
    try:
        with held_interrupts() as bench.interrupts:  # rows that are measured are written whatever happens
            measured += [_write(args.out / RESULTS, bench, steps, _measured(bench, groups))]
            lines = bench.until_stopped(bench.numerics(tested))
            measured += [_write(args.out / NUMERICS, bench, _lines(tested), lines)]
            for name, measure in _others(args).items():
                measured += [_write(args.out / name, bench, 0, bench.until_stopped(measure(bench)))]
        if not any(measured):
            if bench.stopped:
                raise KeyboardInterrupt
            raise InputError("; ".join(bench.notes) or "there is nothing to measure")
        stopped = ["Stopped before the end."] if bench.stopped else []
        _write_notes(args.out, [*missing, *bench.notes, *stopped])
        _report(args)
    except KeyboardInterrupt:
        if any(measured):
            warn(f"{args.out} holds the rows. 'scan4d bench --report' makes the page from them")
        raise
    if old is not None:
        print(*compare(old, read_rows(args.out)), sep="\n")
    return int(bench.stopped)


def _calibrate(args: Namespace) -> int:
    """Measure each way of drawing that may be chosen, unless `--report` says that the rows are there, and
    keep the model of them. 1 where Ctrl-C stopped it: nothing is kept then."""
    if args.suite or args.backend or args.compare:
        hint = "Leave out --suite, --backend and --compare"
        raise InputError("defines its own pictures and renderers", "--calibrate", hint)
    usual = replace(_CALIBRATION, views=2) if args.quick else _CALIBRATION
    settings = _settings(args, usual)
    renderer = drawing.renderer(args.device)
    if not args.report:
        claim([args.out / WAYS, args.out / NOTES], [*map(Path, args.scene or ())], args.force)
        output_folder(args.out)
        bench = Bench(renderer, settings)
        scenes = args.scene or (_QUICK_CALIBRATION if args.quick else SCENES)
        with held_interrupts() as bench.interrupts:
            _write(args.out / WAYS, bench, 0, bench.until_stopped(measure_ways(bench, scenes)))
        _write_notes(args.out, bench.notes)
        if bench.stopped:
            warn(f"{args.out} holds the rows. 'scan4d bench --calibrate --report' uses them")
            return 1
    tell(keep_model(renderer.gpu, laws_of(read_rows(args.out / WAYS))))
    return 0


def _report(args: Namespace) -> None:
    """Make the pages of the rows in the folder, and say what is there."""
    suite = PAGE_SUITES.get(args.suite)
    if suite is None or suite.groups is not None:
        tell(write_report(args.out))
    if suite is not None:
        tell(suite.write_page(args.out))


def _others(args: Namespace) -> Mapping[str, Callable[[Bench], Iterator[Row]]]:
    """Other measurements of a suite than pictures of scenes, by the files of their rows."""
    if args.suite not in PAGE_SUITES:
        return {}
    suite = PAGE_SUITES[args.suite]
    if suite.scenes is None:
        return suite.others
    scenes = args.scene or (suite.quick[0] if args.quick and suite.quick else suite.scenes)
    return {name: partial(measure, scenes=scenes) for name, measure in suite.others.items()}


def _report_files(args: Namespace) -> list[Path]:
    """The files that `_report` writes, and the plots that it replaces by its own."""
    names = [PAGE]
    if args.suite in PAGE_SUITES:
        name = PAGE_SUITES[args.suite].page
        names += [f"{name}.md", f"{name}.json"]
    return [*(args.out / name for name in names), *sorted((args.out / "plots").glob("*.png"))]


def _claim(args: Namespace, settings: BenchSettings, groups: Sequence[Group], numerics: bool) -> None:
    """Raise InputError where the folder has results that are not to be replaced."""
    names = [*([RESULTS] if groups else []), *([NUMERICS] if numerics else []), NOTES, *_others(args)]
    judged = [group for group in groups if group.judged and not group.sweep]
    scenes = dict.fromkeys(settings.subject(group).name for group in judged)
    drawn = dict.fromkeys(contender.backend for group in judged for contender in group.contenders)
    outputs = [*(args.out / name for name in names), *_report_files(args)]
    outputs += [picture_path(args.out, scene, name) for scene, name in product(scenes, drawn)]
    if args.suite in PAGE_SUITES:
        outputs += [args.out / name for name in PAGE_SUITES[args.suite].pictures]
    compared = [args.compare, args.compare / RESULTS] if args.compare else []
    claim(outputs, [*compared, *map(Path, args.scene or ())], args.force)


def _measured(bench: Bench, groups: Sequence[Group]) -> Iterator[Row]:
    """The rows of all groups until Ctrl-C. A scene that turns out damaged is noted and left out."""
    for group in groups:
        if bench.stopped:
            return
        try:
            yield from bench.measure(group)
        except InputError as error:
            bench.note(f"{group.scene} is left out: {error}")
            warn(bench.notes[-1])


def _write(path: Path, bench: Bench, steps: int, rows: Iterator[Row]) -> bool:
    """Write rows as they come; whether there were any.

    Those of an earlier run stay where they are until there is a new one, then beside it as old-*, those
    before as old-2-* and so on: none is lost, also where several runs were stopped.
    """
    with progress(steps) as bench.tick:
        first = next(rows, None)
        if first is None:
            return False
        try:
            if os.path.lexists(path):
                path.replace(_free_beside(path))
            with open(path, "x", encoding="utf-8") as stream:
                for row in chain([first], rows):
                    write_row(stream, row)
        except OSError as error:
            what, hint = explained(error)
            raise InputError(f"cannot be written: {what}", path, hint) from error
    return True


def _free_beside(path: Path) -> Path:
    """old-NAME, or old-2-NAME and so on where that is taken."""
    names = chain([f"old-{path.name}"], (f"old-{n}-{path.name}" for n in count(2)))
    return next(old for old in map(path.with_name, names) if not os.path.lexists(old))


def _lines(names: Sequence[str]) -> int:
    return sum(row.is_for(backend(name)) for name in names for row in numerics.rows())


def _foretell(bench: Bench, groups: Sequence[Group], tested: Sequence[str], others: Iterable[str]) -> None:
    """Say how much there is to do and how long it will take."""
    if groups:
        seconds = forecast(bench, groups)
        rows = sum(len(group.contenders) for group in groups)
        minutes = f"{seconds / 60:.0f} minutes" if seconds >= 100 else f"{seconds:.0f} seconds"
        scenes = len({group.scene for group in groups})
        tell(f"{rows} rows on {scenes} scenes: about {minutes}")
    if others:
        tell(f"Then {', '.join(others)}: some minutes")
    if tested:
        tell(f"{_lines(tested)} rows of the stability suite: some seconds a backend")


def _settings(args: Namespace, calibration: BenchSettings | None = None) -> BenchSettings:
    """How to measure; `--quick`, and what was said. calibration: what is usual for it."""
    beside = str(_BESIDE) if _BESIDE.is_dir() else None
    data = args.data or os.environ.get("SCAN4D_DATA") or beside
    if data is not None and not Path(data).is_dir():
        raise InputError("is no folder of real scans", data, "Name one with --data")
    if args.size and min(args.size) < _LEAST:
        small = "x".join(map(str, args.size))
        raise InputError(
            f"pictures of {small} are too small",
            "--size",
            f"Use at least {_LEAST}x{_LEAST}, such as 1920x1280",
        )
    told = {"size": args.size, "views": args.views, "seed": args.seed, "data": data and Path(data)}
    usual = PAGE_SUITES[args.suite].usual if args.suite in PAGE_SUITES else BenchSettings()
    if calibration is not None:
        usual = calibration
    elif args.quick:
        quick = PAGE_SUITES[args.suite].quick if args.suite in PAGE_SUITES else None
        usual = replace(
            _QUICK, frames=min(_QUICK.frames, usual.frames), views=quick[1] if quick else _QUICK.views
        )
    return replace(usual, **{name: value for name, value in told.items() if value is not None})


def _groups(args: Namespace, settings: BenchSettings, names: Sequence[str]) -> tuple[list[Group], list[str]]:
    """Groups to measure, and scenes that cannot be had. Raises InputError for those that were named."""
    if args.suite == "numerics":
        return [], []
    missing = {name: reason for name, reason in catalog.scene_names(settings.data).items() if reason}
    if args.suite in PAGE_SUITES:
        suite = PAGE_SUITES[args.suite]
        scenes = args.scene or [name for name in suite.scenes or () if name not in missing]
        groups = suite.groups(settings, scenes) if suite.groups else []
        lacking = {group.scene: missing[group.scene] for group in groups if group.scene in missing}
        lacking |= {name: missing[name] for name in suite.scenes or () if name in missing and not args.scene}
        return [group for group in groups if group.scene not in lacking], _left_out(lacking)
    known = _QUICK_SCENES if args.quick else catalog.scene_names(settings.data)
    scenes = list(dict.fromkeys(args.scene or [name for name in known if name not in missing]))
    if args.quick:
        groups = plan(scenes, names, _QUICK_COUNTS, _QUICK_NOISES, swept_scenes=1)
    else:
        groups = plan(scenes, names)
    called = Counter(settings.subject(group).name for group in groups if not group.sweep)
    if twice := [name for name, count in called.items() if count > 1]:
        raise InputError(f"two scenes are called {twice[0]}", "--scene", "Rename one of the files")
    return groups, [] if args.scene else _left_out(missing)


def _left_out(missing: Mapping[str, str]) -> list[str]:
    """Sentences on scenes that cannot be had, by name with the reason."""
    return [f"{name} is left out: {reason}" for name, reason in missing.items()]


def _write_notes(out: Path, notes: Sequence[str]) -> None:
    with whole_file(out / NOTES) as path:
        path.write_text("".join(f"{note}\n" for note in notes), encoding="utf-8")

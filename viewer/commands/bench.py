"""Measure the run time and the error of every renderer.

The scenes have a known truth. DIR receives report.html, one page with all results; results.jsonl, a row for
each scene, renderer and setting; numerics.jsonl, the results of the stability suite; plots and pictures.
Ctrl-C stops the run and keeps the results so far.
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from ..backends import backend, backends
from ..bench import goals, numerics, surface_suite
from ..bench.calibrating import SCENES, laws_of, measure_ways
from ..bench.plan import Group, plan
from ..bench.report.page import PAGE, three_digits, write_report
from ..bench.report.results import NOTES, NUMERICS, SURFACE, WAYS, compare, read_rows
from ..bench.run import Bench, BenchSettings
from ..bench.scenes import catalog
from ..choice.known import keep_model
from ..errors import InputError
from ..files import output_folder
from ..imports import require
from ..signals import held_interrupts
from . import _drawing as drawing
from ._console import tell, warn
from ._measuring import (
    QUICK,
    MeasuringPlan,
    RowSource,
    add_measuring_arguments,
    left_out,
    settings_of,
    write_notes,
    write_rows,
)
from ._outputs import claim

_LIBRARIES = ("jinja2", "matplotlib", "scipy", "skimage")
_QUICK_SCENES = ("torus", "bunny", "demo", "torus-simulated")
_QUICK_COUNTS = (10_000, 300_000)
_QUICK_NOISES = (2.0,)
_SUITES = ("scenes", "numerics", "surface")
_CALIBRATION = BenchSettings(views=4, repeat=2, frames=0)
_QUICK_CALIBRATION = ("torus", "box", "sheets-bare", "torus-simulated")


def add_arguments(parser: ArgumentParser) -> None:
    """The arguments of `scan4d bench`."""
    add_measuring_arguments(parser, BenchSettings())
    parser.add_argument(
        "--backend",
        nargs="+",
        action="extend",
        metavar="NAME",
        help="measure only these renderers; gl-points and mesh are always included",
    )
    parser.add_argument(
        "--suite",
        choices=_SUITES,
        help="name of the suite to run; default: scenes and numerics, or only scenes with --quick",
    )
    parser.add_argument(
        "--calibrate", action="store_true",
        help=
            "measure only what the automatic choice of a renderer needs on this device, and store the "
            "results for this user"
        ,
    )  # fmt: skip
    parser.add_argument(
        "--compare",
        type=Path,
        metavar="OLD",
        help="compare with these earlier results, and list the measurements that got slower or worse",
    )


def run(args: Namespace) -> int:
    """Measure, report, compare, or only report. 1 where Ctrl-C stopped it."""
    require(*_LIBRARIES)
    if args.calibrate:
        return _calibrate(args)
    if args.report:
        if args.compare or args.backend or args.scene:
            hint = "Leave out --compare, --backend and --scene"
            raise InputError("measures nothing, but reports all results in DIR", "--report", hint)
        claim(_report_files(args.out), [], args.force)
        tell(write_report(args.out))
        return 0
    if args.compare and args.suite in ("numerics", "surface"):
        raise InputError("--compare applies only to scenes", f"--suite {args.suite}")
    old = read_rows(args.compare) if args.compare else None
    names = list(dict.fromkeys(args.backend or backends()))
    for name in names:
        backend(name)  # an unknown name is an error before anything is drawn
    if args.suite == "surface":
        return _surface(args, names)
    settings = settings_of(args, QUICK if args.quick else BenchSettings())
    groups, missing = _groups(args, settings, names) if args.suite != "numerics" else ([], {})
    others = {}
    if args.suite == "numerics" or not (args.suite or args.quick):
        lines = sum(row.is_for(backend(name)) for name in names for row in numerics.rows())
        others[NUMERICS] = RowSource(partial(Bench.numerics, names=names), lines)
    notes = left_out(missing)
    if args.quick and not args.suite:
        notes.append("--quick leaves out the stability suite. 'scan4d bench --suite numerics' measures it")
    chosen = MeasuringPlan(groups, others, notes, _report_files(args.out))
    bench = Bench(drawing.renderer(args.device), settings, args.out)
    chosen.claim(args, settings, [args.compare, args.compare / "results.jsonl"] if args.compare else [])
    chosen.measure(bench, args.out, lambda: tell(write_report(args.out)))
    if old is not None:
        print(*compare(old, read_rows(args.out)), sep="\n")
    return int(bench.stopped)


def _surface(args: Namespace, names: Sequence[str]) -> int:
    """Measure the suite "surface", and print the table of its goals. 1 where Ctrl-C stopped it."""
    amount = surface_suite.QUICK if args.quick else surface_suite.Amount()
    settings = settings_of(args, BenchSettings(amount.size, amount.views))
    models, missing = list(dict.fromkeys(args.scene or ())), {}
    if not models:
        reasons = catalog.scene_names(settings.data)
        wanted = surface_suite.QUICK_MODELS if args.quick else surface_suite.MODELS
        models = [name for name in wanted if not reasons[name]]
        missing = {name: reasons[name] for name in wanted if reasons[name]}
    rows = partial(Bench.surface, names=names, models=models, points=amount.points, picks=amount.picks)
    source = RowSource(rows, surface_suite.steps(names, models))
    chosen = MeasuringPlan([], {SURFACE: source}, left_out(missing), _report_files(args.out))
    bench = Bench(drawing.renderer(args.device), settings, args.out)
    chosen.claim(args, settings)

    def report() -> None:
        print(*goals.table_lines(goals.table(read_rows(args.out / SURFACE)), three_digits), sep="\n")
        tell(write_report(args.out))

    chosen.measure(bench, args.out, report)
    return int(bench.stopped)


def _calibrate(args: Namespace) -> int:
    """Measure each configuration that the automatic choice knows, unless `--report` says that the rows are
    there, and store the model of them. 1 where Ctrl-C stopped it: nothing is stored then."""
    if args.suite or args.backend or args.compare:
        hint = "Leave out --suite, --backend and --compare"
        raise InputError("defines its own pictures and renderers", "--calibrate", hint)
    settings = settings_of(args, replace(_CALIBRATION, views=2) if args.quick else _CALIBRATION)
    renderer = drawing.renderer(args.device)
    if not args.report:
        claim([args.out / WAYS, args.out / NOTES], [*map(Path, args.scene or ())], args.force)
        output_folder(args.out)
        bench = Bench(renderer, settings)
        scenes = args.scene or (_QUICK_CALIBRATION if args.quick else SCENES)
        with held_interrupts() as bench.interrupts:
            write_rows(args.out / WAYS, bench, 0, bench.until_stopped(measure_ways(bench, scenes)))
        write_notes(args.out, bench.notes)
        if bench.stopped:
            warn(
                f"{args.out} contains the results. To use these results, run 'scan4d bench --calibrate "
                "--report'"
            )
            return 1
    tell(keep_model(renderer.gpu, laws_of(read_rows(args.out / WAYS))))
    return 0


def _report_files(out: Path) -> list[Path]:
    """The files that the report writes, and the plots that it replaces by its own."""
    return [out / PAGE, *sorted((out / "plots").glob("*.png"))]


def _groups(
    args: Namespace, settings: BenchSettings, names: Sequence[str]
) -> tuple[list[Group], dict[str, str]]:
    """Groups to measure, and the scenes that cannot be had, with the reasons. Raises InputError for such
    scenes that the user names."""
    missing = {name: reason for name, reason in catalog.scene_names(settings.data).items() if reason}
    known = _QUICK_SCENES if args.quick else catalog.scene_names(settings.data)
    scenes = list(dict.fromkeys(args.scene or [name for name in known if name not in missing]))
    if args.quick:
        groups = plan(scenes, names, _QUICK_COUNTS, _QUICK_NOISES, swept_scenes=1)
    else:
        groups = plan(scenes, names)
    called = Counter(settings.subject(group).name for group in groups if not group.sweep)
    if twice := [name for name, count in called.items() if count > 1]:
        raise InputError(f"two scenes have the name {twice[0]}", "--scene", "Rename one of the files")
    return groups, {} if args.scene else missing

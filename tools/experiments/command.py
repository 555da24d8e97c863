"""The command line of the experiments: find one by its name, measure, and make its tables."""

from __future__ import annotations

import ast
import json
import os
import subprocess
import sys
from argparse import ArgumentParser, Namespace, RawDescriptionHelpFormatter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, replace
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from experiments.resuming import Journal, JournaledBench
from experiments.script import Failed, Script
from experiments.stale import commit, stale
from experiments.suite import Part, Suite, write_run
from experiments.tables import Row, shown
from viewer.bench.report.page import PAGE, write_report
from viewer.bench.run import Bench, BenchSettings
from viewer.bench.scenes import catalog
from viewer.commands._console import tell
from viewer.commands._measuring import (
    QUICK,
    MeasuringPlan,
    RowSource,
    add_measuring_arguments,
    data_folder,
    left_out,
    settings_of,
)
from viewer.commands._outputs import claim
from viewer.drawing.renderer import Renderer
from viewer.errors import InputError, Scan4DError
from viewer.files import whole_file
from viewer.imports import require

_FOLDER = Path(__file__).resolve().parent
_LIBRARIES = ("jinja2", "matplotlib", "scipy", "skimage")


def found() -> dict[str, Path]:
    """The modules of all experiments, by name: those that declare `EXPERIMENT`."""
    modules = sorted(_FOLDER.glob("*/*.py"))
    return {path.stem: path for path in modules if "\nEXPERIMENT = " in path.read_text(encoding="utf-8")}


def experiment(name: str) -> Suite | Script:
    """An experiment by its name. Raises InputError for one that is not there."""
    modules = found()
    if name not in modules:
        raise InputError(f"no experiment is called {name}. Known: {', '.join(modules)}")
    path = modules[name]
    declared = import_module(f"experiments.{path.parent.name}.{name}").EXPERIMENT
    assert isinstance(declared, Suite | Script)
    return declared


def main(words: Sequence[str]) -> int:
    """Run the experiment that the words name. Returns 1 where it failed or Ctrl-C stopped it, 2 for wrong
    words."""
    if not words or words[0] in ("-h", "--help"):
        for name, path in found().items():
            print(f"{path.parent.name:14} {name:16} {_about(path).partition(chr(10))[0]}")
        return 0
    if words[0] == "--stale":
        for line in stale():
            print(line)
        return 0
    try:
        declared = experiment(words[0])
        parser = ArgumentParser(
            prog=f"experiment.py {words[0]}",
            description=_about(found()[words[0]]),
            formatter_class=RawDescriptionHelpFormatter,
        )
        if isinstance(declared, Suite):
            add_measuring_arguments(parser, declared.usual)
            parser.add_argument(
                "--resume",
                action="store_true",
                help="go on with the stopped run in DIR, with the same options and the same commit",
            )
            return _run_suite(words[0], declared, parser.parse_args(words[1:]))
        declared.add_arguments(parser)
        parser.add_argument(
            "--against", type=Path, metavar="TREE", help="compare with this checkout, by turns"
        )
        parser.add_argument("--turns", type=int, default=3, help="runs of each checkout with --against")
        args = parser.parse_args(words[1:])
        if args.against:
            for row in _compared(words, args):
                print("  ".join(f"{title} {shown(cell)}" for title, cell in row.items()), flush=True)
        else:
            args.data = data_folder(getattr(args, "data", None))
            declared.run(words[0], args)
    except Failed as failure:
        print(failure, file=sys.stderr)
        return 1
    except Scan4DError as error:
        print(f"experiment: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        return 1
    return 0


def _about(path: Path) -> str:
    """The docstring of a module."""
    return ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""


# --- suites ---------------------------------------------------------------------------


def _run_suite(name: str, suite: Suite, args: Namespace) -> int:
    """Measure rows into the folder, or only report; 1 where Ctrl-C stopped it."""
    require(*_LIBRARIES, *suite.libraries)
    stored = args.out / f"{name}.json"
    reports = [stored, args.out / suite.page]
    if suite.groups is not None:
        reports += [args.out / PAGE, *sorted((args.out / "plots").glob("*.png"))]
    if args.scene and suite.scenes is None and suite.groups is None:
        raise InputError("defines its own scenes", name, "Leave out --scene")
    settings = settings_of(args, _usual(suite, args.quick))
    if args.report:
        if args.resume:
            raise InputError("--report measures nothing", "--resume", "Leave out one of them")
        claim(reports, [], args.force)
        _report(name, suite, Bench(Renderer(), settings, args.out), _provenance(args.out, suite, stored))
        return 0
    plan = _plan(suite, args, settings)._replace(
        reports=reports, pictures=[args.out / picture for picture in suite.pictures]
    )
    options = _options(name, args, settings, plan)
    if args.resume:
        journal = Journal.resumed(args.out, options)
    else:
        plan.claim(args, settings)
        journal = Journal.of_new(args.out, options)
    bench = JournaledBench(Renderer(), settings, journal)
    if args.resume:
        tell(f"Complete pieces that the run keeps: {bench.stored}")
    plan.measure(bench, args.out, partial(_report, name, suite, bench, journal.provenance))
    bench.finish()
    return int(bench.stopped)


def _options(name: str, args: Namespace, settings: BenchSettings, plan: MeasuringPlan) -> Row:
    """What a run measures and how, in words: two runs with the same measure the same pieces."""
    scenes = dict.fromkeys(group.scene for group in plan.groups)
    return {
        "experiment": name,
        **{option: str(value) for option, value in asdict(settings).items()},
        "--scene": " ".join(map(str, args.scene or ())) or "not given",
        "--quick": "given" if args.quick else "not given",
        "scenes with data": f"{' '.join(map(str, scenes))} in {len(plan.groups)} groups",
    }


def _provenance(out: Path, suite: Suite, stored: Path) -> Row:
    """Which code measured the rows in a folder; of a run without a journal, as it is stored."""
    journal = Journal.read(out)
    if journal is not None:
        return journal.provenance
    measured = suite.read_run(stored).get("commit") if stored.exists() else commit()
    return {} if measured is None else {"commit": measured}


def _usual(suite: Suite, quick: bool) -> BenchSettings:
    """The settings of a suite, or of its quick form."""
    if not quick:
        return suite.usual
    views = suite.quick[1] if suite.quick else QUICK.views
    return replace(QUICK, frames=min(QUICK.frames, suite.usual.frames), views=views)


def _plan(suite: Suite, args: Namespace, settings: BenchSettings) -> MeasuringPlan:
    """What a suite measures. Scenes that cannot be had are left out, unless the user names them."""
    missing = {name: reason for name, reason in catalog.scene_names(settings.data).items() if reason}
    scenes = args.scene or [name for name in suite.scenes or () if name not in missing]
    groups = suite.groups(settings, scenes) if suite.groups else []
    lacking = {group.scene: missing[group.scene] for group in groups if group.scene in missing}
    lacking |= {name: missing[name] for name in suite.scenes or () if name in missing and not args.scene}
    chosen = args.scene or (suite.quick[0] if args.quick and suite.quick else ())
    given = {} if suite.scenes is None else {"scenes": chosen or suite.scenes}
    own = suite.scenes is None and bool(chosen)  # then only groups: other parts have their own scenes
    others = {
        f"{name}.jsonl": RowSource(partial(_rows, file=f"{name}.jsonl", part=part, given=given))
        for name, part in suite.parts.items()
        if part.measure is not None and not own
    }
    if own:
        known = list(dict.fromkeys(group.scene for group in groups))
        groups = [group for group in groups if group.scene in chosen]
        if not groups:
            raise InputError(f"defines its own scenes: {', '.join(known)}", "--scene", "Name some of these")
    groups = [group for group in groups if group.scene not in lacking]
    return MeasuringPlan(groups, others, left_out(lacking))


def _rows(bench: Bench, file: str, part: Part, given: Mapping[str, Sequence[str]]) -> Iterator[Row]:
    """The rows of a part, piece by piece. given: the scenes, if the suite has any."""
    assert isinstance(bench, JournaledBench) and part.measure is not None
    pieces = [{"scenes": [scene]} for scene in given["scenes"]] if part.by_scene else [given]
    for piece in pieces:
        yield from bench.rows(file, partial(part.measure, **piece))


def _report(name: str, suite: Suite, bench: Bench, provenance: Row) -> None:
    """Make the report, the stored run, its pictures and the page of the rows in a folder. provenance: what
    the stored run says of the code that measured them."""
    assert bench.folder is not None
    if suite.groups is not None:
        tell(write_report(bench.folder))
    run = suite.read(bench.folder) | provenance
    write_run(bench.folder / f"{name}.json", run)
    for draw in suite.pictures.values():
        if draw is not None:
            draw(bench, run)
    page = bench.folder / suite.page
    with whole_file(page) as temporary:
        temporary.write_text(suite.filled([run]), encoding="utf-8")
    tell(page)


# --- two checkouts --------------------------------------------------------------------


def _compared(words: Sequence[str], args: Namespace) -> Iterator[Row]:
    """Run both checkouts' own forms of the experiment by turns; yield the medians of their times, and
    ratios."""
    trees = {"old": args.against.resolve(), "new": _FOLDER.parents[1]}
    own = [word for word in _without(words, "--against", "--turns")]
    times: dict[tuple[Any, ...], dict[str, dict[str, list[float]]]] = {}
    for _ in range(args.turns):
        for tree, folder in trees.items():
            command = [sys.executable, str(folder / "tools" / "experiment.py"), *own, "--json"]
            environment = {**os.environ, "PYTHONPATH": str(folder)}
            done = subprocess.run(command, env=environment, stdout=subprocess.PIPE, text=True, check=True)
            for line in map(json.loads, done.stdout.splitlines()):
                fixed = tuple(
                    (name, value) for name, value in line["row"].items() if not isinstance(value, float)
                )
                for name, value in line["row"].items():
                    if isinstance(value, float):
                        by_name = times.setdefault((("table", line["table"]), *fixed), {}).setdefault(
                            name, {}
                        )
                        by_name.setdefault(tree, []).append(value)
    for key, found_times in times.items():
        for name, by_tree in found_times.items():
            if len(by_tree) == len(trees):
                old, new = (float(np.median(by_tree[tree])) for tree in trees)
                yield {
                    **dict(key),
                    "": name,
                    "old": old,
                    "new": new,
                    "new / old": new / old if old else np.nan,
                }


def _without(words: Sequence[str], *flags: str) -> Iterator[str]:
    """The words without some flags and their values."""
    skipped = False
    for word in words:
        if skipped or word in flags:
            skipped = word in flags
            continue
        yield word

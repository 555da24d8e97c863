"""What `scan4d bench` and the experiments of the source tree share: arguments, and rows that go into a
folder."""

from __future__ import annotations

import os
from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import chain, count, product
from pathlib import Path
from typing import NamedTuple

from ..bench.forecast import forecast
from ..bench.plan import Group
from ..bench.report.pictures import picture_path
from ..bench.report.results import NOTES, RESULTS, Row, write_row
from ..bench.run import Bench, BenchSettings
from ..errors import InputError, explained
from ..files import output_folder, whole_file
from ..signals import held_interrupts
from . import _arguments as arguments
from ._console import progress, tell, warn
from ._outputs import add_output_argument, claim

_BESIDE = Path(__file__).resolve().parents[3] / "shared" / "data"  # of a checkout
_LEAST = 32  # pixels of a picture's edge, for metrics that look at windows
_MINUTES = 100  # seconds from which a time is shown in minutes
# Enough to see whether a change helps, in three minutes on two cores.
QUICK = BenchSettings(size=(384, 256), views=2, repeat=1, frames=2)


def add_measuring_arguments(parser: ArgumentParser, usual: BenchSettings) -> None:
    """Add the arguments of every measurement: the folder, the scenes, how much is measured. usual: the
    defaults."""
    add_output_argument(parser, "folder for the results", "DIR")
    parser.add_argument(
        "--scene",
        nargs="+",
        action="extend",
        metavar="NAME|FILE",
        help="measure only these scenes: names, or meshes (PLY, OBJ, NPZ)",
    )
    parser.add_argument(
        "--quick",
        action="store_true",
        help="quick run with few scenes, few views and small pictures, about three minutes",
    )
    parser.add_argument(
        "--report",
        action="store_true",
        help="measure nothing, but write the report of the results that DIR already contains",
    )
    parser.add_argument(
        "--data", type=Path, metavar="DIR",
        help="folder of real scans; default: SCAN4D_DATA, or shared/data beside the checkout",
    )  # fmt: skip
    size = "x".join(map(str, usual.size))
    parser.add_argument(
        "--size", type=arguments.size, metavar="WxH", help=f"size of the pictures; default {size}"
    )
    parser.add_argument(
        "--views", type=arguments.count, metavar="N",
        help=f"number of views of each scene; default {usual.views}",
    )  # fmt: skip
    parser.add_argument(
        "--seed", type=arguments.seed, metavar="N",
        help=f"seed of viewpoints, samples and noise; default {usual.seed}",
    )  # fmt: skip


def data_folder(given: Path | None = None) -> Path | None:
    """The folder of real scans: the given one, `SCAN4D_DATA`, or the one beside a checkout; None without one.

    Raises InputError for a name that is no folder.
    """
    data = given or os.environ.get("SCAN4D_DATA") or (_BESIDE if _BESIDE.is_dir() else None)
    if data is not None and not Path(data).is_dir():
        raise InputError("is not a folder", data, "Name the folder of real scans with --data")
    return data and Path(data)


def settings_of(args: Namespace, usual: BenchSettings) -> BenchSettings:
    """How to measure: the usual settings, with those that the arguments state. Raises InputError."""
    if args.size and min(args.size) < _LEAST:
        small = "x".join(map(str, args.size))
        raise InputError(
            f"pictures of {small} are too small",
            "--size",
            f"Use at least {_LEAST}x{_LEAST}, such as 1920x1280",
        )
    stated = {"size": args.size, "views": args.views, "seed": args.seed, "data": data_folder(args.data)}
    return replace(usual, **{name: value for name, value in stated.items() if value is not None})


def left_out(missing: Mapping[str, str]) -> list[str]:
    """Sentences on scenes that cannot be had, by name with the reason."""
    return [f"the benchmark leaves out {name}: {reason}" for name, reason in missing.items()]


class RowSource(NamedTuple):
    """Rows other than those of drawn pictures. steps: how many there are, for the progress bar; 0:
    unknown."""

    rows: Callable[[Bench], Iterator[Row]]
    steps: int = 0


class MeasuringPlan(NamedTuple):
    """All that a run measures. groups: pictures of scenes. others: by the files of their rows.

    notes: what is left out from the start. reports, pictures: the files that the report writes, and those of
    the measurements."""

    groups: Sequence[Group]
    others: Mapping[str, RowSource]
    notes: Sequence[str] = ()
    reports: Iterable[Path] = ()
    pictures: Iterable[Path] = ()

    def claim(self, args: Namespace, settings: BenchSettings, inputs: Iterable[Path] = ()) -> None:
        """Raise InputError where the folder has results that the run would replace."""
        names = [*([RESULTS] if self.groups else []), NOTES, *self.others]
        judged = [group for group in self.groups if group.judged and not group.sweep]
        scenes = dict.fromkeys(settings.subject(group).name for group in judged)
        drawn = dict.fromkeys(contender.backend for group in judged for contender in group.contenders)
        outputs = [*(args.out / name for name in names), *self.reports, *self.pictures]
        outputs += [picture_path(args.out, scene, name) for scene, name in product(scenes, drawn)]
        claim(outputs, [*inputs, *map(Path, args.scene or ())], args.force)

    def measure(self, bench: Bench, out: Path, report: Callable[[], object]) -> None:
        """Write all rows into a folder as they come, then report. Ctrl-C ends it; `bench.stopped` is set
        then.

        Raises InputError where nothing can be measured, KeyboardInterrupt where Ctrl-C came before any row.
        """
        output_folder(out)
        for note in self.notes:
            warn(note)
        self._foretell(bench)
        steps = sum(map(bench.steps, self.groups))
        measured: list[bool] = []
        try:
            with held_interrupts() as bench.interrupts:  # rows that are measured are written in any case
                measured += [write_rows(out / RESULTS, bench, steps, _drawn(bench, self.groups))]
                for name, other in self.others.items():
                    rows = bench.until_stopped(other.rows(bench))
                    measured += [write_rows(out / name, bench, other.steps, rows)]
            if not any(measured):
                if bench.stopped:
                    raise KeyboardInterrupt
                raise InputError("; ".join(bench.notes) or "these options select nothing to measure")
            stopped = ["Stopped before the end."] if bench.stopped else []
            write_notes(out, [*self.notes, *bench.notes, *stopped])
            report()
        except KeyboardInterrupt:
            if any(measured):
                warn(f"{out} contains the results. To write the report, run the same command with --report")
            raise

    def _foretell(self, bench: Bench) -> None:
        """Say how much there is to do and how long it will take."""
        if self.groups:
            seconds = forecast(bench, self.groups)
            rows = sum(len(group.contenders) for group in self.groups)
            minutes = f"{seconds / 60:.0f} minutes" if seconds >= _MINUTES else f"{seconds:.0f} seconds"
            scenes = len({group.scene for group in self.groups})
            tell(
                f"Measuring {rows} combinations of renderer and parameters on {scenes} scenes takes about "
                f"{minutes}"
            )
        if self.others:
            tell(f"After that, measuring {', '.join(self.others)} takes some more minutes")


def _drawn(bench: Bench, groups: Sequence[Group]) -> Iterator[Row]:
    """The rows of all groups until Ctrl-C. A scene that turns out damaged is noted and left out."""
    rows = [len(group.contenders) for group in groups]
    for number, group in enumerate(groups):
        if bench.stopped:
            return
        left = sum(rows[number + 1 :])
        tell(f"Measuring {rows[number]} combinations on {group.scene}; after that, {left} are left")
        try:
            yield from bench.measure(group)
        except InputError as error:
            bench.note(f"the benchmark leaves out {group.scene}: {error}")
            warn(bench.notes[-1])


def write_rows(path: Path, bench: Bench, steps: int, rows: Iterator[Row]) -> bool:
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


def write_notes(out: Path, notes: Sequence[str]) -> None:
    """Write what the numbers of a run do not say, a line each."""
    with whole_file(out / NOTES) as path:
        path.write_text("".join(f"{note}\n" for note in notes), encoding="utf-8")

"""Track landmarks and measure them in all frames.

Scan4D moves the landmarks of FILE onto the surface and tracks them where FILE has no position. OUT is one
table: a row for each landmark and frame, then a row for each measure and frame, then a row for each
trajectory and frame if --order asks for speed or acceleration.
OUT_numbers, beside OUT, has amplitude, onset and peak of each measure. --repeats writes a third table with
the repeats of a movement. --plot saves the same plots as the window.
"""

from __future__ import annotations

import math
import os
from argparse import ArgumentParser, ArgumentTypeError, Namespace
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..analysis.curves import ORDERS, Smoothing
from ..analysis.landmarks.files import AXES, landmark_suffixes, read_landmarks
from ..analysis.landmarks.files.long_table import LONG_COLUMNS, landmark_rows
from ..analysis.landmarks.landmark_set import LandmarkSet
from ..analysis.measures import Measure, Quantity, Series
from ..analysis.measures.curves import (
    NUMBER_COLUMNS,
    PER_ORDER,
    REPEAT_COLUMNS,
    MeasureCurve,
    number_rows,
    numbers_file,
    repeat_rows,
    repeats_by_peaks,
    unit_of,
)
from ..analysis.measures.definitions import read_measures
from ..analysis.measures.series import all_series
from ..analysis.track import STATES, Known, Track
from ..analysis.trajectories import Trajectory, held_still, stabilising, trajectory_of
from ..csv_text import cell, save_rows
from ..errors import InputError, unknown_name
from ..files import absolute, save_json
from ..output.export import check_output
from ..output.plots import (
    PLOT_SUFFIXES,
    check_plot,
    color_of_curve,
    color_of_path,
    line_of_curve,
    line_of_path,
    plot_against,
    plot_over_time,
)
from ..scan.inputs import scan_inputs
from ..scan.points import UNKNOWN_UNIT
from ..scan.reading.axes import landmark_space
from ..scan.timeline import Timeline
from ..scan.units import Scale
from ..task import Task
from ._console import progress, tell, warn
from ._followed import check_on_scan, put_on_surface, tracks_in_frames, with_noise
from ._outputs import add_output_argument, claim
from ._scans import SCAN_HELP, add_pose_arguments, chosen_poses, first_readable, open_timeline

_SUFFIXES = (".csv", ".json")
_STEPS = 200  # of a progress bar
_NAMED = 3  # landmarks that a message names
_LONGEST = 1e15  # scan units
_LEAST_ANCHORS = 3
_PLAIN = str.maketrans({"²": "^2", "³": "^3", "°": "deg"})  # letters of units in tables
_LEAST = 0.5  # of a curve's range, that a peak stands out by


def add_arguments(parser: ArgumentParser) -> None:
    """The arguments of `scan4d measure`."""
    parser.add_argument("scan", metavar="SCAN", help=SCAN_HELP)
    parser.add_argument(
        "--landmarks", type=Path, metavar="FILE", required=True,
        help=f"{' '.join(landmark_suffixes())}, or a series such as smile_%%04d.mrk.json",
    )  # fmt: skip
    parser.add_argument(
        "--measures",
        type=Path,
        metavar="FILE",
        help="file of measures (JSON or TOML), or a template; default: no measures",
    )
    add_output_argument(parser, " or ".join(_SUFFIXES))
    parser.add_argument(
        "--numbers", type=Path, metavar="FILE",
        help="table of the largest movement of each measure (amplitude, onset, peak, ...), "
        f"{' or '.join(_SUFFIXES)}; default: OUT_numbers",
    )  # fmt: skip
    parser.add_argument(
        "--repeats", type=Path, metavar="FILE",
        help=f"table of all measures around each peak of one measure, {' or '.join(_SUFFIXES)}",
    )  # fmt: skip
    parser.add_argument(
        "--plot", type=Path, metavar="FILE",
        help=f"picture of the measures over time, {', '.join(PLOT_SUFFIXES)}",
    )  # fmt: skip
    add_pose_arguments(parser)
    how = parser.add_argument_group("tracking and measuring")
    how.add_argument(
        "--noise", type=_length, default=0.0, metavar="SIGMA",
        help="noise of the scanner: standard deviation of a coordinate, in scan units",
    )  # fmt: skip
    how.add_argument(
        "--order", choices=ORDERS, default=ORDERS[0],
        help=(
            "quantity in the rows of measures; speed and acceleration also add rows for landmarks; "
            f"default {ORDERS[0]}"
        ),
    )  # fmt: skip
    how.add_argument(
        "--traced",
        type=_names,
        metavar="NAME,...",
        help="landmarks whose speeds or accelerations the tables contain; default: all",
    )
    how.add_argument(
        "--anchors", type=_names, metavar="NAME,...",
        help="rigid references: at least three landmarks; Scan4D removes their common motion",
    )  # fmt: skip
    how.add_argument(
        "--smoothing", type=_time, metavar="SECONDS",
        help=(
            "width, in seconds, of the window that smooths speeds, accelerations and the table of "
            "--numbers; default "
            f"{Smoothing().seconds}"
        )
        ,
    )  # fmt: skip
    how.add_argument(
        "--aligned", metavar="MEASURE", help="measure whose peaks align the repeats; default: the first"
    )
    how.add_argument(
        "--least", type=_share, metavar="SHARE",
        help=(
            f"smallest peak that counts as a repeat, as a share of the curve's range; default {_LEAST}"
        ),
    )  # fmt: skip
    how.add_argument(
        "--against", metavar="MEASURE",
        help="plot all other measures against MEASURE, and compute their correlation with MEASURE",
    )  # fmt: skip
    how.add_argument(
        "--placed-in", type=int, metavar="I",
        help=(
            "frame in which the landmarks were placed, if FILE does not name one; default: the first "
            "measured frame"
        ),
    )  # fmt: skip
    how.add_argument("--no-snap", action="store_true", help="do not move landmarks onto the surface")
    how.add_argument(
        "--axes", choices=AXES, help="axes of the scan's coordinates; default: those of the scan, else LPS"
    )


def run(args: Namespace) -> int:
    """Write the tables of the chosen poses, by default all."""
    outputs = _outputs(args)
    with open_timeline(args, args.scan) as timeline:
        indices = sorted(chosen_poses(args, timeline) or range(len(timeline)))
        inputs = [args.landmarks, *([args.measures] if args.measures else [])]
        claim(outputs, [*scan_inputs(timeline), *inputs], args.force)
        found = _landmarks(args, timeline, indices)
        measures = _measures(args, found)
        for remark in found.remarks:
            warn(f"{args.landmarks}: {remark}")
        tracks, series = _tracked_and_measured(args, found, measures, timeline, indices)
        curves, order = _curves(args, series, timeline), ORDERS.index(args.order)
        if order:
            series = [_changes(*each, order) for each in zip(series, curves, strict=True)]
        trajectories = _trajectories(args, tracks, indices) if order else {}
        paces = [_pace(name, one, tracks[name].known[indices], order) for name, one in trajectories.items()]
        rows = _landmark_rows(tracks, timeline, indices)
        for kind, group in (("measure", series), ("trajectory", paces)):
            rows += _value_rows(kind, group, timeline.unit, indices, order)
        _write(args.out, timeline, (*LONG_COLUMNS, "note"), rows)
        _write_numbers(args, curves, timeline)
        if args.repeats:
            _write(args.repeats, timeline, REPEAT_COLUMNS, _repeats(args, curves, order))
        if args.plot:
            _save_plot(args, curves, trajectories, timeline, indices)
        _tell_gaps(tracks, series, paces, indices, order)
    for path in outputs:
        tell(path)
    return 0


def _landmarks(args: Namespace, timeline: Timeline, indices: Sequence[int]) -> LandmarkSet:
    """The landmarks of the file. Raises InputError where an argument names one that it lacks."""
    first_readable(timeline, indices)  # whose file states the axes, perhaps
    unit = None if timeline.unit == UNKNOWN_UNIT else timeline.unit
    found = read_landmarks(args.landmarks, unit, args.axes or landmark_space(timeline.reading["axes"]))
    for name in (*(args.anchors or ()), *(args.traced or ())):
        if name not in found.names:
            raise unknown_name("landmark", name, found.names)
    return found


def _tracked_and_measured(
    args: Namespace,
    found: LandmarkSet,
    measures: Sequence[Measure],
    timeline: Timeline,
    indices: Sequence[int],
) -> tuple[Mapping[str, Track], list[Series]]:
    """The tracks of landmarks in all frames, without head motion if the arguments say so, and the series of
    measures in these frames."""
    frame = indices[0] if args.placed_in is None else args.placed_in
    timeline.label(frame)  # raises where there is none
    check_on_scan(args.landmarks, found, timeline)
    with _shown(f"Measuring {timeline.name}"):
        if not args.no_snap:
            found = put_on_surface(found, timeline, frame)
        tracks = with_noise(tracks_in_frames(found, timeline, frame), args.noise)
    with _shown(f"Measuring {timeline.name}"):
        found_series = all_series(measures, tracks, timeline, frames=indices, keep=True)
    if args.anchors:  # whose motion changes no measure
        still = stabilising(tracks, args.anchors)
        tracks = {name: held_still(track, still) for name, track in tracks.items()}
    return tracks, [each.in_frames(indices) for each in found_series.values()]


def _write_numbers(args: Namespace, curves: Sequence[MeasureCurve], timeline: Timeline) -> None:
    """Write the numbers of movements, where they are asked for."""
    if args.numbers:
        against = next((curve for curve in curves if curve.name == args.against), None)
        columns = NUMBER_COLUMNS if against is None else (*NUMBER_COLUMNS, "r")
        _write(args.numbers, timeline, columns, number_rows(curves, against))


def _number_that(fits: Callable[[float], bool], what: str) -> Callable[[str], float]:
    """A function from the text of an argument to a number, which refuses those that do not fit."""

    def parse(text: str) -> float:
        try:
            number = float(text)
        except ValueError:
            number = math.nan
        if not fits(number):
            raise ArgumentTypeError(f"'{text}' is not {what}")
        return number

    return parse


_length = _number_that(lambda length: 0 <= length <= _LONGEST, f"a length from 0 to {_LONGEST:g}")
_share = _number_that(lambda share: 0 < share <= 1, "a share above 0, up to 1")
_time = _number_that(lambda seconds: 0 < seconds < math.inf, "a time above 0, in seconds")


def _names(text: str) -> tuple[str, ...]:
    return tuple(dict.fromkeys(name for part in text.split(",") if (name := part.strip())))


def _outputs(args: Namespace) -> list[Path]:
    """The files to write. Raises InputError, before any work, where one cannot be, or a flag does nothing."""
    if args.numbers is None and args.measures is not None:
        args.numbers = numbers_file(args.out)
    more = {"--numbers": args.numbers, "--repeats": args.repeats, "--plot": args.plot}
    asked = {flag: path for flag, path in more.items() if path}
    outputs = [args.out, *asked.values()]
    for path in outputs:
        check_output(path, PLOT_SUFFIXES if path is args.plot else _SUFFIXES, several=False)
    taken = {os.path.realpath(absolute(args.out))}
    for flag, path in asked.items():
        if (place := os.path.realpath(absolute(path))) in taken:
            raise InputError("is already the name of another output", path, f"Write {flag} to another file")
        taken.add(place)
    if args.plot:
        check_plot(args.plot)
    is_of_speeds = args.order != ORDERS[0]
    lacking = [flag for flag in asked if flag != "--plot" or not is_of_speeds]
    if lacking and args.measures is None:
        raise InputError(
            "needs measures, but the command names none", lacking[0], "Name them with --measures"
        )
    if args.traced is not None and not is_of_speeds:
        raise InputError("needs speeds, but this command computes no speeds", "--traced", "Add --order speed")
    if args.against is not None and args.measures is None:
        raise InputError(
            "needs measures, but the command names none", "--against", "Name them with --measures"
        )
    if args.anchors is not None and len(args.anchors) < _LEAST_ANCHORS:
        hint = "Name landmarks that move as one rigid body, separated by commas"
        raise InputError("removing head motion needs at least three landmarks", "--anchors", hint)
    if args.smoothing is not None and not (is_of_speeds or args.measures):
        hint = f"Use this option with --measures, or with --order {' or '.join(ORDERS[1:])}"
        raise InputError("has nothing to smooth", "--smoothing", hint)
    if not args.repeats and (args.aligned is not None or args.least is not None):
        flag = "--least" if args.aligned is None else "--aligned"
        raise InputError(
            "applies only to repeats of a movement, but the command asks for no repeats",
            flag,
            "Add --repeats FILE",
        )
    return outputs


def _measures(args: Namespace, found: LandmarkSet) -> list[Measure]:
    """The measures of whose landmarks the file has all; reports the others."""
    if args.measures is None:
        return []
    kept, lacking = [], {}
    for measure in read_measures(args.measures):
        missing = [name for name in measure.landmarks if name not in found.names]
        if missing:
            lacking[measure.name] = missing[0]
        else:
            kept.append(measure)
    for name, landmark in lacking.items():
        warn(f"Scan4D leaves out '{name}': {args.landmarks} has no landmark '{landmark}'")
    if not kept:
        more = ", ..." if len(found.names) > _NAMED else ""
        hint = f"The file has the landmarks {', '.join(found.names[:_NAMED])}{more}"
        raise InputError(
            f"does not contain all landmarks of any measure in {args.measures}", args.landmarks, hint
        )
    names = [measure.name for measure in kept]
    for name in (args.aligned, args.against):
        if name is not None and name not in names:
            raise unknown_name("measure", name, names)
    if args.against is not None and len(kept) == 1:
        raise InputError("there is only one measure", "--against", "Name a file with more measures")
    return kept


def _curves(args: Namespace, series: Sequence[Series], timeline: Timeline) -> list[MeasureCurve]:
    """The curves of the measures, as the window has them."""
    return [MeasureCurve.of(each, Scale(timeline.unit), _smoothing(args)) for each in series]


def _smoothing(args: Namespace) -> Smoothing:
    return Smoothing() if args.smoothing is None else Smoothing(args.smoothing)


def _changes(series: Series, curve: MeasureCurve, order: int) -> Series:
    """The speed or acceleration of a measure in place of its values; a gap where that is not known."""
    values, sigmas = curve.derivative(order)
    return replace(series, values=values, sigmas=sigmas, known=_known_of(values, series.known))


def _trajectories(args: Namespace, tracks: Mapping[str, Track], indices: list[int]) -> dict[str, Trajectory]:
    """The trajectories of the traced landmarks in these frames alone, as the window has them."""
    found = {}
    for name in args.traced or tracks:
        track = tracks[name]
        times, positions, covariances = (
            whole[indices] for whole in (track.times, track.positions, track.covariances)
        )
        cut = replace(
            track, times=times, positions=positions, covariances=covariances, known=track.known[indices]
        )
        found[name] = trajectory_of(cut, _smoothing(args).wide_enough(times))
    return found


def _pace(name: str, trajectory: Trajectory, known: NDArray[np.uint8], order: int) -> Series:
    """The speed or acceleration of a landmark. known: (T,) of its places."""
    values, sigmas = trajectory.pace(order)
    return Series(name, "length", trajectory.times, values, sigmas, _known_of(values, known))


def _known_of(values: NDArray[np.float64], known: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """How well values, (T,), are known that are made of what is `known`, (T,): gaps where they are not."""
    return np.where(np.isfinite(values), known, np.minimum(known, Known.GAP)).astype(np.uint8)


def _repeats(args: Namespace, curves: Sequence[MeasureCurve], order: int) -> list[list[object]]:
    """The rows of the repeats, aligned by the peaks of one of the curves; none where it has no peak, which a
    warning says."""
    aligned_by = next(curve for curve in curves if args.aligned in (None, curve.name))
    least = _LEAST if args.least is None else args.least
    aligned = repeats_by_peaks(aligned_by, least)
    if aligned is None:
        warn(
            f"'{aligned_by.name}' has no peak of at least {100 * least:g} % of its range, so Scan4D finds "
            "no repeats"
        )
        return []
    tell(f"Scan4D found {len(aligned.events)} repeats, and aligned them by the peaks of '{aligned_by.name}'")
    return repeat_rows(curves, aligned, order)


def _save_plot(
    args: Namespace,
    curves: Sequence[MeasureCurve],
    trajectories: Mapping[str, Trajectory],
    timeline: Timeline,
    indices: list[int],
) -> None:
    """Write curves over time, or over one of them. Warns of curves for whose unit a picture has no axis.
    trajectories: of landmarks, whose speed or acceleration is plotted over time beside that of measures."""
    path, order, scale = args.plot, ORDERS.index(args.order), Scale(timeline.unit)
    frames = np.array(indices, np.intp)
    lines = {
        curve.name: line_of_curve(curve, color_of_curve(number), order) for number, curve in enumerate(curves)
    }
    if args.against is not None:
        plot = plot_against(lines.pop(args.against), frames, [*lines.values()])
    else:
        paces = [
            line_of_path(name, trajectory, scale, color_of_path(number), order)
            for number, (name, trajectory) in enumerate(trajectories.items())
        ]
        plot = plot_over_time(timeline.times[indices], frames, [*lines.values(), *paces])
    plot.save(path)
    for line in plot.lines:
        if line not in plot.drawn and path.suffix.lower() != ".csv":
            warn(
                f"{path} does not show '{line.label}': the axes of the plot are in "
                f"{', '.join(plot.units)}, not in {line.unit}"
            )


def _landmark_rows(
    tracks: Mapping[str, Track], timeline: Timeline, indices: Sequence[int]
) -> list[list[object]]:
    """The rows of landmarks, frame by frame."""
    wanted = {index + 1 for index in indices}
    landmarks = LandmarkSet.of_tracks(tracks, timeline.unit)
    rows = (row for row in landmark_rows(landmarks) if row[1] in wanted)
    return [[*row, tracks[str(row[3])].reasons.get(int(str(row[1])) - 1)] for row in rows]


def _value_rows(
    kind: str, series: Sequence[Series], unit: str, indices: Sequence[int], order: int
) -> list[list[object]]:
    """The rows of a kind with values, frame by frame. series: in these frames. unit: of lengths. order: of
    the derivative that they hold."""
    rows: list[list[object]] = []
    for row, index in enumerate(indices):
        for each in series:
            state = STATES[Known(int(each.known[row]))]
            values = cell(each.values[row]), cell(each.sigmas[row])
            time, own = cell(each.times[row]), _unit(each.quantity, unit, order)
            note = each.note(row) or None
            rows.append([kind, index + 1, time, each.name, None, None, None, state, *values, own, note])
    return rows


def _unit(quantity: Quantity, unit: str, order: int) -> str:
    """The unit of a measure's values in plain letters, or that of their derivatives as the window has it."""
    own = unit_of(quantity, unit)
    return own + PER_ORDER[order] if order else own.translate(_PLAIN)


def _write(path: Path, timeline: Timeline, columns: Sequence[str], rows: Sequence[Sequence[object]]) -> None:
    """CSV, or the same as JSON: `rows` of objects by the names of the columns, null where a cell is empty."""
    if path.suffix.lower() == ".csv":
        save_rows(path, [columns, *rows])
        return
    objects = [dict(zip(columns, row, strict=True)) for row in rows]
    save_json(path, {"scan": timeline.name, "unit": timeline.unit, "rows": objects})


def _tell_gaps(
    tracks: Mapping[str, Track],
    series: Sequence[Series],
    paces: Sequence[Series],
    indices: Sequence[int],
    order: int,
) -> None:
    """Say in how many of the frames each is not known. paces: speeds or accelerations of landmarks."""
    what = f"the {ORDERS[order]} of " if order else ""
    known = {f"'{name}'": each.known[list(indices)] for name, each in tracks.items()}
    known |= {f"{what}'{each.name}'": each.known for each in series if order or not each.warning}
    known |= {f"{what}the landmark '{each.name}'": each.known for each in paces}
    for name, states in known.items():
        gaps = int((states < Known.TRACKED).sum())
        if gaps:
            warn(f"{name} has no value in {gaps} of {len(indices)} frames")
    for each in series if not order else ():
        if each.warning:
            warn(f"'{each.name}': {each.warning}")


@contextmanager
def _shown(name: str) -> Iterator[None]:
    """Have long work inside show how far it has come."""
    with progress(_STEPS) as tick, _Ticking(name, tick).current():
        yield


class _Ticking(Task):
    """A task that ticks as it gets on."""

    def __init__(self, name: str, tick: Callable[[], object]) -> None:
        super().__init__(name)
        self._tick, self._ticked = tick, 0

    def report(self, progress: float) -> None:
        super().report(progress)
        while self._ticked < progress * _STEPS:
            self._ticked += 1
            self._tick()

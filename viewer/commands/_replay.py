"""Replaying: the pictures of a recording, or of a picture with its recording inside."""

from __future__ import annotations

import os
from argparse import Namespace
from collections.abc import Generator, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager, suppress
from dataclasses import replace
from itertools import compress, groupby
from pathlib import Path
from typing import NamedTuple

from ..document.anonymous import anonymous_pose, anonymous_request, middle_of
from ..document.recording import (
    Entry,
    Recording,
    checked_scan_paths,
    fingerprint,
    fingerprint_as,
    matrix_of,
    new_salt,
)
from ..drawing.request import Request
from ..errors import InputError
from ..output.export import OUTPUT_SUFFIXES, check_output
from ..output.film import FILM_SUFFIX, FilmTimes
from ..output.legend import Legend, marks_of
from ..scan.averaging import Averaging
from ..scan.inputs import scan_inputs
from ..scan.open import is_no_path, open_scan
from ..scan.timeline import Timeline
from ..scan.times import frame_in_words
from . import _arguments as arguments
from . import _drawing as drawing
from ._console import warn
from ._drawing import Plan
from ._outputs import claim
from ._scans import stated_corrections

# Arguments that a recording replaces.
_OF_RECORDING = (
    "pose", "time", "poses", "all", "size", "backend", "set", "look", "camera", "orbit", "turntable",
    "budget", "error", "up", "average",
)  # fmt: skip


@contextmanager
def planned(args: Namespace) -> Iterator[Plan]:
    """The pictures of `args.replay`. Raises InputError where other arguments say what to draw as well."""
    _check_arguments(args)
    recording = Recording.load(args.replay)
    entries: Sequence[Entry] = recording.entries
    check_output(args.out, OUTPUT_SUFFIXES, several=len(entries) > 1)
    times = None
    if args.out.suffix.lower() == FILM_SUFFIX:
        times = FilmTimes(recording.seconds, args.fps)
        entries = _of_film(entries, times)
    outputs = drawing.outputs(args.out, range(len(entries)), args.stats)
    claim(outputs, [args.replay, *_scan_files(entries, args)], args.force)
    with closing(_pictures(entries, args)) as pictures:
        yield Plan(len(entries), entries[0].size, times, pictures)


def _scan_files(entries: Sequence[Entry], args: Namespace) -> Iterator[Path]:
    """The files that the scans of the entries are read from; errors in these come later."""
    several = {(args.scan or entry.scan, *sorted(entry.reading.items())): entry for entry in entries}
    for entry in several.values():
        with suppress(InputError):
            if args.scan is not None or entry.scan is not None:
                with _found(entry, args)[1] as timeline:
                    yield from scan_inputs(timeline)


def _check_arguments(args: Namespace) -> None:
    if given := arguments.given(args, _OF_RECORDING):
        hint = "Leave out these options: the recording already states what to draw"
        raise InputError(f"--replay cannot be combined with {', '.join(given)}", args.replay, hint)


def _of_film(entries: Sequence[Entry], times: FilmTimes) -> Sequence[Entry]:
    """The entries that a film shows, all of the size of the first."""
    size, are_shown = entries[0].size, times.are_shown([entry.at for entry in entries])
    return [replace(entry, size=size) for entry in compress(entries, are_shown)]


def _pictures(entries: Sequence[Entry], args: Namespace) -> Generator[tuple[int, Request, Entry, Legend]]:
    """Number, request, entry and legend of each.

    Broken frames among several are reported and left out. Raises InputError where none is left.
    """
    failed, drawn = None, False
    for number, entry, opened in _opened(entries, args):
        try:
            request = _request(entry, args, opened.timeline)
        except InputError as error:
            if not _may_be_left_out(entry, opened.timeline, entries):
                raise
            if str(error) != str(failed):
                warn(f"{opened.timeline.name}: Scan4D leaves out {frame_in_words(entry.pose)}: {error}")
            failed = error
            continue
        failed, drawn = None, True
        shown = _completed(entry, request, args, opened)
        yield number, request, shown, shown.legend(opened.timeline, request.pose)
    if failed and not drawn:
        raise failed


class _Opened(NamedTuple):
    """The scan of an entry: its name as it was found, its frames, and its hash."""

    name: str
    timeline: Timeline
    hash: str | None


def _opened(entries: Sequence[Entry], args: Namespace) -> Generator[tuple[int, Entry, _Opened]]:
    """The entries by number, each with its scan, of which one at a time is open. Raises InputError."""
    salt = new_salt() if args.anonymous else None
    for _, group in groupby(enumerate(entries), lambda item: _scan_as_read(item[1])):
        first, *others = group
        opened = _scan_of(first[1], args, salt)
        with opened.timeline:
            for number, entry in (first, *others):
                yield number, entry, opened


def _scan_as_read(entry: Entry) -> tuple[object, ...]:
    """The scan of an entry, and the corrections of how Scan4D reads it."""
    return entry.scan, entry.hash, dict(entry.reading)


def _request(entry: Entry, args: Namespace, timeline: Timeline) -> Request:
    """The picture of an entry, anonymous where it or the arguments are. Raises InputError."""
    timeline.average(Averaging(entry.average))
    pose, start = timeline.drawn(entry.pose), float(timeline.times[0])
    entry = replace(entry, look=replace(entry.look, quality=args.quality or entry.look.quality))
    computed = entry.computed(timeline)
    if entry.anonymous:
        return entry.request(anonymous_pose(pose, start), computed)
    request = entry.request(pose, computed)
    if not computed:
        drawing.check_color_source(entry.look, timeline, [entry.pose], entry.backend)
    return anonymous_request(request, start) if args.anonymous else request


def _completed(entry: Entry, request: Request, args: Namespace, opened: _Opened) -> Entry:
    """The entry with what is known by now, and with the marks and the unit of the arguments.

    What is anonymous stays so.
    """
    marks = entry.marks if args.marks is None else marks_of(args.marks)
    unit = args.unit or entry.unit or opened.timeline.unit
    look = replace(entry.look, quality=request.look.quality)
    shown = replace(entry, scan=opened.name, hash=opened.hash, look=look, marks=marks, unit=unit)
    shown = shown.with_reading(opened.timeline)
    if not (entry.anonymous or args.anonymous):
        return shown
    time = float(request.pose.time)
    world_from_pose = matrix_of(request.layers.world_from_pose)
    if not entry.anonymous and request.pose.count:
        shown = shown.drawn_from(middle_of(opened.timeline.pose(entry.pose)))
    return replace(
        shown, time=time, camera=request.camera, look=request.look, place=world_from_pose
    ).without_names()


def _may_be_left_out(entry: Entry, timeline: Timeline, entries: Sequence[Entry]) -> bool:
    """Whether the entry's frame is a broken one among several."""
    return entry.pose in timeline.broken and any(other.pose != entry.pose for other in entries)


def _scan_of(entry: Entry, args: Namespace, salt: str | None) -> _Opened:
    """The scan of an entry, open.

    salt: of the hash where what is drawn is made anonymous. Raises InputError where it is unusable, or where
    the one that was named is another one.
    """
    found, timeline = _found(entry, args)
    hash = fingerprint_as(entry.hash, timeline.files)
    if None not in (hash, entry.hash) and hash != entry.hash:
        if args.scan is not None:
            timeline.close()
            what = (
                f"is not the scan that {args.replay.name} shows: the hash of the file is {hash}, not "
                f"{entry.hash}"
            )
            raise InputError(what, found, "Give the path of the unchanged scan that you recorded")
        warn(f"{found}: has changed since Scan4D saved {args.replay.name}, so the pictures may differ")
    if salt is not None and not entry.anonymous:
        hash = fingerprint(timeline.files, salt)
    return _Opened(found, timeline, hash)


def _found(entry: Entry, args: Namespace) -> tuple[str, Timeline]:
    """The scan of an entry and its name, read as the entry says; corrections of the command line win.

    Raises InputError where the scan is missing or unusable.
    """
    read = {**entry.reading, **stated_corrections(args)}
    if args.scan is not None:
        return args.scan, open_scan(args.scan, read=read)
    if entry.scan is None:
        hint = f"Give the path of the scan: scan4d render SCAN --replay {args.replay} -o {args.out}"
        raise InputError("does not contain the name of the recorded scan", args.replay, hint)
    return _open(entry.scan, args.replay, read)


def _open(scan: str, path: Path, read: Mapping[str, str]) -> tuple[str, Timeline]:
    """A scan that a recording names, and how it was found: beside the recording, or as it is named.

    Raises InputError where it is in neither folder, or unusable.
    """
    for folder in checked_scan_paths(scan, path):
        try:
            return folder, open_scan(folder, read=read)
        except InputError as error:
            if os.path.exists(folder):
                raise
            missing = error
    if is_no_path(scan) or os.path.isabs(scan):
        raise missing
    hint = (
        f"Scan4D looked in '{path.parent}' and in the working directory. Put the scan there, or "
        "correct the field 'scan' of the recording"
    )
    raise InputError(f"shows '{scan}', a scan that Scan4D cannot find", path, hint) from missing

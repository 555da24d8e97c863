"""Replaying: the pictures of a recording, or of a picture that tells how it was made."""

from __future__ import annotations

import os
from argparse import Namespace
from collections.abc import Generator, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import replace
from pathlib import Path

from ..errors import InputError
from ..export import FILM_SUFFIX, FRAME_RATES, OUTPUT_SUFFIXES, check_output
from ..frame import Request
from ..recording import Entry, Recording, fingerprint
from ..scan.open import DEMO, open_scan
from ..scan.timeline import Timeline
from ..scan.times import DEFAULT_FPS
from .console import warn
from .drawing import Plan

# What the recording tells, by the names of arguments.
_TOLD = (
    "scan", "pose", "time", "poses", "all", "size", "backend", "set", "look", "camera", "orbit", "turntable",
)  # fmt: skip


@contextmanager
def planned(args: Namespace) -> Iterator[Plan]:
    """The pictures of `args.replay`. Raises InputError where other arguments tell what to draw as well."""
    _check_arguments(args)
    recording = Recording.load(args.replay)
    entries: Sequence[Entry] = recording.entries
    check_output(args.out, OUTPUT_SUFFIXES, several=len(entries) > 1)
    fps = DEFAULT_FPS if args.fps is None else args.fps
    if args.out.suffix.lower() == FILM_SUFFIX:
        entries = _film(recording, fps)
    with closing(_pictures(entries, args.replay)) as pictures:
        yield Plan(len(set(map(id, entries))), entries[0].size, fps, pictures)


def _check_arguments(args: Namespace) -> None:
    given = ["SCAN" if name == "scan" else f"--{name}" for name in _TOLD if _is_given(getattr(args, name))]
    if args.up != "+y":
        given.append("--up")
    if given:
        hint = "The recording tells what to draw; leave it out"
        raise InputError(f"--replay takes no {', '.join(given)}", args.replay, hint)


def _is_given(value: object) -> bool:
    return not (value is None or value is False or value == [])


def _film(recording: Recording, fps: float) -> Sequence[Entry]:
    """The entries at the film's pace, all of the size of the first."""
    low, high = FRAME_RATES
    if not low <= fps <= high:
        raise InputError(f"{fps:g} pictures a second are not usable", "--fps", f"Use {low:g} to {high:g}")
    size = recording.entries[0].size
    resized = Recording(tuple(replace(e, size=size) for e in recording.entries), recording.seconds)
    return resized.paced(fps)


def _pictures(entries: Sequence[Entry], path: Path) -> Generator[tuple[int, Request, Entry]]:
    """Number, request and entry of each; an entry that stays makes one request."""
    timeline: Timeline | None = None
    opened, source = None, None
    try:
        for number, entry in enumerate(entries):
            if entry.scan != opened:
                if timeline is not None:
                    timeline.close()
                found, timeline = _open(entry.scan, path)
                opened, hash = entry.scan, fingerprint(timeline.files)
                if None not in (hash, entry.hash) and hash != entry.hash:
                    warn(f"{found}: has changed since {path.name} was made; pictures may differ")
            assert timeline is not None
            if entry is not source:
                request = entry.request(timeline.pose(entry.pose))
                source, shown = entry, replace(entry, scan=found, hash=hash)
            yield number, request, shown
    finally:
        if timeline is not None:
            timeline.close()


def _open(scan: str, path: Path) -> tuple[str, Timeline]:
    """A scan that a recording names, and how it was found: beside the recording, or as it is named.

    Raises InputError where it is in neither place, or unusable.
    """
    places = list(dict.fromkeys([scan] if scan == DEMO else [str(path.parent / scan), scan]))
    for place in places:
        try:
            return place, open_scan(place)
        except InputError as error:
            if os.path.exists(place):
                raise
            missing = error
    if scan == DEMO or os.path.isabs(scan):
        raise missing
    hint = f"Looked in '{path.parent}' and in the working directory; put it there, or correct 'scan'"
    raise InputError(f"its scan '{scan}' is not there", path, hint) from missing

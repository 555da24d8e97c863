"""Open scans in a window.

Without SCAN, the window shows the demo scan. SCAN can also be a recording, a saved picture or a session.
Where no window can open, --fallback DIR plays the scan into DIR: numbered PNGs, a contact sheet and a film.
"""

from __future__ import annotations

import re
from argparse import ArgumentParser, Namespace
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from ..document.recording import Recording, is_recording, scan_path
from ..document.saved_session import SavedSession, is_session
from ..drawing.request import Request
from ..drawing.timing import draw
from ..errors import InputError, NoOpenGLError
from ..files import output_folder, printable
from ..look import Look
from ..output.export import contact_sheet, thumbnail, write_png
from ..output.film import FilmTimes, film
from ..scan.averaging import Averaging
from ..scan.inputs import scan_inputs
from ..scan.listing import is_there, named_scans
from ..scan.open import DEMO
from ..scan.pods import first_camera
from ..scan.timeline import Timeline
from . import _drawing as drawing
from ._console import progress, tell, warn
from ._outputs import add_force_argument, claim
from ._scans import (
    SCAN_HELP,
    add_average_argument,
    first_readable,
    framing,
    open_timeline,
    read_poses,
    stated_corrections,
    stated_upright,
)
from .doctor import display

_SIZE = (1200, 800)
_SHEET_PICTURES = 25  # at most, on a contact sheet


def add_arguments(parser: ArgumentParser) -> None:
    """The arguments of `scan4d view`."""
    parser.add_argument("scans", metavar="SCAN", nargs="*", help=SCAN_HELP)
    parser.add_argument(
        "--fallback",
        type=Path,
        metavar="DIR",
        help="write pictures of the scan into this folder if Scan4D cannot open a window",
    )
    add_average_argument(parser)
    add_force_argument(parser)


def run(args: Namespace) -> int:
    """Open the window, or play without one."""
    with ExitStack() as opened:
        refused: InputError | None = None
        problems: list[InputError] = []
        try:  # errors come before anything is drawn
            named = _named(args.scans or [DEMO])
            scans, problems = named_scans(named.scans)
            if not scans:
                raise problems[0]
            timelines = [opened.enter_context(open_timeline(args, scan)) for scan in scans]
        except InputError as error:
            if display() is None:
                raise
            refused, named = error, _Named([DEMO])  # a file manager has no terminal: the window tells it
            timelines = [opened.enter_context(open_timeline(args, DEMO))]
            warn(str(error))
        try:
            return _open_window(args, named, timelines[0], refused)
        except NoOpenGLError as error:
            if args.fallback is None:
                raise
            if refused is not None:
                raise refused from error
            tell(f"No window: {error.what}. Scan4D writes pictures into {args.fallback} instead.")
        for problem in problems:
            warn(str(problem))
        _play_all(args, timelines)
    return 0


@dataclass(frozen=True)
class _Named:
    """Arguments of the command line. replay: a recording to show. session: to open the first scan with."""

    scans: list[str]
    replay: Path | None = None
    session: SavedSession | None = None


def _named(names: list[str]) -> _Named:
    """Scans alone, a recording, or a session, before which its scan may be named.

    Raises InputError where a file does not name its scan, or that is not there.
    """
    path = Path(names[-1])
    if is_session(path) and len(names) <= 2:
        session = SavedSession.load(path)
        return _Named(names[:-1] or [_scan_of_session(session, path)], session=session)
    if len(names) == 1 and is_recording(path):
        scan = Recording.load(path).entries[0].scan
        if scan is None:
            raise InputError(
                "does not contain the name of the recorded scan",
                path,
                "Open the scan, then drop this file onto the window",
            )
        return _Named([scan_path(scan, path)], replay=path)
    return _Named(names)


def _scan_of_session(session: SavedSession, path: Path) -> str:
    scan = scan_path(session.scan, path)
    if not is_there(scan):
        hint = f"Give the path of the scan: scan4d view SCAN {path}"
        raise InputError(
            f"stores work on '{printable(session.scan)}', a scan that Scan4D cannot find", path, hint
        )
    return scan


def _open_window(args: Namespace, named: _Named, first: Timeline, refused: InputError | None) -> int:
    if display() is None:
        raise NoOpenGLError(
            "there is no display (neither DISPLAY nor WAYLAND_DISPLAY is set)",
            hint="Use --fallback DIR to write pictures into a folder, or 'scan4d render'",
        )
    from .. import app

    start = app.Start(
        args.unit,
        args.fps,
        args.up,
        args.device,
        named.replay,
        named.session,
        refused,
        stated_corrections(args),
        args.average,
    )
    return app.run(named.scans, start, opened=first)


def _play_all(args: Namespace, timelines: Sequence[Timeline]) -> None:
    """Play the scans into the folder of --fallback."""
    output_folder(args.fallback)
    prefixes = [f"{number}_" if len(timelines) > 1 else "" for number in range(len(timelines))]
    outputs: list[Path] = []
    inputs: list[Path] = []
    for timeline, prefix in zip(timelines, prefixes, strict=True):
        outputs += _files(args.fallback, prefix, timeline)
        inputs += scan_inputs(timeline)
    claim(outputs, inputs, args.force)
    for timeline, prefix in zip(timelines, prefixes, strict=True):
        _play(args, timeline, prefix)


def _stem(folder: Path, prefix: str, timeline: Timeline) -> str:
    """How the names of a scan's files begin."""
    return str(folder / (prefix + re.sub(r"[^\w-]+", "_", timeline.name)))


def _files(folder: Path, prefix: str, timeline: Timeline) -> list[Path]:
    """The files that `_play` writes."""
    stem = _stem(folder, prefix, timeline)
    pictures = [f"{stem}_{index:04d}.png" for index in range(len(timeline))]
    return [Path(name) for name in (*pictures, f"{stem}.mp4", f"{stem}_contact_sheet.png")]


def _play(args: Namespace, timeline: Timeline, prefix: str) -> None:
    """Draw all poses of a scan into the folder, and say what is there."""
    name = _stem(args.fallback, prefix, timeline)
    timeline.average(Averaging(args.average or 0))
    indices = list(range(len(timeline)))
    upright = stated_upright(args, timeline, indices)
    on_sheet = set(indices[:: -(-len(indices) // _SHEET_PICTURES)])
    starts = (timeline.times - timeline.times[0]).tolist()
    thumbnails = []
    with (
        drawing.canvas(args.device, _SIZE) as (renderer, surface),
        film(f"{name}.mp4", _SIZE, FilmTimes.of(starts)) as add,
        progress(len(indices)) as tick,
    ):
        bounds = framing(timeline, indices)
        camera = None
        for pose in read_poses(timeline, indices, with_empty=True):
            first = pose if pose.count or camera else first_readable(timeline, indices)
            camera = camera or first_camera(first.views, bounds, _SIZE[0] / _SIZE[1], upright)
            draw(renderer, Request(pose, camera, look=Look(up=upright.up)), surface)
            image = surface.image()
            write_png(image, f"{name}_{pose.index:04d}.png")
            add(image, starts[pose.index])
            if pose.index in on_sheet:
                thumbnails.append(thumbnail(image))
            tick()
    contact_sheet(thumbnails, f"{name}_contact_sheet.png")
    tell(*(Path(f"{name}{end}") for end in ("_%04d.png", "_contact_sheet.png", ".mp4")))

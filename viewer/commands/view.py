"""Open scans in a window; the demo scan where none is named. A recording or a picture is shown again.

Where no window can be opened, --fallback plays them without one: into numbered PNGs, a
contact sheet and a film.
"""

from __future__ import annotations

import re
from argparse import ArgumentParser, Namespace
from pathlib import Path

from ..camera import Camera
from ..document.recording import Recording, is_recording, place_of
from ..errors import InputError, NoOpenGLError, explained
from ..frame import Request
from ..look import Look
from ..output.export import contact_sheet, film, thumbnail, write_png
from ..scan.inputs import scan_inputs
from ..scan.listing import named_scans
from ..scan.open import DEMO
from ..scan.timeline import Timeline
from ..timing import draw
from ..unfinished import remove_leftovers
from . import _drawing as drawing
from ._console import progress, tell, warn
from ._outputs import add_force_argument, claim
from ._scans import SCAN_HELP, framing, open_timeline, read_poses
from .doctor import display

_SIZE = (1200, 800)
_SHEET_PICTURES = 25  # at most, on a contact sheet


def add_arguments(parser: ArgumentParser) -> None:
    """The arguments of `scan4d view`."""
    parser.add_argument("scans", metavar="SCAN", nargs="*", help=SCAN_HELP)
    parser.add_argument(
        "--fallback", type=Path, metavar="DIR", help="where no window can be opened, play into this folder"
    )
    add_force_argument(parser)


def run(args: Namespace) -> int:
    """Open the window, or play without one."""
    names, replay = args.scans or [DEMO], None
    if len(names) == 1 and is_recording(Path(names[0])):
        replay = Path(names[0])
        names = [_scan_of(replay)]
    scans, problems = named_scans(names)
    if not scans:
        raise problems[0]
    for scan in scans:
        open_timeline(args, scan).close()  # what is wrong is told before anything is drawn
    try:
        return _open_window(args, names, replay)
    except NoOpenGLError as error:
        if args.fallback is None:
            raise
        tell(f"No window: {error.what}. Playing into {args.fallback} instead.")
    for problem in problems:
        warn(str(problem))
    try:
        args.fallback.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        what, hint = explained(error)
        raise InputError(f"cannot be made: {what}", args.fallback, hint) from error
    prefixes = [f"{number}_" if len(scans) > 1 else "" for number in range(len(scans))]
    outputs: list[Path] = []
    inputs: list[Path] = []
    for scan, prefix in zip(scans, prefixes, strict=True):
        with open_timeline(args, scan) as timeline:
            outputs += _files(args.fallback, prefix, timeline)
            inputs += scan_inputs(timeline)
    claim(outputs, inputs, args.force)
    for scan, prefix in zip(scans, prefixes, strict=True):
        _play(args, scan, prefix)
    return 0


def _scan_of(replay: Path) -> str:
    """The scan that a recording begins with. Raises InputError where it tells none."""
    scan = Recording.load(replay).entries[0].scan
    if scan is None:
        raise InputError("does not tell its scan", replay, "Open the scan, and drop this onto the window")
    return place_of(scan, replay)


def _open_window(args: Namespace, scans: list[str], replay: Path | None) -> int:
    if display() is None:
        raise NoOpenGLError(
            "there is no display (neither DISPLAY nor WAYLAND_DISPLAY is set)",
            hint="Use --fallback DIR to play into a folder, or 'scan4d render'",
        )
    from .. import app

    remove_leftovers()
    return app.run(scans, unit=args.unit, fps=args.fps, up=args.up, device=args.device, replay=replay)


def _stem(folder: Path, prefix: str, timeline: Timeline) -> str:
    """How the names of a scan's files begin."""
    return str(folder / (prefix + re.sub(r"[^\w-]+", "_", timeline.name)))


def _files(folder: Path, prefix: str, timeline: Timeline) -> list[Path]:
    """The files that `_play` writes."""
    stem = _stem(folder, prefix, timeline)
    pictures = [f"{stem}_{index:04d}.png" for index in range(len(timeline))]
    return [Path(name) for name in (*pictures, f"{stem}.mp4", f"{stem}_contact_sheet.png")]


def _play(args: Namespace, scan: str, prefix: str) -> None:
    """Draw all poses of a scan into the folder, and say what is there."""
    with open_timeline(args, scan) as timeline:
        name = _stem(args.fallback, prefix, timeline)
        indices = list(range(len(timeline)))
        on_sheet = set(indices[:: -(-len(indices) // _SHEET_PICTURES)])
        fps = drawing.film_rate(timeline, indices, args.fps)
        thumbnails = []
        with (
            drawing.canvas(args.device, _SIZE) as (renderer, surface),
            film(f"{name}.mp4", _SIZE, fps) as add,
            progress(len(indices)) as tick,
        ):
            bounds = framing(timeline, indices)
            camera = Camera.orbit(bounds, aspect=_SIZE[0] / _SIZE[1], up=args.up)
            for pose in read_poses(timeline, indices):
                draw(renderer, Request(pose, camera, look=Look(up=args.up)), surface)
                image = surface.image()
                write_png(image, f"{name}_{pose.index:04d}.png")
                add(image)
                if pose.index in on_sheet:
                    thumbnails.append(thumbnail(image))
                tick()
    contact_sheet(thumbnails, f"{name}_contact_sheet.png")
    tell(*(Path(f"{name}{end}") for end in ("_%04d.png", "_contact_sheet.png", ".mp4")))

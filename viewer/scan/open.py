"""From a user's name of a scan (a file, a folder, a pattern, the demo) to a Timeline."""

from __future__ import annotations

import difflib
import glob
import itertools
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..errors import InputError, shortened
from . import formats
from .range_folders import find_range_frames, lacking_part, pods
from .reading import frames as deciding_frames
from .reading import takes as deciding_takes
from .reading.corrections import NOTHING_CORRECTED, Corrections
from .reading.hints import foreign_files
from .reading.record import Aside, Decision
from .reading.sequence import Decided
from .reading.times import STORED, Times, counted_times, times_in_names
from .reading.times import decide as decide_times
from .reading.times_table import read_times_csv
from .reading.unit import decide as decide_unit
from .sources import FACES_FILE, FileSequence, FrameSource, MultiFrameFile
from .timeline import ScanMessage, Timeline
from .times import is_times_file, natural_key
from .units import checked_unit, usable_unit

DEMO = "demo"
STANDARD_INPUT = "-"
_PICTURES = {  # beside which text tables are no points
    ".png", ".jpg", ".jpeg", ".ppm", ".pgm", ".tif", ".tiff", ".bmp",
}  # fmt: skip
_NAME_TABLES = "If the text tables contain points, open them with a pattern such as '*.txt'"
_PRINTF = re.compile("%(0?[0-9]{0,2})d")
_NAMES_TO_COMPARE = 5000
_TABLES = {".csv", ".txt"}  # which beside other files are notes as a rule


def is_demo(scan: str | None) -> bool:
    """Whether a name of a scan is that of the demo, or of a variant of it."""
    return scan is not None and (scan == DEMO or scan.startswith(f"{DEMO}:"))


def is_arriving(scan: str) -> bool:
    """Whether a name of a scan is an address of a server, or standard input."""
    return scan == STANDARD_INPUT or scan.lower().startswith(("http://", "https://"))


def is_no_path(scan: str) -> bool:
    """Whether a name of a scan is no path: the demo, or something that arrives."""
    return is_demo(scan) or is_arriving(scan)


def open_scan(
    path: str | os.PathLike[str],
    unit: str | None = None,
    fps: float | None = None,
    read: Mapping[str, str] | None = None,
    take: str | None = None,
) -> Timeline:
    """Open a scan without reading any frame.

    path: a file, a folder of frames, a pattern such as "frame%04d.ply" or "frame*.ply", or "demo", of which
    "demo:smile", "demo:sway" and "demo:cough" are variants, and "demo:smile:3" one of another seed; the
    address of an octree file on a server (http, https), or "-" for one on standard input. unit: the
    name of its unit of length, for example "mm"; None: what the scan states, else "units". fps: frame numbers
    a second, where no times.csv states the times. Without it the times stored in the file count, and without
    those 25 a second. read: corrections of how Scan4D reads it, key -> text, as `--read` takes them. take:
    which scan of a folder that holds several. Raises InputError where there is nothing to open, and says what
    is near, and where a correction is unusable.
    """
    if fps is not None and not (np.isfinite(fps) and fps > 0):
        raise InputError(f"Scan4D cannot use a frame rate of {fps}", hint="Give frames per second above 0")
    corrections = Corrections.parse({**(read or {}), **({"take": take} if take else {})})
    unit = unit or corrections.get("unit")
    if unit is not None:
        corrections = corrections.amended({"unit": checked_unit(unit)})
    source = find_source(path, corrections)
    times = _times_of(source, fps, corrections)
    stated = source.unit
    unit_decision = decide_unit(stated, corrections=corrections)
    timeline = Timeline(source, times.seconds, unit_decision.value)
    timeline.is_measured = times.is_measured
    timeline.decided.replace(unit_decision)
    if not times.decision.value == timeline.reading["times"].value == STORED:  # whose unit a reader doubts
        timeline.decided.replace(times.decision)
    if isinstance(source, MultiFrameFile):
        timeline.decided.note(Decision("frames", f"{len(source)} in one file", "file"))
    aside = {row.file for row in timeline.reading.aside}
    others = [name for name in left_aside(path, source) if name not in aside]
    timeline.decided.leave_aside(*(Aside(name, "may be a separate scan") for name in others))
    if others:
        what = f"The folder also contains {_listed(others)} beside this scan"
        timeline.messages.append(ScanMessage("beside", f"{what}. To see such a file, open it by its name."))
    if stated and not usable_unit(stated):
        what = (
            f"the scan states the unit of length '{shortened(stated)}', which is not a short word such as mm"
        )
        timeline.messages.append(ScanMessage("unit", f"{what}. The unit stays unknown"))
    if fps is not None and times.is_measured and times.decision.source != "user":
        timeline.messages.append(
            ScanMessage(
                "times", f"Scan4D takes the times from {times.decision.where}, and ignores {fps:g} fps"
            )
        )
    return timeline


def left_aside(path: str | os.PathLike[str], source: FrameSource) -> list[str]:
    """Names of scan files in a folder that are not its frames, so that each may be a separate scan; none if
    `path` is no folder."""
    if not os.path.isdir(path):
        return []
    used = {*(file.name for file in source.files), FACES_FILE}
    found = (
        file
        for file in entries(Path(path))
        if file.name not in used and not deciding_frames.is_no_scan(file.name)
    )
    kinds = ((file, file.suffix.lower()) for file in found)
    others = (file.name for file, kind in kinds if kind not in _TABLES and formats.is_known(kind))
    return sorted(others, key=natural_key)


def retime(timeline: Timeline, fps: float | None, by_names: bool = False) -> None:
    """Have the frames of a scan follow each other at this rate, or as their names state; else as when it was
    opened. A times.csv overrides both."""
    source = timeline.source
    stated = times_in_names(_labels(source)) if by_names and not timeline.is_measured else None
    if stated is None and fps is not None and not timeline.is_measured:
        stated = counted_times(_labels(source), fps, len(source))
    timeline.retime(timeline.opened_with if stated is None else stated)
    if stated is not None:
        value = "names" if fps is None or by_names else f"fps:{fps:g}"
        timeline.decided.replace(Decision("times", value, "user", "the panel", changes_numbers=True))


def _times_of(source: FrameSource, fps: float | None, corrections: Corrections) -> Times:
    """The times of all frames. Raises InputError where a table or a correction is unusable."""
    table = _times_table(source, corrections) if isinstance(source, FileSequence) else None
    folder = source.files[0].parent if source.files else None
    return decide_times(
        _labels(source), folder, count=len(source), table=table, fps=fps, corrections=corrections,
        stored=None if table else source.times(),
    )  # fmt: skip


def _times_table(source: FileSequence, corrections: Corrections) -> Path | None:
    """The times.csv of a sequence; without one, a table with another usual name that states its times."""
    if source.times_file is not None or "times" in corrections:
        return source.times_file
    for file in source.other_times_files:
        try:
            read_times_csv(file, _labels(source))
            return file
        except InputError as error:
            what = f"Scan4D does not use the times in {file.name}: {error.what}"
            source.decided.report("times", what)
    return None


def has_times_in_names(timeline: Timeline) -> bool:
    """Whether the names of the frames give their times, and nothing better does."""
    return not timeline.is_measured and times_in_names(_labels(timeline.source)) is not None


def _labels(source: FrameSource) -> list[str]:
    """The names of the frames, where these are files of their own."""
    return [] if isinstance(source, MultiFrameFile) else [source.label(i) for i in range(len(source))]


def find_source(path: str | os.PathLike[str], corrections: Corrections = NOTHING_CORRECTED) -> FrameSource:
    """Find where the frames of the scan named `path` come from. Raises InputError."""
    decided = Decided(corrections)
    path = os.fspath(path)
    if is_arriving(path):
        from .octree.arriving import ArrivingOctrees

        return ArrivingOctrees(path)
    if is_demo(path):
        from .demo import DemoSource

        return DemoSource(path)
    if os.path.basename(path) == pods.FILE and os.path.isfile(path):
        path = os.path.dirname(path) or os.curdir
    if os.path.isdir(path):
        folder = Path(path)
        found = find_range_frames(folder, decided)
        if found is not None:
            return found
        return _open_frames(folder_frames(folder), folder.resolve().name, decided)
    if os.path.isfile(path):
        return _open_frames([Path(path)], Path(path).name, decided)
    if os.path.exists(path):
        raise InputError("is neither a file nor a folder", path)
    if _PRINTF.search(path) or glob.has_magic(path):
        return _open_pattern(path, decided)
    raise _nothing_there(path)


def folder_frames(folder: Path) -> list[Path]:
    """The scan files that a folder plays as one scan, at least one, in natural order. No file is read.

    They are in the folder, or in its folder `frames`, whatever stands beside that. Raises InputError where
    there are none, and where text tables seem to belong to range images that are missing.
    """
    for searched in (folder / "frames", folder):
        if os.path.isdir(searched) and (frames := _choose_frames(entries(searched), searched)):
            are_notes = all(frame.suffix.lower() in formats.NOTES for frame in frames)
            if are_notes and (lacking := lacking_part(searched)):
                raise InputError(
                    f"{lacking}. Scan4D does not read points from the text tables in this folder",
                    folder,
                    _NAME_TABLES,
                )
            return frames
    if lacking := lacking_part(folder):
        raise InputError(lacking, folder, "Copy the complete folder, with all its files")
    inner = sorted((entry.name for entry in entries(folder) if os.path.isdir(entry)), key=natural_key)
    if (foreign := foreign_files(entries(folder))) is not None:
        raise InputError(f"contains no scan files, but {foreign.what}", folder, foreign.hint)
    hint = f"Open one of its folders: {_listed(inner)}" if inner else _known_files()
    raise InputError("holds no scan files", folder, hint)


def _known_files() -> str:
    return f"Scan4D reads files with the suffixes {_listed(formats.known_suffixes())}"


def _open_pattern(pattern: str, decided: Decided) -> FrameSource:
    files = matches(pattern)
    if not files:
        raise InputError("matches no file", pattern, "Check the folder, and put the pattern in quotes")
    frames = _choose_frames(files, pattern)
    if not frames:
        foreign = foreign_files(files)
        what, hint = ("", _known_files()) if foreign is None else (f", but {foreign.what}", foreign.hint)
        raise InputError(f"matches no file that Scan4D can read{what}", pattern, hint)
    return _open_frames(frames, Path(pattern).name, decided)


def matches(pattern: str) -> list[Path]:
    """The files that a glob pattern or a printf pattern names."""
    if not _PRINTF.search(pattern):
        return [Path(name) for name in glob.glob(pattern, recursive=True)]
    texts_and_widths = _PRINTF.split(pattern)
    texts, widths = texts_and_widths[::2], texts_and_widths[1::2]
    wild = "*".join(glob.escape(text) for text in texts)
    digits = [f"[0-9]{{{max(1, int(width or 1))},}}" for width in widths]
    exact = re.compile("".join(re.escape(t) + d for t, d in zip(texts, [*digits, ""], strict=True)))
    return [Path(name) for name in glob.glob(wild) if exact.fullmatch(name)]


def searches_folders(path: str) -> bool:
    """Whether a name is a pattern with wild cards in its folders, which may match a whole disk."""
    folder, name = os.path.split(path)
    is_pattern = "**" in name or glob.has_magic(folder) or _PRINTF.search(folder) is not None
    return is_pattern and not os.path.exists(path)


def _choose_frames(files: Sequence[Path], where: object) -> list[Path]:
    """The frames among the files, in natural order; empty where there is none.

    Left aside: hidden files, times.csv, unknown suffixes, and TXT and CSV beside frames of another kind.
    Raises InputError where two kinds remain, and where TXT and CSV stand beside pictures alone.
    """
    by_kind: dict[str, list[Path]] = {}
    for file in files:
        kind = file.suffix.lower()
        is_left_aside = deciding_frames.is_no_scan(file.name) or is_times_file(file.name)
        if not is_left_aside and formats.is_known(kind) and os.path.isfile(file):
            by_kind.setdefault(kind, []).append(file)
    if by_kind.keys() - formats.NOTES:
        by_kind = {kind: frames for kind, frames in by_kind.items() if kind not in formats.NOTES}
    elif by_kind and any(file.suffix.lower() in _PICTURES for file in files):
        lacking = os.path.isdir(str(where)) and lacking_part(Path(str(where)))
        if lacking:
            raise InputError(
                f"{lacking}. Scan4D does not read points from text tables beside pictures",
                where,
                _NAME_TABLES,
            )
        hint = f"Scan4D reads depth from 16-bit PNG files with a camera.json. {_NAME_TABLES}"
        raise InputError("contains pictures and text tables, but no scan", where, hint)
    if len(by_kind) > 1:
        found = ", ".join(f"{len(frames)} {kind}" for kind, frames in sorted(by_kind.items()))
        most = max(by_kind, key=lambda kind: len(by_kind[kind]))
        hint = f"Choose one kind with a pattern such as '*{most}'"
        raise InputError(f"contains files of several kinds ({found})", where, hint)
    return sorted(itertools.chain(*by_kind.values()), key=lambda file: natural_key(str(file)))


def _open_frames(files: list[Path], name: str, decided: Decided) -> FrameSource:
    if len(files) == 1:
        count = formats.frame_count(files[0], decided)
        return MultiFrameFile(files[0], count, decided) if count > 1 else FileSequence(files, name, decided)
    return FileSequence(scan_frames(files, decided), name, decided)


def scan_frames(files: Sequence[Path], decided: Decided) -> list[Path]:
    """The files that one scan plays, in order: without copies, reference files and other takes. They are
    decided by the names, and put into the record.

    files: several of one kind. Raises InputError where a correction is unusable.
    """
    folder = Path(os.path.commonpath([file.parent for file in files]))
    named = {file.relative_to(folder).as_posix(): file for file in files}
    frames = deciding_frames.decide(list(named), decided.corrections)
    takes = deciding_takes.decide(frames.names, decided.corrections)
    chosen = frames.decision
    if takes.aside and chosen.source != "user":
        chosen = replace(chosen, value=deciding_frames.counted(takes.names))
    decided.replace(chosen, takes.decision)
    decided.leave_aside(*frames.aside, *takes.aside)
    decided.note_takes(takes.takes)
    if words := deciding_frames.message_of_files(frames):
        decided.report("aside", words)
    if words := deciding_takes.message_of_takes(takes):
        decided.report("take", words)
    return [named[name] for name in takes.names]


def _nothing_there(path: str) -> InputError:
    """The error for a missing path, with the names close to the first part of it that is missing."""
    missing = Path(path)
    while not os.path.exists(missing.parent):
        missing = missing.parent
    names = [entry.name for entry in entries(missing.parent)[:_NAMES_TO_COMPARE]]
    close = difflib.get_close_matches(missing.name, names, n=3)
    hint = f"Did you mean: {_listed(close)}" if close else f"There is no '{missing.name}' in {missing.parent}"
    return InputError("no such file or folder", path, hint)


def entries(folder: Path) -> list[Path]:
    """The contents of a folder, in no order. Raises InputError where it cannot be listed."""
    try:
        return list(folder.iterdir())
    except OSError as error:
        raise InputError(f"cannot be listed ({error.strerror})", folder) from error


def _listed(names: Sequence[str], most: int = 12) -> str:
    return ", ".join([*names[:most], "..."] if len(names) > most else names)

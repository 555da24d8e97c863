"""The scans of a folder, found by the names in it: no frame is read."""

from __future__ import annotations

import glob
import os
import re
import stat
from collections import Counter
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from ..errors import InputError
from ..files import absolute
from . import formats
from .open import entries, find_source, folder_frames, is_no_path, matches, scan_frames
from .range_folders import find_range_frames
from .reading.frames import is_no_scan
from .reading.names import frame_counts
from .reading.sequence import Decided
from .sources import FileSequence
from .times import is_times_file, natural_key

_UNLIKE = 2.0  # times the size of the smallest file: frames of one scan differ less
_DIGITS = re.compile("[0-9]+")
_NUMBERED = re.compile(r"(.*?)([0-9]+)([^0-9]*)")


@dataclass(frozen=True)
class Listed:
    """Something in a folder.

    path: as `open_scan` takes it. title: its name for people. kind: "whole" is the folder itself.
    frames: that it plays; 1 for a file, which may hold several, and 0 for a folder that is no scan.
    size: in bytes, of a folder None. changed: when it was last, seconds since 1970, None if unknown.
    """

    path: str
    title: str
    kind: Literal["whole", "folder", "sequence", "file"]
    frames: int
    size: int | None = None
    changed: float | None = None


def is_there(scan: str) -> bool:
    """Whether a scan can be opened, by its name alone; of a pattern, the folder must exist."""
    is_pattern = "%" in scan or glob.has_magic(scan)
    return is_no_path(scan) or os.path.exists(scan) or (is_pattern and os.path.isdir(os.path.dirname(scan)))


def list_folder(folder: Path | str) -> list[Listed]:
    """Entries of a folder: itself as one scan, folders, numbered sequences and files, in natural order.

    Raises InputError where it cannot be listed.
    """
    folder = Path(folder)
    inside = sorted(entries(folder), key=lambda entry: natural_key(entry.name))
    folders = [entry for entry in inside if os.path.isdir(entry) and not entry.name.startswith(".")]
    files = _scan_files(inside)
    count, own = _frames(folder)
    if own:
        files = [file for file in files if file not in own and file.suffix.lower() not in formats.NOTES]
    title = f"All of {folder.resolve().name or folder}"
    whole = [Listed(str(folder), title, "whole", count, *_stated([folder]))] if count > 1 or own else []
    sequences = [
        Listed(pattern, _with_range(members), "sequence", len(members), *_stated(members))
        for pattern, members in _sequences(files).items()
        if not (whole and len(members) == len(files))
    ]
    return [
        *whole,
        *(
            Listed(str(entry), entry.name, "folder", _frames(entry)[0], *_stated([entry]))
            for entry in folders
        ),
        *sequences,
        *(Listed(str(file), file.name, "file", 1, *_stated([file])) for file in files),
    ]


def _stated(paths: Sequence[Path]) -> tuple[int | None, float | None]:
    """The bytes of files together, None of a folder, and when the last of them was changed, None where
    nothing tells."""
    stated = []
    for path in paths:
        with suppress(OSError):
            stated.append(os.stat(path))
    size = None if any(stat.S_ISDIR(one.st_mode) for one in stated) else sum(one.st_size for one in stated)
    return size, max((one.st_mtime for one in stated), default=None)


def scans_beside(scan: str) -> list[str]:
    """The scans in the folder of a scan, itself among them: files and folders, or sequences for a pattern.

    The scan alone where its folder cannot be listed.
    """
    path = Path(absolute(scan))
    if is_no_path(scan) or str(path) == path.anchor:
        return [scan]
    kinds = ("file", "folder") if os.path.exists(path) else ("sequence",)
    found: dict[str, str] = {}
    with suppress(InputError):
        listed = [one for one in list_folder(path.parent) if one.kind in kinds and one.frames]
        found = {one.path: one.path for one in listed}
    found[str(path)] = scan
    return [found[name] for name in sorted(found, key=natural_key)]


def named_scans(names: Iterable[str]) -> tuple[list[str], list[InputError]]:
    """The scans among a user's names that can be opened, and what is wrong with the others.

    A folder that is no scan itself, or a collection, stands for the scans in it.
    """
    scans: list[str] = []
    problems: list[InputError] = []
    for name in names:
        found, wrong = _scans_named(name, set())
        scans += found
        problems += wrong
    return scans, problems


def _scans_named(name: str, entered: set[str]) -> tuple[list[str], list[InputError]]:
    """The scans that a name stands for, and what is wrong with others.

    entered: real paths of the folders that were searched. Where a link leads there again, it adds nothing.
    """
    try:
        source = find_source(name)
        if os.path.isdir(name) and isinstance(source, FileSequence) and is_collection(source.files):
            raise InputError("contains several scans, not the frames of one scan", name)
        return [name], []
    except InputError as problem:
        if (folder := os.path.realpath(name)) in entered:
            return [], []
        entered.add(folder)
        inner = [_scans_named(one, entered) for one in _inside(Path(name))]
        scans = [scan for found, _ in inner for scan in found]
        return scans, [one for _, wrong in inner for one in wrong] if scans else [problem]


def is_collection(files: Sequence[Path]) -> bool:
    """Whether files are scans of their own rather than frames of one: most of their names differ by more than
    numbers, and their sizes by far."""
    patterns = Counter(_DIGITS.sub("0", file.name) for file in files)
    if len(files) < 2 or 2 * max(patterns.values()) > len(files):
        return False
    try:
        sizes = [file.stat().st_size for file in files]
    except OSError:
        return False
    return max(sizes) > _UNLIKE * min(sizes)


def as_one_scan(files: Sequence[str]) -> str | None:
    """The pattern of files that are all frames of one numbered sequence; None where they are not."""
    (folder, *others) = {os.path.dirname(absolute(file)) for file in files}
    if others or len(files) < 2:
        return None
    members = {Path(folder, os.path.basename(file)) for file in files}
    for pattern, found in _sequences(_scan_files(sorted(members))).items():
        if members == set(found) == set(matches(pattern)):
            return pattern
    return None


def _inside(folder: Path) -> list[str]:
    """The scans in a folder; none where it is no folder, or cannot be listed."""
    if not os.path.isdir(folder):
        return []
    with suppress(InputError):
        return [one.path for one in list_folder(folder) if one.kind in ("file", "folder") and one.frames]
    return []


def _scan_files(paths: Sequence[Path]) -> list[Path]:
    """The files that scans may be in; TXT and CSV only where there is nothing else."""
    files = [
        path
        for path in paths
        if not is_no_scan(path.name)
        and not is_times_file(path.name)
        and formats.is_known(path.suffix.lower())
        and os.path.isfile(path)
    ]
    scans = [file for file in files if file.suffix.lower() not in formats.NOTES]
    return scans or files


def _frames(folder: Path) -> tuple[int, set[Path]]:
    """How many frames a folder plays as one scan, 0 where it is none or a collection, and the files of its
    range images."""
    try:
        found = find_range_frames(folder)
        if found is not None:
            return len(found), set(found.files)
        frames = folder_frames(folder)
        if is_collection(frames):
            return 0, set()
        return len(scan_frames(frames, Decided())) if len(frames) > 1 else len(frames), set()
    except InputError:
        return 0, set()


def _sequences(files: Sequence[Path]) -> dict[str, list[Path]]:
    """Pattern -> its files in order, for names that differ in their last number alone, as frames do."""
    groups: dict[tuple[str, str, int], list[Path]] = {}
    for file in files:
        if match := _NUMBERED.fullmatch(file.name):
            before, number, after = match.groups()
            width = len(number) if number.startswith("0") and number != "0" else 0
            groups.setdefault((before, after, width), []).append(file)
    _join_padded(groups)
    return {
        str(members[0].with_name(f"{before}%0{width}d{after}" if width else f"{before}%d{after}")): members
        for (before, after, width), members in groups.items()
        if len(members) > 1 and _is_plain(members[0]) and frame_counts([file.name for file in members])
    }


def _join_padded(groups: dict[tuple[str, str, int], list[Path]]) -> None:
    """Numbers without zeros in front are of the padded group of their width, where there is one: 099, 100."""
    for (before, after, width), members in list(groups.items()):
        unpadded = groups.get((before, after, 0))
        if width and unpadded:
            digits = len(before) + width + len(after)
            members += [file for file in unpadded if len(file.name) >= digits]
            members.sort(key=lambda file: natural_key(file.name))
            unpadded[:] = [file for file in unpadded if len(file.name) < digits]


def _is_plain(file: Path) -> bool:
    """Whether a pattern can be made of its name."""
    return "%" not in str(file)


def _with_range(files: Sequence[Path]) -> str:
    return f"{files[0].name} to {files[-1].name}"

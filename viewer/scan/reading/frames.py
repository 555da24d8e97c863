"""Which files are frames: copies and reference files beside them are left aside."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from typing import NamedTuple

from ...errors import InputError, shortened
from .corrections import NOTHING_CORRECTED, Corrections
from .names import in_order, numbered_name
from .record import Aside, Decision

KEY = "frames"
_LEAST = 3  # frames of one pattern, beside which other files are no frames
_MOST_REFERENCES = 2  # unless their names say what they are:
_REFERENCE = re.compile(
    r"(?:^|[^a-z])(?:ref|reference|referenz|mean|average|template|base|model|merged|all)(?:[^a-z]|$)",
    re.IGNORECASE,
)
_NO_SCANS = (".", "~")  # hidden files, and the lock files of other programs, begin so
_ALL = "*"
USE_ALL = f" To use these files too, add --read {KEY}='{_ALL}'"  # how, on the command line
LIST = ";"  # between the files that a correction lists, in the order in which they play

_WORDS = r"copy|copie|kopie|copia|cópia|kopia|kopija|duplicate|コピー|副本"
_COPIES = tuple(
    re.compile(pattern, re.IGNORECASE)
    for pattern in (
        r"(?P<base>.+?) ?\(\d{1,3}\)",
        rf"(?P<base>.+?)(?: ?- ?|[ _])(?:{_WORDS})(?: ?\(?\d{{1,3}}\)?)?",
        rf"(?:{_WORDS})(?: of| von| de| di)? (?P<base>.+)",
        r"(?P<base>.+?) ?\([^()]*(?:conflict|konflikt|conflit|conflicto)[^()]*\)",
        r"(?P<base>.+?)\.sync-conflict-[0-9]{8}-[0-9]{6}(?:-[A-Z0-9]+)?",
        r"(?P<base>.+?)(?:~|\.bak|\.orig|\.backup|[ _-](?:old|bak|backup|orig))",
        r"(?P<base>.+?)-(?-i:[A-Z][A-Z0-9]*[0-9-][A-Z0-9-]*)",
    )
)


class FrameFiles(NamedTuple):
    """The files that are frames, in order, and those that are left aside."""

    names: list[str]
    decision: Decision
    aside: tuple[Aside, ...]


def copied_names(names: Sequence[str]) -> dict[str, str]:
    """Name of a copy -> the name that it is a copy of, which is among the names.

    None are copies where fewer than two other files would remain: "scan.ply", "scan (1).ply" and
    "scan (2).ply" are a sequence.
    """
    there, found = set(names), {}
    for name in names:
        folder, file = os.path.split(name)
        stem, suffix = os.path.splitext(file)
        for pattern in _COPIES:
            match = pattern.fullmatch(stem)
            if match and (base := os.path.join(folder, match["base"] + suffix)) in there:
                found[name] = base
                break
    return found if len(there) - len(found) >= 2 else {}


def is_no_scan(name: str) -> bool:
    """Whether a file is hidden, or a lock file of another program, such as `~$f1.csv`."""
    return name.startswith(_NO_SCANS)


def references_in(names: Sequence[str]) -> list[str]:
    """Names of one or two files without the number of a frame, or with a name of their own before it, where
    all others share numbered patterns, one of them three or more."""
    groups: dict[tuple[str, str] | None, list[str]] = {}
    for name in names:
        found = numbered_name(name)
        groups.setdefault(None if found is None else (found.before, found.after), []).append(name)
    large = {group for group, found in groups.items() if group is not None and len(found) > 1}
    odd = [name for group, found in groups.items() if group not in large for name in found]
    texts = {_without_digits(name) for group in large for name in groups[group]}
    largest = max((len(groups[group]) for group in large), default=0)
    if largest < _LEAST or any(_without_digits(name) in texts for name in odd):  # which number is which?
        return []
    is_named = all(_REFERENCE.search(Path(name).stem) for name in odd)
    return odd if len(odd) <= _MOST_REFERENCES or is_named else []


def _without_digits(name: str) -> str:
    return re.sub("[0-9]+", "0", name)


def decide(names: Sequence[str], corrections: Corrections = NOTHING_CORRECTED) -> FrameFiles:
    """The frames among files of one kind, in order.

    names: at least one; relative to a common folder. Raises InputError where no file has the user's pattern.
    """
    stated = corrections.get(KEY)
    if stated is not None and lists_files(corrections):
        return _listed_files(names, stated)
    if stated is not None and any(sign in stated for sign in "*?[."):
        matching = [name for name in names if fnmatchcase(os.path.basename(name), stated)]
        if not matching:
            raise InputError(f"no file matches '{shortened(stated)}'", hint="Correct --read frames")
        aside = tuple(Aside(name, "not chosen") for name in in_order([*{*names} - {*matching}]))
        return FrameFiles(in_order(matching), Decision(KEY, stated, "user", "--read"), aside)
    copied = copied_names(names)
    rest = [name for name in names if name not in copied]
    odd = {*references_in(rest)}
    aside = tuple(
        Aside(
            os.path.basename(name),
            f"copy of {os.path.basename(copied[name])}" if name in copied else "reference",
        )
        for name in in_order([*copied, *odd])
    )
    used = in_order([name for name in rest if name not in odd])
    if not aside:
        return FrameFiles(used, Decision(KEY, counted(used), "folder"), ())
    why = f"Because of their names, Scan4D does not play {', '.join(row.file for row in aside[:3])}"
    return FrameFiles(used, Decision(KEY, counted(used), "assumed", why=why, alternatives=(_ALL,)), aside)


def lists_files(corrections: Corrections) -> bool:
    """Whether the user lists the frames, in the order in which they play: "f2.ply;f1.ply" or "f2.ply;"."""
    return LIST in corrections.get(KEY, "")


def _listed_files(names: Sequence[str], stated: str) -> FrameFiles:
    """The frames that a list names. Raises InputError where one of them is not there."""
    listed = list(dict.fromkeys(filter(None, map(str.strip, stated.split(LIST)))))
    for name in listed:
        if name not in names:
            raise InputError(f"there is no file '{shortened(name)}'", hint="Correct --read frames")
    if not listed:
        raise InputError("the list of frames is empty", hint="Correct --read frames")
    aside = tuple(Aside(name, "not chosen") for name in in_order([*{*names} - {*listed}]))
    return FrameFiles(listed, Decision(KEY, counted(listed) or listed[0], "user", "--read"), aside)


def counted(names: Sequence[str]) -> str | None:
    """The frames in words; None where there is one."""
    if len(names) < 2:
        return None
    return f"{len(names)} files, {os.path.basename(names[0])} to {os.path.basename(names[-1])}"


def message_of_files(frames: FrameFiles) -> str:
    """The report of files that are left aside, for the user; empty where there is none."""
    if not frames.aside or frames.decision.source == "user":
        return ""
    listed = ", ".join(f"{row.file} ({row.why})" for row in frames.aside[:3])
    more = f" and {len(frames.aside) - 3} more" if len(frames.aside) > 3 else ""
    return f"Scan4D does not play {listed}{more}.{USE_ALL}"

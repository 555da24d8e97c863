"""Which scans a folder holds: several takes or subjects, whose frames are numbered each by itself."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import takewhile
from pathlib import Path
from typing import NamedTuple

from ...errors import InputError, shortened
from ..times import TIMES_FILE
from . import frames, times
from .corrections import NOTHING_CORRECTED, Corrections
from .names import are_dates, has_signs, in_order, is_epoch, numbered_name, stamped_seconds
from .record import Aside, Decision, Take

KEY = "take"
ALL = "all"  # the correction that plays all takes as one scan
_LEAST = 2  # frames of a take
_SIGNS = "_-. /*"  # between the words of a name


class Takes(NamedTuple):
    """The frames of the take that opens.

    names: in order. decision: None where the files are of one scan. takes: all of them, in order; none where
    the files are of one. aside: the files of the other takes.
    """

    names: list[str]
    decision: Decision
    takes: tuple[Take, ...]
    aside: tuple[Aside, ...]


def takes_in(names: Sequence[str]) -> dict[str, list[str]]:
    """Pattern -> names in order, where names are of several scans; empty where they are of one.

    The frames of a take differ in the number of the frame alone, see `numbered_name`. Takes have numbers in
    common, as frames that count on from take to take are one scan; or their numbers are times since 1970.
    Dates and clock times are no numbers of frames.
    """
    signed, ordered = has_signs(names), in_order(names)
    groups: dict[tuple[str, str], list[str]] = {}
    numbers: dict[tuple[str, str], set[int]] = {}
    for name in ordered:
        found = numbered_name(name, signed)
        if found is None:
            return {}
        group = found.before, found.after
        groups.setdefault(group, []).append(name)
        numbers.setdefault(group, set()).add(int(found.digits))
    first, *others = numbers.values() or [set()]
    if not others or any(len(found) < _LEAST for found in groups.values()):
        return {}
    are_stamps = all(is_epoch(str(number)) for found in numbers.values() for number in found)
    if not are_stamps and not all(first & other for other in others):
        return {}
    if are_dates(ordered) or stamped_seconds(ordered) is not None:
        return {}
    patterns = {f"{before}*{after}": found for (before, after), found in groups.items()}
    return {pattern: patterns[pattern] for pattern in in_order(list(patterns))}


def take_names(patterns: Sequence[str]) -> list[str]:
    """A short name of each pattern: the words in which it differs from the others."""
    start = _whole_words(_common_start(patterns))
    end = _whole_words(_common_start([pattern[::-1] for pattern in patterns]))
    short = [pattern[len(start) : len(pattern) - len(end)].strip(_SIGNS) for pattern in patterns]
    is_clear = all(short) and len({*short}) == len(short)
    return short if is_clear else list(patterns)


def _common_start(texts: Sequence[str]) -> str:
    """The longest text that all of these begin with."""
    same = takewhile(lambda letters: len({*letters}) == 1, zip(*texts, strict=False))
    return "".join(letters[0] for letters in same)


def _whole_words(start: str) -> str:
    """The text up to its last sign, so that no word is cut."""
    return start[: max(start.rfind(sign) for sign in _SIGNS) + 1]


def decide(names: Sequence[str], corrections: Corrections = NOTHING_CORRECTED) -> Takes:
    """The take that opens: the one that the user names, else the first.

    names: of the frames, at least one. Where the user lists the frames, these are one scan, in the order of
    the list. Raises InputError where there is no such take.
    """
    wanted = corrections.get(KEY)
    if frames.lists_files(corrections) and wanted in (None, ALL):
        return Takes(list(names), Decision(KEY, None, "folder"), (), ())
    found = takes_in(names)
    if not found:
        if wanted not in (None, ALL):
            hint = "Leave out --take, because all files are frames of one scan"
            raise InputError(f"there is no take '{shortened(wanted)}'", hint=hint)
        return Takes(in_order(names), Decision(KEY, None, "folder"), (), ())
    short = take_names(list(found))
    takes = tuple(
        Take(name, pattern, len(found[pattern])) for name, pattern in zip(short, found, strict=True)
    )
    if wanted == ALL:
        return Takes(in_order(names), Decision(KEY, ALL, "user", "--read"), takes, ())
    chosen = takes[0] if wanted is None else _named(wanted, takes)
    aside = tuple(
        Aside(name, f"another take: {take.name}")
        for take in takes
        if take is not chosen
        for name in found[take.pattern]
    )
    if wanted is None:
        why = f"The folder contains {len(takes)} takes: {', '.join(take.pattern for take in takes)}"
        others = tuple(take.name for take in takes[1:])
        decision = Decision(KEY, chosen.name, "assumed", why=why, alternatives=(*others, ALL))
    else:
        decision = Decision(KEY, chosen.name, "user", "--read")
    return Takes(found[chosen.pattern], decision, takes, aside)


def _named(wanted: str, takes: Sequence[Take]) -> Take:
    """The take of this name, or the only one whose name or pattern begins so. Raises InputError."""
    exact = [take for take in takes if wanted in (take.name, take.pattern)]
    near = [take for take in takes if take.name.startswith(wanted) or take.pattern.startswith(wanted)]
    found = exact or near
    if len(found) != 1:
        hint = f"Takes: {', '.join(take.name for take in takes)}, or {ALL}"
        raise InputError(f"the name '{shortened(wanted)}' does not select exactly one take", hint=hint)
    return found[0]


def message_of_takes(takes: Takes) -> str:
    """The report of several takes for the user; empty where there is one, or the user has chosen."""
    if not takes.takes or takes.decision.source == "user":
        return ""
    listed = ", ".join(f"{take.pattern} ({take.frames})" for take in takes.takes)
    return (
        f"The folder contains {len(takes.takes)} takes: {listed}. Scan4D opens {takes.decision.value}. To "
        f"open another take, use --take {takes.takes[1].name}, or {ALL}"
    )


# --- the dialog of folders ------------------------------------------------------------------


class FileRow(NamedTuple):
    """A file in the dialog of a folder.

    take: the name of its take, empty where there is one. number: of the frame, None where it has none.
    time: seconds, None where it is not used. why: it is left aside, else empty.
    """

    name: str
    take: str
    number: int | None
    time: float | None
    is_used: bool
    why: str


class Split(NamedTuple):
    """How the files of a folder split into scans. takes: none where they are of one scan. times: the decision
    about the times of the frames."""

    takes: tuple[Take, ...]
    files: tuple[FileRow, ...]
    times: Decision


def split(folder: Path, names: Sequence[str], corrections: Corrections = NOTHING_CORRECTED) -> Split:
    """The files of a folder as the dialog of folders lists them, in order. It reads no file but times.csv.

    names: of the files of one kind in the folder. Raises InputError where a correction is unusable.
    """
    table = folder / TIMES_FILE if (folder / TIMES_FILE).is_file() else None
    used = frames.decide(names, corrections)
    takes = decide(used.names, corrections)
    moments = times.decide(takes.names, folder, table=table, corrections=corrections)
    at = dict(zip(takes.names, moments.seconds.tolist(), strict=True))
    why = {row.file: row.why for row in (*used.aside, *takes.aside)}
    of_take = {name: take for take, found in zip(takes.takes, takes_in(used.names).values(), strict=False)
               for name in found}  # fmt: skip
    signed = has_signs(names)
    rows = []
    for name in in_order(names):
        number = numbered_name(name, signed)
        take = of_take.get(name)
        rows.append(
            FileRow(
                name, take.name if take else "", int(number.digits) if number else None, at.get(name),
                name in at, why.get(name, ""),
            )
        )  # fmt: skip
    return Split(takes.takes, tuple(rows), moments.decision)

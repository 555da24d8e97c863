"""Numbers, dates and clock times in the names of files, for the deciders of frames, takes and times."""

from __future__ import annotations

import re
from collections.abc import Sequence
from datetime import datetime, timedelta
from decimal import Decimal
from itertools import pairwise
from typing import NamedTuple

from ..times import natural_key

_SIGNED = re.compile(r"(-?[0-9]+)")
_DECIMALS = re.compile(r"([0-9]+(?:\.[0-9]+)?)")
_DIGITS = re.compile(r"([0-9]+)")
_LAST = re.compile(r"(.*?)([0-9]+)([^0-9]*)", re.DOTALL)
_YEARS = 1990, 2100
_EPOCHS = {10: 1.0, 13: 1e-3, 16: 1e-6, 19: 1e-9}  # digits of times since 1970 -> seconds of their unit
_SHORTEST = 1 / 300  # seconds between frames, where decimals tell times
_LONGEST = 10.0
_LARGEST_STEP = 1000  # numbers further apart are no frame numbers
_TIGHT = "-.:h"  # between hours and minutes: "_" stands between other numbers too


def has_signs(names: Sequence[str]) -> bool:
    """Whether a minus before a number is its sign: elsewhere a name has the same text and no minus."""
    seen: dict[tuple[tuple[str, ...], int], set[bool]] = {}
    for name in names:
        parts = _SIGNED.split(name)
        for column, number in enumerate(parts[1::2]):
            seen.setdefault((tuple(parts[::2]), column), set()).add(number.startswith("-"))
    return any(len(both) == 2 for both in seen.values())


def in_order(names: Sequence[str]) -> list[str]:
    """Names as a person would sort them: 2 before 10, and -1 before 0 where a minus is a sign."""
    if _are_unequal_decimals(names):  # 0.04 before 0.2
        return sorted(names, key=lambda name: Decimal(_DECIMALS.search(name)[1]))  # type: ignore[index]
    if not has_signs(names):
        return sorted(names, key=natural_key)

    def key(name: str) -> list[str | int]:
        parts = _SIGNED.split(name.casefold())
        return [int(part) if position % 2 else part for position, part in enumerate(parts)]

    return sorted(names, key=lambda name: (key(name), name))


def _are_unequal_decimals(names: Sequence[str]) -> bool:
    """Whether names differ in decimal numbers of several lengths, none of which ends with a zero."""
    parts = [re.match(r"[^0-9]*([0-9]+)\.([0-9]+)", name) for name in names]
    columns = varying(names, _DECIMALS)
    if not (all(parts) and columns is not None and len(columns) == 1):
        return False
    fractions = [part[2] for part in parts if part is not None]
    return len({*map(len, fractions)}) > 1 and not any(text.endswith("0") for text in fractions)


def varying(names: Sequence[str], numbers: re.Pattern[str]) -> list[tuple[str, ...]] | None:
    """The parts that differ among names that are split at numbers, each as the texts of all names; None where
    names have different numbers of parts."""
    rows = [numbers.split(name) for name in names]
    if len({len(row) for row in rows}) != 1:
        return None
    return [column for column in zip(*rows, strict=True) if len(set(column)) > 1]


class Numbered(NamedTuple):
    """A name split at its last number: the text before, the digits with their sign, and the text after."""

    before: str
    digits: str
    after: str


def numbered_name(name: str, signed: bool = False) -> Numbered | None:
    """The name split at its last number; None where it has none. signed: whether a minus is a sign."""
    match = _LAST.fullmatch(name)
    if match is None:
        return None
    before, digits, after = match.groups()
    if signed and before.endswith("-"):
        before, digits = before[:-1], f"-{digits}"
    return Numbered(before, digits, after)


def is_date(digits: str) -> bool:
    """Whether 8 digits are a day, year first."""
    return len(digits) == 8 and _moment([digits[:4], digits[4:6], digits[6:]], []) is not None


def are_dates(names: Sequence[str]) -> bool:
    """Whether all numbers that differ among names are those of a day, such as 20240501 or 2024-05-01."""
    rows = [_DIGITS.split(name) for name in names]
    if len({tuple(row[::2]) for row in rows}) != 1:
        return False
    columns = list(zip(*(row[1::2] for row in rows), strict=True))
    changing = {number for number, column in enumerate(columns) if len(set(column)) > 1}
    for start, column in enumerate(columns):
        if changing == {start}:
            return all(map(is_date, column))
        days = columns[start : start + 3]
        within = changing <= {start, start + 1, start + 2}
        if len(days) == 3 and within and all(_moment(list(day), []) for day in zip(*days, strict=True)):
            return bool(changing)
    return False


def stamped_seconds(names: Sequence[str]) -> list[float] | None:
    """Seconds from the first frame on where the names are real times: times since 1970, decimal seconds, or a
    clock with or without a date. None where they are not, or do not increase."""
    if len(names) < 2:
        return None
    for find in (_since_1970, _decimal_seconds, _clock_seconds):
        found = find(names)
        if found is not None:
            return found if all(before < after for before, after in pairwise(found)) else None
    return None


def frame_counts(names: Sequence[str]) -> list[int] | None:
    """The frame number in each name, where the names differ in that one number only.

    None where they differ in more, where the numbers do not increase, are dates, or a step between two is too
    large for frame numbers.
    """
    columns = varying(names, _SIGNED if has_signs(names) else _DIGITS)
    if columns is None or len(columns) != 1 or not columns[0][0][-1:].isdecimal():
        return None
    if are_dates(names):
        return None
    numbers = [int(number) for number in columns[0]]
    return (
        numbers if all(0 < after - before <= _LARGEST_STEP for before, after in pairwise(numbers)) else None
    )


def small_stamps(names: Sequence[str]) -> list[float] | None:
    """Seconds from the first frame on where the names differ in one number that may be of milli-, micro- or
    nanoseconds, the first of these that makes steps of a film; None where they do not."""
    columns = varying(names, _DIGITS)
    if len(names) < 2 or columns is None or len(columns) != 1 or not columns[0][0].isdecimal():
        return None
    numbers = [int(text) for text in columns[0]]
    steps = sorted(after - before for before, after in pairwise(numbers))
    if steps[0] <= 0 or are_dates(names):
        return None
    middle = (steps[(len(steps) - 1) // 2] + steps[len(steps) // 2]) / 2
    fits = (unit for unit in (1e-3, 1e-6, 1e-9) if _SHORTEST <= middle * unit <= _LONGEST)
    unit = next(fits, None)
    return None if unit is None else [(number - numbers[0]) * unit for number in numbers]


def _since_1970(names: Sequence[str]) -> list[float] | None:
    columns = varying(names, _DIGITS)
    if columns is None or len(columns) != 1 or len({*map(len, columns[0])}) != 1:
        return None
    digits = columns[0]
    unit = _EPOCHS.get(len(digits[0]))
    if unit is None or not all(text.isdecimal() for text in digits):
        return None
    low, high = (datetime(year, 1, 1).timestamp() for year in _YEARS)
    numbers = [int(text) for text in digits]
    if not all(low <= number * unit <= high for number in numbers):
        return None
    return [(number - numbers[0]) * unit for number in numbers]


def _decimal_seconds(names: Sequence[str]) -> list[float] | None:
    columns = varying(names, _DECIMALS)
    if columns is None or len(columns) != 1 or not all("." in text for text in columns[0]):
        return None
    if not all(text[:1].isdecimal() for text in columns[0]):
        return None
    wholes, fractions = zip(*(text.split(".") for text in columns[0]), strict=True)
    steps = [int(after) - int(before) for before, after in pairwise(fractions)]
    if len({*wholes}) == 1 and int(wholes[0]) and {*steps} == {1}:
        return None  # "take1.01", "take1.02": a number of the take and one of the frame
    stamps = [Decimal(text) for text in columns[0]]
    seconds = [float(stamp - stamps[0]) for stamp in stamps]
    middle = sorted(after - before for before, after in pairwise(seconds))[len(seconds) // 2 - 1]
    return seconds if middle >= _SHORTEST else None


def _clock_seconds(names: Sequence[str]) -> list[float] | None:
    rows = [_DIGITS.split(name) for name in names]
    if len({tuple(row[::2]) for row in rows}) != 1:
        return None
    texts, columns = rows[0][::2], list(zip(*(row[1::2] for row in rows), strict=True))
    changing = {number for number, column in enumerate(columns) if len(set(column)) > 1}
    for start in range(len(columns)):
        for form in _forms(start, [len(column[0]) for column in columns]):
            if not changing or not changing <= {*form.all}:
                continue
            joints = {text[:1] for text in texts[form.clock[0] + 1 : form.clock[0] + 3]}
            is_loose = len(form.clock) == 3 and not joints <= {*_TIGHT}
            if not form.date and (is_loose and len(changing) < 2):
                continue
            if changing <= {*form.date}:
                return None
            moments = [form.moment([row[1::2][number] for number in form.all]) for row in rows]
            known = [moment for moment in moments if moment is not None]
            if len(known) == len(moments):
                return [(moment - known[0]).total_seconds() for moment in known]
    return None


class _Form(NamedTuple):
    """The numbers of a name that are a date, a clock and a part of a second; date and part may lack."""

    date: tuple[int, ...]
    clock: tuple[int, ...]
    part: tuple[int, ...]

    @property
    def all(self) -> tuple[int, ...]:
        return (*self.date, *self.clock, *self.part)

    def moment(self, texts: Sequence[str]) -> datetime | None:
        dated, timed = len(self.date), len(self.clock)
        date, clock = list(texts[:dated]), list(texts[dated : dated + timed])
        if dated == 1:
            date = [date[0][:4], date[0][4:6], date[0][6:]]
        if timed == 1:
            clock = [clock[0][:2], clock[0][2:4], clock[0][4:]]
        return _moment(date, clock, texts[dated + timed :])


def _forms(start: int, widths: Sequence[int]) -> list[_Form]:
    """The forms of a time that begins at a number, the longest first. widths: digits of the numbers."""

    def at(first: int, *wanted: int) -> bool:
        return list(widths[first : first + len(wanted)]) == list(wanted)

    found = []
    dates = [tuple(range(start, start + n)) for n, w in ((3, (4, 2, 2)), (1, (8,))) if at(start, *w)]
    for date in (*dates, ()):
        after = start + len(date)
        clocks = [tuple(range(after, after + n)) for n, w in ((3, (2, 2, 2)), (1, (6,))) if at(after, *w)]
        for clock in clocks:
            end = after + len(clock)
            if len(clock) == 1 and not date:  # six digits alone are a number
                continue
            has_part = end < len(widths) and widths[end] in (1, 2, 3, 6, 9)
            found += [_Form(date, clock, (end,))] if has_part else []
            found.append(_Form(date, clock, ()))
    return found


def _moment(date: Sequence[str], clock: Sequence[str], part: Sequence[str] = ()) -> datetime | None:
    """The moment that digits give; None where there is no such day or time."""
    year, month, day = (int(text) for text in date) if date else (2000, 1, 1)
    if not _YEARS[0] <= year <= _YEARS[1]:
        return None
    try:
        hour, minute, second = (int(text) for text in clock) if clock else (0, 0, 0)
        moment = datetime(year, month, day, hour, minute, second)
    except ValueError:
        return None
    return moment + timedelta(seconds=float(f"0.{part[0]}")) if part else moment

"""Numbers, dates and clock times in the names of files, for the deciders of frames, takes and times."""

from __future__ import annotations

import re
from collections.abc import Sequence
from datetime import datetime, timedelta
from decimal import Decimal
from itertools import pairwise
from typing import NamedTuple

from ..times import natural_key

_SIGNED = re.compile(r"([-+]?[0-9]+)")
_DECIMALS = re.compile(r"([0-9]+(?:\.[0-9]+)?)")
_DIGITS = re.compile(r"([0-9]+)")
_LAST = re.compile(r"(.*?)([0-9]+)([^0-9]*)", re.DOTALL)
_OF_CAMERA = re.compile(
    r"(?:^|[^a-z])(?:cam|camera|kamera|view|kinect|sensor|device|pod|lod|side)[ _-]?$", re.IGNORECASE
)
_YEARS = 1990, 2100
_EPOCHS = {10: 1.0, 13: 1e-3, 16: 1e-6, 19: 1e-9}  # digits of times since 1970 -> seconds of their unit
_SHORTEST = 1 / 300  # seconds between frames, where decimals tell times
_LONGEST = 10.0
_LARGEST_STEP = 1000  # numbers further apart are no frame numbers
_JOINED_CLOCK = re.compile(r"(?<![0-9])([0-9]{8})([0-9]{6})([0-9]{3}|[0-9]{6})?(?![0-9])")
_SPLIT_STAMP = re.compile(r"(?<![0-9])([0-9]{10})[-_.]([0-9]{9}|[0-9]{6}|[0-9]{3})(?![0-9])")
_DECIMAL_MARK = re.compile(r"(?<=[0-9])(?:,|(?<=[^0-9]0)p)(?=[0-9])|(?<=^0)p(?=[0-9])")
_UNIT = re.compile(r"[ _]?(s|sec|ms|us|µs|ns)(?![a-zäöüß])", re.IGNORECASE)
_SECONDS = {"s": 1.0, "sec": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "ns": 1e-9}
_SPAN = re.compile(r"(?:(\d+)h)?(\d+)m(\d+)s", re.ASCII)
_TIGHT = "-.:hm"  # between hours and minutes: "_" stands between other numbers too


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
    if (days := _days_last_year(names)) is not None:  # 15.05.2024 before 02.07.2024
        return sorted(names, key=lambda name: (days[name], name))
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
    """The name split at the number of its frame; None where it has none. signed: whether a minus is a sign.

    That is the last number, or the one before where the last one is of a camera: `frame12_cam1.ply`.
    """
    match = _LAST.fullmatch(name)
    if match is None:
        return None
    before, digits, after = match.groups()
    if _OF_CAMERA.search(before) and (inner := _LAST.fullmatch(before)) is not None:
        before, digits, after = inner[1], inner[2], inner[3] + digits + after
    if signed and before.endswith(("-", "+")):
        before, digits = before[:-1], before[-1] + digits
    return Numbered(before, digits, after)


def _days_last_year(names: Sequence[str]) -> dict[str, datetime] | None:
    """The day of each name, where all have one with the year behind: 31.05.2024, or 05-31-2024; else None."""
    rows = [_DIGITS.split(name) for name in names]
    if not rows or len({tuple(row[::2]) for row in rows}) != 1:
        return None
    columns = list(zip(*(row[1::2] for row in rows), strict=True))
    for start in range(len(columns) - 2):
        days = list(zip(*columns[start : start + 3], strict=True))
        is_alone = all(len(set(c)) == 1 for at, c in enumerate(columns) if not start <= at < start + 3)
        if not is_alone or not all(len(a) <= 2 and len(b) <= 2 and len(year) == 4 for a, b, year in days):
            continue
        for day, month in ((0, 1), (1, 0)):
            moments = [_moment([one[2], one[month], one[day]], []) for one in days]
            known = [moment for moment in moments if moment is not None]
            if len(known) == len(names):
                return dict(zip(names, known, strict=True))
    return None


def is_date(digits: str) -> bool:
    """Whether 8 digits are a day, year first, or 6 digits, which lack the century."""
    if len(digits) == 6:
        digits = f"20{digits}"
    return len(digits) == 8 and _moment([digits[:4], digits[4:6], digits[6:]], []) is not None


def are_dates(names: Sequence[str]) -> bool:
    """Whether all numbers that differ among names are those of a day: 20240501, 2024-05-01 or 01.05.2024."""
    if len(names) > 1 and _days_last_year(names) is not None:
        return True
    rows = [_DIGITS.split(name) for name in names]
    if len({tuple(row[::2]) for row in rows}) != 1:
        return False
    columns = list(zip(*(row[1::2] for row in rows), strict=True))
    changing = {number for number, column in enumerate(columns) if len(set(column)) > 1}
    for start, column in enumerate(columns):
        if changing == {start}:
            is_month = start and all(_moment([year, month, "1"], []) for year, month in
                                     zip(columns[start - 1], column, strict=True)
                                     if len(year) == 4 and len(month) == 2)  # fmt: skip
            if is_month and {*map(len, columns[start - 1])} == {4} and {*map(len, column)} == {2}:
                return start + 1 == len(columns)
            is_short = len(column[0]) == 6  # days of one month may as well be frame numbers
            return all(map(is_date, column)) and not (is_short and len({day[:4] for day in column}) == 1)
        days = columns[start : start + 3]
        within = changing <= {start, start + 1, start + 2}
        if len(days) == 3 and within and all(_moment(list(day), []) for day in zip(*days, strict=True)):
            return bool(changing)
    return False


def stamped_seconds(names: Sequence[str]) -> list[float] | None:
    """Seconds from the first frame on where the names are real times: times since 1970, decimal seconds, or a
    clock with or without a date. None where they are not, or do not increase."""
    if len(names) < 2 or are_dates(names):
        return None
    names = [_plain_stamps(name) for name in names]
    for find in (_since_1970, _seconds_with_unit, _decimal_seconds, _clock_seconds):
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


def _plain_stamps(name: str) -> str:
    """A name with its times apart: 20240501_123001 for 20240501123001, one number for seconds and their part,
    and a decimal point for a comma."""
    name = _JOINED_CLOCK.sub(_apart, name)
    name = _SPLIT_STAMP.sub(lambda match: match[1] + match[2] if is_epoch(match[1]) else match[0], name)
    return _DECIMAL_MARK.sub(".", name)


def _apart(match: re.Match[str]) -> str:
    date, clock, part = match.groups()
    known = _moment([date[:4], date[4:6], date[6:]], [clock[:2], clock[2:4], clock[4:]]) is not None
    return "_".join(filter(None, (date, clock, part))) if known else match[0]


def is_epoch(digits: str) -> bool:
    """Whether digits are a time since 1970 in seconds, milli-, micro- or nanoseconds."""
    unit = _EPOCHS.get(len(digits)) if digits.isdecimal() else None
    low, high = (datetime(year, 1, 1).timestamp() for year in _YEARS)
    return unit is not None and low <= int(digits) * unit <= high


def _since_1970(names: Sequence[str]) -> list[float] | None:
    columns = varying(names, _DIGITS) or []
    stamps = [column for column in columns if all(map(is_epoch, column)) and len({*map(len, column)}) == 1]
    others = [column for column in columns if column not in stamps]
    if len(stamps) != 1 or not all(map(_is_counter, others)):
        return None
    numbers = [int(text) for text in stamps[0]]
    return [(number - numbers[0]) * _EPOCHS[len(stamps[0][0])] for number in numbers]


def _is_counter(column: Sequence[str]) -> bool:
    """Whether a part of names counts up by 1."""
    if not all(text.isdecimal() for text in column):
        return False
    return {int(after) - int(before) for before, after in pairwise(column)} == {1}


def _seconds_with_unit(names: Sequence[str]) -> list[float] | None:
    """Seconds of names with "40ms", "0.04s" or "01m30s"."""
    spans = [_SPAN.search(name) for name in names]
    if all(spans):
        parts = [[int(part or 0) for part in span.groups()] for span in spans if span is not None]
        seconds = [3600.0 * hours + 60 * minutes + second for hours, minutes, second in parts]
        return [second - seconds[0] for second in seconds]
    rows = [_DECIMALS.split(name) for name in names]
    if len({len(row) for row in rows}) != 1:
        return None
    changing = [at for at, column in enumerate(zip(*rows, strict=True)) if len({*column}) > 1]
    if len(changing) != 1 or changing[0] % 2 == 0:
        return None
    unit = _UNIT.match(rows[0][changing[0] + 1])
    if unit is None:
        return None
    stamps = [Decimal(row[changing[0]]) for row in rows]
    return [float(stamp - stamps[0]) * _SECONDS[unit[1].lower()] for stamp in stamps]


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
    return seconds if _typical_step(seconds) >= _SHORTEST else None


def _typical_step(seconds: Sequence[float]) -> float:
    return sorted(after - before for before, after in pairwise(seconds))[len(seconds) // 2 - 1]


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
                seconds = [(moment - known[0]).total_seconds() for moment in known]
                return None if form.part and _typical_step(seconds) < _SHORTEST else seconds
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

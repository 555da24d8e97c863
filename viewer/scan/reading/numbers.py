"""How text writes numbers: encoding, separator and decimal mark of tables, and the numbers themselves."""

from __future__ import annotations

import codecs
import csv
import math
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain, islice
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError, shortened
from ...task import checkpoint
from .record import Decision

SEPARATORS = {"semicolon": ";", "tab": "\t", "comma": ",", "bar": "|", "blank": None}
COMMENTS = ("#", "//", "%")
HEAD = 1 << 16  # bytes that tell how a text is written
_LOOKED_AT = 200  # lines, of which the last ones tell the separator and the decimal mark:
_SAMPLE = 40
_ROWS_AT_ONCE = 1 << 12  # of text, since numpy holds the interpreter's lock while it grows a table
_CHARACTERS_AT_ONCE = 1 << 22  # of those rows
_LINES = 1 << 5  # whose characters are counted together

# --- encoding -----------------------------------------------------------------------------------

_MARKS = {
    codecs.BOM_UTF32_LE: "utf-32", codecs.BOM_UTF32_BE: "utf-32", codecs.BOM_UTF8: "utf-8-sig",
    codecs.BOM_UTF16_LE: "utf-16", codecs.BOM_UTF16_BE: "utf-16",
}  # fmt: skip
_CODECS = {"utf-8": "utf-8-sig", "utf-16": "utf-16", "latin-1": "cp1252"}  # of --read encoding=


def encoding_of(head: bytes) -> str:
    """The encoding of a text as Python names it, by its first bytes: a byte-order mark, zeros between the
    characters (UTF-16), or whether the bytes are UTF-8. All others are "cp1252", which extends Latin-1."""
    for mark, name in _MARKS.items():
        if head.startswith(mark):
            return name
    even, odd = head[0:512:2], head[1:512:2]
    if len(odd) > 1 and b"\0" in odd + even:
        if odd.count(0) > 0.4 * len(odd) and not even.count(0):
            return "utf-16-le"
        if even.count(0) > 0.4 * len(even) and not odd.count(0):
            return "utf-16-be"
    try:
        codecs.getincrementaldecoder("utf-8")().decode(head)
    except UnicodeDecodeError:
        return "cp1252"
    return "utf-8-sig"


def encoding_decision(head: bytes, corrected: str | None = None) -> Decision:
    """The encoding of a text, `utf-8`, `utf-16`, `utf-32` or `latin-1`; see `encoding_of`."""
    if corrected is not None:
        return Decision("encoding", corrected, "user", "--read")
    name = encoding_of(head)
    if name == "cp1252":
        why = "Some bytes of the file are not UTF-8 text."
        return Decision("encoding", "latin-1", "assumed", why=why, alternatives=("utf-8", "utf-16"))
    return Decision("encoding", name.removesuffix("-sig")[:6].rstrip("-"))


def codec_of(encoding: Decision, head: bytes) -> str:
    """The encoding of a text as Python names it."""
    return _CODECS[encoding.value] if encoding.source == "user" else encoding_of(head)


def decoded(data: bytes) -> str:
    """A whole text, without a byte-order mark. Bytes that the encoding does not have become U+FFFD."""
    return data.decode(encoding_of(data[:HEAD]), "replace").removeprefix("\ufeff")


# --- numbers ------------------------------------------------------------------------------------

ABSENT = {  # in place of a number; spreadsheets write the words in capitals
    "", "-", "--", "---", "?", "*", ".", "na", "n/a", "<na>", "nan", "-nan", "none", "null", "nil", "missing",
    "#n/a", "#nv", "#value!", "#wert!", "#div/0!", "#num!", "#zahl!", "#ref!", "#bezug!", "#name?", "#null!",
}  # fmt: skip
_FORTRAN = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)[dD][+-]?\d+", re.ASCII)
_NOT_FINITE = re.compile(r"([+-]?)(?:1[.,]#(qnan|snan|ind|nan|inf|j)\d*|nan\(\w*\))", re.IGNORECASE)
_COMMA = re.compile(r"[+-]?(?:\d*,\d+|\d+)(?:[eEdD][+-]?\d+)?", re.ASCII)
_THOUSANDS = re.compile(r"[+-]?\d{1,3}(?:,\d{3})+\.\d*|[+-]?\d{1,3}(?:,\d{3}){2,}", re.ASCII)
_GERMAN_THOUSANDS = re.compile(r"[+-]?\d{1,3}(?:\.\d{3})+(?:,\d*)?", re.ASCII)
_GROUPED = re.compile(r"[+-]?\d{1,3}(?:[' ]\d{3})+(?:[.,]\d*)?")  # thousands of Switzerland and France
_LIKE_THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}", re.ASCII)


def value(word: str, decimal: str = ".") -> float:
    """The number of a word. Raises ValueError where it is none.

    It also reads Fortran's exponents (1.5D+03), what Windows writes for numbers that are not finite
    (`1.#QNAN`, `-1.#IND`, `1.#INF`, `nan(ind)`), and thousands before a decimal mark (1,234.5).
    decimal: "." or ",".
    """
    form = point_form(word, decimal)
    try:
        return float(form)
    except ValueError:
        pass
    if _FORTRAN.fullmatch(form):
        return float(form.lower().replace("d", "e"))
    if match := _NOT_FINITE.fullmatch(word):
        sign = -1 if match[1] == "-" else 1
        return sign * math.inf if (match[2] or "").lower() == "inf" else math.nan
    raise ValueError(f"{shortened(word)!r} is not a number")


def point_form(word: str, decimal: str = ".") -> str:
    """A number with a decimal point and without marks of thousands; other words as they are."""
    if ("'" in word or " " in word) and _GROUPED.fullmatch(word):
        word = word.replace("'", "").replace(" ", "")
    if decimal == ",":
        if _COMMA.fullmatch(word):
            return word.replace(",", ".")
        if _GERMAN_THOUSANDS.fullmatch(word):
            return word.replace(".", "").replace(",", ".")
        return "" if "." in word and "#" not in word else word  # a point is no decimal mark here
    return word.replace(",", "") if "," in word and _THOUSANDS.fullmatch(word) else word


def is_not_finite(word: str) -> bool:
    """Whether a word is what Windows writes for a number that is not finite, such as `1.#QNAN`."""
    return _NOT_FINITE.fullmatch(word) is not None


def is_numeral(word: str, decimal: str = ".") -> bool:
    """Whether a word is a number as `value` reads them."""
    if "_" in word:  # which Python allows among digits
        return False
    try:
        value(word, decimal)
    except ValueError:
        return False
    return True


# --- separators and decimal marks ---------------------------------------------------------------


@dataclass(frozen=True)
class Dialect:
    """How the rows of a table are written.

    separator:   "blank", "tab", "comma", "semicolon", "bar", or the character itself
    decimal:     "." or ","
    needs_blank: whether a comma separates only where a blank follows, as in "1,25, 2,50"
    is_certain:  False where each comma could be a mark of thousands
    groups:      whether each comma is a mark of thousands, as where the user states a decimal point
    """

    separator: str = "blank"
    decimal: str = "."
    needs_blank: bool = False
    is_certain: bool = True
    groups: bool = False

    @property
    def delimiter(self) -> str | None:
        """The separator as numpy takes it: None for blanks."""
        return SEPARATORS.get(self.separator, self.separator)

    def decisions(self, corrected: Iterable[str] = ()) -> tuple[Decision, Decision]:
        """The separator and the decimal mark. corrected: those of the two that the user stated."""
        corrected = {*corrected}
        separator = Decision("separator", self.separator)
        decimal = Decision("decimal", self.decimal, why=_WHY[self.decimal])
        if not self.is_certain:
            why = "Three digits follow each comma, so the commas could also separate thousands."
            decimal = Decision("decimal", ",", "assumed", "", why, (".",), changes_numbers=True)
        user = [Decision(one.key, one.value, "user", "--read") for one in (separator, decimal)]
        return (
            user[0] if "separator" in corrected else separator,
            user[1] if "decimal" in corrected else decimal,
        )


PLAIN = Dialect()
_WHY = {".": "", ",": "Only with decimal commas do all rows have the same number of values."}
_CANDIDATES = (
    Dialect("semicolon"), Dialect("semicolon", ","), Dialect("tab"), Dialect("tab", ","),
    Dialect("comma"), Dialect("comma", ","), Dialect("bar"), Dialect("bar", ","), Dialect(),
    Dialect("blank", ","),
)  # fmt: skip
_SPACED = Dialect("comma", ",", needs_blank=True)
_BETWEEN = re.compile(r"[ \t]*,[ \t]+")
_WORDS = re.compile(r'"[^"]*"|\S+')


def split_line(line: str, dialect: Dialect = PLAIN) -> list[str]:
    """The words of a line, without quotes and blanks around them, as the file spells them.

    Brackets around the line, as in `[1, 2, 3]`, go too. Signs that are not ASCII become those that are.
    """
    line = with_plain_signs(line).strip(" \r\n" if dialect.separator == "tab" else None)
    if line[:1] in _OPENING and _IN_BRACKETS.match(line):
        line = line.strip("()[]{};, \t")
    if dialect.separator == "comma":
        line = line.rstrip("; ")
    if dialect.needs_blank:
        words = _BETWEEN.split(line)
    elif dialect.delimiter is None:
        words = _WORDS.findall(line) if '"' in line else line.split()
    elif '"' in line:
        try:
            words = next(csv.reader([line], delimiter=dialect.delimiter, skipinitialspace=True), [])
        except csv.Error:
            words = line.split(dialect.delimiter)
    else:
        words = line.split(dialect.delimiter)
    words = [word.strip().strip("\"'").strip() for word in words]
    if dialect.groups:
        words = [word.replace(",", "") if _LIKE_THOUSANDS.fullmatch(word) else word for word in words]
    return words


def with_plain_signs(text: str) -> str:
    """A text with ASCII signs for minus, blanks and apostrophes, and numbers without blanks of thousands that
    are not ASCII."""
    if text.isascii():
        return text
    return _THIN_GROUPS.sub(lambda match: re.sub(r"\D", "", match[0]), text).translate(_PLAIN_SIGNS)


_PLAIN_SIGNS = str.maketrans(dict(zip("\u2212\u2013\u00a0\u202f\u2009\u2019", "--   '", strict=True)))
_THIN_GROUPS = re.compile(r"(?<![\d.,])\d{1,3}(?:[\u00a0\u202f\u2009]\d{3})+(?!\d)")
_OPENING = ("(", "[", "{")
_IN_BRACKETS = re.compile(r"[(\[{\s]+[-+.\d]")


def without_comment(line: str) -> str:
    """A line without the comment at its end, which begins with `#`, `//` or `%` behind a blank."""
    return _COMMENT.split(line, maxsplit=1)[0]


_COMMENT = re.compile(r"(?:^|(?<=\s))(?:#(?!N/A|NV|n/a|nv|[A-Z/0]+[!?])|//|%)")
_REMARK = re.compile(r"\s*(?:/\*|\*/|!|;\s*[^\W\d][^;]*$|\*\s*[^\W\d]|rem\b|--\s)", re.IGNORECASE)


def is_comment(line: str) -> bool:
    """Whether a whole line is a comment, also one of other programs: `; text`, `! text`, `/* text */`."""
    return line.lstrip().startswith(COMMENTS) or _REMARK.match(line) is not None


def dialect_of(lines: Iterable[str], separator: str | None = None, decimal: str | None = None) -> Dialect:
    """How the rows among the first lines of a text are written; names and remarks may stand above them.

    Those separators and decimal marks count that find the most numbers, and the least else, in most lines.
    Decimal commas count only where more numbers are found with them. separator, decimal: stated by the user.
    """
    sample = [*islice(_filled(lines), _LOOKED_AT)][-_SAMPLE:]
    text = "".join(sample)
    candidates = [
        one
        for one in _CANDIDATES
        if (one.separator == separator if separator else _occurs(one, text))
        and (one.decimal == decimal if decimal else one.decimal == "." or "," in text)
    ]
    if decimal == ".":
        candidates = [replace(one, groups=one.separator != "comma") for one in candidates]
    if _is_spaced(sample, separator, decimal):
        return _SPACED
    if separator is None and decimal == "," and not candidates:
        return Dialect("blank", ",")
    scores = [_score(one, sample) for one in candidates]
    most = max((score.lines for score in scores), default=0)
    usable = [(score, one) for score, one in zip(scores, candidates, strict=True) if 2 * score.lines >= most]
    best = max(usable, key=lambda pair: pair[0].fit)[1] if usable else PLAIN
    if best.decimal == "," and decimal is None and _could_be_thousands(best, sample):
        return Dialect(best.separator, ",", is_certain=False)
    return best


def _filled(lines: Iterable[str]) -> Iterator[str]:
    return (line for line in lines if not line.isspace() and line and not is_comment(line))


def _occurs(dialect: Dialect, text: str) -> bool:
    if dialect == Dialect("comma", ","):
        return '"' in text  # only quotes tell such commas apart
    return dialect.delimiter is None or dialect.delimiter in text


class _Score(NamedTuple):
    """How well a dialect fits: lines with as many words as most others; their numbers times their share."""

    lines: int
    fit: float


def _score(dialect: Dialect, sample: Sequence[str]) -> _Score:
    rows = [split_line(without_comment(line), dialect) for line in sample]
    counts: dict[int, list[int]] = {}
    for words in rows:
        if found := sum(is_numeral(word, dialect.decimal) for word in words):
            counts.setdefault(len(words), []).append(found)
    if not counts:
        return _Score(0, 0)
    width, each = max(counts.items(), key=lambda item: (len(item[1]), item[0]))
    return _Score(len(each), sum(each) ** 2 / (len(each) * width))


def _is_spaced(sample: Sequence[str], separator: str | None, decimal: str | None) -> bool:
    """Whether commas are decimal marks and, with a blank behind them, separators too: "1,25, 2,50"."""
    if separator not in (None, "comma") or decimal not in (None, ","):
        return False
    rows = [words for line in sample if len(words := split_line(line, _SPACED)) > 1]
    rows = [words for words in rows if any("," in word for word in words)]
    if not rows or len({len(words) for words in rows}) != 1:
        return False
    fits = all(_COMMA.fullmatch(word) for words in rows for word in words)
    marked = sum("," in word for words in rows for word in words)
    return fits and 4 * marked > sum(map(len, rows))  # others may be whole numbers, such as colours


def _could_be_thousands(dialect: Dialect, sample: Sequence[str]) -> bool:
    marked = [word for line in sample for word in split_line(line, dialect) if "," in word]
    numbers = [word for word in marked if is_numeral(word, ",")]
    return bool(numbers) and all(_LIKE_THOUSANDS.fullmatch(word) for word in numbers)


def check_commas(rows: Iterable[Sequence[str]], is_twice: bool = False) -> None:
    """Raise InputError where commas separate values, and seem to be decimal marks as well: "1,25,2,50,-3,75".

    Then every second value is a whole number without a sign, as long in all rows, and one begins with 0.
    is_twice: whether there are twice as many values as names, so that the last two do not count.
    """
    table = [[*words] for words in rows]
    width = len(table[0]) if table else 0
    if width < 4 or width % 2 or any(len(words) != width for words in table):
        return
    behind = [words[column] for words in table for column in range(1, width, 2)]
    columns = [[words[column] for words in table] for column in range(1, width, 2)]
    has_digits = all(word.isdecimal() for word in behind)
    if not has_digits or any("." in word for words in table for word in words):
        return
    same = all(len({len(word) for word in column}) == 1 for column in columns)
    if is_twice or (same and any(len(word) > 1 and word.startswith("0") for word in behind)):
        raise InputError(
            "seems to use commas both as separators and as decimal marks",
            hint=(
                "Export the file with semicolons or blanks between the values, or state the two marks, "
                "such as --read decimal=. --read separator=comma"
            ),
        )


# --- tables -------------------------------------------------------------------------------------


class TableRow(NamedTuple):
    """The words of a line of a table; numbers have a decimal point. line: its number, from 1."""

    line: int
    words: list[str]


def cells(lines: Iterable[str], dialect: Dialect | None = None) -> Iterator[TableRow]:
    """The words of all lines that are not blank and no comments, numbers with a decimal point.

    dialect: found by `dialect_of` where it is None; then all lines are held.
    """
    if dialect is None:
        lines = list(lines)
        dialect = dialect_of(lines)
    for number, line in enumerate(lines, 1):
        if line.strip() and not is_comment(line):
            words = split_line(line, dialect)
            yield TableRow(number, [_cell(word, dialect.decimal) for word in words])


def _cell(word: str, decimal: str) -> str:
    plain = point_form(word, decimal)
    return plain if plain != word and is_numeral(plain) else word


@dataclass
class LooseLines:
    """Lines of a table that are no rows.

    counts: lines of one whole number, which begin blocks of rows. behind: lines of text below the last row,
    each with the error that it is where rows follow.
    """

    counts: list[int] = field(default_factory=list)
    behind: list[tuple[str, InputError]] = field(default_factory=list)

    def check_end(self) -> None:
        """Raise InputError where rows follow the lines of text."""
        if self.behind:
            raise self.behind[0][1]


def parse_numbers(
    lines: Iterable[str],
    columns: Sequence[int] | None = None,
    dialect: Dialect = PLAIN,
    rows: int | None = None,
    loose: LooseLines | None = None,
) -> NDArray[np.float64]:
    """Numbers from lines of text, (N, C) float64; blank lines and comments (`#`, `//`, `%`) are skipped.

    columns: which to take; None: all, and then every row must have the same number (0 rows: 3).
    rows: how many to read at most. What is allocated follows the text, not `rows`.
    loose: gets the lines that are no rows; None: these are errors.
    Raises InputError where something is not a number or a row is too short.
    """
    width = len(columns) if columns is not None else 3
    table = np.empty((0, width))
    done, lines = 0, iter(lines)
    while batch := _batch(lines, _ROWS_AT_ONCE if rows is None else min(_ROWS_AT_ONCE, rows - done)):
        checkpoint(done / rows if rows else None)
        part = _parse_rows(batch, columns, dialect, done, loose)
        if not len(part):
            continue
        if loose is not None and loose.behind and loose.behind[0][0] not in batch:
            loose.check_end()
        if not done:
            table = np.empty((0, part.shape[1]))
        if part.shape[1] != table.shape[1]:
            raise _uneven(done, part.shape[1], table.shape[1])
        if done + len(part) > len(table):  # grown in place, so that there is never a second one
            table.resize((done + len(part) + done // 8, part.shape[1]), refcheck=False)
        table[done : done + len(part)] = part
        done += len(part)
    table.resize((done, table.shape[1]), refcheck=False)
    return table


def looked_at(
    lines: Iterable[str], most: int | None = None, decimal: str | None = None
) -> tuple[Dialect, Iterator[str]]:
    """Find how the rows of a stream are written, and return that with all its lines.

    most: lines that may be taken. decimal: the decimal mark that the user states.
    """
    lines = iter(lines)
    head = _batch(lines, _LOOKED_AT if most is None else min(most, _LOOKED_AT))
    is_plain = not any(mark in line for line in head for mark in ",;")
    return PLAIN if is_plain else dialect_of(head, None, decimal), chain(head, lines)


def _batch(lines: Iterator[str], most: int) -> list[str]:
    """The next lines, few enough to hold."""
    batch: list[str] = []
    size = 0
    while size <= _CHARACTERS_AT_ONCE and (part := list(islice(lines, min(_LINES, most - len(batch))))):
        batch += part
        size += sum(map(len, part))
    return batch


def _parse_rows(
    batch: list[str],
    columns: Sequence[int] | None,
    dialect: Dialect,
    before: int,
    loose: LooseLines | None,
) -> NDArray[np.float64]:
    """The rows of a few lines, (N, C), `before` rows below the first of the table: by numpy where it can."""
    text = "".join(batch)
    if not text.isascii():
        batch = [with_plain_signs(line) for line in batch]
        text = "".join(batch)
    if text.isspace():
        return np.empty((0, 0))
    if any(mark in text for mark in COMMENTS):
        batch = [line for line in batch if not is_comment(line)]
        text = "".join(batch)
        if not text or text.isspace():
            return np.empty((0, 0))
    plain, delimiter = batch, dialect.delimiter
    if dialect.decimal == ",":
        if "." in text or '"' in text:
            return _parse_line_by_line(batch, columns, dialect, before, loose)
        if dialect.needs_blank:
            text, delimiter = _BETWEEN.sub(";", text), ";"
        plain = text.replace(",", ".").split("\n")
    quote = '"' if '"' in text else None
    try:
        return np.loadtxt(
            plain, usecols=columns, delimiter=delimiter, comments=None, quotechar=quote, ndmin=2
        )
    except ValueError:  # numpy knows fewer numbers, no comments, and counts rows from the first of these
        return _parse_line_by_line(batch, columns, dialect, before, loose)


def _parse_line_by_line(
    batch: Iterable[str],
    columns: Sequence[int] | None,
    dialect: Dialect,
    before: int,
    loose: LooseLines | None,
) -> NDArray[np.float64]:
    """The rows of a few lines, (N, C), word by word; arguments as those of `_parse_rows`."""
    rows: list[list[float]] = []
    for line in batch:
        words = split_line(without_comment(line), dialect)
        if not any(words) or is_comment(line):
            continue
        if loose is not None and len(words) == 1 and words[0].isdecimal() and len(words[0]) < 19:
            loose.counts.append(int(words[0]))
            continue
        number = before + len(rows) + 1
        try:
            row = _parse_row(words, columns, dialect, number, len(rows[0]) if rows else None)
        except InputError as error:
            if loose is None or _begins_as_row(words, columns, dialect.decimal):
                raise
            loose.behind.append((line, error))
            continue
        if loose is not None:
            loose.check_end()
        rows.append(row)
    return np.array(rows, np.float64).reshape(len(rows), -1 if rows else 0)


def _parse_row(
    words: list[str], columns: Sequence[int] | None, dialect: Dialect, number: int, width: int | None
) -> list[float]:
    """The numbers of a row. number: of the row, from 1. width: of the rows above. Raises InputError."""
    if columns is None:
        if width is not None and len(words) != width:
            raise _uneven(number - 1, len(words), width)
        columns = range(len(words))
    last = max(columns, default=0)
    if len(words) <= last:
        if len(words) < 3 or dialect.delimiter is None:
            raise InputError(
                f"row {number:,} has only {len(words)} values, but Scan4D needs column {last + 1}"
            )
        words = [*words, *[""] * (last + 1 - len(words))]  # programs leave out empty cells at the end
    return [_number(words[column], dialect.decimal, number, column + 1) for column in columns]


def _begins_as_row(words: Sequence[str], columns: Sequence[int] | None, decimal: str) -> bool:
    """Whether the first value of a line is a number, or stands for one, as in a row that is damaged."""
    first = columns[0] if columns else 0
    if len(words) <= first:
        return len(words) > 1
    return words[first].lower() in ABSENT or is_numeral(words[first], decimal)


def _number(word: str, decimal: str, row: int, column: int) -> float:
    """The number of a cell; NaN where it is absent. Raises InputError."""
    if word.lower() in ABSENT:
        return math.nan
    try:
        return value(word, decimal)
    except ValueError:
        what = f"row {row:,}, column {column}: {shortened(word)!r} is not a number"
        other = "," if decimal == "." else "."
        is_other = is_numeral(word, other)
        hint = f"If this is a number, read the file with --read decimal={other}" if is_other else None
        raise InputError(what, hint=hint) from None


def _uneven(done: int, width: int, above: int) -> InputError:
    return InputError(f"row {done + 1:,} has {width} values, but the rows above have {above}")

"""The lines of an OBJ file by keyword, which numpy finds all at once."""

from __future__ import annotations

import re
from codecs import BOM_UTF8
from collections.abc import Iterator, Sequence
from enum import IntEnum
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...task import checkpoint
from ..admission import LONGEST_LINE
from ..reading.numbers import PLAIN, parse_numbers

_AT_ONCE = 1 << 24  # bytes in which lines are found together
_FACES_AT_ONCE = 1 << 14
_ROWS_AT_ONCE = 1 << 16
_PAYS = 1 << 22  # bytes of text for which it pays to load compiled code
_INDENTED = re.compile(rb"(?m)^[ \t]+")
_CONTINUED = re.compile(rb"(?m)^[vf](?:[^\\\n]|\\\r?\n|\\)*")  # from line to line by a backslash
_COMMENT = re.compile(rb"#[^\n]*")
_SLASHES_AS_BLANKS = bytes.maketrans(b"/", b" ")


class Keyword(IntEnum):
    """The keyword of a line."""

    OTHER = 0
    VERTEX = 1  # v
    NORMAL = 2  # vn
    UV = 3  # vt
    FACE = 4  # f
    MATERIAL = 5  # usemtl


_LENGTHS = {Keyword.VERTEX: 1, Keyword.NORMAL: 2, Keyword.UV: 2, Keyword.FACE: 1, Keyword.MATERIAL: 6}


class FaceRows(NamedTuple):
    """Faces as the file states them.

    corners: (C, 3) int64, the numbers of vertex, position in the texture and normal, from 0; -1 where a
    corner states none. sizes: (F,) int64, corners of each face. lines: (F,) int64, of the file, from 0.
    """

    corners: NDArray[np.int64]
    sizes: NDArray[np.int64]
    lines: NDArray[np.int64]


class ObjLines:
    """The lines of an OBJ file.

    data: its bytes. total: bytes of text of the scan that it belongs to; where they are many, compiled code
    parses the numbers. dialect: how the numbers are written, which the caller may set. Raises InputError
    where a line is longer than any row of numbers.
    """

    def __init__(self, data: bytes, total: int = 0) -> None:
        self.data = _with_whole_lines(data)
        self._is_large = max(total, len(data)) >= _PAYS
        self._starts, self._ends = _lines_in(self.data)
        firsts = _bytes_at(self.data, self._starts)
        if np.isin(firsts, (ord(" "), ord("\t"))).any():
            self.data = _INDENTED.sub(b"", self.data)
            self._starts, self._ends = _lines_in(self.data)
            firsts = _bytes_at(self.data, self._starts)
        lengths = self._ends - self._starts
        if len(lengths) and lengths.max() > LONGEST_LINE:
            line = int(lengths.argmax()) + 1
            raise InputError(f"line {line} has more than {LONGEST_LINE:,} characters")
        self._keywords = self._classified(firsts)
        self.dialect = PLAIN

    def _classified(self, first: NDArray[np.uint8]) -> NDArray[np.uint8]:
        second, third = (_bytes_at(self.data, self._starts + offset) for offset in (1, 2))
        found = np.zeros(len(first), np.uint8)
        is_v = first == ord("v")
        found[is_v & _is_blank(second)] = Keyword.VERTEX
        found[is_v & (second == ord("n")) & _is_blank(third)] = Keyword.NORMAL
        found[is_v & (second == ord("t")) & _is_blank(third)] = Keyword.UV
        found[(first == ord("f")) & _is_blank(second)] = Keyword.FACE
        for line in np.flatnonzero((first == ord("u")) & (second == ord("s"))):
            start = self._starts[line]
            if self.data[start : start + 6] == b"usemtl":
                found[line] = Keyword.MATERIAL
        return found

    def lines_of(self, keyword: Keyword) -> NDArray[np.int64]:
        """The numbers of the lines with this keyword, (L,), from 0."""
        return self._lines[keyword]

    @cached_property
    def _lines(self) -> list[NDArray[np.int64]]:
        return [np.flatnonzero(self._keywords == keyword) for keyword in Keyword]

    def count(self, keyword: Keyword) -> int:
        """How many lines have this keyword."""
        return len(self._lines[keyword])

    def texts(self, keyword: Keyword) -> Iterator[str]:
        """The rest of each line with this keyword, with its end."""
        length = _LENGTHS[keyword]
        for line in self._lines[keyword].tolist():
            yield self.data[self._starts[line] + length : self._ends[line] + 1].decode(
                "utf-8", "surrogateescape"
            )

    def others(self, *beginnings: bytes) -> Iterator[str]:
        """The lines with another keyword that begin so, in any case."""
        wanted = {beginning[:1] for beginning in beginnings} | {b[:1].upper() for b in beginnings}
        others = self._lines[Keyword.OTHER]
        firsts = _bytes_at(self.data, self._starts[others])
        for line in others[np.isin(firsts, [ord(letter) for letter in wanted])].tolist():
            text = self.data[self._starts[line] : self._ends[line]]
            if text.lower().startswith(beginnings):
                yield text.decode("utf-8", "surrogateescape").rstrip("\r\n")

    def raw(self, keyword: Keyword) -> bytes:
        """The bytes of all lines with this keyword, one behind the other."""
        return self._joined(self._lines[keyword])

    def _joined(self, lines: NDArray[np.int64]) -> bytes:
        """The bytes of lines, with their ends."""
        if not len(lines):
            return b""
        breaks = np.flatnonzero(np.diff(lines) != 1)
        starts = self._starts[lines[np.r_[0, breaks + 1]]].tolist()
        ends = self._ends[lines[np.r_[breaks, len(lines) - 1]]].tolist()
        return b"".join([self.data[start : end + 1] for start, end in zip(starts, ends, strict=True)])

    @cached_property
    def order(self) -> bytes:
        """The order of vertices, positions, normals and faces, as bytes that are the same for the same."""
        numbered = self._keywords[self._keywords > 0]
        begins = np.flatnonzero(np.diff(numbered, prepend=0))
        return numbered[begins].tobytes() + begins.tobytes() + len(numbered).to_bytes(8, "little")

    def table(self, keyword: Keyword, columns: Sequence[int] | None = None) -> NDArray[np.float64]:
        """The numbers behind a keyword, (N, C), as `parse_numbers` reads them. Raises InputError likewise."""
        is_fast = self._is_large and self.dialect == PLAIN
        found = self._compiled_table(keyword, columns) if is_fast else None
        return parse_numbers(self.texts(keyword), columns, self.dialect) if found is None else found

    def _compiled_table(self, keyword: Keyword, columns: Sequence[int] | None) -> NDArray[np.float64] | None:
        """The numbers as `table`, if all rows are plain; None if one is odd."""
        from ._obj_kernels import parse_rows

        lines = self._lines[keyword]
        if not len(lines):
            return None
        width = len(columns) if columns else len(next(self.texts(keyword)).split())
        data = np.frombuffer(self.data, np.uint8)
        table = np.empty((len(lines), width))
        left = np.empty((min(len(lines), _ROWS_AT_ONCE) * width, 2), np.int64)
        for begin in range(0, len(lines), _ROWS_AT_ONCE):
            checkpoint()
            part = lines[begin : begin + _ROWS_AT_ONCE]
            rows = table[begin : begin + len(part)]
            starts = self._starts[part] + _LENGTHS[keyword]
            parsed, hard = parse_rows(data, starts, self._ends[part], columns is None, rows, left)
            if parsed < len(part):
                return None
            words = [self.data[start:end] for start, end in left[:hard].tolist()]
            try:
                rows[np.isnan(rows)] = [float(word) for word in words]  # in the same order
            except ValueError:
                return None
            if any(b"_" in word for word in words):  # which Python allows among digits
                return None
        return table

    def faces(self) -> Iterator[FaceRows]:
        """The faces, in pieces. Raises ValueError where one is damaged."""
        lines = self._lines[Keyword.FACE]
        for begin in range(0, len(lines), _FACES_AT_ONCE):
            checkpoint(begin / len(lines))
            part = lines[begin : begin + _FACES_AT_ONCE]
            corners, sizes = _corners_of(self._joined(part))
            numbered = (Keyword.VERTEX, Keyword.UV, Keyword.NORMAL)
            so_far = np.stack([np.searchsorted(self._lines[each], part) for each in numbered], axis=1)
            is_counted_back = corners < 0
            if is_counted_back.any():
                corners = np.where(is_counted_back, corners + np.repeat(so_far, sizes, axis=0), corners - 1)
            else:
                corners -= 1
            yield FaceRows(corners, sizes, part)


def _with_whole_lines(data: bytes) -> bytes:
    """The text with line feeds behind all lines, without a byte-order mark and continued lines."""
    data = data.removeprefix(BOM_UTF8)
    if b"\n" not in data:
        data = data.replace(b"\r", b"\n")
    if b"\\" in data and (b"\\\n" in data or b"\\\r\n" in data):
        data = _CONTINUED.sub(lambda line: re.sub(rb"\\\r?\n", b" ", line[0]), data)
    return data if data.endswith(b"\n") else data + b"\n"


def _lines_in(data: bytes) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The first byte of each line, and its line feed."""
    values = np.frombuffer(data, np.uint8)
    ends = np.concatenate(
        [
            start + np.flatnonzero(values[start : start + _AT_ONCE] == ord("\n"))
            for start in range(0, len(values), _AT_ONCE)
        ]
    )
    return np.concatenate([[0], ends[:-1] + 1]), ends


def _bytes_at(data: bytes, at: NDArray[np.int64]) -> NDArray[np.uint8]:
    values = np.frombuffer(data, np.uint8)
    return values[np.minimum(at, len(values) - 1)]


def _is_blank(values: NDArray[np.uint8]) -> NDArray[np.bool_]:
    return (values == ord(" ")) | (values == ord("\t"))


def _corners_of(text: bytes) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The numbers of corners of faces as written, (C, 3), 0 where one is missing; and how many each has.

    text: whole lines. Raises ValueError where a word is no corner.
    """
    if b"#" in text:
        text = _COMMENT.sub(b"", text)
    values = np.frombuffer(text, np.uint8)
    is_word = values > ord(" ")
    begins = np.flatnonzero(is_word & ~np.concatenate([[False], is_word[:-1]]))
    words = np.searchsorted(begins, np.flatnonzero(values == ord("\n")))  # so far, with the keywords
    sizes = np.diff(words, prepend=0) - 1
    keywords = words - sizes - 1
    without_keywords = bytearray(text)
    np.frombuffer(without_keywords, np.uint8)[begins[keywords]] = ord(" ")
    found = np.zeros((len(begins) - len(keywords), 3), np.int64)
    stated = _stated_in_all(np.delete(begins, keywords), np.flatnonzero(values == ord("/")))
    if stated is not None:
        numbers = np.fromstring(bytes(without_keywords.translate(_SLASHES_AS_BLANKS)), np.int64, sep=" ")
        if len(numbers) == len(found) * len(stated):
            found[:, stated] = numbers.reshape(len(found), len(stated))
            return found, sizes
    for row, word in enumerate(without_keywords.split()):
        for column, number in enumerate(word.split(b"/")[:3]):
            found[row, column] = int(number) if number else 0
    return found, sizes


def _stated_in_all(corners: NDArray[np.intp], slashes: NDArray[np.intp]) -> list[int] | None:
    """The columns of vertex, position and normal that every corner states; None if corners differ.

    corners: where the words begin. slashes: where these are.
    """
    if not len(slashes):
        return [0]
    each = len(slashes) // max(len(corners), 1)
    if each > 2 or each * len(corners) != len(slashes):
        return None
    of_word = np.searchsorted(corners, slashes, side="right") - 1
    if (of_word != np.repeat(np.arange(len(corners)), each)).any():
        return None
    is_doubled = np.diff(slashes)[::2] == 1 if each == 2 else np.zeros(1, bool)
    if is_doubled.any():
        return [0, 2] if is_doubled.all() else None
    return [*range(each + 1)]

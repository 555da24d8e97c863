"""PLY: the Stanford polygon file format; its vertices are the points, its faces tell the topology.

Vertices of plain numbers that come first in the file, as nearly always, are read straight into numpy. Rows
with lists are walked, since only the lengths in them tell where the next one begins; the lists are left out.
"""

from __future__ import annotations

import re
import sys
from array import array
from collections.abc import Iterable
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError, unknown_name
from ...task import checkpoint
from ..points import PointCloud
from ._admission import (
    MOST_COLUMNS,
    check_count,
    opened,
    read_exactly,
    read_records,
    read_rest,
    size_of,
    too_few,
    whole_number,
)
from ._columns import (
    Columns,
    cloud_from_columns,
    columns_from_cloud,
    declared,
    listed,
    named,
    parse_table,
    records,
    text_lines,
)
from ._faces import with_faces

TITLE = "PLY"
SUFFIXES = (".ply",)

_HEADER_LIMIT = 1 << 20  # bytes looked at for the header
_LONGEST_WORD = 40  # of a file, in a message
_ROWS_AT_ONCE = 1 << 12  # of text
_ROWS = {"vertex": "vertices"}  # what rows are called in messages
_ENDIAN = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4",
    "float": "f4", "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2",
    "int32": "i4", "uint32": "u4", "float32": "f4", "float64": "f8",
}  # fmt: skip


@dataclass(frozen=True)
class _Property:
    name: str
    type: str  # as the file spells it
    length_type: str | None = None  # of a list

    def __post_init__(self) -> None:
        for name in (self.type, self.length_type or self.type):
            if name not in _TYPES:
                raise unknown_name("PLY property type", name[:_LONGEST_WORD], list(_TYPES))
        if _TYPES[self.length_type or "int"][0] == "f":
            raise InputError(
                f"the list '{self.name[:_LONGEST_WORD]}' has a length of type {self.length_type}"
            )

    @property
    def line(self) -> str:
        kind = self.type if self.length_type is None else f"list {self.length_type} {self.type}"
        return f"property {kind} {self.name}"


@dataclass(frozen=True)
class _Element:
    name: str
    count: int
    properties: list[_Property] = field(default_factory=list)

    @property
    def has_lists(self) -> bool:
        return any(p.length_type for p in self.properties)

    @property
    def numbers(self) -> list[_Property]:
        """The properties that are no lists."""
        return [p for p in self.properties if not p.length_type]

    def dtype(self, endian: str) -> np.dtype:
        """One row without its lists; fields go by number, since names may repeat."""
        return np.dtype([(str(i), endian + _TYPES[p.type]) for i, p in enumerate(self.numbers)])


@dataclass(frozen=True)
class _Header:
    encoding: str
    elements: list[_Element]
    odd_lines: list[str]  # that mean nothing to us
    size: int  # bytes


def read(path: Path, frame: int = 0) -> PointCloud:
    """The vertices of a PLY file, ascii or binary. Raises InputError."""
    with opened(path) as stream:
        header = _read_header(stream.read(_HEADER_LIMIT))
        names = [element.name for element in header.elements]
        if "vertex" not in names:
            raise InputError(f"has no vertex element, only: {listed(names)}")
        before, vertex = header.elements[: names.index("vertex")], header.elements[names.index("vertex")]
        if not vertex.count:
            raise InputError("holds no vertices")
        if not {"x", "y", "z"} <= {p.name.lower() for p in vertex.numbers}:
            odd, found = header.odd_lines, listed(p.name for p in vertex.numbers)
            reason = (
                f": the header line '{odd[0]}' says nothing in PLY" if odd else f" among the columns: {found}"
            )
            raise InputError(f"no x, y and z{reason}")
        stream.seek(header.size)
        read_rows = _read_ascii if header.encoding == "ascii" else _read_binary
        for element in before:
            if element.count and element.properties:
                read_rows(stream, element, header.encoding)
        cloud = cloud_from_columns(read_rows(stream, vertex, header.encoding))
        has_faces = any(element.name == "face" and element.count for element in header.elements)
        if has_faces and not vertex.has_lists and not any(element.count for element in before):
            cloud = with_faces(cloud, read_rest(stream))  # all that is behind the vertices
    return cloud


def write(path: Path, cloud: PointCloud) -> None:
    """Write a binary little-endian PLY; whole numbers of 64 bit become double."""
    columns = {
        name: column.astype("f8") if column.dtype.kind in "iu" and column.itemsize == 8 else column
        for name, column in columns_from_cloud(cloud).items()
    }
    spelling = {code: name for name, code in reversed(_TYPES.items())}
    properties = [_Property(name, spelling[column.dtype.str[1:]]) for name, column in columns.items()]
    with open(path, "wb") as stream:
        stream.write(_header_text("binary_little_endian", [_Element("vertex", len(cloud), properties)]))
        records(columns).tofile(stream)


def _read_header(head: bytes) -> _Header:
    end = re.search(rb"\nend_header[ \t\r]*(\n|\Z)", head)
    if not re.match(rb"ply\s", head) or end is None:
        raise InputError("is not a PLY file: it does not start with 'ply' or has no 'end_header'")
    encoding, elements, odd_lines = "", [], []
    for line in head[: end.start()].decode("utf-8", "replace").splitlines()[1:]:
        match line.split():
            case ["format", encoding, *_]:
                if encoding not in _ENDIAN:
                    raise unknown_name("PLY format", encoding[:_LONGEST_WORD], list(_ENDIAN))
            case ["element", name, count]:
                if not count.isdecimal() or len(count) > _LONGEST_WORD:
                    raise InputError(f"the header promises '{count[:_LONGEST_WORD]}' rows of {name}")
                elements.append(_Element(name, int(count)))
            case ["property", "list", length_type, type_, name] if elements:
                elements[-1].properties.append(_Property(name, type_, length_type))
            case ["property", type_, name] if elements:
                elements[-1].properties.append(_Property(name, type_))
            case ["comment" | "obj_info", *_] | []:
                pass
            case _:
                odd_lines.append(line.strip())
    for element in elements:
        check_count(len(element.properties), MOST_COLUMNS, "properties of an element")
    if not encoding:
        raise InputError("the PLY header has no format line")
    return _Header(encoding, elements, odd_lines, end.end())


def _header_text(encoding: str, elements: list[_Element]) -> bytes:
    lines = ["ply", f"format {encoding} 1.0"]
    for element in elements:
        lines += [f"element {element.name} {element.count}", *(p.line for p in element.properties)]
    return "\n".join([*lines, "end_header\n"]).encode()


def _read_ascii(stream: BinaryIO, element: _Element, encoding: str) -> Columns:
    lines = text_lines(stream)
    if element.has_lists:
        table = _walk_lines(lines, element)
    else:
        table = parse_table(lines, rows=element.count)
        if len(table) and table.shape[1] < len(element.properties):
            promised = len(element.properties)
            raise InputError(f"its rows hold {table.shape[1]} values, the header promises {promised}")
    if len(table) < element.count:
        raise too_few(len(table), element.count, _ROWS.get(element.name, f"rows of {element.name}"))
    return named(
        (p.name, declared(p.name, column, _TYPES[p.type]))
        for p, column in zip(element.numbers, table.T, strict=False)
    )


def _walk_lines(lines: Iterable[str], element: _Element) -> NDArray[np.float64]:
    """What is no list of each row, (N, C); a row a line."""
    values, rows = array("d"), 0
    for row, line in enumerate(islice(filter(str.strip, lines), min(element.count, sys.maxsize))):
        if row % _ROWS_AT_ONCE == 0:
            checkpoint(row / element.count)
        words, at = line.split(), 0
        for p in element.properties:
            if at >= len(words):
                raise InputError(f"row {row} of {element.name} ends before its {p.name}")
            if p.length_type:
                length = whole_number(words[at], f"the length of {p.name} in row {row} of {element.name}")
                if length < 0:
                    raise _negative(row, element)
                at += 1 + length
            else:
                values.append(float(words[at]))
                at += 1
        if at > len(words):
            raise InputError(f"row {row} of {element.name} ends within a list")
        rows += 1
    return np.frombuffer(values, np.float64).reshape(rows, len(element.numbers))


def _negative(row: int, element: _Element) -> InputError:
    return InputError(f"row {row} of {element.name} has a list of a negative length")


def _read_binary(stream: BinaryIO, element: _Element, encoding: str) -> Columns:
    dtype = element.dtype(_ENDIAN[encoding])
    what = _ROWS.get(element.name, f"rows of {element.name}")
    if not element.has_lists:
        rows = read_records(stream, dtype, element.count, what)
    else:
        packed = _walk_bytes(stream, element, encoding, what)
        rows = packed.view(dtype)[:, 0] if element.numbers else packed
    return named((p.name, rows[str(i)]) for i, p in enumerate(element.numbers))


def _walk_bytes(stream: BinaryIO, element: _Element, encoding: str, what: str) -> NDArray[np.uint8]:
    """The bytes of each row but those of its lists, (N, bytes)."""
    from ._ply_kernels import pack_rows

    sizes = np.array([np.dtype(_TYPES[p.type]).itemsize for p in element.properties])
    lengths = np.array(
        [np.dtype(_TYPES[p.length_type]).itemsize if p.length_type else 0 for p in element.properties]
    )
    start, held = stream.tell(), size_of(stream) - stream.tell()
    least = int(lengths.sum() + sizes[lengths == 0].sum())  # bytes of a row with empty lists
    if element.count * least > held:
        raise too_few(held // least, element.count, what)
    data = np.frombuffer(read_exactly(stream, held), np.uint8)
    packed = np.empty((element.count, int(sizes[lengths == 0].sum())), np.uint8)
    signed = np.array([_TYPES[p.length_type or p.type][0] == "i" for p in element.properties])
    rows, size, is_negative = pack_rows(data, sizes, lengths, signed, encoding == "binary_big_endian", packed)
    if is_negative:
        raise _negative(rows, element)
    if rows < element.count:
        raise too_few(rows, element.count, what)
    stream.seek(start + size)
    return packed

"""Headers of PLY files: elements, and the properties of their rows."""

from __future__ import annotations

import re
from codecs import BOM_UTF8
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError, unknown_name
from ..admission import MOST_COLUMNS, check_count
from ._columns import check_encoding

LONGEST_HEADER = 1 << 20  # bytes looked at
_LONGEST_WORD = 40  # of a file, in a message
ENDIAN = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4",
    "float": "f4", "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2",
    "int32": "i4", "uint32": "u4", "float32": "f4", "float64": "f8",
    # Beyond the standard, as programs write them nevertheless.
    "bool": "u1", "int64": "i8", "uint64": "u8", "long": "i8", "ulong": "u8", "longlong": "i8",
    "ulonglong": "u8", "half": "f2", "float16": "f2",
}  # fmt: skip
_KNOWN = list(TYPES)  # that a message names
TYPES |= {
    "boolean": "u1", "byte": "i1", "ubyte": "u1", "single": "f4", "unsigned": "u4", "size_t": "u8",
    "int8_t": "i1", "int16_t": "i2", "int32_t": "i4", "int64_t": "i8",
    "uint8_t": "u1", "uint16_t": "u2", "uint32_t": "u4", "uint64_t": "u8",
}  # fmt: skip


@dataclass(frozen=True)
class Property:
    """A property of an element's rows: a number, or a list of them. Raises InputError for unknown types."""

    name: str
    type: str  # as the file spells it
    length_type: str | None = None  # of a list

    def __post_init__(self) -> None:
        for name in (self.type, self.length_type or self.type):
            if name not in TYPES:
                raise unknown_name("PLY property type", name[:_LONGEST_WORD], _KNOWN)
        if TYPES[self.length_type or "int"][0] == "f":
            raise InputError(
                f"the length of the list '{self.name[:_LONGEST_WORD]}' is of type {self.length_type}, not "
                "of a whole-number type"
            )

    @property
    def line(self) -> str:
        """The line of the header that declares it."""
        kind = self.type if self.length_type is None else f"list {self.length_type} {self.type}"
        return f"property {kind} {self.name}"


@dataclass(frozen=True)
class Element:
    """An element of a PLY file: so many rows of the same properties."""

    name: str
    count: int
    properties: list[Property] = field(default_factory=list)

    @property
    def has_lists(self) -> bool:
        """Whether rows have no fixed size."""
        return any(p.length_type for p in self.properties)

    @property
    def numbers(self) -> list[Property]:
        """The properties that are no lists."""
        return [p for p in self.properties if not p.length_type]

    @property
    def layout(self) -> Layout:
        """The layout of a row with lists, property by property."""
        of_items = [np.dtype(TYPES[p.type]).itemsize for p in self.properties]
        of_lengths = [
            np.dtype(TYPES[p.length_type]).itemsize if p.length_type else 0 for p in self.properties
        ]
        signed = [TYPES[p.length_type or p.type][0] == "i" for p in self.properties]
        return Layout(np.array(of_items), np.array(of_lengths), np.array(signed))

    def dtype(self, endian: str) -> np.dtype:
        """One row without its lists; fields go by number, since names may repeat."""
        return np.dtype([(str(i), endian + TYPES[p.type]) for i, p in enumerate(self.numbers)])


class Layout(NamedTuple):
    """The layout of a binary row, property by property.

    sizes: (P,), bytes of the number, or of each in its list. lengths: (P,), bytes of the length in front of
    the list, 0: no list. signed: (P,), whether that length may be negative.
    """

    sizes: NDArray[np.int64]
    lengths: NDArray[np.int64]
    signed: NDArray[np.bool_]

    @property
    def least(self) -> int:
        """Bytes of a row with empty lists."""
        return int(self.lengths.sum()) + self.width

    @property
    def width(self) -> int:
        """Bytes of a row without its lists."""
        return int(self.sizes[self.lengths == 0].sum())


@dataclass(frozen=True)
class PlyHeader:
    """The header of a PLY file: its encoding and elements, in the file's order."""

    encoding: str
    elements: list[Element]
    odd_lines: list[str]  # that mean nothing to us
    remarks: tuple[str, ...]  # comments and obj_info, without these words
    size: int  # bytes


def parse_header(head: bytes) -> PlyHeader:
    """The header that a file begins with, perhaps behind a byte-order mark. Raises InputError."""
    check_encoding(head, "PLY")
    mark = len(BOM_UTF8) if head.startswith(BOM_UTF8) else 0
    head = head[mark:]
    end = re.search(rb"\nend_header[ \t\r]*(\n|\Z)", head)
    if not re.match(rb"ply\s", head) or end is None:
        raise InputError("is not a PLY file: it does not start with 'ply' or has no 'end_header'")
    encoding, elements, odd_lines = "", [], []
    remarks: list[str] = []
    for line in head[: end.start()].decode("utf-8", "replace").splitlines()[1:]:
        match line.split():
            case ["format", encoding, *_]:
                if encoding not in ENDIAN:
                    raise unknown_name("PLY format", encoding[:_LONGEST_WORD], list(ENDIAN))
            case ["element", name, count]:
                elements.append(_element(name, count))
            case ["comment" | "obj_info", *words]:
                remarks.append(" ".join(words))
            case []:
                pass
            case words:
                declared = _property(words) if elements else None
                if declared is None:
                    odd_lines.append(line.strip())
                else:
                    elements[-1].properties.append(declared)
    for element in elements:
        check_count(len(element.properties), MOST_COLUMNS, "properties of an element")
    if not encoding:
        raise InputError("the PLY header has no format line")
    return PlyHeader(encoding, elements, odd_lines, tuple(remarks), mark + end.end())


def _element(name: str, count: str) -> Element:
    if not count.isdecimal() or len(count) > _LONGEST_WORD:
        raise InputError(
            f"the header states '{count[:_LONGEST_WORD]}' rows of {name}, which is not a usable number"
        )
    return Element(name, int(count))


def _property(words: list[str]) -> Property | None:
    """The property that a line declares, None if it declares none."""
    match words:
        case ["property", "list", length_type, type_, name]:
            return Property(name, type_, length_type)
        case ["property", type_, name]:
            return Property(name, type_)
        case [type_, name] if type_ in TYPES:  # some exporters forget the word
            return Property(name, type_)
    return None


def header_text(encoding: str, elements: list[Element]) -> bytes:
    """A header for such elements, as it stands in a file."""
    lines = ["ply", f"format {encoding} 1.0"]
    for element in elements:
        lines += [f"element {element.name} {element.count}", *(p.line for p in element.properties)]
    return "\n".join([*lines, "end_header\n"]).encode()


def negative_list(where: str) -> InputError:
    """The error for a list of a negative length; where: for example "row 3 of vertex"."""
    return InputError(f"{where} has a list of a negative length")

"""The faces of PLY files, in pieces: rows with a list of corners, whatever else is in them."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from itertools import islice
from typing import BinaryIO, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...task import checkpoint
from ..admission import too_few
from ..faces import Faces
from ..reading.numbers import value
from ._columns import batches, text_lines, whole_numbers
from ._ply_header import ENDIAN, TYPES, Element, negative_list

_LISTS = ("vertex_indices", "vertex_index")  # what files call the corners
_ROWS_AT_ONCE = 1 << 12
_BYTES_AT_ONCE = 1 << 20


def face_rows(stream: BinaryIO, element: Element, encoding: str) -> Iterator[Faces]:
    """The faces of a stream that stands before them, in pieces.

    Raises InputError where no list is one of corners, and where rows are missing or damaged, or ValueError.
    """
    lists = {p.name: number for number, p in enumerate(element.properties) if p.length_type}
    corners = next((lists[name] for name in _LISTS if name in lists), None)
    if corners is None:
        raise InputError("the faces refer to no vertices")
    for row in property_rows(stream, element, encoding, corners):
        yield Faces.of(row.values, row.sizes)


class PropertyRows(NamedTuple):
    """Values of a property, row after row, and how many each row has."""

    values: NDArray
    sizes: NDArray[np.integer]


def property_rows(stream: BinaryIO, element: Element, encoding: str, number: int) -> Iterator[PropertyRows]:
    """The values of one property, by its number, of a stream that stands before the rows, in pieces.

    Raises InputError where rows are missing or damaged, or ValueError.
    """
    left = element.count
    pieces = _from_text(stream, element, number)
    if encoding != "ascii":
        pieces = _from_bytes(stream, element, number, ENDIAN[encoding])
    for piece in pieces:
        checkpoint(1 - left / element.count)
        left -= len(piece.sizes)
        yield piece
    if left:
        raise too_few(element.count - left, element.count, "faces")


def _from_text(stream: BinaryIO, element: Element, number: int) -> Iterator[PropertyRows]:
    wanted = element.properties[number]
    is_whole = wanted.name in _LISTS or TYPES[wanted.type][0] != "f"

    def words(line: str) -> list[str]:
        row, at = line.split(), 0
        for p in element.properties[:number]:
            at += 1 + (int(row[at]) if p.length_type else 0)
        begin, end = (at + 1, at + 1 + int(row[at])) if wanted.length_type else (at, at + 1)
        if not begin <= end <= len(row):
            raise InputError("the data end in the middle of a face")
        return row[begin:end]

    lines = islice(filter(str.strip, text_lines(stream)), min(element.count, sys.maxsize))
    for rows in batches(map(words, lines), _ROWS_AT_ONCE):
        if is_whole:
            yield PropertyRows(*whole_numbers(rows))
        else:
            numbers = [value(word, "," if "," in word else ".") for row in rows for word in row]
            yield PropertyRows(np.array(numbers, np.float64), np.array([len(row) for row in rows]))


def _from_bytes(stream: BinaryIO, element: Element, number: int, endian: str) -> Iterator[PropertyRows]:
    data, left = b"", element.count
    while left:
        part = stream.read(max(_BYTES_AT_ONCE, len(data)))  # a polygon may be longer than a piece
        data += part
        piece, size = _alike(data, element, number, endian, left) or _unlike(
            data, element, number, endian, left
        )
        if not (part or len(piece.sizes)):
            return
        yield piece
        data, left = data[size:], left - len(piece.sizes)


def _alike(
    data: bytes, element: Element, wanted: int, endian: str, most: int
) -> tuple[PropertyRows, int] | None:
    """Whole rows at the beginning of the data, and their bytes; None where their lists differ in length."""
    fields: list[tuple[str, np.dtype, tuple[int, ...]]] = []
    at = 0
    for number, p in enumerate(element.properties):
        count = 1
        if p.length_type:
            of_length = np.dtype(endian + TYPES[p.length_type])
            if at + of_length.itemsize > len(data):
                return None
            count = int(np.frombuffer(data, of_length, 1, at)[0])
            fields.append((f"length {number}", of_length, ()))
            at += of_length.itemsize
        item = np.dtype(endian + TYPES[p.type])
        at += count * item.itemsize
        if not 0 <= count <= at <= len(data):
            return None
        fields.append((str(number), item, (count,)))
    row = np.dtype(fields)
    rows = np.frombuffer(data, row, min(most, len(data) // row.itemsize))
    lengths = [rows[name] for name, *_ in fields if name.startswith("length")]
    if any((each != each[0]).any() for each in lengths):
        return None
    values = rows[str(wanted)]
    return PropertyRows(values.ravel(), np.full(len(rows), values.shape[1], np.uint32)), rows.nbytes


def _unlike(data: bytes, element: Element, wanted: int, endian: str, most: int) -> tuple[PropertyRows, int]:
    """Whole rows at the beginning of the data, and their bytes."""
    from ._ply_kernels import pack_rows

    layout = element.layout
    packed = np.empty(len(data), np.uint8)
    sizes = np.empty(min(most, len(data) // layout.least), np.uint32)
    rows, size, filled, is_negative = pack_rows(
        np.frombuffer(data, np.uint8), layout, endian == ">", wanted, packed, sizes
    )
    if is_negative and not rows:
        raise negative_list("a face")
    item = np.dtype(endian + TYPES[element.properties[wanted].type])
    return PropertyRows(packed[:filled].view(item), sizes[:rows]), size

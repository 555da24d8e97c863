"""PLY: the Stanford polygon file format; its vertices are the points, its faces tell the topology.

Vertices of plain numbers that come first in the file, as nearly always, are read straight into
numpy. What is rare (vertices with lists, or behind other elements) goes through plyfile.
"""

from __future__ import annotations

import io
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

import numpy as np

from ...errors import InputError, unknown_name
from ..points import PointCloud
from ._columns import (
    Columns,
    cloud_from_columns,
    columns_from_cloud,
    declared,
    parse_table,
    records,
    text_lines,
)
from ._faces import with_faces

TITLE = "PLY"
SUFFIXES = (".ply",)

_HEADER_LIMIT = 1 << 20  # bytes looked at for the header
_CHUNK = 1 << 20  # bytes of faces held at a time
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
                raise unknown_name("PLY property type", name, list(_TYPES))

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

    def dtype(self, endian: str) -> np.dtype:
        """One row; of a list, its length."""
        return np.dtype([(p.name, endian + _TYPES[p.length_type or p.type]) for p in self.properties])


@dataclass(frozen=True)
class _Header:
    encoding: str
    elements: list[_Element]
    odd_lines: list[str]  # that mean nothing to us
    size: int  # bytes


def read(path: Path, frame: int = 0) -> PointCloud:
    """The vertices of a PLY file, ascii or binary. Raises InputError."""
    with open(path, "rb") as stream:
        header = _read_header(stream.read(_HEADER_LIMIT))
        names = [element.name for element in header.elements]
        if "vertex" not in names:
            raise InputError(f"has no vertex element, only: {', '.join(names) or 'none'}")
        elements = header.elements[: names.index("vertex") + 1]
        vertex = elements[-1]
        if not vertex.count:
            raise InputError("holds no vertices")
        if not {"x", "y", "z"} <= {p.name.lower() for p in vertex.properties} and header.odd_lines:
            raise InputError(f"no x, y and z: the header line '{header.odd_lines[0]}' says nothing in PLY")
        stream.seek(header.size)
        plain = not vertex.has_lists and not any(element.count for element in elements[:-1])
        size = path.stat().st_size - header.size
        if not plain:
            columns = _read_with_plyfile(stream, header.encoding, elements, size)
        elif header.encoding == "ascii":
            columns = _read_ascii(stream, vertex)
        else:
            columns = _read_binary(stream, vertex, header.encoding, size)
        cloud = cloud_from_columns(columns)
        has_faces = any(element.name == "face" and element.count for element in header.elements)
        if plain and has_faces:  # all behind the vertices
            cloud = with_faces(cloud, iter(lambda: stream.read(_CHUNK), b""))
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
                    raise unknown_name("PLY format", encoding, list(_ENDIAN))
            case ["element", name, count]:
                if not count.isdecimal():
                    raise InputError(f"the header promises '{count}' rows of {name}")
                elements.append(_Element(name, int(count)))
            case ["property", "list", length_type, type_, name] if elements:
                elements[-1].properties.append(_Property(name, type_, length_type))
            case ["property", type_, name] if elements:
                elements[-1].properties.append(_Property(name, type_))
            case ["comment" | "obj_info", *_] | []:
                pass
            case _:
                odd_lines.append(line.strip())
    if not encoding:
        raise InputError("the PLY header has no format line")
    return _Header(encoding, elements, odd_lines, end.end())


def _header_text(encoding: str, elements: list[_Element]) -> bytes:
    lines = ["ply", f"format {encoding} 1.0"]
    for element in elements:
        lines += [f"element {element.name} {element.count}", *(p.line for p in element.properties)]
    return "\n".join([*lines, "end_header\n"]).encode()


def _read_ascii(stream: BinaryIO, vertex: _Element) -> Columns:
    width = len(vertex.properties)
    table = parse_table(text_lines(stream), rows=vertex.count)
    if len(table) < vertex.count:
        raise _too_few(len(table), vertex.count)
    if table.shape[1] < width:
        raise InputError(f"its rows hold {table.shape[1]} values, the header promises {width}")
    columns = {p.name: column for p, column in zip(vertex.properties, table.T, strict=False)}
    return declared(columns, {p.name: _TYPES[p.type] for p in vertex.properties})


def _read_binary(stream: BinaryIO, vertex: _Element, encoding: str, size: int) -> Columns:
    """size: bytes behind the header, so that nothing is allocated that the file does not hold."""
    dtype = vertex.dtype(_ENDIAN[encoding])
    if vertex.count * dtype.itemsize > size:
        raise _too_few(size // dtype.itemsize, vertex.count)
    rows = np.fromfile(stream, dtype, vertex.count)
    return {name: rows[name] for name in dtype.names or ()}


def _read_with_plyfile(stream: BinaryIO, encoding: str, elements: list[_Element], size: int) -> Columns:
    """Read rare forms; plyfile sees a clean header and no element behind the vertices.

    size: bytes behind the header; plyfile allocates what the header promises, so it is checked first.
    """
    from plyfile import PlyData

    for element in elements:
        # A value of text takes at least a digit and a blank.
        row = max(1, 2 * len(element.properties) if encoding == "ascii" else element.dtype("").itemsize)
        if element.count * row > size + 1:
            raise InputError(f"promises {element.count} rows of {element.name}, more than {size} bytes hold")
    body = io.BytesIO(_header_text(encoding, elements) + stream.read())
    rows = PlyData.read(body, mmap=False)["vertex"].data
    return {p.name: rows[p.name] for p in elements[-1].properties if p.length_type is None}


def _too_few(held: int, promised: int) -> InputError:
    return InputError(f"holds {held} of the {promised} vertices that its header promises")

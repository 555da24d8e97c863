"""PLY: the Stanford polygon file format; its vertices are the points, its faces define the topology.

Vertices of plain numbers that come first in the file, as nearly always, are read straight into numpy. Rows
with lists are walked, since only the lengths in them tell where the next one begins; the lists are left out.
"""

from __future__ import annotations

import math
import os
import re
import sys
from array import array
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import BinaryIO, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...errors import EmptyFrame, InputError
from ...task import checkpoint
from ..admission import admit, opened, read_exactly, read_records, size_of, too_few, whole_number
from ..contents import PointContents, Stated, TextureContents
from ..faces import Faces
from ..points import PointCloud
from ..reading.cloud import assemble, listed
from ..reading.columns import has_positions, unit_in_names
from ..reading.numbers import value
from ..reading.sequence import Decided
from ..texture import TexturedMesh
from ._columns import (
    Columns,
    columns_from_cloud,
    declared,
    named,
    parse_table,
    records,
    text_lines,
)
from ._ply_faces import face_rows
from ._ply_header import (
    ENDIAN,
    LONGEST_HEADER,
    TYPES,
    Element,
    PlyHeader,
    Property,
    header_text,
    negative_list,
    parse_header,
)
from ._ply_textures import in_materials, materials_of, mesh_at_faces, mesh_at_vertices, positions_of
from ._topology import topology_of

TITLE = "PLY"
SUFFIXES = (".ply",)

_ROWS_AT_ONCE = 1 << 12  # of text
_NORMALS = {"nx", "ny", "nz"}
_GRID, _CELL_BYTES = "range_grid", 64  # bytes of memory for a cell of it


def contents(path: Path, frame: int = 0, decided: Decided | None = None) -> PointContents:
    """The vertices of a PLY file, ascii or binary, its texture and its remarks. Raises InputError."""
    with opened(path) as stream:
        header = parse_header(stream.read(LONGEST_HEADER))
        names = [element.name for element in header.elements]
        if "vertex" not in names:
            raise InputError(f"has no vertex element, only: {listed(names)}")
        before, vertex = header.elements[: names.index("vertex")], header.elements[names.index("vertex")]
        if not vertex.count:
            raise EmptyFrame("holds no vertices")
        properties = [p.name for p in vertex.numbers]
        if not has_positions(properties):
            odd, found = header.odd_lines, listed(properties)
            reason = f": PLY has no header line '{odd[0]}'" if odd else f" among the columns: {found}"
            raise InputError(f"no x, y and z{reason}")
        if len(names) == 1 and header.encoding != "ascii":
            vertex = _as_stored(vertex, size_of(stream) - header.size)
        stream.seek(header.size)
        for element in before:
            _skip(stream, element, header.encoding)
        if header.encoding == "ascii":
            columns = _read_ascii(stream, vertex, decided)
        else:
            columns = _read_binary(stream, vertex, header.encoding)
        passed, materials = len(before) + 1, materials_of(header.remarks, path.parent)
        if materials:
            mesh = _textured_mesh(stream, header, passed, columns, decided or Decided())
        else:
            mesh = _Mesh(topology_of(vertex.count, _faces(stream, header, passed)), None)
        texture = None
        if mesh.textured is not None:
            textured = in_materials(mesh.textured, len(materials))
            texture = TextureContents(mesh=textured, materials=materials)
        return PointContents(
            columns=columns,
            stated=Stated(unit=unit_in_names(properties)),
            remarks=header.remarks,
            topology=mesh.topology,
            texture=texture,
        )


class _Mesh(NamedTuple):
    """The topology of a file, and its faces with their positions in pictures; None where it has none."""

    topology: str | None
    textured: TexturedMesh | None


def _textured_mesh(
    stream: BinaryIO, header: PlyHeader, passed: int, columns: Columns, decided: Decided
) -> _Mesh:
    """The faces with positions in pictures, from a stream that stands behind so many elements.

    Those of an earlier frame where the bytes of both are the same. Takes the positions of vertices from the
    columns.
    """
    names, start = positions_of(columns), stream.tell()
    uv = np.stack([np.asarray(columns.pop(name), np.float64) for name in names], axis=1) if names else None
    number = next((columns.pop(name) for name in [*columns] if name.lower() == "texnumber"), None)
    count = len(next(iter(columns.values())))
    at_vertices = [part.tobytes() for part in (uv, number) if part is not None]
    rest = stream.read() if decided.frames > 1 else b""
    stream.seek(start)

    def make() -> _Mesh:
        faces = Faces.joined([])
        with suppress(InputError, ValueError, IndexError, OverflowError):  # damaged faces cost no point
            if (mesh := _mesh_at_faces(stream, header, passed)) is not None:
                faces = Faces.of(mesh.vertices, mesh.sizes)
                return _Mesh(topology_of(count, [faces]), mesh)
            stream.seek(start)
            faces = Faces.joined(_faces(stream, header, passed))
        mesh = None if uv is None else mesh_at_vertices(faces, uv, number)
        return _Mesh(topology_of(count, [faces]), mesh)

    found = decided.shared("ply", (header.elements, at_vertices, rest), make)
    return found


def _mesh_at_faces(stream: BinaryIO, header: PlyHeader, passed: int) -> TexturedMesh | None:
    """The faces with positions at their corners, from a stream that stands behind so many elements."""
    at = _seek_rows(stream, header, passed, "face")
    return None if at is None else mesh_at_faces(stream, header.elements[at], header.encoding)


def column_names(path: Path) -> list[str]:
    """The names of the properties of a vertex. Raises InputError."""
    with opened(path) as stream:
        header = parse_header(stream.read(LONGEST_HEADER))
    return [p.name for element in header.elements if element.name == "vertex" for p in element.numbers]


def _as_stored(vertex: Element, held: int) -> Element:
    """The vertices without normals, where a file of vertices alone holds exactly that many bytes: exporters
    that forget the word `property` also declare normals that they do not store."""
    stored = replace(vertex, properties=[p for p in vertex.properties if p.name not in _NORMALS])
    if vertex.has_lists or held >= vertex.count * vertex.layout.width:
        return vertex
    return stored if held == vertex.count * stored.layout.width else vertex


def read_faces(path: Path, frame: int = 0) -> Iterator[Faces]:
    """The faces of a PLY file, in pieces. Raises InputError or ValueError where they cannot be used."""
    with opened(path) as stream:
        header = parse_header(stream.read(LONGEST_HEADER))
        stream.seek(header.size)
        yield from _faces(stream, header)


def read_range_grid(path: Path) -> NDArray[np.float64]:
    """The points of a range grid, (rows, columns, 3), NaN where the grid has none. Raises InputError.

    So Stanford's scans are stored: the element `range_grid` has a list for each cell of the grid, with one
    vertex or none, and remarks of the header tell how many rows and columns there are.
    """
    with opened(path) as stream:
        head = stream.read(LONGEST_HEADER)
        header = parse_header(head)
        sizes = [int(size) for name in (b"rows", b"cols") for size in _grid_sizes(head[: header.size], name)]
        cells = sum(element.count for element in header.elements if element.name == _GRID)
        if len(sizes) != 2 or not cells or math.prod(sizes) != cells:
            found = " x ".join(map(str, sizes)) or "no size"
            raise InputError(
                f"its range grid is damaged: it has {cells} cells, but the header states a size of {found}"
            )
        admit(size_of(stream), cells * _CELL_BYTES)
        stream.seek(header.size)
        lists = Faces.joined(_faces(stream, header, of=_GRID))
    cloud = assemble(contents(path), Decided())
    points = np.full((len(cloud) + cloud.dropped, 3), np.nan)
    points[slice(None) if cloud.ids is None else cloud.ids] = cloud.world()
    if lists.sizes.max() > 1 or (lists.corners >= len(points)).any():
        raise InputError(
            "the range grid has several vertices in one cell, or names a vertex that does not exist"
        )
    grid = np.full((cells, 3), np.nan)
    grid[lists.sizes == 1] = points[lists.corners]
    return grid.reshape(*sizes, 3)


def _grid_sizes(head: bytes, name: bytes) -> list[bytes]:
    return re.findall(rb"\nobj_info num_%b ([0-9]{1,9})\s" % name, head)


def _faces(stream: BinaryIO, header: PlyHeader, passed: int = 0, of: str = "face") -> Iterator[Faces]:
    """The faces, from a stream that stands behind so many elements. of: the element that has them."""
    at = _seek_rows(stream, header, passed, of)
    if at is not None:
        yield from face_rows(stream, header.elements[at], header.encoding)


def _seek_rows(stream: BinaryIO, header: PlyHeader, passed: int, of: str) -> int | None:
    """Go on to the rows of an element, from behind so many; return its number, None where it has no rows."""
    names = [element.name for element in header.elements]
    at = names.index(of) if of in names else -1
    if at < 0 or not header.elements[at].count:
        return None
    if at < passed:
        stream.seek(header.size)
        passed = 0
    for element in header.elements[passed:at]:
        _skip(stream, element, header.encoding)
    return at


def write(path: Path, cloud: PointCloud) -> None:
    """Write a binary little-endian PLY; whole numbers of 64 bit become double."""
    columns = {
        name: column.astype("f8") if column.dtype.kind in "iu" and column.itemsize == 8 else column
        for name, column in columns_from_cloud(cloud).items()
    }
    spelling = {code: name for name, code in reversed(TYPES.items())}
    properties = [Property(name, spelling[column.dtype.str[1:]]) for name, column in columns.items()]
    with open(path, "wb") as stream:
        stream.write(header_text("binary_little_endian", [Element("vertex", len(cloud), properties)]))
        records(columns).tofile(stream)


def _skip(stream: BinaryIO, element: Element, encoding: str) -> None:
    """Go on behind the rows of an element. Raises InputError where there are fewer."""
    if not (element.count and element.properties):
        return
    if encoding == "ascii":
        held = sum(1 for _ in _filled_lines(stream, element))
    elif element.has_lists:
        held = len(_walk_bytes(stream, element, encoding))
    else:
        size = element.dtype("").itemsize
        held = min(element.count, (size_of(stream) - stream.tell()) // size)
        stream.seek(held * size, os.SEEK_CUR)
    if held < element.count:
        raise too_few(held, element.count, _rows_of(element))


def _rows_of(element: Element) -> str:
    """The rows of an element as messages call them."""
    return "vertices" if element.name == "vertex" else f"rows of {element.name}"


def _filled_lines(stream: BinaryIO, element: Element) -> Iterator[str]:
    """The lines of the rows of an element, as far as there are that many."""
    return islice(filter(str.strip, text_lines(stream)), min(element.count, sys.maxsize))


def _read_ascii(stream: BinaryIO, element: Element, decided: Decided | None) -> Columns:
    if element.has_lists:
        table = _walk_lines(_filled_lines(stream, element), element)
    else:
        table = parse_table(text_lines(stream), element.count, decided)
        if len(table) and table.shape[1] < len(element.properties):
            promised = len(element.properties)
            raise InputError(f"the rows have {table.shape[1]} values, but the header states {promised}")
    if len(table) < element.count:
        raise too_few(len(table), element.count, _rows_of(element))
    return named(
        (p.name, declared(p.name, column, TYPES[p.type]))
        for p, column in zip(element.numbers, table.T, strict=False)
    )


def _walk_lines(lines: Iterable[str], element: Element) -> NDArray[np.float64]:
    """The numbers of each row that are in no list, (N, C); a row a line."""
    values, rows = array("d"), 0
    for row, line in enumerate(lines):
        if row % _ROWS_AT_ONCE == 0:
            checkpoint(row / element.count)
        words, at = line.split(), 0
        for p in element.properties:
            if at >= len(words):
                raise InputError(f"row {row} of {element.name} ends before its {p.name}")
            if p.length_type:
                length = whole_number(words[at], f"the length of {p.name} in row {row} of {element.name}")
                if length < 0:
                    raise negative_list(f"row {row} of {element.name}")
                at += 1 + length
            else:
                values.append(value(words[at], "," if "," in words[at] else "."))
                at += 1
        if at > len(words):
            raise InputError(f"row {row} of {element.name} ends within a list")
        rows += 1
    return np.frombuffer(values, np.float64).reshape(rows, len(element.numbers))


def _read_binary(stream: BinaryIO, element: Element, encoding: str) -> Columns:
    dtype = element.dtype(ENDIAN[encoding])
    if not element.has_lists:
        rows = read_records(stream, dtype, element.count, _rows_of(element))
    else:
        packed = _walk_bytes(stream, element, encoding)
        rows = packed.view(dtype)[:, 0] if element.numbers else packed
    return named((p.name, rows[str(i)]) for i, p in enumerate(element.numbers))


def _walk_bytes(stream: BinaryIO, element: Element, encoding: str) -> NDArray[np.uint8]:
    """The bytes of each row but those of its lists, (N, bytes)."""
    from ._ply_kernels import pack_rows

    layout = element.layout
    start, held = stream.tell(), size_of(stream) - stream.tell()
    if element.count * layout.least > held:
        raise too_few(held // layout.least, element.count, _rows_of(element))
    data = np.frombuffer(read_exactly(stream, held), np.uint8)
    packed = np.empty(element.count * layout.width, np.uint8)
    lengths = np.empty(element.count, np.uint32)
    is_big = encoding == "binary_big_endian"
    rows, size, _, is_negative = pack_rows(data, layout, is_big, -1, packed, lengths)
    if is_negative:
        raise negative_list(f"row {rows} of {element.name}")
    if rows < element.count:
        raise too_few(rows, element.count, _rows_of(element))
    stream.seek(start + size)
    return packed.reshape(element.count, layout.width)

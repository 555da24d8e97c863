"""OBJ: Wavefront's mesh format; its vertices are the points, with the common colour extension, and its
faces tell the topology. Materials with pictures give the vertices their colours.

Read here and not by a library because those at hand drop vertices that no triangle uses. In a sequence,
frames often have the same faces: these are compared as bytes, and parsed once.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ..admission import admit, opened, read_exactly, size_of
from ..contents import Material, PointContents, TextureContents
from ..faces import Faces
from ..reading import numbers
from ..reading.numbers import PLAIN, Dialect
from ..reading.sequence import Decided
from ..texture import TexturedMesh
from ._columns import batches
from ._mtl import file_beside, read_materials
from ._obj_lines import FaceRows, Keyword, ObjLines
from ._topology import topology_of

TITLE = "OBJ"
SUFFIXES = (".obj",)

_ROWS_AT_ONCE = 1 << 14
_HEAD = 1 << 16  # bytes that tell the encoding
_VERTICES_LOOKED_AT = 200
_LOOK = 3000  # face corners that tell whether normals and vertices are numbered alike
_REMARKS = 1000  # comments that are looked at
# Numbers of a vertex -> where its red, green and blue begin; 4, 7 and 8 numbers have a weight behind z.
_COLORS_AT = {6: 3, 7: 4, 8: 4}
_MOST_NUMBERS = 8
_WITH_LINES = 4  # times the bytes of the file: with its lines and numbers
_JOINING = 4  # times the bytes of corners: in pieces, joined, and as a mesh
_PICTURES = (".jpg", ".jpeg", ".png", ".bmp", ".tif", ".tiff", ".tga")


def contents(path: Path, frame: int = 0, decided: Decided | None = None) -> PointContents:
    """The vertices (`v x y z [w] [r g b]`), their normals (`vn`) and textures. Raises InputError."""
    decided = decided or Decided()
    with opened(path) as stream:
        lines = _lines(stream, decided.frames)
        lines.dialect = _dialect_of_vertices(lines, decided)
        positions, colors = _vertices(lines, decided)
        columns = dict(zip("xyz", positions.T, strict=True))
        materials = _materials(lines, path, decided)
        picture = None if materials else _picture_of_name(lines, path)
        if picture is not None:
            materials = {"": Material(image=picture)}
        mesh = _shared_mesh(lines, len(positions), bool(materials), size_of(stream), decided)
        normals = _normals(lines, mesh.normals, len(positions))
        if normals is not None:
            columns |= dict(zip(("nx", "ny", "nz"), normals.T, strict=True))
        if colors is not None:
            columns |= dict(zip(("red", "green", "blue"), colors.T, strict=True))
        return PointContents(
            columns=columns,
            remarks=tuple(_remarks(lines)),
            topology=mesh.topology,
            texture=_texture(lines, mesh.textured, materials, picture is None),
        )


def read_faces(path: Path, frame: int = 0) -> Iterator[Faces]:
    """The faces of an OBJ file, in pieces. Raises InputError or ValueError where they cannot be used."""
    with opened(path) as stream:
        yield from map(_vertices_of, _lines(stream).faces())


def _lines(stream: BinaryIO, frames: int = 1) -> ObjLines:
    held = size_of(stream)
    admit(held, _WITH_LINES * held)
    data = read_exactly(stream, held)
    encoding = numbers.encoding_of(data[:_HEAD])
    if encoding.startswith(("utf-16", "utf-32")):
        data = data.decode(encoding, "replace").encode()
    return ObjLines(data, held * frames)


def _dialect_of_vertices(lines: ObjLines, decided: Decided) -> Dialect:
    """How the numbers of the vertices are written; the decimal mark is put into the record."""
    head = [*islice(lines.texts(Keyword.VERTEX), _VERTICES_LOOKED_AT)]
    stated = decided.corrections.get("decimal")
    is_plain = stated is None and not any("," in line for line in head)
    dialect = PLAIN if is_plain else numbers.dialect_of(head, PLAIN.separator, stated)
    if head:
        _, decimal = dialect.decisions(decided.corrections)
        decided.note(decimal)
    return dialect


def _vertices_of(rows: FaceRows) -> Faces:
    return Faces.of(rows.corners[:, 0], rows.sizes)


def _remarks(lines: ObjLines) -> Iterator[str]:
    """The first comments of the file."""
    for _, line in zip(range(_REMARKS), lines.others(b"#"), strict=False):
        yield line.lstrip("# ")


def _vertices(lines: ObjLines, decided: Decided) -> tuple[NDArray[np.float64], NDArray[np.float64] | None]:
    """Positions and colours, (N, 3) each; None where no vertex has a colour. Those without one are white."""
    try:
        table = lines.table(Keyword.VERTEX)
    except InputError:  # as a rule, since some vertices have colours and others have none
        table = _uneven_rows(lines)
    if table.shape[1] < 3:
        raise InputError(_bad_width(table.shape[1]))
    if (at := _COLORS_AT.get(table.shape[1])) is None:
        if table.shape[1] > 4:
            decided.note_unused(f"numbers 4 to {table.shape[1]} of each vertex")
        return table[:, :3], None
    if table.shape[1] == 7 and _is_opaque(table[:, 6]) and not _is_opaque(table[:, 3]):
        at = 3  # x y z r g b a
    colors = table[:, at : at + 3]
    if not (is_bare := np.isnan(colors).all(axis=1)).any():
        return table[:, :3], colors
    if is_bare.all():
        return table[:, :3], None
    colors = colors.copy()
    colors[is_bare] = 255 if np.nanmax(colors) > 1 else 1
    return table[:, :3], colors


def _is_opaque(column: NDArray[np.float64]) -> bool:
    """Whether a column is 1 everywhere, as weights and full opacity are."""
    return bool((column == 1).all())


def _uneven_rows(lines: ObjLines) -> NDArray[np.float64]:
    """Vertices of which some have colours: (N, 7) x y z w r g b, NaN where there is none."""
    parts = [np.empty((0, 7))]
    for texts in batches(lines.texts(Keyword.VERTEX), _ROWS_AT_ONCE):
        widths = np.array([len(text.split()) for text in texts])
        part = np.full((len(texts), 7), np.nan)
        for width in np.unique(widths):
            rows = np.flatnonzero(widths == width)
            found = numbers.parse_numbers((texts[row] for row in rows), dialect=lines.dialect)
            if len(found) != len(rows) or not 3 <= found.shape[1] <= _MOST_NUMBERS:
                raise InputError(_bad_width(int(width)))
            part[rows, :3] = found[:, :3]
            if (at := _COLORS_AT.get(found.shape[1])) is not None:
                part[rows, 4:] = found[:, at : at + 3]
        parts.append(part)
    return np.concatenate(parts)


def _bad_width(width: int) -> str:
    return f"a vertex has {width} numbers, expected 3, 4, 6, 7 or 8"


@dataclass(frozen=True, eq=False)
class _NormalCorners:
    """The normals of the vertices. vertices, normals: (C,), a pair for each corner with a normal.
    is_in_order: whether row k of the normals is that of vertex k."""

    vertices: NDArray[np.int64]
    normals: NDArray[np.int64]
    is_in_order: bool


@dataclass(frozen=True, eq=False)
class _Mesh:
    """Faces as the parts of the reader need them. textured: None where no material has a picture."""

    topology: str | None
    normals: _NormalCorners
    textured: TexturedMesh | None


def _shared_mesh(lines: ObjLines, count: int, has_materials: bool, held: int, decided: Decided) -> _Mesh:
    """The faces between `count` vertices; those of an earlier frame where the text of both is the same."""
    sizes = count, *map(lines.count, (Keyword.NORMAL, Keyword.UV)), has_materials
    groups = _groups(lines)
    key = sizes, lines.order, groups.tobytes(), lines.raw(Keyword.FACE), lines.raw(Keyword.UV)
    return decided.shared("obj", key, lambda: _mesh(lines, count, groups if has_materials else None, held))


def _mesh(lines: ObjLines, count: int, groups: NDArray[np.int64] | None, held: int) -> _Mesh:
    """groups: of each `usemtl`; None where no texture is wanted. held: bytes of the file."""
    needs_corners = groups is not None or lines.count(Keyword.NORMAL) > 0
    pieces: list[FaceRows] = []
    taken = 0

    def faces() -> Iterator[Faces]:
        nonlocal taken
        for rows in lines.faces():
            if needs_corners:
                pieces.append(rows)
                taken += _JOINING * rows.corners.nbytes
                admit(held, taken + _WITH_LINES * held)
            yield _vertices_of(rows)

    topology = topology_of(count, faces())
    none = FaceRows(np.empty((0, 3), np.int64), np.empty(0, np.int64), np.empty(0, np.int64))
    corners, sizes, at = (np.concatenate(parts) for parts in zip(none, *pieces, strict=True))
    textured = None
    if groups is not None and topology is not None:
        textured = _textured_mesh(lines, FaceRows(corners, sizes, at), groups)
    return _Mesh(topology, _normal_corners(lines, corners, count), textured)


def _textured_mesh(lines: ObjLines, faces: FaceRows, groups: NDArray[np.int64]) -> TexturedMesh:
    before = np.searchsorted(lines.lines_of(Keyword.MATERIAL), faces.lines)  # usemtl above each face
    return TexturedMesh(
        sizes=faces.sizes,
        vertices=faces.corners[:, 0].copy(),
        corners=faces.corners[:, 1].copy(),
        groups=groups[before],
        uv=lines.table(Keyword.UV, (0, 1)),
    )


def _group_names(lines: ObjLines) -> list[str]:
    """The names of the materials that faces have, each once, in the order of the file; "" above the first."""
    return list(dict.fromkeys(["", *(text.strip() for text in lines.texts(Keyword.MATERIAL))]))


def _groups(lines: ObjLines) -> NDArray[np.int64]:
    """The rows of `_group_names` that count above all lines with `usemtl`, and behind each, (M + 1,)."""
    number_of = {name: number for number, name in enumerate(_group_names(lines))}
    return np.array([0, *(number_of[text.strip()] for text in lines.texts(Keyword.MATERIAL))], np.int64)


def _normal_corners(lines: ObjLines, corners: NDArray[np.int64], count: int) -> _NormalCorners:
    vertex, _, normal = corners[corners[:, 2] != -1].T
    normals = lines.count(Keyword.NORMAL)
    usable = (vertex >= 0) & (vertex < count) & (normal >= 0) & (normal < normals)
    is_in_order = normals == count and bool((vertex[:_LOOK] == normal[:_LOOK]).all())
    return _NormalCorners(vertex[usable], normal[usable], is_in_order)


def _normals(lines: ObjLines, of: _NormalCorners, count: int) -> NDArray[np.float64] | None:
    """A normal for each of `count` vertices, (count, 3), or None where not every vertex has one.

    They stand in the order of the vertices, or the faces tell; a vertex whose corners have several
    normals gets their mean.
    """
    if not lines.count(Keyword.NORMAL):
        return None
    normals = lines.table(Keyword.NORMAL, (0, 1, 2))
    if of.is_in_order and len(normals) == count:
        return normals
    usable = of.normals < len(normals)
    vertices, corners = of.vertices[usable], normals[of.normals[usable]]
    if not np.bincount(vertices, minlength=count).all() or not len(vertices):
        return None
    sums = np.stack([np.bincount(vertices, values, count) for values in corners.T], axis=1)
    return sums / np.maximum(np.linalg.norm(sums, axis=1, keepdims=True), np.finfo(np.float32).tiny)


def _texture(
    lines: ObjLines, mesh: TexturedMesh | None, materials: dict[str, Material], is_named: bool
) -> TextureContents | None:
    """The texture of the faces; None where no material has a picture."""
    if mesh is None or not materials:
        return None
    in_any_case = {name.casefold(): material for name, material in materials.items()}
    usual = next(iter(materials.values())) if len(materials) == 1 else Material()
    used = [materials.get(name) or in_any_case.get(name.casefold(), usual) for name in _group_names(lines)]
    return TextureContents(mesh=mesh, materials=tuple(used), is_named=is_named)


def _materials(lines: ObjLines, path: Path, decided: Decided) -> dict[str, Material]:
    """The materials of the files that `mtllib` names; {} where none of them has a picture."""
    found: dict[str, Material] = {}
    for line in lines.others(b"mtllib"):
        for name in _file_names(line[len("mtllib") :].strip("\"' \t"), path.parent):
            try:
                found |= read_materials(file_beside(path.parent, name))
            except (InputError, OSError, ValueError):
                decided.report("assumed", "Scan4D cannot read the material file that the OBJ file names")
    return found if any(material.image for material in found.values()) else {}


def _file_names(text: str, folder: Path) -> list[str]:
    """The names behind `mtllib`: one that may contain blanks, or several."""
    return [text] if text and file_beside(folder, text).is_file() else text.split()


def _picture_of_name(lines: ObjLines, path: Path) -> Path | None:
    """The picture beside a file with positions in a texture that has its name; None where there is none."""
    if not lines.count(Keyword.UV):
        return None
    beside = (file_beside(path.parent, path.stem + suffix) for suffix in _PICTURES)
    return next((file for file in beside if file.is_file()), None)

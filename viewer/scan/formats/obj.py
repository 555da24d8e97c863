"""OBJ: Wavefront's mesh format; its vertices are the points, with the common colour extension, and its
faces tell the topology. Materials with pictures give the vertices their colours.

Read here and not by a library because those at hand drop vertices that no triangle uses.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from io import TextIOWrapper
from itertools import islice
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ..admission import admit, opened
from ..contents import PointContents, TextureContents
from ..faces import Faces
from ..reading import numbers
from ..reading.numbers import PLAIN, Dialect
from ..reading.sequence import Decided
from ._columns import batches, bounded_lines, parse_table, whole_numbers
from ._mtl import Material, read_materials
from ._topology import topology_of

TITLE = "OBJ"
SUFFIXES = (".obj",)

_CORNERS_AT_ONCE = 1 << 18
_FACES_AT_ONCE = 1 << 12
_ROWS_AT_ONCE = 1 << 14
_VERTICES_LOOKED_AT = 200
_LOOK = 3000  # face corners that tell whether normals and vertices are numbered alike
_HEAD = 1 << 16  # characters in which `mtllib` stands
# Numbers of a vertex -> where its red, green and blue begin; 4, 7 and 8 numbers have a weight behind z.
_COLORS_AT = {6: 3, 7: 4, 8: 4}
_MOST_NUMBERS = 8
_JOINING = 3  # times the bytes of textured corners: in pieces, joined, and with their positions
_BLANKS = {" ", "\t"}


def contents(path: Path, frame: int, decided: Decided) -> PointContents:
    """The vertices (`v x y z [w] [r g b]`), their normals (`vn`) and textures. Raises InputError."""
    with opened(path) as stream:
        text = _text_of(stream)
        dialect = _dialect_of_vertices(text, decided)
        positions, colors = _vertices(text, dialect)
        columns = dict(zip("xyz", positions.T, strict=True))
        normals = _normals(text, len(positions))
        if normals is not None:
            columns |= dict(zip(("nx", "ny", "nz"), normals.T, strict=True))
        if colors is not None:
            columns |= dict(zip(("red", "green", "blue"), colors.T, strict=True))
        return PointContents(
            columns=columns,
            remarks=_remarks(text),
            topology=topology_of(len(positions), _faces(text)),
            texture=_texture(text, path),
        )


def read_faces(path: Path, frame: int = 0) -> Iterator[Faces]:
    """The faces of an OBJ file, in pieces. Raises InputError or ValueError where they cannot be used."""
    with opened(path) as stream:
        text = _text_of(stream)
        yield from _faces(text)


def _text_of(stream: BinaryIO) -> TextIOWrapper:
    """A file as text, which closes the stream when it goes. Names of other encodings stay as they are."""
    encoding = numbers.encoding_of(stream.read(_HEAD))
    stream.seek(0)
    return TextIOWrapper(stream, "utf-8-sig" if encoding == "cp1252" else encoding, errors="surrogateescape")


def _dialect_of_vertices(text: TextIOWrapper, decided: Decided) -> Dialect:
    """How the numbers of the vertices are written; the decimal mark is put into the record."""
    head = [*islice(_lines(text, "v"), _VERTICES_LOOKED_AT)]
    stated = decided.corrections.get("decimal")
    is_plain = stated is None and not any("," in line for line in head)
    dialect = PLAIN if is_plain else numbers.dialect_of(head, PLAIN.separator, stated)
    if head:
        _, decimal = dialect.decisions(decided.corrections)
        decided.note(decimal)
    return dialect


def _remarks(text: TextIOWrapper) -> tuple[str, ...]:
    """The comments at the beginning of the file."""
    text.seek(0)
    lines = text.read(_HEAD).splitlines()
    return tuple(line.lstrip("# ") for line in lines if line.startswith("#"))


def _vertices(
    text: TextIOWrapper, dialect: Dialect
) -> tuple[NDArray[np.float64], NDArray[np.float64] | None]:
    """Positions and colours, (N, 3) each; None where no vertex has a colour. Those without one are white."""
    try:
        table = numbers.parse_numbers(_lines(text, "v"), dialect=dialect)
    except InputError:  # as a rule, since some vertices have colours and others have none
        table = _uneven_rows(text, dialect)
    if table.shape[1] < 3:
        raise InputError(_bad_width(table.shape[1]))
    if (at := _COLORS_AT.get(table.shape[1])) is None:
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


def _uneven_rows(text: TextIOWrapper, dialect: Dialect) -> NDArray[np.float64]:
    """Vertices of which some have colours: (N, 7) x y z w r g b, NaN where there is none."""
    parts = [np.empty((0, 7))]
    for lines in batches(_lines(text, "v"), _ROWS_AT_ONCE):
        widths = np.array([len(line.split()) for line in lines])
        part = np.full((len(lines), 7), np.nan)
        for width in np.unique(widths):
            rows = np.flatnonzero(widths == width)
            found = numbers.parse_numbers((lines[row] for row in rows), dialect=dialect)
            if len(found) != len(rows) or not 3 <= found.shape[1] <= _MOST_NUMBERS:
                raise InputError(_bad_width(int(width)))
            part[rows, :3] = found[:, :3]
            if (at := _COLORS_AT.get(found.shape[1])) is not None:
                part[rows, 4:] = found[:, at : at + 3]
        parts.append(part)
    return np.concatenate(parts)


def _bad_width(width: int) -> str:
    return f"a vertex has {width} numbers, expected 3, 4, 6, 7 or 8"


def _faces(text: TextIOWrapper) -> Iterator[Faces]:
    for rows in batches(_polygons(text), _FACES_AT_ONCE):
        corners, sizes = whole_numbers([words for words, _ in rows])
        vertices = np.repeat([vertices for _, vertices in rows], sizes)
        yield Faces.of(np.where(corners < 0, corners + vertices, corners - 1), sizes)


def _polygons(text: TextIOWrapper) -> Iterator[tuple[list[str], int]]:
    """The vertices of each face as written, and how many there are so far: negative ones count back."""
    vertices = 0
    text.seek(0)
    for line in _unindented(text):
        if line.startswith(("v ", "v\t")):
            vertices += 1
        elif line.startswith(("f ", "f\t")):
            words = line.split()[1:]
            yield [word.partition("/")[0] for word in words] if "/" in line else words, vertices


def _normals(text: TextIOWrapper, count: int) -> NDArray[np.float64] | None:
    """A normal for each of `count` vertices, (count, 3), or None where not every vertex has one.

    They stand in the order of the vertices, or the faces tell; a vertex whose corners have several
    normals gets their mean.
    """
    normals = parse_table(_lines(text, "vn"), (0, 1, 2))
    if not len(normals):
        return None
    start = parse_table(islice(_corners(text), _LOOK), (0, 2), "/")
    if len(normals) == count and (start[:, 0] == start[:, 1]).all():
        return normals
    sizes = np.array([count, len(normals)])
    sums, corners_of = np.zeros((count, 3)), np.zeros(count, np.intp)
    all_corners = _corners(text)
    while len(corners := parse_table(islice(all_corners, _CORNERS_AT_ONCE), (0, 2), "/")):
        corners = np.where(corners < 0, corners + sizes, corners - 1)  # negative: counted from the end
        vertex, normal = corners[((corners >= 0) & (corners < sizes)).all(axis=1)].astype(np.intp).T
        np.add.at(sums, vertex, normals[normal])
        np.add.at(corners_of, vertex, 1)
    if not corners_of.all():
        return None
    return sums / np.maximum(np.linalg.norm(sums, axis=1, keepdims=True), np.finfo(np.float32).tiny)


def _texture(text: TextIOWrapper, path: Path) -> TextureContents | None:
    """The textures that the faces have, None where no material has a picture."""
    materials = _materials(text, path)
    if not any(material.image for material in materials.values()):
        return None
    uv = parse_table(_lines(text, "vt"), (0, 1))
    number_of = {name: number for number, name in enumerate(materials)}
    pieces, taken, held = [np.empty((0, 3), np.int64)], uv.nbytes, path.stat().st_size
    for rows in batches(_textured_polygons(text), _FACES_AT_ONCE):
        pieces.append(_textured(rows, number_of))
        taken += _JOINING * pieces[-1].nbytes
        admit(held, taken)
    vertices, corners, used = np.concatenate(pieces).T
    return TextureContents(
        images=tuple(material.image for material in materials.values()),
        colors=np.array([material.color for material in materials.values()], np.float64).reshape(-1, 3),
        uv=uv,
        vertices=vertices,
        corners=corners,
        materials=used,
    )


def _materials(text: TextIOWrapper, path: Path) -> dict[str, Material]:
    """The materials of the files that `mtllib` names. The name of the only one is also ""."""
    found: dict[str, Material] = {}
    text.seek(0)
    for line in text.read(_HEAD).splitlines():
        keyword, _, rest = line.strip().partition(" ")
        if keyword != "mtllib":
            continue
        names = [rest.strip()] if (path.parent / rest.strip()).is_file() else rest.split()
        for name in names:
            with suppress(InputError, OSError, ValueError):
                found |= read_materials(path.parent / name)
    if len(found) == 1:
        found[""] = next(iter(found.values()))
    return found


_Row = tuple[list[str], str, int, int]  # corners as written, the material, vertices and uv so far


def _textured_polygons(text: TextIOWrapper) -> Iterator[_Row]:
    vertices = positions = 0
    material = ""
    text.seek(0)
    for line in _unindented(text):
        if line.startswith(("v ", "v\t")):
            vertices += 1
        elif line.startswith(("vt ", "vt\t")):
            positions += 1
        elif line.startswith("usemtl"):
            material = line[len("usemtl") :].strip()
        elif line.startswith(("f ", "f\t")):
            yield line.split()[1:], material, vertices, positions


def _textured(rows: list[_Row], number_of: dict[str, int]) -> NDArray[np.int64]:
    """Vertex, row of uv and material of each corner, (C, 3); -1 where there is none."""
    words = [word for corners, *_ in rows for word in corners]
    sizes = [len(corners) for corners, *_ in rows]
    found = np.zeros((len(words), 3), np.int64)
    counts = {word.count("/") for word in words}
    if len(counts) == 1 and counts <= {1, 2} and not any("//" in word for word in words):
        stated, _ = whole_numbers([" ".join(words).replace("/", " ").split()])
        found[:, :2] = stated.reshape(len(words), -1)[:, :2]
    else:
        split = [word.split("/", 2) for word in words]
        found[:, 0] = [int(parts[0]) for parts in split]
        found[:, 1] = [int(parts[1]) if len(parts) > 1 and parts[1] else 0 for parts in split]
    found[:, 2] = np.repeat([number_of.get(material, -1) for _, material, _, _ in rows], sizes)
    so_far = np.repeat([(vertices, positions) for *_, vertices, positions in rows], sizes, axis=0)
    stated = found[:, :2]
    found[:, :2] = np.where(stated < 0, stated + so_far, stated - 1)
    return found


def _unindented(text: TextIOWrapper) -> Iterator[str]:
    """The lines from where the text stands, without blanks in front."""
    return (line.lstrip() if line[:1] in _BLANKS else line for line in bounded_lines(text))


def _lines(text: TextIOWrapper, keyword: str) -> Iterator[str]:
    """The rest of every line that starts with the keyword; from the beginning of the file."""
    starts = (keyword + " ", keyword + "\t")
    text.seek(0)
    for line in bounded_lines(text):
        if line.startswith(starts):
            yield line[len(keyword) :]
        elif line[:1] in _BLANKS and (inner := line.lstrip()).startswith(starts):
            yield inner[len(keyword) :]


def _corners(text: TextIOWrapper) -> Iterator[str]:
    """The face corners that name a normal: `vertex/[texture]/normal`."""
    for line in _lines(text, "f"):
        yield from (corner for corner in line.split() if corner.count("/") == 2)

"""OBJ: Wavefront's mesh format; its vertices are the points, with the common colour extension, and its
faces tell the topology.

Read here and not by a library because those at hand drop vertices that no triangle uses.
"""

from __future__ import annotations

from codecs import BOM_UTF8
from collections.abc import Iterator
from io import TextIOWrapper
from itertools import islice
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..admission import opened
from ..contents import Deferred
from ..faces import Faces
from ..points import PointCloud
from ..reading import axes
from ..reading.cloud import cloud_of
from ..reading.sequence import Decided
from ._columns import batches, bounded_lines, parse_table, whole_numbers
from ._topology import with_topology

TITLE = "OBJ"
SUFFIXES = (".obj",)

_CORNERS_AT_ONCE = 1 << 18
_FACES_AT_ONCE = 1 << 12
_MARK = BOM_UTF8.decode("latin-1")
_HEAD = 100  # lines among which remarks state the axes
_LOOK = 3000  # face corners that tell whether normals and vertices are numbered alike


def read(path: Path, frame: int, decided: Decided) -> PointCloud:
    """The vertices (`v x y z [w]` or `v x y z r g b`) and their normals (`vn`). Raises InputError."""
    with opened(path) as stream:
        text = TextIOWrapper(stream, "latin-1")
        table, given = parse_table(_lines(text, "v")), {}
        if (normals := _normals(text, len(table))) is not None:
            given["normals"] = Deferred(lambda: normals, normals.dtype, 3)
        if table.shape[1] >= 6:
            given["colors"] = Deferred(lambda: table[:, 3:6], table.dtype, 3)
        decided.note(axes.decide(_remarks(text), decided.corrections))
        cloud = cloud_of([table[:, :3]], given, {}, decided=decided)
        return with_topology(cloud, _faces(text))


def _remarks(text: TextIOWrapper) -> list[str]:
    """The comments among the first lines."""
    text.seek(0)
    return [line[1:].strip() for line in islice(bounded_lines(text), _HEAD) if line.startswith("#")]


def read_faces(path: Path, frame: int = 0) -> Iterator[Faces]:
    """The faces of an OBJ file, in pieces. Raises InputError or ValueError where they cannot be used."""
    with opened(path) as stream:
        text = TextIOWrapper(stream, "latin-1")  # closes the stream when it goes
        yield from _faces(text)


def _faces(text: TextIOWrapper) -> Iterator[Faces]:
    for rows in batches(_polygons(text), _FACES_AT_ONCE):
        corners, sizes = whole_numbers([words for words, _ in rows])
        vertices = np.repeat([vertices for _, vertices in rows], sizes)
        yield Faces.of(np.where(corners < 0, corners + vertices, corners - 1), sizes)


def _polygons(text: TextIOWrapper) -> Iterator[tuple[list[str], int]]:
    """The vertices of each face as written, and how many there are so far: negative ones count back."""
    vertices = 0
    text.seek(0)
    for line in bounded_lines(text):
        if line.removeprefix(_MARK).startswith(("v ", "v\t")):
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


def _lines(text: TextIOWrapper, keyword: str) -> Iterator[str]:
    """The rest of every line that starts with the keyword; from the beginning of the file."""
    starts = (keyword + " ", keyword + "\t")
    text.seek(0)
    for line in bounded_lines(text):
        line = line.removeprefix(_MARK)
        if line.startswith(starts):
            yield line[len(keyword) :]


def _corners(text: TextIOWrapper) -> Iterator[str]:
    """The face corners that name a normal: `vertex/[texture]/normal`."""
    for line in _lines(text, "f"):
        yield from (corner for corner in line.split() if corner.count("/") == 2)

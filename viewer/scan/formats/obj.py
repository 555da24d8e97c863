"""OBJ: Wavefront's mesh format; its vertices are the points, with the common colour extension, and its
faces tell the topology.

Read here and not by a library because those at hand drop vertices that no triangle uses.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..points import PointCloud
from ._columns import parse_table
from ._faces import with_faces

TITLE = "OBJ"
SUFFIXES = (".obj",)

_LOOK = 3000  # face corners that tell whether normals and vertices are numbered alike


def read(path: Path, frame: int = 0) -> PointCloud:
    """The vertices (`v x y z [w]` or `v x y z r g b`) and their normals (`vn`). Raises InputError."""
    table = parse_table(_lines(path, "v"))
    cloud = PointCloud.from_arrays(
        table[:, :3],
        normals=_normals(path, len(table)),
        colors=table[:, 3:6] if table.shape[1] >= 6 else None,
    )
    return with_faces(cloud, (line.encode("latin-1") for line in _lines(path, "f")))


def _normals(path: Path, count: int) -> NDArray[np.float64] | None:
    """A normal for each of `count` vertices, (count, 3), or None where not every vertex has one.

    They stand in the order of the vertices, or the faces tell; a vertex whose corners have several
    normals gets their mean.
    """
    normals = parse_table(_lines(path, "vn"), (0, 1, 2))
    if not len(normals):
        return None
    start = parse_table(islice(_corners(path), _LOOK), (0, 2), "/")
    if len(normals) == count and (start[:, 0] == start[:, 1]).all():
        return normals
    sizes = np.array([count, len(normals)])
    corners = parse_table(_corners(path), (0, 2), "/")
    corners = np.where(corners < 0, corners + sizes, corners - 1)  # negative: counted from the end
    vertex, normal = corners[((corners >= 0) & (corners < sizes)).all(axis=1)].astype(np.intp).T
    sums = np.zeros((count, 3))
    np.add.at(sums, vertex, normals[normal])
    if not np.bincount(vertex, minlength=count).all():
        return None
    return sums / np.maximum(np.linalg.norm(sums, axis=1, keepdims=True), np.finfo(np.float32).tiny)


def _lines(path: Path, keyword: str) -> Iterator[str]:
    """What follows the keyword, of every line that starts with it."""
    starts = (keyword + " ", keyword + "\t")
    with open(path, encoding="latin-1") as lines:
        for line in lines:
            if line.startswith(starts):
                yield line[len(keyword) :]


def _corners(path: Path) -> Iterator[str]:
    """The face corners that name a normal: `vertex/[texture]/normal`."""
    for line in _lines(path, "f"):
        yield from (corner for corner in line.split() if corner.count("/") == 2)

"""Textures of PLY files: pictures that comments name, and positions in them at vertices or at faces."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from ..contents import Material
from ..faces import Faces
from ..texture import TexturedMesh
from ._mtl import file_beside
from ._ply_faces import face_rows, property_rows
from ._ply_header import Element

# The names of positions in a texture, in lower case, at vertices.
_AT_VERTICES = [
    ("u", "v"), ("s", "t"), ("texture_u", "texture_v"), ("texcoord_u", "texcoord_v"), ("tex_u", "tex_v"),
    ("u0", "v0"), ("s0", "t0"), ("tu", "tv"),
]  # fmt: skip
_AT_FACES = ("texcoord", "texcoords", "uv")
_NUMBERS = ("texnumber", "texture_number", "material_index")


def materials_of(remarks: tuple[str, ...], folder: Path) -> tuple[Material, ...]:
    """The pictures that `comment TextureFile` names, a material each."""
    named = [remark.split(maxsplit=1) for remark in remarks]
    names = [words[1] for words in named if len(words) == 2 and words[0].lower() == "texturefile"]
    return tuple(Material(image=file_beside(folder, name.strip("\"' "))) for name in names)


def positions_of(columns: Mapping[str, NDArray]) -> list[str]:
    """The columns that hold positions in a texture; none where there are none."""
    names = {name.lower(): name for name in columns}
    complete = (pair for pair in _AT_VERTICES if all(name in names for name in pair))
    return [names[name] for name in next(complete, ())]


def mesh_at_vertices(faces: Faces, uv: NDArray[np.float64], number: NDArray | None) -> TexturedMesh:
    """Faces between vertices with positions uv (N, 2); vertices alone where there are no faces.

    number: (N,), of the picture of each vertex; None: all have the first one.
    """
    if not len(faces):
        sizes, corners = np.ones(len(uv), np.int64), np.arange(len(uv))
    else:
        sizes, corners = faces.sizes.astype(np.int64), faces.corners.astype(np.int64)
    groups = np.zeros(len(sizes), np.int64)
    if number is not None:
        firsts = corners[np.minimum(np.cumsum(sizes) - sizes, len(corners) - 1)]
        groups = number[np.minimum(firsts, len(number) - 1)].astype(np.int64)
    return TexturedMesh(sizes, corners, corners, groups, uv)


def mesh_at_faces(stream: BinaryIO, element: Element, encoding: str) -> TexturedMesh | None:
    """Faces whose corners have positions, of a stream that stands before them; None where they have none.

    Raises InputError or ValueError where they are damaged.
    """
    by_name = {p.name.lower(): number for number, p in enumerate(element.properties)}
    lists = [by_name[name] for name in _AT_FACES if name in by_name]
    if not lists or not element.properties[lists[0]].length_type:
        return None
    start = stream.tell()
    faces = Faces.joined(face_rows(stream, element, encoding))
    values, lengths = _values(stream, start, element, encoding, lists[0])
    sizes = faces.sizes.astype(np.int64)
    has_positions = np.repeat(lengths == 2 * sizes, sizes)
    uv = values[np.repeat(lengths == 2 * sizes, lengths)].astype(np.float64).reshape(-1, 2)
    corners = np.full(len(faces.corners), -1, np.int64)
    corners[has_positions] = np.arange(len(uv))
    groups = np.zeros(len(sizes), np.int64)
    if numbers := [by_name[name] for name in _NUMBERS if name in by_name]:
        groups = _values(stream, start, element, encoding, numbers[0])[0].astype(np.int64)
    return TexturedMesh(sizes, faces.corners.astype(np.int64), corners, groups, uv)


def _values(
    stream: BinaryIO, start: int, element: Element, encoding: str, number: int
) -> tuple[NDArray, NDArray[np.int64]]:
    """The values of a property of all rows, and how many each row has."""
    stream.seek(start)
    rows = [*property_rows(stream, element, encoding, number)]
    values = np.concatenate([row.values for row in rows])
    return values, np.concatenate([row.sizes for row in rows]).astype(np.int64)


def in_materials(mesh: TexturedMesh, materials: int) -> TexturedMesh:
    """The mesh without materials that do not exist; `groups` count from 0, or from 1 where none is 0."""
    groups = mesh.groups
    if len(groups) and groups.min() >= 1 and groups.max() == materials:
        groups = groups - 1
    groups = np.where((groups < 0) | (groups >= materials), -1, groups)
    return TexturedMesh(mesh.sizes, mesh.vertices, mesh.corners, groups, mesh.uv)

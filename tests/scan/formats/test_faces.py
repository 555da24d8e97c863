"""Faces: the same ones however a file stores them, and none where they are damaged."""

from __future__ import annotations

import itertools
import struct
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest
from scenes import rarely

from viewer.errors import InputError
from viewer.scan.faces import Faces, topology
from viewer.scan.formats import read_faces, read_points

POINTS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]], np.float32)
TRIANGLES = ((0, 1, 2), (0, 2, 3), (4, 2, 1))
POLYGONS = ((0, 1, 2), (0, 1, 4, 3), (4, 2), (), (0, 1, 2, 3, 4), (1, 2, 3))
Polygons = Sequence[Sequence[int]]
Writer = Callable[[Path, Polygons], Path]

_CODES = {"uchar": "B", "char": "b", "ushort": "H", "short": "h", "int": "i", "uint": "I", "int32": "i"}


def ply(encoding: str, length: str = "uchar", item: str = "int", around: str = "") -> Writer:
    """A writer of PLY files. around: a property that stands before or behind the corners of each face."""
    extra = {
        "": ("", ""),
        "number before": ("property float quality\n", ""),
        "list before": ("property list uchar float uv\n", ""),
        "list behind": ("", "property list uchar float uv\n"),
    }[around]
    order = ">" if "big" in encoding else "<"

    def row(face: Sequence[int]) -> bytes:
        beside = [(2, 0.5, 0.25), struct.pack(f"{order}Bff", 2, 0.5, 0.25)]
        if around == "number before":
            beside = [(0.5,), struct.pack(f"{order}f", 0.5)]
        if encoding == "ascii":
            words = [*(beside[0] if extra[0] else ()), len(face), *face, *(beside[0] if extra[1] else ())]
            return (" ".join(map(str, words)) + "\n").encode()
        own = struct.pack(f"{order}{_CODES[length]}{len(face)}{_CODES[item]}", len(face), *face)
        return (beside[1] if extra[0] else b"") + own + (beside[1] if extra[1] else b"")

    def write(path: Path, faces: Polygons) -> Path:
        path = path.with_suffix(".ply")
        points = POINTS.astype(order + "f4").tobytes()
        if encoding == "ascii":
            points = "".join(f"{x} {y} {z}\n" for x, y, z in POINTS.tolist()).encode()
        head = (
            f"ply\nformat {encoding} 1.0\nelement vertex {len(POINTS)}\nproperty float x\nproperty float y\n"
            f"property float z\nelement face {len(faces)}\n{extra[0]}"
            f"property list {length} {item} vertex_indices\n{extra[1]}end_header\n"
        )
        path.write_bytes(head.encode() + points + b"".join(map(row, faces)))
        return path

    return write


def obj(corner: Callable[[int], str]) -> Writer:
    def write(path: Path, faces: Polygons) -> Path:
        lines = [f"v {x} {y} {z}\n" for x, y, z in POINTS.tolist()]
        lines += ["f " + " ".join(map(corner, face)) + "\n" for face in faces]
        path = path.with_suffix(".obj")
        path.write_text("".join(lines), encoding="ascii")
        return path

    return write


def npz(dtype: str, column_order: bool = False) -> Writer:
    def write(path: Path, faces: Polygons) -> Path:
        array = np.array(faces, dtype)
        path = path.with_suffix(".npz")
        np.savez(path, positions=POINTS, faces=np.asfortranarray(array) if column_order else array)
        return path

    return write


_ENCODINGS = ("ascii", "binary_little_endian", "binary_big_endian")
_TYPES = [("uchar", "int"), ("int", "uint"), ("uint", "ushort"), ("char", "short"), ("ushort", "uchar")]
OF_POLYGONS = {
    **{
        f"ply {encoding} {length} {item}": ply(encoding, length, item)
        for encoding, (length, item) in itertools.product(_ENCODINGS, _TYPES)
    },
    **{
        f"ply {encoding} {around}": ply(encoding, around=around)
        for encoding in _ENCODINGS
        for around in ("number before", "list before", "list behind")
    },
    "obj": obj(lambda id: str(id + 1)),
    "obj from the end": obj(lambda id: str(id - len(POINTS))),
    "obj with normals": obj(lambda id: f"{id + 1}//{id + 1}"),
}
OF_TRIANGLES = OF_POLYGONS | {f"npz {dtype}": npz(dtype) for dtype in ("<u4", "<i8", ">i4", "u1", ">u8")}
OF_TRIANGLES["npz by columns"] = npz("<i4", column_order=True)


def same(faces: Faces, polygons: Polygons) -> bool:
    corners = list(itertools.chain.from_iterable(polygons))
    return faces.sizes.tolist() == [len(face) for face in polygons] and faces.corners.tolist() == corners


@pytest.mark.parametrize("kind", OF_TRIANGLES)
def test_triangles_are_the_same_however_they_are_stored(kind: str, tmp_path: Path) -> None:
    path = OF_TRIANGLES[kind](tmp_path / "a", TRIANGLES)
    assert same(read_faces(path), TRIANGLES)
    assert read_points(path).topology == topology(len(POINTS), [Faces.of(np.array(TRIANGLES))])


@pytest.mark.parametrize("kind", OF_POLYGONS)
def test_polygons_are_the_same_however_they_are_stored(kind: str, tmp_path: Path) -> None:
    polygons = [face for face in POLYGONS if face or "obj" not in kind]
    path = OF_POLYGONS[kind](tmp_path / "a", polygons)
    assert same(read_faces(path), polygons)
    pieces = [Faces.of(np.array([face], int)) for face in polygons]
    assert read_points(path).topology == topology(len(POINTS), pieces)


def test_a_topology_is_of_faces_in_their_order_between_so_many_points() -> None:
    def name(faces: Polygons, points: int = 5) -> str | None:
        return topology(points, [Faces.of(np.array([face], int)) for face in faces])

    assert name(()) is None
    others = [
        TRIANGLES[::-1],
        TRIANGLES[:2],
        ((1, 2, 0), *TRIANGLES[1:]),
        ((0, 1), (2, 0, 2, 3), TRIANGLES[2]),  # the same corners, of other polygons
        POLYGONS,
    ]
    names = [name(TRIANGLES), name(TRIANGLES, 6), *map(name, others)]
    assert len(set(names)) == len(names)
    assert name(TRIANGLES) == topology(5, [Faces.of(np.array(TRIANGLES))]), "in one piece"


def test_polygons_become_fans() -> None:
    faces = Faces.joined(Faces.of(np.array([face], int)) for face in POLYGONS)
    fans = [[face[0], *pair] for face in POLYGONS for pair in itertools.pairwise(face[1:])]
    assert faces.triangles().tolist() == fans
    assert Faces.joined([]).triangles().shape == (0, 3)


@pytest.mark.parametrize("mixed", [False, True])
@pytest.mark.parametrize("encoding", ["binary_big_endian", *rarely("binary_little_endian")])
@pytest.mark.slow
def test_faces_of_many_pieces(encoding: str, mixed: bool, tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    sizes = rng.integers(3, 6, 200_000) if mixed else np.full(200_000, 3)
    faces = np.split(rng.integers(0, 5, sizes.sum()), np.cumsum(sizes)[:-1])
    path = ply(encoding)(tmp_path / "a", [face.tolist() for face in faces])
    found = read_faces(path)
    np.testing.assert_array_equal(found.sizes, sizes)
    np.testing.assert_array_equal(found.corners, np.concatenate(faces))


def test_one_polygon_longer_than_a_piece(tmp_path: Path) -> None:
    long = [0, 1, 2, 3] * 200_000
    assert same(
        read_faces(ply("binary_little_endian", "uint")(tmp_path / "a", [long, (0, 1, 2)])), [long, (0, 1, 2)]
    )


def test_faces_that_stand_before_the_points(tmp_path: Path) -> None:
    path = tmp_path / "a.ply"
    head = "ply\nformat {} 1.0\nelement face 2\nproperty list uchar int vertex_index\n"
    head += "element vertex 5\nproperty float x\nproperty float y\nproperty float z\nend_header\n"
    rows = np.array([(3, face) for face in TRIANGLES[:2]], [("size", "u1"), ("corners", "<i4", 3)])
    path.write_bytes(head.format("binary_little_endian").encode() + rows.tobytes() + POINTS.tobytes())
    text = "3 0 1 2\n3 0 2 3\n" + "".join(f"{x} {y} {z}\n" for x, y, z in POINTS)
    (tmp_path / "b.ply").write_text(head.format("ascii") + text, encoding="ascii")
    for name in ("a.ply", "b.ply"):
        cloud = read_points(tmp_path / name)
        np.testing.assert_array_equal(cloud.world(), POINTS)
        assert cloud.topology == topology(5, [Faces.of(np.array(TRIANGLES[:2]))])


def test_vertices_of_an_obj_that_are_counted_from_the_end_as_far_as_the_file_is_told(tmp_path: Path) -> None:
    path = tmp_path / "a.obj"
    part = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\n"
    path.write_text(part * 3, encoding="ascii")
    assert same(read_faces(path), [(0, 1, 2), (3, 4, 5), (6, 7, 8)])


@pytest.mark.parametrize(
    ("kind", "corner", "message"),
    [
        ("ply ascii uchar int", -1, "a vertex that does not exist"),
        ("obj", -1, "a vertex that does not exist"),
        ("npz <i8", 2**32, "a vertex that does not exist"),
    ],
)
def test_damaged_faces_tell_nothing_and_cost_no_point(
    kind: str, corner: int, message: str, tmp_path: Path
) -> None:
    path = OF_TRIANGLES[kind](tmp_path / "a", ((0, 1, corner),))
    cloud = read_points(path)
    assert (len(cloud), cloud.topology) == (5, None)
    with pytest.raises(InputError, match=message) as caught:
        read_faces(path)
    assert str(path) in str(caught.value)


@pytest.mark.parametrize("encoding", _ENCODINGS)
@pytest.mark.parametrize("polygons", [TRIANGLES, POLYGONS])
def test_faces_that_end_early(encoding: str, polygons: Polygons, tmp_path: Path) -> None:
    path = ply(encoding)(tmp_path / "a", polygons)
    path.write_bytes(path.read_bytes()[: -3 if encoding != "ascii" else -8])
    cloud = read_points(path)
    assert (len(cloud), cloud.topology) == (5, None)
    with pytest.raises(InputError, match=r"contains only [0-9] of the [0-9] faces|ends within its corners"):
        read_faces(path)

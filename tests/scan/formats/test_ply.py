"""PLY: encodings, names, odd headers, and files that hold less than they promise."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
from scenes import rarely

from viewer.errors import InputError
from viewer.scan.formats import read, write
from viewer.scan.points import PointCloud

XYZ = "property float x\nproperty float y\nproperty float z\n"


def save(path: Path, header: str, body: bytes | str, encoding: str = "ascii") -> Path:
    text = f"ply\nformat {encoding} 1.0\n{header}end_header\n"
    path.write_bytes(text.encode() + (body.encode() if isinstance(body, str) else body))
    return path


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "scan.ply"


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-16-be", "utf-32"])
def test_a_header_in_utf_16_gets_a_message_that_says_so(encoding: str, path: Path) -> None:
    save(path, f"element vertex 1\n{XYZ}", "1 2 3\n")
    path.write_bytes(path.read_text().encode(encoding))
    with pytest.raises(InputError, match=encoding[:6].upper()) as refused:
        read(path)
    assert "UTF-8" in (refused.value.hint or "")


@pytest.mark.parametrize("real", ["f4", "f8"])
@pytest.mark.parametrize("encoding", ["ascii", "binary_little_endian", "binary_big_endian"])
def test_all_encodings_hold_the_same(encoding: str, real: str, path: Path) -> None:
    endian = ">" if "big" in encoding else "<"
    reals = ["x", "y", "z", "nx", "ny", "nz", "confidence", "radius"]
    fields = [(name, endian + real) for name in reals] + [(name, "u1") for name in ("red", "green", "blue")]
    rows = np.zeros(20, [*fields, ("label", endian + "i2")])
    rng = np.random.default_rng(3)
    for name in reals:
        rows[name] = rng.random(20).astype("f4") - 0.5
    for name in ("red", "green", "blue", "label"):
        rows[name] = rng.integers(0, 200, 20)
    types = {"f4": "float", "f8": "double", "u1": "uchar", "i2": "short"}
    header = "element vertex 20\n" + "".join(
        f"property {types[rows.dtype[name].str[1:]]} {name}\n" for name in rows.dtype.names
    )
    text = "".join(" ".join(repr(value) for value in row.tolist()) + "\n" for row in rows)
    cloud = read(save(path, header, text if encoding == "ascii" else rows.tobytes(), encoding))
    np.testing.assert_allclose(cloud.world()[:, 1], rows["y"], rtol=0, atol=1e-7)
    np.testing.assert_allclose(cloud.normals[:, 2], rows["nz"], rtol=1e-6)
    np.testing.assert_allclose(cloud.radii, rows["radius"], rtol=1e-6)
    np.testing.assert_array_equal(cloud.colors[:, 2], rows["blue"])
    assert (cloud.colors[:, 3] == 255).all()
    assert {name: values.dtype.str for name, values in cloud.scalars.items()} == {
        "confidence": "<" + real,
        "label": "<i2",
    }
    np.testing.assert_array_equal(cloud.scalars["confidence"], rows["confidence"])
    np.testing.assert_array_equal(cloud.scalars["label"], rows["label"])


@pytest.mark.parametrize(
    "names", ["red green blue alpha", "r g b a", "diffuse_red diffuse_green diffuse_blue"]
)
def test_names_of_colours(names: str, path: Path) -> None:
    columns = names.split()
    header = "element vertex 1\n" + XYZ + "".join(f"property uchar {name}\n" for name in columns)
    values = [10, 20, 30, 40][: len(columns)]
    cloud = read(save(path, header, f"1 2 3 {' '.join(map(str, values))}\n"))
    assert cloud.colors.tolist() == [[10, 20, 30, values[3] if len(values) == 4 else 255]]


@pytest.mark.parametrize(("value", "byte"), [("0.2", 51), ("51", 51)])
def test_float_colours_count_in_units_or_bytes(value: str, byte: int, path: Path) -> None:
    colors = "".join(f"property float {name}\n" for name in ("red", "green", "blue"))
    cloud = read(save(path, "element vertex 1\n" + XYZ + colors, f"1 2 3 {value} 0 {value}\n"))
    assert cloud.colors[0, :3].tolist() == [byte, 0, byte]


def test_the_surfel_radius_of_fused_scans_is_the_radius(path: Path) -> None:
    header = "element vertex 1\n" + XYZ + "property float surfel_radius\n"
    assert read(save(path, header, "1 2 3 0.25\n")).radii == [0.25]


def test_ascii_coordinates_keep_digits_beyond_their_declared_type(path: Path) -> None:
    cloud = read(
        save(path, "element vertex 2\n" + XYZ, "665187.522077 5648349.895035 241.75\n665188 5648350 242\n")
    )
    np.testing.assert_allclose(cloud.world()[0], [665187.522077, 5648349.895035, 241.75], rtol=0, atol=1e-5)


def test_doubles_at_utm_coordinates_keep_millimetres(path: Path) -> None:
    points = np.array([[665187.522, 5648349.895, 241.767], [665189.001, 5648351.003, 242.009]])
    header = "element vertex 2\n" + XYZ.replace("float", "double")
    cloud = read(save(path, header, points.tobytes(), "binary_little_endian"))
    np.testing.assert_allclose(cloud.world(), points, rtol=0, atol=1e-6)


def test_small_sloppiness_does_no_harm(path: Path) -> None:
    path.write_bytes(
        b"ply \r\nformat ascii 1.0\r\ncomment by hand\r\nobj_info cols 3\r\nbye\r\nelement vertex 2\r\n"
        + XYZ.replace("\n", " \r\n").encode()
        + b"element face 1\r\nproperty list uchar int vertex_indices\r\nend_header\r\n"
        + b"0 0 0 \r\n\r\n1 2 3 \r\n3 0 1 1\r\n"
    )
    np.testing.assert_array_equal(read(path).world(), [[0, 0, 0], [1, 2, 3]])


@pytest.mark.parametrize("encoding", ["ascii", "binary_little_endian"])
def test_vertices_behind_other_elements_and_with_lists(encoding: str, path: Path) -> None:
    header = (
        "element camera 1\nproperty float fov\nproperty list uchar int ids\nelement vertex 2\n"
        + XYZ
        + "property list uchar short seen_by\nproperty double weight\n"
    )
    row = [("xyz", "<f4", 3), ("n", "u1"), ("seen", "<i2", 2), ("weight", "<f8")]
    camera = np.array([(60, 1, 5)], [("fov", "<f4"), ("n", "u1"), ("ids", "<i4")])
    vertices = np.array([((1, 2, 3), 2, (7, 8), 0.5), ((4, 5, 6), 2, (9, 9), 0.25)], row)
    text = "60 1 5\n1 2 3 2 7 8 0.5\n4 5 6 2 9 9 0.25\n"
    body = text if encoding == "ascii" else camera.tobytes() + vertices.tobytes()
    cloud = read(save(path, header, body, encoding))
    np.testing.assert_array_equal(cloud.world(), [[1, 2, 3], [4, 5, 6]])
    np.testing.assert_array_equal(cloud.scalars["weight"], [0.5, 0.25])
    assert set(cloud.scalars) == {"weight"}


@pytest.mark.parametrize(
    ("encoding", "body"), [("ascii", "1 2 3\n" * 7), ("binary_little_endian", bytes(7 * 12 + 5))]
)
@pytest.mark.parametrize("promised", [8, 10**6, 10**15, 10**30])
def test_fewer_rows_than_promised(encoding: str, body: bytes | str, promised: int, path: Path) -> None:
    save(path, f"element vertex {promised}\n" + XYZ, body, encoding)
    with pytest.raises(InputError, match=f"contains only 7 of the {promised} vertices"):
        read(path)


@pytest.mark.parametrize("encoding", ["ascii", "binary_big_endian"])
@pytest.mark.parametrize(("element", "rows"), [("vertex", "vertices"), ("face", "rows of face")])
def test_huge_promises_in_rare_forms_allocate_nothing(
    encoding: str, element: str, rows: str, path: Path
) -> None:
    faces = f"element face {10**12 if element == 'face' else 1}\nproperty list uchar int vertex_indices\n"
    vertices = f"element vertex {10**12 if element == 'vertex' else 1}\n{XYZ}"
    save(path, faces + vertices, "0\n1 2 3\n" if encoding == "ascii" else bytes(20), encoding)
    with pytest.raises(
        InputError, match=rf"contains only [0-9]+ of the {10**12} {rows} that its header states"
    ):
        read(path)


@pytest.mark.parametrize("length_type", ["char", "short", "int32"])
@pytest.mark.parametrize("encoding", ["ascii", "binary_little_endian", "binary_big_endian"])
def test_a_list_of_a_negative_length_is_refused(length_type: str, encoding: str, path: Path) -> None:
    header = f"element vertex 2\n{XYZ}property list {length_type} uchar q\n"
    order = ">" if encoding == "binary_big_endian" else "<"
    row = np.dtype(
        [("p", order + "f4", 3), ("k", order + {"char": "i1", "short": "i2", "int32": "i4"}[length_type])]
    )
    rows = np.zeros(2, row)
    rows["k"][1] = -5
    body = "1 2 3 0\n1 2 3 -5 7\n" if encoding == "ascii" else rows.tobytes() + bytes(9)
    with pytest.raises(InputError, match="row 1 of vertex has a list of a negative length"):
        read(save(path, header, body, encoding))
    unsigned = {"char": "uchar", "short": "ushort", "int32": "uint32"}[length_type]
    with pytest.raises(InputError, match=r"negative|contains only 1 of the 2 vertices"):
        read(save(path, header.replace(length_type, unsigned, 1), body, encoding))


@pytest.mark.parametrize("length", ["9" * 5000, "three", "1.5"])
def test_lengths_that_are_no_number_are_told_in_our_words(length: str, path: Path) -> None:
    header = f"element vertex 1\n{XYZ}property list int int q\n"
    told = "the length of q in row 0 of vertex is '.*', which is not a usable whole number"
    with pytest.raises(InputError, match=told) as caught:
        read(save(path, header, f"1 2 3 {length}\n"))
    assert len(str(caught.value)) < 400


def test_faces_are_not_taken_for_missing_vertices(path: Path) -> None:
    header = "element vertex 3\n" + XYZ + "element face 2\nproperty list uchar int vertex_indices\n"
    save(path, header, "0 0 0\n1 0 0\n3 0 1 1\n3 0 1 1\n")
    with pytest.raises(InputError, match="row 3 has 4 values, but the rows above have 3"):
        read(path)


@pytest.mark.parametrize("encoding", ["ascii", "binary_little_endian"])
@pytest.mark.parametrize(
    ("header", "reason"),
    [
        ("element vertex 1\nproperty float x\nproperty float y\n", "no x, y and z among the columns: x, y"),
        (
            "element vertex 1\nflat x\nfloat y\nfloat z\nproperty uchar red\n",
            "PLY has no header line 'flat x'",
        ),
        (
            "element vertex 1\nproperty triple x\n",
            "property type 'triple'. Known: bool, char, double",
        ),
        ("element vertex -1\n" + XYZ, "states '-1' rows of vertex"),
        ("element vertex 0\n" + XYZ, "holds no vertices"),
        ("element vertex 1\n", "no x, y and z among the columns: none"),
        ("element depth 4\nproperty float d\n", "no vertex element, only: depth"),
    ],
)
def test_headers_that_cannot_be_used(header: str, reason: str, encoding: str, path: Path) -> None:
    with pytest.raises(InputError, match=reason):
        read(save(path, header, "1 2 3 4 5 6 7\n", encoding))


def test_properties_without_the_word_are_properties(path: Path) -> None:
    header = "element vertex 1\n" + XYZ + "property uchar red\nproperty uchar green\nproperty uchar blue\n"
    plain = read(save(path, header, "1 2 3 4 5 6\n"))
    bare = read(save(path, header.replace("property float ", "float "), "1 2 3 4 5 6\n"))
    for cloud in (plain, bare):
        np.testing.assert_array_equal(cloud.world(), [[1, 2, 3]])
        np.testing.assert_array_equal(cloud.colors, [[4, 5, 6, 255]])


def test_normals_that_are_declared_and_not_stored_are_left_aside(path: Path) -> None:
    rows = np.zeros(2, [("p", "<f4", 3), ("c", "u1", 3)])
    rows["p"], rows["c"] = np.arange(6).reshape(2, 3), 7
    header = "element vertex 2\n" + XYZ + "float nx\nfloat ny\nfloat nz\n"
    header += "".join(f"property uchar {name}\n" for name in ("red", "green", "blue"))
    cloud = read(save(path, header, rows.tobytes(), "binary_little_endian"))
    np.testing.assert_array_equal(cloud.world(), rows["p"])
    assert cloud.normals is None
    assert (cloud.colors[:, :3] == 7).all()
    with pytest.raises(InputError, match="contains only 1 of the 2 vertices"):
        read(save(path, header, rows.tobytes() + b"1", "binary_little_endian"))


def test_unknown_encoding(path: Path) -> None:
    with pytest.raises(InputError, match="unknown PLY format 'binary_middle_endian'"):
        read(save(path, "element vertex 1\n" + XYZ, "", "binary_middle_endian"))


def test_positions_are_written_as_double_only_where_needed(path: Path) -> None:
    write(path, PointCloud.from_arrays(np.eye(3)))
    assert b"property float x" in path.read_bytes()
    write(path, PointCloud.from_arrays(np.eye(3) * 0.1 + 5_648_349.1))
    assert b"property double x" in path.read_bytes()


def test_other_programs_can_read_what_is_written(full_cloud: PointCloud, path: Path) -> None:
    from plyfile import PlyData

    write(path, full_cloud)
    vertices = PlyData.read(path)["vertex"]
    np.testing.assert_allclose(vertices["x"], full_cloud.world()[:, 0], rtol=0, atol=1e-6)
    np.testing.assert_array_equal(vertices["alpha"], full_cloud.colors[:, 3])
    np.testing.assert_array_equal(vertices["ring"], full_cloud.scalars["ring"])


@pytest.mark.parametrize("encoding", ["ascii", "binary_little_endian", "binary_big_endian"])
@pytest.mark.parametrize("columns", ["x y z x", "x y z X", "x y z red green blue Red"])
def test_two_columns_of_one_meaning_are_refused(columns: str, encoding: str, path: Path) -> None:
    names = columns.split()
    header = "element vertex 1\n" + "".join(f"property float {name}\n" for name in names)
    body = " ".join("1" * len(names)) if encoding == "ascii" else bytes(4 * len(names))
    with pytest.raises(InputError, match=f"two columns have the name '{names[-1]}'. Rename one"):
        read(save(path, header, body, encoding))


@pytest.mark.parametrize("encoding", ["ascii", "binary_little_endian"])
def test_scalars_of_one_name_are_numbered(encoding: str, path: Path) -> None:
    header = "element vertex 1\n" + XYZ + "property float q\nproperty float Q\nproperty float q\n"
    body = "1 2 3 4 5 6\n" if encoding == "ascii" else np.arange(1, 7, dtype="<f4").tobytes()
    scalars = read(save(path, header, body, encoding)).scalars
    assert {name: values.tolist() for name, values in scalars.items()} == {"q": [4], "Q": [5], "q_2": [6]}


@pytest.mark.parametrize("lengths", ["constant", "of all kinds"])
@pytest.mark.parametrize("encoding", ["ascii", *rarely("binary_little_endian", "binary_big_endian")])
def test_lists_among_the_numbers_of_many_vertices(encoding: str, lengths: str, path: Path) -> None:
    """A row at a time in Python would take a minute for these in binary."""
    count = 2_000 if encoding == "ascii" else 400_000
    long = np.full(count, 2) if lengths == "constant" else np.arange(count) % 4
    points = np.random.default_rng(0).integers(-99, 99, (count, 3))
    header = (
        f"element camera 2\nproperty list uchar short ids\nproperty double fov\nelement vertex {count}\n"
        "property float x\nproperty list ushort uchar seen_by\nproperty float y\nproperty float z\n"
    )
    if encoding == "ascii":
        rows = [f"{x} {n} {'5 ' * n}{y} {z}\n" for (x, y, z), n in zip(points, long, strict=True)]
        body: bytes | str = "2 7 8 0.5\n0 1.5\n" + "".join(rows)
    else:
        order = ">" if "big" in encoding else "<"
        row = [struct.Struct(f"{order}fH{n}xff") for n in range(4)]
        cameras = struct.pack(f"{order}BhhdBd", 2, 7, 8, 0.5, 0, 1.5)
        body = cameras + b"".join(
            row[n].pack(x, n, y, z) for (x, y, z), n in zip(points.tolist(), long, strict=True)
        )
    np.testing.assert_array_equal(read(save(path, header, body, encoding)).world(), points)


@pytest.mark.parametrize("encoding", ["ascii", "binary_little_endian"])
@pytest.mark.parametrize("end", [2, 9])
def test_lists_that_end_early_are_refused(encoding: str, end: int, path: Path) -> None:
    header = "element vertex 2\n" + XYZ + "property list uint uchar i\n"
    binary = (struct.pack("<3fI", 1, 2, 3, 2) + bytes(2)) * 2
    body = "1 2 3 2 0 0\n1 2 3 2 0 0\n"[:-end] if encoding == "ascii" else binary[:-end]
    with pytest.raises(InputError, match=r"row 1 of vertex ends|contains only 1 of the 2 vertices"):
        read(save(path, header, body, encoding))
    huge = struct.pack("<3fI", 1, 2, 3, 2**32 - 1) + bytes(30)
    with pytest.raises(InputError, match="contains only 0 of the 2 vertices"):
        read(save(path, header, huge, "binary_little_endian"))


def test_headers_of_very_many_or_long_names(path: Path) -> None:
    many = "".join(f"property uchar c{i}\n" for i in range(4097))
    with pytest.raises(
        InputError, match="has 4,097 properties of an element, but Scan4D reads at most 4,096"
    ):
        read(save(path, "element vertex 1\n" + many, ""))
    long = "".join(f"property uchar {'n' * 5000}{i}\n" for i in range(100))
    with pytest.raises(InputError, match=r"no x, y and z among the columns: nnnn.*and 88 more") as caught:
        read(save(path, "element vertex 1\n" + long, ""))
    assert len(str(caught.value)) < 1000


@pytest.mark.parametrize("encoding", ["ascii", "binary_little_endian", "binary_big_endian"])
@pytest.mark.parametrize(
    ("kind", "code", "value"),
    [
        ("bool", "u1", 1),
        ("uint64", "u8", 1 << 52),
        ("size_t", "u8", 1 << 52),
        ("int32_t", "i4", -7),
        ("ubyte", "u1", 200),
        ("byte", "i1", -7),
        ("single", "f4", 1.5),
        ("boolean", "u1", 1),
        ("int64", "i8", -(1 << 52)),
        ("long", "i8", -5),
        ("ulong", "u8", 5),
        ("half", "f2", 0.5),
        ("float16", "f2", -2.0),
    ],
)
def test_types_beyond_the_standard(kind: str, code: str, value: float, encoding: str, path: Path) -> None:
    endian = ">" if "big" in encoding else "<"
    rows = np.array(
        [(1, 2, 3, value), (4, 5, 6, 0)], [*((axis, endian + "f4") for axis in "xyz"), ("v", endian + code)]
    )
    text = "".join(" ".join(repr(one) for one in row.tolist()) + "\n" for row in rows)
    header = f"element vertex 2\n{XYZ}property {kind} v\n"
    cloud = read(save(path, header, text if encoding == "ascii" else rows.tobytes(), encoding))
    np.testing.assert_array_equal(cloud.world(), [[1, 2, 3], [4, 5, 6]])
    np.testing.assert_array_equal(cloud.scalars["v"], [value, 0])


@pytest.mark.parametrize("encoding", ["ascii", "binary_little_endian"])
def test_a_byte_order_mark_in_front_does_no_harm(encoding: str, path: Path) -> None:
    body = "1 2 3\n4 5 6\n" if encoding == "ascii" else np.array([1, 2, 3, 4, 5, 6], "<f4").tobytes()
    save(path, f"element vertex 2\n{XYZ}", body, encoding)
    path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes())
    np.testing.assert_array_equal(read(path).world(), [[1, 2, 3], [4, 5, 6]])

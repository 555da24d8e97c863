"""PCD: the three encodings, packed colours, fields of any kind, and damaged files."""

from __future__ import annotations

import struct
from pathlib import Path

import lzf
import numpy as np
import pytest

from viewer.errors import InputError
from viewer.scan.formats import read, read_points, write
from viewer.scan.points import PointCloud

ROWS = np.array(
    [((1, 2, 3), 0x80FF2010, (0.5, 1.5), 7), ((4, 5, np.nan), 1, (0, 0), 8), ((-1, 0, 2), 2, (2.5, 3.5), -9)],
    [("p", "<f4", 3), ("rgba", "<u4"), ("moment", "<f8", 2), ("label", "<i2")],
)
FIELDS = "x y z rgba moment label"
HEADER = {
    "VERSION": "0.7",
    "FIELDS": FIELDS,
    "SIZE": "4 4 4 4 8 2",
    "TYPE": "F F F U F I",
    "COUNT": "1 1 1 1 2 1",
    "WIDTH": "3",
    "HEIGHT": "1",
    "VIEWPOINT": "0 0 0 1 0 0 0",
    "POINTS": "3",
}


def test_a_header_in_utf_16_gets_a_message_that_says_so(tmp_path: Path) -> None:
    path = tmp_path / "scan.pcd"
    path.write_bytes("# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\n".encode("utf-16"))
    with pytest.raises(InputError, match="is UTF-16 text, but PCD files are ASCII or UTF-8"):
        read(path)


def body_of(encoding: str) -> bytes:
    """ROWS as the encoding has them."""
    columns = [*ROWS["p"].T, ROWS["rgba"], *ROWS["moment"].T, ROWS["label"]]
    if encoding == "binary":
        return ROWS.tobytes()
    if encoding == "ascii":
        return "".join(" ".join(str(c[i]) for c in columns) + "\n" for i in range(3)).encode()
    fields = [*columns[:4], ROWS["moment"], ROWS["label"]]  # field after field, two moments a point
    data = b"".join(np.ascontiguousarray(field).tobytes() for field in fields)
    packed = lzf.compress(data + bytes(0), 10 * len(data)) or pytest.fail("did not pack")
    return struct.pack("<II", len(packed), len(data)) + packed


def save(path: Path, encoding: str = "binary", body: bytes | None = None, **changes: str | None) -> Path:
    lines = [f"{key} {value}\n" for key, value in (HEADER | changes).items() if value is not None]
    path.write_bytes(
        "".join([*lines, f"DATA {encoding}\n"]).encode() + (body_of(encoding) if body is None else body)
    )
    return path


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "scan.pcd"


@pytest.mark.parametrize("encoding", ["ascii", "binary", "binary_compressed"])
def test_all_encodings_hold_the_same(encoding: str, path: Path) -> None:
    cloud = read(save(path, encoding))
    np.testing.assert_array_equal(cloud.world(), [[1, 2, 3], [-1, 0, 2]])
    np.testing.assert_array_equal(cloud.ids, [0, 2])
    assert cloud.dropped == 1
    np.testing.assert_array_equal(cloud.colors, [[255, 32, 16, 128], [0, 0, 2, 0]])
    np.testing.assert_array_equal(cloud.scalars["moment_0"], [0.5, 2.5])
    np.testing.assert_array_equal(cloud.scalars["moment_1"], [1.5, 3.5])
    np.testing.assert_array_equal(cloud.scalars["label"], [7, -9])
    assert [values.dtype.str for values in cloud.scalars.values()] == ["<f8", "<f8", "<i2"]


def test_upper_case_names_padding_and_missing_lines(path: Path) -> None:
    save(path, FIELDS="X Y Z _ _ label", VIEWPOINT=None, POINTS=None, VERSION=None)
    cloud = read(path)
    np.testing.assert_array_equal(cloud.world(), [[1, 2, 3], [-1, 0, 2]])
    assert set(cloud.scalars) == {"label"}


def test_colours_packed_into_a_float_are_opaque(path: Path) -> None:
    cloud = read(save(path, FIELDS=FIELDS.replace("rgba", "rgb"), TYPE="F F F F F I"))
    np.testing.assert_array_equal(cloud.colors, [[255, 32, 16, 255], [0, 0, 2, 255]])


def test_alpha_that_nobody_set_is_opaque(path: Path) -> None:
    rows = ROWS.copy()
    rows["rgba"] &= 0xFFFFFF
    assert (read(save(path, body=rows.tobytes())).colors[:, 3] == 255).all()


def test_bytes_behind_the_points_are_ignored(path: Path) -> None:
    assert len(read(save(path, body=ROWS.tobytes() + bytes(3906)))) == 2


@pytest.mark.parametrize("delimiter", [" ", "\t", ","])
def test_delimiters_of_ascii(delimiter: str, path: Path) -> None:
    body = delimiter.join(["289814.15", "4320978.61", "170.76"]).encode() + b"\r\n"
    save(path, "ascii", body, FIELDS="X Y Z", SIZE="4 4 4", TYPE="F F F", COUNT=None, WIDTH="1", POINTS="1")
    np.testing.assert_allclose(read(path).world(), [[289814.15, 4320978.61, 170.76]], rtol=0, atol=1e-6)


@pytest.mark.parametrize("encoding", ["ascii", "binary"])
@pytest.mark.parametrize("promised", ["4", "1000000", str(10**18)])
def test_fewer_points_than_promised(encoding: str, promised: str, path: Path) -> None:
    with pytest.raises(InputError, match=f"contains only 3 of the {promised} points"):
        read(save(path, encoding, WIDTH=promised, POINTS=promised))


def test_damaged_compressed_data(path: Path) -> None:
    whole = body_of("binary_compressed")
    packed, unpacked = struct.unpack("<II", whole[:8])
    cases = {
        whole[:20]: f"contains only 12 of {packed} bytes",
        whole[:4]: "ends early: it has 4 bytes where 8 bytes should be",
        struct.pack("<II", packed, 10**9)
        + whole[8:]: "contains 1000000000 bytes of points, but its header states",
        struct.pack("<II", 1, unpacked) + whole[8:]: f"1 bytes of compressed data cannot contain {unpacked}",
        whole[:8] + bytes([255]) * packed: "cannot be read as PCD|damaged",
    }
    for body, reason in cases.items():
        with pytest.raises(InputError, match=reason):
            read(save(path, "binary_compressed", body))


def test_a_bomb_is_refused_before_it_unpacks(path: Path) -> None:
    body = struct.pack("<II", 100, 34 * 10**8) + bytes(100)
    with pytest.raises(InputError, match="cannot contain 3400000000"):
        read(save(path, "binary_compressed", body, WIDTH=str(10**8), POINTS=str(10**8)))


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"FIELDS": None}, "no FIELDS line"),
        ({"POINTS": None, "WIDTH": None}, "no WIDTH line"),
        ({"SIZE": "4 4 4"}, "have different numbers of entries"),
        ({"SIZE": "4 4 3 4 8 2"}, "unknown PCD type and size 'F3'"),
        (
            {"COUNT": f"1 1 1 1 {10**12} 1"},
            "has 1,000,000,000,005 values a point, but Scan4D reads at most 4,096",
        ),
        ({"COUNT": "1 1 1 1 0 1"}, "promises 3 points"),
        ({"POINTS": "0"}, "contains no points"),
        ({"POINTS": "-3"}, "promises -3 points"),
        ({"POINTS": "9" * 5000}, "the number of points is .9+\\.\\.\\.., which is not a usable whole number"),
        ({"COUNT": "1 1 1 1 x 1"}, "a COUNT is .x., which is not a usable whole number"),
        ({"FIELDS": "x y w rgba moment label"}, "the columns do not include x, y and z: x, y, w"),
    ],
)
def test_headers_that_cannot_be_used(changes: dict[str, str | None], reason: str, path: Path) -> None:
    with pytest.raises(InputError, match=reason):
        read(save(path, **changes))


def test_unknown_encoding(path: Path) -> None:
    with pytest.raises(InputError, match=r"unknown PCD encoding 'zip'\. Known: ascii, binary"):
        read(save(path, "zip", b""))


def test_other_programs_can_read_what_is_written(tmp_path: Path) -> None:
    import open3d

    rng = np.random.default_rng(5)
    cloud = PointCloud.from_arrays(
        rng.random((30, 3), np.float32) - 0.5,
        normals=rng.random((30, 3)),
        colors=rng.integers(0, 256, (30, 3), np.uint8),
        scalars={"intensity": rng.random(30, np.float32)},
    )
    write(tmp_path / "scan.pcd", cloud)
    other = open3d.t.io.read_point_cloud(str(tmp_path / "scan.pcd")).point
    np.testing.assert_array_equal(other["positions"].numpy(), cloud.world().astype(np.float32))
    np.testing.assert_array_equal(other["normals"].numpy(), cloud.normals)
    np.testing.assert_array_equal(other["colors"].numpy(), cloud.colors[:, :3])
    np.testing.assert_array_equal(other["intensity"].numpy()[:, 0], cloud.scalars["intensity"])


@pytest.mark.parametrize("encoding", ["ascii", "binary", "binary_compressed"])
def test_a_field_that_is_there_twice(encoding: str, path: Path) -> None:
    with pytest.raises(InputError, match="two columns have the name 'X'"):
        read(save(path, encoding, FIELDS="x y z rgba moment X"))
    twice = read(save(path, encoding, FIELDS="x y z n moment n")).scalars
    assert twice["n"].tolist() == [0x80FF2010, 2]
    assert twice["n_2"].tolist() == [7, -9]


def test_a_field_of_millions_of_values_is_refused(path: Path) -> None:
    with pytest.raises(InputError, match="has 4,000,005 values a point, but Scan4D reads at most 4,096"):
        read(save(path, COUNT="1 1 1 1 4000000 1"))


def organised(path: Path, encoding: str = "binary", fields: str = "x y z rgba", **changes: str) -> np.ndarray:
    """A cloud that a pinhole has measured, its points (12, 16, 3) float32 with a hole."""
    row, column = np.mgrid[:12, :16].astype(float)
    depth = 2 + 0.01 * row + 0.02 * column
    grid = np.stack([(column - 7) * depth / 20, (row - 5) * depth / 21, depth], axis=2).astype(np.float32)
    grid[3, 4] = np.nan
    rows = np.zeros((12, 16), [("p", "<f4", 3), ("rgba", "<u4")])
    rows["p"], rows["rgba"] = grid, np.arange(192).reshape(12, 16) * 0x10101
    kinds = {"FIELDS": fields, "SIZE": "4 4 4 4", "TYPE": "F F F U", "COUNT": "1 1 1 1"}
    kinds |= {"WIDTH": "16", "HEIGHT": "12", "POINTS": "192"}
    save(path, encoding, rows.tobytes(), **kinds | changes)
    return grid


def test_an_organised_cloud_is_a_range_view(path: Path) -> None:
    grid = organised(path)
    (view,) = read(path)
    seen = np.isfinite(grid).all(axis=2)
    assert (view.fx, view.fy, view.cx, view.cy) == pytest.approx((20, 21, 7.5, 5.5), abs=1e-4)
    assert np.array_equal(view.depth[seen], grid[seen][:, 2])
    assert np.array_equal(view.valid(), seen)
    assert view.positions() == pytest.approx(grid[seen], abs=1e-6)  # as the file has them
    assert np.array_equal(view.color[..., 0], np.arange(192).reshape(12, 16))
    assert (view.unit, view.name) == ("units", "camera")
    cloud = read_points(path)
    assert (len(cloud), cloud.dropped) == (191, 0)
    assert np.array_equal(cloud.ids, np.flatnonzero(seen))


def test_its_viewpoint_is_the_pose_of_the_camera(path: Path) -> None:
    grid = organised(path, VIEWPOINT="1 2 3 0 0 0 2")  # half a turn about z, of any length
    (view,) = read(path)
    seen = np.isfinite(grid).all(axis=2)
    assert view.eye.tolist() == [1, 2, 3]
    assert view.positions() == pytest.approx(grid[seen] * (-1, -1, 1) + (1, 2, 3), abs=1e-6)
    for words in ("1 2 3 0 0 0 0", "1 2 3 nan 0 0 0", "1 2 3", "a b c d e f g"):
        organised(path, VIEWPOINT=words)
        with pytest.raises(InputError, match=r"the line VIEWPOINT is not a pose|is not a rotation"):
            read(path)


@pytest.mark.parametrize(
    "changes",
    [
        {"WIDTH": "192", "HEIGHT": "1"},
        {"WIDTH": "1", "HEIGHT": "192"},
        {"WIDTH": "16", "HEIGHT": "11"},
        {"WIDTH": "32", "HEIGHT": "6"},  # which no pinhole has measured
        {"fields": "x y z label"},
        {"fields": "z x y rgba"},
    ],
)
def test_other_clouds_stay_points(changes: dict[str, str], path: Path) -> None:
    organised(path, **changes)
    cloud = read(path)
    assert isinstance(cloud, PointCloud)
    assert len(cloud) == 191
    assert cloud.dropped == 1


def test_clouds_of_real_cameras(data_dir: Path) -> None:
    for file in sorted((data_dir / "range/pcl_pairwise_kinect_5").glob("*.pcd")):
        (view,) = read(file)
        assert (view.fx, view.fy, view.cx, view.cy) == pytest.approx((525, 525, 320, 240), abs=1e-4)
        assert view.xy is None
        assert view.world_to_camera == pytest.approx(np.eye(4))  # its VIEWPOINT sets it upright
    (mug,) = read(next((data_dir / "range/pcl_organised").glob("*.pcd")))
    assert mug.xy is not None  # written with five decimals
    assert mug.color.dtype == np.uint8
    assert np.count_nonzero(mug.valid()) == 209_280
    assert np.einsum("ij,ij->i", mug.normals(), mug.positions()).max() < 0  # all face the camera


@pytest.mark.parametrize("told", ["0 0 0 1 0 0 0", None, "1 2", "1 2 nan 1 0 0 0"])
def test_a_viewpoint_that_nobody_tells(told: str | None, path: Path) -> None:
    assert read(save(path, VIEWPOINT=told)).viewpoint is None


def test_points_know_where_their_sensor_stood_and_it_is_written(path: Path) -> None:
    assert read(save(path, VIEWPOINT="0 0 0 0 1 0 0")).viewpoint.tolist() == [0, 0, 0]
    cloud = read(save(path, VIEWPOINT="10 -2.5 1e6 1 0 0 0"))
    assert cloud.viewpoint.tolist() == [10, -2.5, 1e6]
    assert cloud.world()[1].tolist() == [-1, 0, 2]  # it moves no point
    write(path, cloud)
    assert np.array_equal(read(path).viewpoint, cloud.viewpoint)

"""One scan in all formats of points: what zero normals, unmeasured points and scales of colours come to."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import laspy
import numpy as np
import pytest

from viewer import PointCloud, open_scan
from viewer.scan.timeline import Timeline

RNG = np.random.default_rng(8)
COUNT, ZEROS = 400, 100
POINTS = np.round(RNG.random((COUNT, 3)) * (150, 200, 190) + (-75, -100, 805), 2).astype(np.float32)
COLORS = RNG.integers(0, 200, (COUNT, 3))
COLORS[0] = 200, 100, 50
NAMES = {"points": "xyz", "normals": ("nx", "ny", "nz"), "colors": ("red", "green", "blue")}
PLY_TYPES = {"f4": "float", "f8": "double", "u1": "uchar", "u2": "ushort", "i4": "int"}

Arrays = dict[str, np.ndarray]


def columns_of(arrays: Arrays) -> dict[str, np.ndarray]:
    return {name: block[:, i] for key, block in arrays.items() for i, name in enumerate(NAMES[key])}


def rows_of(arrays: Arrays) -> str:
    columns = columns_of(arrays).values()
    return "".join(" ".join(repr(one.item()) for one in row) + "\n" for row in zip(*columns, strict=True))


def save_ply(path: Path, arrays: Arrays) -> None:
    columns = columns_of(arrays)
    records = np.rec.fromarrays(list(columns.values()), names=list(columns))
    kinds = (f"property {PLY_TYPES[each.dtype.str[1:]]} {name}\n" for name, each in columns.items())
    head = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {len(records)}\n{''.join(kinds)}end_header\n"
    )
    path.write_bytes(head.encode() + records.tobytes())


def save_ascii_ply(path: Path, arrays: Arrays) -> None:
    columns = columns_of(arrays)
    kinds = (f"property {PLY_TYPES[each.dtype.str[1:]]} {name}\n" for name, each in columns.items())
    count = len(arrays["points"])
    path.write_text(
        f"ply\nformat ascii 1.0\nelement vertex {count}\n{''.join(kinds)}end_header\n{rows_of(arrays)}"
    )


def save_pcd(path: Path, arrays: Arrays) -> None:
    columns, count = columns_of(arrays), len(arrays["points"])
    head = {
        "VERSION": ["0.7"],
        "FIELDS": [
            name.replace("nx", "normal_x").replace("ny", "normal_y").replace("nz", "normal_z")
            for name in columns
        ],
        "SIZE": [each.itemsize for each in columns.values()],
        "TYPE": [each.dtype.kind.upper() for each in columns.values()],
        "COUNT": [1] * len(columns),
        "WIDTH": [count],
        "HEIGHT": [1],
        "POINTS": [count],
        "DATA": ["binary"],
    }
    records = np.rec.fromarrays(list(columns.values()), names=list(columns))
    text = "".join(f"{key} {' '.join(map(str, values))}\n" for key, values in head.items())
    path.write_bytes(text.encode() + records.tobytes())


def save_npz(path: Path, arrays: Arrays) -> None:
    np.savez(path, **{key.replace("points", "positions"): block for key, block in arrays.items()})


def save_text(path: Path, arrays: Arrays) -> None:
    path.write_text(" ".join(columns_of(arrays)) + "\n" + rows_of(arrays))


def save_obj(path: Path, arrays: Arrays) -> None:
    blocks = np.hstack([arrays["points"], *([arrays["colors"]] if "colors" in arrays else [])])
    lines = [f"v {' '.join(map(str, row))}" for row in blocks.tolist()]
    if "normals" in arrays:
        lines += [f"vn {' '.join(map(str, row))}" for row in arrays["normals"].tolist()]
        lines += [f"f {i}//{i} {i + 1}//{i + 1} {i + 2}//{i + 2}" for i in range(1, len(blocks) - 1)]
    path.write_text("\n".join(lines) + "\n")


def save_las(path: Path, arrays: Arrays) -> None:
    header = laspy.LasHeader(point_format=3, version="1.2")
    header.scales = np.full(3, 1e-2)
    written = laspy.LasData(header)
    written.x, written.y, written.z = arrays["points"].T.astype(np.float64)
    if "colors" in arrays:
        written.red, written.green, written.blue = arrays["colors"].T.astype(np.uint16)
    written.write(path)


Save = Callable[[Path, Arrays], None]
FORMATS: dict[str, tuple[str, Save]] = {
    "binary PLY": (".ply", save_ply),
    "ascii PLY": (".ply", save_ascii_ply),
    "PCD": (".pcd", save_pcd),
    "NPZ": (".npz", save_npz),
    "text": (".txt", save_text),
    "OBJ": (".obj", save_obj),
    "LAS": (".las", save_las),
}
HAVE_NORMALS = [name for name in FORMATS if name != "LAS"]


@pytest.fixture
def opened(tmp_path: Path) -> Callable[..., Timeline]:
    """opened(format, arrays, ...): a scan of these frames, through a file each."""

    def write(name: str, *frames: Arrays, **corrections: str) -> Timeline:
        suffix, save = FORMATS[name]
        for number, arrays in enumerate(frames):
            save(tmp_path / f"f{number:03}{suffix}", arrays)
        return open_scan(tmp_path, read=corrections)

    return write


def first(timeline: Timeline) -> PointCloud:
    with timeline:
        return timeline.pose(0).cloud


@pytest.mark.parametrize("name", HAVE_NORMALS)
@pytest.mark.parametrize("value", [0.0, np.nan])
def test_normals_that_are_none_are_dropped_and_told_once(
    name: str, value: float, opened: Callable[..., Timeline]
) -> None:
    if name == "OBJ" and np.isnan(value):
        pytest.skip("OBJ writes no NaN")
    frame = {"points": POINTS, "normals": np.full((COUNT, 3), value, np.float32)}
    with opened(name, frame, frame) as timeline:
        assert [pose.cloud.normals for pose in timeline] == [None, None]
        assert [message.kind for message in timeline.messages] == ["normals"]
        assert timeline.reading["normals"].value == "dropped"


@pytest.mark.parametrize("name", HAVE_NORMALS)
def test_some_bad_normals_cost_no_others(name: str, opened: Callable[..., Timeline]) -> None:
    normals = np.tile(np.array([0, 0.6, 0.8], np.float32), (COUNT, 1))
    normals[5] = 0
    with opened(name, {"points": POINTS, "normals": normals}) as timeline:
        found = timeline.pose(0).cloud.normals
        np.testing.assert_allclose(np.delete(found, 5, axis=0), np.delete(normals, 5, axis=0), atol=1e-6)
        assert np.linalg.norm(found[5]) == pytest.approx(1)
        assert timeline.reading["normals"].value == "partly"
        assert "1 of 400" in timeline.reading["normals"].why


@pytest.mark.parametrize("name", HAVE_NORMALS)
def test_the_user_leaves_normals_out(name: str, opened: Callable[..., Timeline]) -> None:
    normals = np.tile(np.array([0, 0.6, 0.8], np.float32), (COUNT, 1))
    with opened(name, {"points": POINTS, "normals": normals}, normals="none") as timeline:
        assert timeline.pose(0).cloud.normals is None
        assert timeline.reading["normals"].source == "user"
        assert not timeline.messages


@pytest.mark.parametrize("name", FORMATS)
def test_points_at_zero_that_saw_nothing_are_left_out(name: str, opened: Callable[..., Timeline]) -> None:
    points = np.vstack([POINTS, np.zeros((ZEROS, 3), np.float32)])
    with opened(name, {"points": points}) as timeline:
        cloud = timeline.pose(0).cloud
        assert (len(cloud), cloud.dropped, cloud.dropped_by["0 0 0"]) == (COUNT, ZEROS, ZEROS)
        np.testing.assert_array_equal(cloud.ids, np.arange(COUNT))
        np.testing.assert_allclose(cloud.world(), POINTS, atol=1e-4)
        assert timeline.reading["missing"].value == "0 0 0"
        assert [message.text for message in timeline.messages] == [
            f"{timeline.label(0)}: Scan4D leaves out 100 points at 0 0 0, which were not measured"
        ]


@pytest.mark.parametrize("name", FORMATS)
def test_the_user_retains_points_at_zero(name: str, opened: Callable[..., Timeline]) -> None:
    points = np.vstack([POINTS, np.zeros((ZEROS, 3), np.float32)])
    cloud = first(opened(name, {"points": points}, missing="none"))
    assert (len(cloud), cloud.dropped) == (COUNT + ZEROS, 0)


@pytest.mark.parametrize("name", FORMATS)
@pytest.mark.parametrize("dtype", ["u1", "u2", "i4", "f4", "f8"])
def test_colors_of_8_bit_are_the_same_in_any_type(
    name: str, dtype: str, opened: Callable[..., Timeline]
) -> None:
    cloud = first(opened(name, {"points": POINTS, "colors": COLORS.astype(dtype)}))
    np.testing.assert_array_equal(cloud.colors[:, :3], COLORS)


@pytest.mark.parametrize("name", FORMATS)
@pytest.mark.parametrize("dtype", ["u2", "i4", "f4", "f8"])
def test_colors_of_16_bit_are_the_same_in_any_type(
    name: str, dtype: str, opened: Callable[..., Timeline]
) -> None:
    cloud = first(opened(name, {"points": POINTS, "colors": (COLORS * 257).astype(dtype)}))
    np.testing.assert_array_equal(cloud.colors[:, :3], COLORS)


@pytest.mark.parametrize("name", [name for name in FORMATS if name != "LAS"])
@pytest.mark.parametrize("dtype", ["f4", "f8"])
def test_colors_from_0_to_1(name: str, dtype: str, opened: Callable[..., Timeline]) -> None:
    cloud = first(opened(name, {"points": POINTS, "colors": (COLORS / 255).astype(dtype)}))
    np.testing.assert_array_equal(cloud.colors[:, :3], COLORS)


@pytest.mark.parametrize("name", ["binary PLY", "ascii PLY", "PCD", "LAS"])
@pytest.mark.parametrize("order", [[0, 1, 1], [1, 0, 1], [1, 1, 0]])
def test_a_dark_frame_is_dark_wherever_it_is(
    name: str, order: list[int], opened: Callable[..., Timeline]
) -> None:
    """Its numbers alone could be of 8 bit."""
    frames = [{"points": POINTS, "colors": (COLORS * scale).astype(np.uint16)} for scale in (1, 257)]
    with opened(name, *(frames[which] for which in order)) as timeline:
        brightest = [int(pose.cloud.colors[:, :3].max()) for pose in timeline]
        assert brightest == [[1, 200][which] for which in order]
        assert timeline.reading["colors"].value == 65535
        assert not timeline.reading.contradictions


@pytest.mark.parametrize("name", ["binary PLY", "PCD", "LAS"])
def test_a_frame_of_another_scale_is_reported(name: str, opened: Callable[..., Timeline]) -> None:
    """Six frames are dark: those that are looked at say 255, and the bright one between does not."""
    dark, bright = ({"points": POINTS, "colors": (COLORS * scale).astype(np.uint16)} for scale in (1, 257))
    with opened(name, dark, bright, *[dark] * 10) as timeline:
        for index in range(len(timeline)):
            timeline.pose(index)
        assert (timeline.reading["colors"].value, timeline.reading["colors"].source) == (255, "assumed")
        (found,) = timeline.reading.contradictions
        assert (found.frame, found.key) == (1, "colors")


@pytest.mark.parametrize("name", FORMATS)
def test_the_user_states_the_scale_of_colors(name: str, opened: Callable[..., Timeline]) -> None:
    frame = {"points": POINTS, "colors": COLORS.astype(np.uint16)}
    cloud = first(opened(name, frame, colors="65535"))
    np.testing.assert_allclose(cloud.colors[:, :3], COLORS / 257, atol=0.51)
    assert first(opened(name, frame, colors="none")).colors is None


@pytest.mark.parametrize("name", FORMATS)
def test_the_user_states_the_axes(name: str, opened: Callable[..., Timeline]) -> None:
    arrays = {"points": POINTS, "normals": np.tile(np.float32([0, 0.6, 0.8]), (COUNT, 1))}
    with opened(name, arrays, axes="+x -z +y") as timeline:
        cloud = timeline.pose(0).cloud
        np.testing.assert_allclose(cloud.world(), POINTS[:, [0, 2, 1]] * (1, -1, 1), atol=1e-4)
        if name != "LAS":
            np.testing.assert_allclose(cloud.normals[0], (0, -0.8, 0.6), atol=1e-6)
        assert timeline.reading["axes"].source == "user"
        assert not timeline.messages


@pytest.mark.parametrize("alpha", [0, 255, 7])
def test_an_alpha_of_zero_everywhere_is_no_alpha(alpha: int, tmp_path: Path) -> None:
    records = np.zeros(
        5, [*((axis, "f4") for axis in "xyz"), *((c, "u1") for c in ("red", "green", "blue", "alpha"))]
    )
    records["x"], records["red"], records["alpha"] = np.arange(5), 9, alpha
    kinds = "".join(f"property {PLY_TYPES[records.dtype[n].str[1:]]} {n}\n" for n in records.dtype.names)
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex 5\n{kinds}end_header\n"
    (tmp_path / "a.ply").write_bytes(head.encode() + records.tobytes())
    cloud = first(open_scan(tmp_path / "a.ply"))
    np.testing.assert_array_equal(cloud.colors, [[9, 0, 0, alpha or 255]] * 5)


def test_the_unit_that_a_comment_states(tmp_path: Path) -> None:
    for number, remark in enumerate(("units: mm", "units: mm", "units: m")):
        head = f"ply\nformat ascii 1.0\ncomment {remark}\nelement vertex 1\nproperty float x\n"
        text = f"{head}property float y\nproperty float z\nend_header\n1 2 3\n"
        (tmp_path / f"f{number}.ply").write_text(text)
    with open_scan(tmp_path) as timeline:
        assert timeline.pose(0).cloud is not None
        assert timeline.unit == "mm"
        assert not timeline.reading.contradictions
        assert timeline.pose(2).cloud is not None
        (found,) = timeline.reading.contradictions
        assert (found.frame, found.key) == (2, "unit")
    with open_scan(tmp_path, unit="ft") as timeline:
        assert timeline.pose(0).cloud is not None
        assert timeline.unit == "ft"


@pytest.mark.parametrize("suffix", [".ply", ".pcd"])
def test_decimal_commas_are_in_the_record(tmp_path: Path, suffix: str) -> None:
    heads = {
        ".ply": "ply\nformat ascii 1.0\nelement vertex 2\n"
        "property float x\nproperty float y\nproperty float z\nend_header\n",
        ".pcd": "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 2\nHEIGHT 1\nPOINTS 2\nDATA ascii\n",
    }
    path = tmp_path / f"a{suffix}"
    for rows, mark in (("1,5 2 3\n4 5,25 6\n", ","), ("1.5 2 3\n4 5.25 6\n", ".")):
        path.write_text(heads[suffix] + rows)
        with open_scan(path) as scan:
            assert scan.pose(0).cloud.world().tolist() == [[1.5, 2, 3], [4, 5.25, 6]]
            assert scan.reading["decimal"].value == mark

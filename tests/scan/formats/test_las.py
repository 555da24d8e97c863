"""LAS and LAZ: what is written by laspy, real files, and damaged ones."""

from __future__ import annotations

import re
from pathlib import Path

import laspy
import numpy as np
import pytest

from viewer.errors import InputError
from viewer.scan.formats import read
from viewer.scan.open import open_scan

RNG = np.random.default_rng(5)
COUNT = 100_000  # more than are unpacked at once
POINTS = np.round(RNG.random((COUNT, 3)) * 100 + (4e5, 5e6, 200), 3)


def save(path: Path, colors: np.ndarray | None = None, **scalars: np.ndarray) -> Path:
    header = laspy.LasHeader(point_format=3, version="1.2")
    header.scales, header.offsets = np.full(3, 1e-3), np.array([4e5, 5e6, 0])
    written = laspy.LasData(header)
    written.x, written.y, written.z = POINTS.T
    if colors is not None:
        scalars |= dict(zip(("red", "green", "blue"), colors.T, strict=True))
    for name, values in scalars.items():
        written[name] = values
    written.write(path)
    return path


@pytest.mark.parametrize("suffix", [".las", ".laz"])
@pytest.mark.parametrize("scale", [1, 257])
def test_points_colours_and_scalars_are_those_that_were_written(
    suffix: str, scale: int, tmp_path: Path
) -> None:
    colors = RNG.integers(0, 256, (COUNT, 3), np.uint16)
    intensity = RNG.integers(0, 1000, COUNT, np.uint16)
    path = save(tmp_path / f"a{suffix}", colors * np.uint16(scale), intensity=intensity)
    cloud = read(path)
    np.testing.assert_allclose(cloud.world(), POINTS, rtol=0, atol=1e-6)
    np.testing.assert_array_equal(cloud.colors[:, :3], colors)
    np.testing.assert_array_equal(cloud.scalars["intensity"], intensity)
    assert list(cloud.scalars) == ["intensity"], "what is the same for all tells nothing"


def test_room_for_colours_alone_is_no_colour(tmp_path: Path) -> None:
    assert read(save(tmp_path / "a.las")).colors is None


@pytest.mark.parametrize("suffix", [".las", ".laz"])
@pytest.mark.parametrize(("dimension", "frames"), [("frame", 3), ("confidence", 1)])
@pytest.mark.slow
def test_an_extra_dimension_may_tell_the_frames(
    suffix: str, dimension: str, frames: int, tmp_path: Path
) -> None:
    header = laspy.LasHeader(point_format=3, version="1.2")
    header.scales = np.full(3, 1e-3)
    header.add_extra_dim(laspy.ExtraBytesParams(name=dimension, type=np.int32))
    written = laspy.LasData(header)
    written.x, written.y, written.z = (POINTS[:300] - (4e5, 5e6, 0)).T
    written[dimension] = np.repeat([0, 10, 20], 100)
    written.write(tmp_path / f"a{suffix}")
    with open_scan(tmp_path / f"a{suffix}") as scan:
        assert len(scan) == frames
        last = scan.pose(frames - 1).cloud
    assert len(last) == 300 // frames
    if frames == 3:
        np.testing.assert_allclose(last.world(), POINTS[200:300] - (4e5, 5e6, 0), atol=1e-3)


@pytest.mark.parametrize(("up", "decision"), [(1, "stored"), (0, "dropped")])
def test_normals_that_are_all_the_same_are_normals(up: float, decision: str, tmp_path: Path) -> None:
    header = laspy.LasHeader(point_format=3, version="1.2")
    for name in ("nx", "ny", "nz"):
        header.add_extra_dim(laspy.ExtraBytesParams(name=name, type=np.float32))
    written = laspy.LasData(header)
    written.x, written.y, written.z = np.mgrid[:10, :10, :1].reshape(3, -1)
    written["nz"] = np.full(100, up)
    written.write(tmp_path / "a.las")
    with open_scan(tmp_path / "a.las") as scan:
        normals = scan.pose(0).cloud.normals
        assert scan.reading["normals"].value == decision
    assert (normals is None) == (decision == "dropped")


@pytest.mark.slow
def test_real_files_hold_as_many_points_as_stated(data_dir: Path) -> None:
    readme = (data_dir / "README.md").read_text(encoding="utf-8")
    stated = {name: int(count) for name, count in re.findall(r"\| (odd/las/\S+) \|.*? n=(\d+)", readme)}
    assert len(stated) > 40
    for name, count in stated.items():
        if count and "garbage" not in name:
            assert len(read(data_dir / name)) == count, name


def test_false_lengths_of_records_behind_the_points_take_no_memory(tmp_path: Path) -> None:
    written = laspy.LasData(laspy.LasHeader(point_format=6, version="1.4"))
    written.x = written.y = written.z = np.arange(5.0)
    written.evlrs = laspy.vlrs.vlrlist.VLRList([laspy.VLR("a", 1, "behind", b"b" * 50)])
    path = tmp_path / "a.las"
    written.write(path)
    whole = path.read_bytes()
    place = int.from_bytes(whole[235:243], "little")
    for at, size in ((235, 8), (243, 4), (place + 20, 8)):  # where they begin, their number, a length
        for value in (1 << 31, (1 << 8 * size) - 1):
            path.write_bytes(whole[:at] + value.to_bytes(size, "little") + whole[at + size :])
            np.testing.assert_array_equal(read(path).world()[:, 0], np.arange(5))


@pytest.mark.parametrize("suffix", [".las", pytest.param(".laz", marks=pytest.mark.slow)])
def test_damaged_files_are_refused_in_one_message(suffix: str, tmp_path: Path) -> None:
    path = save(tmp_path / f"a{suffix}")
    whole = path.read_bytes()
    for size in (1, 100, 104, 230, 400, len(whole) // 2):
        path.write_bytes(whole[:size])
        with pytest.raises(InputError) as caught:
            read(path)
        assert str(caught.value).startswith(str(path))
    path.write_bytes(whole[:100] + b"\xff\xff\xff\x7f" + whole[104:])
    with pytest.raises(InputError, match="states 2,147,483,647 records"):
        read(path)
    path.write_bytes(whole[:96] + b"\xf0\xff\xff\xff" + whole[100:])
    with pytest.raises(InputError, match="points begin at byte 4,294,967,280"):
        read(path)
    for at in RNG.integers(0, len(whole), 20):
        path.write_bytes(whole[:at] + bytes([whole[at] ^ 0xFF]) + whole[at + 1 :])
        try:
            assert len(read(path))
        except InputError:
            continue

"""Damaged files of every format: an InputError or points, and no allocation far beyond the file."""

from __future__ import annotations

import re
import struct
import tracemalloc
from pathlib import Path

import lzf
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from range_scenes import sphere_view

from viewer.errors import InputError
from viewer.scan import formats
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose
from viewer.scan.range_view import merge

HEAD = 600  # bytes of a file that hold its header
MOST_SEED = 6000  # bytes of a real file that is worth damaging
MOST_RATIO = 10  # of the memory that reading takes to the size of the file
SPARE = 20_000_000  # bytes that any file may take, however small

OUR_OWN_FAULT = (AttributeError, NameError, LookupError, RecursionError)  # and no library's

PLY_LIST = (
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    "property list uchar int seen_by\nend_header\n1 2 3 2 0 1\n4 5 6 0\n7 8 9 1 5\n"
)
PLY_BIG_LIST = (
    b"ply\nformat binary_big_endian 1.0\nelement camera 2\nproperty list int double pose\nelement vertex 2\n"
    b"property double x\nproperty float y\nproperty int z\nend_header\n"
    + struct.pack(">idi", 1, 0.5, 0)
    + struct.pack(">dfidfi", 1, 2, 3, 4, 5, 6)
)
PCD_HEAD = (
    "FIELDS x y z rgb n\nSIZE 4 4 4 4 2\nTYPE F F F F U\nCOUNT 1 1 1 1 2\nWIDTH 3\nHEIGHT 4\nPOINTS 12\nDATA "
)
OWN = {
    ".ply": [PLY_LIST.encode(), PLY_BIG_LIST],
    ".pcd": [
        f"{PCD_HEAD}ascii\n{'1 2 3 1e-38 7 8' * 12}\n".encode(),
        f"{PCD_HEAD}binary_compressed\n".encode()
        + struct.pack("<II", len(lzf.compress(bytes(240))), 240)
        + lzf.compress(bytes(240)),
    ],
    ".obj": [b"v 0 0 1 1 0 0\nv 1 2 3 0 1 0\nvn 0 0 1\nf 1//1 2//1 1//1\nf 1/2/1 -1//-1 2//1\n"],
    ".xyz": [b"1 2 3 4 5 6\n7 8 9 1 2 3\n", b"# x y z\n1,2,3\n4,5,6\n"],
    ".csv": [b'"x";"y";"z";"GPS Time"\r\n1;2;3;4\r\n5;6;7;8\r\n'],
    ".txt": [b"X\tY\tZ\tR\tG\tB\n1\t2\t3\t4\t5\t6\n"],
    ".pts": [b"2\n1 2 3 4 5 6 7\n8 9 1 2 3 4 5\n"],
}


def save_arrays(folder: Path) -> None:
    sequence = np.ones((3, 8, 3), np.float32)
    np.save(folder / "seed.npy", sequence)
    np.save(folder / "seed2.npy", np.asfortranarray(sequence[0].astype(">f8")))
    np.savez(
        folder / "seed3.npz", positions=sequence, radii=np.ones(8), origin=np.ones(3), times=np.arange(3)
    )
    views = (sphere_view((0, 0, 4), size=(9, 7)), sphere_view((3, 0, 4), size=(6, 8), name="right"))
    formats.write(folder / "seed5.exr", merge(views), views)
    np.savez_compressed(folder / "seed4.npz", positions=sequence, label=np.ones((3, 8), np.int8))


@pytest.fixture(scope="module")
def seeds(
    near_cloud: PointCloud, tmp_path_factory: pytest.TempPathFactory, request: pytest.FixtureRequest
) -> dict[str, list[bytes]]:
    """Whole files by suffix: our own, and small real ones where they are at hand."""
    folder = tmp_path_factory.mktemp("seeds")
    save_arrays(folder)
    for suffix in formats.writable_suffixes():
        formats.write(folder / f"full{suffix}", near_cloud)
    for suffix in formats.scan_suffixes():
        poses = [Pose(index, index / 25, "", near_cloud) for index in range(3)]
        formats.write_poses(folder / f"scan{suffix}", poses, "mm")
    files = {suffix: list(OWN.get(suffix, [])) for suffix in formats.known_suffixes()}
    for path in sorted(folder.iterdir()):
        files[path.suffix].append(path.read_bytes())
    try:
        data_dir = request.getfixturevalue("data_dir")
    except pytest.skip.Exception:
        return files
    for path in sorted((data_dir / "odd").rglob("*")):
        if path.suffix in files and path.stat().st_size < MOST_SEED:
            files[path.suffix].append(path.read_bytes())
    return files


def cut(data: bytes, at: int, which: int, new: bytes) -> bytes:
    return data[: at % (len(data) + 1)]


def flip(data: bytes, at: int, which: int, new: bytes) -> bytes:
    changed = bytearray(data or b"x")
    changed[at % len(changed)] ^= 1 << which % 8
    return bytes(changed)


def splice(data: bytes, at: int, which: int, new: bytes) -> bytes:
    at %= len(data) + 1
    return data[:at] + new + data[at + which % 40 :]


def renumber(data: bytes, at: int, which: int, new: bytes) -> bytes:
    """Replace a number of the header by one that is harder to bear."""
    numbers = list(re.finditer(rb"-?\d+", data[:HEAD])) or [re.match(b"", data)]
    old = numbers[at % len(numbers)]
    return data[: old.start()] + b"%d" % HARD_NUMBERS[which % len(HARD_NUMBERS)] + data[old.end() :]


def reword(data: bytes, at: int, which: int, new: bytes) -> bytes:
    """Remove, double or exchange a word of the header."""
    words = list(re.finditer(rb"[^\s,;]+", data[:HEAD])) or [re.match(b"", data)]
    old, other = words[at % len(words)], words[which % len(words)]
    choices = [b"", old[0] + b" " + old[0], other[0], b"nan", b"\xff\x00", b"\n", new]
    return data[: old.start()] + choices[which % len(choices)] + data[old.end() :]


HARD_NUMBERS = [-1, 0, 1, 3, 255, 10**4, 2**31 - 1, 2**32, 10**12, 2**63, 10**40]
ANY = st.integers(0, 2**32 - 1)
DAMAGES = st.lists(
    st.tuples(st.sampled_from([cut, flip, splice, renumber, reword]), ANY, ANY, st.binary(max_size=40)),
    min_size=1,
    max_size=5,
)


def read_or_refuse(path: Path) -> InputError | None:
    """The error where the file is refused; what is read must hold together."""
    try:
        clouds = read_all(path)
    except InputError as error:
        return error
    for cloud in clouds:
        assert len(cloud) > 0
        assert np.isfinite(cloud.positions).all()
        assert all(len(values) == len(cloud) for values in cloud.scalars.values())
    return None


def read_all(path: Path) -> list[PointCloud]:
    formats.read_times(path)
    return [formats.read_points(path, frame) for frame in range(min(formats.frame_count(path), 4))]


@pytest.mark.parametrize("suffix", formats.known_suffixes())
@settings(max_examples=150)
@given(choice=ANY, damages=DAMAGES)
def test_damage_does_no_harm(
    suffix: str,
    choice: int,
    damages: list[tuple],
    seeds: dict[str, list[bytes]],
    tmp_path_factory: pytest.TempPathFactory,
) -> None:
    content = seeds[suffix][choice % len(seeds[suffix])]
    for damage, *how in damages:
        content = damage(content, *how)
    path = tmp_path_factory.getbasetemp() / f"damaged{suffix}"
    path.write_bytes(content)
    tracemalloc.start()
    error = read_or_refuse(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < MOST_RATIO * len(content) + SPARE
    if error is not None:
        assert str(error).startswith(str(path))
        assert error.hint
        assert not isinstance(error.__cause__, OUR_OWN_FAULT)

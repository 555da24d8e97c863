"""What a file may take to be read: memory in peak, regular files alone, all of it there to the end."""

from __future__ import annotations

import os
import stat
import struct
import subprocess
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import BinaryIO

import lzf
import numpy as np
import pytest
from range_scenes import sphere_view
from scenes import rarely_together

from viewer.errors import InputError
from viewer.scan import admission, formats
from viewer.scan.admission import READ_VARIABLE, admit, most_memory, opened, read_exactly
from viewer.scan.formats import exr, ply
from viewer.scan.open import find_source
from viewer.scan.points import PointCloud
from viewer.scan.range_view import RangeView, merge
from viewer.scan.reading.sequence import Decided

_READS = """
import sys
from viewer.errors import InputError
from viewer.scan import formats
from viewer.scan.pose import Pose

def peak():
    status = open("/proc/self/status").read()
    return int(status.split("VmHWM:")[1].split()[0]) << 10

formats.known_suffixes()
before = peak()
try:
    Pose.of(0, 0.0, "", formats.read(sys.argv[1]))
except InputError as error:
    print(error, file=sys.stderr)
print(peak() - before)
"""


def peak_of_reading(path: Path) -> tuple[int, str]:
    """Bytes beyond what a process of its own takes before it reads the file; what it says."""
    done = subprocess.run([sys.executable, "-c", _READS, path], capture_output=True, text=True, check=True)
    return int(done.stdout), done.stderr


def constant_npz(path: Path) -> None:
    """7.5 million points of 12 bytes, and a scalar: what packs to next to nothing."""
    np.savez_compressed(path, positions=np.zeros((5_500_000, 3), np.float32), q=np.zeros(5_500_000))


def constant_pcd(path: Path) -> None:
    count = 12_000_000
    packed = lzf.compress(bytes(12 * count))
    head = f"FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nPOINTS {count}\nDATA binary_compressed\n"
    path.write_bytes(head.encode() + struct.pack("<II", len(packed), 12 * count) + packed)


def flat_exr(path: Path) -> None:
    """A picture of which every pixel sees a point, and all see the same."""
    shape = 2000, 1500
    pose = np.eye(4)
    view = RangeView(
        depth=np.ones(shape, np.float32), mask=np.ones(shape, bool), color=np.zeros((*shape, 3), np.float16),
        fx=1000, fy=1000, cx=750, cy=1000, world_to_camera=pose, name="flat",
    )  # fmt: skip
    exr.write_views(path, [view])


def short_rows(path: Path) -> None:
    path.write_text("1 2 3\n" * 1_500_000)


def short_rows_with_nan(path: Path) -> None:
    path.write_text("1 2 3 4 5 6 7 8\n1 nan 3 4 5 6 7 8\n" * 300_000)


def ply_with_lists(path: Path) -> None:
    names = "".join(f"property float {name}\n" for name in "xyz")
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex 700000\n{names}property list uchar int i\n"
    path.write_bytes(f"{head}end_header\n".encode() + struct.pack("<3fBi", 1, 2, 3, 1, 7) * 700_000)


@pytest.mark.skipif(not os.path.exists("/proc/self/status"), reason="peaks are read from /proc")
@pytest.mark.parametrize(
    ("make", "suffix"),
    [
        (constant_npz, ".npz"),
        (short_rows, ".xyz"),
        *rarely_together(
            (constant_pcd, ".pcd"),
            (flat_exr, ".exr"),
            (short_rows_with_nan, ".txt"),
            (ply_with_lists, ".ply"),
        ),
    ],
)
@pytest.mark.slow
def test_reading_takes_ten_times_the_file_and_200_megabytes_at_most(
    make: Callable[[Path], None], suffix: str, tmp_path: Path
) -> None:
    path = tmp_path / f"scan{suffix}"
    make(path)
    peak, _ = peak_of_reading(path)
    assert peak <= 10 * path.stat().st_size + 200_000_000


@pytest.mark.parametrize(
    ("make", "suffix"),
    [(constant_npz, ".npz"), *rarely_together((constant_pcd, ".pcd"), (flat_exr, ".exr"))],
)
def test_what_unpacks_to_too_much_is_refused_and_can_be_allowed(
    make: Callable[[Path], None], suffix: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / f"scan{suffix}"
    make(path)
    monkeypatch.setenv(READ_VARIABLE, "20")
    with pytest.raises(
        InputError,
        match=rf"reading this file of .* bytes would need .* set the environment variable {READ_VARIABLE}=",
    ):
        formats.read(path)
    monkeypatch.setenv(READ_VARIABLE, "2000")
    assert formats.read(path)


def columns_of(count: int, dropped: bool) -> dict[str, np.ndarray]:
    """Of points that pack well, a third of which have no place where `dropped`."""
    x = np.full(count, 3, np.float32)
    x[::3] = np.nan if dropped else 3
    zeros = np.zeros(count, np.float32)
    return dict(
        zip(
            ["x", "y", "z", "nx", "ny", "nz", "q"], [x, zeros, zeros, zeros, zeros, zeros, zeros], strict=True
        )
    )


def npz_of_columns(path: Path, dropped: bool) -> None:
    columns = columns_of(4_500_000, dropped)
    positions, normals = (
        np.stack([columns[name] for name in names.split()], 1) for names in ("x y z", "nx ny nz")
    )
    colors = np.zeros((len(positions), 3), np.uint8)
    np.savez_compressed(path, positions=positions, normals=normals, colors=colors, q=columns["q"])


def pcd_of_columns(path: Path, dropped: bool) -> None:
    columns = columns_of(3_500_000, dropped) | {"rgb": np.full(3_500_000, 0x808080, np.uint32)}
    data = b"".join(column.tobytes() for column in columns.values())
    packed = lzf.compress(data)
    head = f"FIELDS {' '.join(columns)}\nSIZE{' 4' * 8}\nTYPE{' F' * 7} U\nCOUNT{' 1' * 8}\nPOINTS 3500000\n"
    path.write_bytes(
        f"{head}DATA binary_compressed\n".encode() + struct.pack("<II", len(packed), len(data)) + packed
    )


@pytest.mark.slow
@pytest.mark.skipif(not os.path.exists("/proc/self/status"), reason="peaks are read from /proc")
@pytest.mark.parametrize("dropped", [False, True])
@pytest.mark.parametrize(("make", "suffix"), [(npz_of_columns, ".npz"), (pcd_of_columns, ".pcd")])
def test_what_reading_is_said_to_take_is_what_it_takes(
    make: Callable[[Path, bool], None],
    suffix: str,
    dropped: bool,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """It is refused below its peak, and not any more above 1.3 times that."""
    path = tmp_path / f"scan{suffix}"
    make(path, dropped)
    monkeypatch.setenv(READ_VARIABLE, "4000")
    peak, said = peak_of_reading(path)
    assert peak > 180_000_000
    assert not said
    monkeypatch.setenv(READ_VARIABLE, str(peak >> 20))
    with pytest.raises(InputError, match=r"reading this file of .* bytes would need"):
        formats.read(path)
    monkeypatch.setenv(READ_VARIABLE, str(int(1.3 * peak) >> 20))
    assert len(formats.read(path))


def test_the_memory_that_may_be_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(READ_VARIABLE, raising=False)
    assert most_memory(1 << 20) == (180 + 10) << 20
    assert most_memory(1 << 50) == admission._half_of_memory()
    monkeypatch.setenv(READ_VARIABLE, "7")
    assert most_memory(1 << 50) == 7 << 20
    admit(1, 7 << 20)
    with pytest.raises(InputError, match="set the environment variable SCAN4D_READ_MB=8"):
        admit(1, (7 << 20) + 1)
    monkeypatch.setenv(READ_VARIABLE, "much")
    with pytest.raises(InputError, match=f"{READ_VARIABLE}: 'much' is not a number of megabytes"):
        admit(1, 1)


# --- what is not a regular file ----------------------------------------------------------------


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no pipes with names")
def test_a_pipe_is_refused_and_not_waited_for(tmp_path: Path) -> None:
    for suffix in formats.known_suffixes():
        pipe = tmp_path / f"scan{suffix}"
        os.mkfifo(pipe)
        with pytest.raises(InputError, match="is a device or a pipe, not a file"):
            formats.read(pipe)
        with pytest.raises(InputError, match="is neither a file nor a folder"):
            find_source(pipe)
        with pytest.raises(OSError, match="regular file"), opened(pipe):
            pass
    with pytest.raises(InputError, match="holds no scan files"):
        find_source(tmp_path)


@pytest.mark.skipif(not os.path.exists("/dev/zero"), reason="there is no such device")
def test_a_device_behind_a_link_is_refused(tmp_path: Path) -> None:
    link = tmp_path / "scan.ply"
    link.symlink_to("/dev/zero")
    with pytest.raises(InputError, match="is a device or a pipe, not a file"):
        formats.read(link)


def test_a_file_that_may_not_be_read_is_told_as_such(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "scan.ply"
    path.write_bytes(b"ply\n")
    path.chmod(0)
    if os.access(path, os.R_OK):  # root may read anything

        def refuse(path: Path) -> None:
            raise PermissionError(13, "Permission denied", str(path))

        monkeypatch.setattr(ply, "opened", refuse)
    with pytest.raises(InputError, match=r"permission denied\. Check the permissions") as caught:
        formats.read(path)
    path.chmod(stat.S_IRWXU)
    assert "export it again" not in str(caught.value)


# --- files that get shorter while they are read -------------------------------------------


def write_all_kinds(folder: Path, cloud: PointCloud) -> list[Path]:
    for suffix in formats.writable_suffixes():
        formats.write(folder / f"scan{suffix}", cloud)
    np.save(folder / "scan.npy", cloud.world())
    rows = "".join(f"{x} {y} {z}\n" for x, y, z in cloud.world())
    (folder / "scan.xyz").write_text(rows)
    (folder / "scan.obj").write_text("".join(f"v {row}\n" for row in rows.splitlines()))
    views = (sphere_view((0, 0, 4), size=(90, 70)),)
    formats.write(folder / "scan.exr", merge(views), views)
    return sorted(folder.iterdir())


def test_a_file_cut_while_it_is_read_gives_no_partial_frame(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    cloud = PointCloud.from_arrays(np.random.default_rng(0).random((3000, 3)))
    size_of = admission.size_of
    for path in write_all_kinds(tmp_path, cloud):
        formats.read(path)
        uncut = path.stat().st_size

        def cut_after_the_first_look(stream: BinaryIO, path: Path = path, uncut: int = uncut) -> int:
            size = size_of(stream)
            if size == uncut:
                os.truncate(path, size // 2)
            return size

        monkeypatch.setattr(admission, "size_of", cut_after_the_first_look)
        with pytest.raises(Exception) as caught:  # noqa: PT011  the door makes one message of any
            formats._scanned(formats._readable(path), path, 0, Decided())
        assert path.stat().st_size == uncut // 2
        assert str(caught.value)
        monkeypatch.setattr(admission, "size_of", size_of)


def test_faces_that_end_while_they_are_read_are_none(tmp_path: Path) -> None:
    path = tmp_path / "data"
    path.write_bytes(bytes(100))
    with (
        opened(path) as stream,
        pytest.raises(InputError, match="ends early: it has 100 bytes where 101 bytes should be"),
    ):
        read_exactly(stream, 101)
    with (
        pytest.raises(InputError, match="another program shortened this file while Scan4D read it"),
        opened(path) as stream,
    ):
        os.truncate(path, 50)


# --- archives -----------------------------------------------------------------------------


@pytest.mark.parametrize("packing", [zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_members_that_numpy_does_not_write_are_refused(packing: int, tmp_path: Path) -> None:
    path = tmp_path / "scan.npz"
    np.save(tmp_path / "positions.npy", np.eye(3))
    with zipfile.ZipFile(path, "w", packing) as archive:
        archive.write(tmp_path / "positions.npy", "positions.npy")
    with pytest.raises(
        InputError, match=r"'positions.npy' is encrypted, or compressed in a way that numpy does not use"
    ):
        formats.read(path)


def test_encrypted_members_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "scan.npz"
    np.savez(path, positions=np.eye(3))
    data = bytearray(path.read_bytes())
    data[data.index(b"PK\x01\x02") + 8] |= 1
    path.write_bytes(bytes(data))
    with pytest.raises(InputError, match="is encrypted, or compressed in a way that numpy does not use"):
        formats.read(path)


def test_two_arrays_of_one_name_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "scan.npz"
    np.save(tmp_path / "positions.npy", np.eye(3))
    with zipfile.ZipFile(path, "w") as archive:
        archive.write(tmp_path / "positions.npy", "positions.npy")
        with pytest.warns(UserWarning, match="Duplicate name"):
            archive.write(tmp_path / "positions.npy", "positions.npy")
    with pytest.raises(InputError, match=r"two arrays have the name 'positions.npy'"):
        formats.read(path)


def test_archives_of_very_many_arrays_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "scan.npz"
    with zipfile.ZipFile(path, "w") as archive:
        for number in range(1025):
            archive.writestr(f"a{number}.npy", b"")
    with pytest.raises(InputError, match="has 1,025 arrays, but Scan4D reads at most 1,024"):
        formats.read(path)

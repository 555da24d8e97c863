"""The door to all formats: what is known, what is refused, and how files are written."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from viewer.errors import InputError
from viewer.scan import formats
from viewer.scan.formats import npz, ply
from viewer.scan.points import PointCloud


def test_what_is_written() -> None:
    assert formats.writable_suffixes() == [".npz", ".pcd", ".ply"]


def test_upper_case_suffixes_are_known(tmp_path: Path) -> None:
    (tmp_path / "SCAN.XYZ").write_text("1 2 3\n")
    assert len(formats.read(tmp_path / "SCAN.XYZ")) == 1


def test_unknown_suffix_lists_the_known(tmp_path: Path) -> None:
    (tmp_path / "scan.stp").write_text("solid")
    for call in (formats.read, formats.frame_count):
        with pytest.raises(InputError, match=r"unknown file suffix '\.stp'") as caught:
            call(tmp_path / "scan.stp")
        assert all(suffix in str(caught.value) for suffix in formats.known_suffixes())
    for suffix in (".json", ".svg"):  # near to one that is another format
        path = tmp_path / f"scan{suffix}"
        path.write_text("{}")
        with pytest.raises(InputError, match=r"unknown file suffix '\..*'\. Known: \.asc, \.csv, ") as caught:
            formats.read(path)
        assert "Did you mean" not in str(caught.value)
    with pytest.raises(InputError, match=r"cannot write '\.obj' files.*\.npz, \.pcd, \.ply"):
        formats.write(tmp_path / "scan.obj", PointCloud.from_arrays(np.eye(3)))


def test_frames_of_single_moment_files(tmp_path: Path) -> None:
    (tmp_path / "one.xyz").write_text("1 2 3\n")
    assert formats.frame_count(tmp_path / "one.xyz") == 1
    assert formats.read_times(tmp_path / "one.xyz") is None
    for frame in (1, -1):
        with pytest.raises(InputError, match=f"has no pose {frame}. The file contains 1"):
            formats.read(tmp_path / "one.xyz", frame)


@pytest.mark.parametrize("error", [OSError(28, "No space left on device"), KeyboardInterrupt()])
def test_a_failed_write_leaves_what_was_there(
    error: BaseException, full_cloud: PointCloud, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(path: Path, cloud: PointCloud) -> None:
        path.write_text("half of it")
        raise error

    (tmp_path / "scan.ply").write_text("former")
    monkeypatch.setattr(ply, "write", fail)
    with pytest.raises(InputError if isinstance(error, OSError) else KeyboardInterrupt):
        formats.write(tmp_path / "scan.ply", full_cloud)
    assert [path.name for path in tmp_path.iterdir()] == ["scan.ply"]
    assert (tmp_path / "scan.ply").read_text() == "former"


@pytest.mark.parametrize(
    ("error", "hint"),
    [(ValueError("odd"), "Choose another format"), (OSError("odd"), "Check free space and permissions")],
)
def test_a_failed_write_hints_at_the_disk_only_for_errors_of_the_system(
    error: Exception, hint: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(path: Path, cloud: PointCloud) -> None:
        raise error

    monkeypatch.setattr(ply, "write", fail)
    with pytest.raises(InputError, match=rf"cannot be written.*: odd\. {hint}"):
        formats.write(tmp_path / "scan.ply", PointCloud.from_arrays(np.eye(3)))


def test_write_into_a_missing_folder_names_it(full_cloud: PointCloud, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="there is no folder"):
        formats.write(tmp_path / "none" / "scan.ply", full_cloud)


def test_out_of_memory_is_a_message(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def exhaust(path: Path, frame: int) -> PointCloud:
        raise MemoryError

    (tmp_path / "big.npz").write_bytes(b"x")
    monkeypatch.setattr(npz, "frame_count", lambda path: 3)
    monkeypatch.setattr(npz, "read", exhaust)
    with pytest.raises(InputError, match=r"big\.npz, frame 3: cannot be read as NPZ: not enough memory"):
        formats.read(tmp_path / "big.npz", 2)


def test_simple_files_need_no_other_library(full_cloud: PointCloud, tmp_path: Path) -> None:
    """PLY and NPZ are read with numpy alone."""
    formats.write(tmp_path / "scan.ply", full_cloud)
    formats.write(tmp_path / "scan.npz", full_cloud)
    code = (
        "import sys; from viewer.scan import formats\n"
        f"formats.read({str(tmp_path / 'scan.ply')!r}); formats.read({str(tmp_path / 'scan.npz')!r})\n"
        "print(*({'open3d', 'plyfile', 'lzf'} & set(sys.modules)))"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == ""


def test_what_can_be_converted_is_refused_with_what_converts_it(tmp_path: Path) -> None:
    for suffix in (".e57", ".ptx"):
        path = tmp_path / f"scan{suffix}"
        path.write_text("none")
        with pytest.raises(InputError, match=f"Convert it with 'pdal translate FILE{suffix} FILE.ply'"):
            formats.read(path)

"""Names of files where the system does not play along."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

from viewer.app.session import known_as
from viewer.files import absolute, free_file, read_text, working_folder


def test_a_path_is_told_from_the_root(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert working_folder() == Path.cwd()
    for path in ("a", "./b/../a", "..", "", "/a//b/", str(tmp_path / "a")):
        assert absolute(path) == os.path.abspath(path)


@pytest.mark.skipif(sys.platform == "win32", reason="a folder in use cannot be removed")
def test_a_working_directory_may_be_gone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    gone = tmp_path / "gone"
    gone.mkdir()
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.chdir(gone)
    gone.rmdir()
    assert working_folder() == tmp_path
    assert known_as("scan.ply") == str(tmp_path / "scan.ply")


def test_a_folder_that_cannot_be_looked_into_has_free_names(tmp_path: Path) -> None:
    folder = tmp_path / ("f" * 300)
    assert free_file(folder, ".png") == folder / "scan4d_0001.png"


def test_text_is_read_whole_or_not_at_all(tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_bytes("grüße\n".encode())
    assert read_text(tmp_path / "a.txt", 8) == "grüße\n"
    with pytest.raises(OSError, match="longer than 7 bytes"):
        read_text(tmp_path / "a.txt", 7)
    with pytest.raises(FileNotFoundError):
        read_text(tmp_path / "b.txt", 8)
    (tmp_path / "c.txt").write_bytes(b"\xff")
    with pytest.raises(UnicodeDecodeError):
        read_text(tmp_path / "c.txt", 8)


@pytest.mark.skipif(sys.platform == "win32", reason="has neither")
def test_pipes_and_devices_are_not_read(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    for path in (tmp_path / "pipe", "/dev/zero"):
        with pytest.raises(OSError, match="not a regular file"):
            read_text(path, 100)
    with pytest.raises(IsADirectoryError):
        read_text(tmp_path, 100)

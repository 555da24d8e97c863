"""Temporary files and folders: what killed processes leave is removed, and nothing else ever."""

from __future__ import annotations

import os
import re
import secrets
import signal
import stat
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from viewer.errors import InputError
from viewer.files import whole_file
from viewer.helper import start_python
from viewer.unfinished import remove_leftovers, temporary_file, temporary_folder

TOKEN = "0123456789abcdef"
ROOT = Path(__file__).resolve().parents[1]
WORK = """
import sys, time
from pathlib import Path
from viewer.unfinished import temporary_file, temporary_folder
folder = Path(sys.argv[1])
with temporary_file(folder / "a.png") as file, temporary_folder(folder) as inside:
    file.write_text("half")
    (inside / "b.txt").write_text("half")
    print("there", flush=True)
    time.sleep(600)
"""
WRITE = (
    "import sys; from viewer.files import whole_file\nwith whole_file(sys.argv[1]) as p: p.write_text('a')"
)

posix = pytest.mark.skipif(sys.platform == "win32", reason="signals and links are POSIX's")


@pytest.fixture(autouse=True)
def notes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of the notes: one of this test's own."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path / "cache" / "scan4d" / "unfinished"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Where temporary files are made."""
    (tmp_path / "made").mkdir()
    return tmp_path / "made"


@contextmanager
def at_work(folder: Path) -> Iterator[subprocess.Popen[str]]:
    """A process that has made a file and a folder."""
    command = [sys.executable, "-c", WORK, str(folder)]
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "there\n"
        yield process
        process.kill()


@posix
def test_what_a_killed_process_leaves_is_removed(folder: Path, notes: Path) -> None:
    with at_work(folder) as process:
        process.kill()
        process.wait()
        assert len(list(folder.iterdir())) == 2
        remove_leftovers()
        assert list(folder.iterdir()) == []
        assert list(notes.iterdir()) == []


@posix
def test_what_a_living_process_makes_stays(folder: Path) -> None:
    with at_work(folder):
        remove_leftovers()
        assert len(list(folder.iterdir())) == 2


@posix
def test_nobody_else_can_read_what_is_made(folder: Path, notes: Path) -> None:
    with at_work(folder):
        assert stat.S_IMODE(notes.stat().st_mode) == stat.S_IMODE(notes.parent.stat().st_mode) == 0o700
        assert [stat.S_IMODE(path.stat().st_mode) for path in notes.iterdir()] == [0o600] * 2
        (inside,) = (path for path in folder.iterdir() if path.is_dir())
        assert stat.S_IMODE(inside.stat().st_mode) == 0o700


@posix
def test_who_ends_well_leaves_no_notes(folder: Path, notes: Path) -> None:
    subprocess.run([sys.executable, "-c", WRITE, str(folder / "a.txt")], cwd=ROOT, check=True)
    assert [path.name for path in folder.iterdir()] == ["a.txt"]
    assert list(notes.iterdir()) == []


@posix
def test_nothing_but_our_own_is_removed_whatever_is_noted(
    folder: Path, notes: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder)
    for name in ("a.png", ".bashrc", ".scan4d", f".scan4d_{TOKEN}", ".a.part.png", f"a.{TOKEN}.part.png"):
        (folder / name).write_text("precious")
    for name in ("b", f".a.{TOKEN}.part.png", ".scan4d_"):
        (folder / name).mkdir()
        (folder / name / "c").write_text("precious")
    (folder / f".scan4d_{TOKEN[::-1]}").symlink_to(folder / "b")
    (folder / f".b.{TOKEN}.part.txt").symlink_to(folder / "a.png")
    (folder / f".relative.{TOKEN}.part.png").write_text("precious")
    (tmp_path / "through").symlink_to(folder)
    (folder / f".linked.{TOKEN}.part.png").write_text("precious")
    before = sorted(folder.rglob("*"))
    places = [str(path) for path in [*before, folder, folder / "b" / "..", "/", tmp_path]]
    places = [place for place in places if "linked" not in place and "relative" not in place]
    places += [
        f".relative.{TOKEN}.part.png",
        str(tmp_path / "through" / f".linked.{TOKEN}.part.png"),
        "",
        "\udcff",
    ]
    notes.mkdir(parents=True)
    (notes / "1_a.lock").touch()
    (notes / "1_a").write_bytes(b"\0".join(map(os.fsencode, places)))
    remove_leftovers()
    assert sorted(folder.rglob("*")) == before


@posix
def test_what_stands_inside_a_link_of_a_folder_stays(folder: Path, notes: Path) -> None:
    (folder / "kept").mkdir()
    (folder / "kept" / "a").write_text("precious")
    made = folder / f".scan4d_{TOKEN}"
    made.mkdir()
    (made / "link").symlink_to(folder / "kept")
    notes.mkdir(parents=True)
    (notes / "1_a.lock").touch()
    (notes / "1_a").write_bytes(os.fsencode(made))
    remove_leftovers()
    assert sorted(path.name for path in folder.rglob("*")) == ["a", "kept"]


def test_without_a_cache_folder_files_are_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    remove_leftovers()
    done = subprocess.run(
        [sys.executable, "-c", WRITE, str(tmp_path / "a.txt")], cwd=ROOT, capture_output=True, text=True
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.txt", "file"]


@pytest.mark.parametrize("stem", ["n" * 251, "é" * 125 + "n", "a"])
def test_a_name_as_long_as_can_be_is_written(folder: Path, stem: str) -> None:
    path = folder / f"{stem}.txt"
    with whole_file(path) as temporary:
        assert [entry.name for entry in folder.iterdir()] == [temporary.name]
        temporary.write_text("whole")
    assert [entry.name for entry in folder.iterdir()] == [path.name]


@posix
def test_no_file_is_made_where_another_has_planted_a_link(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Even where the name can be foretold: the link stays, and so does what it leads to."""
    monkeypatch.setattr(secrets, "token_hex", lambda size: "0" * 2 * size)
    (tmp_path / "precious").write_text("precious")
    with whole_file(folder / "a.txt") as temporary:
        name = temporary.name
    for target in ("precious", "missing"):
        (folder / name).symlink_to(tmp_path / target)
        with pytest.raises(InputError, match="cannot be written"), whole_file(folder / "a.txt") as temporary:
            temporary.write_text("planted")
        assert (tmp_path / "precious").read_text() == "precious"
        assert not (tmp_path / "missing").exists()
        (folder / name).unlink(missing_ok=True)
    (folder / f".scan4d_{'0' * 16}").symlink_to(tmp_path)
    with pytest.raises(FileExistsError), temporary_folder(folder):
        pass


def test_names_of_temporary_files_are_made_by_chance(folder: Path) -> None:
    names = set()
    for _ in range(20):
        with temporary_file(folder / "a.txt") as file, temporary_folder(folder) as inside:
            names |= {file.name, inside.name}
    assert len(names) == 40
    assert all(len(set(re.findall("[0-9a-f]{16}", name))) == 1 for name in names)
    assert not any(str(os.getpid()) == part for name in names for part in name.split("."))


@posix
@pytest.mark.slow
def test_what_is_left_of_unpacking_goes_at_the_next_start(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A process that is killed while it reads LAZ leaves its unpacked points; any command removes them."""
    import laspy

    monkeypatch.setenv("TMPDIR", str(folder))
    rng = np.random.default_rng(0)
    las = laspy.LasData(laspy.LasHeader(point_format=3, version="1.2"))
    las.x, las.y, las.z = rng.normal(size=(3, 2_000_000))
    las.write(tmp_path / "a.laz")
    command = [sys.executable, "-m", "viewer.cli", "info"]
    with subprocess.Popen([*command, str(tmp_path / "a.laz")], cwd=ROOT) as process:
        while not any(path.stat().st_size for path in folder.rglob("plain.las")):
            assert process.poll() is None
        (kept,) = folder.iterdir()
        assert stat.S_IMODE(kept.stat().st_mode) == 0o700
        process.kill()
    assert list(folder.rglob("plain.las"))
    subprocess.run([*command, "demo"], cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
    assert list(folder.iterdir()) == []


@posix
def test_a_process_ends_with_the_one_that_started_it(folder: Path) -> None:
    """However that ended, and whatever it does."""
    inner = "open(sys.argv[1], 'w').close(); import time; time.sleep(60); print('alone', file=sys.stderr)"
    outer = (
        "import os, subprocess, sys; from viewer.helper import start_python\n"
        f"child = start_python({inner!r}, sys.argv[1], nice=0, stdin=subprocess.DEVNULL)\n"
        "while not os.path.exists(sys.argv[1]): pass\n"
        "os.kill(os.getpid(), 9)"
    )
    command = [sys.executable, "-c", outer, str(folder / "begun")]
    done = subprocess.run(command, cwd=ROOT, stderr=subprocess.PIPE, text=True)  # until both are gone
    assert (done.returncode, done.stderr) == (-signal.SIGKILL, "")


@pytest.mark.slow
def test_a_process_works_while_the_one_that_started_it_does() -> None:
    with start_python("import time; time.sleep(1.5); print('done')", nice=0) as process:
        assert process.communicate()[0].split() == [b"done"]

"""Temporary files and folders: what killed processes leave is removed, and nothing else ever."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from viewer.files import whole_file
from viewer.helper import start_python
from viewer.unfinished import remove_leftovers, temporary_name

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
def test_who_ends_well_leaves_no_notes(folder: Path, notes: Path) -> None:
    subprocess.run([sys.executable, "-c", WRITE, str(folder / "a.txt")], cwd=ROOT, check=True)
    assert [path.name for path in folder.iterdir()] == ["a.txt"]
    assert list(notes.iterdir()) == []


@posix
def test_nothing_but_our_own_is_removed_whatever_is_noted(
    folder: Path, notes: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder)
    for name in ("a.png", ".bashrc", ".scan4d", ".scan4d_file", ".a.part.png", "a.1.part.png"):
        (folder / name).write_text("precious")
    for name in ("b", ".a.1.part.png", ".scan4d_"):
        (folder / name).mkdir()
        (folder / name / "c").write_text("precious")
    (folder / ".scan4d_link").symlink_to(folder / "b")
    (folder / ".b.1.part.txt").symlink_to(folder / "a.png")
    (folder / ".relative.1.part.png").write_text("precious")
    (tmp_path / "through").symlink_to(folder)
    (folder / ".linked.1.part.png").write_text("precious")
    before = sorted(folder.rglob("*"))
    places = [str(path) for path in [*before, folder, folder / "b" / "..", "/", tmp_path]]
    places = [place for place in places if "linked" not in place and "relative" not in place]
    places += [".relative.1.part.png", str(tmp_path / "through" / ".linked.1.part.png"), "", "\udcff"]
    notes.mkdir(parents=True)
    (notes / "1_a.lock").touch()
    (notes / "1_a").write_bytes(b"\0".join(map(os.fsencode, places)))
    remove_leftovers()
    assert sorted(folder.rglob("*")) == before


@posix
def test_what_stands_inside_a_link_of_a_folder_stays(folder: Path, notes: Path) -> None:
    (folder / "kept").mkdir()
    (folder / "kept" / "a").write_text("precious")
    (folder / ".scan4d_1").mkdir()
    (folder / ".scan4d_1" / "link").symlink_to(folder / "kept")
    notes.mkdir(parents=True)
    (notes / "1_a.lock").touch()
    (notes / "1_a").write_bytes(os.fsencode(folder / ".scan4d_1"))
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
        assert temporary == temporary_name(path)
        temporary.write_text("whole")
    assert [entry.name for entry in folder.iterdir()] == [path.name]


def test_long_names_that_differ_in_their_number_have_files_of_their_own() -> None:
    names = {temporary_name(Path("n" * 240 + f"{number:04d}.png")) for number in range(100)}
    assert len(names) == 100


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


def test_a_process_works_while_the_one_that_started_it_does() -> None:
    with start_python("import time; time.sleep(1.5); print('done')", nice=0) as process:
        assert process.communicate()[0].split() == [b"done"]

"""What was being recorded when a process was killed is there at the next start, as far as it was recorded."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from scenes import sphere

from viewer.backends import backend
from viewer.camera import Camera
from viewer.document.journal import Journal, journals, saved
from viewer.document.recording import Entry, Recorder, Recording
from viewer.errors import InputError
from viewer.look import Look

CAMERA = Camera.orbit(sphere(100).bounds())
PARAMS = backend("points").params({})
FIRST = Entry("doe.npz", None, 0, 0.0, (96, 64), CAMERA, "points", PARAMS, Look(), unit="mm")
ENTRIES = [replace(FIRST, pose=n, time=n / 25) for n in range(5)]


@pytest.fixture(autouse=True)
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The home of a user who has recorded nothing yet."""
    for name in ("HOME", "XDG_STATE_HOME"):
        monkeypatch.setenv(name, str(tmp_path / "home"))
    (tmp_path / "home").mkdir()
    return tmp_path / "home"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Where recordings are to go."""
    folder = tmp_path / "work"
    folder.mkdir()
    return folder


def left(folder: Path, entries: list[Entry] = ENTRIES) -> Path:
    """A journal that somebody has left."""
    recorder, journal = Recorder(10.0), Journal(folder)
    for number, entry in enumerate(entries):
        journal.add(recorder.note(entry, 10.0 + number / 10) or {})
        assert recorder.note(entry, 10.0 + number / 10) is None, "it is the same"
    journal.leave()
    (path,) = journals()
    return path


def test_a_journal_becomes_the_recording_that_it_was(folder: Path, home: Path) -> None:
    path = saved(left(folder))
    assert path == folder / "scan4d_0001.json"
    recording = Recording.load(path)
    assert list(recording.entries) == ENTRIES
    assert [entry.at for entry in recording.entries] == [0, 0.1, 0.2, 0.3, 0.4]
    assert list((home / "scan4d" / "recordings").iterdir()) == []


def test_a_recording_that_is_there_stays(folder: Path) -> None:
    (folder / "scan4d_0001.json").write_text("former")
    assert saved(left(folder)) == folder / "scan4d_0002.json"
    assert (folder / "scan4d_0001.json").read_text() == "former"


@pytest.mark.parametrize("cut", [1, 2, 30])
def test_a_last_line_that_was_cut_is_left_out(folder: Path, cut: int) -> None:
    journal = left(folder)
    journal.write_bytes(journal.read_bytes()[:-cut])
    path = saved(journal)
    assert path is not None
    assert list(Recording.load(path).entries) == ENTRIES[:-1]


def test_without_an_entry_there_is_nothing_to_save(folder: Path) -> None:
    for content in (None, b"", b'{"format'):
        journal = left(folder, [])
        if content is not None:
            journal.write_bytes(content)
        assert saved(journal) is None
        assert journals() == []
    assert list(folder.iterdir()) == []


def test_a_journal_that_is_removed_leaves_nothing(folder: Path, home: Path) -> None:
    journal = Journal(folder)
    assert len(journals()) == 1
    journal.remove()
    assert list((home / "scan4d" / "recordings").iterdir()) == []


@pytest.mark.parametrize(
    "content",
    [
        b"\xff\xfe\n{}\n",
        b'{"format": 1}\n{"at": 0}\n',
        b'{"format": 1, "folder": "."}\n{"at": 0}\n',
        b'{"format": 99, "folder": "."}\n{"at": 0}\n',
        b'{"format": 1, "folder": "."}\n{"at": 0, "camera": ' + b"[" * 100 + b"]" * 100 + b"}\n",
    ],
)
def test_what_cannot_be_read_is_put_aside_and_told_once(folder: Path, content: bytes) -> None:
    journal = left(folder)
    journal.write_bytes(content)
    with pytest.raises(InputError) as caught:
        saved(journal)
    kept = journal.with_suffix(".damaged")
    assert str(kept) in str(caught.value)
    assert kept.read_bytes() == content
    assert journals() == []


def test_where_its_folder_is_gone_it_goes_to_the_users_own_and_finds_its_scan(
    folder: Path, home: Path
) -> None:
    entries = [*ENTRIES, replace(FIRST, scan="demo"), replace(FIRST, scan="/else/where.ply")]
    journal = left(folder, entries)
    folder.rmdir()
    path = saved(journal)
    assert path is not None
    assert path.parent in (home, home / "Documents")
    scans = [entry.scan for entry in Recording.load(path).entries]
    assert scans == [str(folder / "doe.npz")] * 5 + ["demo", "/else/where.ply"]


def test_where_it_can_go_nowhere_it_stays_for_the_next_start(
    folder: Path, home: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    journal = left(folder)
    moved = folder.rename(folder.with_name("moved"))
    monkeypatch.setenv("HOME", str(folder))
    with pytest.raises(InputError, match="cannot be written"):
        saved(journal)
    assert journals() == [journal]
    moved.rename(folder)
    assert saved(journal) == folder / "scan4d_0001.json"


def test_folders_that_are_no_utf_8(tmp_path: Path) -> None:
    folder = tmp_path / os.fsdecode(b"caf\xe9")
    folder.mkdir()
    assert saved(left(folder)) == folder / "scan4d_0001.json"


def test_the_journal_of_a_process_that_lives_is_left_alone(folder: Path) -> None:
    code = (
        "import sys; from pathlib import Path; from viewer.document.journal import Journal\n"
        "journal = Journal(Path(sys.argv[1])); print('there', flush=True); sys.stdin.read()"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", code, folder], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )
    assert process.stdin is not None
    assert process.stdout is not None
    assert process.stdout.readline() == b"there\n"
    (journal,) = journals()
    with journal.open("ab") as stream:
        stream.write(json.dumps(Recorder(0.0).note(FIRST, 0.0)).encode() + b"\n")
    assert saved(journal) is None
    assert journals() == [journal]
    process.kill()
    process.wait()
    process.stdin.close()
    process.stdout.close()
    assert saved(journal) == folder / "scan4d_0001.json"

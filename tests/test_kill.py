"""Commands that are killed, or ended by a signal, at any moment: nothing is torn, nothing stays behind."""

from __future__ import annotations

import os
import random
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from command_line import Run
from disks import small_disk
from scenes import sphere
from written import film, picture

from viewer.bench.report.results import RESULTS, read_rows
from viewer.document.recording import Recording
from viewer.scan import formats

ROOT = Path(__file__).resolve().parents[1]
MOMENTS = 6  # of each command and signal

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(sys.platform == "win32", reason="signals are POSIX's"),
]


def whole_picture(path: Path) -> None:
    assert picture(path).shape == (300, 400, 4)
    assert Recording.load(path).entries


def whole_film(path: Path) -> None:
    assert len(film(path)[0]) == 40


def whole_points(path: Path) -> None:
    assert len(formats.read(path)) == 100_000


COMMANDS: dict[str, tuple[tuple[str, ...], Callable[[Path], None]]] = {
    "render": (("render", "seq", "--all", "--size", "400x300", "-o", "out/b%d.png"), whole_picture),
    "film": (("render", "demo", "--turntable", "40", "--size", "400x300", "-o", "out/b.mp4"), whole_film),
    "convert": (("convert", "seq", "out/b%d.ply"), whole_points),
}


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working directory, with a sequence and an empty folder; the cache folder is in it."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    Path("seq").mkdir()
    Path("out").mkdir()
    for number in range(12):
        formats.write(f"seq/f{number}.npz", sphere(100_000))
    return tmp_path


def start(*command: str) -> subprocess.Popen[str]:
    words = [sys.executable, "-m", "viewer.cli", *command]
    return subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def ended(command: tuple[str, ...], number: int, after: float) -> tuple[int, str]:
    """Send a signal to a command after so many seconds; its exit code, and what it said."""
    with start(*command) as process:
        try:
            process.wait(after)
        except subprocess.TimeoutExpired:
            process.send_signal(number)
        _, err = process.communicate()
    return process.returncode, err


def moments(command: tuple[str, ...], seed: str) -> list[float]:
    """Seconds after the start, by chance, until the command ends by itself."""
    begin = time.monotonic()
    with start(*command) as process:
        process.communicate()
        assert process.returncode == 0
    whole = time.monotonic() - begin
    clear()
    generator = random.Random(seed)
    return [generator.uniform(0, whole) for _ in range(MOMENTS)]


def clear() -> list[Path]:
    """Delete what was written; what had final names."""
    files = list(Path("out").iterdir())
    for path in files:
        path.unlink()
    return files


def hidden(folder: Path) -> list[str]:
    """Temporary files and folders; the notes of them are no such."""
    return [name for _, folders, files in os.walk(folder) for name in [*folders, *files] if name[0] == "."]


@pytest.mark.parametrize("name", COMMANDS)
def test_what_is_killed_leaves_whole_files_and_nothing_else(name: str, run: Run, folder: Path) -> None:
    command, check = COMMANDS[name]
    for after in moments(command, name):
        ended(command, signal.SIGKILL, after)
        assert run("convert", "seq/f0.npz", "next.pcd", "--force").code == 0
        assert hidden(folder) == [], f"killed after {after} s"
        for path in sorted(Path("out").iterdir()):
            if path.name != "times.csv":
                check(path)
        clear()


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGHUP])
@pytest.mark.parametrize("name", COMMANDS)
def test_a_signal_leaves_nothing_at_once(name: str, number: signal.Signals, folder: Path) -> None:
    command, check = COMMANDS[name]
    for after in moments(command, f"{name} {number}"):
        code, said = ended(command, number, after)
        assert hidden(folder) == [], f"{number} after {after} s: {said}"
        assert code in (0, 1, -number), said  # the last while Python itself starts
        if not said.startswith("Fatal Python error: init"):  # by Python, before it ran any of ours
            assert said == ("scan4d: stopped\n" if code == 1 else "")
        for path in sorted(Path("out").iterdir()):
            if path.name != "times.csv":
                check(path)
        clear()


@pytest.mark.parametrize("kilobytes", [16, 100, 700, 2500])
@pytest.mark.parametrize("name", COMMANDS)
def test_a_disk_that_fills_up_leaves_whole_files(name: str, kilobytes: int, run: Run, folder: Path) -> None:
    command, check = COMMANDS[name]
    Path("out").rmdir()
    with small_disk(folder / "out", kilobytes):
        done = run(*command)
        if done.code:
            assert done.code == 2
            assert re.fullmatch(r"scan4d: [^\n]*the disk is full[^\n]*\n", done.err)
        assert hidden(folder) == []
        for path in sorted(Path("out").iterdir()):
            if path.name != "times.csv":
                check(path)
        assert done.code or len(list(Path("out").iterdir())) in (1, 12, 13)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_benchmark_that_is_stopped_twice_keeps_its_rows(number: signal.Signals, folder: Path) -> None:
    """At once, and while it makes the report.

    A scene after the first has no sweeps. So once the picture of its last backend is there, each backend has
    drawn a view of it, and its rows hold that view.
    """
    last, results = Path("bench/pictures/box--points.png"), Path("bench") / RESULTS
    for pause in (0.0, 0.2, 1.0):
        command = ("bench", "--scene", "sphere", "--scene", "box", "--suite", "scenes", "--quick",
                   "--size", "96x64", "--backend", "points", "-o", "bench", "--force")  # fmt: skip
        former = results.read_bytes() if results.exists() else None
        last.unlink(missing_ok=True)
        with start(*command) as process:
            while process.poll() is None and not last.exists():
                time.sleep(0.01)
            process.send_signal(number)
            time.sleep(pause)
            process.send_signal(number)
            _, said = process.communicate()
        # "stopped" is not said where the two came as one, or the second too late: all may be done already.
        assert said == "" or (said.endswith("scan4d: stopped\n") and process.returncode == 1)
        assert process.returncode in (1, -number, -signal.SIGINT)
        for scene in ("sphere", "box"):
            drawn = {row["backend"] for row in read_rows(results) if row["scene"] == scene}
            assert drawn == {"gl-points", "mesh", "points"}
        assert results.read_text().endswith("\n")
        assert former is None or former in [old.read_bytes() for old in Path("bench").glob("old-*.jsonl")]
        assert hidden(folder) == []

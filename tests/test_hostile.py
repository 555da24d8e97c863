"""Hostile files on the command line: done or refused, in little memory, with one plain message."""

from __future__ import annotations

import gzip
import re
import subprocess
import sys
from pathlib import Path

import pytest

from viewer.backends import backends

MOST_MEMORY = 600_000  # kilobytes, of the whole process
# What a process takes at most counts what its parent did when it began: this one is small.
MEASURED = """
import resource, subprocess, sys
code = subprocess.run(sys.argv[1:]).returncode
open("peak", "w").write(str(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss))
sys.exit(code)
"""
CONTROL = re.compile(rb"[\x00-\x08\x0b-\x1f\x7f]")  # all but tab and the end of a line

pytestmark = pytest.mark.slow


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def assert_done_or_refused(*words: object) -> None:
    """A command line in a process of its own; what it says on standard error is one message."""
    with open("output", "wb+") as output, open("errors", "wb+") as errors:
        process = subprocess.run(
            [sys.executable, "-c", MEASURED, sys.executable, "-m", "viewer.cli", *map(str, words)],
            stdin=subprocess.DEVNULL, stdout=output, stderr=errors,
        )  # fmt: skip
    said, told = Path("output").read_bytes(), Path("errors").read_bytes()
    assert process.returncode in (0, 2), told
    assert int(Path("peak").read_text()) < MOST_MEMORY
    assert not CONTROL.search(said + told)
    lines = told.splitlines()
    assert all(line.startswith(b"scan4d: ") for line in lines), told
    assert len(lines) == 1 or process.returncode == 0, told


def test_scans(data_dir: Path) -> None:
    others = (".md", ".json", ".toml", ".png")
    for path in sorted((data_dir / "hostile").iterdir()):
        if path.suffix == ".gz":
            unpacked = Path(path.stem)
            unpacked.write_bytes(gzip.decompress(path.read_bytes()))
            path = unpacked
        if path.suffix not in others:
            assert_done_or_refused("info", path)
            for backend in backends():
                assert_done_or_refused("render", path, "--backend", backend, "--size", "64x48", "--force",
                                       "-o", "a.png")  # fmt: skip


def test_cameras_and_recordings(data_dir: Path) -> None:
    for path in sorted((data_dir / "hostile").iterdir()):
        if path.suffix == ".json":
            assert_done_or_refused("render", "demo", "--camera", path, "--size", "64x48", "-o", "a.png")
        if path.suffix in (".json", ".png"):
            assert_done_or_refused("render", "--replay", path, "--force", "-o", "b.png")

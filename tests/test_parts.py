"""A part of the tests: which ones a commit chooses, and what the end of the time leaves."""

from __future__ import annotations

import itertools
import subprocess
from pathlib import Path

import pytest
from nested import run_pytest

HERE = Path(__file__).parent
FILE = """
import time
import pytest
from nested import run_pytest

@pytest.mark.parametrize("number", range({count}))
def test_that(number):
    pass

def test_slow():
    for _ in range({waits}):
        time.sleep(0.05)

def test_last():
    assert {is_right}
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in ("test_a.py", "test_b.py", "test_c.py"):
        (tmp_path / name).write_text(FILE.format(count=40, waits=0, is_right=True))
    return tmp_path


def pytest_in(folder: Path, *options: str) -> subprocess.CompletedProcess[str]:
    return run_pytest("-v", "-p", "parts", *options, cwd=folder, paths=[HERE])


def run_by(done: subprocess.CompletedProcess[str]) -> list[str]:
    return [line.split()[0] for line in done.stdout.splitlines() if " PASSED" in line]


@pytest.mark.slow
def test_ten_commits_run_every_test_once_and_one_always_the_same(folder: Path) -> None:
    parts = [run_by(pytest_in(folder, "--tenth", f"{digit:08x}{'ab' * 16}")) for digit in range(10)]
    assert all(5 <= len(part) <= 25 for part in parts), "of 126"
    assert len({part[0].partition("::")[0] for part in parts}) > 1, "they begin with different files"
    assert sorted(itertools.chain(*parts)) == sorted(run_by(pytest_in(folder)))
    assert run_by(pytest_in(folder, "--tenth", f"{3:08x}{'ab' * 16}")) == parts[3]


@pytest.mark.slow
def test_the_end_of_the_time_leaves_tests_and_a_failure_counts(folder: Path) -> None:
    (folder / "test_a.py").write_text(FILE.format(count=1, waits=0, is_right=False))
    (folder / "test_b.py").write_text(FILE.format(count=2, waits=10_000, is_right=False))
    done = pytest_in(folder, "--seconds", "6")
    assert done.returncode == 1
    assert "1 failed, 4 passed, 44 skipped" in done.stdout
    assert "5 tests ran, 44 were left for lack of time" in done.stdout
    assert "test_b.py::test_slow SKIPPED" in done.stdout


def test_without_a_limit_nothing_is_left_and_nothing_said(folder: Path) -> None:
    done = pytest_in(folder)
    assert done.returncode == 0
    assert "126 passed" in done.stdout
    assert "left" not in done.stdout

"""Tests that lack a large library are skipped, others that fail are not; on_gpu.sh says how it is called."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from nested import run_pytest

HERE = Path(__file__).resolve().parent
ON_GPU = HERE.parents[1] / "tools" / "on_gpu.sh"
TESTS = """
def test_direct():
    raise ModuleNotFoundError("no open3d", name="open3d.core")

def test_caused():
    try:
        raise ModuleNotFoundError("no numba", name="numba")
    except ModuleNotFoundError as error:
        raise ValueError("not drawn") from error

def test_small():
    raise ModuleNotFoundError("no such thing", name="viewer.nothing")

def test_wrong():
    assert 1 == 2
"""
MORE = """
raise ModuleNotFoundError("no matplotlib", name="matplotlib")

def test_never():
    pass
"""


def test_only_the_large_ones_are_left_out(tmp_path: Path) -> None:
    (tmp_path / "test_some.py").write_text(TESTS)
    (tmp_path / "test_more.py").write_text(MORE)
    done = run_pytest("-q", "-rsf", "-p", "left_out", cwd=tmp_path, paths=[HERE])
    assert "2 failed, 3 skipped" in done.stdout
    assert "needs open3d" in done.stdout
    assert "needs numba" in done.stdout
    assert "needs matplotlib" in done.stdout
    assert "test_small" in done.stdout.partition("short test summary")[2]


@pytest.mark.skipif(sys.platform == "win32", reason="a script for bash")
@pytest.mark.parametrize("words", [[], ["--quikc", "out"], ["one", "two"], ["--environment"]])
def test_what_on_gpu_does_not_know_it_explains(words: list[str], tmp_path: Path) -> None:
    done = subprocess.run([str(ON_GPU), *words], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 2
    assert "tools/on_gpu.sh --pack DIR" in done.stderr
    assert not list(tmp_path.iterdir())

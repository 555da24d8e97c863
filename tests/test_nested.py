"""A pytest within the tests does not depend on plugins that happen to be installed."""

from __future__ import annotations

from pathlib import Path

import pytest
from nested import run_pytest

TEST = """
import os

def test_it():
    assert "PYTEST_XDIST_WORKER" not in os.environ
"""


def test_installed_plugins_and_the_outer_run_change_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    entry = tmp_path / "odd_plugin-1.0.dist-info"
    entry.mkdir()
    (entry / "METADATA").write_text("Metadata-Version: 2.1\nName: odd-plugin\nVersion: 1.0\n")
    (entry / "entry_points.txt").write_text("[pytest11]\nodd = odd_plugin\n")
    (tmp_path / "odd_plugin.py").write_text("raise RuntimeError('it was loaded')\n")
    (tmp_path / "test_it.py").write_text(TEST)
    monkeypatch.setenv("PYTEST_XDIST_WORKER", "gw0")
    done = run_pytest(cwd=tmp_path, paths=[tmp_path])
    assert done.returncode == 0, done.stdout + done.stderr
    monkeypatch.setattr("nested._INDEPENDENT", {})
    assert "it was loaded" in run_pytest(cwd=tmp_path, paths=[tmp_path]).stderr, "it would be, otherwise"

"""Experiments run in the test's own process."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from command_line import Done, Run
from experiments.command import main
from scenes import sphere_mesh


@pytest.fixture
def run_experiment(capsys: pytest.CaptureFixture[str]) -> Run:
    """run_experiment("feeds", ...): tools/experiment.py with these words. Nothing ever prints a traceback."""

    def run(*words: object) -> Done:
        code = main([str(word) for word in words])
        captured = capsys.readouterr()
        assert "Traceback" not in captured.err
        return Done(code, captured.out, captured.err)

    return run


@pytest.fixture
def mesh(tmp_path: Path) -> Path:
    """A small mesh of one's own."""
    ball, path = sphere_mesh(16), tmp_path / "ball.obj"
    lines = ["v {} {} {}".format(*point) for point in ball.points.positions]
    lines += ["f {} {} {}".format(*face) for face in np.asarray(ball.faces, int) + 1]
    path.write_text("\n".join(lines) + "\n", encoding="ascii")
    return path

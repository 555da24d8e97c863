"""`scan4d bench` as a user runs it: what it says, writes, keeps and refuses."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import Run
from missing import leave_out

from viewer.bench.report.results import RESULTS, read_rows
from viewer.bench.run import Bench
from viewer.commands import bench

SMALL = ("--quick", "--size", "96x64", "--views", 1, "--backend", "points")
Refused = Callable[..., str]


def write_ply(path: Path, faces: bool = True) -> Path:
    """A unit sphere of quads, or its points alone."""
    polar, turn = np.meshgrid(
        np.linspace(0.01, np.pi - 0.01, 12), np.linspace(0, 2 * np.pi, 24), indexing="ij"
    )
    points = np.stack([np.sin(polar) * np.cos(turn), np.cos(polar), -np.sin(polar) * np.sin(turn)], axis=-1)
    first = (np.arange(11)[:, None] * 24 + np.arange(23)).ravel()
    quads = np.stack([first, first + 24, first + 25, first + 1], axis=1) if faces else []
    header = ["ply", "format ascii 1.0", f"element vertex {polar.size}"]
    header += [f"property float {axis}" for axis in "xyz"]
    header += [f"element face {len(quads)}", "property list uchar int vertex_indices", "end_header"]
    lines = [" ".join(map(str, point)) for point in points.reshape(-1, 3)]
    lines += [" ".join(map(str, (4, *quad))) for quad in quads]
    path.write_text("\n".join([*header, *lines]) + "\n", encoding="ascii")
    return path


@pytest.fixture
def mesh(tmp_path: Path) -> Path:
    """A small mesh of one's own."""
    return write_ply(tmp_path / "ball.ply")


@pytest.mark.slow
def test_a_mesh_of_ones_own_is_measured_reported_and_compared(run: Run, mesh: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    scenes = ("--scene", mesh)
    done = run("bench", *scenes, *SMALL, "-o", out)
    assert done.code == 0, done.err
    first, *steps, last = done.out.splitlines()
    assert "about" in first
    assert steps[-1] == f"Measuring 3 combinations on {mesh}; after that, 0 are left"
    assert "leaves out the stability suite" in done.err
    assert not (out / "numerics.jsonl").exists()
    assert last == str(out / "report.html")
    rows = read_rows(out)
    assert {row["backend"] for row in rows} == {"gl-points", "mesh", "points"}
    assert {row["scene"] for row in rows} == {"ball.ply"}
    assert (out / "report.html").stat().st_size > 10_000
    assert {path.name for path in (out / "pictures").iterdir()} == {
        f"ball.ply--{name}.png" for name in ("gl-points", "mesh", "points")
    }

    # Once more into the same folder, beside what was there.
    old = tmp_path / "old.jsonl"
    old.write_bytes((out / RESULTS).read_bytes())
    done = run("bench", *scenes, *SMALL, "-o", out, "--compare", old, "--force")
    assert done.code == 0
    assert "worse" not in done.out
    errors = [
        [row["errors_by_view"] for row in read_rows(out / name)] for name in (RESULTS, f"old-{RESULTS}")
    ]
    assert json.dumps(errors[0]) == json.dumps(errors[1])


def test_the_stability_suite_alone_keeps_the_scenes(run: Run, tmp_path: Path) -> None:
    (tmp_path / "results.jsonl").write_text("")
    done = run("bench", "--suite", "numerics", "--backend", "points", "-o", tmp_path)
    assert done.code == 0, done.err
    assert (tmp_path / "results.jsonl").exists()
    lines = [json.loads(line) for line in (tmp_path / "numerics.jsonl").read_text().splitlines()]
    assert len(lines) > 50
    assert all(line["held"] or line["limit"] for line in lines)
    assert "translated by 10^9" in (tmp_path / "report.html").read_text(encoding="utf-8")


@pytest.mark.slow
def test_the_surface_suite_prints_its_goals(run: Run, mesh: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    done = run("bench", "--suite", "surface", "--scene", mesh, *SMALL, "-o", out)
    assert done.code == 0, done.err
    assert "holes and see-through, ramp 1:100" in done.out
    lines = [json.loads(line) for line in (out / "surface.jsonl").read_text().splitlines()]
    of_data = {"horse-gallop", "crane"}  # where the folder of real scans is
    assert {line["scene"] for line in lines} - of_data == {"ball.ply", "torus", "sheets", "demo"}
    assert {line["backend"] for line in lines} == {"points", "estimate"}
    assert "One surface" in (out / "report.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--scene", "bunnie"], ["bunnie", "bunny"]),
        (["--scene", "nowhere.ply"], ["nowhere.ply"]),
        (["--backend", "nerf"], ["nerf", "points"]),
        (["--data", "nowhere"], ["nowhere", "--data"]),
        (["--compare", "nowhere"], ["nowhere"]),
        (["--size", "8x8"], ["8x8", "1920x1280"]),
        (["--views", "0"], ["0"]),
        (["--suite", "speed"], ["speed", "numerics"]),
        (["--seed", "-1"], ["-1"]),
        (["--suite", "numerics", "--compare", "."], ["--compare"]),
        (["--suite", "surface", "--compare", "."], ["--compare"]),
        (["--scene", "sphere", "--size", "20000x20000"], ["20000x20000", "too large"]),
    ],
)
def test_what_cannot_be_is_one_message(
    refused: Refused, tmp_path: Path, arguments: list[str], words: list[str]
) -> None:
    message = refused("bench", "-o", tmp_path / "out", *arguments)
    assert all(word in message for word in words), message
    assert not (tmp_path / "out").exists()


def test_two_files_of_one_name_are_refused(refused: Refused, tmp_path: Path) -> None:
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        write_ply(tmp_path / folder / "ball.ply")
    files = (tmp_path / "a" / "ball.ply", tmp_path / "b" / "ball.ply")
    assert "ball.ply" in refused("bench", "--scene", *files, "-o", tmp_path / "out")


@pytest.mark.slow
def test_a_damaged_scene_is_left_out_and_the_others_are_measured(run: Run, tmp_path: Path) -> None:
    models = tmp_path / "data" / "models"
    models.mkdir(parents=True)
    (models / "stanford_bunny_35947.ply").write_bytes(b"ply, once")
    damaged = ("--data", tmp_path / "data", "--suite", "scenes")
    done = run("bench", *damaged, *SMALL, "--scene", "plane", "bunny", "plane", "-o", tmp_path / "out")
    assert done.code == 0
    assert "leaves out bunny" in done.err
    assert {row["scene"] for row in read_rows(tmp_path / "out")} == {"plane"}
    assert "leaves out bunny" in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")

    done = run("bench", *damaged, *SMALL, "--scene", "bunny", "-o", tmp_path / "none")
    assert done.code == 2
    assert not (tmp_path / "none" / "report.html").exists()


@pytest.mark.parametrize("views", [0, pytest.param(2, marks=pytest.mark.slow)])
def test_ctrl_c_before_the_first_row_leaves_former_results(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, views: int
) -> None:
    """While the time is foretold, which takes two views, and before the first that counts."""
    (tmp_path / RESULTS).write_text("former\n")
    before, view = iter(range(views)), Bench._view

    def interrupted(*arguments: Any, **keywords: Any) -> None:
        if next(before, None) is None:
            raise KeyboardInterrupt
        view(*arguments, **keywords)

    monkeypatch.setattr(Bench, "_view", interrupted)
    done = run("bench", "--scene", "sphere", "--suite", "scenes", *SMALL, "-o", tmp_path, "--force")
    assert (done.code, done.err) == (1, "scan4d: stopped\n")
    assert (tmp_path / RESULTS).read_text() == "former\n"
    assert not (tmp_path / "report.html").exists()


def test_rows_of_a_run_that_was_stopped_before_its_report_make_one_later(
    run: Run, refused: Refused, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(folder: Path) -> Path:
        raise KeyboardInterrupt

    with monkeypatch.context() as context:
        context.setattr(bench, "write_report", interrupted)
        done = run("bench", "--suite", "numerics", "--backend", "points", "-o", tmp_path)
    assert done.code == 1
    kept, stopped = done.err.splitlines()
    assert "contains the results" in kept
    assert stopped == "scan4d: stopped"
    assert not (tmp_path / "report.html").exists()

    rows = (tmp_path / "numerics.jsonl").read_bytes()
    done = run("bench", "-o", tmp_path, "--report")
    assert done == (0, f"{tmp_path / 'report.html'}\n", "")
    assert "translated by 10^9" in (tmp_path / "report.html").read_text(encoding="utf-8")
    assert (tmp_path / "numerics.jsonl").read_bytes() == rows
    assert "report.html: exists already" in refused("bench", "-o", tmp_path, "--report")
    assert "--report" in refused("bench", "-o", tmp_path, "--report", "--scene", "sphere")
    assert "no results" in refused("bench", "-o", tmp_path / "nowhere", "--report")


def test_points_without_faces_are_no_scene(refused: Refused, tmp_path: Path) -> None:
    path = write_ply(tmp_path / "points.ply", faces=False)
    assert "faces" in refused("bench", "--scene", path, "-o", tmp_path / "out")


def test_a_missing_library_is_told(refused: Refused, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    leave_out(monkeypatch, "jinja2", "skimage")
    message = refused("bench", "-o", tmp_path)
    assert "not installed: jinja2, skimage. " in message
    assert message.endswith("-m pip install jinja2 scikit-image\n")


@pytest.mark.slow
def test_ctrl_c_keeps_what_was_measured(mesh: Path, tmp_path: Path) -> None:
    command = [sys.executable, "-m", "viewer.cli", "bench", "--scene", str(mesh), "--suite", "scenes",
               "--backend", "surfels", "--quick", "--size", "96x64", "--views", "400",
               "-o", str(tmp_path / "out")]  # fmt: skip
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        process.stdout.readline()  # until then it draws to foretell how long it takes
        began = time.time()
        while process.poll() is None and not any(
            path.stat().st_mtime > began for path in tmp_path.glob("out/pictures/*--surfels.png")
        ):
            time.sleep(0.2)
        time.sleep(1)  # into the views after the first
        process.send_signal(signal.SIGINT)
        out, err = process.communicate()
    assert process.returncode == 1, err
    assert "Traceback" not in err
    assert out.splitlines()[-1] == str(tmp_path / "out" / "report.html")
    rows = read_rows(tmp_path / "out")
    assert rows
    assert len({row["views"] for row in rows}) == 1
    assert 1 <= rows[0]["views"] < 400
    assert "Stopped" in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")

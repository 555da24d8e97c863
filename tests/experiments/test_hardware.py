"""The experiment for graphics cards runs with what such a machine has, and its sketches draw the points."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import numpy as np
import pytest
from experiments.speed.hardware import CASES, TABLES, Drawn, Plain, counted_reads, shape, view
from experiments.speed.idle_driver import Driver
from experiments.speed.sketches import Sketch
from experiments.suite import ROOT

from viewer.camera import Camera
from viewer.drawing.renderer import Renderer
from viewer.drawing.request import Request
from viewer.scan.pose import Pose

LACKING = "open3d", "imgui_bundle", "av"
RUN = f"""
import sys
class Lacking:
    def find_spec(self, name, *more):
        if name.split(".")[0] in {LACKING}:
            raise ModuleNotFoundError(name)
sys.meta_path.insert(0, Lacking())
from experiments.command import main
sys.exit(main(sys.argv[1:]))
"""
SMALL = "--size", "64x48"


def rows_without(*words: str) -> list[dict[str, object]]:
    """The rows of an experiment on a machine that lacks some libraries."""
    path = os.pathsep.join(map(str, (ROOT, ROOT / "tools")))
    done = subprocess.run(
        [sys.executable, "-c", RUN, *words, *SMALL, "--json"],
        env={**os.environ, "PYTHONPATH": path}, stdout=subprocess.PIPE, text=True, check=True,
    )  # fmt: skip
    return [json.loads(line)["row"] for line in done.stdout.splitlines()]


@pytest.mark.slow
def test_frames_are_measured_without_libraries_of_the_window() -> None:
    few = "--sizes", "2000", "--pictures", "2", "--table", "orbit", "new_pose"
    rows = rows_without("hardware", *few, "--rows", "points", "sketch 32", "GL_POINTS", "new points")
    assert [row["row"] for row in rows] == ["points", "sketch 32", "GL_POINTS", "new points"]
    assert all("left out" not in row and row["done, ms"] > 0 for row in rows)
    assert rows[0]["errors"] == 0


def test_the_work_of_the_cpu_is_measured_beside_that_of_the_driver() -> None:
    few = "--sizes", "2000", "--pictures", "3", "--table", "cpu", "--rows", "points"
    (row,) = rows_without("hardware", *few)
    assert row["new view, CPU, ms"] > 0
    assert row["same view, CPU, ms"] > 0
    assert row["new view, calls"] > 10
    assert row["new programs"] > 0


def test_a_driver_that_does_nothing_leaves_the_picture() -> None:
    drawn = Drawn(CASES["points"], Pose(0, 0.0, "", shape(2000)), (64, 48))
    driver = Driver(drawn.surface.gpu.staging)
    with driver.watched():
        drawn.submit(0)
    first, calls = drawn.surface.image(), driver.calls.copy()
    assert calls["run"] + calls["run_indirect"] >= 3
    assert calls["write"] > 0
    with driver.idle():
        drawn.submit(5)
    np.testing.assert_array_equal(drawn.surface.image(), first)
    assert driver.calls == calls
    drawn.submit(5)
    assert (drawn.surface.image() != first).any()


def test_what_is_drawn_is_made_before_anything_is_timed(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch
) -> None:
    cloud, size = shape(2000), (64, 48)
    contenders = (
        Drawn(CASES["points"], Pose(0, 0.0, "", cloud), size),
        Plain(Sketch(renderer.gpu, cloud, size, 32), cloud, size),
    )
    for made in (Camera, Request):
        monkeypatch.delattr(made, "__init__")
    for each in contenders:
        each.submit(2)
        each.submit(25)
        each.release()


@pytest.mark.slow
def test_a_first_picture_is_drawn_in_a_process_of_its_own() -> None:
    (row,) = rows_without("hardware", "--sizes", "2000", "--table", "cold", "--rows", "cold points")
    assert row["nothing stored, ms"] > 0
    assert row["stored, ms"] > 0


def test_a_table_has_what_was_measured_and_nothing_where_that_failed() -> None:
    drawn = {"row": "points", "points": 1000, "done, ms": 0.5, "maps": 2}
    failed = {"row": "CUDA", "points": 1000, "left out": "why"}
    *_, first, second = TABLES[0].text([{"orbit": [drawn, failed]}]).splitlines()
    count = "1\N{NARROW NO-BREAK SPACE}000"
    assert [cell.strip() for cell in first.split("|")[1:4]] == ["`points`", count, "0.500"]
    assert [cell.strip() for cell in second.split("|")[1:-1]] == ["`CUDA`", count, *[""] * 9]


@pytest.mark.parametrize("name", ["series", "turning"])
@pytest.mark.slow
def test_moving_pictures_are_measured_without_libraries_of_the_window(name: str) -> None:
    few = ("--poses", "3") if name == "series" else ("--pictures", "3", "--backends", "points")
    assert rows_without(name, "--counts", "2000", *few)


def test_a_sketch_shows_the_points_of_the_backend(renderer: Renderer) -> None:
    size, count = (160, 120), 3000
    drawn = Drawn(CASES["points"], Pose(0, 0.0, "sphere", CASES["points"].cloud(count)), size)
    drawn.submit(3)
    sketch = Sketch(drawn.surface.gpu, shape(count), size, 32)
    sketch.submit(view(shape(count), size, 3))
    with counted_reads() as counts:
        sketch.read()
    assert counts == {"maps": 1, "reads": 1}
    picture = sketch.out.reshape(*size[::-1], 4)
    covered = np.isfinite(drawn.surface.depth)
    assert covered.sum() > 1000
    alike = ((picture[..., :3] != 0).any(axis=2) == covered).mean()
    assert alike > 0.999

"""The benchmark of automatic choices: the error of a picture, and how choices are judged."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import Run
from experiments.command import main

from viewer.backends import backend
from viewer.bench import calibrating
from viewer.bench.calibrating import Truth, laws_of, measure_ways
from viewer.bench.report.results import WAYS, read_rows
from viewer.bench.run import Bench, BenchSettings
from viewer.bench.scenes import catalog
from viewer.camera import Camera
from viewer.choice import known
from viewer.choice.configurations import SCALES
from viewer.choice.model import CAP
from viewer.drawing.frame import scaled_size
from viewer.drawing.renderer import Renderer
from viewer.drawing.request import Request
from viewer.drawing.timing import draw
from viewer.picture.surface import Surface

SIZE = (240, 160)
CAMERA = Camera(eye=(0.5, 0.4, 4.0), fov_y=35)


def surface_of(renderer: Renderer, scene: str, name: str, scale: float = 1.0, **values: Any) -> Surface:
    pose = catalog.subject(scene, None).moment(0).pose
    request = Request(pose, CAMERA, name, backend(name).params(values))
    surface = Surface(renderer.gpu, scaled_size(SIZE, scale), SIZE)
    draw(renderer, request, surface)
    return surface


def truth_of(scene: str) -> Truth:
    return Truth.of(catalog.subject(scene, None).moment(0).truth, CAMERA, SIZE)


def test_the_error_is_what_is_off_and_at_most_what_is_missing(renderer: Renderer) -> None:
    truth, surface = truth_of("sphere"), surface_of(renderer, "sphere", "surfels")
    assert 0 < truth.error(surface) < 0.3
    empty = Truth(truth.pixels, np.full(len(truth.pixels), np.inf), truth.footprint)
    assert empty.error(surface) == CAP  # all that is drawn is wrong
    there = np.isfinite(truth.depth)
    moved = replace(truth, depth=truth.depth + np.where(there, truth.footprint, 0.0))
    assert moved.error(surface) == pytest.approx(1.0, abs=0.25)
    nowhere = surface_of(renderer, "sphere", "points", point_size=1)
    nowhere.clear()
    assert truth.error(nowhere) == CAP


def test_larger_pixels_are_off_by_how_far_their_middles_are(renderer: Renderer) -> None:
    truth = truth_of("plane")  # that faces the eye nearly: depths hardly differ
    errors = [truth.error(surface_of(renderer, "plane", "surfels", scale)) for scale in SCALES]
    assert errors == sorted(errors)
    half = dict(zip(SCALES, errors, strict=True))[0.5]
    assert half == pytest.approx(
        np.sqrt(0.5), abs=0.2
    )  # each pixel's middle is half a pixel off on each axis


@pytest.mark.slow
def test_ways_are_measured_and_chosen(renderer: Renderer) -> None:
    bench = Bench(renderer, BenchSettings(size=SIZE, views=3, repeat=1, frames=0))
    rows = list(measure_ways(bench, ["sphere", "no-such-scene"]))
    assert any("no-such-scene" in note for note in bench.notes)
    assert len({(row["view"], row["key"], row["scale"]) for row in rows}) == len(rows) == 3 * 4 * len(SCALES)
    assert all(row["ms"] > 0 and 0 <= row["error"] <= CAP for row in rows)
    model = laws_of(rows)
    assert model.keys() == {row["key"] for row in rows}


@pytest.mark.slow
def test_a_device_is_calibrated_and_chosen_for(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, renderer: Renderer
) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "settings"))
    scene = ("--scene", "torus", "--views", "2", "--size", "120x80")
    small = (*scene, "-o", tmp_path / "out")
    done = run("bench", "--calibrate", *small)
    assert done.code == 0, done.err
    file = tmp_path / "settings" / "scan4d" / known.FILE
    assert str(file) in done.out
    assert known.model_of(renderer.gpu) == laws_of(read_rows(tmp_path / "out" / WAYS))
    assert run("bench", "--calibrate", *small).code == 2  # the rows are there
    assert run("bench", "--calibrate", "--report", *small).code == 0
    judged = tmp_path / "judged"
    assert main(["choice", *map(str, scene), "-o", str(judged)]) == 0
    assert "| 50 ms | 2 | 2 |" in (judged / "automatic.md").read_text()


@pytest.mark.parametrize("other", [["--suite", "numerics"], ["--backend", "points"], ["--compare", "."]])
def test_calibrating_is_all_that_is_done(run: Run, tmp_path: Path, other: list[str]) -> None:
    done = run("bench", "--calibrate", "-o", tmp_path / "out", *other)
    assert (done.code, "--calibrate" in done.err) == (2, True)


def test_scenes_are_known() -> None:
    assert set(calibrating.SCENES) <= set(catalog.scene_names(None))

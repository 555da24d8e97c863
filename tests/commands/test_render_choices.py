"""`scan4d render` with the renderer that is chosen for a time or an error."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import Run
from PIL import Image

from viewer.choice import known
from viewer.choice.known import read_models, write_models
from viewer.document.recording import Recording
from viewer.resources import resource_path

LARGE = ("--size", "640x400")
MODEL = read_models(resource_path("assets", known.FILE))["software"]


@pytest.fixture(autouse=True)
def own_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A user's folder in which nothing is kept yet."""
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "settings"))
    return tmp_path / "settings" / "scan4d"


def drawn(run: Run, scan: Path, folder: Path, *args: object) -> tuple[dict[str, Any], Path]:
    """The statistics of a picture, and the picture."""
    out, stats = folder / "out.png", folder / "stats.json"
    done = run("render", scan, "-o", out, "--stats", stats, "--force", *LARGE, *args)
    assert done.code == 0, done.err
    return json.loads(stats.read_text()), out


def test_what_is_chosen_stands_in_statistics_and_pictures(run: Run, scans: Path, tmp_path: Path) -> None:
    errors = []
    for budget in (1000.0, 15.0, 6.0):
        stats, out = drawn(run, scans / "ball.npz", tmp_path, "--backend", "auto", "--budget", f"{budget}ms")
        told = stats["automatic"]
        assert (told["kind"], told["bound"], told["unit"]) == ("time", budget, "ms")
        assert told["expected_ms"] <= budget
        errors.append(told["expected_error"])
        (entry,) = Recording.load(out).entries
        assert vars(entry.automatic) == told
        assert (entry.backend, vars(entry.params)) == (stats["backend"], stats["params"])
        assert stats["size"] == [640, 400]
        assert stats["drawn_size"] == [round(640 * entry.scale), round(400 * entry.scale)]
        with Image.open(out) as image:
            assert image.size == (640, 400)
    assert errors == sorted(errors)
    assert errors[0] < errors[-1]


def test_a_picture_of_few_pixels_is_drawn_again_bit_for_bit(run: Run, scans: Path, tmp_path: Path) -> None:
    stats, out = drawn(run, scans / "ball.npz", tmp_path, "--budget", "6ms")
    assert stats["drawn_size"] != stats["size"]
    again = tmp_path / "again.png"
    assert run("render", "--replay", out, "-o", again).code == 0
    with Image.open(out) as first, Image.open(again) as second:
        assert np.array_equal(np.asarray(first), np.asarray(second))
    assert Recording.load(again).entries[0].automatic == Recording.load(out).entries[0].automatic


def test_numbers_of_a_picture_of_few_pixels_are_of_its_size(run: Run, scans: Path, tmp_path: Path) -> None:
    out = tmp_path / "out.npz"
    assert run("render", scans / "ball.npz", "-o", out, *LARGE, "--budget", "6ms").code == 0
    with np.load(out) as arrays:
        assert {name: array.shape[:2] for name, array in arrays.items()} == dict.fromkeys(
            arrays.files, (400, 640)
        )


def test_an_error_may_be_told_in_any_unit_of_length(run: Run, scans: Path, tmp_path: Path) -> None:
    found = []
    for error in ("0.4mm", "0.04cm", "400um"):
        stats, _ = drawn(run, scans / "ball.npz", tmp_path, "--unit", "mm", "--error", error)
        assert stats["automatic"]["unit"] == "mm"
        assert stats["automatic"]["bound"] == pytest.approx(0.4)
        found.append((stats["backend"], stats["params"]))
    assert found[0] == found[1] == found[2]


def test_auto_alone_is_the_default_of_the_scan(run: Run, scans: Path, tmp_path: Path) -> None:
    default, _ = drawn(run, scans / "ball.npz", tmp_path)
    auto, _ = drawn(run, scans / "ball.npz", tmp_path, "--backend", "auto")
    assert auto["automatic"] is None
    assert (auto["backend"], auto["params"]) == (default["backend"], default["params"])


def test_a_bound_that_nothing_keeps_is_told(run: Run, scans: Path, tmp_path: Path) -> None:
    done = run("render", scans / "ball.npz", "-o", tmp_path / "a.png", *LARGE, "--budget", "0.001ms")
    assert done.code == 0
    assert "no renderer is likely to stay within the limit of 0.001 ms" in done.err


def test_the_model_of_the_device_comes_before_the_one_that_is_shipped(
    run: Run, scans: Path, tmp_path: Path, own_folder: Path, renderer: Any
) -> None:
    budget = ("--budget", "1000ms")
    shipped, _ = drawn(run, scans / "ball.npz", tmp_path, *budget)
    known.keep_model(renderer.gpu, {"points": MODEL["points"]})
    assert list(read_models(own_folder / known.FILE)) == [f"{renderer.gpu.device}, {renderer.gpu.driver}"]
    kept, _ = drawn(run, scans / "ball.npz", tmp_path, *budget)
    assert (shipped["backend"], kept["backend"]) == ("surfels", "points")


def test_a_damaged_file_counts_as_none(run: Run, scans: Path, tmp_path: Path, own_folder: Path) -> None:
    own_folder.mkdir(parents=True)
    for text in ("", "[", '{"format": 1, "models": 3}', '{"format": 9, "models": {}}'):
        (own_folder / known.FILE).write_text(text)
        assert read_models(own_folder / known.FILE) == {}
    write_models({"a": MODEL}, own_folder / known.FILE)
    told = json.loads((own_folder / known.FILE).read_text())
    told["models"]["a"]["points"]["time"][0] = "fast"
    told["models"]["a"]["surfels"]["error"] = [-1.0] * len(MODEL["surfels"].error)
    (own_folder / known.FILE).write_text(json.dumps(told))
    assert read_models(own_folder / known.FILE)["a"].keys() == MODEL.keys() - {"points", "surfels"}


@pytest.mark.parametrize(
    ("args", "words"),
    [
        (["--budget", "0"], ["--budget", "more than 0"]),
        (["--budget", "soon"], ["--budget", "50ms"]),
        (["--budget", "5px"], ["--budget", "milliseconds"]),
        (["--budget", "nan"], ["--budget"]),
        (["--error", "5ms", "--unit", "mm"], ["--error", "'ms'", "5mm"]),
        (["--error", "1mm", "--unit", "hands"], ["--error", "'hands'"]),
        (["--error", "0px"], ["--error", "more than 0"]),
        (["--error", "0.1", "--budget", "5"], ["--budget, --error"]),
        (["--budget", "5", "--backend", "points"], ["--budget", "points", "auto"]),
        (["--budget", "5", "--set", "point_size=2"], ["--set", "--budget"]),
        (["--error", "5", "--quality", "fine"], ["--quality", "--error"]),
        (["--budget", "5", "--no-gl"], ["--budget", "OpenGL"]),
    ],
)
def test_wrong_bounds(run: Run, scans: Path, tmp_path: Path, args: list[str], words: list[str]) -> None:
    done = run("render", scans / "ball.npz", "-o", tmp_path / "a.png", *args)
    assert done.code == 2
    assert len(done.err.splitlines()) == 1
    assert all(word in done.err for word in words), done.err
    assert not (tmp_path / "a.png").exists()


def test_replay_takes_no_bound(run: Run, scans: Path, tmp_path: Path) -> None:
    out = tmp_path / "a.png"
    assert run("render", scans / "ball.npz", "-o", out, "--size", "96x64").code == 0
    done = run("render", "--replay", out, "-o", tmp_path / "b.png", "--budget", "5ms")
    assert (done.code, "--budget" in done.err) == (2, True)

"""The fastest way is measured once, and remembered."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scenes import sphere

from viewer.backends import backend
from viewer.camera import Camera
from viewer.drawing.frame import render_frame
from viewer.drawing.renderer import Renderer
from viewer.drawing.request import Request
from viewer.errors import Scan4DError
from viewer.gpu.context import headless
from viewer.picture.surface import Surface
from viewer.scan.pose import Pose
from viewer.splatting import fastest as module
from viewer.splatting.amplify import FEEDS
from viewer.splatting.fastest import fastest

NAMES = ("slow", "quick", "broken")


def ways(calls: list[str]) -> Callable[[], dict[str, Callable[[], None]]]:
    """Ways that note when they are called."""

    def slow() -> None:
        calls.append("slow")
        time.sleep(0.02)

    def broken() -> None:
        raise Scan4DError("does not compile on this driver")

    return lambda: {"slow": slow, "quick": lambda: calls.append("quick"), "broken": broken}


def test_it_is_measured_once(renderer: Renderer, tmp_path: Path) -> None:
    file, calls = tmp_path / "fastest.json", list[str]()
    assert fastest(renderer.gpu, "a task", NAMES, ways(calls), file) == "quick"
    assert {"slow", "quick"} == set(calls)
    calls.clear()
    assert fastest(renderer.gpu, "a task", NAMES, ways(calls), file) == "quick"
    assert not calls
    assert fastest(renderer.gpu, "another", NAMES, ways(calls), file) == "quick"
    assert calls
    assert len(json.loads(file.read_text())) == 2
    assert [path.name for path in file.parent.iterdir()] == ["fastest.json"]


def test_what_was_remembered_is_taken(renderer: Renderer, tmp_path: Path) -> None:
    file = tmp_path / "fastest.json"
    fastest(renderer.gpu, "a task", NAMES, ways([]), file)
    file.write_text(file.read_text().replace('"quick"', '"slow"'))
    assert fastest(renderer.gpu, "a task", NAMES, ways([]), file) == "slow"


@pytest.mark.parametrize("content", ["", "{", "[]", "\x00", '{"a": 1}', "null"])
def test_a_damaged_file_is_passed_over(renderer: Renderer, tmp_path: Path, content: str) -> None:
    file = tmp_path / "fastest.json"
    file.write_text(content)
    assert fastest(renderer.gpu, "a task", NAMES, ways([]), file) == "quick"
    assert "quick" in json.loads(file.read_text()).values()


@pytest.mark.parametrize("name", ["removed", 3, None, ["quick"]])
def test_a_way_that_there_is_not_is_measured_anew(renderer: Renderer, tmp_path: Path, name: object) -> None:
    file = tmp_path / "fastest.json"
    fastest(renderer.gpu, "a task", NAMES, ways([]), file)
    file.write_text(json.dumps(dict.fromkeys(json.loads(file.read_text()), name)))
    assert fastest(renderer.gpu, "a task", NAMES, ways([]), file) == "quick"


def test_a_folder_that_cannot_be_written_is_passed_over(renderer: Renderer, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    assert fastest(renderer.gpu, "a task", NAMES, ways([]), tmp_path / "file" / "fastest.json") == "quick"


@pytest.mark.parametrize("name", ["surfels", "voxels"])
def test_splats_on_hardware_go_the_way_that_was_measured(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    monkeypatch.setattr(module, "cache_folder", lambda: tmp_path)
    monkeypatch.setattr(module, "_TRIAL_POINTS", 1000)
    monkeypatch.setattr(module, "_TRIAL_SIZE", (160, 120))
    cloud = sphere(2000)
    request = Request(Pose(0, 0.0, "test", cloud), Camera.orbit(cloud.bounds()), name)
    pictures, chosen = [], set()
    for _ in range(2):
        gpu = headless()
        gpu.software = False
        renderer = Renderer(gpu)
        surface = Surface(gpu, (80, 60))
        gpu.timers.enabled = True
        render_frame(renderer, request, surface)
        assert {name for name, _ in surface.stats.passes}
        passes = [name for name, _ in surface.stats.passes if name != "clear"]
        assert len(passes) < 30, "passes of the trial are not the picture's"
        chosen.add(surface.stats.chosen["instancing"])
        pictures.append(surface.row)
        renderer.release()
    assert len(chosen) == 1
    assert chosen <= {"tiles", *FEEDS}
    np.testing.assert_array_equal(*pictures)
    params = backend(name).params({"instancing": chosen.pop()})
    assert params.instancing in next(iter(json.loads((tmp_path / "fastest.json").read_text()).values()))

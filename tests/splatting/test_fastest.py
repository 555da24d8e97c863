"""The fastest way is measured once, and remembered."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scenes import sphere

from viewer.camera import Camera
from viewer.drawing.frame import render_frame
from viewer.drawing.renderer import Renderer
from viewer.drawing.request import Request
from viewer.errors import Scan4DError
from viewer.gpu.context import Gpu, headless
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
def test_splats_on_hardware_use_the_variant_that_a_process_measured_before(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    monkeypatch.setattr(module, "cache_folder", lambda: tmp_path)
    monkeypatch.setattr(module, "_TRIAL_POINTS", 1000)
    monkeypatch.setattr(module, "_TRIAL_SIZE", (160, 120))
    cloud = sphere(2000)
    request = Request(Pose(0, 0.0, "test", cloud), Camera.orbit(cloud.bounds()), name)
    file = tmp_path / "fastest.json"

    def draw(pictures: int) -> tuple[Gpu, list[str], list[NDArray]]:
        """Some pictures on a new context: it, what they chose, and their rows."""
        gpu = headless()
        gpu.software = False
        renderer, surface, chosen, rows = Renderer(gpu), Surface(gpu, (80, 60)), list[str](), list[NDArray]()
        for _ in range(pictures):
            render_frame(renderer, request, surface)
            chosen.append(surface.stats.chosen["instancing"])
            rows.append(surface.row)
        return gpu, chosen, rows

    gpu, chosen, rows = draw(1)
    assert chosen == ["tiles"]
    assert not gpu.cached(module._Choices).trials, "the first picture begins none"
    gpu, chosen, (first, second, third) = draw(3)
    (trial,) = gpu.cached(module._Choices).trials.values()
    trial.result()
    (found,) = json.loads(file.read_text()).values()
    assert found in {"tiles", *FEEDS}
    assert chosen == ["tiles"] * 3, "what it finds changes no picture of this process"
    np.testing.assert_array_equal(first, rows[0])
    np.testing.assert_array_equal(second, first)
    np.testing.assert_array_equal(third, first)
    file.write_text(file.read_text().replace(f'"{found}"', '"pull"'))
    gpu, chosen, _ = draw(2)
    assert chosen == ["pull"] * 2
    assert not gpu.cached(module._Choices).trials, "it was measured"

"""The backend of docs/developing/adding-a-backend.md: found, drawn, and held to the contract."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from nested import run_pytest
from numpy.typing import NDArray
from scenes import NOTHING, rarely

import viewer
from viewer import backends as registry
from viewer import resources
from viewer.backends import backend, backends
from viewer.camera import Camera
from viewer.picture.surface import Surface
from viewer.scan.points import PointCloud
from viewer.view import View

ROOT = Path(__file__).resolve().parents[2]
SIZE = (97, 61)
CONTRACT = """
import sys
import pytest, viewer.backends, viewer.resources
viewer.backends.__path__.append(sys.argv[1] + "/viewer/backends")
viewer.resources.ROOTS.append(sys.argv[1])
sys.exit(pytest.main(sys.argv[2:]))
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the files that the page names, holding its blocks of code."""
    folder = tmp_path_factory.mktemp("documented")
    page = (ROOT / "docs" / "developing" / "adding-a-backend.md").read_text(encoding="utf-8")
    files = re.findall(r"`((?:viewer|shaders)/[\w/]+\.\w+)`:?\n\n```\w+\n(.*?)```", page, re.DOTALL)
    assert [name for name, _ in files] == ["viewer/backends/dots.py", "shaders/dots/cells.glsl"]
    for name, text in files:
        (folder / name).parent.mkdir(parents=True)
        (folder / name).write_text(text, encoding="utf-8")
    return folder


@pytest.fixture
def registered(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """It stands among the backends, found as they are."""
    monkeypatch.setattr(registry, "__path__", [*registry.__path__, str(folder / "viewer" / "backends")])
    monkeypatch.setattr(resources, "ROOTS", [*resources.ROOTS, folder])
    backends.cache_clear()
    yield
    backends.cache_clear()


def dots(
    cloud: PointCloud, camera: Camera, diameter: float, facing: bool
) -> tuple[NDArray[np.float64], NDArray[np.uint32]]:
    """The plain twin: depth and row of each pixel, point by point."""
    view = View.of(camera, SIZE, cloud.origin, cloud.bounds())
    pixels, depths = view.project(cloud.positions.astype(np.float64))
    toward = np.array(camera.eye) - cloud.world()
    depth, row = np.full(SIZE[::-1], np.inf), np.full(SIZE[::-1], NOTHING, np.uint32)
    grid = np.mgrid[: SIZE[1], : SIZE[0]]
    for i, ((across, down), d) in enumerate(zip(pixels, depths, strict=True)):
        if d < view.near or (facing and cloud.normals[i] @ toward[i] < 0):
            continue
        around = (  # the pixels that it may reach
            slice(max(int(down - diameter), 0), int(down + diameter) + 1),
            slice(max(int(across - diameter), 0), int(across + diameter) + 1),
        )
        y, x = grid[:, *around]
        reached = (x + 0.5 - across) ** 2 + (y + 0.5 - down) ** 2 <= (diameter / 2) ** 2
        reached |= (x == np.floor(across)) & (y == np.floor(down))
        nearer = reached & (d < depth[around])
        depth[around][nearer], row[around][nearer] = d, i
    return depth, row


@pytest.mark.usefixtures("registered")
@pytest.mark.parametrize("diameter", [*rarely(1.0, 6.5), 3.0])
@pytest.mark.parametrize("facing", [False, True])
def test_the_demo_is_drawn_as_the_page_says(
    draw: Callable[..., Surface], diameter: float, facing: bool
) -> None:
    cloud = viewer.open_scan("demo").pose(0).cloud
    camera = Camera.orbit(cloud.bounds(), 30, 20, aspect=SIZE[0] / SIZE[1])
    surface = draw(cloud, camera, SIZE, "dots", params={"diameter": diameter, "facing": facing})
    depth, row = dots(cloud, camera, diameter, facing)
    assert 0.1 < (row != NOTHING).mean() < 0.9
    # float32 may put a pixel's centre that lies on the rim of a dot on the other side of it.
    assert (surface.row != row).mean() <= 0.002
    same = (surface.row == row) & (row != NOTHING)
    np.testing.assert_allclose(surface.depth[same], depth[same], rtol=1e-6)


@pytest.mark.usefixtures("registered")
def test_what_faces_away_is_left_out(draw: Callable[..., Surface]) -> None:
    cloud = PointCloud.from_arrays([[-0.5, 0, 0], [0.5, 0, 0]], normals=[[0, 0, 1], [0, 0, -1]])
    for facing, seen in ((False, {0, 1}), (True, {0})):
        surface = draw(cloud, Camera(eye=(0, 0, 5)), SIZE, "dots", params={"facing": facing})
        assert set(np.unique(surface.row)) - {NOTHING} == seen


@pytest.mark.usefixtures("registered")
def test_it_is_a_backend_like_all_others() -> None:
    assert "dots" in backends()
    assert backend("dots").help == "Each point as a round dot of pixels; the nearest wins."


def test_it_keeps_the_contract(folder: Path) -> None:
    """Run every test of all backends on it, in a process whose registry finds it from the start."""
    tests = [str(ROOT / "tests" / "backends" / name) for name in ("test_exact.py", "test_preview.py")]
    done = run_pytest("-q", "-k", "dots", *tests, cwd=ROOT, start=["-c", CONTRACT, str(folder)])
    assert done.returncode == 0, done.stdout + done.stderr
    found = re.search(r"(\d+) passed", done.stdout)
    assert found, done.stdout
    assert int(found[1]) >= 20

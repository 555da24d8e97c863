"""The packages of the pages docs/developing/adding-….md: installed as pip does, they extend Scan4D."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from extended import PAGES, ROOT, pip_install, run_with, write_package
from nested import run_pytest
from numpy.typing import NDArray
from PIL import Image
from scenes import NOTHING, rarely

import viewer
from viewer.backends import backends
from viewer.camera import Camera
from viewer.extensions import installed_extensions
from viewer.picture.surface import Surface
from viewer.scan.points import PointCloud
from viewer.view import View

SIZE = (97, 61)


@pytest.fixture(scope="module")
def packages(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """The folders of all packages, by kind."""
    folder = tmp_path_factory.mktemp("packages")
    return {kind: write_package(kind, folder) for kind in PAGES}


@pytest.fixture(scope="module")
def target(packages: dict[str, Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder in which they are installed."""
    target = tmp_path_factory.mktemp("installed")
    for package in packages.values():
        pip_install(package, target)
    return target


@pytest.mark.parametrize("kind", PAGES)
@pytest.mark.slow
def test_its_own_test_passes(kind: str, packages: dict[str, Path], target: Path) -> None:
    done = run_pytest("-q", "tests", cwd=packages[kind], paths=[target, ROOT])
    assert done.returncode == 0, done.stdout + done.stderr
    passed = re.search(r"(\d+) passed", done.stdout)
    assert passed, done.stdout
    assert int(passed[1]) >= {"backend": 19, "reader": 1, "measure": 6, "tool": 6}[kind]


@pytest.mark.slow
def test_doctor_lists_the_packages(target: Path) -> None:
    rows = " ".join(run_with(target, "-m", "viewer", "doctor").stdout.split())
    for kind, package in PAGES.items():
        name = package.removeprefix("scan4d-")
        assert f"{kind} {name} {package} 1.0, module {package.replace('-', '_')}" in rows


@pytest.mark.slow
def test_the_backend_draws(target: Path, tmp_path: Path) -> None:
    picture = tmp_path / "dots.png"
    words = ("render", "demo", "--backend", "dots", "--set", "diameter=5", "--size", "160x120")
    done = run_with(target, "-m", "viewer", *words, "-o", picture)
    assert done.returncode == 0, done.stderr
    with Image.open(picture) as image:
        assert len(image.convert("RGB").getcolors(160 * 120)) > 100, "a shaded subject"


@pytest.mark.slow
def test_the_reader_opens_a_file(target: Path, tmp_path: Path) -> None:
    path = tmp_path / "solid.stl"
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], "<f4")
    path.write_bytes(bytes(80) + (1).to_bytes(4, "little") + bytes(12) + corners.tobytes() + bytes(2))
    done = run_with(target, "-m", "viewer", "info", path, "--json")
    assert done.returncode == 0, done.stderr
    facts = json.loads(done.stdout)
    assert (facts["points"], facts["package"]) == (3, "scan4d-stl 1.0")
    converted = run_with(target, "-m", "viewer", "convert", path, tmp_path / "solid.ply")
    assert converted.returncode == 0, converted.stderr


@pytest.mark.slow
def test_the_measure_is_measured_from_the_command_line(target: Path, tmp_path: Path) -> None:
    points = np.stack(np.meshgrid(np.arange(20.0), np.arange(20.0), [0.0]), axis=-1).reshape(-1, 3)
    np.save(tmp_path / "scan.npy", points)
    (tmp_path / "landmarks.csv").write_text("name,x,y,z\na,0,0,0\nb,4,0,0\nc,0,3,0\n")
    (tmp_path / "measures.toml").write_text(
        '[[measures]]\nname = "corner"\nkind = "triangle"\nlandmarks = ["a", "b", "c"]\n'
    )
    paths = {name: tmp_path / name for name in ("landmarks.csv", "measures.toml", "out.json")}
    words = ("--landmarks", paths["landmarks.csv"], "--measures", paths["measures.toml"])
    done = run_with(target, "-m", "viewer", "measure", tmp_path / "scan.npy", *words, "-o", paths["out.json"])
    assert done.returncode == 0, done.stderr
    assert '"corner"' in paths["out.json"].read_text()
    assert re.search(r'"value": 6\.0', paths["out.json"].read_text()), paths["out.json"].read_text()


# --- the backend's pictures, point by point -----------------------------------------------------------


@pytest.fixture
def registered(target: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Have this process find what is installed, too."""
    monkeypatch.syspath_prepend(target)
    installed_extensions.cache_clear()
    backends.cache_clear()
    yield
    installed_extensions.cache_clear()
    backends.cache_clear()


def dots(
    cloud: PointCloud, camera: Camera, diameter: float
) -> tuple[NDArray[np.float64], NDArray[np.uint32]]:
    """The plain twin: depth and row of each pixel, point by point."""
    view = View.of(camera, SIZE, cloud.origin, cloud.bounds())
    pixels, depths = view.project(cloud.positions.astype(np.float64))
    depth, row = np.full(SIZE[::-1], np.inf), np.full(SIZE[::-1], NOTHING, np.uint32)
    grid = np.mgrid[: SIZE[1], : SIZE[0]]
    for i, ((across, down), d) in enumerate(zip(pixels, depths, strict=True)):
        if d < view.near:
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
@pytest.mark.slow
def test_the_demo_is_drawn_as_the_page_says(draw: Callable[..., Surface], diameter: float) -> None:
    cloud = viewer.open_scan("demo").pose(0).cloud
    camera = Camera.orbit(cloud.bounds(), 30, 20, aspect=SIZE[0] / SIZE[1])
    surface = draw(cloud, camera, SIZE, "dots", params={"diameter": diameter})
    depth, row = dots(cloud, camera, diameter)
    assert 0.1 < (row != NOTHING).mean() < 0.9
    # float32 may put a pixel's centre that lies on the rim of a dot on the other side of it.
    assert (surface.row != row).mean() <= 0.002
    same = (surface.row == row) & (row != NOTHING)
    np.testing.assert_allclose(surface.depth[same], depth[same], rtol=1e-6)

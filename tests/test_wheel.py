"""The built wheel carries shaders and assets, and its command works from any folder."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import pytest
from PIL import Image

ROOT = Path(__file__).resolve().parents[1]


def run(*command: str | Path, **options: Any) -> str:
    """Run a command and return what it printed; its errors become the test's."""
    result = subprocess.run(command, capture_output=True, text=True, **options)
    assert result.returncode == 0, f"{command} ended with {result.returncode}:\n{result.stderr}"
    return result.stdout


def pip(*arguments: str | Path) -> None:
    run(sys.executable, "-m", "pip", "--quiet", "--disable-pip-version-check", *arguments)


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("dist")
    pip("wheel", "--no-deps", "--no-build-isolation", "--wheel-dir", folder, ROOT)
    (path,) = folder.glob("scan4d-*.whl")
    return path


@pytest.mark.slow
def test_the_wheel_carries_all_shaders_and_assets(wheel: Path) -> None:
    shipped = {
        f"viewer/{path.relative_to(ROOT).as_posix()}"
        for folder in ("shaders", "assets")
        for path in (ROOT / folder).rglob("*")
        if path.is_file()
    }
    with ZipFile(wheel) as archive:
        assert shipped <= set(archive.namelist())
    assert any(name.startswith("viewer/shaders/") for name in shipped)


def test_the_wheel_is_small(wheel: Path) -> None:
    assert wheel.stat().st_size < 20e6


@pytest.mark.slow
def test_the_installed_command_renders_the_demo_from_elsewhere(wheel: Path, tmp_path: Path) -> None:
    target, elsewhere = tmp_path / "installed", tmp_path / "elsewhere"
    elsewhere.mkdir()
    pip("install", "--no-deps", "--target", target, wheel)
    # PYTHONPATH comes before site-packages, where an editable install points to the checkout.
    here = {"cwd": elsewhere, "env": {**os.environ, "PYTHONPATH": str(target)}}

    imported = run(sys.executable, "-c", "import viewer.resources as r; print(r.__file__)", **here)
    assert Path(imported.strip()).is_relative_to(target)

    run(target / "bin" / "scan4d", "render", "demo", "-o", "picture.png", "--size", "160x120", **here)
    with Image.open(elsewhere / "picture.png") as picture:
        assert picture.size == (160, 120)
        assert len(picture.convert("RGB").getcolors(160 * 120)) > 100  # a shaded subject, not a blank

"""`scan4d doctor`, and OpenGL that is missing, too old or lacks room for its cache."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from small_scans import SMALL, finish, process

import viewer
from viewer.drawing.renderer import Renderer


def test_doctor(renderer: Renderer) -> None:
    done = finish(process("doctor", DISPLAY="", WAYLAND_DISPLAY=""))
    assert done.code == 0
    for words in (
        renderer.gpu.device, renderer.gpu.driver, "GL_ARB_clip_control", "max_shader_storage_block_size",
        f"Python   {sys.version.split()[0]}", viewer.__version__, "neither DISPLAY nor WAYLAND_DISPLAY",
        "not open a window",
    ):  # fmt: skip
        assert words in re.sub("  +", "   ", done.out), words
    done = finish(process("doctor", DISPLAY=":7", WAYLAND_DISPLAY=""))
    assert "DISPLAY=:7" in done.out


def test_doctor_without_opengl() -> None:
    done = finish(process("doctor", "--device", 99))
    assert (done.code, done.err) == (3, "")
    assert "EGL device 99" in done.out
    assert "lists the devices" in done.out


@pytest.mark.usefixtures("mesa")
def test_an_older_opengl_is_named(tmp_path: Path) -> None:
    older = {"MESA_GL_VERSION_OVERRIDE": "3.3", "DISPLAY": "", "WAYLAND_DISPLAY": ""}
    done = finish(process("render", "demo", "-o", tmp_path / "a.png", **older))
    assert done.code == 3
    assert re.fullmatch(
        r"scan4d: OpenGL 3\.3 on [^\n]* is too old for Scan4D\. [^\n]* 4\.3 [^\n]*\n", done.err
    ), done.err
    done = finish(process("doctor", **older))
    assert done.code == 3
    assert "OpenGL 3.3 on " in done.out


@pytest.fixture
def mesa(renderer: Renderer) -> None:
    if "Mesa" not in renderer.gpu.driver:
        pytest.skip("these environment variables are Mesa's")


@pytest.fixture
def full_disk(tmp_path: Path) -> Iterator[Path]:
    """The folder of a file system of its own that has no room."""
    folder = tmp_path / "disk"
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", str(folder)]
    if shutil.which("mount") is None or subprocess.run(mount, capture_output=True).returncode:
        pytest.skip("a file system cannot be mounted here")
    try:
        (folder / "full").write_bytes(bytes(60_000))
        yield folder
    finally:
        subprocess.run(["umount", str(folder)], check=True)


@pytest.mark.usefixtures("mesa")
@pytest.mark.slow
def test_a_full_disk_under_the_shader_cache_is_no_harm(full_disk: Path, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    caches = {
        str(full_disk): "the disk is full",
        str(tmp_path / "file"): "a part of the path is not a folder",
        str(tmp_path / "new"): str(tmp_path / "new" / "mesa_shader_cache") + "\n",
    }
    for cache, words in caches.items():
        done = finish(process("doctor", MESA_SHADER_CACHE_DIR=cache))
        assert (done.code, done.err) == (0, "")
        assert re.search(rf"shader cache +.*{re.escape(words)}", done.out), done.out
    picture = ("render", "demo", "-o", tmp_path / "a.png", *SMALL)
    done = finish(process(*picture, MESA_SHADER_CACHE_DIR=str(full_disk)))
    assert done == (0, f"{tmp_path / 'a.png'}\n", "")

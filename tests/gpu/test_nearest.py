"""Nearest items of cells: 64-bit atomics find what two passes of 32-bit ones do."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from scenes import sphere

from viewer.backends import backends
from viewer.camera import Camera
from viewer.drawing.frame import render_frame
from viewer.drawing.renderer import Renderer
from viewer.drawing.request import Request
from viewer.gpu import gl, scatter
from viewer.gpu.constants import NO_DEPTH, NOTHING
from viewer.gpu.context import WIDE_EXTENSIONS
from viewer.gpu.shader import Source
from viewer.picture.surface import Surface
from viewer.scan.pose import Pose
from viewer.splatting.squares import _Squares

CELLS = 5000
POINTS = [name for name, each in backends().items() if each.rows == "points"]


def pictures(renderer: Renderer, name: str) -> list[np.ndarray]:
    """Some pictures of a sphere that turns."""
    cloud, surface = sphere(20_000), Surface(renderer.gpu, (80, 60))
    shown = []
    for turn in (0, 5, 10):
        request = Request(Pose(0, 0.0, "turning", cloud), Camera.orbit(cloud.bounds(), turn, 15), name)
        while render_frame(renderer, request, surface):
            pass
        shown += [surface.depth, surface.row, surface.image()]
    surface.release()
    return shown


def test_cells_are_split_into_keys_and_items_and_clear_again(renderer: Renderer) -> None:
    gpu, rng = renderer.gpu, np.random.default_rng(4)
    keys, best = (gl.BufferTexture(gpu.buffer(reserve=4 * CELLS), gl.R32UI) for _ in range(2))
    nearest = scatter.OnePass(gpu, keys, best)
    wide = nearest._wide._buffer
    assert wide is not None
    empty = gpu.read(wide, np.uint64, CELLS)
    assert (empty == (NO_DEPTH << 32 | NOTHING)).all()
    found = np.minimum(rng.integers(0, NO_DEPTH, CELLS, np.uint64) << np.uint64(32) | np.uint64(7), empty)
    wide.write(found)
    nearest.show_keys()
    assert (gpu.read(keys.buffer, np.uint32) == found >> np.uint64(32)).all()
    assert (gpu.read(wide, np.uint64, CELLS) == found).all()
    nearest.finish(None)
    assert (gpu.read(keys.buffer, np.uint32) == found >> np.uint64(32)).all()
    assert (gpu.read(best.buffer, np.uint32) == 7).all()
    assert (gpu.read(wide, np.uint64, CELLS) == empty).all()
    gpu.discard(keys, best)


def test_what_a_picture_left_half_done_is_cleared(renderer: Renderer) -> None:
    gpu = renderer.gpu
    keys, best = (gl.BufferTexture(gpu.buffer(reserve=4 * CELLS), gl.R32UI) for _ in range(2))
    left = scatter.OnePass(gpu, keys, best)
    assert left._wide._buffer is not None
    left._wide._buffer.write(bytes(8 * CELLS))
    scatter.OnePass(gpu, keys, best).finish(None)
    assert (gpu.read(keys.buffer, np.uint32) == NO_DEPTH).all()
    assert (gpu.read(best.buffer, np.uint32) == NOTHING).all()
    gpu.discard(keys, best)


@pytest.mark.parametrize("name", POINTS)
def test_pictures_are_the_same_by_either_atomics(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    if not renderer.gpu.ctx.extensions >= WIDE_EXTENSIONS:
        pytest.skip("this driver has no 64-bit atomics")
    one = pictures(renderer, name)
    monkeypatch.setattr(renderer.gpu, "wide_atomics", False)
    assert all((a == b).all() for a, b in zip(pictures(renderer, name), one, strict=True))


def test_the_reference_compiler_takes_64_bit_atomics(tmp_path: Path) -> None:
    validator = shutil.which("glslangValidator")
    if validator is None:
        pytest.skip("no glslangValidator; Debian has it in glslang-tools")
    squares = {
        **dict.fromkeys(("SINGLE", "SAMPLED", "FILTERED", "CHUNKED", "KEPT", "STRIDED", "LISTED"), 0),
        **{"ITEMS": "item_count", "PASS": 0, "LISTS": 0, "WIDE": 1},
    }
    parts = {"target": "scatter/best.glsl", "cells": "points/cells.glsl"}
    for given in (squares, {**squares, "CHUNKED": 1, "CHUNK": 64, "LISTED": 1, "ITEMS": "list_count"}):
        source = Source("scatter/scatter.comp", given, parts, _Squares)
        file = tmp_path / "wide.comp"
        file.write_text(source.text)
        done = subprocess.run([validator, str(file)], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout

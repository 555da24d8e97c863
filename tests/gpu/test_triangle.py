"""Depths within a triangle of a picture (shaders/common/triangle.glsl), against those of its plane."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from viewer.drawing.renderer import Renderer

PROBE = str(Path(__file__).resolve().parent / "shaders" / "triangle.comp")


@pytest.mark.parametrize("is_perspective", [False, True])
def test_depths_are_those_of_the_plane(renderer: Renderer, is_perspective: bool) -> None:
    """Depth is linear across an orthographic picture, and its inverse across one in perspective."""
    gpu, random = renderer.gpu, np.random.default_rng(0)
    corners = np.array([[3.0, 5, 2, 0], [90, 20, 3, 0], [30, 70, 7, 0]])
    shares = random.dirichlet((1, 1, 1), 500)
    depths = 1 / (shares @ (1 / corners[:, 2])) if is_perspective else shares @ corners[:, 2]
    given = corners, shares @ corners[:, :2], np.zeros(len(shares))
    buffers = [gpu.ctx.buffer(array.astype(np.float32)) for array in given]
    for binding, buffer in enumerate(buffers):
        buffer.bind_to_storage_buffer(binding)
    gpu.dispatch(gpu.compute(PROBE, {"PERSPECTIVE": int(is_perspective)}), len(shares))
    np.testing.assert_allclose(np.frombuffer(buffers[2].read(), np.float32), depths, rtol=1e-5)

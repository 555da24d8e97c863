"""Pyramidal projection draws the level of range views whose samples fit the pixels."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from viewer.bounds import Bounds
from viewer.picture.surface import Surface
from viewer.scan.pods import first_camera
from viewer.scan.range_view import RangeView

pytestmark = pytest.mark.backend("pyramidal")


@pytest.mark.parametrize("primitive", ["points", "polygons"])
@pytest.mark.parametrize("zoom", [1.5, 3.0])
def test_what_is_near_is_drawn_finely_where_a_tile_has_what_is_far_too(
    draw: Callable[..., Surface], primitive: str, zoom: float
) -> None:
    row, column = np.mgrid[:80, :96]
    near = np.hypot(row - 40, column - 48) < 25
    view = RangeView(
        depth=np.where(near, np.float32(0.5), np.float32(20)),
        mask=np.ones(near.shape, bool),
        color=np.random.default_rng(1).integers(0, 256, (*near.shape, 3), np.uint8),
        fx=90.0,
        fy=90.0,
        cx=48.0,
        cy=40.0,
        world_to_camera=np.eye(4),
    )
    size = round(96 * zoom), round(80 * zoom)
    camera = first_camera([view], Bounds(np.zeros(3), np.ones(3)), 96 / 80)
    params = {"primitive": primitive, "lod": False}
    plain = draw((view,), camera, size, "pyramidal", None, params)
    fitted = draw((view,), camera, size, "pyramidal", None, params | {"lod": True})
    np.testing.assert_array_equal(plain.row, fitted.row)
    np.testing.assert_array_equal(plain.image(), fitted.image())

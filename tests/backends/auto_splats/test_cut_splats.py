"""Splats end where the surface that their neighbours tell is seen to end."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from bare_scenes import on_unit_sphere, seen
from scenes import sphere_hits

from viewer.bench import metrics
from viewer.bench.scenes.defects import noisy
from viewer.picture.surface import Surface
from viewer.scan.points import PointCloud

pytestmark = pytest.mark.backend("auto_splats")

NAME, SIZE, COUNT = "auto_splats", (320, 240), 500


@pytest.mark.parametrize(("noise", "left"), [(0.0, 0.7), (0.3, 0.35)])
def test_splats_of_a_ball_end_at_its_outline(draw: Callable[..., Surface], noise: float, left: float) -> None:
    """left: share of the area beyond the outline that whole splats would draw."""
    points = on_unit_sphere(COUNT)
    cloud = noisy(noise)(PointCloud.from_arrays(points, normals=points), np.random.default_rng(0))
    scene = seen(cloud.positions.astype(float), SIZE)
    true = np.isfinite(sphere_hits(scene.camera, SIZE)[0])
    cut, whole = (
        metrics.coverage(surface.coverage > 0, true)
        for surface in (
            draw(scene.cloud, scene.camera, SIZE, NAME, params={"surface": name})
            for name in ("local", "nearest")
        )
    )
    assert cut["spill_percent"] < left * whole["spill_percent"]
    assert cut["hole_percent"] < 0.5

"""Visible points under noise: more of them are right than the exact operator tells, on scans with faces."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from viewer.camera import Camera
from viewer.mesh.reference import visible
from viewer.mesh.triangles import read_mesh, vertex_normals
from viewer.visibility.exact import SeenPoints, flipping, hull_rows
from viewer.visibility.search import visible_points

NOISES = (0.001, 0.005, 0.01)  # standard deviations, in diameters of the model
# Percent of errors at most, with each noise.
NOISY_MODELS = {
    "stanford_bunny_35947": (6, 12, 18),
    "stanford_armadillo_43243": (14, 24, 36),
    "cyberware_igea_134345": (6, 12, 17),
    "stanford_dragon_437645": (10, 28, 50),
}
DECADES = (3.0, 3.5, 4.0, 4.5)  # of radii of the exact operator, in distances of the farthest point


@pytest.mark.slow
@pytest.mark.parametrize("name", NOISY_MODELS)
def test_under_noise_it_errs_less_than_the_exact_operator_at_its_best(data_dir: Path, name: str) -> None:
    """The truth is that of points where they were."""
    mesh = read_mesh(data_dir / "models" / f"{name}.ply")
    camera = Camera.orbit(mesh.bounds, 30, 10)
    truth = visible(mesh, mesh.points.positions, camera)
    errors = []
    for noise, most in zip(NOISES, NOISY_MODELS[name], strict=True):
        by = np.random.default_rng(0).normal(0, 2 * mesh.bounds.radius * noise, (len(truth), 1))
        cloud = mesh.points.displaced(by * vertex_normals(mesh))
        seen = SeenPoints.of(cloud, camera.eye)
        farthest = float(seen.distance.max())
        hulls = [hull_rows(seen, flipping(seen, farthest * 10**decades)) for decades in DECADES]
        found, *exact = (error(rows, truth) for rows in (visible_points(cloud, camera.eye), *hulls))
        errors.append((noise, found, min(exact)))
        assert found < most, errors
        assert found < 0.85 * min(exact), errors


def error(rows: NDArray[np.integer], truth: NDArray[np.bool_]) -> float:
    """Percent of the points that are rightly called visible."""
    seen = np.isin(np.arange(len(truth)), rows)
    return 100 * np.count_nonzero(seen != truth) / np.count_nonzero(seen & truth)

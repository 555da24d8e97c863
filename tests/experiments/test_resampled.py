"""Sequences that are sampled anew: on the moved surface, with the noise told, and no point in two frames."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from demo_surface import rest_of, surface_normal, surface_value
from experiments.landmarks.resampled import ResampledDemo, ResampledMesh

from viewer.scan.open import find_source
from viewer.scan.spacing import typical_spacing
from viewer.scan.timeline import Timeline

FRONT = 85.0  # mm: mouth and nose alone


def test_points_of_the_demo_are_on_its_exact_surface() -> None:
    source = ResampledDemo("demo:sway:1", behind=FRONT)
    points, time = source.load(20).world(), float(source.times()[20])
    value = np.abs(surface_value(points, time, source.demo.motion))
    assert len(points) > 3000
    assert np.quantile(value, 0.99) < 1e-3


def test_paths_of_points_are_where_they_lie_in_each_frame() -> None:
    source = ResampledDemo("demo:sway:1", behind=FRONT)
    still, there = source.paths(20, [20, 25])
    assert np.allclose(still, source.load(20).world(), atol=1e-4)
    rest = [
        rest_of(points.T, float(source.times()[i]), source.demo.motion)
        for i, points in ((20, still), (25, there))
    ]
    assert np.abs(rest[0] - rest[1]).max() < 1e-2


def test_noise_is_along_the_normal_and_of_the_size_told() -> None:
    clean, noisy = (ResampledDemo("demo:smile", noise, behind=FRONT) for noise in (0.0, 0.25))
    one, other = clean.load(30).world(), noisy.load(30).world()
    assert not np.array_equal(one, other)
    normals = surface_normal(one, float(clean.times()[30]), clean.demo.motion)
    along = ((other - one) * normals).sum(axis=1)
    across = np.linalg.norm(other - one - along[:, None] * normals, axis=1)
    assert abs(along.std() / 0.25 - 1) < 0.05
    assert np.median(across) < 1e-3


def test_no_point_of_the_subject_is_in_two_frames() -> None:
    source = ResampledDemo("demo:smile", behind=FRONT)
    first, second = (
        rest_of(source.load(i).world()[::4].T, float(source.times()[i]), source.demo.motion).T for i in (0, 1)
    )
    nearest = np.array([np.linalg.norm(first - place, axis=1).min() for place in second])
    assert np.mean(nearest < 0.01) < 0.002
    assert len(source.load(0)) != len(source.load(1))


def test_frames_repeat_and_tell_no_topology() -> None:
    source = ResampledDemo("demo:cough", 0.1, seed=5, behind=FRONT)
    np.testing.assert_array_equal(
        source.load(2).positions, ResampledDemo("demo:cough", 0.1, 5, FRONT).load(2).positions
    )
    with Timeline(source, source.times(), source.unit or "") as timeline:
        assert timeline.pose(0).cloud.topology is None
        assert timeline.pose(0).cloud.colors is not None


def test_meshes_are_sampled_anew(tmp_path: Path) -> None:
    for frame in range(2):
        corners = [(0, 0, frame), (4, 0, frame), (4, 4, frame), (0, 4, frame)]
        lines = [f"v {x} {y} {z}" for x, y, z in corners]
        (tmp_path / f"{frame}.obj").write_text("\n".join([*lines, "f 1 2 3", "f 1 3 4"]))
    source = ResampledMesh(find_source(tmp_path), count=1600)
    first, second = source.load(0), source.load(1)
    assert len(first) == len(second) == 1600
    assert first.topology is None
    assert 0.07 < typical_spacing(first) < 0.13
    np.testing.assert_allclose(second.world()[:, 2], 1, atol=1e-6)
    between = np.linalg.norm(first.world()[:, None, :2] - second.world()[None, :, :2], axis=2).min(axis=1)
    assert np.median(between) > 0.01
    noisy = ResampledMesh(find_source(tmp_path), count=1600, noise=0.05).load(0).world()
    assert abs(noisy[:, 2].std() / 0.05 - 1) < 0.1

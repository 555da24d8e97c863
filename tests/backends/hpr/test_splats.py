"""Splats of candidates, against the plain version of going around sectors."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import packed
import pytest
from numpy.typing import NDArray
from scenes import NOTHING, sphere, sphere_hits
from sector_scenes import Scene

from viewer.backends.hpr.splats import SectorSplats
from viewer.bench.metrics import angles_between
from viewer.bench.scenes.defects import noisy
from viewer.camera import Camera
from viewer.drawing.renderer import Renderer
from viewer.look import Look
from viewer.picture.surface import Surface
from viewer.scan.points import PointCloud
from viewer.visibility.spacing import local_spacings

Draw = Callable[..., Surface]
RING = ((-1, -1), (0, -1), (1, -1), (1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0))
WIDEST = 3  # sectors
STEP = 2.0**-16  # of sums: triangles with what is far behind add nothing
CAMERAS = {
    "grid": Camera(eye=(0.4, 0.3, 4.0), target=(0, 0, 0), fov_y=40),
    "cube": Camera(eye=(0.3, 0.2, 1.1), target=(0, 0, 0), fov_y=60),
}


def bumpy(count: int) -> PointCloud:
    """A ball with bumps, at places that are on no grid."""
    directions = np.random.default_rng(0).normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    return PointCloud.from_arrays(directions * (1 + 0.1 * np.sin(7 * directions[:, :1])))


def widths_of(scene: Scene, eye: NDArray[np.float64]) -> NDArray[np.float64]:
    """The edge of a sector where each point lies, (N,), scan units."""
    away = np.linalg.norm(scene.positions + scene.pose.origin - eye, axis=1)
    return scene.candidates.sectors.angle * away


def circulated(scene: Scene, eye: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Normals (N, 3) and spacings (N,) of the candidates, as hpr/circulation.glsl says: plain loops."""
    rows, positions, widths = scene.rows, scene.positions, widths_of(scene, eye)
    every = np.arange(len(rows), dtype=np.uint32)
    around = np.stack([scene.beside(every, step) for step in RING], axis=1)
    normals, counts, near = np.zeros((len(positions), 3)), np.zeros(len(positions)), np.zeros(len(positions))
    for own, ring in zip(rows, around, strict=True):
        if own == NOTHING:
            continue
        others = [(place, row) for place, row in enumerate(ring) if row not in (NOTHING, own)]
        offsets = [(positions[row] - positions[own]) / widths[own] for _, row in others]
        nearness = [min(1 / np.linalg.norm(offset), 1) for offset in offsets]
        counts[own] += len(others)
        near[own] += sum(nearness)
        to_eye, total = eye - scene.pose.origin - positions[own], np.zeros(3)
        for i in range(len(others)):
            j = (i + 1) % len(others)
            steps = (others[j][0] - others[i][0]) % 8 or 8
            if others[i][1] == others[j][1] or steps > WIDEST:
                continue
            a, b = offsets[i], offsets[j]
            across = np.cross(a, b) / (np.linalg.norm(a) * np.linalg.norm(b)) * nearness[i] * nearness[j]
            total += across if across @ to_eye >= 0 else -across
        normals[own] += np.round(total / STEP) * STEP
    known = counts > 0
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    spacings = np.where(known, widths * counts / np.where(known, near, 1), widths)
    return normals / np.where(length > 0, length, 1), spacings


def reaches(scene: Scene, eye: NDArray[np.float64]) -> NDArray[np.float64]:
    """How far the middle of a candidate's farthest sector passes it, (N,), scan units; -1: it has none."""
    sectors, rows = scene.candidates.sectors, scene.rows
    found = np.full(len(scene.positions), -1.0)
    away = scene.positions + scene.pose.origin - eye
    far = np.linalg.norm(away, axis=1)
    base = np.array(sectors.to_sectors)[:3, :3].T * sectors.unit  # rows: the sectors' axes
    towards = away / far[:, None] @ base.T
    directions = sectors.directions(np.arange(len(rows), dtype=np.uint32))
    if sectors.mapping == "grid":
        directions = directions * [1, sectors.tangent, sectors.tangent]
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    for sector, row in enumerate(rows):
        if row != NOTHING:
            apart = np.linalg.norm(towards[row] - directions[sector]) * far[row]
            found[row] = max(found[row], apart)
    return found


@pytest.mark.parametrize("name", CAMERAS)
def test_normals_and_sizes_are_those_of_the_plain_version(renderer: Renderer, name: str) -> None:
    camera, cloud = CAMERAS[name], bumpy(1500)
    eye = np.array(camera.eye)
    scene = Scene.of(renderer, cloud, camera, edge=60 if name == "grid" else 40)
    assert scene.candidates.sectors.mapping == name
    splats = SectorSplats(renderer.gpu, (1, 1))
    splats.find(scene.pose, scene.candidates)
    words = np.frombuffer(splats["splats"].buffer.read(), np.uint32).reshape(-1, 3)
    normals, radii, _ = packed.unpack(words)
    found = np.frombuffer(splats["spacings"].buffer.read(), np.float32)
    expected, spacings = circulated(scene, eye)
    reach = reaches(scene, eye)
    seen = reach >= 0
    assert seen.sum() > 300
    np.testing.assert_array_equal(radii > 0, seen)
    np.testing.assert_allclose(found[seen], spacings[seen], rtol=2e-3)
    told = seen & (np.linalg.norm(expected, axis=1) > 0)
    assert told.sum() > 0.9 * seen.sum()
    off = 1 - np.einsum("ij,ij->i", normals[told], expected[told])
    assert (off > 1e-4).mean() < 0.005, "but for triangles seen from their edge, and sums of a step"
    to_eye = eye - scene.pose.origin - scene.positions
    to_eye /= np.linalg.norm(to_eye, axis=1, keepdims=True)
    cosine = np.where(told, np.einsum("ij,ij->i", normals, to_eye), 1.0)
    size = reach + 0.5 * widths_of(scene, eye)
    leaning = size / np.maximum(cosine, 0.5)
    size = np.minimum(np.maximum(leaning, np.minimum(spacings, 3 * size)), 1.5 * spacings)
    apart = local_spacings(scene.pose.stored)
    apart = np.maximum(apart, widths_of(scene, eye))
    is_clear = seen & (np.abs(reach + 0.5 * widths_of(scene, eye) - 1.4 * apart) > 0.02 * apart)
    at_outline = reach + 0.5 * widths_of(scene, eye) > 1.4 * apart
    assert 0 < at_outline[seen].mean() < 0.5
    size = np.where(
        at_outline, np.minimum(size, 1.1 * apart), np.maximum(size, np.minimum(apart, 3 * spacings))
    )
    np.testing.assert_allclose(radii[is_clear], size[is_clear], rtol=0.02)
    splats.release()


def test_splats_close_a_sphere_and_have_its_normals(draw: Draw) -> None:
    cloud = PointCloud.from_arrays(sphere(20_000).positions)
    camera, size = Camera.orbit(cloud.bounds(), 40, 25, aspect=4 / 3), (160, 120)
    surface = draw(cloud, camera, size, "hpr", Look(light="head"), {"output": "splats"})
    depth, normal = sphere_hits(camera, size)
    inside, covered = np.isfinite(depth), np.isfinite(surface.depth)
    assert (inside & ~covered).mean() < 1e-3
    both = inside & covered & (normal @ camera.rotation()[2] > 0.3)
    np.testing.assert_allclose(surface.depth[both], depth[both], atol=0.05)
    cosine = np.einsum("ijk,ijk->ij", surface.normal, normal)[both]
    assert np.degrees(np.arccos(np.clip(cosine, -1, 1))).mean() < 2


def test_splats_close_a_sphere_of_random_points(draw: Draw) -> None:
    """However unevenly they lie, wide gaps and leaning splats leave no pixel open."""
    directions = np.random.default_rng(0).normal(size=(30_000, 3))
    cloud = PointCloud.from_arrays(directions / np.linalg.norm(directions, axis=1, keepdims=True))
    camera, size = Camera((0.0, 0.0, 3.2)), (160, 120)
    inside = np.isfinite(sphere_hits(camera, size)[0])
    surface = draw(cloud, camera, size, "hpr")
    covered = np.isfinite(surface.depth)
    assert (inside & ~covered).sum() < 5e-3 * inside.sum()
    assert (covered & ~inside).sum() < 0.02 * inside.sum(), "they do not spread beyond the outline"
    assert (surface.depth[inside & covered] > 3.2).sum() < 2e-3 * inside.sum(), "nor show the far side"


def test_the_same_bits_each_time(draw: Draw) -> None:
    cloud, camera = bumpy(3000), CAMERAS["grid"]
    first, second = (
        draw(cloud, camera, (80, 60), "hpr", Look(light="head"), {"output": "splats"}) for _ in range(2)
    )
    np.testing.assert_array_equal(first.normal, second.normal)
    np.testing.assert_array_equal(first.row, second.row)


@pytest.mark.parametrize(("noise", "mean"), [(0.3, 3.0), (0.6, 5.0)])
def test_noise_hardly_turns_normals(draw: Draw, noise: float, mean: float) -> None:
    """Normals around sectors would be off by 15 and 28 degrees."""
    even = sphere(6000)
    moved = noisy(noise)(even, np.random.default_rng(1))
    camera, size = Camera.orbit(even.bounds(), 30, 10), (240, 240)
    surface = draw(PointCloud(moved.positions, moved.origin), camera, size, "hpr", look=Look(light="head"))
    depth, normals = sphere_hits(camera, size)
    both = (surface.coverage > 0) & np.isfinite(depth)
    angles = angles_between(surface.normal[both], normals[both])
    assert angles.mean() < mean
    assert np.quantile(angles, 0.95) < 3 * mean

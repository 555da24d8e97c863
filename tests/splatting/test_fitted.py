"""Splats that are fitted to the cells of their points: as plainly computed, and what they are good for."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray
from splat_scenes import assert_agree

from viewer.bench.scenes.samples import on_torus
from viewer.bench.scenes.subjects import with_rows
from viewer.camera import Camera
from viewer.drawing.renderer import Renderer
from viewer.picture.surface import Surface
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose
from viewer.splatting.gaps import GapRadii

pytestmark = pytest.mark.backend("surfels")
Draw = Callable[..., Surface]
SIZE = (300, 200)


class Ellipse(NamedTuple):
    """Ellipse in a plane. middle: (2,). lengths: of the longer half-axis and the other. turn: of the longer
    one."""

    middle: NDArray[np.float64]
    lengths: NDArray[np.float64]
    turn: float


def ellipse_round(corners: NDArray[np.float64], rounds: int) -> Ellipse:
    """An ellipse round corners (K, 2), by Khachiyan's method towards the smallest one."""
    weights = np.full(len(corners), 1 / len(corners))
    for _ in range(rounds + 1):
        middle = weights @ corners
        off = corners - middle
        form = (weights[:, None] * off).T @ off
        far = np.einsum("ki,ij,kj->k", off, np.linalg.inv(form), off)
        weights = weights * (far + 1) / 3
    squares, axes = np.linalg.eigh(far.max() * form)
    return Ellipse(middle, np.sqrt(squares[::-1]), float(np.arctan2(axes[1, 1], axes[0, 1])))


def turned(vectors: NDArray[np.float64], angle: float) -> NDArray[np.float64]:
    """Vectors (..., 2) in axes that are turned by an angle."""
    x, y = vectors[..., 0], vectors[..., 1]
    return np.stack([np.cos(angle) * x + np.sin(angle) * y, np.cos(angle) * y - np.sin(angle) * x], axis=-1)


def directions(count: int) -> NDArray[np.float64]:
    """Unit vectors around, (count, 2)."""
    turns = np.arange(count) * 2 * np.pi / count
    return np.stack([np.cos(turns), np.sin(turns)], axis=1)


def reaches(d: NDArray[np.float64], sides: NDArray[np.float64]) -> NDArray[np.float64]:
    """How far the cell of a point reaches to each side, (K,). d: (N, 2), offsets of others over their squared
    length. sides: (K, 2), unit vectors."""
    return 0.5 / np.maximum((d @ sides.T).max(axis=0), 1e-30)


class Fitted(NamedTuple):
    """What is found of a point.

    axes: (4,), 0 where a disc does. middle: (3,), from the point to the splat's middle. planes: (up to 3, 4),
    unit normals of neighbours that end the splat, and how far from the point their planes cross the splat's.
    """

    axes: NDArray[np.float64]
    middle: NDArray[np.float64]
    planes: NDArray[np.float64]


def plain(positions: NDArray[np.float64], normals: NDArray[np.float64], row: int) -> Fitted:
    """The splat of a point, from the distances to all others."""
    d = np.delete(positions - positions[row], row, axis=0)
    others, n = np.delete(normals, row, axis=0), normals[row]
    u = np.cross((0.0, 1.0, 0.0), n)
    u /= np.linalg.norm(u)
    v, squares = np.cross(n, u), np.square(d).sum(axis=1)
    reach = reaches(np.stack([d @ u, d @ v], axis=1) / squares[:, None], directions(8))
    opposite = np.roll(reach, 4)
    in_rows = np.maximum(reach, opposite) <= 1.5 * np.minimum(reach, opposite)
    reach = np.minimum(reach, np.where(in_rows, 4.0, 2.0) * np.sort(reach)[4])
    radius = 1.2 * reach.max()
    rough = ellipse_round(reach[:, None] * directions(8), 0)
    lengths = np.array([rough.lengths[0], max(rough.lengths[1], rough.lengths[0] / 16)])
    along, across = (np.cos(a) * u + np.sin(a) * v for a in (rough.turn, rough.turn + np.pi / 2))
    reach = reaches(np.stack([d @ along, d @ across], axis=1) * lengths / squares[:, None], directions(16))
    sides, near = lengths * directions(16), np.sqrt(squares) <= 2.5 * radius
    spread = np.maximum((np.stack([d @ along, d @ across], axis=1)[near] @ sides.T).max(axis=0), 0.0)
    width = np.linalg.norm(sides, axis=1)
    reach = np.minimum(1.25 * np.where(reach > 1.5, 1.2, reach), spread / width**2 + 0.3 * radius / width)
    found = ellipse_round(reach[:, None] * sides, 4)
    farthest = np.linalg.norm(found.middle) + found.lengths[0]
    is_round = found.lengths.prod() > 0.75 * radius**2 and farthest < 1.2 * radius
    first = np.cos(found.turn) * along + np.sin(found.turn) * across
    middle = found.middle[0] * along + found.middle[1] * across
    axes = np.append(found.lengths[0] * first, found.lengths[1])

    to = np.stack([d @ along, d @ across], axis=1)
    upper = np.where(to[:, 1] < 0, -to[:, 0], to[:, 0]) / np.linalg.norm(to, axis=1)
    sector = np.where(upper > 0.5, 0, np.where(upper > -0.5, 1, 2)) + 3 * (to[:, 1] < 0)
    distance, below = np.sqrt(squares), -(d @ n)
    rise = below * (2 * radius / distance - 1)
    rise = np.where((distance <= 2.5 * radius) & (below > 0.06 * distance), rise, 0.0)
    cuts = []
    for k in range(6):
        best = int(np.argmax(np.where(sector == k, rise, -1.0)))
        normal, height = others[best], float(d[best] @ others[best])
        parts = np.array([normal @ along, normal @ across])
        slope = np.linalg.norm(parts)
        if sector[best] != k or rise[best] <= 0 or height < 0 or slope < 1e-3:
            continue
        reach_to = turned(rough.middle, rough.turn) @ parts / slope + 1.25 * np.linalg.norm(
            lengths * parts / slope
        )
        room = height + 0.13 * radius
        if slope * reach_to - room > 0.05 * radius:
            cuts.append((slope * reach_to - room, *normal, room / slope))
    planes = np.array(sorted(cuts, reverse=True)[:3]).reshape(-1, 5)[:, 1:]
    return Fitted(np.zeros(4) if is_round else axes, np.zeros(3) if is_round else middle, planes)


def unpacked(axes: NDArray[np.float32], cell: NDArray[np.float32], normal: NDArray, radius: float) -> Fitted:
    """What the GPU stores of a point (shaders/surfels/cell.glsl)."""
    longer = float(np.linalg.norm(axes[:3])) or radius
    first = axes[:3] / longer if axes.any() else np.cross((0.0, 1.0, 0.0), normal)
    first = first / np.linalg.norm(first)
    second, code = np.cross(normal, first), int(cell[0])
    offset = (np.array([code & 4095, code >> 12]) - 2048) / 2047 if code else np.zeros(2)
    planes = []
    for code in cell[1:].astype(int):
        if code:
            turn, tilt = (code & 255) * 2 * np.pi / 256, (code >> 8 & 127) * np.pi / 127
            to = np.cos(turn) * first + np.sin(turn) * second
            planes.append([*(np.cos(tilt) * normal + np.sin(tilt) * to), (code >> 15) * 2 * longer / 511])
    middle = offset[0] * longer * first + offset[1] * axes[3] * second
    return Fitted(axes.astype(np.float64), middle, np.array(planes).reshape(-1, 4))


def found(renderer: Renderer, cloud: PointCloud) -> tuple[list[Fitted], NDArray[np.float32]]:
    """What the GPU finds of each row; and the radii of discs, (N,)."""
    assert cloud.normals is not None
    gaps = renderer.resident(Pose(0, 0.0, "fitted", cloud)).cached(GapRadii)
    assert gaps.find(renderer.resident(Pose(0, 0.0, "fitted", cloud)), wait=True)
    radii, axes, cells = (
        np.frombuffer(gaps.buffers[name].buffer.read(), np.float32).reshape(len(cloud), -1)
        for name in ("radii", "axes", "cells")
    )
    rows = range(len(cloud))
    return [unpacked(axes[i], cells[i], cloud.normals[i], float(radii[i, 0])) for i in rows], radii[:, 0]


def random_torus(count: int) -> PointCloud:
    arrays = on_torus(4 * count)
    rows = np.sort(np.random.default_rng(0).choice(4 * count, count, replace=False))
    return PointCloud.from_arrays(arrays["positions"][rows], normals=arrays["normals"][rows])


def test_they_are_those_that_are_plainly_computed(renderer: Renderer) -> None:
    """But for a few whose gaps are as large as a cell of the grid."""
    cloud = random_torus(600)
    assert cloud.normals is not None
    splats, radii = found(renderer, cloud)
    positions, normals = cloud.positions.astype(np.float64), cloud.normals.astype(np.float64)
    wrong = {"axes": 0, "middle": 0, "planes": 0}
    for row, splat in enumerate(splats):
        twin, scale = plain(positions, normals, row), radii[row]
        same = np.abs(np.abs(splat.axes) - np.abs(twin.axes)).max() < 0.02 * scale
        wrong["axes"] += not same
        wrong["middle"] += np.linalg.norm(splat.middle - twin.middle) > 0.02 * scale
        wrong["planes"] += len(splat.planes) != len(twin.planes) or bool(
            (np.abs(splat.planes - twin.planes) > [0.05, 0.05, 0.05, 0.05 * scale]).any()
        )
    assert sum(splat.axes.any() for splat in splats) > 200
    assert sum(len(splat.planes) > 0 for splat in splats) > 200
    assert max(wrong.values()) <= 0.04 * len(splats), wrong


def plain_limit(positions: NDArray[np.float64], normal: NDArray[np.float64], row: int) -> float:
    """How far the disc of a point may reach as points around it lie on no plane."""
    d = np.delete(positions - positions[row], row, axis=0)
    distance = np.linalg.norm(d, axis=1)
    third = np.sort(distance)[2]
    d = d[distance <= 2 * third]
    u = np.cross((0.0, 1.0, 0.0), normal)
    u /= np.linalg.norm(u)
    across = d @ np.stack([u, np.cross(normal, u)], axis=1) @ directions(8).T
    narrow = np.maximum(across, 0).max(axis=0)
    narrow = 0.5 * (narrow + np.roll(narrow, 4)).min()
    heights = np.append(d @ normal, 0)
    return float(max(0.85 * third, narrow * max(1.5 * narrow**2 / np.ptp(heights) ** 2, 1)))


def test_with_estimated_normals_discs_are_small_where_points_lie_on_no_plane(renderer: Renderer) -> None:
    along, turn = np.random.default_rng(7).random((2, 300))
    around = np.stack([np.cos(2 * np.pi * turn), np.sin(2 * np.pi * turn)], axis=1)
    width = 0.06 * np.sqrt(along)[:, None]
    pose = renderer.resident(
        Pose(0, 0.0, "needle", PointCloud.from_arrays(np.column_stack([width * around, along])))
    )
    normals = np.column_stack([around, np.zeros(300)])
    pose.add_estimates({"normals": normals.astype(np.float32)})
    gaps, radii = GapRadii(pose), []
    for fits in (False, True):
        assert gaps.find(pose, wait=True, fits=fits)
        radii.append(np.frombuffer(gaps.buffers["radii"].buffer.read(), np.float32))
    gaps.release()
    positions = pose.cloud.positions.astype(np.float64)
    limits = np.array([plain_limit(positions, normals[row], row) for row in range(300)])
    smaller = radii[1] < radii[0]
    assert 30 < np.count_nonzero(smaller) < 270
    other = ~np.isclose(radii[1], limits, rtol=1e-3)
    assert np.count_nonzero(smaller & other) <= 8  # whose gaps are as large as a cell of the grid
    assert np.count_nonzero(~smaller & (limits < 0.99 * radii[0])) < 15  # in rows


def test_order_and_copies_change_nothing(renderer: Renderer) -> None:
    cloud = random_torus(2000)
    gaps = [renderer.resident(Pose(0, 0.0, "a", cloud)).cached(GapRadii)]
    order = np.random.default_rng(1).permutation(len(cloud))
    moved = with_rows(cloud, order)
    gaps.append(renderer.resident(Pose(0, 0.0, "b", moved)).cached(GapRadii))
    for each, pose in zip(gaps, (Pose(0, 0.0, "a", cloud), Pose(0, 0.0, "b", moved)), strict=True):
        assert each.find(renderer.resident(pose), wait=True)
    for name in ("radii", "axes", "cells"):
        first, second = (
            np.frombuffer(each.buffers[name].buffer.read(), np.float32).reshape(len(cloud), -1)
            for each in gaps
        )
        np.testing.assert_array_equal(second, first[order])


def test_even_points_on_a_flat_surface_keep_discs(renderer: Renderer) -> None:
    x, y = (part.ravel() for part in np.meshgrid(np.arange(40.0), np.arange(40.0)))
    cloud = PointCloud.from_arrays(np.stack([x, y, 0 * x], axis=1), normals=np.tile([0.0, 0, 1], (1600, 1)))
    pose = renderer.resident(Pose(0, 0.0, "plane", cloud))
    gaps = pose.cached(GapRadii)
    assert gaps.find(pose, wait=True)
    assert list(gaps.buffers) == ["radii"]


def test_while_a_scan_moves_discs_do(renderer: Renderer) -> None:
    pose = renderer.resident(Pose(0, 0.0, "moving", random_torus(1000)))
    gaps = pose.cached(GapRadii)
    assert gaps.find(pose, wait=True, fits=False)
    assert list(gaps.buffers) == ["radii"]
    radii = gaps.buffers["radii"].buffer.read()
    assert gaps.find(pose, wait=True)
    assert set(gaps.buffers) == {"radii", "axes", "cells"}
    assert gaps.buffers["radii"].buffer.read() == radii
    assert gaps.find(pose, wait=True, fits=False)
    assert set(gaps.buffers) == {"radii", "axes", "cells"}


@pytest.mark.parametrize("passes", ["one", "two"])
def test_feeds_draw_the_same_bits(draw: Draw, passes: str) -> None:
    cloud, camera = random_torus(600), Camera((2.9, 3.4, 4.0))
    first, *others, by_geometry, tiles = (
        draw(cloud, camera, SIZE, "surfels", params={"passes": passes, "instancing": feed})
        for feed in ("tbo", "vbo", "pull", "ubo", "gs", "tiles")
    )
    for other in others:
        np.testing.assert_array_equal(other.id, first.id)
        np.testing.assert_array_equal(other.depth, first.depth)
        np.testing.assert_array_equal(other.image(), first.image())
    for other in (by_geometry, tiles):
        assert_agree(other, first, 0.005)


def random_sphere(count: int) -> PointCloud:
    places = np.random.default_rng(3).normal(size=(count, 3))
    places /= np.linalg.norm(places, axis=1, keepdims=True)
    return PointCloud.from_arrays(places, normals=places)


def with_discs(renderer: Renderer, cloud: PointCloud) -> PointCloud:
    """The cloud with the radii of discs that close it."""
    pose = renderer.resident(Pose(0, 0.0, "discs", cloud))
    gaps = pose.cached(GapRadii)
    assert gaps.find(pose, wait=True, fits=False)
    return replace(cloud, radii=np.frombuffer(gaps.buffers["radii"].buffer.read(), np.float32))


def test_they_spill_less_than_discs_and_close_as_well(renderer: Renderer, draw: Draw) -> None:
    cloud, camera = random_sphere(400), Camera((0.0, 0.0, 4.0))
    scale = SIZE[1] / 2 / math.tan(math.radians(camera.fov_y) / 2)
    outline = scale * math.tan(math.asin(1 / 4))
    x, y = (np.arange(length) + 0.5 - length / 2 for length in SIZE)
    off = np.hypot(x, y[:, None])
    fitted = draw(cloud, camera, SIZE, "surfels").coverage > 0
    discs = draw(with_discs(renderer, cloud), camera, SIZE, "surfels", params={"radius": "own"}).coverage > 0
    spill = [np.count_nonzero(drawn & (off > outline)) for drawn in (fitted, discs)]
    assert spill[0] < 0.8 * spill[1], spill
    assert np.count_nonzero(~fitted & (off < outline - 1)) < 0.01 * np.count_nonzero(off < outline)


def ridge() -> PointCloud:
    """Two faces, 200 points each: z = 0, which ends at y = 0, and y = 0 behind it."""
    across, along = (np.random.default_rng(5).random((400, 2)) * [2, 1] - [1, 0]).T
    front, zero = np.arange(400) < 200, np.zeros(400)
    places = np.stack([across, np.where(front, along, zero), np.where(front, zero, -along)], axis=1)
    return PointCloud.from_arrays(places, normals=np.where(front[:, None], [0.0, 0, 1], [0.0, -1, 0]))


def test_they_end_at_a_ridge(renderer: Renderer, draw: Draw) -> None:
    """The camera looks along z, and sees the second face from the side."""
    cloud, camera = ridge(), Camera((0.0, -0.4, 4.0), target=(0.0, -0.4, 0.0))
    pixel = 8 * math.tan(math.radians(camera.fov_y) / 2) / SIZE[1]
    x = (np.arange(SIZE[0]) + 0.5 - SIZE[0] / 2) * pixel
    y = (SIZE[1] / 2 - np.arange(SIZE[1])[:, None] - 0.5) * pixel - 0.4
    past = (y < 0) & (np.abs(x) < 0.9)
    fitted = draw(cloud, camera, SIZE, "surfels").id < 200
    discs = draw(with_discs(renderer, cloud), camera, SIZE, "surfels", params={"radius": "own"}).id < 200
    assert np.count_nonzero(fitted & past) < 0.2 * np.count_nonzero(discs & past)

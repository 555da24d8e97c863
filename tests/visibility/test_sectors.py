"""Sectors: their mappings, on the GPU as in numpy, and the precision of keys."""

from __future__ import annotations

from decimal import Decimal, getcontext
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from viewer.drawing.renderer import Renderer
from viewer.gpu import gl
from viewer.gpu.bindings import Storage
from viewer.scan.points import NOTHING
from viewer.visibility.candidates import Candidates
from viewer.visibility.sectors import Sectors

PROBE = str(Path(__file__).with_name("probe.comp"))
STEPS = [(x, y) for y in (-1, 0, 1) for x in (-1, 0, 1) if x or y]
ORIGIN = np.zeros(3)
FORWARD = np.array([0.48, -0.6, 0.64])
DISTANCES = {"inside": 0.3, "near": 1.5, "usual": 5.0, "far": 1e6, "parallel": np.inf}


def sectors_from(distance: float, edge: int, radius: float = 1.0) -> Sectors:
    """Sectors for a sphere about zero, from a distance in its radii."""
    if np.isinf(distance):
        return Sectors.along(ORIGIN, radius, FORWARD, ORIGIN, edge)
    return Sectors.around(ORIGIN, radius, -distance * radius * FORWARD, ORIGIN, edge)


def directions_of(sectors: Sectors) -> NDArray[np.float64]:
    """Unit vectors of all sectors, (k, 3), with forward first; offsets on the plane for parallel rays."""
    found = sectors.directions(np.arange(sectors.count, dtype=np.uint32))
    if sectors.mapping == "grid":
        found[:, 1:] *= sectors.tangent or 1.0
    return found / np.linalg.norm(found, axis=1)[:, None]


@pytest.mark.parametrize("distance", DISTANCES.values(), ids=DISTANCES)
@pytest.mark.parametrize("edge", [1, 2, 7, 32])
def test_the_gpu_divides_directions_as_numpy_does(renderer: Renderer, distance: float, edge: int) -> None:
    sectors = sectors_from(distance, edge)
    assert sectors.mapping == ("cube" if distance < np.sqrt(2) else "grid")
    gpu, every = renderer.gpu, np.arange(sectors.count, dtype=np.uint32)
    gpu.activate()
    told = gpu.ctx.buffer(reserve=48 * sectors.count)
    told.bind_to_storage_buffer(Storage.WORDS)
    program = gpu.compute(PROBE, {"CUBE": int(sectors.mapping == "cube")}, params=sectors)
    gpu.dispatch(program, sectors.count)
    words = np.frombuffer(told.read(), np.uint32).reshape(-1, 12)
    np.testing.assert_allclose(words[:, :3].view(np.float32), sectors.directions(every), atol=3e-7)
    np.testing.assert_array_equal(words[:, 3], every)
    for step, found in zip(STEPS, words[:, 4:].T, strict=True):
        np.testing.assert_array_equal(found, sectors.neighbors(every, step), str(step))


@pytest.mark.parametrize("edge", [1, 2, 9])
def test_neighbors_across_the_edges_of_a_cube_lie_beside(edge: int) -> None:
    sectors = sectors_from(0.0, edge)
    directions, every = directions_of(sectors), np.arange(sectors.count, dtype=np.uint32)
    found = np.stack([sectors.neighbors(every, step) for step in STEPS])
    lacking = (found == NOTHING).sum(axis=0)
    # The three sectors around each corner of the cube lack the one across; with one a face, all do.
    assert lacking.sum() == 24
    for column, near in zip(every, found.T, strict=True):
        assert len(set(near[near != NOTHING])) == 8 - lacking[column]
        for other in near[near != NOTHING]:
            assert column in found[:, other], "it is a neighbour of its neighbours"
            angle = np.arccos(np.clip(directions[column] @ directions[other], -1, 1))
            assert angle < 1.6 * np.pi / 2 / edge


def test_neighbors_turn_the_same_way_on_every_face() -> None:
    """Seen from the eye, right x down is forward."""
    sectors = sectors_from(0.0, 8)
    directions, every = directions_of(sectors), np.arange(sectors.count, dtype=np.uint32)
    right, down = (sectors.neighbors(every, step) for step in ((1, 0), (0, 1)))
    inside = np.flatnonzero((right // 64 == every // 64) & (down // 64 == every // 64))
    ahead = directions[inside]
    turned = np.cross(directions[right[inside]] - ahead, directions[down[inside]] - ahead)
    assert len(inside) == 6 * 49
    assert (np.einsum("ij,ij->i", turned, ahead) > 0).all()


def solid_angles(sectors: Sectors) -> NDArray[np.float64]:
    """Of random directions, how many are in each sector, (k,)."""
    points = np.random.default_rng(3).normal(size=(200_000, 3))
    found = sectors.sector_of(sectors.sector_positions(points))
    return np.bincount(found, minlength=sectors.count).astype(np.float64)


def test_sectors_of_a_cube_are_nearly_alike() -> None:
    """The largest is less than 1.5 times the smallest; of a plain cube or an octahedron it is 5.2 times."""
    counts = solid_angles(sectors_from(0.0, 4))
    assert counts.max() / counts.min() < 1.5


@pytest.mark.parametrize("distance", [1.42, 2.0, 30.0])
def test_the_grid_covers_the_sphere_and_little_more(distance: float) -> None:
    sectors = sectors_from(distance, 64)
    points = np.random.default_rng(0).normal(size=(20_000, 3))
    points /= np.linalg.norm(points, axis=1)[:, None] * (1 + 1e-6)
    found = sectors.sector_of(sectors.sector_positions(points))
    assert (found != NOTHING).all()
    column, line = found % 64, found // 64
    assert {column.min(), column.max(), line.min(), line.max()} == {0, 63}


def number_of(key: NDArray[np.uint32]) -> NDArray[np.float32]:
    """The numbers that words in their order stand for."""
    bits = np.where(key >> 30 & 1, key << 1 & 0x7FFFFFFF, ~(key << 1))
    return bits.astype(np.uint32).view(np.float32)


def exact_keys(
    points: NDArray[np.float64], directions: NDArray[np.float64], eye: NDArray[np.float64], radius: float
) -> list[Decimal]:
    """Projections of flipped points on directions, with 60 digits; less is better."""
    getcontext().prec = 60
    keys = []
    for point, direction in zip(points, directions, strict=True):
        away = [Decimal(float(p)) - Decimal(float(e)) for p, e in zip(point, eye, strict=True)]
        far = sum(a * a for a in away).sqrt()  # type: ignore[union-attr]
        along = [Decimal(float(d)) for d in direction]
        length = sum(d * d for d in along).sqrt()  # type: ignore[union-attr]
        cosine = sum(a * d for a, d in zip(away, along, strict=True)) / (far * length)
        keys.append(-(2 * Decimal(radius) - far) * cosine)
    return keys


@pytest.mark.parametrize("distance", [0.3, 1.5, 5.0, 1e3, 1e6])
@pytest.mark.parametrize("radius", [1e2, 1e4, 1e8])
@pytest.mark.parametrize("scale", [1e-12, 1.0, 1e12])
def test_keys_keep_the_order_of_projections(
    renderer: Renderer, distance: float, radius: float, scale: float
) -> None:
    """On the GPU, of points of one sector: what they differ by is right to 1e-5 of a sphere's radius, and to
    1e-5 of how far they lie beside the direction. radius: in distances of the farthest point."""
    edge = 16
    points = np.random.default_rng(0).uniform(-0.57 * scale, 0.57 * scale, (300, 3)).astype(np.float32)
    eye = -distance * scale * FORWARD
    flip = radius * (distance + 1) * scale
    sectors = sectors_from(distance, edge, scale).flipped(flip)
    gpu = renderer.gpu
    gpu.activate()
    positions = gl.BufferTexture(gpu.ctx.buffer(points), gl.RGB32F)
    candidates = Candidates(gpu, sectors, len(points))
    candidates.find(positions, sectors, 0)
    home, key = np.frombuffer(candidates.homes.buffer.read(), np.uint32).reshape(-1, 2).T
    at_sectors = np.frombuffer(candidates.sector_positions.buffer.read(), np.float32).reshape(-1, 3)
    kept = np.flatnonzero(home != NOTHING)
    assert len(kept) == len(points)
    twin = sectors.sector_positions(points)
    near = np.abs(twin[:, 2]) > 0.05 if sectors.mapping == "grid" else np.ones(len(points), bool)
    np.testing.assert_allclose(at_sectors[near], twin[near], rtol=2e-5, atol=1e-6)
    agree = sectors.sector_of(twin) == home
    assert agree.mean() > 0.99
    np.testing.assert_allclose(
        number_of(key), sectors.keys(twin, home), rtol=1e-5, atol=1e-4 * sectors.weight / edge**2 + 3e-6
    )
    # As numpy has keys, against 60 digits: of pairs in one direction, the one of a point's own sector.
    directions = sectors.directions(home)
    if sectors.mapping == "grid":
        axes = np.array(sectors.to_sectors)[:3, :3].T * sectors.unit  # rows: forward, right, down
        world = directions * np.array([1, sectors.tangent, sectors.tangent]) @ axes
    else:
        world = directions
    other = np.roll(np.arange(len(points)), 1)
    mine, theirs = exact_keys(points, world, eye, flip), exact_keys(points[other], world, eye, flip)
    exact = np.array([float((a - b) / Decimal(scale)) for a, b in zip(mine, theirs, strict=True)])
    found = sectors.keys(twin, home) - sectors.keys(twin[other], home)
    np.testing.assert_allclose(found, exact, rtol=1e-4, atol=1e-6 * max(1.0, sectors.weight))
    candidates.release()
    positions.release()

"""Candidates and their propagation, against numpy over all points and all sectors."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from viewer.drawing.renderer import Renderer
from viewer.errors import InputError
from viewer.gpu import gl
from viewer.gpu.context import Gpu
from viewer.scan.points import NOTHING
from viewer.visibility.candidates import UNLIMITED, Candidates, RowSample
from viewer.visibility.clipping import EVERYWHERE
from viewer.visibility.sectors import Sectors

STEPS = [(x, y) for y in (-1, 0, 1) for x in (-1, 0, 1) if x or y]
ZERO = np.zeros(3)
Find = Callable[..., Candidates]


def points_in_ball(count: int) -> NDArray[np.float32]:
    points = np.random.default_rng(1).normal(size=(count, 3))
    return (points / np.linalg.norm(points, axis=1)[:, None] * (1 - 1e-5)).astype(np.float32)


def texels(gpu: Gpu, values: NDArray, texel_format: int) -> gl.BufferTexture:
    gpu.activate()
    return gl.BufferTexture(gpu.ctx.buffer(np.ascontiguousarray(values)), texel_format)


@pytest.fixture
def find(renderer: Renderer) -> Find:
    """find(points, sectors, steps, ...): their candidates."""

    def find(points: NDArray[np.float32], sectors: Sectors, steps: int, **how: Any) -> Candidates:
        renderer.gpu.activate()
        candidates = Candidates(renderer.gpu, sectors, len(points))
        candidates.find(texels(renderer.gpu, points, gl.RGB32F), sectors, steps, **how)
        return candidates

    return find


def rows_of(candidates: Candidates) -> NDArray[np.uint32]:
    return np.frombuffer(candidates.rows.buffer.read(), np.uint32, candidates.sectors.count)


def propagated(
    sectors: Sectors, points: NDArray[np.float32], steps: int, cells: int
) -> tuple[NDArray[np.uint32], NDArray[np.bool_]]:
    """Rows of all sectors after so many steps in which all of them look at all neighbours, and which sectors
    lie in cells of so many along an edge that a point falls into: the others get nothing."""
    every = np.arange(sectors.count, dtype=np.uint32)
    at_sectors = sectors.sector_positions(points)
    home = sectors.sector_of(at_sectors)

    def cell_of(sector: NDArray[np.uint32]) -> NDArray[np.int64]:
        edge = sectors.edge
        column, line, face = sector % edge, sector // edge % edge, sector // edge**2
        return (face.astype(np.int64) * edge + line // cells) * edge + column // cells

    inside = np.isin(cell_of(every), cell_of(home))
    rows, keys = np.full(sectors.count, NOTHING, np.uint32), np.full(sectors.count, np.inf)
    own = sectors.keys(at_sectors, home)
    for row in np.lexsort((np.arange(len(points)), own))[::-1]:
        rows[home[row]], keys[home[row]] = row, own[row]
    for _ in range(steps):
        before = rows.copy()
        for step in STEPS:
            near = sectors.neighbors(every, step)
            looking = np.flatnonzero(inside & (near != NOTHING))
            other = before[near[looking]]
            looking, other = looking[other != NOTHING], other[other != NOTHING]
            found = sectors.keys(at_sectors[other], every[looking])
            better = (found < keys[looking]) | ((found == keys[looking]) & (other < rows[looking]))
            rows[looking[better]], keys[looking[better]] = other[better], found[better]
    return rows, inside


@pytest.mark.parametrize("distance", [0.2, 3.0])
@pytest.mark.parametrize("steps", [0, 1, 3, 40])
def test_propagation_is_that_of_all_sectors_at_once(find: Find, distance: float, steps: int) -> None:
    """Though only sectors whose neighbours changed look again."""
    edge, points = (8 if distance < 1 else 20), points_in_ball(120)
    sectors = Sectors.around(ZERO, 1.0, np.array([0.0, 0.0, distance]), ZERO, edge).weighted(3.0)
    found = rows_of(find(points, sectors, steps))
    halvings = int(np.ceil(np.log2(sectors.count / 30) / 2))
    expected, inside = propagated(sectors, points, steps, 2**halvings)
    assert inside.any()
    differing = found != expected
    at_sectors, every = sectors.sector_positions(points), np.arange(sectors.count, dtype=np.uint32)
    assert (found[~inside] == NOTHING).all()
    assert differing.mean() < 0.01
    at = np.flatnonzero(differing & (found != NOTHING) & (expected != NOTHING))  # as good as equal
    np.testing.assert_allclose(
        sectors.keys(at_sectors[found[at]], every[at]),
        sectors.keys(at_sectors[expected[at]], every[at]),
        atol=1e-5,
    )


@pytest.mark.parametrize("weight", [2.0, 20.0])
@pytest.mark.slow
def test_until_nothing_changes_each_sector_has_the_best_of_all_points(find: Find, weight: float) -> None:
    """Where none shares its sector with one that reaches farther there: such a point is no candidate."""
    points = points_in_ball(400)
    sectors = Sectors.around(ZERO, 1.0, np.array([0.0, 0.0, 3.0]), ZERO, 96).weighted(weight)
    candidates = find(points, sectors, UNLIMITED)
    rows, at_sectors = rows_of(candidates), sectors.sector_positions(points)
    filled = np.flatnonzero(rows != NOTHING).astype(np.uint32)
    best = np.min(
        [sectors.keys(at_sectors[[row] * len(filled)], filled) for row in range(len(points))], axis=0
    )
    found = sectors.keys(at_sectors[rows[filled]], filled)
    assert len(filled) > 8000
    assert (found - best).max() < 1e-5


def test_ties_go_to_the_lowest_row(find: Find) -> None:
    """Copies of each point, of which the first ones are the candidates, and alone visible."""
    points = points_in_ball(50)
    sectors = Sectors.around(ZERO, 1.0, np.array([0.0, 0.0, 3.0]), ZERO, 30).weighted(3.0)
    candidates = find(np.concatenate([points, points, points]), sectors, 2)
    rows = rows_of(candidates)
    assert (rows[rows != NOTHING] < 50).all()
    once = find(points, sectors, 2).visible_rows()
    np.testing.assert_array_equal(candidates.visible_rows(), once)


def test_some_rows_alone_may_take_part(find: Find, renderer: Renderer) -> None:
    """By flags, or by a list, as if the others were not there."""
    points = points_in_ball(300)
    sectors = Sectors.around(ZERO, 1.0, np.array([0.0, 0.0, 3.0]), ZERO, 16).weighted(3.0)
    chosen = np.arange(0, 300, 3, dtype=np.uint32)
    alone = find(points[chosen], sectors, 2)
    flags = np.isin(np.arange(300), chosen).astype(np.uint32)
    flagged = find(points, sectors, 2, among=texels(renderer.gpu, flags, gl.R32UI))
    listed = find(points, sectors, 2, sample=RowSample(texels(renderer.gpu, chosen, gl.R32UI), len(chosen)))
    for some in (flagged, listed):
        rows = rows_of(some)
        expected = np.where(rows_of(alone) == NOTHING, NOTHING, chosen[rows_of(alone) % 100])
        np.testing.assert_array_equal(rows[rows != NOTHING] % 3, 0)
        both = (rows != NOTHING) & (expected != NOTHING)  # which are empty goes by the number of all points
        assert both.sum() > 100
        assert (rows == expected)[both].mean() > 0.97
    assert len(np.setxor1d(listed.visible_rows(), chosen[alone.visible_rows()])) <= 3


def test_points_before_a_plane_are_left_out(find: Find) -> None:
    points = points_in_ball(300)
    sectors = Sectors.around(ZERO, 1.0, np.array([0.0, 0.0, 3.0]), ZERO, 16).weighted(3.0)
    rows = find(points, sectors, 2, clip=((0.0, 0.0, -1.0, 0.5), *EVERYWHERE[1:])).visible_rows()
    assert len(rows)
    assert (points[rows, 2] <= 0.5).all()


def test_memory_is_what_it_says(find: Find) -> None:
    """28 bytes a sector, 4 a cell of empty ones, 28 a point."""
    sectors = Sectors.around(ZERO, 1.0, np.array([0.0, 0.0, 3.0]), ZERO, 64)
    held = find(points_in_ball(1000), sectors, 1).nbytes
    assert held == pytest.approx((32 * sectors.count + 28 * 1000), rel=0.01)


def test_more_sectors_than_the_driver_takes_are_refused(renderer: Renderer) -> None:
    edge = int(np.sqrt(renderer.gpu.max_storage_bytes / 4)) + 1
    sectors = Sectors.around(ZERO, 1.0, np.array([0.0, 0.0, 3.0]), ZERO, edge)
    with pytest.raises(InputError, match="more than this graphics driver can handle"):
        Candidates(renderer.gpu, sectors, 10)

"""Contenders of pyramidal projection: pull and push, and deferred blending."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest
from experiments.farooq_2013 import contenders
from experiments.farooq_2013.deferred_blending import blended, groups_of
from experiments.farooq_2013.pull_push import Floats, Reconstruction, differences, reconstructed

from viewer.bench.run import Bench, BenchSettings
from viewer.view import View

if TYPE_CHECKING:
    from viewer.drawing.renderer import Renderer

SIZE = (48, 40)
FRONT, BACK = 1.0, 8.0  # depths of planes, farther apart than discs are wide
COLOR, BEHIND = (0.75, 0.5, 0.25), (0.125, 0.25, 1.0)
APART = 4  # pixels from sample to sample
INSIDE = np.s_[4:-4, 4:-4]


def a_view(perspective: bool = False) -> View:
    """Along -z: a pixel is a unit, at a depth of 1 where rays are not parallel."""
    return View(
        size=SIZE, origin=np.zeros(3), rotation=np.eye(3), translation=np.zeros(3), scale=1.0, near=0.1,
        far=20.0, reach=20.0, perspective=perspective,
    )  # fmt: skip


def a_plane(
    depth: float, color: tuple[float, float, float], radius: float = APART, apart: int = APART
) -> Floats:
    """Discs that face the eye, over the picture and beyond."""
    x, y = np.meshgrid(np.arange(-28, 28, apart) + 0.25, np.arange(-24, 24, apart) + 0.25)
    rows = [x.ravel(), y.ravel(), np.full(x.size, -depth)]
    rest = np.broadcast_to((0, 0, 1, *color, radius), (x.size, 7))
    return np.column_stack([*rows, rest]).astype(np.float32, order="C")


def test_a_plane_is_reproduced() -> None:
    cells = reconstructed(a_plane(FRONT, COLOR), a_view())[INSIDE]
    assert np.isfinite(cells[..., 0]).all()
    assert cells[..., 11] == pytest.approx(FRONT, rel=1e-6)
    assert cells[..., 5:8] == pytest.approx(np.broadcast_to((0, 0, 1), cells[..., 5:8].shape), abs=1e-6)
    assert cells[..., 8:11] == pytest.approx(np.broadcast_to(COLOR, cells[..., 8:11].shape), rel=1e-6)


def test_gaps_between_discs_that_do_not_meet_stay() -> None:
    shown = np.isfinite(reconstructed(a_plane(FRONT, COLOR, radius=1.0), a_view())[INSIDE][..., 0])
    assert 0 < shown.mean() < 0.5


def test_a_tilted_disc_is_an_ellipse() -> None:
    disc = a_plane(FRONT, COLOR, radius=8.0)[:1]
    disc[0, :6] = (0, 0, -FRONT, np.sqrt(0.75), 0, 0.5)
    shown = np.isfinite(reconstructed(disc, a_view())[..., 0])
    rows, columns = np.nonzero(shown)
    assert np.ptp(rows) > 1.5 * np.ptp(columns) > 0


def test_what_shines_through_a_surface_is_covered() -> None:
    both = np.concatenate([a_plane(FRONT, COLOR), a_plane(BACK, BEHIND, apart=1)])
    cells = reconstructed(both, a_view())[INSIDE]
    assert cells[..., 11] == pytest.approx(FRONT, rel=1e-6)
    assert cells[..., 8:11] == pytest.approx(np.broadcast_to(COLOR, cells[..., 8:11].shape), rel=1e-6)


@pytest.mark.parametrize("perspective", [False, True])
def test_gpu_and_cpu_give_the_same_cells(renderer: Renderer, perspective: bool) -> None:
    rng = np.random.default_rng(3)
    points = np.concatenate([a_plane(FRONT, COLOR), a_plane(BACK, BEHIND)])
    points[:, :3] += rng.normal(0, 0.3, (len(points), 3))
    points[:, 3:6] += rng.normal(0, 0.3, (len(points), 3))
    drawn = Reconstruction(renderer.gpu, points.astype(np.float32), SIZE)
    drawn.draw(a_view(perspective))
    found = differences(drawn.read(), reconstructed(points.astype(np.float32), a_view(perspective)))
    drawn.release()
    assert found["covered"] == 0
    assert max(found["depth"], found["color"], found["normal"]) < 1e-5


def test_discs_of_a_group_do_not_overlap() -> None:
    points = np.concatenate([a_plane(FRONT, COLOR), a_plane(FRONT, COLOR, radius=7.0, apart=11)])
    groups = groups_of(points)
    positions, radii = points[:, :3].astype(np.float64), points[:, 9]
    apart = np.linalg.norm(positions[:, None] - positions, axis=2)
    meet = (apart < radii[:, None] + radii) & (groups[:, None] == groups)
    assert np.array_equal(meet, np.eye(len(points), dtype=bool))


def test_deferred_blending_reproduces_planes_and_hides_what_is_behind() -> None:
    tilted = a_plane(FRONT, COLOR)
    tilted[:, 2] -= 0.5 * tilted[:, 0] + 20
    tilted[:, 3:6] = np.array([0.5, 0, 1]) / np.sqrt(1.25)
    points = np.concatenate([tilted, a_plane(60.0, BEHIND)])
    view = replace(a_view(), far=100.0, reach=100.0)
    cells = blended(points, groups_of(points), view)[INSIDE]
    x = np.arange(SIZE[0])[INSIDE[1]] + 0.5 - SIZE[0] / 2
    assert cells[..., 11] == pytest.approx(np.broadcast_to(FRONT + 20 + 0.5 * x, cells.shape[:2]), rel=1e-5)
    assert cells[..., 8:11] == pytest.approx(np.broadcast_to(COLOR, cells[..., 8:11].shape), rel=1e-5)


def test_differences_are_found() -> None:
    cells = reconstructed(a_plane(FRONT, COLOR), a_view())
    other = cells.copy()
    other[20, 20, 11] *= 1.5
    other[20, 21, 0] = np.inf
    found = differences(cells, other)
    pixel = 100 / (SIZE[0] * SIZE[1])
    assert found["pixels"] == pytest.approx(2 * pixel)
    assert found["covered"] == pytest.approx(pixel)
    assert found["depth"] == pytest.approx(1 / 3)


@pytest.mark.slow
def test_all_contenders_draw_a_pair_of_views(renderer: Renderer) -> None:
    bench = Bench(renderer, BenchSettings(size=(96, 72), views=1, repeat=1, frames=0))
    (like, *_) = contenders.groups()
    rows = bench.measure(replace(like, scene="torus-pair"))
    assert not bench.notes
    found = {row["backend"]: row["errors"] for row in rows}
    assert len(rows) == len(like.contenders)
    assert found["pull-push"] == pytest.approx(found["pull-push on the CPU"], rel=1e-3, nan_ok=True)
    for name in ("pull-push", "deferred-blending"):
        assert found[name]["hole_scanned_percent"] < 5
        assert found[name]["psnr_scanned"] > 25


@pytest.mark.slow
def test_times_and_differences_of_both_are_found(renderer: Renderer) -> None:
    bench = Bench(renderer, BenchSettings(size=(96, 72), views=1, repeat=1, frames=0))
    rows = list(contenders.measure_twins(bench))
    assert [row["zoom"] for row in rows] == list(contenders.ZOOMS)
    for row in rows:
        assert min(*row["busy_ms"].values(), *row["wall_ms"].values()) > 0
        assert row["pixels"] < 1

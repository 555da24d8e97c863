"""Scans as they are: uneven, noisy, with strays, with wrong normals; of each is known what was done."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from viewer.bench.scenes import catalog, samples
from viewer.bench.scenes.defects import by_turns, noisy, thinned, with_strays
from viewer.bench.truth.shapes import AnalyticScene, Cuboid
from viewer.mesh.triangles import Mesh
from viewer.scan.spacing import typical_spacing

BODY = samples.cloud(samples.on_torus, 20_000)


def test_a_ramp_leaves_ten_times_as_many_at_one_end_as_at_the_other() -> None:
    square = samples.cloud(samples.on_square, 50_000)
    kept = thinned(square, np.random.default_rng(0))
    counts, _ = np.histogram(kept.positions[:, 0], 10, (-1, 1))
    assert counts[0] / counts[-1] == pytest.approx(10**0.9, rel=0.15)  # the middles of the ends
    assert np.diff(np.log(counts)) == pytest.approx(np.full(9, -0.1 * np.log(10)), abs=0.12)
    assert kept.radii is None
    assert kept.normals is not None


@pytest.mark.parametrize("spacings", [0.2, 0.5])
def test_noise_is_along_the_normals_in_spacings(spacings: float) -> None:
    moved = noisy(spacings)(BODY, np.random.default_rng(0))
    offset = (moved.positions - BODY.positions).astype(np.float64)
    assert np.std((offset * BODY.normals).sum(axis=1)) == pytest.approx(
        spacings * typical_spacing(BODY), rel=0.03
    )
    assert np.linalg.norm(np.cross(offset, BODY.normals), axis=1).max() < 1e-6


def test_strays_are_far_off_and_the_body_stays() -> None:
    spoilt = with_strays(BODY, np.random.default_rng(0))
    assert np.array_equal(spoilt.positions[:-3], BODY.positions)
    away = np.linalg.norm(spoilt.world()[-3:], axis=1)
    assert away == pytest.approx([2.8e3, 2.8e6, 9999 * 3**0.5], rel=1e-3)
    assert len(spoilt.normals) == len(spoilt.radii) == len(spoilt)


def test_normals_of_merged_scans_are_right_turned_and_missing_by_turns() -> None:
    up = np.tile(np.float32([0, 0, 1]), (2, 1))
    assert by_turns([up, up, up, up])[:, 2].tolist() == [1, 1, -1, -1, 0, 0, 1, 1]


@pytest.mark.parametrize("suffix", ["bare", "ramp", "ramp-bare", "noise-0.2", "noise-0.5", "strays-bare"])
def test_scenes_of_a_mesh_keep_its_truth(data_dir: Path, suffix: str) -> None:
    subject, sound = (catalog.subject(name, data_dir) for name in (f"bunny-{suffix}", "bunny"))
    moment = subject.moment(0)
    assert isinstance(moment.truth, Mesh)
    assert np.array_equal(moment.truth.points.positions, sound.moment(0).mesh.points.positions)
    assert (moment.pose.cloud.normals is None) == (suffix != "ramp")
    assert moment.pose.cloud.radii is None
    spacing = typical_spacing(sound.moment(0).pose.cloud)
    noise = float(suffix.removeprefix("noise-")) if suffix.startswith("noise") else 0
    assert subject.tolerance == (pytest.approx(4 * noise * spacing, rel=1e-6) if noise else None)
    assert subject.hash != sound.hash


def test_another_seed_leaves_other_points(data_dir: Path) -> None:
    one, same, other = (catalog.subject("bunny-ramp", data_dir, seed=seed).hash for seed in (1, 1, 2))
    assert one == same != other


def test_points_of_thin_parts_lie_on_the_truth_and_none_inside() -> None:
    moment = catalog.subject("sheets", None).moment(0)
    truth, world = moment.truth, moment.pose.cloud.world()
    assert isinstance(truth, AnalyticScene)
    on_any = np.zeros(len(world), bool)
    for shape in truth.shapes:
        local = world - shape.center
        if isinstance(shape, Cuboid):
            off = np.abs(local) - shape.half
            inside, on = (off < -1e-3).all(axis=1), np.abs(off.max(axis=1)) < 1e-3
        else:
            distance = np.linalg.norm(local, axis=1)
            inside, on = distance < 1 - 1e-3, np.abs(distance - 1) < 1e-3
        assert not inside.any()
        on_any |= on
    assert on_any.all()


@pytest.mark.slow
def test_merged_scans_have_a_normal_for_each_point(data_dir: Path) -> None:
    merged, scans = (
        catalog.subject(name, data_dir).moment(0).pose for name in ("bunny-scans-merged", "bunny-scans")
    )
    assert np.array_equal(merged.cloud.positions, scans.cloud.positions)
    lengths = np.linalg.norm(merged.cloud.normals, axis=1)
    ends = np.cumsum([len(view.positions()) for view in scans.views])
    missing = np.zeros(len(lengths), bool)
    for number, (first, last) in enumerate(zip([0, *ends[:-1]], ends, strict=True)):
        missing[first:last] = number % 3 == 2
    assert np.array_equal(lengths < 0.5, missing)

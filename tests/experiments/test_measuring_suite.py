"""What ± says of measured distances, against what is truly there; and the table of it."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from experiments.landmarks.measuring import (
    DRAWN,
    EXPERIMENT,
    SCENES,
    ZOOMS,
    Distances,
    measured_in,
    zoomed,
)
from scenes import rarely, sphere, sphere_mesh

from viewer.analysis.pick import before_gap, pick
from viewer.bench.report.results import write_row
from viewer.bench.scenes import catalog
from viewer.bench.scenes.subjects import Moment, Subject
from viewer.bench.truth.shapes import AnalyticScene, Sphere
from viewer.drawing.renderer import Renderer
from viewer.mesh.reference import first_hits, trace
from viewer.picture.surface import Surface
from viewer.scan.pose import Pose

SIZE = (400, 300)
COUNT = 300_000
VIEWS, PAIRS = 4, 400


@cache
def scanned(scene: str, data: Path) -> tuple[Subject, Moment]:
    subject = catalog.subject(scene, data, count=COUNT)
    return subject, subject.moment(0)


@pytest.mark.slow
@pytest.mark.parametrize(("scene", "name"), [*product(SCENES, DRAWN)])
def test_the_true_distance_is_within_what_is_said_in_95_percent(
    renderer: Renderer, data_dir: Path, scene: str, name: str
) -> None:
    subject, moment = scanned(scene, data_dir)
    parts = [
        measured_in(
            renderer,
            moment,
            zoomed(moment.truth, zoom, VIEWS, SIZE, subject.up),
            SIZE,
            name,
            DRAWN[name],
            pairs=PAIRS,
        )
        for zoom in ZOOMS
    ]
    off, uncertainty = (
        np.concatenate([getattr(part, name) for part in parts]) for name in ("off", "uncertainty")
    )
    found = Distances(off, uncertainty, parts[0].pitch)
    assert np.isnan(found.uncertainty).mean() < 0.01
    assert 93 <= found.covered <= 98, [part.covered for part in parts]


@pytest.mark.slow
@pytest.mark.parametrize("zoom", [1.0, 4.0])
@pytest.mark.parametrize("scene", ["bunny", "armadillo", "dragon-100k"])
def test_picks_of_voxels_are_on_the_surface(
    draw: Callable[..., Surface], data_dir: Path, scene: str, zoom: float
) -> None:
    subject, moment = scanned(scene, data_dir)
    off = []
    for camera in zoomed(moment.truth, zoom, 2, SIZE, subject.up):
        surface = draw(moment.pose.cloud, camera, SIZE, "voxels")
        rows, columns = np.nonzero(surface.level == 0)
        chosen = np.random.default_rng(1).integers(len(rows), size=100)
        pixels = np.stack([columns[chosen], rows[chosen]], axis=1)
        for (x, y), there in zip(
            pixels.tolist(), first_hits(moment.truth, camera, SIZE, pixels + 0.5), strict=True
        ):
            picked = pick(surface, x, y, shown=before_gap(surface, x, y))
            assert picked is not None
            off.append(float(np.linalg.norm(picked.position - there)))
    assert np.nanmedian(off) < 0.1 * moment.pose.spacing


@pytest.mark.parametrize("name", [next(iter(DRAWN)), *rarely(*list(DRAWN)[1:])])
def test_of_a_sphere_it_is_held(renderer: Renderer, name: str) -> None:
    cloud, truth = sphere(20_000), AnalyticScene((Sphere(),))
    seen = Moment(Pose(0, 0.0, "", cloud), truth, sphere_mesh())
    cameras = zoomed(truth, 2.0, 2, (160, 120))
    found = measured_in(renderer, seen, cameras, (160, 120), name, DRAWN[name], pairs=100)
    assert 90 <= found.covered <= 100
    assert np.nanmedian(found.uncertainty) < 2 * np.sqrt(4 * np.pi / 20_000)


def test_hits_at_the_middles_of_pixels_are_those_of_the_reference() -> None:
    truth = AnalyticScene((Sphere(),))
    (camera,) = zoomed(truth, 1.0, 1, (40, 30))
    reference = trace(truth, camera, (40, 30))
    row, column = np.indices((30, 40))
    hits = first_hits(truth, camera, (40, 30), np.stack([column.ravel(), row.ravel()], axis=1) + 0.5)
    there = np.isfinite(hits).all(axis=1)
    np.testing.assert_array_equal(there, reference.covered.ravel())
    np.testing.assert_allclose(hits[there], reference.positions() + reference.origin, atol=1e-9)


def test_what_nothing_is_said_of_does_not_count() -> None:
    found = Distances(np.array([1.0, -3.0, 9.0, 0.1]), np.array([2.0, 2.0, np.nan, 0.1]), 1.0)
    assert found.covered == pytest.approx(200 / 3)


def test_rows_become_a_table(tmp_path: Path) -> None:
    where = {
        "device": "a", "driver": "b", "processors": 2, "timer": "finish", "version": "1",
        "date": "2026-01-01", "size": [400, 300], "repeat": 1, "seed": 0,
    }  # fmt: skip
    with open(tmp_path / "rows.jsonl", "w", encoding="utf-8") as stream:
        for zoom in (1.0, 4.0):
            for name, values in DRAWN.items():
                row = {
                    "scene": "bunny", "backend": name, "params": values, "zoom": zoom, "pitch": 0.5,
                    "pairs": 600, "untold": 0, "covered": 95.25, "uncertainty": 1.5, "views": 4, **where,
                }  # fmt: skip
                write_row(stream, row)
    made = EXPERIMENT.made([EXPERIMENT.read(tmp_path)])
    assert made["coverage"].count("`bunny`") == 2
    assert made["coverage"].count("95.2") == 8

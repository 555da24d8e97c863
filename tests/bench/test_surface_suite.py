"""The suite "surface": pictures and scans whose errors are known."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest
from scipy.spatial import cKDTree

from viewer.bench import surface_suite
from viewer.bench.scenes import catalog
from viewer.bench.scenes.defects import without_normals
from viewer.bench.scenes.subjects import Moment
from viewer.bench.surface_suite import (
    CONDITIONS,
    Amount,
    PictureTruth,
    ScanCondition,
    estimated_normals,
    measure_condition,
)
from viewer.bench.truth.shapes import AnalyticScene, Torus
from viewer.bench.truth.surface import reference_surface
from viewer.camera import Camera
from viewer.look import Look
from viewer.mesh.reference import trace
from viewer.scan.spacing import typical_spacing

if TYPE_CHECKING:
    from viewer.drawing.renderer import Renderer

SIZE = (96, 64)
COUNT = 3000


@pytest.fixture(scope="module")
def torus() -> Moment:
    return catalog.subject("torus", None, count=COUNT).moment(0)


def condition(name: str) -> ScanCondition:
    (found,) = (each for each in CONDITIONS if each.name == name)
    return found


def truth_of(moment: Moment) -> PictureTruth:
    camera = Camera.orbit(moment.truth.bounds, 30, 40, aspect=1.5)
    return PictureTruth.of(moment, camera, SIZE, moment.pose.cloud)


def test_the_true_picture_has_no_errors(renderer: Renderer, torus: Moment) -> None:
    truth = truth_of(torus)
    surface = reference_surface(truth.reference, renderer.gpu, Look())
    for name, value in truth.errors(surface).items():
        assert value == pytest.approx(0, abs=2e-5), name
    spacing = np.median(truth.spacing[truth.reference.covered])
    assert spacing == pytest.approx(typical_spacing(torus.pose.cloud), rel=0.2)


def test_a_thicker_body_stands_in_front_by_so_many_spacings(renderer: Renderer, torus: Moment) -> None:
    truth = truth_of(torus)
    spacing = typical_spacing(torus.pose.cloud)
    thicker = AnalyticScene((Torus(tube=0.4 + spacing),))
    picture = reference_surface(trace(thicker, truth.camera, SIZE), renderer.gpu, Look())
    errors = truth.errors(picture)
    assert errors["bias"] == pytest.approx(-1.0, abs=0.2)
    assert errors["rms"] >= -errors["bias"]
    assert errors["spill_percent"] > 0
    assert errors["open_percent"] < 1


def test_scans_are_what_their_names_say(torus: Moment) -> None:
    def scan(name: str) -> tuple:
        return condition(name).scan(torus, COUNT, (0, 0))

    bare, true = scan("even")
    assert bare.normals is None
    assert true.normals is not None
    assert scan("even, with normals")[0].normals is not None
    assert len(scan("thinned 1:10")[0]) == pytest.approx(COUNT / 10, rel=0.15)
    blue = scan("blue noise")[0].positions
    nearest = cKDTree(blue).query(blue, k=2)[0][:, 1]
    random = scan("random")[0].positions
    by_chance = cKDTree(random).query(random, k=2)[0][:, 1]
    assert nearest.min() > 0.5 * np.median(nearest) > 10 * by_chance.min()
    assert len(blue) == pytest.approx(COUNT, rel=0.15)
    sparse = scan("ramp 1:100")[0].positions
    assert (sparse < 0).mean(axis=0).max() > 0.85, "dense at one end"


def test_noise_is_along_the_normals_and_differs_from_frame_to_frame(torus: Moment) -> None:
    still = condition("noise 0.3, with normals")
    (one, _), (other, _) = (still.scan(torus, COUNT, (0, frame)) for frame in (0, 1))
    exact, _ = replace(still, noise=0.0).scan(torus, COUNT, (0, 0))
    off = ((one.positions - exact.positions) * exact.normals).sum(axis=1)
    assert off.std() == pytest.approx(0.3 * typical_spacing(exact), rel=0.1)
    assert len(one) == len(other)
    assert (one.positions != other.positions).any()


def test_the_stretched_grid_is_stretched() -> None:
    cloud, _ = condition("stretched grid").scan(catalog.subject("torus", None).moment(0), 40_000, (0, 0))
    distances, _ = cKDTree(cloud.positions).query(cloud.positions, k=3)
    around = 2 * np.pi * 1.4 / surface_suite._AROUND
    assert distances[:, 2].max() == pytest.approx(around / 5, rel=0.1), "both neighbours are on the tube"


def test_flipped_normals_are_counted(torus: Moment) -> None:
    cloud = torus.pose.cloud
    assert cloud.normals is not None
    bare = without_normals(cloud, np.random.default_rng(0))
    assert estimated_normals(bare, cloud)["flipped_percent"] == 0
    turned = estimated_normals(bare, replace(cloud, normals=-cloud.normals))
    assert turned["flipped_percent"] == 100
    assert turned["normal_mean"] < 5


@pytest.mark.slow
def test_a_condition_is_measured_for_each_backend(renderer: Renderer) -> None:
    amount = Amount(points=COUNT, views=1, picks=5, size=SIZE)
    static = replace(condition("static, noise 0.1"), frames=2)
    found = dict(measure_condition(renderer, catalog.subject("torus", None), static, ["surfels"], amount))
    assert set(found) == {"surfels", "estimate"}
    errors = found["surfels"]
    assert errors["open_percent"] < 5
    assert abs(errors["bias"]) < 0.5
    assert 0 < errors["wander_depth"] < 0.5
    assert 0 <= errors["held_percent"] <= 100
    again = dict(measure_condition(renderer, catalog.subject("torus", None), static, ["surfels"], amount))
    assert again["surfels"] == pytest.approx(errors, nan_ok=True)

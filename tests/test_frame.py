from __future__ import annotations

import threading
import time
from dataclasses import dataclass, replace
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from scenes import NOTHING, sphere

import viewer
from viewer.backends import Backend
from viewer.camera import Camera
from viewer.errors import InputError
from viewer.frame import Request, choose, render_frame
from viewer.gpu.surface import Surface
from viewer.look import Look
from viewer.params import param
from viewer.renderer import Renderer
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose

BARE = PointCloud.from_arrays(sphere(4000).positions)


def test_render_gives_a_surface_that_stays_its_own() -> None:
    cloud = sphere(3000)
    one = viewer.render(cloud, size=(60, 40))
    picture = one.image()
    other = viewer.render(cloud, Camera.orbit(cloud.bounds(), 180), (60, 40))
    assert (one.image() == picture).all()
    assert (other.image() != picture).any()


def test_render_takes_parameters_by_name_and_explains_wrong_ones() -> None:
    thin = viewer.render(sphere(3000), size=(60, 40), backend="surfels", radius_scale=0.3)
    thick = viewer.render(sphere(3000), size=(60, 40), backend="surfels")
    assert thin.coverage.sum() < thick.coverage.sum()
    with pytest.raises(InputError, match=r"unknown parameter of 'points' 'radius'. Known: point_size"):
        viewer.render(sphere(10), backend="points", radius=2)


def test_the_default_follows_what_the_scan_stores() -> None:
    assert choose(sphere(10))[0] == "surfels"
    assert choose(BARE)[0] == "points"
    assert choose(BARE)[1].point_size == 0
    assert choose(BARE, "points")[1].point_size == 1
    assert choose(BARE, None, {"point_size": "3"})[1].point_size == 3
    assert viewer.render(sphere(10), size=(8, 8)).stats.backend == "surfels"
    assert viewer.render(BARE, size=(8, 8)).stats.backend == "points"


def test_missing_normals_are_estimated_when_asked_for() -> None:
    surface = viewer.render(BARE, size=(80, 80), backend="surfels")
    covered = surface.row != NOTHING
    assert covered.mean() > 0.4
    exact = sphere(4000).normals[surface.row[covered]]
    cosine = np.abs((surface.normal[covered] * exact).sum(axis=1))
    assert np.median(cosine) > 0.99
    assert BARE.normals is None, "the scan itself is left as it was"


def test_a_look_can_ask_for_normals_too() -> None:
    lit = viewer.render(BARE, size=(80, 80), backend="points", look=Look(light="head"))
    assert np.ptp(lit.image()[lit.row != NOTHING][:, 0]) > 60


def test_the_window_gets_points_until_what_it_asked_for_is_ready(renderer: Renderer) -> None:
    own = Renderer(renderer.gpu)
    surface = Surface(renderer.gpu, (64, 64))
    request = Request(Pose(0, 0.0, "x", BARE), Camera.orbit(BARE.bounds()), "surfels")
    assert render_frame(own, request, surface, wait=False), "more is to come"
    assert surface.stats.backend == "points"
    assert surface.stats.skipped == {"surfels": "what it needs is being prepared", **_points_skips(surface)}
    deadline = time.monotonic() + 60
    while render_frame(own, request, surface, wait=False):
        assert time.monotonic() < deadline
        time.sleep(0.01)
    assert surface.stats.backend == "surfels"
    own.release()


def _points_skips(surface: Surface) -> dict[str, str]:
    return {k: v for k, v in surface.stats.skipped.items() if k == "compact"}


@dataclass(frozen=True)
class _Params:
    step: int = param(2, "Every how many points", low=1, affects="derive")
    shade: int = param(1, "Nothing", low=1)


class _Uploaded:
    def __init__(self, array: np.ndarray) -> None:
        self.array, self.nbytes, self.released = array, array.nbytes, False

    def release(self) -> None:
        self.released = True


@pytest.fixture
def deriving() -> tuple[Backend, list[Any]]:
    """A backend that derives every n-th position, and the threads that it did so on."""
    module, threads = ModuleType("deriving"), []

    def derive(cloud: PointCloud, params: _Params) -> np.ndarray:
        threads.append(threading.current_thread())
        return cloud.positions[:: params.step]

    vars(module).update(
        Params=_Params,
        needs=lambda cloud, params: (),
        derive=derive,
        upload=lambda gpu, arrays: _Uploaded(arrays),
    )
    return Backend("deriving", module), threads


def test_derived_data_is_made_once_counted_and_evicted(
    renderer: Renderer, deriving: tuple[Backend, list[Any]]
) -> None:
    backend, threads = deriving
    own = Renderer(renderer.gpu, budget_bytes=1)
    pose = Pose(0, 0.0, "x", sphere(1000))
    resident = own.resident(pose)
    first = own.prepare(resident, backend, _Params(), Look(), wait=True)
    assert first is not None
    assert own.prepare(resident, backend, _Params(shade=5), Look(), wait=True) is first, "draws only"
    other = own.prepare(resident, backend, _Params(step=5), Look(), wait=True)
    assert other is not None
    assert len(threads) == 2
    assert own.nbytes == first.derived.nbytes + other.derived.nbytes == 12 * (500 + 200)
    own.resident(replace(pose, index=1))
    assert own.nbytes == 0
    assert first.derived.released
    own.release()


def test_derive_runs_on_the_worker_and_uploads_do_not(
    renderer: Renderer, deriving: tuple[Backend, list[Any]]
) -> None:
    backend, threads = deriving
    own = Renderer(renderer.gpu)
    resident = own.resident(Pose(0, 0.0, "x", sphere(1000)))
    while own.prepare(resident, backend, _Params(), Look(), wait=False) is None:
        time.sleep(0.001)
    assert threads[0] is not threading.main_thread()
    own.release()

"""A frame is planned once, and what its request comes to is found once."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace

import pytest
from moves import Moves
from scenes import sphere

from viewer.app.scene.viewport import Viewport
from viewer.backends import backend
from viewer.camera import Camera
from viewer.document.document import Document
from viewer.drawing.plan import Effort, Failed, Ready, Waiting, make_plan
from viewer.drawing.renderer import Renderer
from viewer.drawing.request import Request
from viewer.errors import InputError
from viewer.look import Look
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose

CLOUD = sphere(2900)
POSE = Pose(0, 0.0, "sphere", CLOUD)
CAMERA = Camera.orbit(CLOUD.bounds())
SIZE = (60, 40)
DECIDING = ("app/", "drawing/", "backends/")  # what decides about a frame; it draws with all else


@pytest.fixture
def viewport(renderer: Renderer) -> Iterator[Viewport]:
    own = Renderer(renderer.gpu)  # without work that other tests left
    viewport = Viewport(own, (0, 0, *SIZE))
    yield viewport
    viewport.release()
    own.release()


@pytest.mark.parametrize("name", ["points", "surfels", "auto_splats"])
def test_a_window_frame_is_planned_and_resolved_once(viewport: Viewport, name: str) -> None:
    document = Document(camera=CAMERA, backend=name)
    while not viewport.is_complete:
        viewport.draw(document.request(POSE))
        time.sleep(0.001)
    turned = replace(document, camera=CAMERA.orbited(10, 0)).request(POSE)
    viewport.rest()  # however slow the machine is, no preview
    moves = Moves(*DECIDING)
    with moves.counted():
        assert viewport.draw(turned)
    assert viewport.surface is not None
    assert viewport.surface.stats.backend == name
    once = ("drawing/plan.py:make_plan", "drawing/request.py:needs", "drawing/request.py:view_of")
    assert {call: moves.calls[call] for call in once} == dict.fromkeys(once, 1)
    assert moves.calls["backends/__init__.py:backend"] == 0, "the request has its backend"
    assert moves.calls["backends/__init__.py:params"] == 0, "and its parameters"
    assert moves.between.total() <= 20, moves.between


def test_the_backend_of_a_pose_is_looked_for_once() -> None:
    pose, moves = Pose(0, 0.0, "sphere", CLOUD), Moves(*DECIDING)
    with moves.counted():
        first = Request(pose, CAMERA)
    assert moves.calls["backends/surfels.py:suits"] == 1
    with moves.counted():
        again = Document(camera=CAMERA).request(pose.at(2.0))
    assert moves.calls["backends/surfels.py:suits"] == 1
    assert (again.backend, again.params) == (first.backend, first.params)


def test_a_document_resolves_a_pose_once() -> None:
    document, moves = Document(camera=CAMERA, backend="points"), Moves(*DECIDING)
    first = document.chosen(POSE)
    with moves.counted():
        for _ in range(38):
            assert document.chosen(POSE) is first
            assert document.defaults(POSE) is document.defaults(POSE)
    assert moves.calls["backends/__init__.py:params"] == 0


@pytest.fixture
def own(renderer: Renderer) -> Iterator[Renderer]:
    """A renderer with workers and poses of its own."""
    own = Renderer(renderer.gpu)
    yield own
    own.release()


def test_a_plan_says_what_is_missing_and_why(own: Renderer) -> None:
    bare = Request(Pose(0, 0.0, "x", PointCloud.from_arrays(CLOUD.positions)), CAMERA, "surfels")
    looked = make_plan(own, bare, SIZE, Effort.NONE)
    assert isinstance(looked, Waiting)
    assert looked.why == "Estimating normals"
    assert own.nbytes == own.work.unfinished == 0, "looking begins nothing"
    made = make_plan(own, bare, SIZE)
    if isinstance(made, Failed):
        raise made.error  # that says which library is missing
    assert isinstance(made, Ready)
    assert made.pose.cloud.normals is not None


def test_a_plan_of_what_cannot_be_drawn_fails_with_the_reason(renderer: Renderer) -> None:
    for request, reason in (
        (Request(POSE, CAMERA, "laplacian"), "draws only range views, but this scan has none"),
        (Request(POSE, CAMERA, "points", look=Look(color_by="missing")), "missing"),
    ):
        failed = make_plan(renderer, request, SIZE)
        assert isinstance(failed, Failed)
        assert isinstance(failed.error, InputError)
        assert reason in str(failed.error)


def test_an_unknown_backend_is_refused_when_a_request_is_made() -> None:
    with pytest.raises(InputError, match=r"unknown backend 'nothing'. Known: auto_splats"):
        Request(POSE, CAMERA, "nothing")
    assert Request(POSE, CAMERA, backend("points")).params == backend("points").params()

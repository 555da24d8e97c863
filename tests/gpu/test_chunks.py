"""Chunks of points: what a picture cannot show is not looked at, and the picture is the same."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scenes import rarely, rarely_together

from viewer.backends import backend, backends
from viewer.bounds import Bounds
from viewer.camera import Camera
from viewer.drawing.frame import render_frame
from viewer.drawing.renderer import Renderer
from viewer.drawing.request import Request
from viewer.gpu import chunks
from viewer.gpu.chunks import best_order, in_coarse_order, in_file_order
from viewer.look import Look
from viewer.picture.surface import Surface
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose
from viewer.view import View

COUNT, SIZE = 30_000, (120, 80)


def sphere(order: str) -> PointCloud:
    """A sphere of radius 1 whose points come in bands, as a scanner has them, or by chance."""
    rng = np.random.default_rng(3)
    points = rng.standard_normal((COUNT, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    if order == "bands":
        points = points[np.lexsort((points[:, 0], np.floor(points[:, 1] * 4)))]
    return PointCloud.from_arrays(
        points.astype(np.float32), normals=points, colors=points * 0.5 + 0.5, origin=np.array([1e6, 0, -1e6])
    )


def camera_in(cloud: PointCloud, azimuth: float = 0.0) -> Camera:
    """A camera near the surface that sees a part of it."""
    outside = Camera.orbit(cloud.bounds(), azimuth, 10, aspect=1.5)
    eye, target = np.array(outside.eye), np.array(outside.target)
    near = target + (eye - target) * 0.35
    return replace(outside, eye=tuple(near), target=tuple(near + np.array([0.3, 0.1, -0.5])))


def drawn(renderer: Renderer, request: Request, share: float = 1.0) -> tuple[Any, ...]:
    """What a picture shows. That of auto splats is larger than the margin of points that take part."""
    surface = Surface(renderer.gpu, (720, 480) if request.backend.name == "auto_splats" else SIZE)
    while render_frame(renderer, request, surface, share=share) and share == 1:
        pass
    found = surface.image(), surface.id, surface.depth, surface.stats.skipped.get("points")
    surface.release()
    assert surface.stats.left_out == pytest.approx((1 - surface.stats.share) * COUNT, abs=0.02 * COUNT)
    return found


@pytest.mark.parametrize("order", [*rarely("bands"), "chance"])
@pytest.mark.parametrize(
    ("name", "params"),
    [
        ("points", {}),
        ("points", {"point_size": 9}),
        ("surfels", {"passes": "two", "enlarge": 2.0}),
        ("auto_splats", {}),
        *rarely_together(("surfels", {}), ("auto_splats", {"passes": "one", "hidden_neighbors": False})),
    ],
    ids=str,
)
def test_pictures_are_the_same_to_the_bit(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch, name: str, params: dict[str, Any], order: str
) -> None:
    cloud = sphere(order)
    pose = Pose(0, 0.0, order, cloud)
    request = Request(pose, camera_in(cloud), name, backend(name).params(params), Look(light="head"))
    whole = [drawn(renderer, request, share) for share in (1.0, 0.4)]
    monkeypatch.setattr(chunks, "LEAST", 1)
    drawn(renderer, request)
    end = time.monotonic() + 60
    while drawn(renderer, request)[-1] is None and time.monotonic() < end:
        time.sleep(0.05)  # until points are in order
    parts = [drawn(renderer, request, share) for share in (1.0, 0.4)]
    for one, other in zip(whole, parts, strict=True):
        assert one[-1] is None
        assert "out of view" in other[-1]
        for before, after in zip(one[:-1], other[:-1], strict=True):
            assert (before == after).all()


def test_a_picture_of_nothing_looks_at_no_point(renderer: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(chunks, "LEAST", 1)
    cloud = sphere("bands")
    camera = Camera.orbit(cloud.bounds(), 0, 0, aspect=1.5)
    away = replace(camera, target=tuple(2 * np.array(camera.eye) - np.array(camera.target)))
    request, told, end = Request(Pose(0, 0.0, "", cloud), away, "points"), None, time.monotonic() + 60
    while told is None and time.monotonic() < end:
        _, ids, _, told = drawn(renderer, request)
        assert (ids == 0xFFFFFFFF).all()
    assert told == f"{COUNT:,} of {COUNT:,} points are in groups out of view"


@pytest.mark.parametrize("name", ["points", "surfels"])
def test_a_pose_that_is_shown_once_is_not_put_in_order(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    monkeypatch.setattr(chunks, "LEAST", 1)
    monkeypatch.setattr(chunks, "best_order", lambda cloud: pytest.fail("looked for an order"))
    cloud = sphere("chance")
    surface = Surface(renderer.gpu, SIZE)
    for number in range(3):
        pose = Pose(number, 0.0, name, cloud.moved(np.full(3, 0.01 * number)))
        render_frame(renderer, Request(pose, camera_in(cloud), name), surface)
        assert "points" not in surface.stats.skipped
        assert renderer.resident(pose).cached(chunks.Chunks)._finding is None


def test_graphics_cards_need_more_points_for_chunks(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch
) -> None:
    """They look at a few million points in less time than Python takes for a list of chunks."""
    monkeypatch.setattr(renderer.gpu, "software", False)
    on_cards = chunks.least_points(renderer.gpu)
    monkeypatch.setattr(renderer.gpu, "software", True)
    assert on_cards > 4e6 > chunks.least_points(renderer.gpu)


def test_orders_hold_each_point_once_and_boxes_hold_theirs() -> None:
    cloud = sphere("chance")
    file, coarse = in_file_order(cloud), in_coarse_order(cloud)
    assert file.is_scattered
    assert not coarse.is_scattered
    assert coarse.rows is not None
    assert (np.sort(coarse.rows) == np.arange(COUNT)).all()
    for ordered in (file, coarse):
        for chunk in range(-(-COUNT // 64)):
            rows = ordered.rows_of(np.array([chunk]), COUNT)
            assert (np.diff(rows.astype(int)) > 0).all()
            points = cloud.positions[rows]
            assert (points.min(axis=0) == ordered.low[chunk]).all()
            assert (points.max(axis=0) == ordered.high[chunk]).all()


_FEW = 1 << 18


class _Held(np.ndarray):
    """Positions that refuse calls that hold the interpreter's lock, but for a few numbers."""

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **kwargs: Any) -> Any:
        plain = [np.asarray(each) if isinstance(each, _Held) else each for each in inputs]
        assert method != "reduceat" or plain[0].size < _FEW
        return getattr(ufunc, method)(*plain, **kwargs)

    def __array_function__(self, function: Any, types: Any, args: Any, kwargs: Any) -> Any:
        assert function not in (np.repeat, np.unique) or np.size(args[0]) < _FEW
        return super().__array_function__(function, types, args, kwargs)

    def tobytes(self, order: Any = "C") -> bytes:
        assert self.size < _FEW
        return super().tobytes(order)


def test_ordering_lets_other_threads_go_on() -> None:
    """Else the window could not draw while many points are put in order."""
    positions = np.random.default_rng(1).random((1 << 20, 3), np.float32)
    ordered = best_order(PointCloud(positions.view(_Held), np.zeros(3)))
    assert ordered.rows is not None, "found in both orders"
    assert (positions[ordered.rows[: ordered.chunk]].min(axis=0) == ordered.low[0]).all()


@pytest.mark.parametrize("name", backends())
@pytest.mark.parametrize("copies", [1, 64])
def test_finding_facts_lets_other_threads_go_on(name: str, copies: int) -> None:
    """Copies of points take another way than points by chance."""
    rng, count = np.random.default_rng(1), 1 << 19
    positions = np.tile(rng.random((count // copies, 3), np.float32), (copies, 1)).view(_Held)
    radii = np.full(count, 0.01, np.float32)
    one = backend(name)
    one.foresee(PointCloud(positions, np.zeros(3), normals=positions, radii=radii), one.params())


def test_points_of_one_plane_are_put_in_order_along_it() -> None:
    flat = np.random.default_rng(2).uniform(size=(COUNT, 3)) * (1, 1, 0)
    coarse = in_coarse_order(PointCloud.from_arrays(flat))
    assert coarse.rows is not None
    assert (np.sort(coarse.rows) == np.arange(COUNT)).all()
    assert not coarse.is_scattered


@given(st.integers(0, 2**32 - 1), st.sampled_from(["perspective", "orthographic"]))
def test_no_box_with_a_point_in_view_is_left_out(seed: int, projection: Any) -> None:
    rng = np.random.default_rng(seed)
    eye, target = rng.normal(size=(2, 3))
    camera = Camera(tuple(eye), tuple(target), (0, 1, 0), projection, near=0.05, far=3.0)
    view = View.of(camera, SIZE, np.zeros(3), Bounds(-np.ones(3), np.ones(3)))
    points = rng.normal(size=(400, 3))
    low, high = points - rng.random((400, 3)), points + rng.random((400, 3))
    assert view.may_show(low, high)[view.contains(points)].all()
    far = points + 50 * (target - eye) / np.linalg.norm(target - eye)
    assert not view.may_show(far, far).any()


def test_what_holds_the_corners_holds_all_between() -> None:
    view = View.of(
        Camera((0, 0, 5), (0, 0, 0), (0, 1, 0)), SIZE, np.zeros(3), Bounds(-np.ones(3), np.ones(3))
    )
    assert view.holds(Bounds(-0.5 * np.ones(3), 0.5 * np.ones(3)).corners())
    assert not view.holds(Bounds(-0.5 * np.ones(3), 9 * np.ones(3)).corners())

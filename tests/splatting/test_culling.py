"""Chunks that are hidden or out of view are not drawn, and pictures are the same to the bit."""

from __future__ import annotations

import itertools
import threading
import time
from dataclasses import replace

import moderngl
import numpy as np
import pytest
from scenes import rarely

from viewer.backends import backend
from viewer.camera import Camera
from viewer.drawing.frame import render_frame
from viewer.drawing.renderer import Renderer
from viewer.drawing.request import Request
from viewer.gpu import arrays, chunks
from viewer.look import Look
from viewer.picture.surface import Surface
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose
from viewer.splatting import culling
from viewer.view import View

COUNT, SIZE = 60_000, (120, 80)
MIDDLE = np.array([1e6, 0, -1e6])


@pytest.fixture(autouse=True)
def small_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Few points have chunks, and all pictures look for hidden ones, whichever the driver."""
    monkeypatch.setattr(chunks, "LEAST", 1)
    monkeypatch.setattr(culling, "_LOOKS", 1 << 20)


def shells(order: str) -> PointCloud:
    """Spheres in one another, each place of them twice; along bands, one after another, or by chance."""
    rng = np.random.default_rng(6)
    points = rng.standard_normal((COUNT // 2, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    radii = np.resize([1.0, 0.8, 0.6, 0.4, 0.2], len(points))
    if order == "bands":
        along = np.lexsort((points[:, 0], np.floor(points[:, 1] * 8), -radii))
        points, radii = points[along], radii[along]
    points = np.repeat(points * radii[:, None], 2, axis=0)
    return PointCloud.from_arrays(points + MIDDLE, colors=rng.random((COUNT, 3)))


def request_of(cloud: PointCloud, camera: Camera, size: int = 2) -> Request:
    params = backend("points").params({"point_size": size})
    return Request(Pose(0, 0.0, "", cloud), camera, "points", params, Look(light="flat"))


def looking(cloud: PointCloud, azimuth: float, nearer: float = 1.0, **changes: object) -> Camera:
    camera = Camera.orbit(cloud.bounds(), azimuth, 20, aspect=1.5)
    eye, target = np.array(camera.eye), np.array(camera.target)
    return replace(camera, eye=tuple(target + (eye - target) * nearer), **changes)


def in_order(renderer: Renderer, request: Request, surface: Surface) -> None:
    """Draw until the points are in an order of use."""
    end = time.monotonic() + 60
    while "chunks" not in surface.stats.counted and time.monotonic() < end:
        render_frame(renderer, request, surface)
        time.sleep(0.02)


def bits_of(
    request: Request, surface: Surface, low: np.ndarray, high: np.ndarray, slack: float
) -> np.ndarray:
    """The plain twin of chunks/cull.comp, of points: whether each box is in view, and shown, (2, C).

    A picture of as many steps has been drawn before. low, high: (C, 3), from the origin of the pose.
    """
    view, margin = surface.view, culling.SLACK + request.params.point_size / 2
    found = []
    for lower, upper in zip(low.astype(float) - slack, high.astype(float) + slack, strict=True):
        corners = np.array(list(itertools.product(*zip(lower, upper, strict=True))))
        pixels, depths = view.project(corners)
        near, far = depths.min(), depths.max()
        first, last = pixels.min(axis=0) - margin, pixels.max(axis=0) + margin
        if is_around := view.perspective and near <= max(view.near, 1e-6 * far):
            first, last = np.zeros(2), np.array(SIZE)
        first, last = np.maximum(first, 0), np.minimum(last, np.array(SIZE) - 1)
        in_view = bool((first <= last).all()) and far >= view.near and near <= view.far
        tiles = [slice(int(a) // 16 * 16, int(b) // 16 * 16 + 16) for a, b in zip(first, last, strict=True)]
        behind = surface.depth[tiles[1], tiles[0]] if in_view and not is_around else np.array([np.inf])
        found.append((in_view, in_view and not behind.max(initial=0) < near * (1 - 1e-5)))
    return np.array(found).T


@pytest.mark.parametrize("order", ["bands", "chance"])
def test_chunks_are_told_apart_as_the_plain_version_does(renderer: Renderer, order: str) -> None:
    cloud = shells(order)
    surface = Surface(renderer.gpu, SIZE)
    request = request_of(cloud, looking(cloud, 0))
    in_order(renderer, request, surface)
    boxes = renderer.resident(request.pose).cached(culling.CulledChunks)._boxes
    kinds = set()
    for camera in (
        looking(cloud, 0), looking(cloud, 70, 0.45), looking(cloud, 140, 0.1), looking(cloud, 30, fov_y=9.0),
        looking(cloud, 30, projection="orthographic"), looking(cloud, 50, near=2.2),
        looking(cloud, 50, near=1.2, far=2.4),
    ):  # fmt: skip
        for _ in range(2):  # the second time all that it shows is drawn first
            render_frame(renderer, replace(request, camera=camera), surface)
        if "chunks" not in surface.stats.counted:
            continue
        seen = boxes.seen(surface)
        found = np.array([seen & culling.IN_VIEW, seen & culling.NOW]) != 0
        expected = bits_of(request, surface, boxes.order.low, boxes.order.high, boxes.slack)
        assert (found != expected).sum(axis=1).max() <= 2, "but for what float32 rounds"
        kinds |= set(zip(*found.tolist(), strict=True))
    assert kinds == {(False, False), (True, False), (True, True)}


@pytest.mark.parametrize(("seconds", "parts"), [(0.0, 1), (1e6, 2)], ids=["by time", "by number"])
def test_the_drawing_thread_neither_orders_points_nor_tests_chunks(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch, seconds: float, parts: int
) -> None:
    """A picture uploads few slices or has the GPU order few runs of points, and all pictures are the same."""
    threads, pictures = set(), []
    for owner, name in ((chunks, "best_order"), (chunks, "in_coarse_order")):
        function = getattr(owner, name)
        monkeypatch.setattr(
            owner, name, lambda cloud, do=function: (threads.add(threading.current_thread()), do(cloud))[1]
        )
    monkeypatch.setattr(View, "may_show", lambda *_: pytest.fail("chunks are tested on the CPU"))
    slice_bytes, run = 1 << 14, 1 << 12
    for owner, name, value in (
        (renderer.gpu.staging, "slice", slice_bytes), (culling, "UPLOAD_SECONDS", seconds),
        (culling, "_SLICES", 2), (culling, "_RUN", run), (culling, "_RUNS", 2),
    ):  # fmt: skip
        monkeypatch.setattr(owner, name, value)
    cloud = shells("chance")
    request = request_of(cloud, looking(cloud, 0), 1)
    surface, far = Surface(renderer.gpu, SIZE), looking(cloud, 70, 0.45)
    work: list[int] = []
    write, dispatch = arrays.GpuArray.write, renderer.gpu.dispatch

    def counted_write(array: arrays.GpuArray, *limits: float) -> bool:
        before = array.uploaded_bytes
        is_complete = write(array, *limits)
        work.append(array.uploaded_bytes - before)
        return is_complete

    def counted_dispatch(program: moderngl.ComputeShader, count: int) -> None:
        dispatch(program, count)
        if program is renderer.gpu.compute("chunks/reorder.comp"):
            work.append(12 * count)

    monkeypatch.setattr(arrays.GpuArray, "write", counted_write)
    monkeypatch.setattr(renderer.gpu, "dispatch", counted_dispatch)
    most = parts * max(slice_bytes, 12 * run)
    ordered = 0
    end = time.monotonic() + 60
    while "chunks" not in surface.stats.counted and time.monotonic() < end:
        work.clear()
        render_frame(renderer, replace(request, camera=far), surface)
        pictures.append(surface.row)
        if len(pictures) > 1:
            ordered += sum(work)
            assert sum(work) <= most + slice_bytes, "the last slice of rows, and the first runs"
        time.sleep(0.002)
    assert "chunks" in surface.stats.counted
    assert ordered >= (4 + 12) * COUNT, "rows, and positions in their order"
    assert len(pictures) > ordered // (most + slice_bytes)
    assert all((picture == pictures[0]).all() for picture in pictures)
    assert threads
    assert threading.current_thread() not in threads


@pytest.mark.parametrize("is_hidden", [True, False])
def test_graphics_cards_look_for_hidden_chunks_where_many_are(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch, is_hidden: bool
) -> None:
    """Pictures are the same whether they look or not."""
    monkeypatch.setattr(renderer.gpu, "software", False)
    monkeypatch.setattr(culling, "_PAYS", 0.0 if is_hidden else 1.0)
    monkeypatch.setattr(culling, "_LOOKS", 3)
    cloud = shells("chance")
    request, surface = request_of(cloud, looking(cloud, 0), 1), Surface(renderer.gpu, SIZE)
    in_order(renderer, request, surface)  # the last of these pictures looks
    looked = []
    for turn in range(6):
        near = replace(request, camera=looking(cloud, 10 * turn))
        render_frame(renderer, near, surface)
        looked.append("chunks" in surface.stats.counted)
        alone = Surface(renderer.gpu, SIZE)
        render_frame(renderer, replace(near, pose=Pose(1, 0.0, "", replace(cloud))), alone)
        assert (surface.row == alone.row).all()
    assert looked == ([True] * 6 if is_hidden else [True, True, False, False, False, False])


def test_chunks_in_view_are_counted_on_the_gpu(renderer: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where few points are in view these are drawn alone; where many are, some pictures do not look."""
    cloud = shells("chance")
    size = 4 * SIZE[0], 4 * SIZE[1]
    request, surface = request_of(cloud, looking(cloud, 0), 1), Surface(renderer.gpu, size)
    in_order(renderer, request, surface)
    monkeypatch.setattr(View, "may_show", lambda *_: pytest.fail("chunks are tested on the CPU"))
    chunks_in = renderer.resident(request.pose).cached(culling.CulledChunks)
    for camera, is_few in ((looking(cloud, 70, 0.1), True), (looking(cloud, 70, 0.8), False)):
        chunks_in._looks_again_in = 0
        near, alone = replace(request, camera=camera), Surface(renderer.gpu, size)
        reads = renderer.gpu.staging.reads
        for _ in range(3):
            render_frame(renderer, near, surface)
        assert renderer.gpu.staging.reads - reads == (3 if is_few else 2)
        assert ("out of view" in surface.stats.skipped.get("points", "")) == is_few
        render_frame(renderer, replace(near, pose=Pose(1, 0.0, "", replace(cloud))), alone)
        assert (surface.row == alone.row).all()
        assert (surface.image() == alone.image()).all()


@pytest.mark.parametrize("order", ["bands", "chance"])
@pytest.mark.parametrize("size", [1, *rarely(2), 5])
def test_pictures_are_the_same_to_the_bit(renderer: Renderer, order: str, size: int) -> None:
    cloud = shells(order)
    surface = Surface(renderer.gpu, SIZE)
    request = request_of(cloud, looking(cloud, 0), size)
    in_order(renderer, request, surface)
    turns = ((0, 1), (5, 1), (90, 0.5), (270, 0.1), (10, 4))
    views = [looking(cloud, azimuth, nearer) for azimuth, nearer in turns]
    views += [looking(cloud, 30, projection="orthographic"), looking(cloud, 40, 30, fov_y=0.4)]
    views += [looking(cloud, 50, near=2.2), looking(cloud, 50, near=1.2, far=2.4), looking(cloud, 60, 0.02)]
    tested = 0
    for camera in views:
        for _ in range(2):
            render_frame(renderer, replace(request, camera=camera), surface)
            if "chunks" in surface.stats.counted:
                assert sum(surface.stats.counted["chunks"]().values()) == -(-COUNT // 64)
                tested += 1
        fresh = Surface(renderer.gpu, SIZE)
        render_frame(renderer, replace(request, camera=camera), fresh)
        assert not fresh.stats.counted, "it has no picture before"
        for name in ("depth", "id", "color"):
            np.testing.assert_array_equal(getattr(surface, name), getattr(fresh, name), err_msg=str(camera))
        np.testing.assert_array_equal(surface.image(), fresh.image())
    assert tested >= len(views), "most of them, in both turns"


@pytest.mark.parametrize("order", ["bands", "chance"])
def test_close_ups_list_the_pixels_of_chunks_in_view(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch, order: str
) -> None:
    cloud = shells(order)
    surface, fresh = (Surface(renderer.gpu, (500, 330)) for _ in range(2))
    request = request_of(cloud, looking(cloud, 0), 1)
    in_order(renderer, request, surface)
    for azimuth in (0, 3, 50):
        near = replace(request, camera=looking(cloud, azimuth, fov_y=3.0))
        render_frame(renderer, near, surface)
        assert {"pixels", "points"} <= surface.stats.skipped.keys()
        fresh.drawn = {}
        with monkeypatch.context() as whole:
            whole.setattr(chunks, "LEAST", COUNT + 1)
            render_frame(renderer, near, fresh)
        assert "pixels" not in fresh.stats.skipped
        for name in ("depth", "id", "color"):
            np.testing.assert_array_equal(getattr(surface, name), getattr(fresh, name))
        np.testing.assert_array_equal(surface.image(), fresh.image())
        assert (surface.id != 0xFFFFFFFF).sum() > 1000


def test_what_is_hidden_or_beside_the_picture_is_not_drawn(renderer: Renderer) -> None:
    cloud = shells("bands")
    surface = Surface(renderer.gpu, (600, 400))
    request = request_of(cloud, looking(cloud, 0), 16)
    in_order(renderer, request, surface)
    render_frame(renderer, request, surface)
    total = -(-COUNT // 64)
    counted = surface.stats.counted["chunks"]()
    assert counted["hidden"] > 0.5 * total, counted
    assert counted["outside"] == 0
    away = looking(cloud, 0)
    eye, target = np.array(away.eye), np.array(away.target)
    render_frame(renderer, replace(request, camera=replace(away, target=tuple(2 * eye - target))), surface)
    assert surface.stats.skipped["points"] == f"{COUNT:,} of {COUNT:,} points are in groups out of view"
    assert (surface.id == 0xFFFFFFFF).all()


def test_others_are_shown_as_soon_as_what_hid_them_is_gone(renderer: Renderer) -> None:
    """Through a hole cut into the outermost shell the next one is seen."""
    cloud = shells("bands")
    surface = Surface(renderer.gpu, SIZE)
    camera = looking(cloud, 0)
    request = request_of(cloud, camera, 5)
    in_order(renderer, request, surface)
    distance = float(np.linalg.norm(np.subtract(camera.eye, camera.target)))
    for near, radius in ((distance - 0.9, 0.8), (distance - 0.7, 0.6), (None, 1.0)):
        render_frame(renderer, replace(request, camera=replace(camera, near=near)), surface)
        middle = cloud.positions[surface.id[SIZE[1] // 2, SIZE[0] // 2]] + (cloud.origin - MIDDLE)
        assert np.linalg.norm(middle) == pytest.approx(radius, abs=1e-3)

"""Moving pictures that go on from the one before: its points and those in turn, each where it lies."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scenes import NOTHING, sphere

from viewer.backends import backend
from viewer.camera import Camera
from viewer.drawing.frame import render_frame
from viewer.drawing.renderer import Renderer
from viewer.drawing.request import Request
from viewer.picture.surface import Surface
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose
from viewer.splatting.kept import ClosedGaps, KeptPoints, stride_of
from viewer.splatting.squares import _STEP, _reach

SIZE = (120, 80)
SHARE = 0.2
COUNT = 30_000


@pytest.fixture(scope="module")
def pose() -> Pose:
    return Pose(0, 0.0, "", sphere(COUNT))


def seen(pose: Pose, turns: float = 0.0, point_size: int = 1) -> Request:
    camera = Camera.orbit(pose.bounds, 20 + turns, 15, aspect=1.5)
    return Request(pose, camera, "points", backend("points").params({"point_size": point_size}))


def whole(renderer: Renderer, request: Request, size: tuple[int, int] = SIZE) -> Surface:
    surface = Surface(renderer.gpu, size)
    render_frame(renderer, request, surface)
    return surface


def assert_same(one: Surface, other: Surface) -> None:
    for channel in ("id", "depth"):
        np.testing.assert_array_equal(getattr(one, channel), getattr(other, channel), err_msg=channel)
    np.testing.assert_array_equal(one.image(), other.image())


def in_turn(count: int, stride: int, turn: int) -> NDArray[np.intp]:
    """The rows whose turn it is, as points/cells.glsl has it."""
    runs = np.arange(-(-count // stride), dtype=np.uint32)
    rows = runs * np.uint32(stride) + (np.uint32(turn) + (runs * np.uint32(0x9E3779B1) >> 16)) % stride
    return rows[rows < count].astype(np.intp)


def closed(surface: Surface, step: float) -> tuple[NDArray, NDArray]:
    """Depths and rows with gaps of one pixel closed, as points/gaps.comp has it."""
    depth, row = surface.depth.copy(), surface.row.copy()
    before, rows = surface.depth, surface.row
    inner = (slice(1, -1), slice(1, -1))
    places = (
        (slice(0, -2), inner[1]),
        (inner[0], slice(0, -2)),
        (inner[0], slice(2, None)),
        (slice(2, None), inner[1]),
    )
    around, of_rows = np.stack([before[each] for each in places]), np.stack([rows[each] for each in places])
    gaps = (around < before[inner] - np.float32(step)).sum(axis=0) >= 3
    nearest = around.argmin(axis=0)[None]
    depth[inner][gaps] = np.take_along_axis(around, nearest, axis=0)[0][gaps]
    row[inner][gaps] = np.take_along_axis(of_rows, nearest, axis=0)[0][gaps]
    return depth, row


def step_of(pose: Pose) -> float:
    """The step of depth beyond which there is a gap, scan units."""
    return np.float32(_STEP * pose.cloud.remember(_reach))


def test_gaps_of_a_pixel_are_closed_and_nothing_else(renderer: Renderer) -> None:
    pose = Pose(0, 0.0, "", sphere(8000))  # through which the other side is seen
    for step in (0.5, 0.01):
        surface = whole(renderer, seen(pose))
        depth, row = closed(surface, step)
        assert (row != surface.row).any()
        surface.cached(ClosedGaps).close(surface, step)
        np.testing.assert_array_equal(surface.depth, depth)
        np.testing.assert_array_equal(surface.row, row)


def test_each_row_has_its_turn_once() -> None:
    for count, stride in ((1000, 7), (COUNT, stride_of(SHARE)), (5, 8)):
        rows = np.concatenate([in_turn(count, stride, turn) for turn in range(3, 3 + stride)])
        np.testing.assert_array_equal(np.sort(rows), np.arange(count))


def test_what_is_listed_is_what_a_picture_shows(renderer: Renderer, pose: Pose) -> None:
    for size in (1, 3):
        surface = whole(renderer, seen(pose, point_size=size))
        listed = KeptPoints(renderer.resident(pose)).list_shown(surface)
        rows = np.frombuffer(listed.texels.buffer.read(4 * len(listed)), np.uint32)
        shown = np.unique(surface.row[surface.row != NOTHING])
        np.testing.assert_array_equal(np.unique(rows), shown)
        assert len(rows) < 1.5 * len(shown), "few more than once"


@pytest.mark.parametrize("point_size", [1, 2])
def test_a_picture_is_of_what_the_one_before_showed_and_of_those_in_turn(
    renderer: Renderer, pose: Pose, point_size: int
) -> None:
    surface = whole(renderer, seen(pose, point_size=point_size))
    stride = stride_of(SHARE)
    kept = renderer.resident(pose).cached(KeptPoints)
    for step in range(1, 5):
        before = np.unique(surface.row[surface.row != NOTHING])
        turn = kept._turn + 1
        request = seen(pose, 3.0 * step, point_size)
        assert render_frame(renderer, request, surface, share=SHARE, moving=True, before=surface)
        rows = np.union1d(before, in_turn(COUNT, stride, turn)).astype(np.intp)
        parts = pose.cloud.of_rows(rows)
        wanted = whole(renderer, replace(request, pose=Pose(1, 0.0, "", parts)))
        depth, row = closed(wanted, step_of(pose))
        row = np.where(row == NOTHING, row, rows[np.minimum(row, len(rows) - 1)])
        np.testing.assert_array_equal(surface.row, row)
        np.testing.assert_array_equal(surface.depth, depth)
        assert surface.stats.left_out == COUNT - -(-COUNT // stride)
        counts = surface.point_counts()
        assert counts.pop("in") == sum(counts.values()) == COUNT
        assert min(counts.values()) >= 0


@pytest.mark.parametrize("point_size", [0, 1, 3])
def test_where_the_camera_rests_it_becomes_the_picture_of_all(
    renderer: Renderer, pose: Pose, point_size: int
) -> None:
    request, surface = seen(pose, 0.0, point_size), Surface(renderer.gpu, SIZE)
    render_frame(renderer, request, surface, share=SHARE, moving=True)
    assert surface.stats.known == SHARE
    known = [SHARE]
    for _ in range(2 * stride_of(SHARE)):
        render_frame(renderer, request, surface, share=SHARE, moving=True, before=surface)
        known.append(surface.stats.known)
    np.testing.assert_allclose(known, np.minimum(SHARE * np.arange(1, len(known) + 1), 1.0))
    wanted = whole(renderer, request)
    depth, row = closed(wanted, step_of(pose))
    np.testing.assert_array_equal(surface.row, row)
    np.testing.assert_array_equal(surface.depth, depth)


def test_where_hidden_points_are_left_out_each_picture_is_its_own(renderer: Renderer) -> None:
    pose, surface = Pose(0, 0.0, "", sphere(5000)), Surface(renderer.gpu, SIZE)
    request = seen(pose)
    request = replace(request, params=replace(request.params, hide_hidden=True))
    before = whole(renderer, request)
    wanted = Surface(renderer.gpu, SIZE)
    render_frame(renderer, request, wanted, share=SHARE, moving=True)
    render_frame(renderer, request, surface, share=SHARE, moving=True, before=before)
    assert surface.stats.known == SHARE, "as hidden ones are found among the share alone"
    assert_same(surface, wanted)


def test_pictures_of_any_size_go_on_from_each_other(renderer: Renderer, pose: Pose) -> None:
    sparse = Pose(0, 0.0, "", sphere(5000))  # too few to touch: no gap of theirs is closed
    small, request = Surface(renderer.gpu, (60, 40)), seen(sparse)
    large = whole(renderer, request)
    render_frame(renderer, request, small, share=SHARE, moving=True, before=large)
    assert small.stats.known == 1.0
    assert_same(small, whole(renderer, request, small.size))
    render_frame(renderer, seen(sparse, 1.0), large, share=SHARE, moving=True, before=small)
    assert large.stats.known == 1.0
    assert 0 < np.isfinite(large.depth).sum() < np.isfinite(whole(renderer, request).depth).sum()


def test_pictures_at_rest_and_of_something_else_are_their_own(renderer: Renderer, pose: Pose) -> None:
    before = whole(renderer, seen(pose))
    other = Pose(1, 0.0, "", sphere(COUNT))
    turned = seen(pose, 10.0)
    for request, moving in (
        (turned, False),
        (seen(other, 10.0), True),
        (seen(pose, 10.0, point_size=2), True),
        (replace(turned, backend="surfels", params=None), True),
    ):
        surface, wanted = Surface(renderer.gpu, SIZE), Surface(renderer.gpu, SIZE)
        render_frame(renderer, request, surface, share=SHARE, moving=moving, before=before)
        render_frame(renderer, request, wanted, share=SHARE, moving=moving)
        assert_same(surface, wanted)
    in_full = Surface(renderer.gpu, SIZE)
    assert not render_frame(renderer, turned, in_full, moving=True, before=before)
    assert_same(in_full, whole(renderer, turned))


def test_squares_of_a_few_points_reach_as_far_as_the_next_one(renderer: Renderer) -> None:
    dense, sparse = (Pose(0, 0.0, "", sphere(count)) for count in (200_000, 300))
    largest = {}
    for pose in (dense, sparse):
        surface, request = Surface(renderer.gpu, SIZE), seen(pose)
        render_frame(renderer, request, surface, share=0.01 if pose is dense else 0.3)
        _, many = np.unique(surface.row[surface.row != NOTHING], return_counts=True)
        largest[pose.count] = int(many.max())
    assert largest[200_000] <= 9, "no tenfold squares where three pixels touch"
    assert largest[300] == 1, "nor other ones than chosen for so few"


def test_previews_of_few_large_squares_leave_nothing_behind(renderer: Renderer) -> None:
    pose, surface = Pose(0, 0.0, "", sphere(COUNT)), Surface(renderer.gpu, (96, 64))
    for turn in range(4):
        request = seen(pose, 40.0 * turn, point_size=0)
        fresh = Surface(renderer.gpu, surface.size)
        for each in (surface, fresh):
            render_frame(renderer, request, each, share=0.04)
        assert_same(surface, fresh)


def test_what_is_kept_of_a_pose_goes_with_it(renderer: Renderer) -> None:
    own = Renderer(renderer.gpu)
    pose = Pose(0, 0.0, "", PointCloud.from_arrays(sphere(COUNT).positions))
    surface = whole(own, seen(pose))
    held = own.nbytes
    render_frame(own, seen(pose, 2.0), surface, share=SHARE, moving=True, before=surface)
    assert own.nbytes == held + 4 * SIZE[0] * SIZE[1] + 16
    own.release()

"""The picture reads from the GPU what the mouse asks for, no more often than it can have changed."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.lib.stride_tricks import sliding_window_view
from scenes import sphere

from viewer.app.scene import probe as probe_module
from viewer.app.scene import viewport as viewport_module
from viewer.app.scene.viewport import Viewport
from viewer.backends import Backend, FrameView
from viewer.camera import Camera
from viewer.drawing.renderer import Renderer, shared_renderer
from viewer.drawing.request import Request
from viewer.gpu.pose import GpuPose
from viewer.look import Look
from viewer.picture.surface import NOTHING, Surface
from viewer.scan.open import DEMO, open_scan
from viewer.scan.pose import Pose

POSE = Pose(0, 0.0, "sphere", sphere(3000))
REQUEST = Request(POSE, Camera.orbit(POSE.cloud.bounds()), "points")
SIZE = (60, 40)


def test_a_pixel_is_read_once_until_mouse_or_picture_move(
    viewport: Viewport, monkeypatch: pytest.MonkeyPatch
) -> None:
    reads = []

    def counted(surface: Surface, x: int, y: int, **options: bool) -> object:
        reads.append((x, y))
        return picture_pick(surface, x, y, **options)

    picture_pick = probe_module.pick
    monkeypatch.setattr(probe_module, "pick", counted)
    assert viewport.probe.pick((30, 20)) is None, "before the first picture"
    viewport.draw(REQUEST)
    first = viewport.probe.pick((30, 20))
    assert first is not None
    viewport.draw(REQUEST)
    assert viewport.probe.pick((30, 20)) is first
    assert viewport.probe.pick((0, 0)) is viewport.probe.pick((0, 0)) is None
    assert len(reads) == 2
    other = replace(REQUEST, camera=REQUEST.camera.orbited(40, 0))
    viewport.probe.pick((30, 20))
    viewport.draw(other)
    turned = viewport.probe.pick((30, 20))
    assert turned is not None
    assert turned.row != first.row
    assert len(reads) == 4


def test_what_is_shown_near_a_pixel_is_known(viewport: Viewport) -> None:
    assert not viewport.probe.shows_near((30, 20), 5), "before the first picture"
    viewport.draw(REQUEST)
    assert viewport.surface is not None
    shown = np.isfinite(viewport.surface.depth)
    left = int(shown.any(axis=0).argmax())
    assert viewport.probe.shows_near((30, 20), 1)
    assert viewport.probe.shows_near((left - 3, 20), 6)
    assert not viewport.probe.shows_near((left - 9, 20), 6)
    assert not viewport.probe.shows_near((0, 0), 2)


def test_nothing_is_picked_where_there_is_no_picture(viewport: Viewport) -> None:
    viewport.draw(REQUEST)
    assert viewport.probe.pick((30, 20)) is not None
    broken = replace(REQUEST, look=replace(REQUEST.look, color_by="missing"))
    viewport.draw(broken)
    assert viewport.problem is not None
    assert viewport.probe.pick((30, 20)) is None
    viewport.draw(REQUEST)
    assert viewport.probe.pick((30, 20)) is not None
    viewport.clear()
    assert viewport.probe.pick((30, 20)) is None
    assert viewport.is_visible, "until another one is drawn"


def test_another_look_is_shaded_in_full_at_once(viewport: Viewport) -> None:
    viewport.draw(REQUEST)
    for color in ("#ff0000", "#00ff00"):
        look = replace(REQUEST.look, color_by="plain", plain=color)
        assert viewport.draw(replace(REQUEST, look=look), held=True)
        assert viewport.surface is not None
        assert "draw" in viewport.surface.stats.skipped
        assert not viewport.is_preview
        middle = viewport.surface.image()[20, 30]
        assert middle[color.index("f") // 2] > 100 > middle[(color.index("f") // 2 + 1) % 3]


def test_a_preview_is_drawn_in_full_at_rest_and_on_demand(viewport: Viewport) -> None:
    viewport.draw(REQUEST)
    full = shown(viewport)
    assert not viewport.is_preview
    assert viewport.is_complete
    viewport.took(1000.0, goal_ms=10.0)
    viewport.draw(turned(REQUEST), held=True)
    assert viewport.is_preview
    assert viewport.surface is not None
    assert viewport.surface.size < SIZE
    assert viewport.size == SIZE
    assert not viewport.is_complete

    assert not viewport.draw(viewport.request or REQUEST, playing=True), "other poses are to come"
    assert math.isinf(viewport.better_at(playing=True))
    assert viewport.better_at(playing=False) < time.monotonic() + 1
    viewport.finish()
    assert not viewport.is_preview
    assert viewport.surface.size == SIZE
    viewport.draw(REQUEST)
    viewport.finish()
    for before, after in zip(full, shown(viewport), strict=True):
        np.testing.assert_array_equal(after, before)


def test_the_time_that_showing_a_picture_takes_is_no_rest(
    viewport: Viewport, monkeypatch: pytest.MonkeyPatch
) -> None:
    now = 0.0
    monkeypatch.setattr(viewport_module, "time", SimpleNamespace(monotonic=lambda: now))
    for seconds, is_preview in ((1.0, True), (0.0, True), (-1.0, False)):
        viewport.draw(REQUEST)
        now += max(seconds, 0.0)
        viewport.took(1000.0, goal_ms=10.0)
        now += max(-seconds, 0.0)
        viewport.draw(turned(REQUEST))
        assert viewport.is_preview is is_preview, f"shown for {seconds} s"
        now += 1.0


@dataclass(frozen=True)
class _NoParams:
    """None."""


def test_a_backend_that_draws_more_simply_in_motion_is_called_again_at_rest(viewport: Viewport) -> None:
    told: list[bool] = []

    class Simple(Backend):
        title = "Simple"
        params_class = _NoParams

        def draw(self, pose: GpuPose, frame: FrameView, surface: Surface) -> bool:
            told.append(frame.moving)
            surface.clear()
            surface.stats.simplified = frame.moving
            return False

    request = replace(REQUEST, backend=Simple("simple"), params=None)
    viewport.draw(request)
    assert (told, viewport.is_complete) == ([False], True)
    dragged = turned(request)
    viewport.draw(dragged, held=True)
    viewport.draw(turned(dragged), playing=True)
    assert told == [False, True, True]
    assert viewport.is_preview
    assert not viewport.draw(turned(dragged), playing=True), "it goes on moving"
    assert math.isinf(viewport.better_at(playing=True))
    while not viewport.draw(turned(dragged)):
        assert len(told) == 3
        time.sleep(0.005)
    assert told == [False, True, True, False]
    assert viewport.is_complete
    viewport.took(1000.0, goal_ms=10.0)  # which says nothing of motion
    viewport.draw(request, held=True)
    assert viewport.surface is not None
    assert viewport.surface.size == SIZE
    viewport.finish()
    assert told[-2:] == [True, False], "at once where something asks for it"


def test_what_is_under_the_mouse_in_a_preview_is_about_what_it_is_in_full(viewport: Viewport) -> None:
    viewport.draw(REQUEST)
    whole = viewport.probe.pick((37, 12))
    viewport.took(1000.0, goal_ms=10.0)
    viewport.draw(replace(REQUEST, look=Look(light="flat")), held=True)
    assert viewport.is_preview
    rough = viewport.probe.pick((37, 12))
    assert whole is not None
    assert rough is not None
    assert np.linalg.norm(rough.position - whole.position) < 0.1
    exact = viewport.probe.pick_in_full()
    assert not viewport.is_preview
    assert exact is not None
    np.testing.assert_array_equal(exact.position, whole.position)
    assert viewport.probe.pick((SIZE[0] - 1, SIZE[1] - 1)) is None


def shown(viewport: Viewport) -> tuple[np.ndarray, ...]:
    assert viewport.surface is not None
    return viewport.surface.image(), viewport.surface.depth, viewport.surface.id


def test_two_viewports_of_one_scan_share_its_upload_and_nothing_else(viewport: Viewport) -> None:
    renderer = Renderer(shared_renderer().gpu)
    front, side = (Viewport(renderer, (left, 0, *SIZE)) for left in (0, SIZE[0]))
    from_side = turned(REQUEST)
    front.draw(REQUEST)
    held = renderer.nbytes
    assert held == renderer.bytes_of(POSE) > 0
    side.draw(from_side)
    assert renderer.nbytes == held, "one scan, uploaded once"

    assert front.surface is not side.surface
    for one, request in ((front, REQUEST), (side, from_side)):
        viewport.draw(request)
        for alone, beside in zip(shown(viewport), shown(one), strict=True):
            np.testing.assert_array_equal(beside, alone)
    assert not np.array_equal(shown(front)[2], shown(side)[2])
    in_front, at_side = front.probe.pick((30, 20)), side.probe.pick((30, 20))
    assert in_front is not None
    assert at_side is not None
    assert in_front.id != at_side.id

    number = front.number
    front.took(1000.0, goal_ms=10.0)
    front.draw(turned(from_side), held=True)
    front.draw(turned(turned(from_side)), held=True)
    assert front.is_preview, "the one that moves"
    assert not side.is_preview
    assert (front.number, side.number) == (number + 2, 1)
    front.release()
    assert side.draw(replace(from_side, look=Look(light="flat"))), "the other goes on"
    side.release()
    renderer.release()


def test_two_viewports_of_two_scans_hold_both_in_one_renderer() -> None:
    renderer = Renderer(shared_renderer().gpu)
    other_pose = Pose(0, 0.0, "other", sphere(500))
    other_request = Request(other_pose, Camera.orbit(other_pose.cloud.bounds()), "points")
    one, other = (Viewport(renderer, (left, 0, *SIZE)) for left in (0, SIZE[0]))
    for _ in range(2):
        one.draw(REQUEST)
        other.draw(other_request)
    assert one.number == other.number == 1, "neither puts the other's picture off"
    assert renderer.nbytes == renderer.bytes_of(POSE) + renderer.bytes_of(other_pose)
    assert min(renderer.bytes_of(POSE), renderer.bytes_of(other_pose)) > 0
    ids = shown(one)[2], shown(other)[2]
    assert 500 <= ids[0][ids[0] != NOTHING].max() < 3000
    assert 0 < ids[1][ids[1] != NOTHING].max() < 500
    for viewport in (one, other):
        viewport.release()
    renderer.release()


def turned(request: Request) -> Request:
    return replace(request, camera=request.camera.orbited(10, 0))


@pytest.mark.parametrize("step", ["make_plan", "draw_plan"])
def test_whatever_fails_is_a_problem_and_the_image_before_stays(
    viewport: Viewport, step: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    viewport.draw(REQUEST)
    before = shown(viewport)[0]
    monkeypatch.setattr(viewport_module, step, failing)
    assert viewport.draw(turned(REQUEST))
    assert str(viewport.problem).startswith("Drawing frame 1 failed (ValueError: of a library)")
    assert not viewport.is_there
    assert viewport.is_visible
    np.testing.assert_array_equal(shown(viewport)[0], before)
    assert not viewport.draw(turned(REQUEST)), "it is not tried again and again"
    assert math.isinf(viewport.better_at(playing=False))
    monkeypatch.undo()
    assert viewport.draw(REQUEST)
    assert viewport.is_there


def test_a_surface_that_nothing_was_drawn_into_is_not_shown(
    viewport: Viewport, monkeypatch: pytest.MonkeyPatch
) -> None:
    viewport.draw(REQUEST)
    monkeypatch.setattr(viewport_module, "draw_plan", failing)
    viewport.rectangle = (0, 0, 30, 20)
    viewport.draw(REQUEST)
    assert not viewport.is_visible


def failing(*args: object, **options: object) -> bool:
    raise ValueError("of a library")


def test_a_picture_at_rest_is_refined_and_any_other_one_begins_anew(viewport: Viewport) -> None:
    viewport.draw(REQUEST)
    assert viewport.surface is not None
    plain = viewport.surface.image()
    assert viewport.is_complete
    assert not viewport.is_refined
    assert math.isinf(viewport.refines_at(playing=True))
    for samples in (1, 1, 1, 5):
        assert viewport.refines_at(playing=False) < time.monotonic()
        assert viewport.refine() == (samples == 5)
        assert viewport.surface.stats.samples == samples
    assert viewport.is_refined
    assert not viewport.refine()
    refined = viewport.surface.image()
    assert (refined != plain).any()

    viewport.draw(turned(REQUEST), held=True)
    assert viewport.surface.stats.samples == 1
    assert time.monotonic() < viewport.refines_at(playing=False) < time.monotonic() + 1, "not while it moves"
    viewport.refine()
    viewport.draw(REQUEST)
    np.testing.assert_array_equal(viewport.surface.image(), plain)
    viewport.finish()
    assert not viewport.is_refined, "which picks do not wait for"
    while not viewport.is_refined:
        viewport.refine()
    np.testing.assert_array_equal(viewport.surface.image(), refined)
    viewport.draw(replace(REQUEST, look=Look(quality="fast")))
    assert viewport.is_refined


def test_the_coarsest_preview_shows_the_surface_without_specks() -> None:
    """Where the full picture is smooth, the preview is about as light: nothing dark shows through gaps."""
    size = (944, 587)
    viewport = Viewport(shared_renderer(), (0, 0, *size))
    with open_scan(DEMO) as timeline:
        pose, still = timeline.pose(26), timeline.pose(27)
    camera = Camera.orbit(pose.cloud.bounds(), aspect=size[0] / size[1])
    request = Request(pose, camera, "surfels")
    viewport.draw(request)
    full = luma(shown(viewport)[0])
    for number in range(4):  # each is too late by far
        viewport.took(1e4, goal_ms=1.0)
        viewport.draw(
            replace(request, pose=still if number % 2 else pose, camera=turned(request).camera), held=True
        )
    viewport.draw(request, playing=True)
    assert viewport.surface is not None
    assert viewport.surface.size[0] < 0.4 * size[0], "the coarsest"
    preview = luma(enlarged(shown(viewport)[0], size))
    around = sliding_window_view(np.pad(full, 7, mode="edge"), (15, 15))
    smooth = np.ptp(around, axis=(2, 3)) < 25
    assert smooth.mean() > 0.7
    assert (np.abs(preview - full)[smooth] < 25).all()
    viewport.release()


def luma(image: np.ndarray) -> np.ndarray:
    return image[..., :3] @ np.array([0.3, 0.6, 0.1])


def enlarged(image: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    """A picture at another size: each pixel as the one in which its middle lies."""
    columns, rows = (
        (np.arange(new) * 2 + 1) * old // (2 * new) for new, old in zip(size, image.shape[1::-1], strict=True)
    )
    return image[rows][:, columns]


def test_a_preview_is_not_refined(viewport: Viewport) -> None:
    viewport.draw(REQUEST)
    viewport.took(1000.0, goal_ms=10.0)
    viewport.draw(turned(REQUEST), held=True)
    assert viewport.is_preview
    assert math.isinf(viewport.refines_at(playing=False))
    assert not viewport.refine()


def test_points_of_a_moving_picture_are_drawn_again_in_the_next(viewport: Viewport) -> None:
    pose = Pose(0, 0.0, "dense", sphere(60_000))
    request = Request(pose, Camera.orbit(pose.cloud.bounds()), "points")
    viewport.draw(request)
    full = shown(viewport)
    viewport.took(10_000.0, goal_ms=10.0)
    known = []
    for step in range(3):
        viewport.draw(replace(request, camera=request.camera.orbited(2 + step, 0)), held=True)
        assert viewport.surface is not None
        assert viewport.surface.stats.share < 1
        assert viewport.is_preview
        known.append(viewport.surface.stats.known)
        viewport.took(1e4 * (step + 1), goal_ms=10.0)  # the next one is of another size, or of fewer points
    assert known == [1.0] * 3, "on from the picture in full"
    viewport.draw(request, held=True)
    viewport.finish()
    for before, after in zip(full, shown(viewport), strict=True):
        np.testing.assert_array_equal(after, before)

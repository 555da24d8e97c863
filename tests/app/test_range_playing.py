"""Range views play, are drawn, pointed at and counted without their points being merged."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import sampling
from range_scenes import sphere_view

from viewer.app.files.opening import find_facts
from viewer.app.playing.playback import Playback
from viewer.app.playing.player import Pace
from viewer.app.scene.counting import Counting, words
from viewer.app.scene.viewport import Viewport
from viewer.app.session import Session
from viewer.backends import Backend
from viewer.camera import Camera
from viewer.drawing.request import Request
from viewer.look import Look
from viewer.scan import formats
from viewer.scan.open import open_scan
from viewer.scan.pose import Pose
from viewer.scan.range_view import merge
from viewer.scan.timeline import Timeline

SIZE = (90, 70)
FRAMES = 6
LATER = 60.0  # seconds


@pytest.fixture
def timeline(tmp_path: Path) -> Iterator[Timeline]:
    """A unit sphere that goes away from two pods."""
    for index in range(FRAMES):
        eyes = np.array([[-1.0, 0, 4 + 0.1 * index], [1.5, 0.5, 4 + 0.1 * index]])
        views = tuple(sphere_view(eye, size=(120, 100), name=f"pod {eye[0]:g}") for eye in eyes)
        formats.write(tmp_path / f"f{index}.exr", merge(views), views)
    with open_scan(tmp_path) as timeline:
        yield timeline


def play(timeline: Timeline, viewport: Viewport, backend: Backend | str) -> list[Pose]:
    """Play all frames as a window does; the poses in the order in which they were shown."""
    playback = Playback(timeline, Session("scan", pace=Pace(every_frame=True)))
    shown: list[Pose] = []
    now, camera = 0.0, None
    while len(shown) < FRAMES:
        playback.advance(now)
        pose = playback.pose
        if pose is None:
            time.sleep(0.001)
            continue
        if not playback.player.playing:
            playback.toggle(now)
        camera = camera or Camera.orbit(viewport.bounds(pose), 15, 10, aspect=SIZE[0] / SIZE[1])
        viewport.draw(Request(pose, camera, backend, look=Look(color_by="view")), playing=True)
        if viewport.request is not None and viewport.request.pose is pose and pose not in shown:
            assert viewport.problem is None
            shown.append(pose)
        now += 0.01
    return shown


@pytest.mark.parametrize("backend", [sampling.BACKEND, "pyramidal"], ids=str)
def test_a_sequence_plays_without_merging(
    timeline: Timeline, viewport: Viewport, backend: Backend | str
) -> None:
    timeline.finish = find_facts
    shown = play(timeline, viewport, backend)
    assert sorted(pose.index for pose in shown) == [*range(FRAMES)]
    while not viewport.is_complete:
        viewport.draw(viewport.request)
    surface = viewport.surface
    assert surface is not None
    picked = viewport.probe.pick((SIZE[0] // 2, SIZE[1] // 2))
    assert picked is not None
    assert picked.id == surface.texel(SIZE[0] // 2, SIZE[1] // 2).row
    at_rest, now = SimpleNamespace(is_moving=False), time.monotonic() + LATER
    counting = Counting(viewport, at_rest)  # type: ignore[arg-type]
    while not counting.advance(now):
        time.sleep(0.001)
    assert counting.counts == surface.point_counts()
    assert counting.counts["in"] == shown[-1].count
    assert [name for name, _ in words(viewport, counting.counts)] == ["Drawn", "Hidden", "Outside"]
    held = [timeline.ready(index) for index in range(FRAMES)]
    assert not any(pose.is_merged for pose in [*shown, *held])


def test_points_of_a_sequence_are_merged_where_it_is_read(timeline: Timeline, viewport: Viewport) -> None:
    timeline.finish = lambda pose: find_facts(pose, of_points=True)
    shown = play(timeline, viewport, "points")
    assert all(pose.is_merged for pose in shown)
    assert viewport.renderer.work.preparing is None
    assert timeline.pose(0).nbytes > timeline.pose(0).cloud.nbytes


def test_choosing_points_has_those_merged_which_were_not(timeline: Timeline, viewport: Viewport) -> None:
    timeline.finish = find_facts
    pose = play(timeline, viewport, sampling.BACKEND)[-1]
    request = Request(pose, Camera.orbit(pose.bounds), "points")
    while viewport.request is not request:
        viewport.draw(request)
    assert pose.is_merged
    assert viewport.surface is not None
    assert viewport.surface.stats.backend == "points"

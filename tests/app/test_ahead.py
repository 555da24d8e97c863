"""Poses are prepared before they are due, those first that are due first and in time."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from scenes import sphere

from viewer.app.playing.ahead import Ahead
from viewer.app.playing.playback import Playback
from viewer.app.playing.player import Pace
from viewer.app.session import Session
from viewer.backends import backend
from viewer.camera import Camera
from viewer.document.document import Document
from viewer.drawing.foresight import Foresight
from viewer.drawing.frame import render_frame
from viewer.drawing.renderer import Renderer
from viewer.drawing.request import Request
from viewer.drawing.work import BackgroundWork
from viewer.picture.surface import Surface
from viewer.rigid import STILL
from viewer.scan.noise import known_noise
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose
from viewer.scan.timeline import Timeline

COUNT, HELD = 12, 5  # frames, and how many of them fit where memory is short
CAMERA = Camera.orbit(sphere(100).bounds())


class Spheres:
    """A source of spheres without normals."""

    name = "spheres"

    def __len__(self) -> int:
        return COUNT

    def label(self, index: int) -> str:
        return f"sphere {index}"

    def load(self, index: int) -> PointCloud:
        return PointCloud.from_arrays(sphere(300 + index).positions)


class NotingWork(BackgroundWork):
    """Work that notes what it is asked for, and takes as long as a test says."""

    def __init__(self, renderer: Renderer) -> None:
        super().__init__(renderer)
        self.asked: list[list[int]] = []
        self.afresh: list[bool] = []
        self.seconds = 0.0

    def prepare_ahead(self, wants: Any, afresh: bool = False) -> None:
        wants = list(wants)
        self.asked.append([want.pose.index for want in wants])
        self.afresh.append(afresh)
        super().prepare_ahead(wants, afresh)

    @property
    def latency(self) -> float:
        return self.seconds


class Noting(Renderer):
    """A renderer that notes what it is asked for, and takes as long as a test says."""

    def __init__(self, gpu: Any) -> None:
        super().__init__(gpu)
        self.work: NotingWork = NotingWork(self)


@pytest.fixture
def renderer(renderer: Renderer) -> Iterator[Noting]:
    own = Noting(renderer.gpu)
    yield own
    own.release()


@pytest.fixture
def start(renderer: Noting) -> Iterator[Callable[..., tuple[Playback, Ahead]]]:
    opened: list[Playback] = []

    def start(backend: str = "surfels", **pace: Any) -> tuple[Playback, Ahead]:
        timeline = Timeline(Spheres(), np.arange(COUNT) / 10)
        session = Session("scan", Document(backend=backend, camera=CAMERA), Pace(**pace))
        playback = Playback(timeline, session)
        ahead = Ahead(session, playback, renderer)
        opened.append(playback)
        timeline.prefetch(0)
        until(lambda: sum(map(len, timeline.cached())) == COUNT)
        playback.advance(0.0)
        return playback, ahead

    yield start
    for playback in opened:
        playback.close()


def until(condition: Callable[[], object]) -> None:
    """Wait for workers; a minute without it is a failure."""
    deadline = time.monotonic() + 60
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.002)


def test_frames_are_asked_for_as_they_are_due_and_none_at_rest(renderer: Noting, start: Callable) -> None:
    playback, ahead = start()
    ahead.advance(0.0)
    assert set(renderer.work.asked[-1]) == {0}, "at rest the one that is shown"
    playback.toggle(0.0)
    ahead.advance(0.0)
    assert list(dict.fromkeys(renderer.work.asked[-1])) == [*range(COUNT)]
    playback.change(0.0, reverse=True)
    ahead.advance(0.0)
    assert list(dict.fromkeys(renderer.work.asked[-1])) == [0, *reversed(range(1, COUNT))]
    playback.change(0.0, reverse=False, loop=False)
    playback.seek(9, 0.0)
    ahead.advance(0.0)
    assert [index for index in renderer.work.asked[-1] if index] == [9, 10, 11]


def test_noise_is_estimated_ahead_of_the_playhead(start: Callable) -> None:
    """While a frame is shown, Scan4D finds what pictures of the next ones read, and draws none of them."""
    playback, ahead = start()
    clouds = [playback.timeline.pose(index).cloud for index in range(COUNT)]

    def is_known(index: int) -> bool:
        ahead.advance(0.0)
        return known_noise(clouds[index]) is not None

    until(lambda: is_known(0))
    assert all(known_noise(cloud) is None for cloud in clouds[1:]), "at rest the one that is shown"
    playback.toggle(0.0)
    for index in range(COUNT):
        until(lambda index=index: is_known(index))


def test_facts_are_found_once_for_each_cloud_and_its_parameters(start: Callable) -> None:
    playback, _ = start()
    pose = playback.timeline.pose(3)
    foresight = Foresight()
    asked: list[object] = []

    class Asked(type(backend("surfels"))):  # type: ignore[misc]
        """Surfels that note what is asked of them."""

        def foresee(self, cloud: PointCloud, params: Any) -> None:
            asked.append(params)

    noting = Asked("surfels")
    requests = [
        Request(pose, CAMERA, noting, noting.params({"surface": surface})) for surface in ("local", "nearest")
    ]

    def is_done() -> bool:
        foresight.begin(requests)
        return len(asked) == 2

    until(is_done)
    foresight.begin(requests)
    assert asked == [request.params for request in requests]


def test_what_would_be_late_comes_last_but_for_every_frame(renderer: Noting, start: Callable) -> None:
    playback, ahead = start()
    renderer.work.seconds = 0.25
    playback.toggle(0.0)
    ahead.advance(0.0)
    shown, *asked = renderer.work.asked[-1]
    assert shown == 0
    assert asked == [*range(3, COUNT), 2, 1, 0]
    playback.change(0.0, every_frame=True)
    ahead.advance(0.0)
    assert renderer.work.asked[-1][1:] == [*range(COUNT)]


def test_jumps_and_other_ways_of_drawing_are_told(renderer: Noting, start: Callable) -> None:
    playback, ahead = start()

    def is_afresh() -> bool:
        ahead.advance(0.0)
        return renderer.work.afresh[-1]

    assert is_afresh()
    playback.toggle(0.0)
    assert not is_afresh()
    playback.advance(0.11)
    assert not is_afresh(), "it plays on"
    playback.seek(8, 0.2)
    assert is_afresh()
    assert not is_afresh()
    playback.session.change("Choose", backend="voxels")
    assert is_afresh()
    assert not is_afresh()
    playback.session.change("Turn", camera=CAMERA.orbited(10, 0))
    assert not is_afresh(), "nothing that is prepared goes by the camera"


@pytest.mark.parametrize("backend", ["surfels", pytest.param("voxels", marks=pytest.mark.slow)])
@pytest.mark.slow
def test_a_second_lap_needs_no_work(renderer: Noting, start: Callable, backend: str) -> None:
    playback, ahead = start(backend)
    playback.toggle(0.0)
    until(lambda: (ahead.advance(0.0), ahead.ready == COUNT - 1 and renderer.work.unfinished == 0)[1])
    shown = []
    for frame in range(1, 2 * COUNT):
        now = frame / 10 + 0.01
        ahead.advance(0.0)
        assert renderer.work.unfinished == 0
        playback.advance(now)
        assert playback.pose is not None
        shown.append(playback.pose.index)
    assert shown == [frame % COUNT for frame in range(1, 2 * COUNT)]
    assert playback.dropped == 0


def test_a_frame_that_is_not_prepared_leaves_the_one_before_and_counts_as_dropped(
    renderer: Noting, start: Callable
) -> None:
    playback, ahead = start()
    playback.toggle(0.0)
    for frame in range(1, 5):
        playback.advance(frame / 10 + 0.01)  # nobody has anything prepared
        assert playback.pose.index == 0
        assert playback.waiting
    assert playback.dropped == 3, "the one that is due may still come"
    timeline, session = playback.timeline, playback.session
    third = session.document.request(timeline.ready(3))

    def third_is_there() -> bool:
        renderer.work.prepare_ahead([third])
        return ahead.is_prepared(third.pose)

    until(third_is_there)
    playback.advance(0.45)
    assert playback.pose.index == 3, "the latest one that is there"
    playback.advance(0.55)
    assert playback.pose.index == 3


@pytest.mark.slow
def test_every_frame_waits_until_it_is_prepared(renderer: Noting, start: Callable) -> None:
    playback, ahead = start(every_frame=True)
    playback.toggle(0.0)
    shown, now = [0], 0.0
    deadline = time.monotonic() + 60
    while len(shown) < 2 * COUNT:
        assert time.monotonic() < deadline
        now += 0.01
        ahead.advance(0.0)
        playback.advance(now)
        if playback.pose.index != shown[-1]:
            shown.append(playback.pose.index)
        time.sleep(0.001)
    assert shown == [frame % COUNT for frame in range(2 * COUNT)]
    assert playback.dropped == 0


@pytest.mark.slow
def test_a_scan_is_shown_before_anything_is_prepared(renderer: Noting, start: Callable) -> None:
    playback, ahead = start("voxels")
    assert playback.pose is not None
    assert not ahead.is_prepared(playback.pose)
    playback.seek(5, 0.0)
    playback.advance(0.1)
    assert playback.pose.index == 0, "the picture before stays"
    until(lambda: (ahead.advance(0.0), playback.advance(0.2), playback.pose.index == 5)[2])


def test_layers_are_found_for_no_other_pose_than_the_one_that_is_shown(
    renderer: Noting, start: Callable
) -> None:
    playback, ahead = start()
    laid, looked = playback.session.laid, []

    def numbers(pose: Pose) -> dict[str, np.ndarray]:
        looked.append(pose.index)
        return {"height": np.zeros(pose.count)}

    laid.lay("tool", numbers, lambda index: STILL)
    shown = laid.layers(playback.pose)
    playback.toggle(0.0)
    ahead.advance(0.0)
    assert ahead.ready >= 0
    assert looked == [0]
    assert laid.layers(playback.pose) is shown


def test_nothing_is_asked_for_before_there_is_a_camera(renderer: Noting, start: Callable) -> None:
    playback, ahead = start()
    playback.session.amend(camera=None)
    playback.toggle(0.0)
    ahead.advance(0.0)
    assert renderer.work.asked[-1] == []
    assert ahead.is_prepared(playback.pose)


@pytest.mark.parametrize("reverse", [False, True], ids=["forwards", "backwards"])
def test_a_loop_beyond_the_budget_uploads_a_part_of_the_poses_each_lap(
    renderer: Noting, start: Callable, reverse: bool
) -> None:
    """The poses that fit stay from lap to lap, and pictures are the same to the bit."""
    playback, ahead = start("points", reverse=reverse)
    surface = Surface(renderer.gpu, (64, 48))
    pictures: dict[int, bytes] = {}
    playback.toggle(0.0)
    laps = []
    for lap in range(3):
        uploads = 0
        for frame in range(lap * COUNT, (lap + 1) * COUNT):
            playback.advance(frame / 10 + 0.01)
            ahead.advance(0.0)
            pose = playback.pose
            assert pose is not None
            render_frame(renderer, playback.session.document.request(pose), surface)
            renderer.budget_bytes = renderer.budget_bytes if frame else HELD * renderer.held_bytes
            uploads += surface.stats.uploaded_bytes > 0
            picture = surface.image().tobytes()
            assert pictures.setdefault(pose.index, picture) == picture
            assert renderer.held_bytes <= renderer.budget_bytes + renderer.bytes_of(pose)
        laps.append(uploads)
    surface.release()
    assert len(pictures) == COUNT
    assert laps[0] == COUNT
    assert max(laps[1:]) <= COUNT - HELD + 1

"""What pictures will need is made by workers before: bounded, in order, and dropped when it is not needed."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
import pytest
from scenes import sphere

from viewer.backends import Backend, Derives, FrameView, backends
from viewer.backends import backend as find_backend
from viewer.camera import Camera
from viewer.drawing.frame import render_frame
from viewer.drawing.plan import Effort, Waiting, make_plan
from viewer.drawing.renderer import Renderer
from viewer.drawing.request import Request
from viewer.errors import InputError
from viewer.gpu.context import Gpu
from viewer.gpu.pose import GpuPose
from viewer.params import param
from viewer.picture.surface import Surface
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose
from viewer.task import Task, checkpoint, in_background
from viewer.testing.backends import draws_points
from viewer.view import View

BYTES = 12_000  # of what is derived of a pose
BARE = PointCloud.from_arrays(sphere(1500).positions)
CAMERA = Camera.orbit(BARE.bounds())


@dataclass(frozen=True)
class _Params:
    step: int = param(1, "Every how many points", low=1, affects="derive")


class _Uploaded:
    def __init__(self, arrays: tuple[np.ndarray, int]) -> None:
        self.array, self.process = arrays
        self.nbytes = self.array.nbytes

    def release(self) -> None:
        pass


def every_nth(pose: Pose, params: _Params, view: View | None = None) -> tuple[np.ndarray, int]:
    """Every n-th position, and the process that looked for them."""
    return pose.cloud.positions[:: params.step], os.getpid()


def slowly(pose: Pose, params: _Params, view: View | None = None) -> tuple[np.ndarray, int]:
    """Tells its process and takes longer than a test waits, but for those of an odd frame."""
    checkpoint(float(os.getpid()))
    while pose.index % 2 == 0:
        checkpoint()
        time.sleep(0.01)
    return every_nth(pose, params)


def failing(pose: Pose, params: _Params, view: View | None = None) -> None:
    """Fails."""
    raise InputError("is no good", pose.label)


class Deriving(Backend):
    """Derives what a test says, and draws nothing."""

    title = "Deriving"
    params_class = _Params

    def upload(self, gpu: Gpu, arrays: tuple[np.ndarray, int]) -> _Uploaded:
        return _Uploaded(arrays)

    def draw(self, pose: GpuPose, frame: FrameView, surface: Surface) -> bool:
        raise NotImplementedError


def deriving(derive: Callable, on_thread: bool = True) -> Backend:
    backend = Deriving("deriving")
    backend.derive = derive  # type: ignore[method-assign]
    backend.derives = Derives.ON_THREAD if on_thread else Derives.IN_PROCESS
    return backend


def want(pose: Pose, backend: Backend, **params: int) -> Request:
    return Request(pose, CAMERA, backend, backend.params(params))


def is_prepared(own: Renderer, request: Request) -> bool:
    """Whether nothing is missing but what depends on the view, or drawing reports an error."""
    return not isinstance(make_plan(own, request, None, Effort.NONE), Waiting)


@pytest.fixture
def own(renderer: Renderer) -> Iterator[Renderer]:
    own = Renderer(renderer.gpu)
    yield own
    own.release()


@pytest.fixture
def poses() -> list[Pose]:
    return [Pose(number, float(number), f"frame {number}", sphere(1000)) for number in range(20)]


def prepare_all(own: Renderer, wants: list[Request], goal: Callable[[], bool], afresh: bool = False) -> None:
    """As a window does, until something has come about."""
    deadline = time.monotonic() + 60
    own.work.prepare_ahead(wants, afresh)
    while not goal():
        assert time.monotonic() < deadline
        time.sleep(0.002)
        own.work.prepare_ahead(wants)


def test_poses_are_prepared_a_few_at_a_time_and_kept(own: Renderer, poses: list[Pose]) -> None:
    backend, most = deriving(every_nth), 0
    wants = [want(pose, backend) for pose in poses]

    def all_there() -> bool:
        nonlocal most
        most = max(most, own.work.unfinished)
        return all(is_prepared(own, one) for one in wants)

    prepare_all(own, wants, all_there)
    assert 1 <= most <= 3 * (os.cpu_count() or 1)
    assert own.work.unfinished == 0
    assert own.nbytes == len(poses) * BYTES
    own.work.prepare_ahead([])
    assert all(is_prepared(own, one) for one in wants), "they are kept though nobody wants them now"
    assert own.work.latency > 0


@pytest.mark.slow
def test_estimates_come_first_and_what_is_derived_goes_by_them(own: Renderer) -> None:
    voxels, pose = find_backend("voxels"), Pose(0, 0.0, "x", BARE)
    wanted = want(pose, voxels)
    prepare_all(own, [wanted], lambda: is_prepared(own, wanted))
    assert is_prepared(own, want(pose, find_backend("surfels"), radius="uniform"))  # type: ignore[arg-type]
    assert pose.cloud.normals is None, "the scan itself is left as it was"
    assert own.resident(pose).cloud.normals is not None


def test_what_waits_is_dropped_when_other_poses_are_wanted(own: Renderer, poses: list[Pose]) -> None:
    backend = deriving(slowly)
    slow, quick = ([want(pose, backend) for pose in poses if pose.index % 2 == odd] for odd in (0, 1))
    own.work.prepare_ahead(slow)
    assert own.work.unfinished > 1
    prepare_all(own, quick[:1], lambda: is_prepared(own, quick[0]), afresh=True)
    assert not any(is_prepared(own, one) for one in slow)


@pytest.mark.slow
def test_work_in_processes_is_ended_where_it_keeps_others_waiting(own: Renderer, poses: list[Pose]) -> None:
    backend = deriving(slowly, on_thread=False)
    slow, quick = ([want(pose, backend) for pose in poses if pose.index % 2 == odd] for odd in (0, 1))
    prepare_all(own, slow, lambda: own.work.preparing is not None and own.work.preparing.progress is not None)
    process = own.work.preparing.progress if own.work.preparing else None
    assert process is not None
    prepare_all(own, quick[:4], lambda: all(is_prepared(own, one) for one in quick[:4]), afresh=True)
    assert not any(is_prepared(own, one) for one in slow)


def test_what_a_worker_is_at_is_let_finish_while_playing_goes_on(own: Renderer, poses: list[Pose]) -> None:
    began: list[int] = []

    def derive(pose: Pose, params: _Params, view: View | None = None) -> tuple[np.ndarray, int]:
        began.append(pose.index)
        time.sleep(0.6)
        return every_nth(pose, params)

    backend = deriving(derive)
    first, *later = (want(pose, backend) for pose in poses[:6])
    prepare_all(own, [first], lambda: bool(began))
    prepare_all(own, later, lambda: is_prepared(own, first))
    assert began.count(0) == 1


def test_the_budget_holds_what_is_drawn_soonest(own: Renderer, poses: list[Pose]) -> None:
    backend = deriving(every_nth)
    own.budget_bytes = 5 * BYTES
    wants = [want(pose, backend) for pose in poses]

    def step_to(playhead: int) -> list[int]:
        own.steps_to = lambda pose: (pose.index - playhead) % len(poses)
        ahead = wants[playhead:] + wants[:playhead]
        prepare_all(own, ahead, lambda: is_prepared(own, ahead[3]) and own.work.unfinished == 0)
        assert own.held_bytes <= own.budget_bytes
        return [number for number, one in enumerate(wants) if is_prepared(own, one)]

    assert step_to(0) == [0, 1, 2, 3, 4]
    assert step_to(3) == [3, 4, 5, 6, 7]
    assert step_to(18) == [0, 1, 2, 18, 19]


def test_a_failure_is_told_when_it_is_drawn_and_holds_up_nothing(own: Renderer, poses: list[Pose]) -> None:
    one, other = (want(pose, deriving(failing)) for pose in poses[:2])
    prepare_all(own, [one, other], lambda: is_prepared(own, one) and is_prepared(own, other))
    good = want(poses[2], deriving(every_nth))
    prepare_all(own, [one, good], lambda: is_prepared(own, good))
    with pytest.raises(InputError, match="frame 0: is no good"):
        raise make_plan(own, one, None, Effort.BEGIN).error  # type: ignore[union-attr]


def test_an_upload_that_fails_is_tried_once_and_told_when_it_is_drawn(
    own: Renderer, poses: list[Pose]
) -> None:
    tried: list[int] = []

    def upload(gpu: object, arrays: tuple[np.ndarray, int]) -> None:
        tried.append(len(arrays[0]))
        raise InputError("does not fit")

    backend = deriving(every_nth)
    backend.upload = upload  # type: ignore[method-assign,assignment]
    bad, good = want(poses[0], backend), want(poses[1], deriving(every_nth))
    prepare_all(own, [bad, good], lambda: is_prepared(own, bad) and is_prepared(own, good))
    own.work.prepare_ahead([bad])
    assert len(tried) == 1
    with pytest.raises(InputError, match="does not fit"):
        raise make_plan(own, bad, None, Effort.BEGIN).error  # type: ignore[union-attr]


def test_what_cannot_be_drawn_is_passed_over(own: Renderer, poses: list[Pose]) -> None:
    refused = Request(poses[0], CAMERA, "laplacian")
    good = want(poses[1], deriving(every_nth))
    prepare_all(own, [refused, good], lambda: is_prepared(own, good))
    assert is_prepared(own, refused), "drawing it tells why"


def test_the_last_few_ways_of_drawing_a_pose_are_kept(own: Renderer, poses: list[Pose]) -> None:
    backend = deriving(every_nth)
    ways = [want(poses[0], backend, step=step) for step in range(1, 8)]
    for way in ways:
        prepare_all(own, [way], lambda way=way: is_prepared(own, way))  # type: ignore[misc]
    assert [is_prepared(own, way) for way in ways] == [False] * 3 + [True] * 4


def test_releasing_ends_all_processes_at_work(renderer: Renderer, poses: list[Pose]) -> None:
    own = Renderer(renderer.gpu)
    slow = [want(pose, deriving(slowly, on_thread=False)) for pose in poses if pose.index % 2 == 0]
    own.work.prepare_ahead(slow)
    tasks = [job.task for job in own.work._unfinished]
    while own.work.preparing is None or own.work.preparing.progress is None:
        time.sleep(0.002)
    own.release()
    for process in {int(task.progress) for task in tasks if task.progress}:
        with pytest.raises(ProcessLookupError):
            os.kill(process, 0)


@pytest.mark.parametrize("name", [name for name, one in backends().items() if draws_points(one)])
@pytest.mark.parametrize("lacks", [(), ("radii",), ("radii", "normals")], ids=["nothing", "radii", "normals"])
def test_a_prepared_picture_looks_at_no_point_again(own: Renderer, name: str, lacks: tuple[str, ...]) -> None:
    """What a picture reads of all points is found before; the picture is the same to the bit."""
    lacking: dict[str, None] = dict.fromkeys(lacks)
    given = sphere(3000)
    given = PointCloud.from_arrays(
        given.positions,
        normals=given.positions,
        radii=np.full(len(given), 0.05),
        colors=given.positions * 0.5 + 0.5,
        origin=given.origin,
    )
    plain, prepared = (
        Request(Pose(number, 0.0, "x", cloud), CAMERA, find_backend(name))
        for number, cloud in enumerate(replace(given, **lacking) for _ in range(2))  # type: ignore[arg-type]
    )
    own.work.prepare(prepared)
    cloud = prepared.pose.cloud
    facts, is_there = set(cloud._facts), is_prepared(own, prepared)
    pictures = []
    for request in (plain, prepared):
        surface = Surface(own.gpu, (64, 48))
        while render_frame(own, request, surface):
            pass
        pictures.append((surface.image().tobytes(), surface.id.tobytes(), surface.depth.tobytes()))
        surface.release()
    assert pictures[0] == pictures[1]
    assert is_there
    assert set(cloud._facts) == facts


def test_a_fact_that_two_threads_ask_for_is_found_once() -> None:
    cloud, is_asked, calls = sphere(100), threading.Event(), []

    def slowly_found(cloud: PointCloud) -> int:
        calls.append(len(cloud))
        assert is_asked.wait(60)
        return len(cloud)

    first = in_background(Task("first"), lambda: cloud.remember(slowly_found))
    while not calls:
        time.sleep(0.001)
    second = in_background(Task("second"), lambda: cloud.remember(slowly_found))
    is_asked.set()
    assert first.result(60) == second.result(60) == 100
    assert calls == [100]

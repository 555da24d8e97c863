from __future__ import annotations

import os
import time
from dataclasses import dataclass, replace

import numpy as np
import pytest
from scenes import NOTHING, sphere

import viewer
from viewer.backends import CHANGES, Backend, Derives, FrameView, backends
from viewer.backends import backend as find_backend
from viewer.camera import Camera
from viewer.drawing.frame import render_frame
from viewer.drawing.jobs import Stage
from viewer.drawing.plan import Effort, Ready, Waiting, make_plan
from viewer.drawing.renderer import Renderer
from viewer.drawing.request import Request, backend_for, fallback, view_of
from viewer.errors import InputError
from viewer.gpu.context import Gpu
from viewer.gpu.pose import GpuPose
from viewer.look import Look
from viewer.params import param
from viewer.picture.surface import Surface
from viewer.scan.layers import Layers
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose
from viewer.task import checkpoint
from viewer.testing.backends import draws_points
from viewer.view import View

SIZE = (64, 48)
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
    with pytest.raises(
        InputError, match=r"unknown parameter of 'points' 'radius'. Known: hide_hidden, point_size"
    ):
        viewer.render(sphere(10), backend="points", radius=2)


def test_the_default_follows_what_the_scan_stores() -> None:
    assert backend_for(_of(sphere(10)))[0] == "surfels"
    assert backend_for(_of(BARE))[0] == "auto_splats"
    assert backend_for(_of(BARE), "points")[1].point_size == 1
    assert backend_for(_of(BARE), None, {"k": "12"})[1].k == 12
    assert viewer.render(sphere(10), size=(8, 8)).stats.backend == "surfels"
    assert viewer.render(BARE, size=(8, 8)).stats.backend == "auto_splats"


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
    assert surface.stats.skipped == {
        "surfels": "Scan4D is still preparing data for this picture",
        **_points_skips(surface),
    }
    while render_frame(own, request, surface, wait=False):
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
    def __init__(self, arrays: tuple[np.ndarray, int]) -> None:
        self.array, self.process = arrays
        self.nbytes, self.released = self.array.nbytes, False

    def release(self) -> None:
        self.released = True


def every_nth(pose: Pose, params: _Params) -> tuple[np.ndarray, int]:
    """Every n-th position, and the process that looked for them."""
    return pose.cloud.positions[:: params.step], os.getpid()


def _of(cloud: PointCloud) -> Pose:
    return Pose(0, 0.0, "x", cloud)


def asked(pose: Pose, backend: Backend, azimuth: float = 0.0, **params: int) -> Request:
    return Request(pose, Camera.orbit(BARE.bounds(), azimuth), backend, _Params(**params))


def derived_of(own: Renderer, request: Request, effort: Effort = Effort.WAIT) -> _Uploaded | None:
    """What was derived for a picture; None while it is not there."""
    planned = make_plan(own, request, SIZE, effort)
    assert isinstance(planned, Ready | Waiting)
    return planned.derived if isinstance(planned, Ready) else None  # type: ignore[return-value]


def is_ready(own: Renderer, request: Request, size: tuple[int, int] = SIZE) -> bool:
    return isinstance(make_plan(own, request, size, Effort.NONE), Ready)


class Deriving(Backend):
    """Derives every n-th position, and draws nothing."""

    title = "Deriving"
    params_class = _Params
    derives = Derives.IN_PROCESS

    def derive(self, pose: Pose, params: _Params, view: View | None) -> tuple[np.ndarray, int]:
        return every_nth(pose, params)

    def upload(self, gpu: Gpu, arrays: tuple[np.ndarray, int]) -> _Uploaded:
        return _Uploaded(arrays)

    def draw(self, pose: GpuPose, frame: FrameView, surface: Surface) -> bool:
        raise NotImplementedError


@pytest.fixture
def deriving() -> Backend:
    """A backend that derives every n-th position."""
    return Deriving("deriving")


def test_a_pose_at_another_time_keeps_what_was_made_of_it(renderer: Renderer, deriving: Backend) -> None:
    own, poses = Renderer(renderer.gpu), [Pose(0, 0.0, "x", sphere(1000))]
    first = derived_of(own, asked(poses[0], deriving))
    poses[0] = poses[0].at(2.0)
    own.resident(Pose(1, 0.0, "y", sphere(10)))
    again = derived_of(own, asked(poses[0], deriving))
    assert again is first
    del poses[0]
    own.resident(Pose(1, 0.0, "y", sphere(10)))
    assert own.nbytes < first.nbytes, "it goes with the pose"
    own.release()


def test_derived_data_is_made_once_counted_and_evicted(renderer: Renderer, deriving: Backend) -> None:
    own = Renderer(renderer.gpu, budget_bytes=1)
    pose = Pose(0, 0.0, "x", sphere(1000))
    first = derived_of(own, asked(pose, deriving))
    assert first is not None
    drawn_alike = derived_of(own, asked(pose, deriving, shade=5))
    assert drawn_alike is first
    other = derived_of(own, asked(pose, deriving, step=5))
    assert other is not None
    assert first.process == other.process == os.getpid()
    assert own.nbytes == first.nbytes + other.nbytes == 12 * (500 + 200)
    own.resident(replace(pose, index=1))
    assert own.nbytes == 0
    assert first.released
    own.release()


def nearer_half(pose: Pose, params: _Params, view: View) -> tuple[np.ndarray, int]:
    """The positions of the half that is nearer to the eye."""
    depths = view.depths(pose.cloud.positions)
    return pose.cloud.positions[depths <= np.median(depths)], os.getpid()


def test_what_is_derived_by_camera_is_kept_for_the_last_views(renderer: Renderer, deriving: Backend) -> None:
    deriving.derived_by_camera = True
    deriving.derive = nearer_half  # type: ignore[method-assign]
    own, pose = Renderer(renderer.gpu), _of(sphere(1000))
    azimuths = range(0, 60, 10)

    def derived(azimuth: float, **params: int) -> _Uploaded:
        found = derived_of(own, asked(pose, deriving, azimuth, **params))
        assert isinstance(found, _Uploaded)
        return found

    first = [derived(azimuth) for azimuth in azimuths[:4]]
    assert len({one.array.tobytes() for one in first}) == 4
    assert derived(0) is first[0], "an equal view"
    assert own.nbytes == 4 * 12 * 500
    assert is_ready(own, asked(pose, deriving, azimuths[1]))
    assert not is_ready(own, asked(pose, deriving), size=(65, 48))
    derived(azimuths[4])
    assert [one.released for one in first] == [False, True, False, False], "the one that was used longest ago"
    other = derived(0, step=5)
    assert not any(one.released for one in (first[0], other)), "others are kept for other parameters"
    assert own.nbytes == 5 * 12 * 500
    own.release()
    assert first[0].released


class _Told(Backend):
    """Keeps what each call was told, and draws nothing."""

    params_class = _Params

    def __init__(self) -> None:
        super().__init__("told")
        self.frames: list[FrameView] = []

    def draw(self, pose: GpuPose, frame: FrameView, surface: Surface) -> bool:
        self.frames.append(frame)
        surface.clear()
        return False


def test_jobs_of_views_that_were_passed_are_dropped(renderer: Renderer, deriving: Backend) -> None:
    deriving.derived_by_camera = True
    deriving.derive = nearer_half  # type: ignore[method-assign]
    own, pose = Renderer(renderer.gpu), _of(sphere(1000))
    entry = own.draw(pose)
    for azimuth in range(6):
        assert derived_of(own, asked(pose, deriving, azimuth), Effort.BEGIN) is None
        while own.work.preparing is not None:
            time.sleep(0.001)
        assert len(entry.jobs) == 1, "what is found for views that nobody looks at any more is not held"
    last = derived_of(own, asked(pose, deriving, 5), Effort.BEGIN)
    assert last is not None
    assert not entry.jobs
    own.release()


def test_a_job_of_a_view_that_was_passed_is_cancelled(renderer: Renderer, deriving: Backend) -> None:
    began: list[View] = []

    def derive(pose: Pose, params: _Params, view: View) -> tuple[np.ndarray, int]:
        began.append(view)
        while len(began) == 1:
            checkpoint()
            time.sleep(0.001)
        return nearer_half(pose, params, view)

    deriving.derived_by_camera = True
    deriving.derives = Derives.ON_THREAD
    deriving.derive = derive  # type: ignore[method-assign]
    own, pose = Renderer(renderer.gpu), _of(sphere(1000))
    assert derived_of(own, asked(pose, deriving, 0), Effort.BEGIN) is None
    deadline = time.monotonic() + 20
    while derived_of(own, asked(pose, deriving, 1), Effort.BEGIN) is None:
        assert time.monotonic() < deadline
        time.sleep(0.001)
    keys = [view_of(asked(pose, deriving, azimuth), SIZE).key for azimuth in (0, 1)]
    assert [view.key for view in began] == keys
    own.release()


def test_a_backend_is_told_what_changed_and_whether_more_will_follow(renderer: Renderer) -> None:
    told, surface = _Told(), Surface(renderer.gpu, SIZE)
    first = Request(_of(BARE), Camera.orbit(BARE.bounds()), told, _Params())
    turned = replace(first, camera=Camera.orbit(BARE.bounds(), 10))
    changed = replace(turned, params=_Params(shade=3))
    another = replace(changed, pose=_of(BARE))
    for request in (first, first, turned, changed, another, replace(another, look=Look(color_by="depth"))):
        render_frame(renderer, request, surface)
    render_frame(renderer, first, surface, moving=True)
    render_frame(renderer, first, Surface(renderer.gpu, (65, 48)))
    every = {"pose", "camera", "parameters", "size", "values"}
    expected = [every, set(), {"camera"}, {"parameters"}, {"pose"}, {"values"}, every - {"size"}, every]
    assert [set(frame.changed) for frame in told.frames] == expected
    assert [frame.moving for frame in told.frames] == [False] * 6 + [True, False]


def test_a_backend_is_told_of_other_numbers_and_after_a_failure_of_everything(renderer: Renderer) -> None:
    class Failing(_Told):
        def draw(self, pose: GpuPose, frame: FrameView, surface: Surface) -> bool:
            if frame.params.shade == 13:
                raise InputError("thirteen")
            return super().draw(pose, frame, surface)

    told = Failing()
    first = Request(_of(BARE), Camera.orbit(BARE.bounds()), told, _Params())
    surface = Surface(renderer.gpu, SIZE)
    numbers = [np.arange(len(BARE)), np.arange(len(BARE))]
    layered = [
        replace(first, look=Look(color_by="n"), layers=Layers({"n": numbers[i], "other": numbers[j]}))
        for i, j in ((0, 0), (0, 1), (1, 1))
    ]
    height = replace(first, look=Look(color_by="height"))
    others = [replace(first, look=Look(plain="#123456", eye_dome_strength=strength)) for strength in (1, 2)]
    for request in (first, *layered, height, replace(height, look=Look(color_by="height", up="+z")), *others):
        render_frame(renderer, request, surface)
    expected = [{"values"}, set(), {"values"}, {"values"}, {"values"}, {"values"}, set()]
    assert [set(frame.changed) for frame in told.frames[1:]] == expected
    with pytest.raises(InputError, match="thirteen"):
        render_frame(renderer, replace(others[1], params=_Params(shade=13)), surface)
    render_frame(renderer, others[1], surface)
    render_frame(renderer, others[1], surface)
    assert [set(frame.changed) for frame in told.frames[-2:]] == [{*CHANGES}, set()]


def test_a_backend_of_range_views_is_refused_for_points(renderer: Renderer) -> None:
    class Ranging(_Told):
        title = "Ranging"

        def needs(self, pose: Pose, params: _Params) -> tuple[str, ...]:
            return ("views",)

    request = Request(_of(BARE), Camera.orbit(BARE.bounds()), Ranging())
    with pytest.raises(InputError, match="Ranging draws only range views, but this scan has none"):
        render_frame(renderer, request, Surface(renderer.gpu, SIZE))


@pytest.mark.slow
def test_what_nobody_waits_for_is_prepared_in_another_process_and_can_be_cancelled(
    renderer: Renderer, deriving: Backend
) -> None:
    own = Renderer(renderer.gpu)
    pose = Pose(0, 0.0, "x", sphere(1000))
    assert not is_ready(own, asked(pose, deriving))
    assert derived_of(own, asked(pose, deriving), Effort.BEGIN) is None
    task = own.work.preparing
    assert task is not None
    assert task.name == "Preparing Deriving"
    task.cancel()
    assert own.work.preparing is None
    while (prepared := derived_of(own, asked(pose, deriving), Effort.BEGIN)) is None:
        assert own.work.preparing is not task, "what was cancelled begins anew"
        time.sleep(0.001)
    assert prepared.process != os.getpid()
    np.testing.assert_array_equal(prepared.array, pose.cloud.positions[::2])
    assert is_ready(own, asked(pose, deriving))
    assert own.work.preparing is None
    own.release()


def test_what_a_thread_does_is_prepared_there_and_may_be_done_in_time(
    renderer: Renderer, deriving: Backend
) -> None:
    deriving.derives = Derives.ON_THREAD
    own = Renderer(renderer.gpu)
    pose = Pose(0, 0.0, "x", sphere(1000))
    prepared = derived_of(own, asked(pose, deriving), Effort.BEGIN)
    while prepared is None:  # a busy machine
        prepared = derived_of(own, asked(pose, deriving), Effort.BEGIN)
    assert prepared.process == os.getpid()
    assert is_ready(own, asked(pose, deriving))
    own.release()


def test_work_on_a_thread_can_be_cancelled(renderer: Renderer, deriving: Backend) -> None:
    def until_told(pose: Pose, params: _Params, view: View | None) -> None:
        while True:
            checkpoint(0.5)

    deriving.derives = Derives.ON_THREAD
    deriving.derive = until_told  # type: ignore[method-assign]
    own = Renderer(renderer.gpu)
    pose = Pose(0, 0.0, "x", sphere(1000))
    assert derived_of(own, asked(pose, deriving), Effort.BEGIN) is None
    task = own.work.preparing
    assert task is not None
    task.cancel()
    own.release()  # waits for the thread


def for_ever(pose: Pose, params: _Params, view: View | None) -> None:
    """Says which process it is by its progress, and never ends."""
    checkpoint(float(os.getpid()))
    while True:
        time.sleep(1)


def test_releasing_ends_what_is_being_prepared(renderer: Renderer, deriving: Backend) -> None:
    own = Renderer(renderer.gpu)
    deriving.derive = for_ever  # type: ignore[method-assign]
    pose = Pose(0, 0.0, "x", sphere(1000))
    derived_of(own, asked(pose, deriving), Effort.BEGIN)
    task = own.work.preparing
    assert task is not None
    while task.progress is None:
        time.sleep(0.001)
    own.release()
    assert task.cancelled
    with pytest.raises(ProcessLookupError):
        os.kill(int(task.progress), 0)


def test_large_arrays_are_uploaded_in_slices(renderer: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(renderer.gpu.staging, "slice", 1 << 22)
    points = np.random.default_rng(0).random((1_000_000, 3), dtype=np.float32)
    pose = GpuPose(renderer.gpu, Pose(0, 0.0, "x", PointCloud.from_arrays(points, colors=points)))
    calls = 1
    while not pose.upload(["positions", "colors"], budget_ms=0):
        calls += 1
    assert calls == 3, "4 MiB a slice"
    assert pose.uploaded_bytes == 16_000_000
    uploaded = np.frombuffer(pose.array("positions").buffer.read(), np.float32).reshape(-1, 3)
    np.testing.assert_array_equal(uploaded, pose.cloud.positions)
    assert pose.upload(["positions"], budget_ms=0)
    assert pose.uploaded_bytes == 16_000_000


def test_an_upload_that_has_begun_is_finished_when_something_reads_it(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(renderer.gpu.staging, "slice", 1 << 22)
    points = np.random.default_rng(0).random((1_000_000, 3), dtype=np.float32)
    pose = GpuPose(renderer.gpu, Pose(0, 0.0, "x", PointCloud.from_arrays(points)))
    assert not pose.upload(["positions"], budget_ms=0)
    uploaded = np.frombuffer(pose.array("positions").buffer.read(), np.float32).reshape(-1, 3)
    np.testing.assert_array_equal(uploaded, pose.cloud.positions)


@pytest.mark.parametrize("name", [name for name, one in backends().items() if draws_points(one)])
@pytest.mark.parametrize("look", [Look(), Look(light="flat"), Look(color_by="id"), Look(color_by="normal")])
def test_a_picture_uploads_no_array_of_points_when_it_is_drawn(
    renderer: Renderer, name: str, look: Look
) -> None:
    """Many points are uploaded in slices before: else a picture would take as long as its largest array."""
    rng, own = np.random.default_rng(4), Renderer(renderer.gpu)
    points = rng.standard_normal((3000, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    cloud = PointCloud.from_arrays(
        points, normals=points, colors=points * 0.5 + 0.5, radii=np.full(3000, 0.1)
    )
    cloud = cloud.of_rows(np.arange(0, 3000, 2))  # so that there are ids
    pose = Pose(0, 0.0, "x", cloud)
    request = Request(pose, Camera.orbit(cloud.bounds()), name, look=look)
    while not isinstance(planned := make_plan(own, request, SIZE, Effort.WAIT, upload_ms=1000), Ready):
        pass
    before = set(planned.pose._arrays)
    surface = Surface(own.gpu, SIZE)
    while render_frame(own, request, surface):
        pass
    assert set(planned.pose._arrays) == before
    surface.release()
    own.release()


def test_bringing_a_pose_uploads_what_the_picture_reads(renderer: Renderer) -> None:
    own = Renderer(renderer.gpu)
    pose = Pose(0, 0.0, "x", sphere(1000))
    request = Request(pose, Camera.orbit(pose.cloud.bounds()), "surfels")
    assert isinstance(make_plan(own, request, SIZE, Effort.BEGIN, upload_ms=1000), Ready)
    assert own.bytes_of(pose) == 1000 * (12 + 12 + 4 + 4), "positions, normals, radii and colours"
    bare = Request(Pose(0, 0.0, "x", BARE), request.camera, "surfels", look=Look(color_by="normal"))
    waiting = make_plan(own, bare, SIZE, Effort.BEGIN, upload_ms=1000)
    assert isinstance(waiting, Waiting)
    assert (waiting.stage, waiting.why) == (Stage.ESTIMATE, "Estimating normals")
    assert isinstance(make_plan(own, fallback(bare), SIZE, Effort.NONE), Ready)
    assert fallback(bare).params.point_size == 0, "which touch: no dust in between"
    own.release()


@pytest.mark.slow
def test_estimates_are_the_same_whoever_makes_them(renderer: Renderer) -> None:
    pose, surfels = Pose(0, 0.0, "x", BARE), find_backend("surfels")
    clouds = []
    for effort in (Effort.WAIT, Effort.BEGIN):
        own = Renderer(renderer.gpu)
        request = Request(pose, Camera.orbit(BARE.bounds()), surfels, surfels.params({"radius": "own"}))
        while not isinstance(planned := make_plan(own, request, SIZE, effort), Ready):
            time.sleep(0.01)
        clouds.append(planned.pose.cloud)
        own.release()
    np.testing.assert_array_equal(clouds[0].normals, clouds[1].normals)
    np.testing.assert_array_equal(clouds[0].radii, clouds[1].radii)


def test_a_frame_that_fails_still_tells_what_drew(renderer: Renderer) -> None:
    pose, surface = Pose(0, 0.0, "x", sphere(100)), Surface(renderer.gpu, (60, 40))
    request = Request(pose, Camera.orbit(pose.cloud.bounds()), "points", look=Look(color_by="missing"))
    with pytest.raises(InputError, match="missing"):
        render_frame(renderer, request, surface)
    assert surface.stats.backend == "points"


def test_normals_that_are_estimated_for_the_renderer_light_the_picture(renderer: Renderer) -> None:
    for passes in ("one", "two"):
        auto = viewer.render(BARE, size=SIZE, backend="surfels", passes=passes)
        lit = viewer.render(BARE, size=SIZE, backend="surfels", passes=passes, look=Look(light="head"))
        np.testing.assert_array_equal(auto.image(), lit.image())
    unlit = viewer.render(BARE, size=SIZE, backend="points").image()
    flat = viewer.render(BARE, size=SIZE, backend="points", look=Look(light="flat", eye_dome=True)).image()
    np.testing.assert_array_equal(unlit, flat)

"""Octants that shaders find of a view are those that the CPU finds, to the bit and in the same order."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scenes import NOTHING, sphere

from viewer.backends import FrameView, backend
from viewer.backends.voxels import Params, cuts
from viewer.backends.voxels.cut_pose import CutPose
from viewer.backends.voxels.cuts import OctreeCuts
from viewer.backends.voxels.shown import ShownOctants
from viewer.camera import Camera
from viewer.drawing.renderer import Renderer
from viewer.gpu.pose import GpuPose
from viewer.picture.surface import Surface
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose
from viewer.view import View

pytestmark = pytest.mark.backend("voxels")
SIZE = (96, 72)
FEW = sphere(1200)


def _colored(cloud: PointCloud) -> PointCloud:
    rng = np.random.default_rng(1)
    return replace(cloud, colors=rng.integers(0, 256, (len(cloud), 4), np.uint8))


def _with_strays() -> PointCloud:
    positions = FEW.world()
    positions[::400] *= 1000
    return _colored(PointCloud.from_arrays(positions, normals=FEW.normals))


CLOUDS = {
    "plain": FEW,
    "coloured": _colored(sphere(3000)),
    "with strays": _with_strays(),
    "far away": PointCloud.from_arrays(FEW.world() + np.array([5e5, 4e6, 120]), normals=FEW.normals),
    "one point": FEW.of_rows(np.array([7])),
}
CAMERAS = {
    "whole": lambda bounds: Camera.orbit(bounds, 30, 20, aspect=4 / 3),
    "orthographic": lambda bounds: Camera.orbit(bounds, 30, 20, aspect=4 / 3, projection="orthographic"),
    "far": lambda bounds: _nearer(bounds, 9.0),
    "a part": lambda bounds: _nearer(bounds, 0.5),
    "inside": lambda bounds: _nearer(bounds, 0.01),
}
PARAMETERS = {
    "defaults": {},
    "coarse": {"pixel_threshold": 6.0},
    "cull_back": {"cull_back": True},
    "a level": {"max_depth": 4},
    "occupancy": {"stop": "occupancy", "occupancy": 3},
}
every_camera = pytest.mark.parametrize("camera", CAMERAS.values(), ids=CAMERAS)
every_cloud = pytest.mark.parametrize("cloud", CLOUDS.values(), ids=CLOUDS)


def _nearer(bounds: object, factor: float) -> Camera:
    camera = Camera.orbit(bounds, 30, 20, aspect=4 / 3)  # type: ignore[arg-type]
    target = np.array(camera.target)
    return replace(camera, eye=tuple((target + factor * (np.array(camera.eye) - target)).tolist()))


class Found:
    """The octants of one cloud and parameters, on either side."""

    def __init__(self, renderer: Renderer, cloud: PointCloud, params: Params) -> None:
        self.pose = GpuPose(renderer.gpu, Pose(0, 0.0, "", cloud))
        self.params = params
        octree = backend("voxels").derive(self.pose.pose, params, None)
        self.cuts = OctreeCuts(renderer.gpu, octree)  # type: ignore[arg-type]

    def show(self, camera: Camera, budget_ms: float | None = None, share: float = 1.0) -> ShownOctants:
        """Those that a view shows."""
        view = View.of(camera, SIZE, self.pose.origin, self.pose.bounds)
        frame = FrameView(view, self.params, self.cuts, share, budget_ms, frozenset(), False, None)
        return self.cuts.show(self.pose, frame)


@pytest.fixture
def by_shaders(monkeypatch: pytest.MonkeyPatch) -> Callable[[bool], None]:
    """by_shaders(True): octants are found by shaders from now on, whichever the device."""
    return lambda wanted: monkeypatch.setattr(cuts, "BY_SHADERS", wanted)


def both(
    renderer: Renderer,
    by_shaders: Callable[[bool], None],
    cloud: PointCloud,
    camera: Camera,
    **values: object,
) -> tuple[ShownOctants, ShownOctants]:
    """What the CPU finds, and what shaders find."""
    if not renderer.gpu.software:
        pytest.skip("graphics cards find octants by shaders alone")
    params = backend("voxels").params(values)
    by_shaders(False)
    expected = Found(renderer, cloud, params).show(camera)
    by_shaders(True)
    found = Found(renderer, cloud, params).show(camera)
    assert isinstance(found, CutPose)
    assert not isinstance(expected.points, CutPose)
    return expected, found


def assert_same(expected: ShownOctants, found: ShownOctants) -> None:
    assert found.found == expected.found
    np.testing.assert_array_equal(found.octants, expected.octants)
    np.testing.assert_array_equal(found.rows, expected.rows)
    ours, theirs = found.points.cloud, expected.points.cloud
    for name in ("positions", "normals", "radii", "colors", "ids", "origin"):
        np.testing.assert_array_equal(getattr(ours, name), getattr(theirs, name), name)
    assert found.points.count == len(theirs)
    if len(theirs):
        facts, wanted = found.points, expected.points
        assert facts.reaches == wanted.reaches
        for one, other in ((facts.bounds, wanted.bounds), (facts.whole_bounds, wanted.whole_bounds)):
            np.testing.assert_array_equal(one.corners(), other.corners())


@pytest.mark.parametrize("values", PARAMETERS.values(), ids=PARAMETERS)
@every_camera
def test_the_same_octants(
    renderer: Renderer,
    by_shaders: Callable[[bool], None],
    camera: Callable[..., Camera],
    values: dict[str, object],
) -> None:
    cloud = CLOUDS["coloured"]
    expected, found = both(renderer, by_shaders, cloud, camera(cloud.bounds()), **values)
    assert_same(expected, found)
    assert camera is CAMERAS["inside"] or len(found.octants) > 0


@every_cloud
def test_of_every_cloud(renderer: Renderer, by_shaders: Callable[[bool], None], cloud: PointCloud) -> None:
    assert_same(*both(renderer, by_shaders, cloud, CAMERAS["whole"](cloud.bounds())))


def test_outliers_do_not_stretch_the_bounds(renderer: Renderer, by_shaders: Callable[[bool], None]) -> None:
    """Those of the nodes: the bounds of the body differ from those of all."""
    positions = np.concatenate([FEW.world(), [[9.0, 0.0, 0.0]]])
    cloud = PointCloud.from_arrays(positions, normals=np.concatenate([FEW.normals, [[0, 0, 1]]]))  # type: ignore[list-item]
    expected, found = both(renderer, by_shaders, cloud, CAMERAS["far"](cloud.bounds()))
    assert_same(expected, found)
    assert found.points.bounds.radius < 0.6 * found.points.whole_bounds.radius


@pytest.mark.parametrize("values", [{}, {"passes": "one"}, {"instancing": "vbo"}, {"cull_back": True}])
def test_the_same_picture(
    draw: Callable[..., Surface],
    renderer: Renderer,
    by_shaders: Callable[[bool], None],
    values: dict[str, object],
) -> None:
    if not renderer.gpu.software:
        pytest.skip("graphics cards find octants by shaders alone")
    cloud = CLOUDS["with strays"]
    pictures: list[dict[str, NDArray]] = []
    for wanted in (False, True):
        by_shaders(wanted)
        # The renderer holds what it derived, for as long as there is the pose.
        copy = replace(cloud, topology=str(wanted))
        surface = draw(copy, CAMERAS["whole"](cloud.bounds()), SIZE, "voxels", None, values)
        assert isinstance(surface.pose, CutPose) == wanted
        pictures.append({**surface.arrays(), "row": surface.row, "picture": surface.image()})
        pictures[-1]["counts"] = np.array(list(surface.point_counts().values()))
    for name, expected in pictures[0].items():
        np.testing.assert_array_equal(pictures[1][name], expected, name)


def test_a_view_costs_two_small_readings_and_another_picture_of_it_none(
    renderer: Renderer, by_shaders: Callable[[bool], None]
) -> None:
    by_shaders(True)
    cloud, gpu = CLOUDS["coloured"], renderer.gpu
    octants = Found(renderer, cloud, Params())
    before = gpu.staging.reads
    shown = octants.show(CAMERAS["whole"](cloud.bounds()))
    assert gpu.staging.reads - before == 1, "how many there are"
    assert shown.points.has("colors")
    assert shown.points.bounds.radius > 0
    assert shown.points.reaches[1] > 0
    assert gpu.staging.reads - before == 2, "facts, and some of the octants"
    assert octants.show(CAMERAS["whole"](cloud.bounds())) is shown
    assert gpu.staging.reads - before == 2


def test_an_octree_is_uploaded_in_slices_and_drawn_meanwhile(
    renderer: Renderer, by_shaders: Callable[[bool], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    by_shaders(True)
    slice_bytes = 1 << 10
    monkeypatch.setattr(renderer.gpu.staging, "slice", slice_bytes)
    cloud = CLOUDS["coloured"]
    camera = CAMERAS["whole"](cloud.bounds())
    octants, whole = Found(renderer, cloud, Params()), Found(renderer, cloud, Params())
    counts: list[int] = []
    while not (shown := octants.show(camera, budget_ms=0.0)).found.complete:
        assert not counts or octants.pose.take_spent().nbytes <= slice_bytes
        octants.pose.take_spent()
        counts.append(shown.points.count)
    assert counts[0] == 1, "the root first"
    assert counts == sorted(counts)
    assert len(set(counts)) >= 5, "level by level"
    np.testing.assert_array_equal(shown.octants, whole.show(camera).octants)


def test_what_a_picture_shows_stays_until_it_goes(
    renderer: Renderer, by_shaders: Callable[[bool], None]
) -> None:
    by_shaders(True)
    cloud = CLOUDS["coloured"]
    octants = Found(renderer, cloud, Params())
    first = octants.show(CAMERAS["whole"](cloud.bounds()))
    texels = first.points.array("positions")
    second = octants.show(CAMERAS["a part"](cloud.bounds()))
    assert second.points.array("positions") is not texels
    np.testing.assert_array_equal(first.octants, octants.show(CAMERAS["whole"](cloud.bounds())).octants)
    del first
    again = octants.show(CAMERAS["far"](cloud.bounds()))
    assert again.points.array("positions") is texels, "no picture shows what it held"
    assert (again.octants != NOTHING).all()

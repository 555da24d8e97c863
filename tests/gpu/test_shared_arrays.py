"""Arrays that poses have in common are on the GPU once: counted in bytes, and the same pictures."""

from __future__ import annotations

import gc
from dataclasses import replace

import numpy as np
import pytest
from scenes import sphere

from viewer.backends import backend
from viewer.camera import Camera
from viewer.drawing.frame import render_frame
from viewer.drawing.renderer import Renderer
from viewer.drawing.request import Request
from viewer.gpu.arrays import shared_arrays
from viewer.look import Look
from viewer.picture.surface import Surface
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose

SIZE = (96, 64)
COUNT = 2000


def coloured() -> PointCloud:
    cloud = sphere(COUNT)
    colors = np.random.default_rng(3).integers(0, 256, (COUNT, 4), np.uint8)
    colors[:, 3] = 255
    return replace(cloud, colors=colors, radii=np.full(COUNT, 0.09, np.float32))


def played() -> list[PointCloud]:
    """Three moments of the same points, of which positions and normals alone change."""
    cloud = coloured()
    assert cloud.normals is not None
    turned = [
        cloud.positions[:, order] * np.float32(grown) for order, grown in (([1, 2, 0], 1.1), ([2, 0, 1], 0.9))
    ]
    normals = [cloud.normals[:, order] for order in ([1, 2, 0], [2, 0, 1])]
    return [cloud, *(replace(cloud, positions=p, normals=n) for p, n in zip(turned, normals, strict=True))]


@pytest.fixture
def own(renderer: Renderer) -> Renderer:
    return Renderer(renderer.gpu)


def drawn(renderer: Renderer, pose: Pose, surface: Surface, name: str = "surfels") -> np.ndarray:
    """A picture that reads positions, normals and colours, and of surfels radii, two passes of which bring
    colours and normals in words of their own."""
    camera = Camera.orbit(pose.bounds, 30, 20, aspect=1.5)
    params = backend(name).params({"radius": "own", "passes": "one"} if name == "surfels" else None)
    render_frame(renderer, Request(pose, camera, name, params, Look(light="head")), surface)
    return surface.image()


def test_what_frames_share_is_uploaded_once(own: Renderer) -> None:
    surface = Surface(own.gpu, SIZE)
    poses = [Pose(i, float(i), "", cloud) for i, cloud in enumerate(played())]
    drawn(own, poses[0], surface)
    assert surface.stats.uploaded_bytes == COUNT * (12 + 12 + 4 + 4)
    assert surface.stats.shared == ()
    held = [own.resident(pose) for pose in poses]
    for pose in poses[1:]:
        drawn(own, pose, surface)
        assert surface.stats.uploaded_bytes == COUNT * (12 + 12), "positions and normals"
        assert set(surface.stats.shared) == {"radii", "colors"}
    assert len({each.array("colors").buffer.glo for each in held}) == 1
    assert len({each.array("positions").buffer.glo for each in held}) == 3
    assert own.nbytes == pytest.approx(COUNT * (3 * 24 + 8), abs=8), "each pose counts its part"
    drawn(own, poses[0], surface)
    assert surface.stats.uploaded_bytes == 0
    own.release()


@pytest.mark.parametrize("name", ["points", "surfels"])
def test_pictures_are_those_of_arrays_of_their_own(own: Renderer, name: str) -> None:
    surface = Surface(own.gpu, SIZE)
    for index, cloud in enumerate(played()):
        shared = drawn(own, Pose(index, 0.0, "", cloud), surface, name)
        names = ("positions", "normals", "colors", "radii")
        copies = {each: getattr(cloud, each).copy() for each in names}
        alone = Renderer(own.gpu)
        pose = Pose(index, 0.0, "", replace(cloud, **copies))
        wanted = drawn(alone, pose, surface, name)
        assert surface.stats.shared == ()
        np.testing.assert_array_equal(shared, wanted)
        alone.release()
    own.release()


def test_an_array_stays_for_as_long_as_a_pose_has_it(own: Renderer) -> None:
    surface = Surface(own.gpu, SIZE)
    first, second = (Pose(i, 0.0, "", cloud) for i, cloud in enumerate(played()[:2]))
    drawn(own, first, surface)
    wanted = drawn(own, second, surface)
    colors = own.resident(second).array("colors")
    del first
    gc.collect()
    own.resident(second)  # which lets go of what nobody holds
    assert colors.buffer.read() == second.cloud.colors.tobytes()
    assert own.nbytes == COUNT * (12 + 12 + 4 + 4)
    np.testing.assert_array_equal(drawn(own, second, surface), wanted)
    shared = shared_arrays(own.gpu)["colors", id(second.cloud.colors)]
    assert list(shared.holders) == [own.resident(second)]
    own.release()


def test_an_array_under_two_names_is_two(own: Renderer) -> None:
    cloud = sphere(COUNT)
    pose = own.resident(Pose(0, 0.0, "", replace(cloud, normals=cloud.positions)))
    pose.upload(["positions", "normals"])
    assert pose.array("positions") is not pose.array("normals")
    assert pose.uploaded_bytes == COUNT * 24
    pose.center(pose.origin + 1.0)
    assert pose.uploaded_bytes == COUNT * 12
    moved = np.frombuffer(pose.array("positions").buffer.read(), np.float32).reshape(-1, 3)
    np.testing.assert_allclose(moved, cloud.positions - 1.0, atol=1e-6)
    assert pose.array("normals").buffer.read() == cloud.positions.tobytes()
    own.release()


def test_what_the_next_pose_has_outlives_the_one_before(own: Renderer) -> None:
    surface = Surface(own.gpu, SIZE)
    for index, cloud in enumerate(played()):
        drawn(own, Pose(index, 0.0, "", cloud), surface)  # which nobody holds from here on
        assert surface.stats.uploaded_bytes == COUNT * (12 + 12 + (0 if index else 4 + 4))
    assert own.nbytes == COUNT * (12 + 12 + 4 + 4)
    other = coloured()
    drawn(own, Pose(9, 0.0, "", replace(other, radii=None)), surface, "points")
    assert own.nbytes == COUNT * (12 + 12 + 4), "and no more than that"
    assert surface.stats.shared == ()
    own.release()

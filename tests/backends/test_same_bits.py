"""Ways to instance that give the same bits: one of them stands for all in other tests."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scenes import BUFFERS, sphere

from viewer.backends import backends
from viewer.camera import Camera
from viewer.drawing.frame import render_frame
from viewer.drawing.renderer import Renderer
from viewer.drawing.request import Request
from viewer.picture.surface import Surface
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose
from viewer.splatting.amplify import FEEDS

FEED = "instancing"  # the parameter is called alike wherever there are feeds
SIZE = (160, 120)
Make = Callable[[], PointCloud]
Aim = Callable[[PointCloud], Camera]
Channels = dict[str, np.ndarray]


# Backend -> its ways to instance.
WAYS = {
    one.name: parameter.choices
    for one in backends().values()
    for parameter in one.parameters
    if parameter.name == FEED and set(FEEDS) <= {*parameter.choices}
}


def odd(count: int = 12_000) -> PointCloud:
    """A sphere, more than a uniform block holds, with normals and radii among it that cannot be used."""
    whole = sphere(count)
    assert whole.normals is not None
    assert whole.radii is not None
    normals, radii = whole.normals.copy(), whole.radii.copy()
    normals[::7], normals[1::7], radii[::5], radii[1::5] = 0, np.nan, np.nan, -1
    return replace(whole, normals=normals, radii=radii)


def ellipses(count: int = 5000) -> PointCloud:
    whole = sphere(count)
    assert whole.normals is not None
    assert whole.radii is not None
    aside = np.cross(whole.normals, (0.3, 0.5, 0.8))
    long = 2 * whole.radii[:, None] * aside / np.linalg.norm(aside, axis=1, keepdims=True)
    axes = np.column_stack([long, whole.radii / 2])
    return PointCloud.from_arrays(whole.positions, normals=whole.normals, radii=whole.radii, axes=axes)


def fitted(cloud: PointCloud) -> Camera:
    return Camera.orbit(cloud.bounds(), 30, 20, aspect=4 / 3) if len(cloud) else Camera(eye=(0, 0, 4))


CLOUDS: dict[str, Make] = {
    "sphere": lambda: sphere(12_000),
    "without radii": lambda: replace(sphere(3000), radii=None),
    "unusable normals and radii": odd,
    "ellipses": ellipses,
    "one point": lambda: PointCloud.from_arrays([[1e6, -2e6, 3e6]], normals=[[0, 0, 1]], radii=[1.0]),
    "no point": lambda: PointCloud.from_arrays(np.zeros((0, 3)), normals=np.zeros((0, 3))),
}
CAMERAS: dict[str, Aim] = {
    "fitted": fitted,
    "orthographic": lambda cloud: fitted(cloud).projected("orthographic"),
    "inside": lambda _: Camera((0.0, 0.1, 0.2), (0.6, 0.3, 0.5), fov_y=70),
}


def pictures(renderer: Renderer, name: str, way: str, cloud: PointCloud, camera: Camera) -> list[Channels]:
    """In full and of a share of the points: all channels and the shaded picture."""
    request = Request(Pose(0, 0.0, "test", cloud), camera, name, backends()[name].params({FEED: way}))
    found = []
    for share in (1.0, 0.4):
        surface = Surface(renderer.gpu, SIZE)
        while render_frame(renderer, request, surface, share=share) and share == 1:
            pass
        found.append({**surface.arrays(), "image": surface.image()})
    return found


every_backend_with_feeds = pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.backend(name)) for name in WAYS]
)
every_cloud = pytest.mark.parametrize("make", CLOUDS.values(), ids=CLOUDS)
every_camera = pytest.mark.parametrize("camera", CAMERAS.values(), ids=CAMERAS)


@every_backend_with_feeds
@every_cloud
@every_camera
def test_feeds_from_buffers_give_the_same_bits(
    renderer: Renderer, name: str, make: Make, camera: Aim
) -> None:
    cloud = make()
    first, *others = (pictures(renderer, name, way, cloud, camera(cloud)) for way in BUFFERS)
    for other in others:
        assert_equal(first, other)


@every_backend_with_feeds
@every_cloud
def test_what_is_chosen_automatically_gives_its_bits(renderer: Renderer, name: str, make: Make) -> None:
    cloud = make()
    camera, surface = fitted(cloud), Surface(renderer.gpu, SIZE)
    render_frame(renderer, Request(Pose(0, 0.0, "test", cloud), camera, name), surface)
    if not len(cloud):
        assert FEED not in surface.stats.chosen
        return
    chosen = surface.stats.chosen[FEED]
    assert chosen in WAYS[name]
    automatic, same = (pictures(renderer, name, way, cloud, camera) for way in ("auto", chosen))
    assert_equal(automatic, same)


def assert_equal(one: list[Channels], other: list[Channels]) -> None:
    for before, after in zip(one, other, strict=True):
        for channel, values in before.items():
            np.testing.assert_array_equal(after[channel], values, err_msg=channel)

"""Splats that face away: left out at the outline alone, never where they are what is seen."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scenes import NOTHING, sphere, sphere_hits

from viewer.camera import Camera
from viewer.gpu.amplify import FEEDS
from viewer.gpu.surface import Surface
from viewer.scan.points import PointCloud

pytestmark = pytest.mark.backend("surfels")
Draw = Callable[..., Surface]
SIZE = (240, 200)
SPHERE = sphere(8000)
OUTSIDE = Camera((0.4, 0.7, 3.2), (0, 0, 0), fov_y=45)
PARALLEL = replace(OUTSIDE, projection="orthographic", height=2.4)
INSIDE = Camera((0.1, 0.0, 0.3), (0.6, 0.3, -0.5), fov_y=70)
CLIPPED = replace(OUTSIDE, near=2.7)
AXES = SPHERE.world() / np.linalg.norm(SPHERE.world(), axis=1, keepdims=True)


def towards(x: float, y: float, z: float) -> NDArray[np.float64]:
    """The cosine of each point's angle to a direction."""
    return AXES @ (np.array([x, y, z]) / np.linalg.norm([x, y, z]))


def without(left_out: NDArray[np.bool_]) -> PointCloud:
    kept, assigned = ~left_out, (SPHERE.normals, SPHERE.radii, SPHERE.colors)
    normals, radii, colors = (values[kept] for values in assigned if values is not None)
    return PointCloud.from_arrays(SPHERE.world()[kept], normals=normals, radii=radii, colors=colors)


def turned(inwards: NDArray[np.bool_]) -> PointCloud:
    assert SPHERE.normals is not None
    return replace(SPHERE, normals=np.where(inwards[:, None], -SPHERE.normals, SPHERE.normals))


def spots(count: int) -> NDArray[np.bool_]:
    rows = np.random.default_rng(0).choice(len(SPHERE), count, replace=False)
    return np.isin(np.arange(len(SPHERE)), rows)


OPEN = {
    "closed": SPHERE,
    "a wide hole": without(towards(0, 0, 1) > 0.8),
    "a small hole": without(towards(0.2, 0.3, 1) > 0.997),
    "a hole at the outline": without(towards(1, 0.2, 0.1) > 0.97),
    "half of it": without(towards(0, -1, 0.2) > 0),
    "all inwards": turned(np.ones(len(SPHERE), bool)),
    "half inwards": turned(towards(0.3, 1, 0.5) > 0),
    "a patch inwards": turned(towards(0.1, 0.2, 1) > 0.98),
    "some inwards": turned(spots(40)),
}


def surfels(draw: Draw, cloud: PointCloud, camera: Camera, cull_back: str, **params: object) -> Surface:
    return draw(cloud, camera, SIZE, "surfels", params={"cull_back": cull_back, **params})


def away(surface: Surface, cloud: PointCloud) -> NDArray[np.bool_]:
    """The pixels that show a splat that faces away."""
    assert cloud.normals is not None
    backs = surface.view.faces_away(cloud.positions, cloud.normals)
    return (surface.row != NOTHING) & backs[np.where(surface.row == NOTHING, 0, surface.row)]


def off_the_outline(camera: Camera) -> NDArray[np.bool_]:
    """The pixels whose ray meets the sphere two splats within its outline; from inside, all."""
    if camera is INSIDE:
        return np.ones(SIZE[::-1], bool)
    assert SPHERE.radii is not None
    return np.isfinite(sphere_hits(camera, SIZE, 1 - 2 * float(SPHERE.radii[0]))[0])


@pytest.mark.parametrize("camera", [OUTSIDE, PARALLEL], ids=["perspective", "orthographic"])
@pytest.mark.parametrize("passes", ["one", "auto"])
def test_a_closed_surface_shows_no_backs(draw: Draw, camera: Camera, passes: str) -> None:
    with_backs, auto, front = (surfels(draw, SPHERE, camera, c, passes=passes) for c in ("off", "auto", "on"))
    assert away(with_backs, SPHERE).any(), "discs of the far side stick out"
    assert not away(auto, SPHERE).any()
    np.testing.assert_array_equal(auto.row, front.row)
    np.testing.assert_allclose(auto.color, front.color, atol=2e-6)


@pytest.mark.parametrize(
    "camera", [OUTSIDE, PARALLEL, INSIDE, CLIPPED], ids=["outside", "parallel", "inside", "clipped"]
)
@pytest.mark.parametrize("cloud", OPEN.values(), ids=OPEN)
def test_what_is_left_out_opens_no_hole(draw: Draw, cloud: PointCloud, camera: Camera) -> None:
    """Off the outline the same surface is seen as if nothing were left out."""
    with_backs, auto = (surfels(draw, cloud, camera, c, instancing="tiles") for c in ("off", "auto"))
    inner = off_the_outline(camera)
    assert SPHERE.radii is not None
    np.testing.assert_array_equal((auto.row != NOTHING)[inner], (with_backs.row != NOTHING)[inner])
    drawn = inner & (auto.row != NOTHING)
    np.testing.assert_allclose(auto.depth[drawn], with_backs.depth[drawn], atol=0.2 * float(SPHERE.radii[0]))
    # Among splats of one surface another may be the nearest where some that face the other way are left out.
    assert np.count_nonzero(auto.row[inner] != with_backs.row[inner]) <= 0.01 * inner.sum()


@pytest.mark.parametrize("passes", ["one", "two"])
@pytest.mark.parametrize("feed", FEEDS)
def test_all_ways_leave_out_the_same(draw: Draw, feed: str, passes: str) -> None:
    for name in ("a wide hole", "a patch inwards"):
        cloud, params = OPEN[name], {"passes": passes, "enlarge": 1.0}
        one, other = (
            surfels(draw, cloud, OUTSIDE, "auto", instancing=way, **params) for way in ("tiles", feed)
        )
        backs = away(one, cloud)
        assert backs.sum() > 50, "through the hole"
        assert np.count_nonzero(backs != away(other, cloud)) <= 3, "rounding"
        assert np.count_nonzero(one.row != other.row) <= 0.002 * one.row.size

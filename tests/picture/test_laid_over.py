"""Layers: numbers over a pose, and where it is moved to."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scenes import DRAWS_POINTS, NOTHING, rarely, sphere, sphere_mesh

from viewer.analysis.pick import Picked, is_seen, pick
from viewer.analysis.surface_point import SurfacePoint, followed
from viewer.backends import backend as find_backend
from viewer.backends import backends
from viewer.bench.judge import Judge
from viewer.camera import Camera
from viewer.document.anonymous import anonymous_request
from viewer.drawing.frame import render_frame
from viewer.drawing.renderer import Renderer
from viewer.drawing.request import Request
from viewer.errors import InputError
from viewer.look import Look
from viewer.mesh.triangles import Mesh
from viewer.output.export import write_picture
from viewer.picture.surface import Surface
from viewer.rigid import Rigid
from viewer.scan.layers import Layers
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose

SIZE = (161, 121)
CLOUD = replace(sphere(6000), scalars={"row": np.arange(6000.0)})
POSE = Pose(0, 0.0, "x", CLOUD)
DEVIATION = np.sin(7 * CLOUD.positions[:, 0].astype(float)) + 5e8  # far from zero
# How far blended normals may be apart that were stored in other axes (shaders/surfels/passes/look.glsl):
# each, in both, in steps of 1/2047 along each axis, after those of 1/32767 of an octahedron's net, which it
# stretches by two at most; and by one step of weight, of 50 or more in all, of a splat whose centre is up to
# its radius away: 1.5 spacings.
_STORED = 2 * 3**0.5 * 0.5 * (1 / 2047 + 2 / 32767)
_WEIGHED = 1.5 * (4 * np.pi / len(CLOUD)) ** 0.5 / 50
OF_POINTS = [one.name for one in backends().values() if one.rows == "points"]
SECTORS = "hpr"  # goes by sectors of directions along the scan's axes, which turn with the pose


def turned(angle: float, to: tuple[float, float, float]) -> Rigid:
    """By an angle, radians, about an axis that is none of the world's, then to a place."""
    x, y, z = np.array([1.0, 2.0, -0.5]) / np.linalg.norm([1.0, 2.0, -0.5])
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    matrix = np.eye(4)
    matrix[:3, :3] += np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    matrix[:3, 3] = to
    return Rigid(matrix)


TURNED = turned(0.7, (3.0, -1.0, 12.0))


def moved(cloud: PointCloud, place: Rigid) -> PointCloud:
    """The points moved one by one in float64."""
    return PointCloud.from_arrays(
        place.points(cloud.world()),
        normals=cloud.normals.astype(np.float64) @ place.rotation.T,
        colors=cloud.colors,
        radii=cloud.radii,
        scalars=cloud.scalars,
    )


def drawn(
    renderer: Renderer,
    pose: Pose,
    camera: Camera,
    layers: Layers | None = None,
    backend: str = "points",
    look: Look | None = None,
) -> Surface:
    """One finished picture."""
    surface = Surface(renderer.gpu, SIZE)
    request = Request(pose, camera, backend, None, look or Look(light="flat"), layers or Layers())
    while render_frame(renderer, request, surface):
        pass
    return surface


def camera_of(cloud: PointCloud, projection: str = "perspective") -> Camera:
    return Camera.orbit(cloud.bounds(), 30, 20, aspect=4 / 3, projection=projection)


@pytest.mark.parametrize("backend", DRAWS_POINTS)
def test_numbers_come_without_the_points(renderer: Renderer, backend: str) -> None:
    own, layers = Renderer(renderer.gpu), Layers({"deviation": DEVIATION})
    look, camera = Look(color_by="deviation", light="flat"), camera_of(CLOUD)
    drawn(own, POSE, camera, backend=backend, look=replace(look, color_by="plain"))
    before = own.bytes_of(POSE)
    surface = drawn(own, POSE, camera, layers, backend, look)
    assert own.bytes_of(POSE) - before <= 4 * len(CLOUD), "a number a point, and nothing else"
    rows = [surface.point_of(row) for row in surface.row[surface.row != NOTHING]]
    np.testing.assert_array_equal(surface.value[surface.row != NOTHING], DEVIATION[rows].astype(np.float32))
    stored = replace(POSE, points=replace(CLOUD, scalars={"deviation": DEVIATION}))
    np.testing.assert_array_equal(surface.image(), drawn(own, stored, camera, None, backend, look).image())
    own.release()


def test_an_array_is_uploaded_once_and_goes_when_nobody_holds_it(renderer: Renderer) -> None:
    own, camera, look = Renderer(renderer.gpu), camera_of(CLOUD), Look(color_by="new", light="flat")
    numbers = DEVIATION.copy()
    drawn(own, POSE, camera, Layers({"new": numbers}), look=look)
    held = own.bytes_of(POSE)
    drawn(own, POSE, camera, Layers({"new": numbers}, TURNED), look=look)
    assert own.bytes_of(POSE) == held
    second = drawn(own, POSE, camera, Layers({"new": (other := -DEVIATION)}), look=look)
    assert own.bytes_of(POSE) == held + 4 * len(CLOUD), "both may be shown, side by side"
    del numbers
    third = drawn(own, POSE, camera, Layers({"new": other}), look=look)
    assert own.bytes_of(POSE) == held
    np.testing.assert_array_equal(second.image(), third.image())
    own.release()


def test_a_layer_stands_for_what_the_scan_calls_alike_and_comes_last_in_number(renderer: Renderer) -> None:
    camera = camera_of(CLOUD)
    first = drawn(renderer, POSE, camera, Layers({"row": DEVIATION}), look=Look(color_by="#1"))
    last = drawn(renderer, POSE, camera, Layers({"deviation": DEVIATION}), look=Look(color_by="#2"))
    covered = first.row != NOTHING
    for surface in (first, last):
        np.testing.assert_array_equal(
            surface.value[covered], DEVIATION[surface.row[covered]].astype(np.float32)
        )


def test_numbers_are_picked_and_exported(renderer: Renderer, tmp_path: object) -> None:
    look, layers = Look(color_by="deviation"), Layers({"deviation": DEVIATION})
    surface = drawn(renderer, POSE, camera_of(CLOUD), layers, look=look)
    y, x = np.argwhere(surface.row != NOTHING)[100].tolist()
    picked = pick(surface, x, y)
    assert picked is not None
    assert picked.scalars == {"row": float(picked.row), "deviation": DEVIATION[picked.row]}
    write_picture(surface, tmp_path / "a.npz")  # type: ignore[operator]
    with np.load(tmp_path / "a.npz") as arrays:  # type: ignore[operator]
        assert arrays["value"][y, x] == np.float32(DEVIATION[picked.row])


def test_what_is_no_layer_is_told(renderer: Renderer) -> None:
    for values, found in ((DEVIATION[1:], r"\(5999,\) float64"), (DEVIATION.astype(str), "<U")):
        with pytest.raises(InputError, match=f"the layer 'd' is .*{found}.*, expected 6,000 numbers"):
            drawn(renderer, POSE, camera_of(CLOUD), Layers({"d": values}))
    for matrix in (np.eye(3), 2 * np.eye(4), np.diag([1.0, 1, -1, 1]), np.full((4, 4), np.nan)):
        with pytest.raises(InputError, match="must be a rotation and a translation"):
            Rigid(matrix)


@pytest.mark.parametrize("projection", ["perspective", *rarely("orthographic")])
@pytest.mark.parametrize("backend", DRAWS_POINTS)
def test_a_pose_that_is_shifted_gives_the_very_picture(
    renderer: Renderer, backend: str, projection: str
) -> None:
    """By whole numbers, which rounds nothing."""
    place = Rigid(np.block([[np.eye(3), np.array([[4096.0], [-512], [2048]])], [np.zeros((1, 3)), 1]]))
    there = Pose(0, 0.0, "x", moved(CLOUD, place))
    camera = camera_of(CLOUD, projection).moved(place.matrix[:3, 3])
    for look in (
        Look(),
        Look(color_by="height"),
        Look(color_by="depth", light="fixed"),
        Look(color_by="normal"),
    ):
        one = drawn(renderer, POSE, camera, Layers(world_from_pose=place), backend, look)
        other = drawn(renderer, there, camera, None, backend, look)
        assert (one.row != NOTHING).any()
        np.testing.assert_array_equal(one.image(), other.image())
        for name, channel in one.arrays().items():
            np.testing.assert_array_equal(channel, other.arrays()[name])


@pytest.mark.parametrize("projection", ["perspective", *rarely("orthographic")])
@pytest.mark.parametrize("backend", [name for name in OF_POINTS if name != SECTORS])
@pytest.mark.parametrize("place", [TURNED, turned(2.5, (1e6, -2e6, 3e5))], ids=["near", "far"])
def test_a_pose_that_is_turned_gives_the_picture_of_turned_points(
    renderer: Renderer, backend: str, projection: str, place: Rigid
) -> None:
    there = Pose(0, 0.0, "x", moved(CLOUD, place))
    camera = camera_of(there.cloud, projection)
    for look in (Look(), Look(color_by="height"), Look(light="fixed"), Look(color_by="normal", light="flat")):
        one = drawn(renderer, POSE, camera, Layers(world_from_pose=place), backend, look)
        other = drawn(renderer, there, camera, None, backend, look)
        same = one.row == other.row
        assert (one.row[same] != NOTHING).sum() > 1000
        assert same.mean() > 0.995, "but for rounding"
        steps = np.abs(one.image().astype(int) - other.image())[same].max(axis=1)
        assert np.quantile(steps, 0.999) <= 1
        found, expected = one.arrays(), other.arrays()
        covered = same & (one.row != NOTHING)
        # Normals that a backend finds go by one neighbor more or less; what is blended is so in steps.
        estimated, blended = find_backend(backend).finds_normals, find_backend(backend).blends
        most = 0.995 if estimated else 1.0
        depth_step = np.abs(found["depth"][covered] / expected["depth"][covered] - 1)
        assert np.quantile(depth_step, most) <= (2e-5 if estimated else 5e-6)
        normal_step = np.abs(found["normal"][covered] - expected["normal"][covered])
        if blended and not estimated:
            assert np.quantile(normal_step, 0.99) <= _STORED
            assert normal_step.max() <= _STORED + _WEIGHED
        else:
            assert np.quantile(normal_step, most) <= (0.01 if estimated else 3e-6)
        np.testing.assert_allclose(found["value"][covered], expected["value"][covered], atol=0.3)
        color_step = np.abs(found["color"][covered] - expected["color"][covered])
        assert np.quantile(color_step, most) == 0


@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
def test_sectors_of_a_turned_pose_show_nearly_what_those_of_turned_points_do(
    renderer: Renderer, projection: str
) -> None:
    there = Pose(0, 0.0, "x", moved(CLOUD, TURNED))
    camera = camera_of(there.cloud, projection)
    one = drawn(renderer, POSE, camera, Layers(world_from_pose=TURNED), SECTORS)
    other = drawn(renderer, there, camera, None, SECTORS)
    covered = (one.row != NOTHING) & (other.row != NOTHING)
    assert covered.sum() > 1000
    assert (covered == (one.row != NOTHING) | (other.row != NOTHING)).mean() > 0.99
    assert (one.row == other.row).mean() > 0.85, "the sectors of the two lie otherwise"
    apart = np.abs(one.arrays()["depth"][covered] - other.arrays()["depth"][covered])
    assert np.quantile(apart, 0.99) < (4 * np.pi / len(CLOUD)) ** 0.5, "a spacing"


def picks(surface: Surface) -> list[Picked]:
    """What some covered pixels show."""
    picked = [pick(surface, x, y) for y, x in np.argwhere(surface.row != NOTHING)[::601].tolist()]
    assert len(picked) > 5
    return [one for one in picked if one is not None]


def positions(surface: Surface) -> NDArray[np.float64]:
    """Where some covered pixels are picked, and the points of them."""
    return np.array([[one.position, one.point, one.normal] for one in picks(surface)])


def test_picking_gives_places_in_the_world(renderer: Renderer) -> None:
    there = Pose(0, 0.0, "x", moved(CLOUD, TURNED))
    camera, layers = camera_of(there.cloud), Layers(world_from_pose=TURNED)
    one = drawn(renderer, POSE, camera, layers, "surfels")
    other = drawn(renderer, there, camera, None, "surfels")
    np.testing.assert_allclose(positions(one), positions(other), atol=1e-5)
    for picked in picks(one):  # at the outline, a splat reaches over the position
        assert picked.uncertainty is not None
        slack = max(0.01, picked.uncertainty)
        assert is_seen(one, picked.position, slack)
        assert not is_seen(one, picked.position - 0.5 * picked.normal, slack)
    assert not is_seen(one, TURNED.inverse.points(positions(one)[0, 0]), 0.01), "out of the picture"


def test_ends_of_distances_go_with_the_pose(renderer: Renderer) -> None:
    there = moved(CLOUD, TURNED)
    surface = drawn(renderer, POSE, camera_of(there), Layers(world_from_pose=TURNED), "surfels")
    places = [pick(surface, x, y) for y, x in np.argwhere(surface.row != NOTHING)[[100, 3000]].tolist()]
    ends = [SurfacePoint.of(place, POSE, place=TURNED) for place in places if place is not None]
    for end, place in zip(ends, places, strict=True):
        assert place is not None
        position = TURNED.points(np.array(end.position))
        np.testing.assert_allclose(position, place.position, atol=1e-6)
        assert np.linalg.norm(position - there.world()[end.id]) < 0.1
        assert end.spacing is not None
        assert end.spacing < 0.1
        assert end.uncertainty == pytest.approx(place.uncertainty, rel=1e-6)
        again = followed(end, POSE)
        assert again is not None
        np.testing.assert_allclose(again.position, end.position, atol=1e-6)


def test_a_moved_pose_is_judged_where_it_is(renderer: Renderer) -> None:
    mesh, size = sphere_mesh(48), SIZE
    truth = Mesh(moved_vertices(mesh.points, TURNED), mesh.faces)
    cloud = moved(CLOUD, TURNED)
    camera = Camera.orbit(cloud.bounds(), 30, 20, aspect=4 / 3)
    judge = Judge.of(renderer.gpu, truth, camera, size, Look(light="head"), cloud, None)
    errors = []
    for pose, layers in ((POSE, Layers(world_from_pose=TURNED)), (Pose(0, 0.0, "x", cloud), Layers())):
        surface = Surface(renderer.gpu, size)
        render_frame(renderer, Request(pose, camera, "surfels", None, Look(light="head"), layers), surface)
        errors.append(judge.errors(surface))
    assert errors[0].keys() == errors[1].keys()
    for name, value in errors[0].items():
        assert value == pytest.approx(errors[1][name], rel=0.02, abs=2e-3), name


def moved_vertices(cloud: PointCloud, place: Rigid) -> PointCloud:
    """The vertices of a mesh that is moved."""
    normals = cloud.normals.astype(np.float64) @ place.rotation.T
    return PointCloud.from_arrays(place.points(cloud.world()), normals=normals, colors=cloud.colors)


def test_an_anonymous_picture_shows_the_same(renderer: Renderer) -> None:
    place = turned(0.7, (3.0, -1.0, 12.0))
    far = Rigid(np.block([[np.eye(3), np.array([[4096.0], [-512], [2048]])], [np.zeros((1, 3)), 1]]))
    pose = Pose(0, 5.0, "somebody", moved(CLOUD, far))
    layers = Layers({"deviation": DEVIATION}, place)
    camera = Camera.orbit(place.bounds(pose.cloud.bounds()), 30, 20, aspect=4 / 3)
    request = Request(pose, camera, "points", None, Look(color_by="deviation"), layers)
    pictures = []
    for each in (request, anonymous_request(request, 5.0)):
        surface = Surface(renderer.gpu, SIZE)
        render_frame(renderer, each, surface)
        pictures.append(surface.image())
    assert len(np.unique(pictures[0].reshape(-1, 4), axis=0)) > 50
    assert (pictures[0] == pictures[1]).all(axis=2).mean() > 0.99


def test_bounds_and_inverse_of_a_motion() -> None:
    points = TURNED.points(CLOUD.world())
    box = TURNED.bounds(CLOUD.bounds())
    assert (points >= box.low - 1e-9).all()
    assert (points <= box.high + 1e-9).all()
    np.testing.assert_allclose(TURNED.inverse.points(points), CLOUD.world(), atol=1e-9)
    still = Rigid()
    assert still.points(points) is points
    assert still.bounds(box) is box

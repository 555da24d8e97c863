"""Places that are clicked, on scenes whose points are where they are known to be."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import replace

import filling
import numpy as np
import pytest
from numpy.typing import NDArray
from scenes import looking_down_z, plane, sphere

from viewer.analysis.measures.distances import distance_of
from viewer.analysis.pick import Neighbor, Picked, pick
from viewer.analysis.surface_point import SurfacePoint, followed
from viewer.analysis.words import SURE
from viewer.camera import Camera
from viewer.errors import InputError
from viewer.gpu.constants import EMPTY
from viewer.picture.surface import NOTHING, Surface
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose

Draw = Callable[..., Surface]
SIZE = (60, 40)
FAR = np.array([1e7, -2e7, 1e7])  # of the size of UTM coordinates


def looking_from(eye: NDArray[np.float64], **fields: object) -> Camera:
    return Camera(**{**looking_down_z(**fields).to_json(), "eye": eye, "target": eye - np.array([0, 0, 1])})


def clicked(surface: Surface, camera: Camera, point: NDArray[np.float64]) -> SurfacePoint:
    """The end that a click on the pixel of a point sets."""
    offsets = (point - surface.pose.cloud.origin)[None]
    x, y = surface.view.project(offsets)[0][0]
    picked = pick(surface, int(x), int(y))
    assert picked is not None
    return SurfacePoint.of(picked, Pose(0, 0.0, "", surface.pose.cloud))


def end(position: tuple[float, float, float], spacing: float | None = 0.1, **fields: object) -> SurfacePoint:
    return SurfacePoint(**{"frame": 0, "time": 0.0, "position": position, "id": 0,
                  "spacing": spacing, "level": 0} | fields)  # fmt: skip


@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
@pytest.mark.parametrize("offset", [np.zeros(3), FAR], ids=["near", "far"])
def test_ends_are_the_picked_places_at_points_that_are_known(
    draw: Draw, projection: str, offset: NDArray[np.float64]
) -> None:
    rng = np.random.default_rng(5)
    # In steps of 2^-10, so that float64 holds them exactly at either place.
    points = np.round(rng.uniform([-1, -0.7, -5], [1, 0.7, -4], (7, 3)) * 1024) / 1024 + offset
    fields = {"projection": projection, "height": 2.0} if projection == "orthographic" else {"fov_y": 29}
    camera = looking_from(offset, **fields)
    surface = draw(PointCloud.from_arrays(points), camera, SIZE)
    seen = sorted(set(surface.id[surface.id != NOTHING].tolist()))
    assert len(seen) > 4
    pixel = 2.6 / SIZE[1]  # at depth 5
    for a, b in itertools.pairwise(seen):
        ends = [clicked(surface, camera, points[i]) for i in (a, b)]
        for made, i in zip(ends, (a, b), strict=True):
            assert (made.id, made.level) == (i, 0)
            assert math.dist(made.position, points[i]) <= pixel / math.sqrt(2), "within the pixel"
            np.testing.assert_allclose(made.position + np.array(made.neighbors[0].offset), points[i])
        distance, sigma = distance_of(*ends)
        assert abs(distance - math.dist(points[a], points[b])) < SURE * sigma


def test_an_end_has_the_spacing_around_its_point_and_the_frame_of_its_pose(draw: Draw) -> None:
    surface = draw(plane(100, depth=4.0), looking_down_z(), SIZE, "surfels")
    picked = pick(surface, 30, 20)
    assert picked is not None
    made = SurfacePoint.of(picked, Pose(7, 0.28, "", surface.pose.cloud))
    assert (made.frame, made.time, made.id) == (7, 0.28, picked.id)
    assert made.spacing == pytest.approx(0.05, rel=0.2)


@pytest.mark.parametrize("hole", [0.0, 3.2])
def test_a_filled_place_between_points_of_one_surface_is_taken(draw: Draw, hole: float) -> None:
    """Not so in the middle of a hole that is some spacings wide to each side."""
    dense = sphere(3000)
    spacing = math.sqrt(4 * math.pi / 3000)
    points = dense.positions + dense.origin
    away = np.linalg.norm(points - np.array([0.0, 0.0, 1.0]), axis=1)
    cloud = PointCloud.from_arrays(points[(away > hole * spacing) & (points[:, 2] > 0)])
    camera = Camera(eye=(0.0, 0.0, 3.0), target=(0.0, 0.0, 0.0), fov_y=45.0)
    params = {"reach": 100.0, "widest": 3.0}
    surface = draw(cloud, camera, (120, 120), "pyramidal", params=params)
    filled = (surface.level > 0) & (surface.level < EMPTY)
    rows, columns = np.nonzero(filled[58:62, 58:62])
    assert len(rows) > 10
    taken, inside, pose = 0, 0, Pose(0, 0.0, "", cloud)
    for row, column in zip(rows.tolist(), columns.tolist(), strict=True):
        picked = pick(surface, 58 + column, 58 + row)
        assert picked is not None
        try:
            spot = SurfacePoint.of(picked, pose)
        except InputError:
            continue
        assert spot.uncertainty is not None
        taken, inside = taken + 1, inside + (abs(np.linalg.norm(spot.position) - 1) <= spot.uncertainty)
    if hole:
        assert taken == 0
    else:
        assert taken > 0.9 * len(rows)
        assert inside >= 0.95 * taken


def test_a_filled_place_is_refused_unless_allowed(draw: Draw) -> None:
    whole = plane(60, depth=4.0, spacing=0.05)
    hole = np.linalg.norm(whole.world()[:, :2], axis=1) < 4 * 0.05
    cloud = PointCloud.from_arrays(whole.world()[~hole])
    surface = draw(cloud, looking_down_z(), SIZE, filling.BACKEND)
    y, x = np.argwhere(surface.level == 2)[0].tolist()
    picked, pose = pick(surface, x, y), Pose(0, 0.0, "", cloud)
    assert picked is not None
    with pytest.raises(InputError, match=r"renderer has filled a hole\. Pass filled=True"):
        SurfacePoint.of(picked, pose)
    made = SurfacePoint.of(picked, pose, filled=True)
    assert (made.id, made.level) == (None, 2)
    assert made.position == tuple(picked.position)
    nearest = np.linalg.norm(cloud.world() - picked.position, axis=1).min()
    assert made.spacing is not None
    assert made.spacing >= nearest * (1 - 1e-5)
    assert made.uncertainty is not None


def test_a_place_where_another_surface_may_be_meant_is_refused_unless_allowed() -> None:
    pose = Pose(0, 0.0, "", plane(40, depth=4.0))
    picked = Picked(np.array([0.01, 0.01, -4.0]), level=0, doubt=0.12)
    with pytest.raises(InputError, match=r"in front or behind \(12%\)\. Pass doubtful=True"):
        SurfacePoint.of(picked, pose)
    assert SurfacePoint.of(picked, pose, doubtful=True).at_outline
    assert not SurfacePoint.of(replace(picked, doubt=0.04), pose).at_outline


def test_on_a_measured_surface_without_a_point_the_spacing_counts() -> None:
    cloud = plane(40, depth=4.0)
    made = SurfacePoint.of(Picked(np.array([0.01, 0.01, -4.0]), level=0), Pose(0, 0.0, "", cloud))
    assert made.spacing == pytest.approx(0.05, rel=0.2)


def spread(*deviations: float) -> tuple[float, float, float, float, float, float]:
    """The covariance of independent deviations along the axes."""
    x, y, z = (deviation**2 for deviation in deviations)
    return x, 0.0, 0.0, y, 0.0, z


# --- through time ---------------------------------------------------------------------------


def moved(index: int) -> Pose:
    """Four points that grow apart from frame to frame; number 1 is missing in frame 3."""
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]) * (1 + index) + FAR
    if index == 3:
        points[1] = np.nan
    return Pose(index, index / 25, "", PointCloud.from_arrays(points))


def at_point(pose: Pose, id: int) -> SurfacePoint:
    return end(tuple(pose.cloud.world(id)), id=id, frame=pose.index, time=pose.time)


def test_it_follows_its_point_where_the_scan_has_one_topology() -> None:
    made = at_point(moved(0), 2)
    there = followed(made, moved(4))
    assert there == at_point(moved(4), 2)
    assert followed(there, moved(0)) == made
    assert followed(at_point(moved(0), 1), moved(3)) is None, "its point is missing there"
    assert followed(replace(made, id=None), moved(4)) is None, "it lies at no point"


def turned_patch(index: int) -> Pose:
    """Twelve points in a plane that turn about z by 20 degrees a frame, and go up; a point far away stays."""
    angle = math.radians(20 * index)
    turn = np.array(
        [[math.cos(angle), -math.sin(angle), 0], [math.sin(angle), math.cos(angle), 0], [0, 0, 1]]
    )
    x, y = np.meshgrid(np.arange(4.0), np.arange(3.0))
    patch = np.stack([x.ravel() + 10, y.ravel(), np.zeros(12)], axis=1) @ turn.T + [0, 0, index]
    return Pose(index, index / 25, "", PointCloud.from_arrays(np.concatenate([patch, [[0, 0, -50]]])))


def test_an_end_beside_its_points_turns_with_them() -> None:
    start, (ox, oy, oz) = turned_patch(0), (11.4, 0.7, 0.05)
    near = tuple(Neighbor(i, tuple(start.cloud.world(i) - [ox, oy, oz])) for i in (1, 2, 5, 6, 9))
    one = end((ox, oy, oz), id=1, covariance=spread(0.3, 0.1, 0), neighbors=near)
    assert followed(one, start) == one, "where it was made, nothing moves"
    there = followed(one, turned_patch(2))
    assert there is not None
    angle = math.radians(40)
    expected = [
        ox * math.cos(angle) - oy * math.sin(angle),
        ox * math.sin(angle) + oy * math.cos(angle),
        oz + 2,
    ]
    np.testing.assert_allclose(there.position, expected, atol=1e-5)
    assert there.spread is not None
    np.testing.assert_allclose(np.linalg.eigvalsh(there.spread), [0, 0.01, 0.09], atol=1e-4)
    assert there.spread[0, 1] > 0.01, "it is turned too"
    back = followed(there, start)
    assert back is not None
    np.testing.assert_allclose(back.position, one.position, atol=1e-5)


def test_points_that_move_each_their_own_way_make_an_end_less_sure() -> None:
    start = turned_patch(0)
    torn = start.cloud.world() + np.random.default_rng(3).normal(0, 0.2, (13, 3))
    near = tuple(Neighbor(i, tuple(start.cloud.world(i) - [11.4, 0.7, 0.0])) for i in range(12))
    made = end((11.4, 0.7, 0.0), id=1, covariance=spread(0.1, 0.1, 0.1), neighbors=near)
    there = followed(made, Pose(1, 0.04, "", PointCloud.from_arrays(torn)))
    assert there is not None
    assert there.spread is not None
    assert np.sqrt(np.diag(there.spread)) == pytest.approx(math.hypot(0.1, 0.2), rel=0.3)

"""Range views: back-projection, what counts as measured, ids, normals from the grid."""

from __future__ import annotations

import weakref
from dataclasses import replace

import numpy as np
import pytest
from range_scenes import LENSES, shape_view, sphere_view
from scenes import rarely

from viewer.errors import InputError
from viewer.scan.colors import linear_from_srgb8, srgb8_from_linear
from viewer.scan.estimate import estimate
from viewer.scan.pose import Pose
from viewer.scan.range_view import RangeView, mask_of, merge, up_axis

EYE = (2.0, 1.5, 4.0)
UTM = np.array([665187.25, 5648349.5, 241.75])


def flat(depth: object, **fields: object) -> RangeView:
    """A view from the origin down -z, its principal point in the middle of the picture."""
    image = np.array(depth, np.float32)
    height, width = image.shape
    given = {"mask": np.ones(image.shape, bool), "fx": 2.0, "fy": 2.0, "cx": width / 2, "cy": height / 2}
    return RangeView(**{"depth": image, "world_to_camera": np.eye(4), **given, **fields})


def test_a_pixel_is_where_its_centre_looks() -> None:
    view = flat([[2, 4, 6], [2, 4, 6]])
    expected = [[-1, 0.5, -2], [0, 1, -4], [3, 1.5, -6], [-1, -0.5, -2], [0, -1, -4], [3, -1.5, -6]]
    assert view.positions().tolist() == expected
    assert view.points().world().tolist() == expected


@pytest.mark.parametrize("center", [np.zeros(3), UTM])
def test_points_lie_on_the_surface(center: np.ndarray) -> None:
    view = sphere_view(center + EYE, center)
    from_center = np.linalg.norm(view.positions() - center, axis=1)
    rounding = 4.7 * 2**-23  # of float32 depths up to 4.7, along rays no longer than 1.2 of it
    assert len(from_center) > 300
    assert np.abs(from_center - 1).max() < rounding
    assert np.linalg.norm(view.points().world() - center, axis=1) == pytest.approx(1, abs=2 * rounding)
    assert view.eye == pytest.approx(center + EYE, abs=1e-8)


def test_points_project_to_the_pixels_they_came_from() -> None:
    view = sphere_view(EYE)
    camera = view.positions() @ view.world_to_camera[:3, :3].T + view.world_to_camera[:3, 3]
    row, column = np.nonzero(view.valid())
    assert view.cx - view.fx * camera[:, 0] / camera[:, 2] == pytest.approx(column + 0.5, abs=1e-11)
    assert view.cy + view.fy * camera[:, 1] / camera[:, 2] == pytest.approx(row + 0.5, abs=1e-11)
    assert -camera[:, 2] == pytest.approx(view.depth[row, column].astype(float), rel=1e-14)


def test_what_counts_as_measured() -> None:
    view = flat([[1, np.nan, np.inf], [0, -1, 1e-30], [-np.inf, 2, 3]])
    masked = replace(view, mask=np.array([[1, 1, 1], [1, 1, 1], [1, 0, 1]], bool))
    assert np.flatnonzero(view.valid()).tolist() == [0, 5, 7, 8]
    points = masked.points()
    assert points.ids.tolist() == [0, 5, 8]
    assert points.dropped == 0  # an empty pixel is no damaged point


def test_views_come_in_order_and_ids_tell_the_pixel() -> None:
    first, second = sphere_view(EYE), sphere_view((-2, 0, 4), size=(30, 20))
    points = merge((first, second))
    assert np.array_equal(points.world().shape, (len(points.ids), 3))
    own = np.count_nonzero(first.valid())
    assert np.array_equal(points.ids[:own], np.flatnonzero(first.valid()))
    assert np.array_equal(points.ids[own:], 48 * 40 + np.flatnonzero(second.valid()))
    assert np.array_equal(points.scalars["view"], [0] * own + [1] * (len(points) - own))
    both = np.concatenate([first.positions(), second.positions()])
    assert points.world() == pytest.approx(both, abs=1e-6)
    confidence = np.concatenate([view.confidence[view.valid()] for view in (first, second)])
    assert np.array_equal(points.scalars["confidence"], confidence)


def test_attributes_that_one_view_lacks_are_absent() -> None:
    full = sphere_view(EYE)
    points = merge((full, replace(full, color=None, confidence=None)))
    assert points.colors is None
    assert list(points.scalars) == ["view"]
    assert full.points().normals is None  # not computed unless asked for


def test_colours_survive_the_way_to_linear_half_and_back() -> None:
    colors = np.arange(256, dtype=np.uint8).repeat(3).reshape(1, 256, 3)
    linear = linear_from_srgb8(colors)
    assert (linear[0, 0, 0], linear[0, 255, 0]) == (0, 1)
    assert linear[0, 188, 0] == pytest.approx(0.5029, abs=2e-4)  # sRGB's middle grey
    points = flat(np.ones((1, 256)), color=linear).points()
    assert np.array_equal(points.colors[:, :3], colors[0])
    odd = np.array([np.nan, np.inf, -np.inf, 7, -0.5], np.float16)
    assert srgb8_from_linear(odd).tolist() == [0, 255, 0, 255, 0]


def test_normals_of_a_sphere() -> None:
    view = replace(sphere_view(EYE, size=(200, 200)), mask=np.ones((200, 200), bool))
    normals, outward = view.normals(), view.positions()
    assert normals.dtype == np.float32
    assert np.linalg.norm(normals, axis=1) == pytest.approx(1, abs=1e-6)
    facing = np.einsum("ij,ij->i", outward, view.eye - outward) / np.linalg.norm(view.eye - outward, axis=1)
    angles = np.degrees(np.arccos(np.clip(np.einsum("ij,ij->i", normals, outward), -1, 1)))
    assert np.median(angles) < 0.1
    assert angles[facing > 0.3].max() < 2
    assert np.array_equal(merge((view, view), normals=True).normals, np.tile(normals, (2, 1)))


def test_normals_are_of_planes_through_neighbours() -> None:
    """Against the plain way: a weighted fit of each pixel's window, one by one."""
    view = sphere_view(EYE, size=(37, 31))  # with holes
    rng = np.random.default_rng(1)
    noisy = (view.depth * rng.normal(1, 0.01, view.depth.shape)).astype(np.float32)
    view = replace(view, depth=noisy, fy=20.0)
    depth = np.where(view.valid(), view.depth.astype(float), np.nan)
    expected = []
    for y, x in np.argwhere(view.valid()):
        rows, weights = [], []
        for v, u in np.argwhere(view.valid()):
            step = np.abs(depth[v, u] - depth[y, x]) / min(depth[v, u], depth[y, x])
            if max(abs(u - x), abs(v - y)) <= 2 and step <= 10 / 20:
                ray = (u + 0.5 - view.cx) / view.fx, (view.cy - v - 0.5) / view.fy, -1.0
                rows.append((*ray, depth[y, x] / depth[v, u]))
                weights.append((3 - abs(u - x)) * (3 - abs(v - y)))
        own = weights.index(9)
        rows, weights = np.array(rows), np.sqrt(weights)
        away, _, rank, _ = np.linalg.lstsq(weights[:, None] * rows[:, :3], weights * rows[:, 3])
        if rank < 3:
            away = rows[own, :3]
        expected.append(view.world_to_camera[:3, :3].T @ -away / np.linalg.norm(away))
    assert len(expected) > 200
    assert view.normals() == pytest.approx(np.array(expected), abs=1e-5)


def test_noise_hurts_normals_of_the_grid_no_more_than_those_of_16_neighbours() -> None:
    from open3d import geometry, utility

    view, rng = sphere_view(EYE, size=(120, 100)), np.random.default_rng(0)
    noise = rng.normal(0, 0.3 * 4 / view.fx, view.depth.shape)  # of 0.3 pixel footprints
    noisy = replace(view, depth=(view.depth + noise).astype(np.float32))
    outward = view.positions()
    places = geometry.PointCloud(utility.Vector3dVector(noisy.positions()))
    places.estimate_normals(geometry.KDTreeSearchParamKNN(16))
    errors = [
        np.median(np.arccos(np.clip(np.abs(np.einsum("ij,ij->i", normals, outward)), 0, 1)))
        for normals in (noisy.normals(), np.asarray(places.normals))
    ]
    assert errors[0] <= 1.05 * errors[1]
    assert np.degrees(errors[0]) < 3


def test_normals_do_not_bridge_edges() -> None:
    """A wall behind a wall, both facing the pod: no normal leans across the step between them."""
    depth = np.full((6, 8), 2.0)
    depth[:, 4:] = 30.0  # 14 pixel footprints away
    assert flat(depth).normals() == pytest.approx(np.tile([0, 0, 1], (48, 1)), abs=1e-6)
    depth[:, 4:] = 8.0  # 3 footprints: a slope
    assert np.abs(flat(depth).normals()[:, 0]).max() > 0.5


def test_normals_beside_holes_are_one_sided_and_alone_face_the_pod() -> None:
    row, column = np.mgrid[:5, :8]
    slope = flat(np.ones((5, 8)), fx=50.0, fy=50.0)
    ray = np.stack([(column + 0.5 - 4) / 50, (2.5 - row - 0.5) / 50, -np.ones((5, 8))], axis=2)
    normal = np.array([0.6, 0.0, 0.8])
    depth = (-1 / (ray @ normal)).astype(np.float32)  # the plane normal . x = -1
    depth[:, 2::3] = np.nan  # every pixel keeps one neighbour in its row
    assert replace(slope, depth=depth).normals() == pytest.approx(
        np.tile(normal, (np.isfinite(depth).sum(), 1)), abs=1e-4
    )
    alone = flat([[np.nan, np.nan], [np.nan, 2]])
    assert alone.normals()[0] == pytest.approx(-alone.positions()[0] / np.linalg.norm(alone.positions()[0]))


def test_points_beyond_float32_are_dropped_and_ids_stay_right() -> None:
    largest = float(np.finfo(np.float32).max)
    points = flat([[1, largest, 2]], fx=0.5).points()
    assert (points.ids.tolist(), points.dropped) == ([0, 2], 1)


def test_normals_that_a_pose_lacks_are_those_of_its_grids() -> None:
    largest = float(np.finfo(np.float32).max)
    dropping = flat([[1, largest, 2], [1, 1, np.nan]], fx=0.5)  # the points of largest do not fit
    for views in ((sphere_view(EYE), sphere_view((-2, 0, 4))), (sphere_view(EYE), dropping)):
        pose = Pose.of(0, 0.0, "x", views)
        normals = estimate(pose, ["normals"]).arrays["normals"]
        assert np.array_equal(normals, merge(views, normals=True).normals)
        assert len(normals) == len(pose.cloud)


def test_points_of_one_view_know_where_its_pod_stood() -> None:
    view = sphere_view(EYE)
    assert view.points().viewpoint == pytest.approx(view.eye, abs=1e-12)
    assert merge((view, sphere_view((-2, 0, 4)))).viewpoint is None
    heights = replace(view, kind="height", fx=100.0, fy=100.0)
    assert heights.points().viewpoint is None  # it looks from nowhere


def test_a_view_of_nothing_has_no_points() -> None:
    view = flat([[np.nan, 1]], mask=np.array([[True, False]]))
    for call in (view.points, lambda: Pose.of(0, 0.0, "x", (view,))):
        with pytest.raises(InputError, match="contains no points"):
            call()
    assert view.normals().shape == (0, 3)
    assert len(merge((view, flat([[1.0]])))) == 1


def test_a_pose_holds_views_and_their_points() -> None:
    views = (sphere_view(EYE), sphere_view((-2, 0, 4)))
    pose = Pose.of(3, 0.5, "f3.exr", views)
    assert pose.views is views
    assert np.array_equal(pose.cloud.positions, merge(views).positions)
    reference = weakref.ref(pose)
    assert reference() is pose
    bare = Pose.of(0, 0.0, "a.ply", pose.cloud)
    assert bare.views == ()
    assert bare.cloud is pose.cloud


SEEN = [
    *((kind, lens, False) for kind in ("z", "range") for lens in LENSES),
    ("height", "none", False),
    ("height", "none", True),
    ("z", "none", True),
    ("z", "barrel", True),
]


@pytest.mark.parametrize("name", ["sphere", *rarely("plane")])
@pytest.mark.parametrize(("kind", "lens", "measured"), SEEN)
def test_shapes_of_every_kind(name: str, kind: str, lens: str, measured: bool) -> None:
    view, points, normals = shape_view(name, kind, lens, measured)
    assert len(points) > 1000
    assert view.positions() == pytest.approx(points, abs=1e-6)  # float32 depths and places up to 8
    back = view.world_to_camera[2, :3] if kind == "height" else view.eye - points
    facing = (normals * back).sum(axis=1) / np.linalg.norm(back, axis=-1)
    tilt = np.degrees(np.arccos(np.clip(np.einsum("ij,ij->i", view.normals(), normals), -1, 1)))
    if name == "plane":
        assert tilt.max() < 0.02
    else:
        assert np.median(tilt) < 0.2
        assert tilt[facing > 0.3].max() < 3  # beside the edge: a pixel and a half of a radius of 38


@pytest.mark.parametrize(("kind", "lens", "measured"), [case for case in SEEN if not case[2]])
def test_points_project_back(kind: str, lens: str, measured: bool) -> None:
    view, _, _ = shape_view("plane", kind, lens)
    pixels, depths = view.project(view.positions())
    row, column = np.nonzero(view.valid())
    assert np.abs(pixels - np.stack([column + 0.5, row + 0.5], axis=1)).max() < 1e-6
    assert depths == pytest.approx(view.depth[row, column].astype(float), rel=1e-12)


def test_what_is_not_before_the_pod_is_not_seen() -> None:
    points = np.array([[0.5, 0.5, -1.0], [0, 0, 0], [1, 1, 1]])
    for kind in ("z", "range"):
        pixels, depths = flat(np.ones((4, 4)), kind=kind).project(points)
        assert pixels[0].tolist() == [3, 1]
        assert depths[0] == (1 if kind == "z" else np.sqrt(1.5))
        assert np.isnan(pixels[1:]).all()
        assert np.isnan(depths[1:]).all()
    pixels, depths = flat(np.ones((4, 4)), kind="height").project(points)
    assert pixels.tolist() == [[3, 1], [2, 2], [4, 0]]
    assert depths.tolist() == [1, 0, -1]
    # Far outside of the picture this lens has turned back: it does not show that place a second time.
    pixels, depths = flat(np.ones((4, 4)), distortion=(-0.05, 0, 0, 0)).project(points * (8, 8, 1))
    assert np.isnan(pixels[0]).all()
    assert np.isnan(depths[0])


def test_heights_may_be_any_number() -> None:
    view = flat([[1, np.nan, np.inf], [0, -1, 1e-30], [-np.inf, 2, 3]], kind="height")
    assert np.flatnonzero(view.valid()).tolist() == [0, 3, 4, 5, 7, 8]
    assert view.positions()[2].tolist() == [0, 0, 1]


def test_places_that_were_not_measured_are_none() -> None:
    xy = np.zeros((2, 2, 2), np.float32)
    xy[0, 0, 1], xy[1, 1, 0] = np.nan, np.inf
    view = flat(np.ones((2, 2)), xy=xy)
    assert view.valid().tolist() == [[False, True], [True, False]]
    assert np.isfinite(view.positions()).all()
    assert np.isfinite(view.normals()).all()
    assert view.points().ids.tolist() == [1, 2]


@pytest.mark.parametrize(("kind", "lens", "measured"), SEEN)
def test_scaling_scales_positions(kind: str, lens: str, measured: bool) -> None:
    view, points, _ = shape_view("sphere", kind, lens, measured)
    longer = view.scaled(1000.0, "um")
    assert longer.positions() == pytest.approx(1000 * points, abs=1e-3)
    assert longer.unit == "um"
    pixels, depths = longer.project(1000 * points)
    assert pixels == pytest.approx(view.project(points)[0], abs=1e-9)
    assert depths == pytest.approx(1000 * view.project(points)[1], rel=1e-12)


def test_colours_of_pictures_are_kept_as_they_are() -> None:
    rng = np.random.default_rng(4)
    colors = rng.integers(0, 256, (2, 3, 3), np.uint8)
    eight, half = flat(np.ones((2, 3)), color=colors), flat(np.ones((2, 3)), color=linear_from_srgb8(colors))
    merged = merge((eight, half)).colors[:, :3]
    assert np.array_equal(merged, np.tile(colors.reshape(-1, 3), (2, 1)))


def test_a_mask_of_numbers() -> None:
    numbers = np.array([0, 0.005, 0.02, 1], np.float16)
    assert mask_of(numbers).tolist() == [False, False, True, True]
    assert mask_of(np.array([0, 1, 255], np.uint8)).tolist() == [False, True, True]


def turned_to(up: tuple[float, float, float], ahead: tuple[float, float, float]) -> RangeView:
    """A view of a pod that looks ahead, with something of the world up in its picture."""
    back = -np.array(ahead, float)
    matrix = np.eye(4)
    matrix[:3, :3] = [np.cross(up, back), up, back]
    return replace(flat([[1, 1], [1, 1]]), world_to_camera=matrix)


def test_what_is_up_is_what_is_up_in_the_pictures() -> None:
    down, along = turned_to((0, -1, 0), (0, 0, 1)), turned_to((0, 0, 1), (1, 0, 0))
    assert up_axis([flat([[1, 1], [1, 1]])]) == "+y"
    assert up_axis([down]) == "-y"
    assert up_axis([along, turned_to((0, 0, 1), (0, -1, 0))]) == "+z"
    assert up_axis([turned_to((0.6, 0.8, 0), (0, 0, -1))]) == "+y"
    assert up_axis([down, turned_to((0, 1, 0), (0, 0, -1))]) is None
    assert up_axis([]) is None


MIRROR = np.diag([1.0, 1, -1, 1])


@pytest.mark.parametrize(
    ("fields", "reason"),
    [
        ({"depth": np.zeros(4, np.float32)}, r"depth of a range view has shape \(4,\)"),
        ({"depth": np.zeros((0, 4), np.float32)}, r"has shape \(0, 4\)"),
        ({"depth": np.zeros((2, 2))}, r"depth is \(2, 2\) float64, expected \(2, 2\) float32"),
        ({"mask": np.ones((2, 3), bool)}, r"mask is \(2, 3\) bool, expected \(2, 2\) bool"),
        ({"mask": None}, "mask is .* NoneType, expected"),
        ({"color": np.zeros((2, 2, 3))}, r"color is \(2, 2, 3\) float64, expected .* float16 or uint8"),
        ({"color": np.zeros((2, 2, 4), np.uint8)}, r"color is \(2, 2, 4\) uint8, expected \(2, 2, 3\)"),
        ({"xy": np.zeros((2, 2), np.float32)}, r"xy is \(2, 2\) float32, expected \(2, 2, 2\) float32"),
        ({"kind": "depth"}, "unknown kind of depth 'depth'. Known: height, range, z"),
        (
            {"kind": "range", "xy": np.zeros((2, 2, 2), np.float32)},
            "measured x and y together with distances",
        ),
        ({"kind": "height", "distortion": LENSES["barrel"]}, "heights has no lens, but a lens distortion"),
        ({"distortion": (0.1, 0.2)}, r"distortion is \(0.1, 0.2\), expected the numbers k1 k2 p1 p2"),
        ({"distortion": (0.1, np.nan, 0, 0)}, r"distortion is \(0.1, nan, 0, 0\)"),
        (
            {"distortion": (-2.0, 0, 0, 0)},
            "maps different directions to the same pixel",
        ),
        (
            {"distortion": (1e300, -1e300, 1e300, 0)},
            "maps different directions to the same pixel",
        ),
        (
            {"fx": 1e-20, "distortion": LENSES["barrel"]},
            "maps different directions to the same pixel",
        ),
        ({"fx": 1e-31}, "calibration cannot be used: fx 1e-31"),
        ({"cy": -1e30}, r"calibration cannot be used: .* cy -1e\+30"),
        ({"confidence": [[1, 1], [1, 1]]}, "confidence is .* list"),
        ({"fx": 0.0}, "calibration cannot be used: fx 0"),
        ({"cy": np.nan}, "cy nan"),
        ({"world_to_camera": np.eye(3)}, r"world_to_camera is \(3, 3\)"),
        ({"world_to_camera": 1.01 * np.eye(4)}, "must be a rotation and a translation"),
        ({"world_to_camera": MIRROR}, "must be a rotation and a translation"),
        ({"world_to_camera": np.full((4, 4), np.nan)}, "must be a rotation and a translation"),
        ({"world_to_camera": np.full((4, 4), 1e300)}, "must be a rotation and a translation"),
    ],
)
def test_what_is_no_range_view(fields: dict[str, object], reason: str) -> None:
    view = flat([[1, 1], [1, 1]])
    with pytest.raises(InputError, match=reason):
        replace(view, **fields)


@pytest.mark.parametrize("measured", [False, True])
def test_a_part_of_a_view_sees_what_its_pixels_see(measured: bool) -> None:
    view = shape_view("sphere", "z", "kinect", measured)[0]
    part = view.cropped(slice(20, 60), slice(31, 90))
    rows, columns = np.nonzero(part.valid())
    assert len(rows) > 500
    np.testing.assert_allclose(part.positions(), view.unproject(rows + 20, columns + 31), rtol=0, atol=1e-12)
    np.testing.assert_array_equal(part.depth, view.depth[20:60, 31:90])
    every = view.cropped(slice(None), slice(None))
    np.testing.assert_array_equal(every.positions(), view.positions())
    np.testing.assert_array_equal(view.unproject(*np.nonzero(view.valid())), view.positions())

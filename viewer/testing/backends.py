"""The contract of backends: scenes with known answers, odd inputs, and previews."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from itertools import product

import numpy as np

from ..backends import Backend, backend, backends
from ..camera import Camera
from ..drawing.frame import render_frame
from ..drawing.renderer import shared_renderer
from ..drawing.request import Request
from ..gpu.pose import GpuPose
from ..look import Look
from ..picture.frame_view import FrameView
from ..picture.sample import is_sampled
from ..picture.surface import Surface
from ..scan.points import PointCloud
from ..scan.pose import Pose
from ..splatting.amplify import FEEDS
from .check import Check
from .scenes import NOTHING, draw, looking_down_z, of_variant, plane, sphere

BUFFERS = tuple(feed for feed in FEEDS if feed != "gs")  # feeds that give the same bits
SIZES = ((1, 1), (7, 3), (1, 240), (641, 1), (255, 257))  # of odd pictures, the most telling first
_PROJECTIONS = ("perspective", "orthographic")
_PREVIEW = (320, 240)
_ONE_POINT = Pose.of(0, 0.0, "one", PointCloud.from_arrays(np.zeros((1, 3))))


def draws_points(one: Backend) -> bool:
    """Whether a backend draws a scan of points; others need range views."""
    return one.draws(_ONE_POINT)


def variants(one: Backend) -> list[str]:
    """A backend in every way that changes its shaders but not its picture: "surfels instancing=gs".

    Of feeds that give the same bits, one is among them.
    """
    ways = [
        f"{one.name} {parameter.name}={word}"
        for parameter in one.parameters
        if parameter.affects == "speed"
        for word in parameter.choices
        if word not in ("auto", *BUFFERS[1:])
    ]
    return ways or [one.name]


def backend_checks(name: str) -> list[Check]:
    """The contract of the backend of this name, for each of its variants. A check draws with OpenGL.

    Raises InputError for an unknown name.
    """
    one = backend(name)
    if not draws_points(one):
        return []
    functions = [*_FOR_ALL, *(_FOR_POINTS if one.rows == "points" else ())]
    return (
        [
            Check("declarations", name, partial(_declarations, one)),
            Check("draw_returns_a_bool", name, partial(_draw_returns_a_bool, one)),
        ]
        + [
            Check(function.__name__[1:], name, partial(function, variant), variant)
            for variant in variants(one)
            for function in functions
        ]
        + [
            Check(f"odd_size_{size[0]}x{size[1]}", name, partial(_odd_size, variant, size), variant)
            for variant in variants(one)
            for size in SIZES
        ]
    )


# --- every backend ------------------------------------------------------------------------------


def _declarations(one: Backend) -> None:
    assert isinstance(one.title, str), "title is not a text"
    assert one.title.strip(), "title is empty"
    assert one.help.strip(), "the docstring of the module does not say what the backend draws"
    assert one.good_for.strip(), "good_for does not say when to choose the backend"
    assert one.params_class.__dataclass_params__.frozen, "params_class is not frozen"
    for parameter in one.parameters:
        assert parameter.help.strip(), f"parameter {parameter.name} has no help"


def _draw_returns_a_bool(one: Backend) -> None:
    """Draw once, and look at what `draw` returns."""
    returned: list[object] = []

    def noted(pose: GpuPose, frame: FrameView, surface: Surface) -> bool:
        returned.append(type(one).draw(one, pose, frame, surface))
        return bool(returned[-1])

    vars(one)["draw"] = noted
    try:
        draw(sphere(500), Camera(eye=(0, 0, 4)), (33, 33), one)
    finally:
        del vars(one)["draw"]
    assert returned, "it was not called"
    assert all(isinstance(each, bool) for each in returned), f"draw returns {returned[0]!r}, expected a bool"


def _ties_go_to_the_lowest_id(name: str) -> None:
    cloud = PointCloud.from_arrays([[0, 0, -2.0]] * 500, normals=[[0, 0, 1]] * 500, radii=[0.5] * 500)
    surface = draw(cloud, looking_down_z(fov_y=60), (33, 33), name)
    assert set(np.unique(surface.id)) == {0, NOTHING}, np.unique(surface.id)


def _odd_size(name: str, size: tuple[int, int]) -> None:
    cloud = sphere(3000)
    surface = draw(cloud, Camera.orbit(cloud.bounds(), aspect=size[0] / size[1]), size, name)
    for channel, values in surface.arrays().items():
        assert values.shape[:2] == size[::-1], channel
    assert surface.image().shape == (size[1], size[0], 4)
    assert (surface.id != NOTHING).any(), "it shows nothing"


def _an_empty_pose_is_background(name: str) -> None:
    cloud = PointCloud.from_arrays(np.zeros((0, 3)), normals=np.zeros((0, 3)))
    surface = draw(cloud, Camera(eye=(0, 0, 5)), (20, 10), name, Look(background="#102030"))
    assert (surface.id == NOTHING).all()
    assert (surface.level == 255).all()
    assert (surface.image() == [0x10, 0x20, 0x30, 255]).all()


def _one_point_is_in_the_middle(name: str) -> None:
    cloud = PointCloud.from_arrays([[1e6, -2e6, 3e6]], normals=[[0, 0, 1]], radii=[1.0])
    assert draw(cloud, Camera.orbit(cloud.bounds()), (31, 31), name).id[15, 15] == 0


def _points_behind_the_eye_are_not_seen(name: str) -> None:
    cloud = PointCloud.from_arrays([[0, 0, 1.0], [0, 0, 0.0]], normals=[[0, 0, 1]] * 2, radii=[0.1] * 2)
    assert (draw(cloud, looking_down_z(), (32, 32), name).id == NOTHING).all()


def _switching_there_and_back_gives_the_same_picture(name: str) -> None:
    cloud = sphere(5000)
    camera = Camera.orbit(cloud.bounds(), 10, 10)
    first = draw(cloud, camera, (90, 70), name)
    for other in filter(draws_points, backends().values()):
        draw(cloud, camera, (90, 70), other)
    _assert_same(first, draw(cloud, camera, (90, 70), name))


def _a_far_away_scan_looks_as_it_does_at_the_origin(name: str) -> None:
    shift = np.array([4.5e6, 5.6e6, -1.2e6])
    near, far = sphere(5000), sphere(5000, center=(4.5e6, 5.6e6, -1.2e6))
    camera = Camera.orbit(near.bounds(), 25, 15)
    moved = Camera(
        eye=tuple(np.array(camera.eye) + shift),
        target=tuple(np.array(camera.target) + shift),
        fov_y=camera.fov_y,
    )
    one, other = draw(near, camera, (160, 120), name), draw(far, moved, (160, 120), name)
    # float64 itself resolves 1e-9 at this distance: a few points sit on pixel edges.
    assert (one.id != other.id).mean() < 0.005


def _the_same_preview_again_and_in_full_as_if_nothing_had_been(name: str) -> None:
    cloud = sphere(8_000)
    first, full = _preview(cloud, name, 0.3), _preview(cloud, name, 1.0)
    for share, count in product((0.5, 1.0), (12_000, 500)):
        _preview(sphere(count), name, share)
    for before, share in ((first, 0.3), (full, 1.0)):
        again = _preview(cloud, name, share)
        for channel, values in before.arrays().items():
            np.testing.assert_array_equal(again.arrays()[channel], values, err_msg=channel)
        _assert_same(before, again)
    assert full.stats.left_out == 0
    assert "preview" not in full.point_counts()


def _a_preview_of_few_points_shows_all(name: str) -> None:
    for cloud in (sphere(500), PointCloud.from_arrays(np.zeros((0, 3)), normals=np.zeros((0, 3)))):
        surface = _preview(cloud, name, 0.1, Camera(eye=(0, 0, 4)))
        assert (surface.stats.left_out, surface.stats.share) == (0, 1)


# --- backends that show the points themselves -----------------------------------------------------


def _the_nearer_wins_whatever_the_order(name: str) -> None:
    for order in ([-2.0, -3.0], [-3.0, -2.0]):
        points, normals = [[0, 0, z] for z in order], [[0, 0, 1]] * 2
        cloud = PointCloud.from_arrays(points, normals=normals, radii=[0.3, 0.3])
        surface = draw(cloud, looking_down_z(fov_y=60), (33, 33), name)
        assert surface.id[16, 16] == order.index(-2.0)
        np.testing.assert_allclose(surface.depth[16, 16], 2.0, rtol=1e-6)


def _a_plane_has_constant_depth(name: str) -> None:
    for projection in _PROJECTIONS:
        camera = looking_down_z(fov_y=40, projection=projection, height=2.0)
        surface = draw(plane(120, 3.0), camera, (64, 48), name)
        covered = surface.id != NOTHING
        assert covered.sum() > 1000, "the backend shows too little of the plane"
        np.testing.assert_allclose(surface.depth[covered], 3.0, rtol=_rounded(surface))


def _near_and_far_planes_cut(name: str) -> None:
    cloud = PointCloud.from_arrays(
        [[0.0, 0, -z] for z in (1, 2, 3)], normals=[[0, 0, 1]] * 3, radii=[0.5] * 3
    )
    for projection in _PROJECTIONS:
        camera = partial(looking_down_z, projection=projection, height=2.0)
        assert draw(cloud, camera(near=1.5), (33, 33), name).id[16, 16] == 1
        assert draw(cloud, camera(near=2.5), (33, 33), name).id[16, 16] == 2
        assert (draw(cloud, camera(near=1.5, far=1.8), (33, 33), name).id == NOTHING).all()


def _ids_are_those_of_the_file(name: str) -> None:
    points = np.array([[np.nan, 0, 0], [0, 0, -2.0], [np.inf, 0, 0], [0.5, 0, -2.0]])
    cloud = PointCloud.from_arrays(points, normals=[[0, 0, 1]] * 4, radii=[0.2] * 4)
    surface = draw(cloud, looking_down_z(fov_y=60), (65, 65), name)
    assert set(np.unique(surface.id)) == {1, 3, NOTHING}, np.unique(surface.id)


def _a_preview_shows_rows_of_the_sample_and_counts_the_others(name: str) -> None:
    cloud = sphere(20_000)
    surface = _preview(cloud, name, 0.25)
    assert surface.stats.share in (0.25, 1.0), "a renderer that is fast enough may draw all points"
    rows = np.unique(surface.row[surface.row != NOTHING])
    sampled = is_sampled(np.arange(len(cloud), dtype=np.uint32), surface.stats.share)
    assert sampled[rows].all()
    assert surface.stats.left_out == np.count_nonzero(~sampled)
    counts = surface.point_counts()
    assert counts.get("preview", 0) == surface.stats.left_out
    assert counts.pop("in") == len(cloud) == sum(counts.values())


def _ties_of_a_preview_go_to_the_lowest_row_of_the_sample(name: str) -> None:
    count = 2000
    normals = np.tile([0.0, 0, 1], (count, 1))
    cloud = PointCloud.from_arrays(np.zeros((count, 3)), normals=normals, radii=np.ones(count))
    surface = _preview(cloud, name, 0.2, Camera(eye=(0, 0, 4)))
    lowest = np.flatnonzero(is_sampled(np.arange(count, dtype=np.uint32), surface.stats.share))[0]
    assert set(np.unique(surface.row)) <= {lowest, NOTHING}
    assert (surface.row == lowest).any()


_FOR_ALL: tuple[Callable[[str], None], ...] = (
    _ties_go_to_the_lowest_id,
    _an_empty_pose_is_background,
    _one_point_is_in_the_middle,
    _points_behind_the_eye_are_not_seen,
    _switching_there_and_back_gives_the_same_picture,
    _a_far_away_scan_looks_as_it_does_at_the_origin,
    _the_same_preview_again_and_in_full_as_if_nothing_had_been,
    _a_preview_of_few_points_shows_all,
)
_FOR_POINTS: tuple[Callable[[str], None], ...] = (
    _the_nearer_wins_whatever_the_order,
    _a_plane_has_constant_depth,
    _near_and_far_planes_cut,
    _ids_are_those_of_the_file,
    _a_preview_shows_rows_of_the_sample_and_counts_the_others,
    _ties_of_a_preview_go_to_the_lowest_row_of_the_sample,
)


def _rounded(surface: Surface) -> float:
    """The relative error that a depth may have: a rounding of float32, or that of a hardware depth buffer."""
    from ..bench.rounding import Rounding

    if surface.gpu.software:
        return 3e-7
    quotient, view = Rounding.of(surface.gpu).quotient, surface.view
    steps = 2 * quotient if view.perspective else (quotient + 1) * max(view.reach / 3.0 - 1, 1)
    return max(3e-7, steps * 2.0**-23)


def _preview(cloud: PointCloud, name: str, share: float, camera: Camera | None = None) -> Surface:
    """A picture of a share of the points, which has to say whether it can be refined."""
    surface = Surface(shared_renderer().gpu, _PREVIEW)
    camera = camera or Camera.orbit(cloud.bounds(), 20, 10, aspect=_PREVIEW[0] / _PREVIEW[1])
    name, setting = of_variant(name)
    request = Request(Pose(0, 0.0, "test", cloud), camera, name, backend(name).params(setting))
    assert render_frame(shared_renderer(), request, surface, share=share) == (surface.stats.left_out > 0)
    return surface


def _assert_same(one: Surface, other: Surface) -> None:
    np.testing.assert_array_equal(one.id, other.id)
    np.testing.assert_array_equal(one.image(), other.image())

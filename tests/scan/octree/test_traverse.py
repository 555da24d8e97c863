from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from viewer.camera import Camera
from viewer.scan.octree import traverse
from viewer.scan.octree.build import Stop, build
from viewer.scan.octree.octree import DEEPEST, Octree
from viewer.scan.octree.traverse import Cut, Sight, Traversal
from viewer.scan.points import PointCloud
from viewer.view import View

SIZE = (240, 160)


def sphere(shift: float = 0.0, count: int = 4000) -> PointCloud:
    points = np.random.default_rng(3).normal(size=(count, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    return PointCloud.from_arrays(points * [1, 0.7, 1.2] + shift, normals=points)


def cameras(cloud: PointCloud) -> dict[str, Camera]:
    bounds = cloud.bounds()
    center, radius = bounds.center, bounds.radius
    near = tuple(center + radius * np.array([0.1, 0.2, 0.8]))
    side = tuple(center + radius * np.array([0.6, 0, 0]))
    return {
        "whole": Camera.orbit(bounds, 30, 20, aspect=1.5),
        "far": Camera.orbit(bounds, 30, 20, distance=60.0 * radius),
        "a part": Camera(eye=near, target=side, fov_y=25),
        "inside": Camera(eye=tuple(center), target=side, fov_y=60),
        "cut by near and far": Camera(
            eye=near, target=tuple(center), fov_y=40, near=0.5 * radius, far=0.9 * radius
        ),
        "orthographic": Camera.orbit(bounds, -40, 60, aspect=1.5, projection="orthographic"),
        "orthographic part": Camera(
            eye=near, target=side, projection="orthographic", height=0.4 * radius, far=radius
        ),
    }


def sight_of(camera: Camera) -> Sight:
    perspective = camera.projection == "perspective"
    extent = 2 * math.tan(math.radians(camera.fov_y) / 2) if perspective else camera.view_height
    near, far = camera.clip_range()
    return Sight(np.array(camera.eye), camera.rotation(), SIZE[1] / extent, SIZE, near, far, perspective)


def view_of(camera: Camera, cloud: PointCloud) -> View:
    return View.of(camera, SIZE, cloud.origin, cloud.bounds())


def holders(cloud: PointCloud, tree: Octree, cut: Cut) -> NDArray[np.int64]:
    """(N,): how many nodes of the cut hold each point."""
    found = np.zeros(len(cloud), np.int64)
    for level in np.unique(cut.level):
        codes = tree.codes(level)[cut.index[cut.level == level]]
        assert len(np.unique(codes)) == len(codes)
        cells = np.floor((cloud.world() - tree.low) / tree.size(level)).astype(np.int64)
        bits = sum((cells[:, a] >> b & 1) << 3 * b + a for a in range(3) for b in range(int(level)))
        found += np.isin(np.asarray(bits, np.int64), codes.astype(np.int64))
    return found


def planes_of(camera: Camera) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Inward planes (p, 4) about the eye, from rays through the corners of the picture; and the eye."""
    sight = sight_of(camera)
    right, up, back = sight.axes
    x, y = (pixels / 2 / sight.scale for pixels in SIZE)
    normals = [right, -right, up, -up]
    offsets = [x, x, y, y]
    if sight.perspective:
        corner = [sx * x * right + sy * y * up - back for sx, sy in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        normals = [np.cross(corner[(i + 1) % 4], corner[i]) for i in range(4)]
        normals = [n * np.sign(n @ -back) / np.linalg.norm(n) for n in normals]
        offsets = [0.0] * 4
    ends = [(-back, -sight.near)] + ([(back, sight.far)] if math.isfinite(sight.far) else [])
    planes = [np.append(n, d) for n, d in [*zip(normals, offsets, strict=True), *ends]]
    return np.array(planes), sight.eye


def is_leaf(tree: Octree, level: int, index: NDArray) -> NDArray[np.bool_]:
    return tree.masks[level][index] == 0 if level < tree.depth else np.ones(len(index), bool)


@pytest.mark.parametrize("rule", ["delta", "occupancy"])
@pytest.mark.parametrize("shift", [0.0, 1e6])
@pytest.mark.parametrize("name", cameras(sphere()))
@pytest.mark.parametrize("threshold", [0.0, 1.0, 12.0])
def test_every_point_in_the_picture_lies_in_one_node(
    name: str, shift: float, threshold: float, rule: str
) -> None:
    cloud = sphere(shift)
    tree = build(cloud, Stop(rule, delta=0.02, occupancy=5))
    camera = cameras(cloud)[name]
    traversal = Traversal(tree, sight_of(camera), pixel_threshold=threshold, cull_cones=False)
    assert traversal.advance()
    cut = traversal.cut(cloud.origin)
    held = holders(cloud, tree, cut)
    assert cut.complete
    assert cut.facing_away == 0
    assert held.max() <= 1
    planes, eye = planes_of(camera)
    centers = cut.positions + cloud.origin - eye
    reach = cut.halves * 3**0.5 * (1 + 1e-6) + 1e-6
    assert (centers @ planes[:, :3].T + planes[:, 3] >= -reach[:, None]).all()
    seen = view_of(camera, cloud).contains(cloud.positions)
    assert seen.any()
    assert (held[seen] == 1).all()
    if not seen.all():
        assert cut.outside > 0
        assert (held == 0).any()


@pytest.mark.parametrize("name", cameras(sphere()))
def test_nodes_end_at_leaves_or_below_the_threshold(name: str) -> None:
    cloud = sphere()
    tree = build(cloud, Stop(delta=0.02))
    sight = sight_of(cameras(cloud)[name])
    traversal = Traversal(tree, sight, pixel_threshold=6.0, cull_cones=False)
    traversal.advance()
    cut = traversal.cut(cloud.origin)
    for level in np.unique(cut.level).tolist():
        centers = cut.positions[cut.level == level] + cloud.origin
        leaf = is_leaf(tree, level, cut.index[cut.level == level])
        nearest = (sight.eye - centers) @ sight.axes[2] - tree.size(level) * 3**0.5 / 2
        depth = np.maximum(nearest, sight.near) if sight.perspective else np.ones(len(centers))
        pixels = tree.size(level) * sight.scale / depth
        assert (leaf | (pixels < 6.0 * (1 + 1e-5))).all()
        # Parents were not small enough: twice the edge, and nearer by less than their diagonal.
        nearest -= tree.size(level) * 2 * 3**0.5
        depth = np.maximum(nearest, sight.near) if sight.perspective else depth
        assert level == 0 or (2 * tree.size(level) * sight.scale / depth >= 6.0).all()


def test_numbers_centres_and_halves_are_those_of_the_tree() -> None:
    cloud = sphere(1e6)
    tree = build(cloud, Stop("occupancy", occupancy=3))
    traversal = Traversal(tree, sight_of(cameras(cloud)["whole"]), pixel_threshold=3)
    traversal.advance()
    cut = traversal.cut(cloud.origin)
    centers = np.concatenate([tree.centers(level) for level in range(tree.depth + 1)])
    np.testing.assert_allclose(centers[cut.numbers(tree)] - cloud.origin, cut.positions, atol=1e-6)
    for name in ("normals", "cones", "rows"):
        values = np.concatenate([getattr(found, name) for found in tree.attributes])
        np.testing.assert_array_equal(cut.gather(tree, name), values[cut.numbers(tree)])
    np.testing.assert_array_equal(cut.halves, np.float32(tree.edge / 2 ** (cut.level + 1.0)))


@pytest.mark.parametrize("name", cameras(sphere()))
def test_cones_leave_out_what_faces_away_alone(name: str) -> None:
    cloud = sphere()
    tree = build(cloud, Stop(delta=0.02))
    camera = cameras(cloud)[name]
    traversal = Traversal(tree, sight_of(camera), pixel_threshold=0.0)
    traversal.advance()
    cut = traversal.cut(cloud.origin)
    view = view_of(camera, cloud)
    assert cloud.normals is not None
    seen = view.contains(cloud.positions) & ~view.faces_away(cloud.positions, cloud.normals)
    held = holders(cloud, tree, cut)
    assert (held[seen] == 1).all()
    if name in ("whole", "far", "orthographic"):
        assert cut.facing_away > 0
        away = view.faces_away(cloud.positions, cloud.normals)
        assert (held[away] == 0).mean() > 0.8  # of what could be left out


@pytest.mark.parametrize("name", cameras(sphere()))
@pytest.mark.parametrize("cones", [False, True])
def test_a_budget_gives_coarser_cuts_that_lack_nothing(
    name: str, cones: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also those in the middle of a level; and each is part of the space of the one before."""
    monkeypatch.setattr(traverse, "_CHUNK", 397)
    cloud = sphere()
    tree = build(cloud, Stop(delta=0.05))
    camera = cameras(cloud)[name]
    sight = sight_of(camera)
    view = view_of(camera, cloud)
    seen = view.contains(cloud.positions)
    if cones and cloud.normals is not None:
        seen &= ~view.faces_away(cloud.positions, cloud.normals)
    traversal = Traversal(tree, sight, cull_cones=cones)
    before = np.ones(len(cloud), bool)
    steps = 0
    complete = False
    while not complete:
        held = holders(cloud, tree, traversal.cut(cloud.origin, means=True))
        assert held.max() <= 1
        assert (held[seen] == 1).all()
        assert not (held[~before] > 0).any()
        before = held > 0
        complete = traversal.advance(budget_ms=0)
        assert complete == traversal.complete
        steps += 1
    whole = Traversal(tree, sight, cull_cones=cones)
    whole.advance()
    one, other = traversal.cut(cloud.origin), whole.cut(cloud.origin)
    assert steps > 3
    assert sorted(one.numbers(tree)) == sorted(other.numbers(tree))
    assert (one.outside, one.facing_away) == (other.outside, other.facing_away)


def test_no_cut_of_a_moving_view_has_a_hole(monkeypatch: pytest.MonkeyPatch) -> None:
    """Orbiting, panning and zooming while it refines: each view sees all of its points, at any moment."""
    monkeypatch.setattr(traverse, "_CHUNK", 300)
    cloud = sphere()
    tree = build(cloud, Stop(delta=0.05))
    camera = cameras(cloud)["whole"]
    traversal = Traversal(tree, sight_of(camera), cull_cones=False)
    for turn in range(8):
        camera = camera.orbited(25, 10).panned(0.1, -0.05).zoomed(1.2)
        traversal.look(sight_of(camera))
        seen = view_of(camera, cloud).contains(cloud.positions)
        for _ in range(turn):
            assert (holders(cloud, tree, traversal.cut(cloud.origin))[seen] == 1).all()
            traversal.advance(budget_ms=0)


def test_nearer_nodes_come_first_within_a_level() -> None:
    cloud = sphere()
    tree = build(cloud, Stop("depth", depth=5))
    for name in ("whole", "orthographic"):
        sight = sight_of(cameras(cloud)[name])
        traversal = Traversal(tree, sight, pixel_threshold=0.0, cull_cones=False)
        traversal.advance()
        cut = traversal.cut(np.zeros(3))
        depth = (sight.eye - cut.positions) @ sight.axes[2]
        rank = np.argsort(np.argsort(depth))
        assert np.corrcoef(rank, np.arange(len(rank)))[0, 1] > 0.5
        occluding = cut.positions - sight.eye if sight.perspective else -np.tile(sight.axes[2], (len(cut), 1))
        for axis in range(3):  # of two siblings along an axis, the one on the eye's side is first
            parents = np.floor((cut.positions - tree.low) / tree.size(4)).astype(int)
            same = (parents[1:] == parents[:-1]).all(axis=1)
            only = np.delete(np.abs(np.diff(cut.positions, axis=0)) < 1e-6, axis, axis=1).all(axis=1)
            step = np.diff(cut.positions[:, axis])[same & only]
            towards = np.sign(occluding[:-1, axis][same & only])
            beside = np.abs(occluding[:-1, axis][same & only]) > 2 * tree.size(4)
            assert (np.sign(step) == towards)[beside].all()


def test_a_greatest_depth_ends_it() -> None:
    cloud = sphere()
    tree = build(cloud, Stop(delta=0.02))
    sight = sight_of(cameras(cloud)["whole"])
    for depth in (0, 3, tree.depth, DEEPEST):
        traversal = Traversal(tree, sight, pixel_threshold=0.0, max_depth=depth, cull_cones=False)
        traversal.advance()
        cut = traversal.cut(cloud.origin)
        assert (cut.level == min(depth, tree.depth)).all()
        assert len(cut) == tree.counts[min(depth, tree.depth)]


def test_a_margin_keeps_what_reaches_into_the_picture() -> None:
    cloud = sphere()
    tree = build(cloud, Stop(delta=0.05))
    camera = cameras(cloud)["a part"]
    view = view_of(camera, cloud)
    centers = []
    for margin in (0.0, 0.05):
        traversal = Traversal(
            tree, sight_of(camera), pixel_threshold=0.0, cull_cones=False, margins=[margin] * (tree.depth + 1)
        )
        traversal.advance()
        cut = traversal.cut(cloud.origin)
        held = holders(cloud, tree, cut) > 0
        near = np.zeros(len(cloud), bool)
        for step in np.random.default_rng(0).normal(size=(60, 3)):
            near |= view.contains(cloud.positions + margin * step / np.linalg.norm(step))
        assert held[near].all()
        centers.append(len(cut))
    assert centers[0] < centers[1]


def test_looking_again_from_elsewhere_equals_a_new_traversal() -> None:
    cloud = sphere()
    tree = build(cloud, Stop(delta=0.05))
    views = cameras(cloud)
    used = Traversal(tree, sight_of(views["a part"]))
    used.advance()
    kept = used.cut(cloud.origin)
    numbers, centers = kept.numbers(tree), kept.positions.copy()
    used.look(sight_of(views["whole"]))
    used.advance()
    fresh = Traversal(tree, sight_of(views["whole"]))
    fresh.advance()
    np.testing.assert_array_equal(used.cut(cloud.origin).numbers(tree), fresh.cut(cloud.origin).numbers(tree))
    np.testing.assert_array_equal(kept.numbers(tree), numbers)
    np.testing.assert_array_equal(kept.positions, centers)


@pytest.mark.parametrize("points", [np.empty((0, 3)), np.ones((1, 3))])
def test_trees_of_no_and_of_one_point(points: NDArray) -> None:
    cloud = PointCloud.from_arrays(points)
    tree = build(cloud, Stop())
    traversal = Traversal(tree, sight_of(Camera(eye=(1, 1, 5), target=(1, 1, 1))))
    assert traversal.advance()
    cut = traversal.cut(cloud.origin)
    assert cut.complete
    assert len(cut) == len(points)
    np.testing.assert_allclose(cut.positions + cloud.origin, points, atol=1e-6)

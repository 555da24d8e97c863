from __future__ import annotations

from collections import Counter, defaultdict
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scenes import rarely

from viewer.errors import InputError
from viewer.scan.octree.build import Stop, build, shortfall
from viewer.scan.octree.cube import Cube
from viewer.scan.octree.octree import DEEPEST, Octree
from viewer.scan.points import PointCloud
from viewer.srgb import bytes_from_linear, linear_from_bytes


def brute_octants(cloud: PointCloud, low: NDArray, edge: float, depth: int) -> list[dict[int, list[int]]]:
    """For each level, Morton code -> rows of the points in that octant: all of it by exact comparisons."""
    points = [
        [Fraction(float(p)) + Fraction(float(o)) for p, o in zip(position, cloud.origin, strict=True)]
        for position in cloud.positions
    ]
    levels: list[dict[int, list[int]]] = [defaultdict(list) for _ in range(depth + 1)]

    def divide(level: int, code: int, corner: list[Fraction], edge: Fraction, rows: list[int]) -> None:
        assert all(corner[a] <= points[row][a] <= corner[a] + edge for row in rows for a in range(3))
        levels[level][code] = rows
        if level == depth:
            return
        half = edge / 2
        octants = defaultdict(list)
        for row in rows:
            octants[sum((points[row][a] >= corner[a] + half) << a for a in range(3))].append(row)
        for octant, inside in octants.items():
            part = [corner[a] + half * (octant >> a & 1) for a in range(3)]
            divide(level + 1, code << 3 | octant, part, half, inside)

    corner = [Fraction(float(v)) for v in low]
    inside = [
        row
        for row, point in enumerate(points)
        if all(corner[a] <= point[a] <= corner[a] + Fraction(edge) for a in range(3))
    ]
    if inside:
        divide(0, 0, corner, Fraction(edge), inside)
    return levels


def check(cloud: PointCloud, tree: Octree) -> list[dict[int, list[int]]]:
    """That counts, codes, masks and lowest rows agree with brute force, the leaves' points included; and that
    strays are the points outside."""
    levels = brute_octants(cloud, tree.low, tree.edge, tree.depth)
    assert tree.points + len(tree.strays) == len(cloud)
    assert tree.counts.tolist() == [len(level) for level in levels]
    for level, octants in enumerate(levels):
        assert tree.codes(level).tolist() == sorted(octants)
        assert tree.attributes[level].rows.tolist() == [min(octants[code]) for code in sorted(octants)]
        if level < tree.depth:
            children = [
                sum(1 << o for o in range(8) if code << 3 | o in levels[level + 1])
                for code in sorted(octants)
            ]
            assert tree.masks[level].tolist() == children
    return levels


def clouds() -> dict[str, NDArray]:
    rng = np.random.default_rng(7)
    body = rng.normal(size=(300, 3))
    flat = body * [1, 0, 1]
    return {
        "random": body,
        "coplanar": flat,
        "line": body * [0, 1, 0],
        "duplicated": rng.permutation(np.repeat(body[:60], 5, axis=0)),
        "one cell": np.concatenate([[[1e6, 0, 0]], body * 1e-3]),
        "outlier": np.concatenate([body, [[1e5, -3, 2]]]),
        "on a lattice": rng.integers(0, 16, size=(300, 3)),
        "two": body[:2],
        "one": body[:1],
        "copies of one": np.repeat(body[:1], 9, axis=0),
        "tiny": body * 1e-30,
        "huge": body * 1e15,
    }


@pytest.mark.parametrize("shift", [*rarely(0.0, 1e7), -123456.789])
@pytest.mark.parametrize("name", clouds())
@pytest.mark.parametrize("depth", [*rarely(0, 1, 9), DEEPEST])
def test_a_tree_is_that_of_exact_comparisons(name: str, shift: float, depth: int) -> None:
    cloud = PointCloud.from_arrays(clouds()[name] + np.array([shift, -shift, 2 * shift]))
    tree = build(cloud, Stop("depth", depth=depth))
    check(cloud, tree)
    inside = np.delete(cloud.positions, tree.strays, axis=0)
    assert tree.distinct == len(np.unique(inside + np.float32(0), axis=0))
    assert len(tree.strays) == (name in ("one cell", "outlier"))


LARGEST = float(np.nextafter(np.float32(1e18), np.float32(0)))
floats = st.floats(-LARGEST, LARGEST, width=32)


@pytest.mark.slow
@settings(max_examples=200, deadline=None, derandomize=True)
@given(st.lists(st.tuples(floats, floats, floats), min_size=1, max_size=12), st.integers(0, DEEPEST))
def test_any_positions_are_divided_exactly(points: list[tuple[float, float, float]], depth: int) -> None:
    positions = np.array(points, np.float32)
    cloud = PointCloud.from_arrays(positions, origin=[0, 0, 0])
    tree = build(cloud, Stop("depth", depth=depth))
    check(cloud, tree)
    assert tree.distinct == len(np.unique(positions + np.float32(0), axis=0))


@pytest.mark.parametrize("edge", [1.0, 3.0, 49 / 64, 5e6])  # of few bits: borders are exact
@pytest.mark.parametrize("depth", [3, 5, DEEPEST])
def test_positions_on_borders_belong_to_the_upper_cell_and_the_last_to_the_last(
    edge: float, depth: int
) -> None:
    steps = np.float32(edge) * np.arange(9, dtype=np.float32) / 8
    below = np.nextafter(steps[1:], np.float32(0))
    positions = np.concatenate([np.stack([steps, steps[::-1], steps], axis=1), np.stack([below] * 3, axis=1)])
    cloud = PointCloud.from_arrays(positions, origin=[0, 0, 0])
    tree = build(cloud, Stop("depth", depth=depth), cube=Cube(np.zeros(3), edge))
    assert (tree.low == 0).all()
    assert tree.edge == edge
    check(cloud, tree)
    assert tree.cells(depth).max() == 2**depth - 1


@settings(max_examples=200, deadline=None, derandomize=True)
@given(
    st.lists(st.tuples(floats, floats, floats), min_size=1, max_size=4),
    st.tuples(*[st.floats(-1e12, 1e12)] * 3),
)
def test_a_cube_holds_its_points_wherever_their_origin_is(
    points: list[tuple[float, float, float]], origin: tuple[float, float, float]
) -> None:
    cloud = PointCloud(np.array(points, np.float32), np.array(origin))
    low, edge = Cube.holding(cloud)
    for position in cloud.positions:
        for axis in range(3):
            inside = Fraction(float(position[axis])) + Fraction(origin[axis]) - Fraction(float(low[axis]))
            assert 0 <= inside < Fraction(edge)
    assert build(cloud, Stop("depth", depth=0)).counts.tolist() == [1]


def test_threads_change_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(1)
    positions = np.round(rng.normal(size=(20_000, 3)), 2)
    cloud = PointCloud.from_arrays(positions, colors=rng.integers(0, 255, (20_000, 3), np.uint8))
    alone = build(cloud, Stop("delta", delta=0.0))
    monkeypatch.setattr("viewer.threads._SHARE", 1000)
    monkeypatch.setattr("os.cpu_count", lambda: 3)
    together = build(cloud, Stop("delta", delta=0.0))
    assert alone.depth == together.depth
    for one, other in zip(alone.masks, together.masks, strict=True):
        np.testing.assert_array_equal(one, other)
    for a, b in zip(alone.attributes, together.attributes, strict=True):
        np.testing.assert_array_equal(a.colors, b.colors)
        np.testing.assert_array_equal(a.rows, b.rows)


@pytest.mark.parametrize("delta", [0.0, 0.02, 0.1, 0.5, 1.0])
@pytest.mark.parametrize("copies", [1, 3])
def test_the_share_of_positions_with_a_leaf_of_their_own_ends_subdivision(delta: float, copies: int) -> None:
    sphere = np.random.default_rng(3).normal(size=(4000, 3))
    sphere /= np.linalg.norm(sphere, axis=1)[:, None]
    tree = build(PointCloud.from_arrays(np.repeat(sphere, copies, axis=0)), Stop(delta=delta))
    shares = tree.counts / 4000
    assert tree.distinct == 4000
    assert shares[-1] >= 1 - delta
    assert (shares[:-1] < 1 - delta).all()
    assert tree.loss == pytest.approx(1 - shares[-1])
    assert shortfall(tree, Stop(delta=delta)) is None


def test_no_loss_ends_where_every_position_has_its_octant_or_at_the_last_level() -> None:
    lattice = np.array([[x, y, z] for x in range(8) for y in range(8) for z in range(8)], np.float32)
    stop = Stop(delta=0.0)
    even = build(PointCloud.from_arrays(np.repeat(lattice, 4, axis=0)), stop)
    assert even.depth < 8
    assert even.loss == 0
    assert shortfall(even, stop) is None
    near = np.array([[0, 0, 0], [1e-12, 0, 0], [1, 1, 1]], np.float32)
    split = build(PointCloud.from_arrays(near, origin=[0, 0, 0]), stop)
    assert (split.depth, split.distinct, split.counts[-1]) == (DEEPEST, 3, 2)
    assert "deepest level, 21" in str(shortfall(split, stop))


def test_crowds_within_one_cell_are_counted() -> None:
    rng = np.random.default_rng(5)
    crowd = np.repeat(rng.random((700, 3)), 2, axis=0)
    positions = np.concatenate([crowd, [[1e9, 0, 0]], -crowd[:300] - 5e8])
    cloud = PointCloud.from_arrays(positions, origin=[0, 0, 0])
    tree = build(cloud, Stop("depth", depth=2), Cube.holding(cloud))
    assert tree.distinct == len(np.unique(cloud.positions, axis=0))


@pytest.mark.parametrize("most", [1, *rarely(2, 3, 8), 40, *rarely(299), 300, *rarely(1 << 40)])
@pytest.mark.parametrize("name", ["random", "duplicated", "outlier"])
def test_occupancy_divides_octants_with_more_points_than_asked(most: int, name: str) -> None:
    cloud = PointCloud.from_arrays(clouds()[name])
    tree = build(cloud, Stop("occupancy", occupancy=most))
    exact = brute_octants(cloud, tree.low, tree.edge, DEEPEST)
    held = [Counter({code: len(rows) for code, rows in level.items()}) for level in exact]
    there = [0]
    for level in range(tree.depth + 1):
        assert tree.codes(level).tolist() == sorted(there)
        divided = [code for code in sorted(there) if held[level][code] > most and level < DEEPEST]
        if level < tree.depth:
            assert [
                code for code, mask in zip(sorted(there), tree.masks[level], strict=True) if mask
            ] == divided
        there = [
            code << 3 | o
            for code in divided
            for o in range(8)
            if code << 3 | o in held[min(level + 1, DEEPEST)]
        ]
    assert there == []


def test_means_of_all_levels_are_those_of_the_points_below() -> None:
    rng = np.random.default_rng(11)
    positions = rng.normal(size=(400, 3))
    normals = rng.normal(size=(400, 3)) + np.array([0, 0, 1.5])
    colors = rng.integers(0, 256, (400, 4), np.uint8)
    cloud = PointCloud.from_arrays(positions, normals=normals, colors=colors)
    tree = build(cloud, Stop("depth", depth=6))
    unit = normals / np.linalg.norm(normals, axis=1)[:, None]
    for level, octants in enumerate(check(cloud, tree)):
        found = tree.attributes[level]
        for node, code in enumerate(sorted(octants)):
            rows = octants[code]
            light = linear_from_bytes(colors[rows, :3]).mean(axis=0)
            np.testing.assert_allclose(found.colors[node, :3], bytes_from_linear(light).astype(int), atol=1)
            alpha = colors[rows, 3].sum(dtype=int)
            assert found.colors[node, 3] == (2 * alpha + len(rows)) // (2 * len(rows))
            mean = unit[rows].mean(axis=0)
            np.testing.assert_allclose(found.normals[node], mean / np.linalg.norm(mean), atol=1e-5)
            cosine = (unit[rows] @ found.normals[node]).min()
            assert cosine - 4e-6 < found.cones[node] <= cosine + 1e-7


def test_colours_are_averaged_as_light_whatever_the_count() -> None:
    cells = np.repeat(np.arange(1, 100), 2 * np.arange(1, 100))  # a cell of 2 n points for each n
    black_and_white = 255 * (np.arange(len(cells)) % 2)
    colors = np.stack([black_and_white, 0 * cells + 7, 0 * cells + 200, black_and_white], axis=1)
    positions = np.stack([cells + 0.5, cells * 0, cells * 0], axis=1)
    cloud = PointCloud.from_arrays(positions, colors=colors.astype(np.uint8))
    tree = build(cloud, Stop("depth", depth=7), cube=Cube(np.zeros(3), 128.0))
    assert tree.counts[7] == 99
    assert (tree.attributes[7].colors == [188, 7, 200, 128]).all()


def test_normals_that_cancel_or_are_missing_open_the_cone() -> None:
    positions = np.array([[0, 0, 0], [0.1, 0, 0], [1, 1, 1], [1, 1, 0.9], [1, 1, 0.8]])
    normals = np.array([[0, 3, 0], [1e-8, -3, 0], [1, 0, 0], [0, 0, 0], [np.nan, 0, 0]])
    tree = build(PointCloud.from_arrays(positions, normals=normals), Stop("depth", depth=1))
    np.testing.assert_array_equal(tree.attributes[1].normals, [[0, 0, 0], [1, 0, 0]])
    assert tree.attributes[1].cones.tolist() == [-1, -1]
    leaves = build(PointCloud.from_arrays(positions, normals=normals), Stop("depth", depth=10)).attributes[-1]
    assert sorted(np.round(leaves.cones, 4)) == [-1, -1, 1, 1, 1]


def test_the_order_of_the_points_changes_nothing() -> None:
    rng = np.random.default_rng(2)
    positions = np.repeat(rng.random((500, 3)), 3, axis=0)
    normals, colors = rng.normal(size=(1500, 3)), rng.integers(0, 256, (1500, 3), np.uint8)
    order = rng.permutation(1500)
    one = build(PointCloud.from_arrays(positions, normals=normals, colors=colors, origin=[0, 0, 0]))
    other = build(
        PointCloud.from_arrays(
            positions[order], normals=normals[order], colors=colors[order], origin=[0, 0, 0]
        )
    )
    for a, b in zip(one.attributes, other.attributes, strict=True):
        for field in ("colors", "normals", "cones"):
            np.testing.assert_array_equal(getattr(a, field), getattr(b, field))


def test_arrays_may_be_read_only_and_apart_in_memory() -> None:
    rng = np.random.default_rng(6)
    packed = np.zeros(700, [("position", np.float32, 3), ("normal", np.float32, 3), ("color", np.uint8, 4)])
    packed["position"], packed["normal"] = rng.random((700, 3)), rng.normal(size=(700, 3))
    packed["color"] = rng.integers(0, 256, (700, 4))
    packed.setflags(write=False)
    views = {"positions": packed["position"], "normals": packed["normal"], "colors": packed["color"]}
    copies = {name: values.copy() for name, values in views.items()}
    one, other = (build(PointCloud(**arrays, origin=np.zeros(3))) for arrays in (views, copies))
    assert [m.tolist() for m in one.masks] == [m.tolist() for m in other.masks]
    for a, b in zip(one.attributes, other.attributes, strict=True):
        for field in ("colors", "normals", "cones", "rows"):
            np.testing.assert_array_equal(getattr(a, field), getattr(b, field))


def test_poses_in_one_cube_have_the_same_octants() -> None:
    rng = np.random.default_rng(4)
    body = rng.random((200, 3)) * [1, 2, 1] + 1e6
    moved = body + np.array([0.25, 0, 0])
    low, high = np.minimum(body, moved).min(axis=0), np.maximum(body, moved).max(axis=0)
    cube = Cube.around(low - 1e-6, high + 1e-6)
    trees = [build(PointCloud.from_arrays(p), Stop("depth", depth=8), cube) for p in (body, moved)]
    for tree, points in zip(trees, (body, moved), strict=True):
        assert (tree.low == cube.low).all()
        assert tree.edge == cube.edge
        check(PointCloud.from_arrays(points), tree)
    assert len(build(PointCloud.from_arrays(body + 5), cube=cube).strays) == len(body)
    with pytest.raises(InputError, match="edge"):
        build(PointCloud.from_arrays(body), cube=Cube(low, np.nan))


@pytest.mark.parametrize("distance", [30.0, 1e3, 1e6, 1e12])
@pytest.mark.parametrize("few", [1, 4, 12])
def test_points_far_from_the_body_are_strays_and_change_no_octant(distance: float, few: int) -> None:
    rng = np.random.default_rng(8)
    body, apart = rng.normal(size=(1000, 3)), rng.normal(size=(few, 3))
    apart *= distance / np.linalg.norm(apart, axis=1, keepdims=True)
    alone = build(PointCloud.from_arrays(body, origin=[0, 0, 0]))
    tree = build(PointCloud.from_arrays(np.concatenate([apart, body]), origin=[0, 0, 0]))
    assert tree.strays.tolist() == list(range(few))
    assert (tree.low == alone.low).all()
    assert tree.edge == alone.edge
    for one, other in zip(tree.masks, alone.masks, strict=True):
        np.testing.assert_array_equal(one, other)
    np.testing.assert_array_equal(tree.attributes[-1].rows, alone.attributes[-1].rows + few)


def test_many_points_apart_are_part_of_the_scan() -> None:
    rng = np.random.default_rng(8)
    apart = np.concatenate([rng.normal(size=(1000, 3)), rng.normal(size=(100, 3)) + 50])
    tree = build(PointCloud.from_arrays(apart))
    assert tree.points == 1100
    assert not len(tree.strays)


def test_octants_turn_with_the_points() -> None:
    """The cube is about the middle of the points: a quarter turn, or a mirror, gives the same octants."""
    points = np.random.default_rng(9).normal(size=(700, 3))
    turned = points @ [[0, 1, 0], [-1, 0, 0], [0, 0, 1]]
    one, other = (build(PointCloud.from_arrays(p, origin=[0, 0, 0])) for p in (points, turned))
    assert one.edge == other.edge
    for level in range(one.depth + 1):
        expected = one.cells(level)[:, [1, 0, 2]]
        expected[:, 0] = 2**level - 1 - expected[:, 0]
        assert {*map(tuple, expected.tolist())} == {*map(tuple, other.cells(level).tolist())}


def test_no_points_give_a_tree_without_nodes() -> None:
    tree = build(PointCloud.from_arrays(np.empty((0, 3))))
    assert (tree.depth, tree.counts.tolist(), tree.leaves, tree.loss, tree.points) == (0, [0], 0, 0.0, 0)
    assert tree.centers(0).shape == (0, 3)


def test_a_prefix_is_the_tree_of_less_depth() -> None:
    cloud = PointCloud.from_arrays(clouds()["random"], colors=np.full((300, 3), 7, np.uint8))
    tree, coarse = build(cloud, Stop("depth", depth=9)), build(cloud, Stop("depth", depth=4))
    prefix = tree.prefix(4)
    assert prefix.counts.tolist() == coarse.counts.tolist()
    assert len(prefix.attributes) == 5
    assert prefix.masks[3] is tree.masks[3]
    np.testing.assert_allclose(prefix.centers(4), coarse.centers(4))
    assert tree.prefix(99).depth == 9


def test_every_leaf_holds_a_point_and_every_point_lies_in_a_leaf() -> None:
    cloud = PointCloud.from_arrays(np.random.default_rng(0).normal(size=(5000, 3)) + 1e5)
    for stop in (Stop(), Stop("occupancy", occupancy=4)):
        tree = build(cloud, stop)
        holders = np.zeros(len(cloud), int)
        for level in range(tree.depth + 1):
            leaf = tree.masks[level] == 0 if level < tree.depth else np.ones(tree.counts[-1], bool)
            cells = {tuple(cell) for cell in tree.cells(level)[leaf].tolist()}
            inside = np.floor((cloud.world() - tree.low) / tree.size(level)).astype(int).tolist()
            assert cells <= {tuple(cell) for cell in inside}
            holders += [tuple(cell) in cells for cell in inside]
        assert (holders == 1).all()


@pytest.mark.parametrize("values", [{"rule": "soon"}, {"delta": 1.5}, {"depth": 22}, {"occupancy": 0}])
def test_a_rule_out_of_range_is_refused(values: dict) -> None:
    with pytest.raises(InputError):
        replace(Stop(), **values)


@pytest.mark.parametrize("least", [5e-324, 1e-320, 1e-300, 1e-62])
def test_extents_that_float32_cannot_hold_are_those_of_one_place(least: float) -> None:
    points = np.array([[0, 0, 0], [0, 0, least], [least, 0, 0]])
    tree = build(PointCloud.from_arrays(points))
    assert (tree.points, tree.leaves) == (3, 1)
    low, high = np.zeros(3), np.full(3, least)
    assert 0 < Cube.around(low, high).edge < 4

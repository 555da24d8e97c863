"""Masks by arithmetic coding: they come back, and the contexts are what is around each node."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
import pytest

from viewer import threads
from viewer.errors import InputError
from viewer.scan.octree import occupancy
from viewer.scan.octree import occupancy_kernels as kernels
from viewer.scan.octree.build import Stop, build
from viewer.scan.octree.cube import Cube
from viewer.scan.octree.occupancy import OccupancyCoder
from viewer.scan.octree.octree import Octree
from viewer.scan.points import PointCloud

CUBE = Cube(np.array([-1.5, -1.5, -1.5]), 3.0)


def sphere(count: int, seed: int = 1, depth: int = 6) -> Octree:
    points = np.random.default_rng(seed).normal(size=(count, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    return build(PointCloud.from_arrays(points), Stop(rule="depth", depth=depth), CUBE, attributes=False)


def stored(octree: Octree, before: Octree | None = None) -> list[bytes]:
    """The levels of an octree as they are stored, which are read again."""
    writer, reader = (OccupancyCoder(before.masks if before else ()) for _ in range(2))
    levels = []
    for masks in octree.masks:
        data, learnt = writer.encode(masks, predicted=before is not None)
        writer.descend(masks, learnt)
        levels.append(data)
        read, learnt = reader.decode(data, predicted=before is not None)
        assert np.array_equal(read, masks)
        reader.descend(read, learnt)
    return levels


def levels(octree: Octree, deepest: int) -> Iterator[kernels.Occupied]:
    """Levels of an octree from the root on, with what is around their nodes as the kernels find it."""
    around = np.where(np.arange(27) == 13, 0, 1).astype(np.int32)[None]
    beside = np.array([1 << 13], np.int32)
    for masks in octree.masks[: deepest + 1]:
        padded = np.append(masks, np.uint8(0))
        counts = np.bitwise_count(padded)
        level = kernels.Occupied(padded, np.cumsum(counts, dtype=np.int32) - counts, around, beside)
        yield level
        beside = np.empty(level.first[-1], np.int32)
        around = np.empty((level.first[-1], 27), np.int32)
        kernels.look_around(level, (0, len(masks)), beside)
        kernels.go_down(level, beside, (0, len(masks)), around)


def test_what_is_around_nodes_is_found() -> None:
    """Found again by looking up every octant."""
    octree = sphere(3000, depth=5)
    moves = np.indices((3, 3, 3))[::-1].reshape(3, 27).T - 1  # x fastest
    for number, level in enumerate(levels(octree, 4)):
        cells = octree.cells(number)
        nodes = {tuple(cell): node for node, cell in enumerate(cells.tolist())}
        around = np.array([[nodes.get(tuple(cell + move), len(cells)) for move in moves] for cell in cells])
        assert np.array_equal(level.around, around)
        assert np.array_equal(level.beside, (around < len(cells)) @ (1 << np.arange(27)))


def test_planes_are_found() -> None:
    """Of a tilted plane of points, to a fifth of a node's edge on average."""
    normal = np.array([0.36, 0.48, 0.8])
    flat = np.random.default_rng(2).uniform(-1, 1, (40_000, 3))
    flat -= (flat @ normal)[:, None] * normal
    octree = build(PointCloud.from_arrays(flat), Stop(rule="depth", depth=6), CUBE, attributes=False)
    *_, parents = levels(octree, 3)
    planes = np.empty((5, len(octree.masks[3])), np.int32)
    kernels.fit_planes(parents, (0, planes.shape[1]), planes)
    found = planes[:3] / np.linalg.norm(planes[:3], axis=0).clip(1)
    is_found = planes[4] > 0
    assert is_found.mean() > 0.9
    assert np.abs(found[:, is_found].T @ normal).mean() > 0.99
    edge = octree.size(4)
    off = np.abs(octree.centers(3) @ normal) / edge
    told = np.abs(planes[3]) / (4 * np.linalg.norm(planes[:3], axis=0).clip(1))
    is_near = is_found & (off < 1)
    assert np.abs(told - off)[is_near].mean() < 0.2


@pytest.mark.parametrize("cores", [1, 3])
def test_parts_of_levels_come_back(cores: int, monkeypatch: pytest.MonkeyPatch) -> None:
    octree = sphere(4000)
    whole = stored(octree)
    monkeypatch.setattr(occupancy, "_PART", 300)
    monkeypatch.setattr(threads, "threads_for", lambda points: cores)
    parted = stored(octree)
    assert whole[:3] == parted[:3]
    assert len(parted[-1]) > len(whole[-1])
    assert sum(map(len, parted)) < 1.2 * sum(map(len, whole))
    coder = OccupancyCoder()
    for masks in octree.masks[:-1]:
        coder.descend(masks, coder.encode(masks)[1])
    for cut in (3, 20):
        with pytest.raises(InputError, match="the parts of a level are longer than the level"):
            coder.decode(parted[-1][:cut])


def test_parts_keep_siblings_together(monkeypatch: pytest.MonkeyPatch) -> None:
    octree = build(PointCloud.from_arrays(np.indices((16, 16, 16)).reshape(3, -1).T))
    monkeypatch.setattr(occupancy, "_PART", 3)
    assert len(stored(octree)[2]) > 4 * 7  # the sizes of parts of eight siblings each


def test_surfaces_take_less_than_masks_by_themselves() -> None:
    """At least a fifth less than the entropy of the masks of each level."""
    octree = sphere(20_000, depth=8)
    entropy = 0.0
    for masks in octree.masks:
        shares = np.bincount(masks) / len(masks)
        shares = shares[shares > 0]
        entropy -= len(masks) * float(shares @ np.log2(shares))
    assert 8 * sum(map(len, stored(octree))) < 0.8 * entropy


def test_a_tree_like_the_one_before_takes_a_fraction() -> None:
    first = sphere(4000)
    alone, told = (sum(map(len, stored(first, before))) for before in (None, first))
    assert told < 0.1 * alone
    assert stored(sphere(3000, seed=2, depth=7), first)
    assert stored(sphere(3000, seed=2, depth=4), first)


def test_damaged_bytes_give_other_masks() -> None:
    octree = sphere(2000)
    levels = stored(octree)
    coder = OccupancyCoder()
    for masks in octree.masks[:-1]:
        coder.descend(masks, coder.encode(masks)[1])
    rng = np.random.default_rng(3)
    for data in (b"", levels[-1][:10], rng.bytes(len(levels[-1])), b"\xff" * 5, bytes(5000)):
        masks, _ = coder.decode(data)
        assert masks.shape == octree.masks[-1].shape
    assert all(one != other for one, other in pairwise(levels))


def test_octants_are_found_in_the_tree_before() -> None:
    """Found again by looking up the places of all octants."""
    octree, before = sphere(1500, depth=5), sphere(1200, seed=2, depth=4)
    coder = OccupancyCoder(before.masks)
    for level, masks in enumerate(octree.masks):
        coder.descend(masks, coder.encode(masks)[1])
        if level < before.depth:
            there = {tuple(cell): node for node, cell in enumerate(before.cells(level + 1).tolist())}
            cells = octree.cells(level + 1).tolist()
            assert coder.counterparts.tolist() == [there.get(tuple(cell), -1) for cell in cells]
        else:
            assert (coder.counterparts == -1).all()

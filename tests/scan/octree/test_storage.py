"""Octrees as bytes: they come back, in the layout that the docs state, and damage is one clear error."""

from __future__ import annotations

import struct
import tracemalloc
import zlib
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from viewer.errors import InputError
from viewer.scan.octree import coding, storage
from viewer.scan.octree.build import Stop, build
from viewer.scan.octree.coding import normal_bytes, normals_of
from viewer.scan.octree.cube import Cube
from viewer.scan.octree.octree import Attributes, Octree
from viewer.scan.octree.storage import Header, Level, Strays, from_bytes, read_header, read_strays, to_bytes
from viewer.scan.points import PointCloud

HEAD = 90  # bytes of a header before its unit
CUBE = Cube(np.array([-1.5, -1.5, -1.5]), 3.0)
DEGREE = np.cos(np.radians(1))


def outside(data: bytes) -> Strays:
    """The points outside the cube of an octree's bytes."""
    header, size = read_header(data)
    return read_strays(header, lambda start, count: data[size + start : size + start + count])


def ball(count: int = 2000, turn: float = 0.0, seed: int = 1) -> PointCloud:
    """Points of a sphere with normals and colours, turned about z by some radians."""
    normals = np.random.default_rng(seed).normal(size=(count, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    colors = np.clip(128 + 100 * normals, 0, 255).astype(np.uint8)
    turned = normals @ np.array(
        [[np.cos(turn), np.sin(turn), 0], [-np.sin(turn), np.cos(turn), 0], [0, 0, 1]]
    )
    return PointCloud.from_arrays(turned, normals=turned, colors=colors)


def bare(octree: Octree) -> Octree:
    return replace(octree, attributes=())


def assert_same_geometry(one: Octree, other: Octree) -> None:
    assert (one.edge, one.points, one.distinct, one.depth) == (
        other.edge,
        other.points,
        other.distinct,
        other.depth,
    )
    assert np.array_equal(one.low, other.low)
    for mine, theirs in zip(one.masks, other.masks, strict=True):
        assert mine.dtype == np.uint8
        assert np.array_equal(mine, theirs)


def assert_same_attributes(back: Octree, octree: Octree) -> None:
    """Colours bit for bit, normals to a degree."""
    for mine, theirs in zip(back.attributes, octree.attributes, strict=True):
        assert np.array_equal(mine.colors, theirs.colors)
        assert (mine.normals * theirs.normals).sum(axis=1).min() > DEGREE


def level_ends(data: bytes) -> list[int]:
    """Where each level of a tree ends."""
    header, size = read_header(data)
    return (size + np.cumsum([level.masks + level.attributes for level in header.levels])).tolist()


TREES = {
    "delta": build(ball()),
    "depth 0": build(ball(), Stop(rule="depth", depth=0)),
    "depth 21": build(ball(300), Stop(rule="depth", depth=21)),
    "occupancy": build(ball(), Stop(rule="occupancy", occupancy=30)),
    "one point": build(ball(1)),
    "copies": build(PointCloud.from_arrays(np.ones((5, 3)))),
    "far away": build(replace(ball(), origin=np.array([665187.25, 5648349.5, 241.75]))),
    "no point": build(PointCloud.from_arrays(np.empty((0, 3)))),
    "a full cube": build(PointCloud.from_arrays(np.indices((16, 16, 16)).reshape(3, -1).T)),
}


@pytest.mark.parametrize("packed", [True, False])
@pytest.mark.parametrize("octree", TREES.values(), ids=TREES)
def test_trees_come_back(octree: Octree, packed: bool) -> None:
    data = to_bytes(octree, time=1.5, unit="µm", packed=packed)
    back = from_bytes(data)
    assert_same_geometry(back, octree)
    if octree.points and octree.attributes[0].colors is not None:
        assert_same_attributes(back, octree)
    else:
        assert back.attributes == ()
    header, _ = read_header(data)
    assert (header.time, header.unit, header.before) == (1.5, "µm", 0)
    assert from_bytes(data, attributes=False).attributes == ()
    assert to_bytes(octree, time=1.5, unit="µm", packed=packed) == data


def test_some_attributes_come_back() -> None:
    octree = TREES["delta"]
    for name in ("colors", "normals"):
        others = tuple(Attributes(**{name: getattr(each, name)}) for each in octree.attributes)
        back = from_bytes(to_bytes(replace(octree, attributes=others)))
        for mine, theirs in zip(back.attributes, octree.attributes, strict=True):
            assert (mine.colors is None) == (name == "normals")
            assert (mine.normals is None) == (name == "colors")
            if name == "colors":
                assert np.array_equal(mine.colors, theirs.colors)


def test_the_layout_is_the_stated_one() -> None:
    """Read with nothing but struct, as docs/reference/octree-files.md has it."""
    octree = TREES["delta"]
    data = to_bytes(bare(octree), time=0.25, unit="mm", packed=False)
    magic, version, flags, before, depth, unit_size, zero = struct.unpack_from("<4s6B", data)
    assert (magic, version, flags, before, depth, unit_size, zero) == (
        b"\x8dSVO",
        5,
        0,
        0,
        octree.depth,
        2,
        0,
    )
    told, time, *low, edge, points, distinct = struct.unpack_from("<I5d2Q", data, 10)
    assert told == 0
    assert (time, low, edge) == (0.25, octree.low.tolist(), octree.edge)
    assert (points, distinct) == (octree.points, octree.distinct)
    assert struct.unpack_from("<5I", data, 70) == (0, 0, 0, 0, 0)
    assert data[HEAD : HEAD + 2] == b"mm"
    at, ends = HEAD + 2, HEAD + 2 + 16 * (depth + 1)
    levels = [struct.unpack_from("<4I", data, at + 16 * level) for level in range(depth + 1)]
    assert struct.unpack_from("<I", data, ends) == (zlib.crc32(data[:ends]),)
    at = ends + 4
    for level, (nodes, masks, attributes, check) in enumerate(levels):
        stored = data[at : at + masks]
        assert nodes == octree.counts[level]
        assert stored == (octree.masks[level - 1].tobytes() if level else b"")
        assert attributes == 0
        assert check == zlib.crc32(stored)
        at += masks
    assert at == len(data)


def test_every_level_ends_a_coarser_tree() -> None:
    octree = TREES["delta"]
    data = to_bytes(octree)
    for level, end in enumerate(level_ends(data)):
        coarser = from_bytes(data[:end])
        assert_same_geometry(coarser, octree.prefix(level))
        assert_same_attributes(coarser, octree.prefix(level))


def test_a_cut_inside_a_level_is_told() -> None:
    data = to_bytes(TREES["delta"])
    starts = [read_header(data)[1], *level_ends(data)]
    for level, end in enumerate(level_ends(data)):
        for cut in {starts[level] + 1, end - 1}:
            with pytest.raises(InputError, match=f"ends within level {level} of"):
                from_bytes(data[:cut])
    for cut in (5, HEAD, HEAD + 20):
        with pytest.raises(InputError, match="ends within the header"):
            from_bytes(data[:cut])


# --- between poses ------------------------------------------------------------------------


def test_a_pose_like_the_one_before_takes_a_fraction() -> None:
    first, second = (bare(build(ball(turn=turn), cube=CUBE)) for turn in (0, 1e-4))
    alone, told = to_bytes(second), to_bytes(second, first, chain=4)
    assert len(told) < 0.3 * len(alone)
    assert read_header(told)[0].before == 4
    assert_same_geometry(from_bytes(told, first), second)


def test_trees_of_other_depths_tell_too() -> None:
    for depths in ((7, 4), (4, 6)):
        first, second = (build(ball(), Stop(rule="depth", depth=depth), CUBE) for depth in depths)
        told = to_bytes(second, first)
        assert read_header(told)[0].before == 1
        assert_same_geometry(from_bytes(told, first), second)


def test_a_pose_stands_alone_where_none_can_tell_it() -> None:
    octree = build(ball(seed=1), cube=CUBE)
    unlike = build(PointCloud.from_arrays(np.random.default_rng(0).uniform(-1.5, 1.5, (2000, 3))), cube=CUBE)
    elsewhere = replace(octree, low=octree.low + 1)
    for previous in (unlike, elsewhere):
        assert to_bytes(octree, previous) == to_bytes(octree)
    assert read_header(to_bytes(octree, octree, chain=256))[0].before == 0


def test_other_points_of_the_same_surface_are_predicted() -> None:
    """Their coarse levels are alike, and fine ones lie near."""
    stop = Stop(rule="depth", depth=6)
    first, second = (bare(build(ball(3000, seed=seed), stop, CUBE)) for seed in (1, 2))
    alone, told = to_bytes(second), to_bytes(second, first)
    assert read_header(told)[0].predicted & 0b1000
    assert len(told) < 0.96 * len(alone)
    assert_same_geometry(from_bytes(told, first), second)


def test_a_little_shorter_is_not_worth_another_tree(monkeypatch: pytest.MonkeyPatch) -> None:
    """A tenth smaller, only the fourth level is like before."""
    first = bare(build(ball(5000), cube=CUBE))
    second = bare(build(PointCloud.from_arrays(0.9 * ball(5000, seed=2).world()), cube=CUBE))
    assert to_bytes(second, first) == to_bytes(second)
    monkeypatch.setattr(storage, "_WORTH", 1.0)
    assert len(to_bytes(second, first)) < len(to_bytes(second))


def test_the_tree_before_has_to_be_there() -> None:
    octree = build(ball(), cube=CUBE)
    told = to_bytes(octree, octree)
    assert_same_geometry(from_bytes(told, octree), octree)
    for previous in (None, replace(octree, edge=2.0)):
        with pytest.raises(InputError, match="depends on the octree before it"):
            from_bytes(told, previous)


@pytest.mark.parametrize("turn", [0.0, 0.002, 0.4])
def test_attributes_are_predicted_from_the_pose_before(turn: float) -> None:
    """Where octants are the same, and not where parents tell more; back come the same bytes."""
    first, second = (build(ball(4000, turn=angle), cube=CUBE) for angle in (0.0, turn))
    alone, told = to_bytes(second), to_bytes(second, from_bytes(to_bytes(first)))
    assert told == to_bytes(second, first), "what is read tells the same as what was written"
    back, plain = from_bytes(told, from_bytes(to_bytes(first))), from_bytes(alone)
    for mine, theirs in zip(back.attributes, plain.attributes, strict=True):
        assert np.array_equal(mine.colors, theirs.colors)
        assert np.array_equal(mine.normals, theirs.normals)
    sizes = [sum(each.attributes for each in read_header(data)[0].levels) for data in (told, alone)]
    assert sizes[0] < {0.0: 0.02, 0.002: 0.6, 0.4: 1.001}[turn] * sizes[1]
    assert bool(read_header(told)[0].predicted_attributes) == (turn < 0.4)
    if turn < 0.4:
        with pytest.raises(InputError, match="depends on the octree before it"):
            from_bytes(told, bare(first))
        assert_same_geometry(from_bytes(told, bare(first), attributes=False), second)


def test_only_octants_with_the_same_attributes_tell_them() -> None:
    first, second = build(ball(), cube=CUBE), build(ball(turn=1e-4), cube=CUBE)
    for kept in ("colors", "normals"):
        of_one = replace(
            first, attributes=tuple(Attributes(**{kept: getattr(a, kept)}) for a in first.attributes)
        )
        told = to_bytes(second, of_one)
        assert not read_header(told)[0].predicted_attributes
        assert_same_attributes(from_bytes(told, of_one), second)


def test_strays_come_back_as_they_are() -> None:
    far = np.array([[1e6, -3.3, 0.1], [-9999.0, 5.5, 1 / 3]]) + np.array([5e5, 5.4e6, 0])
    near = ball().world() + np.array([5e5, 5.4e6, 0])
    points = np.insert(near, [7, 900], far, axis=0)
    normals = np.tile([[0.6, 0.0, 0.8]], (len(points), 1))
    colors = np.random.default_rng(2).integers(0, 256, (len(points), 4), np.uint8)
    cloud = PointCloud.from_arrays(points, normals=normals, colors=colors)
    radii = np.full(len(points), np.inf, np.float32)
    radii[901] = 3.0
    cloud = replace(cloud, radii=radii)
    octree = build(replace(cloud, radii=np.ones(len(points), np.float32)))
    assert octree.strays.tolist() == [7, 901]
    data = to_bytes(octree, strays=Strays.of(octree, cloud))
    back = outside(data)
    np.testing.assert_allclose(back.positions, far, rtol=1e-15)
    assert np.array_equal(back.colors, colors[octree.strays])
    np.testing.assert_allclose(back.radii, [0, 3.1], rtol=0.04)
    assert (back.normals @ [0.6, 0.0, 0.8]).min() > DEGREE
    assert_same_geometry(from_bytes(data), octree)
    header, size = read_header(data)
    assert header.strays.nodes == len(back) == 2
    broken = bytearray(data)
    broken[size] ^= 1
    with pytest.raises(InputError, match="points outside an octree are damaged"):
        outside(bytes(broken))
    with pytest.raises(InputError, match="ends within the points outside"):
        outside(data[: size + header.strays.masks - 1])


def test_radii_come_back_a_little_larger_and_coarser_trees_have_none() -> None:
    cloud = ball()
    radii = np.geomspace(1e-5, 100, len(cloud)).astype(np.float32)
    radii[::7] = 0
    radii[3::7] = np.nan
    cloud = replace(cloud, radii=radii)
    octree = build(cloud, cube=CUBE)
    data = to_bytes(octree)
    found = from_bytes(data)
    for one, other in zip(octree.attributes, found.attributes, strict=True):
        assert ((one.own_radii > 0) == (other.own_radii > 0)).all()
        limited = np.clip(one.own_radii, CUBE.edge * 2.0**-22, None)
        share = other.own_radii[one.own_radii > 0] / limited[one.own_radii > 0]
        assert share.min() > 0.999
        assert share.max() < 1.073
    assert to_bytes(found, time=0.0) == data, "bytes that were read are their own"
    header, size = read_header(data)
    cut = size + sum(level.masks + level.attributes for level in header.levels[:-1])
    assert all(each.own_radii is None for each in from_bytes(data[:cut]).attributes)
    later = build(replace(ball(turn=0.001), radii=radii), cube=CUBE)
    told = to_bytes(later, octree)
    assert read_header(told)[0].before
    for one, other in zip(
        from_bytes(to_bytes(later)).attributes, from_bytes(told, found).attributes, strict=True
    ):
        np.testing.assert_array_equal(one.own_radii, other.own_radii)


def test_normals_are_kept_as_bytes_that_are_their_own() -> None:
    """So that a tree that was read tells the next one as that which was written does."""
    pairs = np.indices((256, 256), np.uint8).reshape(2, -1).T
    once = normal_bytes(normals_of(pairs))
    np.testing.assert_array_equal(normal_bytes(normals_of(once)), once)
    assert (normals_of(once) * normals_of(pairs)).sum(axis=1)[1:].min() > 0.9999
    assert len(np.unique(once, axis=0)) > 64_000


# --- damage ---------------------------------------------------------------------------


def resigned(header: Header, data: bytes) -> bytes:
    """A tree with another header, whose checksum is right."""
    return header.to_bytes() + data[read_header(data)[1] :]


def test_headers_that_contradict_themselves_are_refused() -> None:
    data = to_bytes(TREES["delta"])
    header, _ = read_header(data)
    first, second, *others = header.levels
    wrong = [
        replace(header, edge=0.0),
        replace(header, edge=np.nan),
        replace(header, low=np.array([0, np.inf, 0])),
        replace(header, time=np.nan),
        replace(header, predicted=1),
        replace(header, before=1),
        replace(header, points=header.distinct - 1),
        replace(header, distinct=0),
        replace(header, levels=(first, *[second] * 22)),
        replace(header, levels=(replace(first, nodes=2), second, *others)),
        replace(header, levels=(replace(first, masks=9), second, *others)),
        replace(header, levels=(first, replace(second, nodes=0), *others)),
        replace(header, levels=(first, replace(second, nodes=9), *others)),
    ]
    for each in wrong:
        with pytest.raises(InputError, match="contradict each other"):
            from_bytes(resigned(each, data))


def test_other_versions_are_refused() -> None:
    data = bytearray(to_bytes(TREES["delta"]))
    data[4] = 2
    with pytest.raises(InputError, match=r"version 2\. This version of Scan4D reads format version 5"):
        from_bytes(bytes(data))


def test_every_damaged_byte_is_found() -> None:
    data = to_bytes(build(ball(100)))
    for at in range(len(data)):
        damaged = bytearray(data)
        damaged[at] ^= 0x10
        with pytest.raises(InputError):
            from_bytes(bytes(damaged))


def test_a_promise_that_the_bytes_cannot_keep_costs_nothing() -> None:
    """Header and checksums right, and 2^30 nodes told of."""
    packed = coding.pack(np.arange(8, dtype=np.uint8))
    counts = [8**level for level in range(11)]
    first, *others = (Level(nodes, len(packed), 0, zlib.crc32(packed)) for nodes in counts)
    header, _ = read_header(to_bytes(bare(TREES["a full cube"])))
    levels = (replace(first, masks=0, check=0), *others)
    liar = replace(header, points=counts[-1], distinct=counts[-1], levels=levels)
    tracemalloc.start()
    with pytest.raises(InputError):
        from_bytes(liar.to_bytes() + packed * 10)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 5_000_000


def test_what_packs_too_well_is_stored_as_it_is() -> None:
    """So that no file may promise more than 64 times its bytes."""
    zeros = np.zeros(10**6, np.uint8)
    assert coding.pack(zeros) == zeros.tobytes()
    packed = coding.pack(np.arange(100, dtype=np.uint8) // 50)
    with pytest.raises(InputError, match="has 100 bytes instead of 101"):
        coding.unpack(packed, 101)
    with pytest.raises(InputError, match="9 bytes would unpack to 577"):
        coding.unpack(bytes(9), 577)


@settings(max_examples=200, deadline=None)
@given(
    masks=st.lists(st.binary(min_size=1, max_size=40), min_size=1, max_size=6),
    counts=st.lists(st.integers(0, 200), min_size=7, max_size=7),
    flags=st.integers(0, 7),
)
@pytest.mark.slow
def test_signed_nonsense_is_a_tree_or_an_error(masks: list[bytes], counts: list[int], flags: int) -> None:
    """Levels of any bytes and counts under checksums that are right."""
    header, _ = read_header(to_bytes(bare(TREES["delta"])))
    levels = [Level(1, 0, 0, 0)]
    for stored, nodes in zip(masks, counts, strict=False):
        levels.append(Level(nodes, len(stored), 0, zlib.crc32(stored)))
    made = replace(header, flags=flags, levels=tuple(levels)).to_bytes() + b"".join(masks)
    try:
        octree = from_bytes(made)
    except InputError:
        return
    assert octree.counts.tolist() == [each.nodes for each in levels]


def test_units_that_do_not_fit_are_refused() -> None:
    with pytest.raises(InputError, match="255 bytes"):
        to_bytes(TREES["delta"], unit="m" * 256)


# --- attributes ---------------------------------------------------------------------------


def test_normals_keep_their_direction_to_a_degree() -> None:
    normals = np.random.default_rng(3).normal(size=(20000, 3)).astype(np.float32)
    normals[:6] = np.concatenate([np.eye(3), -np.eye(3)])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    back = normals_of(normal_bytes(normals))
    assert np.allclose(np.linalg.norm(back, axis=1), 1)
    assert (back * normals).sum(axis=1).min() > DEGREE
    assert np.allclose(back[:6], normals[:6])


def test_what_has_no_normal_gets_none() -> None:
    assert np.array_equal(normals_of(normal_bytes(np.zeros((2, 3), np.float32))), np.zeros((2, 3)))


def test_few_bytes_cannot_promise_very_many_octants(monkeypatch: pytest.MonkeyPatch) -> None:
    lattice = np.stack(np.meshgrid(*[np.arange(16)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    octree = build(PointCloud.from_arrays(lattice + 0.5), Stop(rule="depth", depth=4), attributes=False)
    stored = to_bytes(octree)
    monkeypatch.setattr(storage, "_FREE", 1000)
    assert from_bytes(stored).counts.tolist() == octree.counts.tolist()
    monkeypatch.setattr(coding, "MOST_RATIO", 4)
    with pytest.raises(InputError, match="claims 4,681 octants"):
        from_bytes(stored)


def test_what_would_promise_too_much_is_stored_as_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    octree = build(ball(), attributes=False)
    packed = to_bytes(octree)
    monkeypatch.setattr(storage, "_are_too_many", lambda nodes, stored: stored <= len(packed))
    assert to_bytes(octree) == to_bytes(octree, packed=False)

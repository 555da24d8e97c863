"""SVO files: a whole scan as octrees, written by `convert`, read pose by pose."""

from __future__ import annotations

import tracemalloc
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from viewer import cli
from viewer.bounds import Bounds
from viewer.errors import InputError
from viewer.scan import formats
from viewer.scan.octree import file as octree_file
from viewer.scan.octree.build import Stop
from viewer.scan.octree.octree import Octree
from viewer.scan.octree.storage import Header, Read, read_header, to_bytes
from viewer.scan.open import open_scan
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose

COUNT = 20
UTM = np.array([665187.25, 5648349.5, 241.75])


def pose_at(index: int, offset: np.ndarray | float = 0.0) -> Pose:
    """A ball that drifts slowly, with normals and colours."""
    normals = np.random.default_rng(2).normal(size=(1500, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    cloud = PointCloud.from_arrays(
        normals + 0.002 * index + offset,
        normals=normals,
        colors=np.clip(128 + 100 * normals, 0, 255).astype(np.uint8),
    )
    return Pose(index, 0.5 + 0.1 * index, f"pose {index}", cloud)


@pytest.fixture(scope="module")
def scan(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("svo") / "ball.svo"
    formats.write_poses(path, map(pose_at, range(COUNT)), "mm")
    return path


def headers(path: Path) -> list[tuple[int, int]]:
    """Of each octree: where it begins, and how many are read before it."""
    data, found, at = path.read_bytes(), [], 0
    while at < len(data):
        header, size = read_header(data[at:])
        found.append((at, header.before))
        at += size + header.stored
    return found


def edge_of(path: Path, index: int) -> float:
    """Of the leaves of one octree."""
    header, _ = read_header(path.read_bytes()[headers(path)[index][0] :])
    return header.edge / 2 ** (len(header.levels) - 1)


@pytest.mark.parametrize("offset", [np.zeros(3), UTM], ids=["near zero", "at UTM coordinates"])
def test_a_scan_comes_back(offset: np.ndarray, tmp_path: Path) -> None:
    """Each point is in a leaf, each leaf has a point, with its colour and its normal."""
    poses = [pose_at(index, offset) for index in range(3)]
    formats.write_poses(tmp_path / "a.svo", iter(poses), "cm", stop=Stop(delta=0.0))
    with open_scan(tmp_path / "a.svo") as timeline:
        assert (len(timeline), timeline.unit) == (3, "cm")
        assert timeline.times.tolist() == [pose.time for pose in poses]
        for pose, back in zip(poses, timeline, strict=True):
            offsets = np.abs(pose.cloud.world()[:, None] - back.cloud.world()).max(axis=2)
            nearest = offsets.argmin(axis=1)
            assert offsets.min(axis=1).max() <= edge_of(tmp_path / "a.svo", pose.index) / 2 + 1e-6
            assert len(back.cloud) == len(pose.cloud) == len({*nearest})
            assert np.array_equal(back.cloud.colors[nearest], pose.cloud.colors)
            assert (back.cloud.normals[nearest] * pose.cloud.normals).sum(axis=1).min() > 0.999


def test_poses_tell_the_next_within_bounds(scan: Path) -> None:
    chains = [before for _, before in headers(scan)]
    assert max(chains) == 7
    assert chains[:8] == list(range(8))  # the first cube has a margin


def test_poses_read_in_any_order_are_the_same(scan: Path) -> None:
    in_turn = formats.frames(scan)
    clouds = [in_turn(index) for index in range(COUNT)]
    jumping = formats.frames(scan)
    for index in [7, 3, 4, 19, 19, 0, 12, 11]:
        for cloud in (jumping(index), formats.read(scan, index)):
            for name in ("positions", "normals", "colors", "radii", "origin"):
                assert np.array_equal(getattr(cloud, name), getattr(clouds[index], name)), (index, name)


@pytest.mark.slow
def test_threads_read_at_once(scan: Path) -> None:
    frames = formats.frames(scan)
    order = [index * 7 % COUNT for index in range(2 * COUNT)]
    with ThreadPoolExecutor(4) as pool:
        read = list(pool.map(frames, order))
    for index, cloud in zip(order, read, strict=True):
        assert np.array_equal(cloud.positions, formats.read(scan, index).positions), index


def test_reading_in_turn_reads_each_octree_once(scan: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    read: list[int] = []
    original = octree_file.read_levels

    def noted(header: Header, read_bytes: Read, previous: Octree | None) -> Iterator[Octree]:
        read.append(header.stored)
        return original(header, read_bytes, previous)

    monkeypatch.setattr(octree_file, "read_levels", noted)
    frames = formats.frames(scan)
    for index in range(COUNT):
        frames(index)
    assert len(read) == COUNT
    read.clear()
    frames(7)
    assert len(read) == 8


def test_opening_reads_headers_alone(scan: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(octree_file, "read_levels", lambda *_, **__: pytest.fail("a pose was read"))
    with open_scan(scan) as timeline:
        assert (len(timeline), timeline.unit, timeline.label(3)) == (COUNT, "mm", "ball.svo frame 4")
        assert np.allclose(timeline.times, 0.5 + 0.1 * np.arange(COUNT))


def test_a_pose_that_leaves_the_cube_gets_another(tmp_path: Path) -> None:
    far = [pose_at(index, np.array([10.0 * (index > 2), 0, 0])) for index in range(6)]
    formats.write_poses(tmp_path / "a.svo", far, "mm")
    assert [before for _, before in headers(tmp_path / "a.svo")][3] == 0
    for pose, cloud in zip(far, map(formats.frames(tmp_path / "a.svo"), range(6)), strict=True):
        assert np.allclose(cloud.world().mean(axis=0), pose.cloud.world().mean(axis=0), atol=0.05)


def test_a_pose_much_smaller_than_the_cube_gets_another(tmp_path: Path) -> None:
    poses = [pose_at(index) for index in range(4)]
    small = PointCloud.from_arrays(poses[3].cloud.positions * 0.1)
    formats.write_poses(tmp_path / "a.svo", [*poses[:3], Pose(3, 0.8, "small", small)], "mm")
    edges = [
        read_header(tmp_path.joinpath("a.svo").read_bytes()[at:])[0].edge
        for at, _ in headers(tmp_path / "a.svo")
    ]
    assert edges[1] == edges[2]
    assert edges[3] < 0.2 * edges[2]


# --- damage ---------------------------------------------------------------------------


def test_a_cut_inside_the_last_pose_breaks_that_one_alone(scan: Path, tmp_path: Path) -> None:
    (tmp_path / "cut.svo").write_bytes(scan.read_bytes()[:-5])
    with open_scan(tmp_path / "cut.svo") as timeline:
        assert len([*timeline]) == COUNT - 1
        with pytest.raises(InputError, match=r"cut\.svo, frame 20: ends within level 7 of 7 of an octree"):
            timeline.pose(19)


def test_a_file_cut_within_a_header_opens_the_poses_before(scan: Path, tmp_path: Path) -> None:
    data = scan.read_bytes()
    path = tmp_path / "cut.svo"
    for kept in (3, 12):
        path.write_bytes(data[: headers_at(data, kept) + 20])
        with open_scan(path) as timeline:
            assert len(timeline) == kept + 1
            assert [pose.index for pose in timeline] == list(range(kept))
            told = [message.text for message in timeline.messages]
            assert len(told) == 1
            assert told[0].startswith(
                f"Scan4D leaves out frame {kept + 1}: {path}, frame {kept + 1}: ends within the header"
            )
    path.write_bytes(data[:20])
    with pytest.raises(InputError, match="octree 0, at byte 0: ends within the header"):
        open_scan(path)


def test_all_poses_share_a_cube_around_them(tmp_path: Path) -> None:
    """However far they go; a point far outside is kept as it is."""
    poses = [pose_at(index, np.array([0.7 * index, 0, 0]) + UTM) for index in range(12)]
    stray = UTM + np.array([3e5, 0.25, -1e4])
    last = poses[-1].cloud
    more = PointCloud.from_arrays(
        np.vstack([last.world(), stray]),
        normals=np.vstack([last.normals, [[0, 0, 1]]]),
        colors=np.vstack([last.colors, [[1, 2, 3, 255]]]),
    )
    poses[-1] = Pose(11, poses[-1].time, "stray", more)
    bounds = [pose.bounds for pose in poses]
    around = Bounds(np.min([b.low for b in bounds], axis=0), np.max([b.high for b in bounds], axis=0))
    formats.write_poses(tmp_path / "a.svo", poses, "mm", around=around)
    data = (tmp_path / "a.svo").read_bytes()
    read = [read_header(data[at:])[0] for at, _ in headers(tmp_path / "a.svo")]
    assert len({(header.edge, *header.low) for header in read}) == 1
    assert [header.strays.nodes for header in read] == [0] * 11 + [1]
    back = formats.read(tmp_path / "a.svo", 11)
    np.testing.assert_array_equal(back.world()[-1], stray)
    assert back.colors[-1].tolist() == [1, 2, 3, 255]
    assert back.radii[-1] == np.float32(np.median(back.radii[:-1]))
    assert len(back) > 1000


def test_a_cut_behind_a_level_of_the_last_pose_is_a_coarser_one(scan: Path, tmp_path: Path) -> None:
    at, _ = headers(scan)[-1]
    data = scan.read_bytes()
    header, size = read_header(data[at:])
    end = at + size + sum(level.masks + level.attributes for level in header.levels[:6])
    (tmp_path / "cut.svo").write_bytes(data[:end])
    whole, coarse = formats.read(scan, COUNT - 1), formats.read(tmp_path / "cut.svo", COUNT - 1)
    assert 0.5 < np.median(coarse.radii) / (header.edge / 32) < 2
    assert len(coarse) == header.levels[5].nodes < len(whole)
    assert coarse.colors is not None
    assert coarse.normals is not None


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda data, at: data + b"some more", r"octree 20, at byte \d+: no octree begins"),
        (lambda data, at: data[:at] + b"x" + data[at:], r"octree 2, at byte \d+: no octree begins"),
        (lambda data, at: data[:at + 40] + b"x" + data[at + 41:], "the header of an octree is damaged"),
        (lambda data, at: data[: headers_at(data, 1)] + data[headers_at(data, 5):], "depends on 5 octrees"),
        (lambda data, at: data[headers_at(data, 5):], "octree 0 depends on 5 octrees before it"),
    ],
)  # fmt: skip
def test_damage_is_one_clear_error(change, message: str, scan: Path, tmp_path: Path) -> None:
    path = tmp_path / "damaged.svo"
    data = scan.read_bytes()
    path.write_bytes(change(data, headers_at(data, 2)))
    for call in (formats.frame_count, formats.read, formats.frames, formats.read_times):
        with pytest.raises(InputError, match=message) as caught:
            call(path)
        assert str(caught.value).startswith(f"{path}: ")


def headers_at(data: bytes, index: int) -> int:
    """Where an octree begins."""
    at = 0
    for _ in range(index):
        header, size = read_header(data[at:])
        at += size + header.stored
    return at


def test_a_damaged_pose_spares_those_it_does_not_tell(scan: Path, tmp_path: Path) -> None:
    data = bytearray(scan.read_bytes())
    data[headers_at(data, 13) - 1] ^= 1  # the last byte of pose 12
    (tmp_path / "damaged.svo").write_bytes(data)
    chains = [before for _, before in headers(scan)]
    with open_scan(tmp_path / "damaged.svo") as timeline:
        read = [pose.index for pose in timeline]
    assert [index for index in range(COUNT) if index - chains[index] > 12 or index < 12] == read


# --- the command ------------------------------------------------------------------------


def test_convert_writes_a_scan_as_one_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "demo.svo"
    assert cli.main(["convert", "demo", str(out), "--poses", "4:8", "--depth", "6"]) == 0
    assert capsys.readouterr().out == f"{out}\n"
    assert [path.name for path in tmp_path.iterdir()] == ["demo.svo"]
    with open_scan("demo") as demo, open_scan(out) as timeline:
        assert timeline.unit == "mm"
        assert timeline.times.tolist() == demo.times[4:8].tolist()
        cloud, whole = timeline.pose(2).cloud, demo.pose(6).cloud
        assert 1000 < len(cloud) < 10000
        for extreme in (np.min, np.max):
            sides = (extreme(each.world(), axis=0) for each in (cloud, whole))
            assert np.allclose(*sides, atol=edge_of(out, 2) / 2)
        assert list(cloud.scalars) == []
    assert 267 / 64 <= edge_of(out, 0) == edge_of(out, 3) < 1.5 * 267 / 64


def test_convert_with_a_delta(tmp_path: Path) -> None:
    counts = []
    for delta in ("0.5", "0.02"):
        out = tmp_path / f"{delta}.svo"
        assert cli.main(["convert", "demo", "--pose", "1", str(out), "--delta", delta]) == 0
        counts.append(len(formats.read(out)))
    assert counts[0] < counts[1]
    assert counts[1] >= 0.98 * len(open_scan("demo").pose(1).cloud)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["a%d.svo"], "a single file with all frames"),
        (["a.ply", "--depth", "5"], "--depth applies only to octrees"),
        (["a.ply", "--delta", "0.1"], "--delta applies only to octrees"),
        (["a.svo", "--depth", "22"], "depth: 22 is outside 0 to 21"),
        (["a.svo", "--delta", "nan"], "delta"),
        (["missing/a.svo"], "there is no folder"),
        (["a.jpg"], "Known: .exr, .npz, .pcd, .ply, .svo"),
    ],
)
def test_convert_refuses(
    arguments: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    assert cli.main(["convert", "demo", "--pose", "1", *arguments]) == 2
    assert message in capsys.readouterr().err
    assert [*tmp_path.iterdir()] == []


def test_a_failed_write_leaves_what_was_there(tmp_path: Path) -> None:
    def poses():
        yield pose_at(0)
        raise OSError(28, "No space left on device")

    (tmp_path / "a.svo").write_text("former")
    with pytest.raises(InputError, match="disk is full"):
        formats.write_poses(tmp_path / "a.svo", poses(), "mm")
    assert [path.read_text() for path in tmp_path.iterdir()] == ["former"]


def test_a_tree_of_far_more_leaves_than_its_bytes_is_refused_before_it_is_read(tmp_path: Path) -> None:
    """Full masks, one bit a leaf: 2.4 MB that would become 17 million points."""
    masks = tuple(np.full(8**level, 255, np.uint8) for level in range(8))
    tree = Octree(np.zeros(3), 1.0, masks, 8**8, 8**8)
    path = tmp_path / "full.svo"
    path.write_bytes(to_bytes(tree, packed=False))
    tracemalloc.start()
    with pytest.raises(InputError, match=r"would need 6\d\d MB of memory, which is suspiciously much"):
        formats.read(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 1_000_000


def test_octrees_in_two_units_are_refused(tmp_path: Path, full_cloud: PointCloud) -> None:
    parts = []
    for unit in ("mm", "m"):
        formats.write_poses(tmp_path / f"{unit}.svo", [Pose(0, 0.0, "", full_cloud)], unit)
        parts.append((tmp_path / f"{unit}.svo").read_bytes())
    (tmp_path / "both.svo").write_bytes(b"".join(parts))
    with pytest.raises(InputError, match="octree 1 has a different unit of length than the first"):
        formats.frame_count(tmp_path / "both.svo")


def test_a_file_that_has_changed_is_looked_at_again(tmp_path: Path, full_cloud: PointCloud) -> None:
    path = tmp_path / "scan.svo"
    for count in (2, 3):
        formats.write_poses(path, [Pose(i, float(i), "", full_cloud) for i in range(count)], "mm")
        assert formats.frame_count(path) == count


def test_files_of_very_many_octrees_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    tree = Octree(np.zeros(3), 1.0, (), 1, 1)
    (tmp_path / "scan.svo").write_bytes(b"".join(to_bytes(tree, time=float(i)) for i in range(6)))
    monkeypatch.setattr(octree_file, "_MOST_POSES", 5)
    with pytest.raises(InputError, match="has 6 octrees, but Scan4D reads at most 5"):
        formats.frame_count(tmp_path / "scan.svo")


def test_convert_tells_of_a_file_that_takes_too_much_to_be_read(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    points = np.random.default_rng(4).random((30_000, 3))
    np.save(tmp_path / "points.npy", points.astype(np.float32))
    words = ["convert", str(tmp_path / "points.npy"), str(tmp_path / "a.svo"), "--force"]
    assert cli.main(words) == 0
    assert capsys.readouterr().err == ""
    assert len(formats.read_points(tmp_path / "a.svo")) > 20_000
    monkeypatch.setenv("SCAN4D_READ_MB", "1")
    assert cli.main([*words[:1], "demo", "--pose", "0", str(tmp_path / "b.svo")]) == 0
    assert "set the environment variable SCAN4D_READ_MB=" in capsys.readouterr().err
    with pytest.raises(InputError, match="suspiciously much"):
        formats.read_points(tmp_path / "b.svo")

"""Octrees that arrive from a server or on standard input: level by level, whole in the end."""

from __future__ import annotations

import io
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from byte_server import serving
from scenes import sphere

from viewer.errors import InputError
from viewer.scan import formats
from viewer.scan.octree import byte_sources
from viewer.scan.octree.storage import read_header
from viewer.scan.octree.stored import octree_of
from viewer.scan.open import open_scan
from viewer.scan.pose import Pose
from viewer.scan.timeline import Timeline

FRAMES = 3


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    path = tmp_path_factory.mktemp("octrees") / "ball.svo"
    poses = (
        Pose(k, 0.5 * k, "", sphere(9000).displaced(np.full((9000, 3), 1e-3 * k))) for k in range(FRAMES)
    )
    formats.write_poses(path, poses, "mm")
    return path.read_bytes()


def from_file(data: bytes, folder: Path) -> Timeline:
    (folder / "ball.svo").write_bytes(data)
    return open_scan(folder / "ball.svo")


def as_input(monkeypatch: pytest.MonkeyPatch, data: bytes) -> None:
    monkeypatch.setattr("sys.stdin", SimpleNamespace(buffer=io.BytesIO(data)))


def level_start(data: bytes, level: int) -> int:
    """Where a level of the first octree begins."""
    header, size = read_header(data)
    stored = (each.masks + each.attributes for each in (header.strays, *header.levels[:level]))
    return size + sum(stored)


@pytest.fixture(autouse=True)
def small_answers(monkeypatch: pytest.MonkeyPatch) -> None:
    """A request brings what is asked for, as the levels of large octrees are longer than the least."""
    monkeypatch.setattr(byte_sources, "_AT_LEAST", 1)


def test_frames_of_a_server_are_those_of_the_file(data: bytes, tmp_path: Path) -> None:
    local = from_file(data, tmp_path)
    with serving(data) as served, open_scan(served.url) as scan:
        assert (len(scan), scan.unit, scan.name) == (FRAMES, "mm", "a.svo")
        np.testing.assert_array_equal(scan.times, local.times)
        for index in (2, 0, 1):
            ours, theirs = scan.pose(index).cloud, local.pose(index).cloud
            np.testing.assert_array_equal(ours.world(), theirs.world())
            np.testing.assert_array_equal(ours.normals, theirs.normals)


def test_levels_come_before_the_bytes_of_finer_ones(data: bytes) -> None:
    """The server keeps the two deepest levels back until the coarser ones were seen."""
    header, _ = read_header(data)
    deepest = len(header.levels) - 1
    for ranges in (True, False):
        held = range(level_start(data, deepest - 1), level_start(data, deepest + 1))
        with serving(data, ranges=ranges, held_back=held) as served, open_scan(served.url) as scan:
            coarser = scan.source.coarser(0)  # type: ignore[attr-defined]
            depths = []
            for cloud in coarser:
                octree = octree_of(cloud)
                assert octree is not None
                assert len(cloud) == octree.leaves == header.levels[octree.depth].nodes
                depths.append(octree.depth)
                if octree.depth == deepest - 2:
                    served.released.set()
            assert depths == [*range(depths[0], deepest)]
            assert depths[0] < deepest - 2
            assert len(scan.pose(0).cloud) == header.levels[-1].nodes


def test_a_frame_takes_its_own_bytes_alone(data: bytes) -> None:
    with serving(data) as served, open_scan(served.url) as scan:
        served.ranges.clear()
        scan.pose(0)
        header, size = read_header(data)
        assert max(start + count for start, count in served.ranges) == size + header.stored
        assert sum(count for _, count in served.ranges) == header.stored


def test_a_server_without_ranges_and_a_stream_give_the_first_octree(
    data: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    first = from_file(data, tmp_path).pose(0).cloud
    as_input(monkeypatch, data)
    with serving(data, ranges=False) as served:
        for name in (served.url, "-"):
            with open_scan(name) as scan:
                assert len(scan) == 1
                np.testing.assert_array_equal(scan.pose(0).cloud.world(), first.world())
                assert any("reads only the first octree" in message.text for message in scan.messages)


def test_what_is_cut_off_or_damaged_is_one_message(data: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    header, size = read_header(data)
    deepest = len(header.levels) - 1
    for keep, words in (
        (level_start(data, deepest) + 5, f"ends within level {deepest} of {deepest}"),
        (size - 3, "ends within the header"),
        (0, "no octree begins"),
    ):
        as_input(monkeypatch, data[:keep])
        with pytest.raises(InputError, match=words) as raised, open_scan("-") as scan:
            scan.pose(0)
        assert "standard input" in str(raised.value)
    broken = bytearray(data)
    broken[level_start(data, 4)] ^= 1
    with (
        serving(bytes(broken)) as served,
        open_scan(served.url) as scan,
        pytest.raises(InputError, match="level 4 of an octree is damaged"),
    ):
        scan.pose(0)


def test_what_a_server_refuses_is_one_message(data: bytes) -> None:
    with serving(data) as served:
        wrong = served.url.replace("a.svo", "b.svo")
        with pytest.raises(InputError, match="the server answers 404") as raised:
            open_scan(wrong)
        assert wrong in str(raised.value)
        gone = served.url
    with pytest.raises(InputError, match="cannot be read from the server"):
        open_scan(gone)
    with serving(b"<html>") as served, pytest.raises(InputError, match="no octree begins"):
        open_scan(served.url)


def test_the_worker_gives_coarser_poses_until_the_frame_is_there(data: bytes) -> None:
    header, _ = read_header(data)
    deepest = len(header.levels) - 1
    held = range(level_start(data, deepest), level_start(data, deepest + 1))
    with serving(data, held_back=held) as served, open_scan(served.url) as scan:
        scan.request(0)
        seen = 0
        while seen < header.levels[deepest - 1].nodes:
            pose = scan.ready(0)
            count = 0 if pose is None else pose.count
            assert count >= seen, "never coarser than before"
            seen = count
        assert scan.ready(0).count == header.levels[deepest - 1].nodes  # type: ignore[union-attr]
        served.released.set()
        assert scan.pose(0).count == header.levels[-1].nodes
        assert scan.ready(0) is scan.pose(0)

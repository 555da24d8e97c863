"""Whether an id is the same point in every frame: only where faces say so."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from written import write_mesh

from viewer.scan import formats
from viewer.scan.open import open_scan
from viewer.scan.points import PointCloud

POINTS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], np.float32)
FACES = ((0, 1, 2), (0, 2, 3))
OTHER = ((0, 1, 2), (0, 1, 3))
Faces = Sequence[tuple[int, int, int]]


def write_obj(path: Path, points: np.ndarray, faces: Faces) -> None:
    lines = [f"v {x} {y} {z}" for x, y, z in points] + [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in faces]
    path.write_text("\n".join(lines) + "\n")


def one_topology(scan: Path | str, most: int = 9) -> bool:
    """Whether a row is the same point of the subject in all frames, or in so many."""
    with open_scan(scan) as timeline:
        known = {timeline.pose(index).cloud.topology for index in range(min(len(timeline), most))}
        return len(known) == 1 and None not in known


WRITERS = {
    "binary ply": (".ply", write_mesh),
    "ascii ply": (".ply", lambda path, points, faces: write_mesh(path, points, faces, binary=False)),
    "obj": (".obj", write_obj),
}


@pytest.mark.parametrize("kind", WRITERS)
def test_equal_faces_in_every_file_say_so(tmp_path: Path, kind: str) -> None:
    suffix, write = WRITERS[kind]
    for name in "abc":
        write(tmp_path / f"{name}{suffix}", POINTS * ord(name), FACES)
    assert one_topology(tmp_path) is True
    write(tmp_path / f"b{suffix}", POINTS, OTHER)
    assert one_topology(tmp_path) is False
    write(tmp_path / f"b{suffix}", POINTS, ())
    assert one_topology(tmp_path) is False, "one frame does not tell"
    write(tmp_path / f"b{suffix}", np.concatenate([POINTS, POINTS[:1] + 5]), FACES)
    assert one_topology(tmp_path) is False, "a point more, and the same faces"


@pytest.mark.parametrize("kind", WRITERS)
def test_equal_numbers_of_points_say_nothing(tmp_path: Path, kind: str) -> None:
    suffix, write = WRITERS[kind]
    for name in "abc":
        write(tmp_path / f"{name}{suffix}", POINTS, ())
    assert one_topology(tmp_path) is False


def test_a_missing_point_does_not_change_the_topology(tmp_path: Path) -> None:
    write_mesh(tmp_path / "a.ply", POINTS, FACES)
    hidden = POINTS.copy()
    hidden[1] = np.nan
    write_mesh(tmp_path / "b.ply", hidden, FACES)
    assert one_topology(tmp_path) is True


def test_an_npz_says_so_by_its_faces(tmp_path: Path) -> None:
    positions = np.stack([POINTS, POINTS * 2])
    np.savez(tmp_path / "bare.npz", positions=positions)
    np.savez(tmp_path / "faces.npz", positions=positions, faces=np.array(FACES))
    np.savez(tmp_path / "odd.npz", positions=positions, faces=np.array(FACES, float))
    assert one_topology(tmp_path / "bare.npz") is False
    assert one_topology(tmp_path / "faces.npz") is True
    assert one_topology(tmp_path / "odd.npz") is False, "not faces, and left alone"


def test_faces_stored_once_beside_the_frames(tmp_path: Path) -> None:
    frames = tmp_path / "frames"
    frames.mkdir()
    for name in "ab":
        np.save(frames / f"{name}.npy", POINTS * ord(name))
    assert one_topology(tmp_path) is False
    write_mesh(tmp_path / "mesh_topology.ply", POINTS, FACES)
    assert one_topology(tmp_path) is True
    assert one_topology(frames) is True
    write_mesh(tmp_path / "mesh_topology.ply", POINTS[:3], FACES[:1])
    assert one_topology(tmp_path) is False, "faces of other points"
    (tmp_path / "mesh_topology.ply").write_bytes(b"no ply")
    assert one_topology(tmp_path) is False


@pytest.mark.slow
def test_the_demo_has_one_topology() -> None:
    assert one_topology("demo", 40) is True


REAL = {
    "crane_175": True,
    "horse_gallop_48": True,
    "owlii_basketball_player_10": False,
    "hands_knot_5": False,
    "waving_cat_16": False,
    "kitti_lidar_street_10": False,
}


@pytest.mark.parametrize("name", REAL)
def test_real_sequences(data_dir: Path, name: str) -> None:
    assert one_topology(data_dir / "sequences" / name, 4) is REAL[name]


def test_a_row_is_found_by_its_id() -> None:
    points = np.array([[0.0, 0, 0], [np.nan, 0, 0], [1, 0, 0], [2, 0, 0], [0, np.inf, 0]])
    cloud = PointCloud.from_arrays(points)
    assert [cloud.row_of(id) for id in range(-1, 6)] == [None, 0, None, 1, 2, None, None]
    assert [PointCloud.from_arrays(points[:1]).row_of(id) for id in (-1, 0, 1)] == [None, 0, None]


def test_faces_cost_no_precision_and_no_points(tmp_path: Path) -> None:
    write_mesh(tmp_path / "a.ply", POINTS, FACES, binary=False)
    np.testing.assert_array_equal(formats.read_points(tmp_path / "a.ply").world(), POINTS)

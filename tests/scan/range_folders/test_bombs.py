"""Folders that name much with little, or lead out of themselves: refused before it costs anything."""

from __future__ import annotations

import json
import sys
import tracemalloc
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from depth_folders import CAMERA, POSE, depth_numbers, write_camera, write_depth, write_matrix
from whole_folders import FOLDERS

from viewer.commands.info import scan_facts
from viewer.errors import InputError
from viewer.files import named_inside
from viewer.scan.admission import admit, opened, shared
from viewer.scan.open import find_source, open_scan
from viewer.scan.range_folders.tum import nearest_once

MB = 1 << 20
TOO_MUCH = "which is suspiciously much"


@contextmanager
def at_most(size: int) -> Iterator[None]:
    """Fail where more memory is taken meanwhile, bytes."""
    tracemalloc.start()
    try:
        yield
        assert tracemalloc.get_traced_memory()[1] < size
    finally:
        tracemalloc.stop()


def test_pairing_costs_no_more_than_its_rows(tmp_path: Path) -> None:
    """All rows are near to all others: trying each pair would take a hundred times as much."""
    rows = [f"{1e9 + n * 1e-6:.6f} a.png" for n in range(1500)]
    for name in ("depth.txt", "rgb.txt"):
        (tmp_path / name).write_text("\n".join(rows))
    with at_most(20 * MB):
        assert len(find_source(tmp_path)) == 1500


def test_pairs_are_those_of_the_rule_however_near_they_are() -> None:
    rng = np.random.default_rng(4)
    for n, m, span in ((40, 40, 0.1), (30, 60, 0.3), (50, 20, 0.02)):
        times, others = (np.unique(rng.integers(0, 1000, count)) * span / 1000 for count in (n, m))
        left, found = set(range(len(others))), np.full(len(times), -1)
        pairs = sorted((abs(b - a), i, j) for i, a in enumerate(times) for j, b in enumerate(others))
        for apart, i, j in pairs:
            if apart <= 0.02 and found[i] < 0 and j in left:
                found[i] = j
                left.remove(j)
        np.testing.assert_array_equal(nearest_once(times, others, 0.02), found)


@pytest.mark.parametrize("name", ["depth.txt", "rgbd.match", "trajectory.log"])
def test_lists_are_read_only_where_their_rows_are_in_proportion(name: str, tmp_path: Path) -> None:
    FOLDERS["tum" if name == "depth.txt" else "open3d"](tmp_path)
    text = {"depth.txt": "{} a\n", "rgbd.match": "a {}\n", "trajectory.log": "{}\n"}[name]
    (tmp_path / name).write_text("".join(text.format(n) for n in range(1_500_000)))
    with at_most(150 * MB), pytest.raises(InputError, match=TOO_MUCH):
        find_source(tmp_path)


def test_pods_that_share_one_picture_share_its_bytes(tmp_path: Path) -> None:
    write_depth(tmp_path / "flat.png", np.full((1500, 2000), 1000, np.uint16))
    pods = [{"name": str(n), "range": "flat.png", "fx": 900, "fy": 900, "cx": 9, "cy": 9} for n in range(64)]
    (tmp_path / "pods.json").write_text(json.dumps({"pods": pods}))
    with open_scan(tmp_path) as scan, at_most(250 * MB), pytest.raises(InputError, match=TOO_MUCH):
        scan.pose(0)


def test_a_picture_whose_points_take_too_much_is_refused(tmp_path: Path) -> None:
    write_depth(tmp_path / "flat_depth.png", np.full((2400, 3000), 1000, np.uint16))
    write_camera(tmp_path)
    with open_scan(tmp_path) as scan, at_most(250 * MB), pytest.raises(InputError, match=TOO_MUCH):
        scan.pose(0)


def test_files_of_a_frame_share_a_budget(tmp_path: Path) -> None:
    for name in ("a", "b"):
        (tmp_path / name).write_bytes(bytes(MB))
    (tmp_path / "link").symlink_to(tmp_path / "a")
    with shared() as budget:
        for name in ("a", "link", "a"):
            with opened(tmp_path / name):
                admit(MB, 190 * MB)
                with pytest.raises(InputError):
                    admit(MB, 190 * MB + 1)
        with opened(tmp_path / "b"):
            admit(MB, 200 * MB)
            budget.retained = 20 * MB
            admit(MB, 180 * MB)
            with pytest.raises(InputError):
                admit(MB, 180 * MB + 1)
    admit(MB, 190 * MB)  # of a file by itself, as ever


def test_a_conf_file_places_no_more_scans_than_a_frame_has(tmp_path: Path) -> None:
    FOLDERS["stanford"](tmp_path)
    line = (tmp_path / "scans.conf").read_text()
    (tmp_path / "scans.conf").write_text(3000 * line)
    with pytest.raises(InputError, match="has 3,000 scans to place, but Scan4D reads at most 256"):
        find_source(tmp_path)


def test_info_merges_no_points(tmp_path: Path) -> None:
    """What it tells is that of all points."""
    for n in range(2):
        write_depth(tmp_path / f"depth_{n}.png", depth_numbers(n))
    write_camera(tmp_path)
    (tmp_path / "pods").mkdir()
    FOLDERS["scanner"](tmp_path / "pods")
    for folder in (tmp_path, tmp_path / "pods"):
        with open_scan(folder) as scan:
            pose = scan.pose(0)
            facts = scan_facts(scan, pose)
            assert not pose.is_merged
            cloud = pose.cloud
        assert facts["points"] == len(cloud)
        np.testing.assert_allclose(facts["bounds"]["low"], cloud.world().min(axis=0), rtol=1e-6)
        np.testing.assert_allclose(facts["bounds"]["high"], cloud.world().max(axis=0), rtol=1e-6)
        if cloud.colors is not None:
            assert facts["attributes"]["colors"]["range"] == [cloud.colors.min(), cloud.colors.max()]
        view = cloud.scalars["view"]
        assert facts["attributes"]["view"]["range"] == [view.min(), view.max()]


# --- paths --------------------------------------------------------------------------------

OUTSIDE = ["../a.png", "/etc/a.png", "depth/../../a.png", "..\\a.png", "a/..", "\x1b[2Ja.png", "a" * 501]
OUT = "which is not a file in its folder. Put the named file into this folder"


def _replaced(file: Path, old: str, new: str) -> None:
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new))


@pytest.mark.parametrize("name", OUTSIDE)
@pytest.mark.parametrize(
    ("kind", "file", "old"),
    [
        ("tum", "depth.txt", "depth/0.png"), ("tum", "rgb.txt", "rgb/1.png"),
        ("open3d", "rgbd.match", "depth/1.png"), ("open3d", "rgbd.match", "color/0.png"),
        ("stanford", "scans.conf", "a.ply"), ("scanner", "pods.json", "left_*.tif"),
        ("scanner", "pods.json", "right_*.png"),
    ],
)  # fmt: skip
def test_no_file_leads_out_of_its_folder(kind: str, file: str, old: str, name: str, tmp_path: Path) -> None:
    """Though what it names is there."""
    folder = tmp_path / "scan"
    folder.mkdir()
    FOLDERS[kind](folder)
    for picture in folder.rglob("*.*"):
        (tmp_path / f"a{picture.suffix}").write_bytes(picture.read_bytes())
    _replaced(folder / file, old, json.dumps(name)[1:-1] if file.endswith(".json") else name)
    with pytest.raises(InputError, match=OUT) as caught:
        find_source(folder)
    assert str(caught.value.where) == str(folder / file)


@pytest.mark.parametrize("name", [".", "./", "././."])
def test_a_folder_is_no_file_in_itself(name: str, tmp_path: Path) -> None:
    """Another suffix of it would be a file beside it."""
    folder = tmp_path / "scan"
    folder.mkdir()
    np.savez(tmp_path / "scan.npz", xyz=np.zeros((4, 4, 3)))
    (folder / "scans.conf").write_text(f"bmesh {name} 0 0 0 0 0 0 1\n")
    with pytest.raises(InputError, match=OUT):
        find_source(folder)


def test_patterns_of_pods_that_all_name_the_same_files_are_refused(tmp_path: Path) -> None:
    """Each of them would be a list of all files, and of as many frames."""
    for number in range(1200):
        (tmp_path / f"{'a' * 64}{number}.tif").touch()
    images = {"texture": "{}*f", "mask": "{}*if", "confidence": "{}*tif", "range": "{}*"}
    pods = [
        {"name": start, "fx": 1, "fy": 1, "cx": 0, "cy": 0}
        | {image: pattern.format(start) for image, pattern in images.items()}
        for start in ("a" * count for count in range(1, 65))
    ]
    (tmp_path / "pods.json").write_text(json.dumps({"pods": pods}))
    with pytest.raises(InputError, match=TOO_MUCH):
        find_source(tmp_path)


def test_names_in_the_folder_are_taken_as_they_are(tmp_path: Path) -> None:
    for name in ("a.png", "./a.png", "depth/a b.png", "..a.png", "a..png", "ä/…/b.png"):
        assert named_inside(tmp_path, name, "list") == tmp_path / name


@pytest.mark.skipif(sys.platform == "win32", reason="links need rights there")
def test_links_that_the_user_has_put_into_a_folder_may_lead_out(tmp_path: Path) -> None:
    (tmp_path / "scan").mkdir()
    write_depth(tmp_path / "elsewhere" / "0.png", depth_numbers())
    write_matrix(tmp_path / "elsewhere" / "pose.txt", POSE)
    (tmp_path / "scan" / "depth").symlink_to(tmp_path / "elsewhere")
    (tmp_path / "scan" / "trajectory.log").write_text("0 0 1 " + " ".join(map(str, POSE.ravel())))
    (tmp_path / "scan" / "camera.json").write_text(json.dumps(CAMERA))
    with open_scan(tmp_path / "scan") as scan:
        assert len(scan.pose(0).cloud) == 22

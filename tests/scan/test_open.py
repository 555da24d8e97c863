"""What a user can name as a scan, the order of its frames, and their times."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from viewer.errors import InputError
from viewer.scan import formats
from viewer.scan.open import has_times_in_names, open_scan, retime
from viewer.scan.points import PointCloud


def put(folder: Path, *names: str) -> Path:
    """Small scans by these names; x of the only point is the place in the list."""
    for x, name in enumerate(names):
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        if path.suffix == ".npy":
            np.save(path, np.array([[x, 0, 0]], np.float32))
        else:
            path.write_text(f"{x} 0 0\n")
    return folder


def labels(path: str | os.PathLike[str]) -> list[str]:
    with open_scan(path) as scan:
        return [scan.label(index) for index in range(len(scan))]


def message(path: str | os.PathLike[str], **options: float) -> str:
    with pytest.raises(InputError) as caught:
        open_scan(path, **options)
    return str(caught.value)


def test_a_folder_in_natural_order(tmp_path: Path) -> None:
    put(tmp_path, "f10.npy", "f9.npy", "f1.npy")
    with open_scan(tmp_path, unit="mm") as scan:
        assert [pose.label for pose in scan] == ["f1.npy", "f9.npy", "f10.npy"]
        assert [pose.cloud.world()[0, 0] for pose in scan] == [2, 1, 0]
        assert scan.times == pytest.approx([0, 8 / 25, 9 / 25])
        assert (scan.name, scan.unit) == (tmp_path.name, "mm")
    with open_scan(tmp_path) as scan:
        assert scan.unit == "units"


def test_the_current_folder_has_a_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(put(tmp_path, "a.npy"))
    assert open_scan(".").name == tmp_path.name


def test_opening_reads_no_frame(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    put(tmp_path, *(f"{index}.npy" for index in range(1000)))
    monkeypatch.setattr(formats, "read", lambda *_: pytest.fail("a frame was read"))
    monkeypatch.setattr(formats, "frame_count", lambda *_: pytest.fail("a header was read"))
    with open_scan(tmp_path) as scan:
        assert len(scan) == 1000
        assert scan.label(999) == "999.npy"


@pytest.mark.parametrize(
    "other", ["readme.txt", "notes.CSV", "times.csv", ".hidden.ply", "preview.png", "old.npy~"]
)
def test_what_is_no_frame_of_a_folder(tmp_path: Path, other: str) -> None:
    put(tmp_path, "1.npy", "2.npy")
    (tmp_path / other).write_text("file,time\n1.npy,5\n2.npy,6\n")
    assert labels(tmp_path) == ["1.npy", "2.npy"]


def test_text_files_are_frames_where_nothing_else_is(tmp_path: Path) -> None:
    put(tmp_path, "1.txt", "2.txt")
    (tmp_path / "times.csv").write_text("0,1\n1,2.5\n")
    with open_scan(tmp_path) as scan:
        assert [pose.label for pose in scan] == ["1.txt", "2.txt"]
        assert scan.times.tolist() == [1, 2.5]


def test_folders_inside_are_not_frames(tmp_path: Path) -> None:
    put(tmp_path, "1.npy", "2.npy/inner.npy")
    assert labels(tmp_path) == ["1.npy"]


def test_suffixes_in_any_case(tmp_path: Path) -> None:
    put(tmp_path, "1.npy")
    (tmp_path / "1.npy").rename(tmp_path / "1.NPY")
    assert open_scan(tmp_path).pose(0).label == "1.NPY"


def test_a_folder_of_mixed_kinds_is_ambiguous(tmp_path: Path) -> None:
    put(tmp_path, "1.npy", "2.npy", "3.xyz", "readme.txt")
    assert message(tmp_path) == (
        f"{tmp_path}: contains files of several kinds (2 .npy, 1 .xyz). "
        "Choose one kind with a pattern such as '*.npy'"
    )
    assert labels(tmp_path / "*.xyz") == ["3.xyz"]
    assert labels(tmp_path / "*.txt") == ["readme.txt"]


def test_a_folder_called_frames_inside(tmp_path: Path) -> None:
    put(tmp_path, "mesh.npy", "frames/1.npy", "frames/3.npy")
    with open_scan(tmp_path) as scan:
        assert [pose.label for pose in scan] == ["1.npy", "3.npy"]
        assert scan.name == tmp_path.name
        assert scan.times == pytest.approx([0, 0.08])
    (tmp_path / "times.csv").write_text("1.npy,7\n3.npy,8\n")
    assert open_scan(tmp_path).times.tolist() == [7, 8]
    assert open_scan(tmp_path / "frames").times.tolist() == [7, 8]


def test_nothing_to_open(tmp_path: Path) -> None:
    assert (
        "holds no scan files. Scan4D reads files with the suffixes .asc, .csv, .cw, .exr, .las, .laz, .npy"
        in message(tmp_path)
    )
    put(tmp_path, "b/1.npy", "a10/1.npy", "a9/1.npy")
    assert message(tmp_path).endswith("holds no scan files. Open one of its folders: a9, a10, b")
    assert "a.jpg: unknown file suffix '.jpg'. Scan4D does not read a picture alone" in message(
        put(tmp_path, "a.jpg") / "a.jpg"
    )
    assert "a.odd: unknown file suffix '.odd'. Known: .asc, .csv, .cw, .exr, .las, .laz" in message(
        put(tmp_path, "a.odd") / "a.odd"
    )
    assert "is empty" in message_of_pose(put_empty(tmp_path / "empty.ply"))
    assert "is neither a file nor a folder" in message(os.devnull)


def put_empty(path: Path) -> Path:
    path.touch()
    return path


def message_of_pose(path: Path) -> str:
    with pytest.raises(InputError) as caught:
        open_scan(path).pose(0)
    return str(caught.value)


def test_a_missing_path_suggests_close_names(tmp_path: Path) -> None:
    put(tmp_path, "hands/1.npy")
    wrong = tmp_path / "hand" / "1.npy"
    assert message(wrong) == f"{wrong}: no such file or folder. Did you mean: hands"
    far = tmp_path / "hands" / "elsewhere.ply"
    assert message(far) == f"{far}: no such file or folder. There is no 'elsewhere.ply' in {far.parent}"
    assert "Not a directory" in message(tmp_path / "hands" / "1.npy" / "2.npy")
    assert "no such file" in message("x" * 5000)
    assert "no such file" in message("nul\0byte")


def test_printf_patterns(tmp_path: Path) -> None:
    put(tmp_path, "f0009.npy", "f0010.npy", "f10000.npy", "f7.npy", "f0008_old.npy", "g0001.npy")
    assert labels(tmp_path / "f%04d.npy") == ["f0009.npy", "f0010.npy", "f10000.npy"]
    assert labels(tmp_path / "f%d.npy") == ["f7.npy", "f0009.npy", "f0010.npy", "f10000.npy"]


def test_printf_patterns_in_folders_and_odd_names(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    put(tmp_path, "take[1]/pod1/scan.npy", "take[1]/pod2/scan.npy", "take[1]/podx/scan.npy")
    assert labels(tmp_path / "take[1]" / "pod%d" / "scan.npy") == ["pod1/scan.npy", "pod2/scan.npy"]
    monkeypatch.chdir(tmp_path / "take[1]")
    assert labels("./pod%d/scan.npy") == ["pod1/scan.npy", "pod2/scan.npy"]


def test_glob_patterns(tmp_path: Path) -> None:
    put(tmp_path, "f9.npy", "f10.npy", "g1.npy", "take[1].npy")
    assert labels(tmp_path / "f*.npy") == ["f9.npy", "f10.npy"]
    assert labels(tmp_path / "**" / "f9.npy") == ["f9.npy"], "in the folder itself, too"
    assert labels(tmp_path / "f[0-9].npy") == ["f9.npy"]
    assert labels(tmp_path / "take[1].npy") == ["take[1].npy"]  # a name that exists is no pattern
    assert "h*.npy: matches no file. Check the folder" in message(tmp_path / "h*.npy")
    assert "f%03d.npy: matches no file" in message(tmp_path / "f%03d.npy")
    put(tmp_path, "a.jpg")
    assert "*.jpg: matches no file that Scan4D can read, but 1 .jpg file" in message(tmp_path / "*.jpg")


def test_one_file_is_one_pose_at_time_zero(tmp_path: Path) -> None:
    put(tmp_path, "0007.npy", "0008.npy")
    (tmp_path / "times.csv").write_text("0007.npy,5\n0008.npy,6\n")
    with open_scan(tmp_path / "0008.npy", fps=10) as scan:
        assert scan.times.tolist() == [0]
        assert scan.pose(0).label == scan.name == "0008.npy"


# --- times -------------------------------------------------------------------------------


def test_times_csv_outweighs_fps_and_says_so(tmp_path: Path) -> None:
    put(tmp_path, "1.npy", "2.npy")
    assert open_scan(tmp_path, fps=10).times == pytest.approx([0, 0.1])
    (tmp_path / "times.csv").write_text("file,time\n1.npy,3\n2.npy,4\n")
    assert open_scan(tmp_path).messages == []
    scan = open_scan(tmp_path, fps=10)
    assert scan.times.tolist() == [3, 4]
    assert [(notice.kind, notice.index) for notice in scan.messages] == [("times", None)]


def test_a_bad_times_csv_is_one_message(tmp_path: Path) -> None:
    put(tmp_path, "1.npy", "2.npy")
    (tmp_path / "times.csv").write_text("file,time\n1.npy,3\n2.npy,2\n")
    assert f"{tmp_path / 'times.csv'}, line 3: '2.npy' is not later than '1.npy'" in message(tmp_path)


@pytest.mark.parametrize("fps", [0, -25, float("nan"), float("inf")])
def test_frame_rates_that_make_no_sense(tmp_path: Path, fps: float) -> None:
    assert "frame rate" in message(put(tmp_path, "1.npy"), fps=fps)


# --- one file of many frames -------------------------------------------------------------


def test_an_npy_of_many_frames(tmp_path: Path) -> None:
    positions = np.random.default_rng(1).normal(size=(4, 50, 3)).astype(np.float32)
    np.save(tmp_path / "walk.npy", positions)
    for path in (tmp_path / "walk.npy", tmp_path):
        with open_scan(path, fps=2) as scan:
            assert scan.times.tolist() == [0, 0.5, 1, 1.5]
            for pose, expected in zip(scan, positions, strict=True):
                assert pose.cloud.world() == pytest.approx(expected)
            assert scan.label(2) == "walk.npy frame 3"


def test_an_npz_with_times(tmp_path: Path) -> None:
    path = tmp_path / "walk.npz"
    np.savez(path, positions=np.ones((3, 5, 3), np.float32), times=[1.0, 1.5, 4.0])
    assert open_scan(path).times.tolist() == [1, 1.5, 4]
    assert open_scan(path, fps=10).times == pytest.approx([0, 0.1, 0.2])
    np.savez(path, positions=np.ones((3, 5, 3), np.float32), times=[1.0, 1.0, 4.0])
    assert "walk.npz: the times of the frames do not increase" in message(path)


def test_a_sequence_of_files_of_many_frames_is_refused_not_cut(tmp_path: Path) -> None:
    for name in ("1.npy", "2.npy"):
        np.save(tmp_path / name, np.ones((4, 5, 3), np.float32))
    with open_scan(tmp_path) as scan, pytest.raises(InputError, match=r"2\.npy: contains 4 frames"):
        scan.pose(1)


# --- real sequences and the demo ---------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "count", "first", "last", "points"),
    [
        ("hands_knot_5", 5, "00001.ply", "00006.ply", 147_962),
        ("owlii_basketball_player_10", 10, "0011.ply", "0020.ply", 20_672),
        ("waving_cat_16", 16, "00022.ply", "00037.ply", 13_533),
        ("crane_175", 175, "0000.ply", "0174.ply", 10_002),
        ("horse_gallop_48", 48, "0000.ply", "0047.ply", 8_431),
        ("kitti_lidar_street_10", 10, "0000000000.pcd", "0000000009.pcd", 119_978),
    ],
)
def test_real_sequences(data_dir: Path, name: str, count: int, first: str, last: str, points: int) -> None:
    with open_scan(data_dir / "sequences" / name) as scan:
        assert (scan.name, len(scan)) == (name, count)
        assert (scan.label(0), scan.label(count - 1)) == (first, last)
        pose = scan.pose(0)
        assert len(pose.cloud) == points
        assert len(scan.pose(count - 1).cloud) > 0
        assert scan.messages == []


def test_real_times(data_dir: Path) -> None:
    sequences = data_dir / "sequences"
    assert open_scan(sequences / "hands_knot_5").times == pytest.approx([0, 0.04, 0.08, 0.12, 0.2])
    assert open_scan(sequences / "kitti_lidar_street_10", fps=10).times == pytest.approx(np.arange(10) / 10)
    assert open_scan(sequences / "crane_175").times == pytest.approx(np.arange(175) / 25)
    every_third = data_dir / "range" / "truedepth_head_30" / "frame-%03d.npz"
    assert open_scan(every_third, fps=30).times == pytest.approx(np.arange(30) / 10)


def test_the_demo() -> None:
    with open_scan("demo") as scan:
        assert (scan.name, scan.unit) == ("demo", "mm")
        assert len(scan) >= 60
        assert scan.times[1] == pytest.approx(0.04)
        pose = scan.pose(len(scan) // 2)
        assert len(pose.cloud) >= 60_000
        assert pose.cloud.normals is not None
    with open_scan("demo", unit="cm", fps=50) as scan:
        assert scan.unit == "cm"
        assert scan.times[:3] == pytest.approx([0, 0.02, 0.04])


def test_a_folder_called_demo(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    put(tmp_path, "demo/1.npy")
    monkeypatch.chdir(tmp_path)
    assert labels("./demo") == ["1.npy"]


def test_a_mesh_beside_its_frames_opens_alone(data_dir: Path) -> None:
    with open_scan(data_dir / "sequences" / "crane_175" / "mesh_topology.ply") as scan:
        assert [len(pose.cloud) for pose in scan] == [10_002]


def test_a_rate_or_names_tell_the_times_of_a_scan_that_is_open(tmp_path: Path) -> None:
    for stamp in ("12.000", "12.540", "13.120"):
        formats.write(tmp_path / f"face_{stamp}.npz", PointCloud.from_arrays(np.eye(3)))
    with open_scan(tmp_path) as scan:
        before = scan.times
        assert has_times_in_names(scan)
        retime(scan, None, by_names=True)
        np.testing.assert_allclose(scan.times, [0, 0.54, 1.12])
        retime(scan, 10.0)
        np.testing.assert_allclose(scan.times, [0, 0.1, 0.2])
        retime(scan, None)
        np.testing.assert_array_equal(scan.times, before)


def test_no_rate_counts_beside_a_times_csv(tmp_path: Path) -> None:
    for number in (40, 80):
        formats.write(tmp_path / f"{number}.npz", PointCloud.from_arrays(np.eye(3)))
    (tmp_path / "times.csv").write_text("40.npz,0\n80.npz,3\n")
    with open_scan(tmp_path) as scan:
        assert not has_times_in_names(scan)
        retime(scan, 10.0, by_names=True)
        np.testing.assert_array_equal(scan.times, [0, 3])


def test_a_folder_that_holds_another_scan_says_so(tmp_path: Path) -> None:
    cloud = PointCloud.from_arrays(np.eye(3))

    def told(folder: Path) -> list[str]:
        with open_scan(folder) as timeline:
            return [message.text for message in timeline.messages if message.kind == "beside"]

    (tmp_path / "frames").mkdir()
    for number in range(3):
        formats.write(tmp_path / "frames" / f"{number}.ply", cloud)
    for name in ("times.csv", "notes.txt", "mesh_topology.ply", ".hidden.ply"):
        (tmp_path / name).write_text("frame,time\n")
    (tmp_path / "times.csv").unlink()
    assert told(tmp_path) == [], "tables, faces and hidden files are no scans"
    formats.write(tmp_path / "whole10.npz", cloud)
    formats.write(tmp_path / "whole9.ply", cloud)
    (text,) = told(tmp_path)
    assert text == (
        "The folder also contains whole9.ply, whole10.npz beside this scan. "
        "To see such a file, open it by its name."
    )
    assert told(tmp_path / "frames") == []
    assert told(tmp_path / "whole9.ply") == []


def test_corrections_are_part_of_the_record(tmp_path: Path) -> None:
    table = tmp_path / "points.xyz"
    table.write_text("1 2 3 4\n5 6 7 8\n9 1 2 3\n")
    with open_scan(table, read={"columns": "intensity x y z", "unit": "mm"}) as timeline:
        cloud = timeline.pose(0).cloud
        record = timeline.reading
    np.testing.assert_allclose(cloud.world(), [(2, 3, 4), (6, 7, 8), (1, 2, 3)])
    np.testing.assert_allclose(cloud.scalars["intensity"], [1, 5, 9])
    assert (record["columns"].value, record["columns"].source) == (["intensity", "x", "y", "z"], "user")
    assert (record["unit"].value, record["unit"].source) == ("mm", "user")
    assert not [message for message in timeline.messages if message.kind == "correction"]


def test_a_correction_that_changes_nothing_is_reported_once(tmp_path: Path) -> None:
    for index in range(2):
        np.save(tmp_path / f"{index}.npy", np.zeros((2, 3), np.float32) + index)
    with open_scan(tmp_path, read={"texture": "dense"}) as timeline:
        list(timeline)
        told = [message.text for message in timeline.messages if message.kind == "correction"]
    assert told == ["The correction texture=dense does not apply to this scan, so Scan4D ignores it"]


def test_columns_that_do_not_fit_the_file_are_refused(tmp_path: Path) -> None:
    (tmp_path / "points.xyz").write_text("1 2 3 4\n")
    with (
        open_scan(tmp_path / "points.xyz", read={"columns": "x y z"}) as timeline,
        pytest.raises(InputError, match=r"has 4 columns, but --read columns= names 3"),
    ):
        timeline.pose(0)


def test_colors_and_normals_can_be_left_out(tmp_path: Path) -> None:
    (tmp_path / "p.csv").write_text("x,y,z,nx,ny,nz,r,g,b\n1,2,3,0,0,1,9,9,9\n2,2,2,0,0,1,9,200,9\n")
    with open_scan(tmp_path / "p.csv", read={"normals": "none", "colors": "none"}) as timeline:
        cloud = timeline.pose(0).cloud
        assert [timeline.reading[key].source for key in ("normals", "colors")] == ["user", "user"]
    assert cloud.normals is None
    assert cloud.colors is None
    assert not cloud.scalars


def test_the_record_says_where_times_and_frames_come_from(tmp_path: Path) -> None:
    for index in range(2):
        np.save(tmp_path / f"f{index}.npy", np.zeros((2, 3), np.float32) + index)
    with open_scan(tmp_path) as timeline:
        times, frames = timeline.reading["times"], timeline.reading["frames"]
        assert times.source == "assumed"
        assert "times" in timeline.reading.assumed
        assert frames.source == "folder"
    with open_scan(tmp_path, fps=50) as timeline:
        assert timeline.reading["times"].source == "user"
    (tmp_path / "times.csv").write_text("file,time\nf0.npy,0\nf1.npy,1\n")
    with open_scan(tmp_path) as timeline:
        times = timeline.reading["times"]
        assert (times.source, times.where) == ("neighbour", "times.csv")

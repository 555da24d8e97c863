"""The 47 checks of files as people have them: `reported/README.md` says for each what is right.

Each test does what a user does: it opens the scan with `open_scan`, or runs a command line. Where the README
allows several answers, the test takes one of them, and says so.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from viewer import PointCloud, cli, open_scan
from viewer.analysis.landmarks.files import read_landmarks
from viewer.errors import InputError

RED, GREEN, BLUE, YELLOW = [255, 0, 0], [0, 255, 0], [0, 0, 255], [255, 255, 0]


class Done(NamedTuple):
    """What became of a command line."""

    code: int
    out: str
    err: str


@pytest.fixture
def reported(data_dir: Path) -> Path:
    """The folder of cases below the folder of real scans."""
    folder = data_dir / "reported"
    if not folder.is_dir():
        pytest.skip(f"no reported cases in {folder}")
    return folder


@pytest.fixture
def command(capsys: pytest.CaptureFixture[str]) -> Callable[..., Done]:
    """command("info", ...): a command line in this process."""

    def run(*words: object) -> Done:
        capsys.readouterr()
        code = cli.main([str(word) for word in words])
        captured = capsys.readouterr()
        assert "Traceback" not in captured.err
        return Done(code, captured.out, captured.err)

    return run


@pytest.fixture
def info(command: Callable[..., Done]) -> Callable[..., dict[str, Any]]:
    """info(scan, ...): what `scan4d info --json` says, with the messages under "told"."""

    def facts(*words: object) -> dict[str, Any]:
        done = command("info", *words, "--json")
        assert done.code == 0, done.err
        return json.loads(done.out) | {"told": done.err}

    return facts


def clouds(path: Path) -> list[PointCloud]:
    """The points of all frames."""
    with open_scan(path) as timeline:
        return [timeline.pose(index).cloud for index in range(len(timeline))]


def only(path: Path) -> PointCloud:
    """The points of a scan of one frame."""
    (cloud,) = clouds(path)
    return cloud


def colors(cloud: PointCloud) -> list[list[int]]:
    """Red, green and blue of all points."""
    assert cloud.colors is not None
    return cloud.colors[:, :3].tolist()


def times(path: Path) -> NDArray[np.float64]:
    """When the frames are, from the first one on."""
    with open_scan(path) as timeline:
        return timeline.times - timeline.times[0]


def decision(facts: dict[str, Any], key: str) -> dict[str, Any]:
    """A decision of the record: value, source, from and alternatives."""
    return facts["reading"]["decisions"][key]


def near(found: Any, wanted: Any, within: float = 1e-5) -> None:
    """The numbers are these."""
    np.testing.assert_allclose(found, wanted, rtol=0, atol=within)


# --- splats, normals, colours ---------------------------------------------------------------


def test_01_splats_have_their_colors_and_opacity(reported: Path) -> None:
    cloud = only(reported / "01_gaussian_splats.ply")
    assert cloud.colors is not None
    on_the_right = cloud.world()[:, 0] > 0
    near(cloud.colors[on_the_right, :3], np.broadcast_to([230, 26, 26], (on_the_right.sum(), 3)), 1)
    near(cloud.colors[~on_the_right, :3], np.broadcast_to([26, 51, 230], ((~on_the_right).sum(), 3)), 1)
    near(cloud.colors[:, 3], 0.982 * 255, 1)


def test_01_splats_are_ellipses_that_face_outward(reported: Path) -> None:
    cloud = only(reported / "01_gaussian_splats.ply")
    assert cloud.axes is not None
    assert cloud.normals is not None
    near(np.linalg.norm(cloud.axes[:, :3], axis=1), 0.045, 1e-4)
    near(cloud.axes[:, 3], 0.045, 1e-4)
    outward = cloud.world() / np.linalg.norm(cloud.world(), axis=1, keepdims=True)
    assert (np.einsum("ij,ij->i", outward, cloud.normals) > 0.99).all()
    assert not {name for name in cloud.scalars if name.startswith(("f_dc", "rot_", "scale_", "opacity"))}


def test_02_zero_normals_count_as_none(reported: Path, info: Callable[..., Any]) -> None:
    assert only(reported / "02_zero_normals.ply").normals is None
    facts = info(reported / "02_zero_normals.ply")
    assert "normals" not in facts["attributes"]
    assert decision(facts, "normals")["value"] == "dropped"
    assert facts["told"].replace("02_zero_normals", "").count("normals") == 1


def test_03_rows_of_unit_length_are_normals(reported: Path) -> None:
    cloud = only(reported / "03_floor_with_normals.xyz")
    assert cloud.colors is None
    assert cloud.normals is not None
    near(cloud.normals, np.broadcast_to([0, 0, 1], (25, 3)))


# --- tables ---------------------------------------------------------------------------------


def test_04_decimal_commas_with_blanks(reported: Path) -> None:
    cloud = only(reported / "04_decimal_commas.xyz")
    near(cloud.world(), [(1.25, 2.5, -3.75), (4.5, 5.25, 6.12), (1000.5, -0.5, 7)])
    assert cloud.normals is None


def test_05_semicolons_and_decimal_commas(reported: Path, info: Callable[..., Any]) -> None:
    near(
        only(reported / "05_german.csv").world(), [(1.25, 2.5, -3.75), (4.5, 5.25, 6.125), (1000.5, -0.5, 7)]
    )
    assert decision(info(reported / "05_german.csv"), "decimal")["value"] == ","


def test_06_a_number_in_front_is_no_coordinate(reported: Path) -> None:
    cloud = only(reported / "06_number_first.txt")
    near(cloud.world().min(axis=0), (10.5, 20.5, 30.5))
    assert len(cloud) == 9


def test_07_a_count_too_small_loses_no_row(reported: Path) -> None:
    cloud = only(reported / "07_count_too_small.pts")
    near(cloud.world(), [(1.5, 2.5, 3.5), (4.5, 5.5, 6.5), (7.5, 8.5, 9.0)])
    assert colors(cloud)[2] == [70, 80, 90]


def test_08_zeros_that_saw_nothing_are_left_out(reported: Path, info: Callable[..., Any]) -> None:
    facts = info(reported / "08_not_measured_is_zero.ply")
    assert facts["points"] == 800
    assert facts["dropped"] == 500
    near([facts["bounds"]["low"][2], facts["bounds"]["high"][2]], (805.1, 994.9), 0.1)
    assert decision(facts, "missing")["value"] == "0 0 0"


def test_09_float_colors_up_to_255(reported: Path) -> None:
    assert colors(only(reported / "09_colors_float_255.npz")) == [[200, 100, 50], [10, 20, 30], BLUE]


def test_10_the_color_range_is_that_of_the_sequence(reported: Path) -> None:
    firsts = [colors(cloud)[0] for cloud in clouds(reported / "10_dark_frame")]
    assert firsts == [[156, 78, 39], [1, 1, 0], [156, 78, 39]]


def test_11_an_organised_cloud_is_one_frame(reported: Path) -> None:
    assert len(only(reported / "11_organised_24x32x3.npy")) == 768


def test_12_fps_of_an_archive(reported: Path) -> None:
    near(times(reported / "12_rate_50.npz"), (0, 0.02, 0.04, 0.06))


# --- which files are frames, and when -------------------------------------------------------


def test_13_two_takes_are_two_scans(reported: Path, info: Callable[..., Any]) -> None:
    """The first take opens, the message names both, and --take chooses."""
    facts = info(reported / "13_two_takes")
    assert facts["poses"] == 3
    assert "take1_" in facts["told"]
    assert "take2_" in facts["told"]
    other = info(reported / "13_two_takes", "--take", "take2")
    assert (other["poses"], other["label"]) == (3, "take2_frame001.ply")


def test_14_conflict_copies_are_left_aside(reported: Path, info: Callable[..., Any]) -> None:
    facts = info(reported / "14_conflict_copies")
    assert facts["poses"] == 3
    aside = {row["file"] for row in facts["reading"]["aside"]}
    assert aside == {"f002 (PC-7's conflicted copy 2024-05-01).ply", "f003 - Copy.ply"}


def test_15_dates_are_no_frame_numbers(reported: Path) -> None:
    near(times(reported / "15_dates"), (0, 0.04, 0.08))


def film_changes(command: Callable[..., Done], scan: Path, film: Path, *more: object) -> list[float]:
    """When the picture of a film changes, in seconds: the first one, and each that differs from the last."""
    av = pytest.importorskip("av")
    done = command(
        "render", scan, "--all", "-o", film, "--size", "160x120", "--look", "background=#000000", *more
    )
    assert done.code == 0, done.err
    changes, before = [], None
    with av.open(str(film)) as container:
        for frame in container.decode(video=0):
            image = frame.to_ndarray(format="rgb24").astype(float)
            if before is None or np.abs(image - before).max() > 40:
                changes.append(float(frame.time))
                before = image
    return changes


def test_16_a_film_shows_each_pose_until_the_next(
    reported: Path, command: Callable[..., Done], tmp_path: Path
) -> None:
    near(film_changes(command, reported / "16_gap", tmp_path / "x.mp4"), (0, 0.04, 0.2), 1e-3)


def test_17_a_frame_column_makes_frames(reported: Path) -> None:
    found = clouds(reported / "17_frame_column.csv")
    assert [len(cloud) for cloud in found] == [2, 2, 2]
    near(found[1].world(), [(1.5, 2, 3), (4.5, 5, 6)])
    near(times(reported / "17_frame_column.csv"), (0, 0.04, 0.08))


def test_18_a_texture_gives_the_vertices_their_colors(reported: Path) -> None:
    cloud = only(reported / "18_textured" / "face.obj")
    assert colors(cloud)[:4] == [RED, GREEN, BLUE, YELLOW]
    near(cloud.world()[:4], [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)])


@pytest.mark.parametrize("name", ["cameras.txt", "camera.txt"])
def test_19_cameras_are_no_points(reported: Path, command: Callable[..., Done], name: str) -> None:
    done = command("info", reported / "19_cameras" / name)
    assert done.code == 2
    assert "camera" in done.err.removeprefix(f"scan4d: {reported / '19_cameras' / name}")


def test_20_landmarks_in_the_axes_that_the_file_states(
    reported: Path, command: Callable[..., Done], tmp_path: Path
) -> None:
    folder, out = reported / "20_space_ras", tmp_path / "m.csv"
    done = command("measure", folder / "head.ply", "--landmarks", folder / "points.mrk.json", "-o", out)
    assert done.code == 0, done.err
    found = read_landmarks(out)
    assert found.names == ("P0", "P1", "P2")
    near(
        found.positions[0],
        [(-9.507, -51.88, 83.006), (79.194, 15.576, -0.119), (-48.165, 29.748, -71.369)],
        0.01,
    )


def test_21_landmarks_of_slicers_table(reported: Path) -> None:
    found = read_landmarks(reported / "21_slicer_table.csv")
    assert found.names == ("nose", "eyeL")
    assert found.axes == "LPS"
    near(found.positions[0], [(1, 2, 3), (4, 5, 6)])


def test_21_slicers_table_in_ras_with_a_gap(tmp_path: Path) -> None:
    table = tmp_path / "points.csv"
    table.write_text(
        "label,r,a,s,defined,selected,visible,locked,description\nnose,1,2,3,1,1,1,0,\nchin,0,0,0,0,1,1,0,\n"
    )
    found = read_landmarks(table)
    near(found.positions[0, 0], (-1, -2, 3))
    assert np.isnan(found.positions[0, 1]).all()


# --- depth cameras --------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["camera_intrinsic.json", "intrinsic.json"])
def test_22_folders_of_recorders(reported: Path, tmp_path: Path, name: str) -> None:
    folder = shutil.copytree(reported / "22_recorder", tmp_path / "recorder")
    (folder / "camera_intrinsic.json").rename(folder / name)
    with open_scan(folder) as timeline:
        assert len(timeline) == 2
        (view,) = timeline.pose(0).views
    near((view.fx, view.fy, view.cx, view.cy), (30, 30, 16, 12))  # pixel centres at +0.5
    near((view.depth[view.valid()].min(), view.depth[view.valid()].max()), (0.479, 0.6), 1e-3)
    assert view.color is not None


def depth_of(path: Path) -> NDArray[np.float32]:
    """The depths of a picture of one view."""
    with open_scan(path) as timeline:
        (view,) = timeline.pose(0).views
    return view.depth[view.valid()]


def test_23_depth_of_a_value_socket(reported: Path) -> None:
    depth = depth_of(reported / "23_depth_value_socket.exr")
    near((depth.min(), depth.max()), (0.479, 0.6), 1e-3)


# --- tables with other heads ----------------------------------------------------------------


def test_24_columns_as_paraview_names_them(reported: Path) -> None:
    cloud = only(reported / "24_paraview.csv")
    near(cloud.world(), [(0, 0, 0), (1, 0, 0), (0, 1, 0)])
    assert colors(cloud) == [RED, GREEN, BLUE]


def test_25_units_in_names_of_columns(reported: Path) -> None:
    with open_scan(reported / "25_units_in_names.csv") as timeline:
        near(timeline.pose(0).cloud.world(), [(1, 2, 3), (4, 5, 6), (7, 8, 10)])
        assert timeline.unit == "mm"


def test_26_a_label_in_front(reported: Path) -> None:
    near(only(reported / "26_label_first.csv").world(), [(1, 2, 3), (4, 5, 6), (7, 8, 9.5)])


def test_27_some_vertices_with_colors(reported: Path) -> None:
    cloud = only(reported / "27_some_vertices_coloured.obj")
    assert len(cloud) == 6
    assert colors(cloud)[:3] == [RED, GREEN, BLUE]


@pytest.mark.parametrize("name", ["28_uint64.ply", "28_bool.ply"])
def test_28_types_beyond_the_standard(reported: Path, name: str) -> None:
    assert len(only(reported / name)) == 3


@pytest.mark.parametrize("suffix", ["asc", "xyzrgb"])
def test_29_colors_by_suffix(reported: Path, suffix: str) -> None:
    assert colors(only(reported / f"29_rows.{suffix}")) == [RED, GREEN, BLUE]


def test_29_normals_by_suffix(reported: Path) -> None:
    cloud = only(reported / "29_rows.xyzn")
    assert cloud.colors is None
    assert cloud.normals is not None
    near(cloud.normals, np.broadcast_to([0, 0, 1], (3, 3)))


def test_30_times_of_a_german_spreadsheet(reported: Path) -> None:
    near(times(reported / "30_times_excel"), (0, 0.033, 0.066))


def test_31_structured_arrays(reported: Path) -> None:
    cloud = only(reported / "31_structured.npy")
    near(cloud.world(), [(1, 2, 3), (4, 5, 6)])
    near(cloud.scalars["intensity"], (9, 8))


def test_31_six_columns(reported: Path) -> None:
    cloud = only(reported / "31_xyzrgb_Nx6.npy")
    near(cloud.world(), [(0, 0, 0), (1, 0, 0), (0, 1, 0)])  # whose other columns are colours or normals


def test_32_sparse_points_of_colmap(reported: Path) -> None:
    cloud = only(reported / "32_sparse" / "points3D.txt")
    near(cloud.world(), [(1.5, 0.25, 0.5), (2, 0.125, -0.25), (1.75, 0.5, 0.75)])
    assert colors(cloud) == [[115, 121, 122], [102, 209, 250], [245, 251, 249]]


def test_33_point_maps_are_frames(reported: Path) -> None:
    assert [len(cloud) for cloud in clouds(reported / "33_point_maps.npz")] == [768, 768]


def test_34_a_film_of_time_stamps(reported: Path, command: Callable[..., Done], tmp_path: Path) -> None:
    near(times(reported / "34_stamps"), (0, 0.033, 0.066323, 0.166323), 1e-6)
    near(film_changes(command, reported / "34_stamps", tmp_path / "x.mp4"), (0, 0.033, 0.0663, 0.1663), 1e-3)


def test_35_a_byte_order_mark(reported: Path) -> None:
    assert len(only(reported / "35_bom.ply")) == 3


def test_36_an_empty_frame_is_an_empty_picture(
    reported: Path, command: Callable[..., Done], tmp_path: Path
) -> None:
    near(film_changes(command, reported / "36_empty_between", tmp_path / "x.mp4"), (0, 0.04, 0.08), 1e-3)


def test_37_the_camera_of_the_neighbour_file(reported: Path, info: Callable[..., Any]) -> None:
    facts = info(reported / "37_camera_in_info")
    near((facts["bounds"]["low"][0], facts["bounds"]["high"][0]), (-0.55, 0.55), 0.005)
    camera = decision(facts, "camera")
    assert (camera["source"], camera["from"]) == ("neighbour", "info.txt")


def test_37_a_default_camera_that_does_not_fit(
    reported: Path, command: Callable[..., Done], tmp_path: Path
) -> None:
    """Refused, or assumed for this picture and told."""
    folder = shutil.copytree(reported / "37_camera_in_info", tmp_path / "scan")
    (folder / "info.txt").unlink()
    done = command("info", folder, "--json")
    if done.code:
        assert "camera" in done.err
        return
    camera = decision(json.loads(done.out), "camera")
    assert camera["source"] == "assumed"
    assert 0 < camera["value"]["cx"] < 320
    assert 0 < camera["value"]["cy"] < 180
    assert "camera" in done.err


def test_38_a_larger_picture(reported: Path) -> None:
    cloud = only(reported / "38_larger_picture")
    assert len(cloud) == 57_600
    on_the_left = cloud.world()[:, 0] < -0.02
    on_the_right = cloud.world()[:, 0] > 0.02
    found = np.array(colors(cloud))
    near(found[on_the_left].mean(axis=0), RED, 3)
    near(found[on_the_right].mean(axis=0), BLUE, 3)


# --- siblings that the README names beside a case -------------------------------------------


@pytest.mark.parametrize("channel", ["depth", "Depth", "Y", "R", "Depth.V"])
def test_a_depth_channel_of_any_name(tmp_path: Path, channel: str) -> None:
    OpenEXR = pytest.importorskip("OpenEXR")
    depth = np.full((6, 8), 0.5, np.float32)
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    for far, name in ((65504.0, "half"), (1e10, "float")):
        depth[0] = far
        OpenEXR.File(header, {channel: depth}).write(str(tmp_path / f"{name}.exr"))
        near(depth_of(tmp_path / f"{name}.exr"), 0.5)


@pytest.mark.parametrize(
    "names",
    [
        "Points_0,Points_1,Points_2",
        '"X (mm)","Y (mm)","Z (mm)"',
        "//X Y Z",
        "x_mm y_mm z_mm",
    ],
)
def test_heads_of_other_programs(tmp_path: Path, names: str) -> None:
    rows = "1 2 3\n4 5 6\n7 8 10\n"
    table = tmp_path / "points.txt"
    table.write_text(f"{names}\n{rows.replace(' ', ',') if ',' in names else rows}")
    near(only(table).world(), [(1, 2, 3), (4, 5, 6), (7, 8, 10)])


@pytest.mark.parametrize("name", ["pts3d", "point_map"])
def test_point_maps_of_other_networks(tmp_path: Path, name: str) -> None:
    y, x = np.mgrid[0:24, 0:32] / 10
    np.savez(tmp_path / "maps.npz", **{name: np.stack([x, y, 5 + x * y])[None].transpose(0, 2, 3, 1)})
    assert len(only(tmp_path / "maps.npz")) == 768


def test_six_columns_of_colors(tmp_path: Path) -> None:
    rows = np.array([(0, 0, 0, 200, 100, 50), (1, 0, 0, 10, 20, 30), (0, 1, 0, 0, 0, 255)], np.float32)
    np.save(tmp_path / "cloud.npy", rows)
    assert colors(only(tmp_path / "cloud.npy")) == [[200, 100, 50], [10, 20, 30], BLUE]


def test_structured_arrays_of_an_archive(tmp_path: Path) -> None:
    points = np.array([(1, 2, 3, 9), (4, 5, 6, 8)], [(name, "f4") for name in ("x", "y", "z", "intensity")])
    np.savez(tmp_path / "cloud.npz", points=points)
    near(only(tmp_path / "cloud.npz").world(), [(1, 2, 3), (4, 5, 6)])


def test_the_record_is_corrected_on_the_command_line(reported: Path, info: Callable[..., Any]) -> None:
    facts = info(reported / "06_number_first.txt", "--read", "columns=x,y,z,intensity")
    near(facts["bounds"]["low"], (1, 10.5, 20.5))
    assert decision(facts, "columns")["source"] == "user"


def test_a_camera_as_the_message_asks_for_it(
    reported: Path, tmp_path: Path, info: Callable[..., Any]
) -> None:
    folder = shutil.copytree(reported / "37_camera_in_info", tmp_path / "scan")
    (folder / "info.txt").unlink()
    facts = info(folder, "--read", "camera=290,290,159.5,89.5")
    near((facts["bounds"]["low"][0], facts["bounds"]["high"][0]), (-0.55, 0.55), 0.005)
    assert decision(facts, "camera")["source"] == "user"


def test_an_unusable_correction_is_refused(reported: Path, command: Callable[..., Done]) -> None:
    done = command("info", reported / "06_number_first.txt", "--read", "columms=x,y,z")
    assert done.code == 2
    assert "columns" in done.err
    with pytest.raises(InputError):
        open_scan(reported / "06_number_first.txt", read={"columns": "x,y"})

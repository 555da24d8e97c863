"""OBJ: vertices, vertex colours, and the ways normals are tied to vertices."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from viewer.errors import InputError
from viewer.scan.formats import _obj_lines, read
from viewer.scan.open import open_scan

VERTICES = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "scan.obj"


def test_points_alone_and_beside_everything_else(path: Path) -> None:
    path.write_text("# head\nmtllib a.mtl\no body\nv 0 0 1.5 \nvt 0 1\nv\t1 2 3\nl 1 2\np 1\ns off\n")
    np.testing.assert_array_equal(read(path).world(), [[0, 0, 1.5], [1, 2, 3]])


def test_vertex_colours_and_weights(path: Path) -> None:
    path.write_text("v 0 0 0 1 0.2 0\nv 1 1 1 0 0 1\n")
    np.testing.assert_array_equal(read(path).colors, [[255, 51, 0, 255], [0, 0, 255, 255]])
    path.write_text("v 0 0 0 1.0\nv 1 1 1 1.0\n")
    assert read(path).colors is None


def test_normals_in_the_order_of_the_vertices(path: Path) -> None:
    normals = "vn 0 0 1\nvn 0 1 0\nvn 1 0 0\n"
    for faces in ("", "f 1//1 2//2 3//3\n", "f 1/1/1 2/1/2 3/1/3\n"):
        path.write_text(VERTICES + normals + faces)
        np.testing.assert_array_equal(read(path).normals, [[0, 0, 1], [0, 1, 0], [1, 0, 0]])


def test_faces_tell_which_normal_is_whose(path: Path) -> None:
    path.write_text(VERTICES + "vn 0 0 1\nvn 0 1 0\nvn 1 0 0\nf 1//3 2//1 3//2\n")
    np.testing.assert_array_equal(read(path).normals, [[1, 0, 0], [0, 0, 1], [0, 1, 0]])
    path.write_text(VERTICES + "vn 0 0 1\nf -3//-1 -2//-1 -1//-1\n")
    np.testing.assert_array_equal(read(path).normals, [[0, 0, 1]] * 3)


def test_a_vertex_with_several_normals_gets_their_mean(path: Path) -> None:
    path.write_text(VERTICES + "v 1 1 0\nvn 0 0 1\nvn 0 1 0\nf 1//1 2//1 3//1\nf 2//2 3//1 4//1\n")
    np.testing.assert_allclose(read(path).normals[1], [0, np.sqrt(0.5), np.sqrt(0.5)], rtol=1e-6)


@pytest.mark.parametrize("faces", ["", "f 1//1 2//1 99//1\n", "f 1/1 2/1 3/1\n"])
def test_normals_that_do_not_cover_the_vertices_are_left_out(faces: str, path: Path) -> None:
    path.write_text(VERTICES + "vn 0 0 1\n" + faces)
    assert read(path).normals is None


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("# nothing here\n", "holds no points"),
        ("v 1 2\n", "a vertex has 2 numbers"),
        ("v 1 2 3\nv 1 2\n", "a vertex has 2 numbers"),
        ("v 1 2 three\n", "row 1, column 3: 'three' is not a number"),
    ],
)
def test_files_that_cannot_be_used(text: str, reason: str, path: Path) -> None:
    path.write_text(text)
    with pytest.raises(InputError, match=reason):
        read(path)


def test_lines_without_numbers_are_passed_over_without_a_warning(tmp_path: Path) -> None:
    path = tmp_path / "scan.obj"
    path.write_text("v 1 2 3\nv 2 3 4\nvn #\nv # nothing\nvn // nothing\n")
    with warnings.catch_warnings(action="error"):
        cloud = read(path)
    assert len(cloud) == 2
    assert cloud.normals is None


def test_corners_in_several_parts_tell_the_same_normals(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "scan.obj"
    faces = "f 1//2 2//1 3//2\nf -1//1 2//2 1//-1\n" * 20
    path.write_text("v 1 2 3\nv 2 3 4\nv 5 5 5\nvn 0 0 1\nvn 1 0 0\n" + faces)
    whole = read(path).normals
    monkeypatch.setattr(_obj_lines, "_FACES_AT_ONCE", 7)
    np.testing.assert_array_equal(read(path).normals, whole)


def test_some_vertices_have_colours_and_others_none(path: Path) -> None:
    """Those without are white; numbers may have a weight before them, and lines may be indented."""
    path.write_text("v 0 0 0 1 0 0\n  v 1 0 0\nv 0 1 0 1.0 0 0 1\n\tv 1 1 0 1.0\n")
    cloud = read(path)
    np.testing.assert_array_equal(cloud.world(), [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
    np.testing.assert_array_equal(
        cloud.colors[:, :3], [[255, 0, 0], [255, 255, 255], [0, 0, 255], [255, 255, 255]]
    )


def test_colours_up_to_255_and_a_byte_order_mark(path: Path) -> None:
    path.write_bytes(b"\xef\xbb\xbfv 0 0 0 200 100 50\nv 1 1 1 10 20 30\n")
    np.testing.assert_array_equal(read(path).colors[:, :3], [[200, 100, 50], [10, 20, 30]])


SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
CORNERS_OF_PICTURE = "vt 0.125 0.125\nvt 0.875 0.125\nvt 0.875 0.875\nvt 0.125 0.875\n"
RED, GREEN, BLUE, GREY = [255, 0, 0], [0, 255, 0], [0, 0, 255], [128, 128, 128]


def save_picture(path: Path, *quarters: list[int]) -> None:
    """A picture of 8 x 8 pixels: upper left, upper right, lower left, lower right."""
    picture = np.repeat(np.repeat(np.array(quarters, np.uint8).reshape(2, 2, 3), 4, axis=0), 4, axis=1)
    Image.fromarray(picture).save(path)


def test_a_texture_gives_the_vertices_their_colours(path: Path) -> None:
    """v points up. The name of the picture has a blank, options before it, and other capitals."""
    save_picture(path.with_name("The Skin.png"), RED, GREEN, BLUE, GREY)
    path.with_name("a.mtl").write_text(
        "newmtl skin\nKd 1 1 1\nmap_Kd -s 1 1 1 -bm 0.5 textures\\The skin.PNG\n"
    )
    path.write_text(f"mtllib a.mtl\n{SQUARE}{CORNERS_OF_PICTURE}usemtl skin\nf 1/1 2/2 3/3 4/4\n")
    with open_scan(path) as timeline:
        cloud = timeline.pose(0).cloud
        decision = timeline.reading["texture"]
    np.testing.assert_array_equal(cloud.colors[:, :3], [BLUE, GREY, GREEN, RED])
    assert (decision.value, decision.source, decision.where) == ("vertices", "neighbour", "The Skin.png")


def test_several_materials_negative_numbers_and_groups(path: Path) -> None:
    """A material without a picture gives its colour, and a vertex of two materials the mean."""
    save_picture(path.with_name("a.png"), RED, RED, RED, RED)
    path.with_name("a.mtl").write_text("newmtl skin\nmap_Kd a.png\n\nnewmtl plain\nKd 0 0 1\n")
    path.write_text(
        f"mtllib a.mtl\ng one\n{SQUARE}{CORNERS_OF_PICTURE}usemtl skin\nf -4/-4 -3/-3 -2/-2\n"
        "g two\nusemtl plain\nf 1 3 4\nv 5 5 5\n"
    )
    np.testing.assert_array_equal(
        read(path).colors[:, :3], [[128, 0, 128], RED, [128, 0, 128], BLUE, [255, 255, 255]]
    )


def test_a_missing_texture_is_reported(path: Path) -> None:
    path.with_name("a.mtl").write_text("newmtl skin\nmap_Kd C:\\scans\\gone.jpg\n")
    path.write_text(f"mtllib a.mtl\n{SQUARE}{CORNERS_OF_PICTURE}usemtl skin\nf 1/1 2/2 3/3\n")
    with open_scan(path) as timeline:
        assert timeline.pose(0).cloud.colors is None
        assert timeline.reading["texture"].value == "none"
        assert [m.text for m in timeline.messages if "gone.jpg" in m.text]


def test_colours_of_vertices_win_over_a_texture_unless_the_user_says_otherwise(path: Path) -> None:
    save_picture(path.with_name("a.png"), RED, RED, RED, RED)
    path.with_name("a.mtl").write_text("newmtl skin\nmap_Kd a.png\n")
    own = "v 0 0 0 0 1 0\nv 1 0 0 0 1 0\nv 1 1 0 0 0.5 0\n"
    path.write_text(f"mtllib a.mtl\n{own}{CORNERS_OF_PICTURE}usemtl skin\nf 1/1 2/2 3/3\n")
    for read_as, color in ((None, GREEN), ({"texture": "vertices"}, RED)):
        with open_scan(path, read=read_as) as timeline:
            assert timeline.pose(0).cloud.colors[0, :3].tolist() == color
    with open_scan(path, read={"texture": "none"}) as timeline:
        assert timeline.pose(0).cloud.colors[0, :3].tolist() == GREEN
        assert timeline.reading["texture"].source == "user"


def test_opacity_behind_the_colours_is_no_weight_before_them(path: Path) -> None:
    path.write_text("v 1 2 3 1 0 0 1\nv 4 5 6 0 1 0 1\n")
    assert read(path).colors[:, :3].tolist() == [[255, 0, 0], [0, 255, 0]]
    path.write_text("v 1 2 3 1 1 0 0\nv 4 5 6 1 0 1 0\n")
    assert read(path).colors[:, :3].tolist() == [[255, 0, 0], [0, 255, 0]]


def test_other_numbers_of_vertices_are_in_the_record(path: Path) -> None:
    path.write_text("v 1 2 3 4 5\nv 4 5 6 7 8\n")
    with open_scan(path) as timeline:
        assert timeline.pose(0).cloud.colors is None
        assert timeline.reading.unused == ("numbers 4 to 5 of each vertex",)


def test_the_decimal_mark_is_in_the_record(path: Path) -> None:
    for text, mark in (("v 1,5 2,5 3\nv 4 5 6\n", ","), ("v 1.5 2.5 3\nv 4 5 6\n", ".")):
        path.write_text(text)
        with open_scan(path) as timeline:
            np.testing.assert_allclose(timeline.pose(0).cloud.world(), [[1.5, 2.5, 3], [4, 5, 6]])
            assert (timeline.reading["decimal"].value, timeline.reading["decimal"].source) == (mark, "file")
    path.write_text("v 1,500 2,500 3,250\nv 4,000 5,000 6,000\n")
    with open_scan(path) as timeline:
        timeline.pose(0)
        assert timeline.reading["decimal"].is_marked
    with open_scan(path, read={"decimal": ","}) as timeline:
        np.testing.assert_allclose(timeline.pose(0).cloud.world()[0], [1.5, 2.5, 3.25])
        assert timeline.reading["decimal"].source == "user"


def test_a_text_in_utf_16(path: Path) -> None:
    path.write_bytes("v 1 2 3\nv 4 5 6\n".encode("utf-16"))
    assert len(read(path)) == 2

"""OBJ: vertices, vertex colours, and the ways normals are tied to vertices."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest

from viewer.errors import InputError
from viewer.scan.formats import obj, read

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
        ("v 1 2\n", "positions have shape"),
        ("v 1 2 3\nv 1 2 3 4 5 6\n", "row 2 has 6 values, but the rows above have 3"),
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
    monkeypatch.setattr(obj, "_CORNERS_AT_ONCE", 7)
    np.testing.assert_array_equal(read(path).normals, whole)

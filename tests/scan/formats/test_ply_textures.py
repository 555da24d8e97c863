"""Textures of PLY files, as MeshLab and photogrammetry write them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from plyfile import PlyData, PlyElement
from square import BLUE, GREEN, GREY, RED, save_picture

from viewer.scan.formats import read_faces
from viewer.scan.open import open_scan

POINTS = [(0, 0), (1, 0), (1, 1), (0, 1), (5, 5)]
UV = [(0.1, 0.1), (0.9, 0.1), (0.9, 0.9), (0.1, 0.9), (0.1, 0.9)]
FACES = [(0, 1, 2), (0, 2, 3)]
AT_CORNERS = [BLUE, GREY, GREEN, RED]
ENCODINGS = [("ascii", "="), ("little", "<"), ("big", ">")]


def save(
    path: Path,
    encoding: tuple[str, str],
    comments: list[str],
    names: tuple[str, str] | None = None,
    faces: list[tuple] | None = None,
    fields: list[tuple] = (),  # type: ignore[assignment]
    colors: list[tuple[int, int, int]] | None = None,
) -> Path:
    """A square as a PLY. names: of positions of vertices. faces: rows of `fields` behind their corners."""
    columns = [("x", "f4"), ("y", "f4"), ("z", "f4")]
    rows = [(x, y, 0.0) for x, y in POINTS]
    if names:
        columns += [(names[0], "f4"), (names[1], "f4")]
        rows = [(*row, *uv) for row, uv in zip(rows, UV, strict=True)]
    if colors:
        columns += [("red", "u1"), ("green", "u1"), ("blue", "u1"), ("alpha", "u1")]
        rows = [(*row, *color, 255) for row, color in zip(rows, colors, strict=True)]
    elements = [PlyElement.describe(np.array(rows, columns), "vertex")]
    if faces is not None:
        made = np.empty(len(faces), [("vertex_indices", "O"), *fields])
        for row, face in enumerate(faces):
            made[row] = face
        types = {"vertex_indices": "i4"} | {name: "f4" for name, kind in fields if kind == "O"}
        elements.append(PlyElement.describe(made, "face", val_types=types))
    name, order = encoding
    PlyData(elements, text=name == "ascii", byte_order=order, comments=comments).write(str(path))
    return path


def corners(*ids: int) -> np.ndarray:
    return np.array(ids, np.int32)


def places(*ids: int, shift: float = 0) -> np.ndarray:
    return np.array([UV[id] for id in ids], np.float32).ravel() + np.float32(shift)


@pytest.mark.parametrize("encoding", ENCODINGS)
@pytest.mark.parametrize("names", [("u", "v"), ("s", "t"), ("texture_u", "texture_v"), ("S", "T")])
@pytest.mark.parametrize("has_faces", [True, False])
def test_positions_at_vertices(
    encoding: tuple[str, str], names: tuple[str, str], has_faces: bool, tmp_path: Path
) -> None:
    """Without faces, vertices have their colours all the same. v points up."""
    save_picture(tmp_path / "skin 1.png")
    faces = [(corners(*face),) for face in FACES] if has_faces else None
    path = save(tmp_path / "a.ply", encoding, ["TextureFile skin 1.png"], names, faces)
    with open_scan(path) as timeline:
        cloud, decision = timeline.pose(0).cloud, timeline.reading["texture"]
    assert cloud.colors[:4, :3].tolist() == AT_CORNERS
    assert not cloud.scalars
    if has_faces:
        assert len(cloud) > 1000
        assert decision.why.startswith("The file contains 5 points. Scan4D adds")
        assert cloud.topology is not None
    else:
        assert len(cloud) == 5
        assert cloud.topology is None


@pytest.mark.parametrize("encoding", ENCODINGS)
@pytest.mark.parametrize("name", ["texcoord", "texcoords"])
def test_positions_at_faces_and_several_pictures(
    encoding: tuple[str, str], name: str, tmp_path: Path
) -> None:
    """A face without positions has no colours of its own, and polygons are of any size."""
    save_picture(tmp_path / "a.png")
    save_picture(tmp_path / "b.png", quarters=(GREY, GREY, GREY, GREY))
    faces = [
        (corners(0, 1, 2), places(0, 1, 2, shift=2), 0),
        (corners(4, 2, 3), places(4, 2, 3), 1),
        (corners(4, 4), places(), 0),
    ]
    fields = [(name, "O"), ("texnumber", "u1")]  # plyfile writes larger ones in the order of this machine
    comments = ["made by a program", "TextureFile a.png", "TextureFile B.PNG"]
    path = save(tmp_path / "a.ply", encoding, comments, None, faces, fields)
    with open_scan(path, read={"texture": "vertices"}) as timeline:
        found = timeline.pose(0).cloud.colors[:, :3].tolist()
    mixed = np.rint((np.array(GREEN) + GREY) / 2).astype(int).tolist()
    assert found == [BLUE, GREY, mixed, GREY, GREY]
    assert [*read_faces(path).sizes] == [3, 3, 2]
    with open_scan(path) as timeline:
        assert len(timeline.pose(0).cloud) > 1000


def test_one_colour_of_all_vertices_does_not_hide_the_texture(tmp_path: Path) -> None:
    """MeshLab writes white vertices beside a texture; vertices of several colours count."""
    save_picture(tmp_path / "a.png")
    faces = [(corners(*face),) for face in FACES]
    for colors, value in (([(255, 255, 255)] * 5, "dense"), ([(1, 2, 3)] * 4 + [(9, 9, 9)], "none")):
        path = save(tmp_path / "a.ply", ENCODINGS[1], ["TextureFile a.png"], ("s", "t"), faces, colors=colors)
        with open_scan(path) as timeline:
            cloud = timeline.pose(0).cloud
            assert timeline.reading["texture"].value == value
        assert cloud.colors[0, :3].tolist() == (BLUE if value == "dense" else [1, 2, 3])


def test_frames_with_the_same_faces_share_them(tmp_path: Path) -> None:
    faces = [(corners(*face), places(*face)) for face in FACES]
    for frame in range(3):
        save_picture(tmp_path / f"f{frame}.png")
        comments = [f"TextureFile f{frame}.png"]
        save(tmp_path / f"f{frame}.ply", ENCODINGS[1], comments, None, faces, [("texcoord", "O")])
    with open_scan(tmp_path) as timeline:
        clouds = [timeline.pose(frame).cloud for frame in range(3)]
    assert len({cloud.topology for cloud in clouds}) == 1
    assert all(len(cloud) > 1000 for cloud in clouds)


def test_damaged_faces_cost_no_point(tmp_path: Path) -> None:
    save_picture(tmp_path / "a.png")
    faces = [(corners(*face), places(*face)) for face in FACES]
    path = save(tmp_path / "a.ply", ENCODINGS[1], ["TextureFile a.png"], None, faces, [("texcoord", "O")])
    path.write_bytes(path.read_bytes()[:-9])
    with open_scan(path) as timeline:
        assert len(timeline.pose(0).cloud) == 5
        assert timeline.pose(0).cloud.colors is None


def test_a_damaged_name_of_a_picture_costs_no_point(tmp_path: Path) -> None:
    path = save(tmp_path / "a.ply", ENCODINGS[1], ["TextureFile ab.png"], ("s", "t"))
    path.write_bytes(path.read_bytes().replace(b"ab.png", b"a\0.png"))
    with open_scan(path) as timeline:
        assert len(timeline.pose(0).cloud) == 5
        assert any("a.png" in message.text for message in timeline.messages)

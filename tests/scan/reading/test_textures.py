"""Textures: the colours of vertices, and points that Scan4D adds between them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from square import BLUE, GREEN, GREY, QUARTERS, RED, save_picture

from viewer.scan.formats import read_faces
from viewer.scan.formats._pictures import texture_colors
from viewer.scan.open import open_scan
from viewer.scan.reading import textures


def save_square(path: Path, picture: str, height: float = 0.0, normals: bool = False) -> None:
    """A square of two triangles over the whole picture, at a height, with a vertex that no face has."""
    path.with_suffix(".mtl").write_text(f"newmtl skin\nKd 1 1 1\nmap_Kd {picture}\n")
    vertices = "".join(f"v {x} {y} {height}\n" for x, y in [(0, 0), (1, 0), (1, 1), (0, 1), (5, 5)])
    stated = "vn 0 0 1\n" * 5 if normals else ""
    corner = "{0}/{0}/{0}" if normals else "{0}/{0}"
    faces = "".join(f"f {' '.join(corner.format(id) for id in ids)}\n" for ids in [(1, 2, 3), (1, 3, 4)])
    places = "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvt 0 0\n"
    path.write_text(f"mtllib {path.stem}.mtl\n{vertices}{stated}{places}usemtl skin\n{faces}")


def quarter(points: np.ndarray) -> np.ndarray:
    """The colours that the square has at (N, 2)."""
    colors = np.array([[BLUE, GREY], [RED, GREEN]])
    return colors[(points[:, 1] > 0.5).astype(int), (points[:, 0] > 0.5).astype(int)]


def test_where_the_texture_is_much_finer_scan4d_adds_points_between_the_vertices(tmp_path: Path) -> None:
    """The vertices keep their ids, the others follow. The record says how many there are of both."""
    save_picture(tmp_path / "a.png")
    save_square(tmp_path / "a.obj", "a.png", normals=True)
    with open_scan(tmp_path / "a.obj") as timeline:
        cloud, decision = timeline.pose(0).cloud, timeline.reading["texture"]
    with open_scan(tmp_path / "a.obj", read={"texture": "vertices"}) as timeline:
        plain = timeline.pose(0).cloud
    assert len(plain) == 5
    assert len(cloud) == 5 + 2 * 45**2
    np.testing.assert_array_equal(cloud.world()[:5], plain.world())
    np.testing.assert_array_equal(cloud.colors[:5], plain.colors)
    added = cloud.world()[5:]
    assert not added[:, 2].any()
    is_inside = (np.abs(added[:, :2] - 0.5) > 1 / 64).all(axis=1)
    assert is_inside.mean() > 0.9
    np.testing.assert_array_equal(cloud.colors[5:, :3][is_inside], quarter(added[is_inside]))
    np.testing.assert_allclose(cloud.normals, [[0, 0, 1]] * len(cloud))
    assert (decision.value, decision.source) == ("dense", "assumed")
    assert decision.why.startswith("The file contains 5 points. Scan4D adds 4,050 points between them")
    assert decision.alternatives == ("vertices", "none")


@pytest.mark.parametrize(("stated", "most"), [("dense", 4050), ("dense:300", 300)])
def test_the_user_states_how_many_points_are_added(stated: str, most: int, tmp_path: Path) -> None:
    save_picture(tmp_path / "a.png")
    save_square(tmp_path / "a.obj", "a.png")
    with open_scan(tmp_path / "a.obj", read={"texture": stated}) as timeline:
        added = len(timeline.pose(0).cloud) - 5
        decision = timeline.reading["texture"]
    assert 0.8 * most <= added <= most
    assert (decision.value, decision.source) == ("dense", "user")
    assert f"adds {added:,} points between" in decision.why


def test_frames_with_the_same_faces_get_the_same_points_under_the_same_ids(tmp_path: Path) -> None:
    """So that a point can be followed, also in a frame with another picture."""
    for frame in range(3):
        quarters = QUARTERS[frame:] + QUARTERS[:frame]
        save_picture(tmp_path / f"f{frame}.png", quarters=quarters)
        save_square(tmp_path / f"f{frame}.obj", f"f{frame}.png", height=frame)
    with open_scan(tmp_path) as timeline:
        clouds = [timeline.pose(index).cloud for index in (2, 0, 1)]
    assert len({cloud.topology for cloud in clouds}) == 1
    for cloud, height in zip(clouds, (2, 0, 1), strict=True):
        np.testing.assert_allclose(cloud.world()[:, :2], clouds[0].world()[:, :2])
        np.testing.assert_allclose(cloud.world()[:, 2], height)
    assert clouds[0].colors[:4, :3].tolist() != clouds[1].colors[:4, :3].tolist()
    with open_scan(tmp_path, read={"texture": "vertices"}) as timeline:
        assert timeline.pose(0).cloud.topology != clouds[0].topology
    assert read_faces(tmp_path / "f0.obj").corners.max() < 5


def test_a_sequence_gets_fewer_points_so_that_it_plays(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(textures, "MOST_OF_SEQUENCE", 100)
    monkeypatch.setattr(textures, "MOST_POINTS", 1000)
    for frame in range(2):
        save_picture(tmp_path / f"f{frame}.png")
        save_square(tmp_path / f"f{frame}.obj", f"f{frame}.png")
    for scan, read_as, most in (
        (tmp_path, {}, 100),
        (tmp_path, {"texture": "dense"}, 1000),
        (tmp_path / "f0.obj", {}, 1000),
    ):
        with open_scan(scan, read=read_as) as timeline:
            assert 0.7 * most < len(timeline.pose(0).cloud) - 5 <= most


def test_many_vertices_need_no_more_points(tmp_path: Path) -> None:
    """A picture of 4 x 4 pixels has too few texels for each of 5 vertices."""
    save_picture(tmp_path / "a.png", 4)
    save_square(tmp_path / "a.obj", "a.png")
    with open_scan(tmp_path / "a.obj") as timeline:
        assert len(timeline.pose(0).cloud) == 5
        assert timeline.reading["texture"].value == "vertices"


@pytest.mark.parametrize("first", [0, 1])
def test_a_frame_without_its_picture_has_the_same_points(first: int, tmp_path: Path) -> None:
    """It has the colour of its material. The record names each such frame; messages do not grow with them."""
    for frame in range(5):
        save_picture(tmp_path / f"f{frame}.png", side=64 if frame else 80)
        save_square(tmp_path / f"f{frame}.obj", f"f{frame}.png", height=frame)
    for frame in (1, 3, 4):
        (tmp_path / f"f{frame}.png").unlink()
    with open_scan(tmp_path) as timeline:
        clouds = {index: timeline.pose(index).cloud for index in (first, 2, 0, 1, 3, 4)}
        told = [message.text for message in timeline.messages]
        contradictions = sorted(one.frame for one in timeline.reading.contradictions)
        assert timeline.reading["texture"].value == "dense"
    assert len({clouds[frame].topology for frame in (0, 2, 3, 4)}) == 1
    assert set(clouds[3].colors.ravel().tolist()) == {255}
    assert contradictions == [1, 3, 4]
    assert len([text for text in told if "f1.png" in text]) == 1
    assert len(told) <= 3
    assert all("material" in text or "f1.png" in text for text in told)


def test_materials_of_several_colours_stand_in_for_their_pictures(tmp_path: Path) -> None:
    save_square(tmp_path / "a.obj", "gone.png")
    (tmp_path / "a.mtl").write_text(
        "newmtl skin\nKd 1 0 0\nmap_Kd gone.png\nnewmtl hair\nKd 0 0 1\nmap_Kd b.png\n"
    )
    text = (tmp_path / "a.obj").read_text()
    (tmp_path / "a.obj").write_text(text.replace("f 1/1 3", "usemtl hair\nf 1/1 3"))
    with open_scan(tmp_path / "a.obj") as timeline:
        colors = timeline.pose(0).cloud.colors[:, :3]
        decision = timeline.reading["texture"]
    np.testing.assert_array_equal(colors[[1, 3, 4]], [RED, BLUE, [255] * 3])
    assert decision.source == "assumed"
    assert "colours of the materials" in decision.why


@pytest.mark.parametrize(
    ("mode", "wanted"),
    [
        ("L", [76, 76, 76]),
        ("P", RED),
        ("RGBA", RED),
        ("LA", [76, 76, 76]),
        ("1", [0, 0, 0]),
        ("I;16", [76, 76, 76]),
    ],
)
def test_kinds_of_pictures(mode: str, wanted: list[int], tmp_path: Path) -> None:
    picture = Image.new("RGB", (8, 8), tuple(RED))
    if mode == "I;16":
        picture = Image.fromarray(np.full((8, 8), 76 * 257, np.uint16))
    elif mode == "1":
        picture = picture.convert("1", dither=Image.Dither.NONE)
    else:
        picture = picture.convert(mode)
    picture.save(tmp_path / "a.png")
    save_square(tmp_path / "a.obj", "a.png")
    with open_scan(tmp_path / "a.obj", read={"texture": "vertices"}) as timeline:
        np.testing.assert_array_equal(timeline.pose(0).cloud.colors[:4, :3], [wanted] * 4)


@pytest.mark.parametrize("name", ["a.jpg", "a.png", "a.tif", "a.bmp", "a.tga"])
def test_pictures_are_reduced_where_points_need_less(name: str, tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    rows = rng.integers(0, 255, (6, 8, 3), dtype=np.uint8).repeat(32, axis=0).repeat(32, axis=1)
    Image.fromarray(rows).save(tmp_path / name, **({"quality": 95} if name == "a.jpg" else {}))
    whole, part = texture_colors(tmp_path / name), texture_colors(tmp_path / name, 4)
    assert (whole.shape, part.shape) == ((192, 256, 3), (48, 64, 3))
    means = whole.reshape(48, 4, 64, 4, 3).mean(axis=(1, 3))
    assert np.abs(part - means).mean() < 2


def test_a_damaged_picture_adds_no_points(tmp_path: Path) -> None:
    """Its header is whole, so that Scan4D finds out late."""
    save_picture(tmp_path / "a.png", 256)
    (tmp_path / "a.png").write_bytes((tmp_path / "a.png").read_bytes()[:300])
    save_square(tmp_path / "a.obj", "a.png")
    with open_scan(tmp_path / "a.obj") as timeline:
        assert len(timeline.pose(0).cloud) == 5
        assert timeline.pose(0).cloud.colors is None
        assert timeline.reading["texture"].value == "none"
        assert len([message for message in timeline.messages if "a.png" in message.text]) == 1


MATERIALS = {
    "3dMD": "newmtl skin\r\n\tKa 0.2 0.2 0.2\r\n\tKd 0.8 0.8 0.8\r\n\tmap_Kd .\\The Skin.png\r\n",
    "Vectra": "newmtl skin\nKd 0.000 0.000 0.000\nmap_Kd   the skin.PNG  \n",
    "Blender": "# Blender\nnewmtl skin\nmap_Kd -s 1.0 1.0 1.0 -bm 0.5 /elsewhere/The Skin.png\n",
    "quotes": 'newmtl skin\nmap_Kd "The Skin.png"\n',
    "another material first": "newmtl a\nKd 1 0 0\nmap_Kd no.png\nnewmtl SKIN\nmap_Kd C:\\x\\The Skin.png\n",
    "offset": "newmtl skin\nmap_Kd -o 3 -2 0 -clamp off The Skin.png\n",
}


@pytest.mark.parametrize("materials", MATERIALS.values(), ids=MATERIALS)
def test_materials_as_programs_write_them(materials: str, tmp_path: Path) -> None:
    save_picture(tmp_path / "The Skin.png")
    save_square(tmp_path / "a b.obj", "")
    (tmp_path / "a b.mtl").write_text(materials, newline="")
    with open_scan(tmp_path / "a b.obj", read={"texture": "dense"}) as timeline:
        cloud = timeline.pose(0).cloud
    added = cloud.world()[5:, :2]
    is_inside = (np.abs(added - 0.5) > 1 / 64).all(axis=1)
    np.testing.assert_array_equal(cloud.colors[5:, :3][is_inside], quarter(added[is_inside]))


def test_scale_turns_the_picture(tmp_path: Path) -> None:
    save_picture(tmp_path / "a.png")
    save_square(tmp_path / "a.obj", "-s 1 -1 1 a.png")
    with open_scan(tmp_path / "a.obj", read={"texture": "dense"}) as timeline:
        cloud = timeline.pose(0).cloud
    added = cloud.world()[5:, :2]
    is_inside = (np.abs(added - 0.5) > 1 / 64).all(axis=1)
    turned = added[is_inside] * (1, -1) + (0, 1)
    np.testing.assert_array_equal(cloud.colors[5:, :3][is_inside], quarter(turned))


@pytest.mark.parametrize("named", [True, False])
def test_a_picture_with_the_name_of_the_file_is_assumed(named: bool, tmp_path: Path) -> None:
    """Where the file of materials is missing, or none is named."""
    save_picture(tmp_path / "a.png", 4)
    save_square(tmp_path / "a.obj", "a.png")
    (tmp_path / "a.mtl").unlink()
    if not named:
        text = (tmp_path / "a.obj").read_text()
        (tmp_path / "a.obj").write_text(text.replace("mtllib a.mtl\n", ""))
    with open_scan(tmp_path / "a.obj") as timeline:
        assert timeline.pose(0).cloud.colors is not None
        decision = timeline.reading["texture"]
        assert any("material file" in message.text for message in timeline.messages) == named
    assert (decision.value, decision.source, decision.where) == ("vertices", "assumed", "a.png")
    assert decision.alternatives == ("dense", "none")

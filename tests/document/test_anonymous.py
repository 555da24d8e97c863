"""Anonymous pictures: no byte of what they leave tells whose the scan is, where and when."""

from __future__ import annotations

import json
import struct
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import pytest
from command_line import Run
from PIL import Image
from range_scenes import sphere_view
from scenes import sphere

from viewer.backends import backend
from viewer.camera import Camera
from viewer.document.anonymous import anonymous_pose, anonymous_request, anonymous_unit, middle_of
from viewer.document.recording import Entry, Recording, fingerprint, fingerprint_as
from viewer.drawing.request import Request
from viewer.look import Look
from viewer.output.export import read_description
from viewer.scan import formats
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose

SIZE = (64, 48)
SMALL = ("--size", "64x48")
PLACE = np.array([691_234.0, 5_334_567.0, 512.0])  # UTM
START = 1_669_087_123.0  # seconds: a date
FAR = 10_000.0  # nothing that a small scan has, or a picture
PRIVATE = ("jane_doe", "born1961", "fever", "of_jane", "jane_files")
FILE = "jane_doe_born1961.npz"


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working directory: a sequence that tells more than it should."""
    folder = tmp_path / "jane_files"
    folder.mkdir()
    monkeypatch.chdir(folder)
    cloud = sphere(2000)
    np.savez(
        FILE, positions=np.stack([cloud.positions.astype(float) + PLACE] * 2), normals=cloud.normals,
        times=[START, START + 0.5], fever_of_jane=np.linspace(36, 41, len(cloud)),
    )  # fmt: skip
    return folder


def strings(values: Any) -> Iterator[str]:
    """All text in a JSON value."""
    if isinstance(values, dict):
        for name, value in values.items():
            yield name
            yield from strings(value)
    elif isinstance(values, list):
        for value in values:
            yield from strings(value)
    elif isinstance(values, str):
        yield values


def numbers(values: Any) -> Iterator[float]:
    """All numbers in a JSON value."""
    if isinstance(values, dict | list):
        for value in values.values() if isinstance(values, dict) else values:
            yield from numbers(value)
    elif isinstance(values, int | float) and not isinstance(values, bool):
        yield values


def assert_tells_nothing(path: Path, folder: Path) -> None:
    """No name, place or date in any byte of a file: as text, or as numbers of any width."""
    data = path.read_bytes()
    lower = data.lower()
    for word in (*PRIVATE, str(folder), fingerprint([folder / FILE]) or "-"):
        for encoding in ("utf-8", "utf-16-le", "utf-16-be"):
            assert word.lower().encode(encoding) not in lower, (path.name, word)
    for number in (*PLACE, START, START + 0.5):
        for kind in ("<f", ">f", "<d", ">d"):
            if abs(number) > FAR:
                assert struct.pack(kind, number) not in data, (path.name, number)
        assert f"{number:.0f}".encode() not in data or abs(number) < FAR


def assert_near_zero(arrays: dict[str, np.ndarray]) -> None:
    for name, array in arrays.items():
        if name != "id":  # 0xFFFFFFFF where nothing is
            assert np.abs(array[np.isfinite(array)].astype(float)).max(initial=0) < FAR, name


LOOKS = ["auto", "height", "fever_of_jane"]


@pytest.mark.parametrize("color_by", LOOKS)
@pytest.mark.parametrize("suffix", [".png", ".exr", ".npz", ".mp4"])
def test_no_byte_of_an_output_tells(suffix: str, color_by: str, run: Run, folder: Path) -> None:
    marks = ("--marks", "scale_bar", "color_bar", "stamp") if suffix in (".png", ".mp4") else ()
    done = run("render", folder / FILE, *SMALL, "--anonymous", "--look", f"color_by={color_by}", *marks,
               "--unit", "of_jane", "--pose", 1, "--stats", "stats.json", "-o", f"a{suffix}")  # fmt: skip
    assert done.code == 0, done.err
    assert_tells_nothing(Path(f"a{suffix}"), folder)
    assert_tells_nothing(Path("stats.json"), folder)
    if suffix == ".npz":
        assert_near_zero(dict(np.load("a.npz")))
    if suffix == ".exr":
        with OpenEXR.File("a.exr", separate_channels=True) as file:
            assert_near_zero({name: channel.pixels for name, channel in file.channels().items()})
    if suffix in (".png", ".exr"):
        told = json.loads(read_description(Path(f"a{suffix}")))
        assert max(map(abs, numbers(told))) < FAR
        assert told["anonymous"] is True
        assert (told["scan"], told["unit"], told["time"]) == (None, "units", 0.5)
        assert not any(word.lower() in text.lower() for word in PRIVATE for text in strings(told))


def test_a_named_picture_would_tell(run: Run, folder: Path) -> None:
    """What the tests above look for is there where nobody asks for an anonymous picture."""
    look = ("--look", "color_by=fever_of_jane")
    assert run("render", folder / FILE, *SMALL, *look, "--pose", 1, "-o", "a.png").code == 0
    told = json.loads(read_description(Path("a.png")))
    assert told["scan"].endswith(FILE)
    assert told["look"]["color_by"] == "fever_of_jane"
    assert told["time"] == START + 0.5
    assert max(map(abs, numbers(told["camera"]))) > FAR
    with pytest.raises(AssertionError):
        assert_tells_nothing(Path("a.png"), folder)


@pytest.mark.parametrize("color_by", LOOKS)
def test_it_is_the_same_picture(color_by: str, run: Run) -> None:
    look = ("--look", f"color_by={color_by}")
    assert run("render", FILE, *SMALL, *look, "-o", "named.png").code == 0
    assert run("render", FILE, *SMALL, *look, "--anonymous", "-o", "a.png").code == 0
    named, anonymous = (np.asarray(Image.open(name)).astype(int) for name in ("named.png", "a.png"))
    assert np.array_equal(named, anonymous)


@pytest.mark.parametrize("color_by", LOOKS)
def test_it_is_drawn_again_where_its_scan_is_named_and_stays_anonymous(
    color_by: str, run: Run, folder: Path, refused: Callable[..., str]
) -> None:
    look = ("--look", f"color_by={color_by}")
    assert run("render", FILE, *SMALL, *look, "--anonymous", "--pose", 1, "-o", "a.png").code == 0
    assert "render SCAN --replay a.png" in refused("render", "--replay", "a.png", "-o", "b.png")
    Path(FILE).rename("moved.npz")  # the name does not count
    assert run("render", "moved.npz", "--replay", "a.png", "-o", "b.png").code == 0
    assert Path("a.png").read_bytes() == Path("b.png").read_bytes()
    cloud = sphere(1999)
    np.savez("other.npz", positions=cloud.positions)
    assert "is not the scan that a.png shows" in refused(
        "render", "other.npz", "--replay", "a.png", "-o", "c.png"
    )


def test_a_recording_replays_anonymously(run: Run, folder: Path) -> None:
    camera = Camera(eye=tuple(PLACE + np.array([0, 0, 5])), target=tuple(PLACE))
    with_range = Look(color_by="height", low=float(PLACE[1]) - 1, high=float(PLACE[1]) + 1)
    pose = Pose(1, START + 0.5, "", formats.read_points(Path(FILE), 1))
    request = Request(pose, camera, "points", backend("points").params(), with_range)
    Recording((Entry.of(request, FILE, fingerprint([Path(FILE)]), SIZE, "jane"),)).save(Path("r.json"))
    assert run("render", "--replay", "r.json", "-o", "named.png").code == 0
    assert run("render", "--replay", "r.json", "--anonymous", "-o", "a.png").code == 0
    assert_tells_nothing(Path("a.png"), folder)
    told = json.loads(read_description(Path("a.png")))
    assert max(map(abs, numbers(told))) < FAR
    assert np.array_equal(np.asarray(Image.open("named.png")), np.asarray(Image.open("a.png")))


def test_range_views_stand_at_the_origin_without_their_names() -> None:
    view = sphere_view((0, 0, 4), size=(32, 24), name="pod of jane")
    to_camera = view.world_to_camera.copy()
    to_camera[:3, 3] -= to_camera[:3, :3] @ PLACE
    object.__setattr__(view, "world_to_camera", to_camera)
    pose = Pose.of(0, START, "jane.exr", (view,))
    request = Request(pose, Camera(eye=tuple(PLACE + np.array([0, 0, 5])), target=tuple(PLACE)), "points")
    made = anonymous_request(request, START).pose
    assert (made.views[0].name, made.label, made.time) == ("pod 0", "frame 1", 0.0)
    assert np.abs(made.cloud.bounds().center).max() < 0.1
    moved = made.views[0].positions() + middle_of(pose)
    assert np.allclose(moved, view.positions(), rtol=0, atol=1e-6)


def test_where_the_scanner_stood_is_told_from_the_origin() -> None:
    cloud = PointCloud.from_arrays(
        np.random.default_rng(1).uniform(size=(50, 3)) + PLACE, viewpoint=PLACE + 2
    )
    pose = Pose(0, 0.0, "a.pcd", cloud)
    anonymous = anonymous_pose(pose, 0.0).cloud
    assert anonymous.viewpoint == pytest.approx(cloud.viewpoint - middle_of(pose), abs=1e-9)
    assert np.abs(anonymous.viewpoint).max() < 3


@pytest.mark.parametrize("origin", [(0, 0, 0), (691_000, 0, 0)])
def test_an_origin_that_a_file_tells_hides_nothing_and_nothing_is_left(
    origin: tuple[float, ...], run: Run, folder: Path
) -> None:
    positions = sphere(500).positions + PLACE - origin
    np.savez(FILE, positions=positions, origin=np.array(origin, float))
    look = ("--look", "color_by=height")
    for out in ("a.png", "a.npz"):
        assert run("render", FILE, *SMALL, "--anonymous", *look, "-o", out).code == 0
        assert_tells_nothing(Path(out), folder)
    assert max(map(abs, numbers(json.loads(read_description(Path("a.png")))))) < FAR
    assert_near_zero(dict(np.load("a.npz")))


def test_the_height_of_a_wide_flat_scan_is_not_told(run: Run) -> None:
    """Its origin is no grid step away from zero, so that its coordinates stay as they are."""
    place = np.random.default_rng(1).random((3000, 3)) * (2000, 6, 2000) + (0, 512, 0)
    np.save("terrain.npy", place.astype(np.float32))
    look = ("--look", "color_by=height")
    assert run("render", "terrain.npy", *SMALL, "--anonymous", *look, "-o", "a.png").code == 0
    assert run("render", "terrain.npy", *SMALL, "--anonymous", *look, "-o", "a.npz").code == 0
    camera = json.loads(read_description(Path("a.png")))["camera"]
    assert abs(camera["target"][1]) < 10
    assert np.nanmax(np.abs(np.load("a.npz")["value"])) < 20


def test_hashes_cannot_be_matched_and_do_not_tell_names(tmp_path: Path) -> None:
    one, other = tmp_path / "jane.ply", tmp_path / "renamed.ply"
    one.write_bytes(b"x" * 1000)
    other.write_bytes(b"x" * 1000)
    first = fingerprint([one], "00" * 8)
    assert first == fingerprint([other], "00" * 8) == fingerprint_as(first, [other])
    assert first != fingerprint([one], "11" * 8)
    assert fingerprint([one, other], "00" * 8) == fingerprint([other, one], "00" * 8)
    other.write_bytes(b"x" * 999 + b"y")
    assert fingerprint_as(first, [other]) != first
    plain = fingerprint([one])
    assert fingerprint_as(plain, [one]) == plain


def test_units_that_nobody_else_uses_are_left_out() -> None:
    assert [anonymous_unit(unit) for unit in ("mm", "m", "units", "jane")] == ["mm", "m", "units", "units"]

"""EXR: range views bit for bit, what other programs find in it, and what is refused."""

from __future__ import annotations

import os
import struct
import tracemalloc
from dataclasses import fields, replace
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import OpenEXR
import pytest
from range_scenes import LENSES, shape_view, sphere_view

from viewer.errors import InputError
from viewer.scan import formats
from viewer.scan.colors import linear_from_srgb8
from viewer.scan.formats import exr
from viewer.scan.open import open_scan
from viewer.scan.points import PointCloud
from viewer.scan.range_view import RangeView, merge

UTM = np.array([665187.25, 5648349.5, 241.75])


def pods(center: np.ndarray | None = None) -> tuple[RangeView, ...]:
    center = np.zeros(3) if center is None else center
    return (
        sphere_view(np.add(center, (0.3, 0, 4)), center, name="left"),
        sphere_view(np.add(center, (3, -1, 4)), center, size=(31, 17), name="rechts ä"),
    )


def save(path: Path, views: tuple[RangeView, ...]) -> Path:
    formats.write(path, merge(views), views)
    return path


def assert_same_bits(views: tuple[RangeView, ...], others: tuple[RangeView, ...]) -> None:
    assert len(views) == len(others)
    for view, other in zip(views, others, strict=True):
        for field in fields(RangeView):
            value, same = getattr(view, field.name), getattr(other, field.name)
            if isinstance(value, np.ndarray):
                assert (value.dtype, value.shape) == (same.dtype, same.shape), field.name
                assert value.tobytes() == same.tobytes(), field.name
            else:
                assert value == same, field.name


@pytest.mark.parametrize("center", [np.zeros(3), UTM])
def test_views_come_back_bit_for_bit(center: np.ndarray, tmp_path: Path) -> None:
    left, right = pods(center)
    depth, color = left.depth.copy(), left.color.copy()
    depth[0, :6] = [np.nan, np.inf, -np.inf, 0.0, -0.0, np.float32(1e-40)]
    color[0, :4, 0] = [np.nan, np.inf, -0.0, 6e-8]
    left = replace(left, depth=depth, color=color, fx=52.1 + 1e-13, cx=23.3)
    views = (left, right, replace(right, name="bare", color=None, confidence=None))
    assert_same_bits(formats.read(save(tmp_path / "f.exr", views)), views)


def test_every_kind_of_view_comes_back_bit_for_bit(tmp_path: Path) -> None:
    colors = np.random.default_rng(2).integers(0, 256, (97, 121, 3), np.uint8)
    cases = {f"{kind} {lens}": (kind, lens, False) for kind in ("z", "range") for lens in LENSES}
    cases |= {"height": ("height", "none", False)}
    cases |= {f"{kind} grid": (kind, "none", True) for kind in ("z", "height")}
    views = tuple(
        replace(shape_view("sphere", *case)[0], name=name, color=None if "grid" in name else colors)
        for name, case in cases.items()
    )
    assert_same_bits(formats.read(save(tmp_path / "f.exr", views)), views)


def test_matrices_of_heights_are_parallel(tmp_path: Path) -> None:
    view, points, _ = shape_view("plane", "height")
    with OpenEXR.File(str(save(tmp_path / "f.exr", (view,))), header_only=True) as file:
        to_ndc = file.parts[0].header["worldToNDC"]
    ndc = np.column_stack([points, np.ones(len(points))]) @ to_ndc
    pixels, depths = view.project(points)
    assert ndc[:, 3] == pytest.approx(1, abs=1e-6)
    assert ndc[:, 2] == pytest.approx(depths, abs=1e-4)
    assert ndc[:, :2] * view.depth.shape[::-1] == pytest.approx(pixels, abs=1e-3)


def test_the_file_is_as_documented(tmp_path: Path) -> None:
    views = pods()
    with OpenEXR.File(str(save(tmp_path / "f.exr", views)), separate_channels=True) as file:
        for view, part in zip(views, file.parts, strict=True):
            types = {name: channel.pixels.dtype for name, channel in part.channels.items()}
            half, single = np.dtype(np.float16), np.dtype(np.float32)
            expected = {"R": half, "G": half, "B": half, "mask": half, "Z": single, "confidence": single}
            assert (part.name(), types) == (view.name, expected)
            assert part.header["unit"] == "mm"
            assert part.header["fx"].tolist() == [view.fx]
            assert part.header["worldToCamera"].dtype == part.header["worldToNDC"].dtype == np.float32


def test_standard_matrices_mean_what_the_standard_says(tmp_path: Path) -> None:
    """Row vectors; a left-handed camera space that looks down +z; NDC from 0, 0 at the top left."""
    views = pods()
    with OpenEXR.File(str(save(tmp_path / "f.exr", views)), header_only=True) as file:
        headers = [dict(part.header) for part in file.parts]
    for view, header in zip(views, headers, strict=True):
        row, column = np.nonzero(view.valid())
        points = np.column_stack([view.positions(), np.ones(len(row))])
        camera = points @ header["worldToCamera"]
        assert camera[:, 2] == pytest.approx(view.depth[row, column], abs=1e-5)
        assert np.linalg.det(header["worldToCamera"][:3, :3].astype(float)) == pytest.approx(-1, abs=1e-6)
        ndc = points @ header["worldToNDC"]
        width, height = header["displayWindow"][1] + 1
        assert (width, height) == (48, 40)  # one for all parts
        assert ndc[:, 0] / ndc[:, 3] * width == pytest.approx(column + 0.5, abs=1e-3)
        assert ndc[:, 1] / ndc[:, 3] * height == pytest.approx(row + 0.5, abs=1e-3)


def other(path: Path, *, drop: tuple[str, ...] = (), **changes: object) -> Path:
    """A range scan as another program may write it: single-part, with these attributes and channels."""
    view = sphere_view((0, 0, 4))
    with OpenEXR.File(str(save(path, (view,))), separate_channels=True) as file:
        header = {k: v for k, v in file.parts[0].header.items() if k not in ("channels", "name", *drop)}
        channels = {k: c.pixels for k, c in file.parts[0].channels.items() if k not in drop}
    for key, value in changes.items():
        (channels if key in (*channels, *"RXY") else header)[key] = value
    with open(path, "wb") as stream:
        OpenEXR.File(header, channels).write(stream)
    return path


def test_what_may_be_absent(tmp_path: Path) -> None:
    absent = ("R", "G", "B", "mask", "confidence", "worldToCamera64", "worldToNDC", "unit")
    (view,) = formats.read(other(tmp_path / "f.exr", drop=absent, fx=50.5))
    assert (view.name, view.unit, view.fx) == ("part 0", "units", 50.5)
    assert view.color is view.confidence is None
    assert view.mask.all()
    assert view.eye == pytest.approx([0, 0, 4], abs=1e-6)


def test_a_cropped_picture_keeps_its_rays(tmp_path: Path) -> None:
    whole = sphere_view((0, 0, 4))
    path = save(tmp_path / "f.exr", (whole,))
    with OpenEXR.File(str(path), separate_channels=True) as file:
        header = {k: v for k, v in file.parts[0].header.items() if k != "channels"}
        channels = {k: np.ascontiguousarray(c.pixels[9:, 5:40]) for k, c in file.parts[0].channels.items()}
    low, high = (np.array(corner, np.int32) for corner in ((5, 9), (39, 39)))
    with open(path, "wb") as stream:
        OpenEXR.File(header | {"dataWindow": (low, high)}, channels).write(stream)
    (view,) = formats.read(path)
    assert view.depth.shape == (31, 35)
    kept = np.zeros(whole.depth.shape, bool)
    kept[9:, 5:40] = True
    expected = replace(whole, mask=whole.mask & kept).positions()
    assert view.positions() == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize(
    ("drop", "changes", "reason"),
    [
        (
            ("Z",),
            {},
            "'part 0' is not a range view. It lacks: channel Z. Each part of an EXR range scan needs",
        ),
        (("fx", "cy"), {}, "lacks: attribute fx, attribute cy"),
        (("worldToCamera", "worldToCamera64"), {}, "lacks: attribute worldToCamera"),
        ((), {"fx": np.array([-1.0])}, "calibration cannot be used: fx -1"),
        ((), {"kind": "far"}, "unknown kind of depth 'far'. Known: height, range, z"),
        ((), {"k1": np.array([0.1])}, r"distortion is \(0.1\), expected the numbers k1 k2 p1 p2"),
        (
            (),
            {"X": np.zeros((40, 48), np.float32), "Y": np.zeros((40, 48), np.float32), "kind": "range"},
            "together with distances",
        ),
        ((), {"cx": "middle"}, "could not convert string"),
        ((), {"worldToCamera64": np.eye(3)}, "cannot reshape"),
        ((), {"worldToCamera64": np.full((4, 4), np.inf)}, "must be a rotation and a translation"),
        ((), {"worldToCamera64": np.eye(4)}, "must be a rotation and a translation"),  # it looks down -z
        ((), {"Z": np.full((40, 48), np.nan, np.float32)}, "no pixel inside the masks has a depth"),
    ],
)
def test_what_is_no_range_scan(
    drop: tuple[str, ...], changes: dict[str, object], reason: str, tmp_path: Path
) -> None:
    path = other(tmp_path / "f.exr", drop=drop, **changes)
    with pytest.raises(InputError, match=reason) as caught:
        formats.read_points(path)
    assert str(caught.value).startswith(str(path))
    assert caught.value.hint


Channels = dict[str, np.ndarray]


def parts(path: Path, *several: tuple[str, dict[str, object], Channels]) -> Path:
    """A file of other programs: name, attributes beside those that all pictures have, and channels a part."""
    kinds = {"type": OpenEXR.scanlineimage, "compression": OpenEXR.ZIP_COMPRESSION}
    with open(path, "wb") as stream:
        OpenEXR.File(
            [OpenEXR.Part(kinds | header, channels, name) for name, header, channels in several]
        ).write(stream)
    return path


def rendered(**camera: object) -> tuple[RangeView, dict[str, object], Channels]:
    """A sphere without a mask, and attributes and channels of its picture as other programs write it."""
    view = replace(sphere_view((0.3, 0, 4)), mask=np.ones((40, 48), bool), confidence=None)
    seen = view.valid()
    channels = {name: np.ascontiguousarray(view.color[..., i]) for i, name in enumerate("RGB")}
    channels |= {"A": seen.astype(np.float16), "Z": np.where(seen, view.depth, np.float32(1e10))}
    return view, camera, channels


def cameras_of(path: Path, view: RangeView) -> dict[str, object]:
    """The standard matrices of a view."""
    with OpenEXR.File(str(save(path, (view,))), header_only=True) as file:
        header = dict(file.parts[0].header)
    return {name: header[name] for name in ("worldToCamera", "worldToNDC")}


def test_pictures_of_other_programs_stand_where_their_matrices_say(tmp_path: Path) -> None:
    for kind in ("z", "height"):
        shape, _, _ = shape_view("sphere", kind)
        camera = cameras_of(tmp_path / "ours.exr", shape)
        (view,) = formats.read(parts(tmp_path / "f.exr", ("beauty", camera, {"Z": shape.depth})))
        assert (view.kind, view.name, view.unit, view.assumed) == (kind, "beauty", "units", "")
        assert view.positions() == pytest.approx(shape.positions(), abs=1e-5)


def test_a_left_handed_world_is_turned(tmp_path: Path) -> None:
    """Its z points the other way, so that what is seen is not mirrored."""
    shape, points, _ = shape_view("sphere", "z")
    camera = cameras_of(tmp_path / "ours.exr", shape)
    turn = np.diag([1, 1, -1, 1]).astype(np.float32)  # for row vectors, from a left-handed world to ours
    camera = {name: turn @ matrix for name, matrix in camera.items()}
    (view,) = formats.read(parts(tmp_path / "f.exr", ("beauty", camera, {"Z": shape.depth})))
    assert view.positions() == pytest.approx(points, abs=1e-5)


def test_a_camera_that_nothing_tells_is_assumed(tmp_path: Path) -> None:
    shape, header, channels = rendered()
    path = parts(tmp_path / "f.exr", ("beauty", header, channels))
    (view,) = formats.read(path)
    assert "assumes a field of view of 45 degrees" in view.assumed
    assert view.fx == view.fy == pytest.approx(24 / np.tan(np.radians(22.5)))
    assert (view.cx, view.cy) == (24, 20)
    assert np.array_equal(view.valid(), shape.valid()), "without alpha nothing was seen"
    with open_scan(path) as scan:
        scan.pose(0)
        assert [(message.kind, message.text) for message in scan.messages] == [
            ("assumed", f"f.exr: {view.assumed}")
        ]
    assert_same_bits(formats.read(save(tmp_path / "again.exr", (view,))), (view,))
    header |= {"screenWindowWidth": 0.5, "screenWindowCenter": np.array([0.125, 0.25], np.float32)}
    (view,) = formats.read(parts(path, ("beauty", header, channels)))
    assert (view.fx, view.fy, view.cx, view.cy, view.assumed) == (96, 96, 24 - 12, 20 + 24, "")


def test_depth_and_colours_are_found_in_layers(tmp_path: Path) -> None:
    shape, header, channels = rendered()
    half = {name: (0.5 * channels[name]).astype(np.float16) for name in "RGBA"}  # half transparent
    layers = {f"Scene.Combined.{name}": half[name] for name in "RGBA"} | {"Scene.Depth.Z": channels["Z"]}
    layers |= {f"Scene.Normal.{name}": channels["R"] for name in "XYZ"}
    (view,) = formats.read(parts(tmp_path / "f.exr", ("", header, layers)))
    seen = shape.valid()
    assert np.array_equal(view.depth[seen], shape.depth[seen])
    assert view.color[seen] == pytest.approx(shape.color[seen], abs=1e-3)
    # Colours of other pixels are none of these.
    colors = {name: channels[name][1:].copy() for name in "RGB"}
    header |= {"displayWindow": (np.zeros(2, np.int32), np.array([47, 39], np.int32))}
    (view,) = formats.read(
        parts(tmp_path / "f.exr", ("a", header, {"Z": channels["Z"]}), ("b", header, colors))
    )
    assert view.color is None
    assert np.array_equal(view.valid(), seen), "1e10 is where nothing is"


def test_eyes_count_where_their_cameras_are_known(tmp_path: Path) -> None:
    left, right = shape_view("sphere", "z")[0], replace(shape_view("plane", "z")[0], name="other")
    eyes = {"left": left, "right": right}
    path = tmp_path / "f.exr"
    for known in (True, False):
        several = []
        for name, eye in eyes.items():
            header = {"view": name} | (cameras_of(path, eye) if known else {})
            several.append((f"depth_{name}", header, {"Z": eye.depth}))
        views = formats.read(parts(path, *several))
        assert [view.name for view in views] == (["left", "right"] if known else ["left"])
        assert [view.depth.tobytes() for view in views] == [
            e.depth.tobytes() for e in (left, right)[: 1 + known]
        ]


@pytest.mark.parametrize(
    ("camera", "reason"),
    [
        (
            {"worldToCamera": np.eye(4, dtype=np.float32)},
            "the attribute worldToNDC does not describe an upright camera",
        ),
        ({"worldToCamera": np.zeros((4, 4), np.float32)}, "Singular matrix"),
        (
            {"worldToCamera": np.full((4, 4), np.nan, np.float32)},
            "not a rotation|does not describe an upright camera",
        ),
        ({"screenWindowWidth": 0.0}, "calibration cannot be used: fx inf|division by zero"),
    ],
)
def test_cameras_of_other_programs_that_are_none(
    camera: dict[str, object], reason: str, tmp_path: Path
) -> None:
    _, _, channels = rendered()
    to_ndc = {"worldToNDC": np.ones((4, 4), np.float32)}
    with pytest.raises(InputError, match=reason):
        formats.read(parts(tmp_path / "f.exr", ("beauty", to_ndc | camera, channels)))


def test_damaged_parts_are_refused_and_standard_output_stays_clean(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = save(tmp_path / "f.exr", pods())
    whole = path.read_bytes()
    for size in range(0, len(whole), len(whole) // 40):
        path.write_bytes(whole[:size])
        with pytest.raises(InputError):
            formats.read(path)
    path.write_bytes(whole[:-300])
    with pytest.raises(InputError, match="can decode only 1 of the 2 parts"):
        formats.read(path)
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize("content", [b"", b"no picture", b"v/1\1" + bytes(200)])
def test_what_is_no_exr_is_told_in_our_words(content: bytes, tmp_path: Path) -> None:
    path = save(tmp_path / "f.exr", pods())
    path.write_bytes(path.read_bytes()[: 0 if content else 60] + content)
    for call in (formats.read, formats.read_unit):
        with pytest.raises(InputError, match=r"f\.exr: is not an EXR file, or is damaged\. Check"):
            call(path)


def test_reading_opens_the_path_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """So that the length is checked of the file that is read, also where another one takes its name."""
    path, other = save(tmp_path / "f.exr", pods()), tmp_path / "other.exr"
    other.write_bytes(b"another file")
    look = exr._headers

    def replaced(stream: BinaryIO) -> list[dict[str, Any]]:
        headers = look(stream)
        os.replace(other, path)
        return headers

    monkeypatch.setattr(exr, "_headers", replaced)
    assert len(exr.read(path)) == 2


def test_a_huge_window_is_refused_before_it_is_allocated(tmp_path: Path) -> None:
    path = save(tmp_path / "f.exr", pods())
    window, huge = struct.pack("<4i", 0, 0, 47, 39), struct.pack("<4i", 0, 0, 99_999, 99_999)
    path.write_bytes(path.read_bytes().replace(window, huge))
    tracemalloc.start()
    with pytest.raises(InputError, match=r"reading this file of .* bytes would need 230,000 MB"):
        formats.read(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 1_000_000


def test_empty_pixels_of_a_large_picture_are_no_bomb(tmp_path: Path) -> None:
    view = sphere_view((0, 0, 4))
    image = np.full((2000, 2000), np.nan, np.float32)
    image[1000, 1000] = 2
    views = (replace(view, depth=image, mask=image > 0, color=None, confidence=None),)
    assert len(formats.read_points(save(tmp_path / "f.exr", views))) == 1


def test_writing_needs_views_with_names_that_differ(tmp_path: Path) -> None:
    left, _ = pods()
    with pytest.raises(InputError, match=r"EXR stores range views.* written as \.npz, \.pcd, \.ply"):
        formats.write(tmp_path / "f.exr", PointCloud.from_arrays(np.eye(3)))
    for views in ((left, left), (replace(left, name=""),)):
        with pytest.raises(InputError, match="the names of the pods must differ"):
            save(tmp_path / "f.exr", views)
    assert list(tmp_path.iterdir()) == []
    assert ".exr" in formats.writable_suffixes(views=True)


def test_a_sequence_opens_with_its_unit(tmp_path: Path) -> None:
    frames = [(sphere_view((0.1 * i, 0, 4)), sphere_view((3, 0, 4), name="right")) for i in range(3)]
    for index, views in enumerate(frames):
        save(tmp_path / f"f{index}.exr", views)
    with open_scan(tmp_path) as scan:
        assert (len(scan), scan.unit) == (3, "mm")
        for pose, views in zip(scan, frames, strict=True):
            assert_same_bits(pose.views, views)
            assert np.array_equal(pose.cloud.positions, merge(views).positions)
        assert scan.messages == []
    (tmp_path / "f0.exr").write_bytes(b"nothing")
    with open_scan(tmp_path) as scan:
        assert scan.unit == "units"
        assert [pose.label for pose in scan] == ["f1.exr", "f2.exr"]


# --- real files -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("odd/exr/AllHalfValues.exr", "is not a range view: none of its channels contains depth"),
        ("odd/exr/WideFloatRange.exr", "none of its channels contains depth"),
        ("odd/exr/damaged_asan_561_c28c.exr", "none of its channels contains depth"),
        ("odd/exr/damaged_fuzz_5936.exr", "is not an EXR file, or is damaged"),
        ("range/openexr_deep/LowResLeftView_Balls.exr", "'rgba.left' is a deep image"),
    ],
)
def test_other_pictures_are_refused(name: str, reason: str, data_dir: Path) -> None:
    with pytest.raises(InputError, match=reason):
        formats.read(data_dir / name)


@pytest.mark.slow
def test_a_rendered_ball(data_dir: Path) -> None:
    """Two eyes without cameras: the first of them, whatever the parts are, where the data window lies."""
    single, several = (
        formats.read(data_dir / f"range/openexr_beachball/{name}.0001.exr")
        for name in ("singlepart", "multipart")
    )
    for (view,), top in ((single, 245), (several, 245)):
        assert (view.name, view.unit) == ("right", "units")
        assert (view.cx, view.cy) == (1024 - 654, 778 - top)
        assert "45 degrees" in view.assumed
        assert view.color.max() < 1
        assert len(view.positions()) == 595_673
        assert view.depth[view.valid()].min() == 9
    assert np.array_equal(single[0].positions(), several[0].positions())
    (beyond,) = formats.read(data_dir / "range/openexr_beachball/singlepart.0008.exr")
    assert beyond.depth.shape == (889, 926)  # to the right of the display window, and through its edge
    assert (beyond.cx, beyond.cy) == (1024 - 1384, 778 - 328)


@pytest.mark.slow
def test_a_head_from_a_phone(data_dir: Path, tmp_path: Path) -> None:
    """Its notes: x = (u - cx) d / f, y = (v - cy) d / f, z = d, u and v whole at pixel centres."""
    with np.load(data_dir / "range/truedepth_head_30/frame-045.npz") as frame:
        depth, colors = frame["depth"], frame["color"]
    f, cx, cy = 298.565, 159.232, 119.101
    view = RangeView(
        depth=depth,
        mask=np.isfinite(depth),
        color=linear_from_srgb8(colors),
        fx=f,
        fy=f,
        cx=cx + 0.5,
        cy=cy + 0.5,
        world_to_camera=np.diag([1.0, -1, -1, 1]),  # their y points down, their z away
        name="phone",
        unit="m",
    )
    v, u = np.nonzero(np.isfinite(depth))
    d = depth[v, u].astype(float)
    expected = np.stack([(u - cx) * d / f, (v - cy) * d / f, d], axis=1)
    assert len(expected) > 10_000
    assert view.positions() == pytest.approx(expected, abs=1e-12)
    (back,) = formats.read(save(tmp_path / "f.exr", (view,)))
    assert_same_bits((back,), (view,))
    assert np.array_equal(back.points().colors[:, :3], colors[v, u])
    assert np.einsum("ij,ij->i", view.normals(), view.positions()).max() < 0  # all face the pod


@pytest.mark.slow
def test_two_poses_of_a_depth_camera_meet(data_dir: Path, tmp_path: Path) -> None:
    """Frames whose poses are stated as camera to world: what both see lies at the same place."""
    from PIL import Image

    folder, views = data_dir / "range/sevenscenes_kinect_31", []
    for number in ("000000", "000033"):
        depth = np.asarray(Image.open(folder / f"frame-{number}.depth.png")).astype(np.float32) / 1000
        to_world = np.loadtxt(folder / f"frame-{number}.pose.txt")
        turned = np.diag([1.0, -1, -1, 1]) @ np.linalg.inv(to_world)
        turned[3] = 0, 0, 0, 1
        views.append(
            RangeView(
                depth=depth,
                mask=depth < 10,  # 65535 is none
                fx=585.0,
                fy=585.0,
                cx=320.5,
                cy=240.5,
                world_to_camera=turned,
                name=number,
                unit="m",
            )
        )
        v, u = np.nonzero(views[-1].valid())
        d = depth[v, u].astype(float)
        camera = np.stack([(u - 320) * d / 585, (v - 240) * d / 585, d, np.ones(len(d))], axis=1)
        assert views[-1].positions() == pytest.approx((camera @ to_world.T)[:, :3], abs=1e-6)
    first, second = views
    points = first.positions()[::50] @ second.world_to_camera[:3, :3].T + second.world_to_camera[:3, 3]
    u = np.floor(second.cx - second.fx * points[:, 0] / points[:, 2])
    v = np.floor(second.cy + second.fy * points[:, 1] / points[:, 2])
    seen = (points[:, 2] < 0) & (u >= 0) & (u < 640) & (v >= 0) & (v < 480)
    row, column = v[seen].astype(int), u[seen].astype(int)
    apart = np.abs(second.depth[row, column] + points[seen, 2])[second.valid()[row, column]]
    assert len(apart) > 1000
    assert np.median(apart) < 0.02  # metres
    assert_same_bits(formats.read(save(tmp_path / "f.exr", (first, second))), (first, second))

"""TIFF: terrains by their tags, depth without a calibration, and every way of storing numbers."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from PIL.TiffImagePlugin import ImageFileDirectory_v2

from viewer.errors import InputError
from viewer.scan import formats
from viewer.scan.admission import READ_VARIABLE
from viewer.scan.open import open_scan
from viewer.scan.range_view import RangeView

SCALE, TIE, TRANSFORMATION, KEYS, NO_DATA = 33550, 33922, 34264, 34735, 42113
DOUBLES, SHORTS, TEXT = 12, 3, 2  # types of tags
GROUND = {SCALE: (30.0, 20.0, 0.0), TIE: (0.0, 0.0, 0.0, 376_000.0, 3_808_000.0, 0.0)}
HEIGHTS = np.arange(12, dtype=np.float32).reshape(3, 4)


def keys(**entries: int) -> tuple[int, ...]:
    """A directory of GeoKeys: model (1024), raster (1025), ground (3076) and height (4099) units."""
    numbers = {"model": 1024, "raster": 1025, "ground": 3076, "height": 4099}
    found = [(numbers[name], 0, 1, value) for name, value in entries.items()]
    return sum(found, (1, 1, 0, len(found)))


def save(path: Path, numbers: np.ndarray, tags: dict[int, Any] | None = None, **how: object) -> Path:
    directory = ImageFileDirectory_v2()
    for tag, value in (tags or {}).items():
        directory.tagtype[tag] = {KEYS: SHORTS, NO_DATA: TEXT}.get(tag, DOUBLES)
        directory[tag] = value
    Image.fromarray(numbers).save(path, tiffinfo=directory, **how)
    return path


def terrain(path: Path, numbers: np.ndarray, tags: dict[int, Any], **how: object) -> RangeView:
    (view,) = formats.read(save(path, numbers, tags, **how))
    return view


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "scan.tif"


def test_a_terrain_lies_where_its_tags_say(path: Path) -> None:
    view = terrain(path, HEIGHTS, GROUND | {KEYS: keys(model=1, raster=1, ground=9001)})
    row, column = np.mgrid[:3, :4].reshape(2, -1)
    expected = np.stack([376_015 + 30 * column, 3_807_990 - 20 * row, HEIGHTS.ravel()], axis=1)
    assert view.positions() == pytest.approx(expected, abs=1e-8)
    assert (view.kind, view.unit, view.name) == ("height", "m", "terrain")
    assert formats.read_unit(path) == "m"


def test_other_ways_to_place_it(path: Path) -> None:
    expected = terrain(path, HEIGHTS, GROUND).positions()
    matrix = (30, 0, 0, 376_000, 0, -20, 0, 3_808_000, 0, 0, 0, 0, 0, 0, 0, 1)
    assert np.array_equal(terrain(path, HEIGHTS, {TRANSFORMATION: matrix}).positions(), expected)
    inside = GROUND | {TIE: (2.0, 1.0, 0.0, 376_060.0, 3_807_980.0, 0.0)}
    assert np.array_equal(terrain(path, HEIGHTS, inside).positions(), expected)
    of_points = GROUND | {TIE: (0.0, 0.0, 0.0, 376_015.0, 3_807_990.0, 0.0), KEYS: keys(raster=2)}
    assert np.array_equal(terrain(path, HEIGHTS, of_points).positions(), expected)


def test_units_of_ground_and_heights(path: Path) -> None:
    feet = terrain(path, HEIGHTS, GROUND | {KEYS: keys(ground=9002)})
    assert (feet.unit, 1 / feet.fx) == ("ft", pytest.approx(30))
    mixed = terrain(path, HEIGHTS, GROUND | {KEYS: keys(ground=9002, height=9001)})
    assert (mixed.unit, 1 / mixed.fx, mixed.eye[0]) == (
        "m",
        pytest.approx(9.144),
        pytest.approx(376_060 * 0.3048),
    )
    assert terrain(path, HEIGHTS, GROUND).unit == formats.read_unit(path) == "units"


def test_degrees(path: Path) -> None:
    ground = {SCALE: (0.001, 0.001, 0.0), TIE: (0.0, 0.0, 0.0, 11.0, 47.0, 0.0)}
    told = terrain(path, HEIGHTS, ground | {KEYS: keys(model=2)})
    assert told.unit == "m"
    assert 1 / told.fy == pytest.approx(111.2, abs=0.1)
    assert told.eye[:2] == pytest.approx([0, 0], abs=1e-9)
    assert np.array_equal(terrain(path, HEIGHTS, ground).positions(), told.positions())  # cliffs, or degrees
    assert formats.read_unit(path) == "m"
    lengths = terrain(path, HEIGHTS, ground | {KEYS: keys(model=1)})
    assert 1 / lengths.fy == pytest.approx(0.001)


@pytest.mark.parametrize(
    ("numbers", "missing"),
    [
        (np.where(HEIGHTS == 5, np.float32(-3.4028234663852886e38), HEIGHTS), "-3.4028234663852886e+38"),
        (np.where(HEIGHTS == 5, np.float32(np.nan), HEIGHTS), "nan"),
        (np.where(HEIGHTS == 5, 65535, HEIGHTS).astype(np.uint16), "65535"),
        (np.where(HEIGHTS == 5, -9999, HEIGHTS).astype(np.int32), "-9999 "),
    ],
)
def test_where_nothing_is_known(numbers: np.ndarray, missing: str, path: Path) -> None:
    view = terrain(path, numbers, GROUND | {NO_DATA: missing})
    assert np.array_equal(view.valid(), HEIGHTS != 5)
    odd = terrain(path, numbers, GROUND | {NO_DATA: "nothing"})
    assert np.array_equal(odd.valid(), np.isfinite(numbers))


@pytest.mark.parametrize("packing", [None, "tiff_lzw", "tiff_adobe_deflate", "zstd", "packbits"])
def test_depth_comes_back_bit_for_bit(packing: str | None, path: Path) -> None:
    depth = np.random.default_rng(1).random((70, 50), np.float32)
    depth[3, 4:7] = np.nan, 0, -1
    (view,) = formats.read(save(path, depth, compression=packing))
    assert view.depth.tobytes() == depth.tobytes()
    assert np.count_nonzero(view.valid()) == 3500 - 3
    assert "45 degrees" in view.assumed
    assert (view.kind, view.unit, view.color) == ("z", "units", None)


def test_numbers_of_other_machines(path: Path) -> None:
    """Big-endian, packed and not: a difference of bytes that must not show."""
    numbers = np.random.default_rng(1).integers(1, 1000, (40, 30))
    for dtype in (">f4", ">i4", ">u2", ">i2"):
        for packed in (False, True):
            path.write_bytes(big_endian(numbers.astype(dtype), packed))
            (view,) = formats.read(path)
            assert np.array_equal(view.depth, numbers), (dtype, packed)


def big_endian(numbers: np.ndarray, packed: bool) -> bytes:
    """A TIFF of one strip as a big-endian machine writes it."""
    data = zlib.compress(numbers.tobytes()) if packed else numbers.tobytes()
    height, width = numbers.shape
    entries = [
        (256, 4, width), (257, 4, height), (258, 3, 8 * numbers.itemsize), (259, 3, 8 if packed else 1),
        (262, 3, 1), (273, 4, 8), (277, 3, 1), (278, 4, height), (279, 4, len(data)),
        (339, 3, {"u": 1, "i": 2, "f": 3}[numbers.dtype.kind]),
    ]  # fmt: skip
    data += b"\0" * (len(data) % 2)
    fields = b"".join(
        struct.pack(">HHIHH" if kind == 3 else ">HHII", tag, kind, 1, value, *[0] * (kind == 3))
        for tag, kind, value in entries
    )
    return struct.pack(">2sHI", b"MM", 42, 8 + len(data)) + data + struct.pack(">H", len(entries)) + fields


@pytest.mark.parametrize(
    ("tags", "reason"),
    [
        (GROUND | {SCALE: (30.0,)}, "the tag 33550 is not 2 finite numbers"),
        (GROUND | {SCALE: (np.nan, 1.0, 0.0)}, "the tag 33550 is not 2 finite numbers"),
        (GROUND | {SCALE: (0.0, 20.0, 0.0)}, "the cells have the unusable size 0 x -20"),
        (GROUND | {TIE: (0.0, 0.0)}, "the tag 33922 is not 6 finite numbers"),
        ({TRANSFORMATION: (1.0, 0.5, *(0.0,) * 14)}, "the rows of the picture do not go from west to east"),
        (GROUND | {KEYS: keys(model=2)}, "the centre of the terrain is at 3.80797e.06 degrees of latitude"),
    ],
)
def test_grounds_that_cannot_be_used(tags: dict[int, Any], reason: str, path: Path) -> None:
    save(path, HEIGHTS, tags)
    with pytest.raises(InputError, match=reason):
        formats.read(path)


def test_odd_keys_tell_nothing(path: Path) -> None:
    for words in ((), (1, 1, 0, 9), (1, 1, 0, 1, 1024, 0, 1), (1, 1, 0, 1, 1024, 34736, 1, 2)):
        assert terrain(path, HEIGHTS, GROUND | ({KEYS: words} if words else {})).unit == "units"


def test_pictures_that_are_no_depth(path: Path) -> None:
    Image.fromarray(np.zeros((4, 4, 3), np.uint8)).save(path)
    with pytest.raises(InputError, match="is a picture of type RGB, but Scan4D needs one number per pixel"):
        formats.read(path)
    path.write_bytes(b"II*\0" + bytes(100))
    with pytest.raises(InputError, match="is not a valid TIFF file"):
        formats.read(path)


def test_damaged_files_are_refused(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = save(path, np.random.default_rng(1).random((70, 50), np.float32), GROUND).read_bytes()
    for size in range(0, len(whole), len(whole) // 40):
        path.write_bytes(whole[:size])
        with pytest.raises(InputError, match=r"scan\.tif"):
            formats.read(path)
    save(path, np.ones((2000, 2000), np.float32), compression="tiff_adobe_deflate")
    monkeypatch.setenv(READ_VARIABLE, "20")
    with pytest.raises(
        InputError, match=rf"would need .* MB of memory, .* set the environment variable {READ_VARIABLE}="
    ):
        formats.read(path)


def test_textures_beside_a_scan_are_no_frames(tmp_path: Path) -> None:
    np.save(tmp_path / "scan.npy", np.eye(3))
    save(tmp_path / "texture.tif", np.ones((2, 2), np.uint8))
    with open_scan(tmp_path) as scan:
        assert [pose.label for pose in scan] == ["scan.npy"]


def test_mountains(data_dir: Path) -> None:
    with open_scan(data_dir / "range/terrain/bigtujunga_30m.tif") as scan:
        (view,) = scan.pose(0).views
        assert scan.unit == "m"
    assert (view.kind, view.depth.shape, 1 / view.fx, 1 / view.fy) == ("height", (643, 1197), 30, 30)
    points = view.positions()
    assert points[0] == pytest.approx([376_313.655 + 15, 3_807_917.828 - 15, -view.depth[0, 0]], abs=1e-3)
    assert (points[:, 2].min(), points[:, 2].max()) == (315, 2295)
    assert view.normals()[:, 2].min() > 0

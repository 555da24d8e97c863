"""PCD: the Point Cloud Library's format, versions 0.5 to 0.7, all three encodings.

Read here and not by a library because those at hand lose columns, alpha or whole files (upper-case
names, 64-bit types).

An organised cloud (HEIGHT above 1) of x, y, z and colours alone is a range view where a pinhole has these
points in its pixels; VIEWPOINT then is the pose of the camera. Of other clouds it is where the sensor stood,
not a transform, and is not applied: normals that are estimated face it. 0 0 0 1 0 0 0, which is written where
nobody knows, tells nothing.
"""

from __future__ import annotations

import math
import re
import struct
from dataclasses import dataclass, replace
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from ...errors import EmptyFrame, InputError, shortened, unknown_name
from ...rigid import rigid_matrix
from ..admission import (
    MOST_COLUMNS,
    admit,
    check_count,
    opened,
    read_exactly,
    read_records,
    size_of,
    too_few,
    whole_number,
)
from ..contents import PointContents, Stated
from ..grids import view_of_camera
from ..image_poses import from_camera_to_world, rotation_of
from ..points import UNKNOWN_UNIT, PointCloud
from ..range_view import RangeView
from ..reading.camera import note_fitted
from ..reading.sequence import Decided
from ._columns import (
    Columns,
    check_encoding,
    columns_from_cloud,
    declared,
    named,
    parse_table,
    records,
    text_lines,
)

TITLE = "PCD"
SUFFIXES = (".pcd",)

_HEADER_LIMIT = 1 << 16  # bytes looked at for the header
_TYPES = {"F4", "F8", "I1", "I2", "I4", "I8", "U1", "U2", "U4", "U8"}
_PADDING = "_"
_HERE = ["0", "0", "0", "1", "0", "0", "0"]  # the viewpoint that nobody tells
_OF_VIEWS = {"x", "y", "z", "red", "green", "blue", "alpha"}  # columns that range views have
_VIEW_BYTES, _WORK = 64, 20 << 20  # bytes of a point as it becomes a view, and beside all
# Open3D 0.20 and PCL's point types do; CloudCompare (2.12) and PDAL read them. Offsets in float32 would need
# a field for the origin that others know, and programs differ in what VIEWPOINT means.
_SLACK = 1e-6  # scan units: what is less is no reason for coordinates that few programs read
_IN_FLOAT64 = (
    "Scan4D stores coordinates as float64, because float32 would round them. Open3D and PCL read float64 "
    "coordinates as zeros"
)
_LONGEST_WORD = 40  # of a file, in a message
_LZF_MAX_RATIO = 88  # three bytes stand for 264 at most


@dataclass(frozen=True)
class _Field:
    name: str
    type: str  # numpy's, as "f4"
    count: int

    @property
    def columns(self) -> list[str]:
        return [self.name] if self.count == 1 else [f"{self.name}_{i}" for i in range(self.count)]


@dataclass(frozen=True)
class _Header:
    fields: list[_Field]
    points: int
    encoding: str
    size: int  # bytes
    grid: tuple[int, int] | None  # rows and columns of an organised cloud
    viewpoint: list[str]
    remarks: tuple[str, ...]  # lines of comments

    @property
    def dtype(self) -> np.dtype:
        """One point; fields go by number, since names may repeat."""
        return np.dtype([(str(i), f"<{f.type}", (f.count,)) for i, f in enumerate(self.fields)])


def contents(path: Path, frame: int, decided: Decided) -> PointContents | tuple[RangeView, ...]:
    """All points of a PCD file and its remarks, or the range view that they are. Raises InputError."""
    with opened(path) as stream:
        header = _read_header(stream.read(_HEADER_LIMIT))
        if header.encoding not in _ENCODINGS:
            raise unknown_name("PCD encoding", header.encoding[:_LONGEST_WORD], list(_ENCODINGS))
        stream.seek(header.size)
        columns = _ENCODINGS[header.encoding](stream, header, decided)
        packed = header.encoding == "binary_compressed"
        if header.grid and {name.lower() for name in columns} <= _OF_VIEWS:
            admit(size_of(stream), header.points * (header.dtype.itemsize + _VIEW_BYTES) + _WORK)
            if (view := _camera_view(columns, header.grid, header.viewpoint)) is not None:
                note_fitted(view, decided)
                return (view,)
        held = size_of(stream) if packed else None
        stated = Stated(viewpoint=_sensor_pose(header.viewpoint))
        return PointContents(columns=columns, held=held, stated=stated, remarks=header.remarks)


def column_names(path: Path) -> list[str]:
    """The names of the fields of a point. Raises InputError."""
    with opened(path) as stream:
        return [name for field in _read_header(stream.read(_HEADER_LIMIT)).fields for name in field.columns]


def _camera_view(columns: Columns, shape: tuple[int, int], viewpoint: list[str]) -> RangeView | None:
    """The range view of an organised cloud, or None where it is no camera's."""
    named = {name.lower(): column for name, column in columns.items()}
    if not {*"xyz"} <= named.keys():
        return None
    grid = np.stack([named[name] for name in "xyz"], axis=1).reshape(*shape, 3)
    view = view_of_camera(grid, _world_to_camera(viewpoint), "camera", UNKNOWN_UNIT)
    if view is None or not {"red", "green", "blue"} <= named.keys():
        return view
    color = np.stack([named[name] for name in ("red", "green", "blue")], axis=1)
    return replace(view, color=color.reshape(*shape, 3)) if color.dtype == np.uint8 else None


def _sensor_pose(viewpoint: list[str]) -> NDArray[np.float64] | None:
    """The pose of the sensor that a VIEWPOINT states, (4, 4) world_from_sensor; None where it states none."""
    try:
        numbers = np.array(viewpoint or _HERE, np.float64)
    except ValueError:
        return None
    is_stated = (
        numbers.shape == (7,) and np.isfinite(numbers).all() and (numbers != np.array(_HERE, float)).any()
    )
    if not is_stated:
        return None
    pose = np.eye(4)  # the rotation of clouds is not used
    pose[:3, 3] = numbers[:3]
    return pose


def _world_to_camera(viewpoint: list[str]) -> NDArray[np.float64]:
    """The pose of a VIEWPOINT: a translation and a quaternion w x y z, from an image's axes to the world."""
    try:
        numbers = np.array(viewpoint or _HERE, np.float64)
    except ValueError:
        numbers = np.empty(0)
    if numbers.shape != (7,) or not np.isfinite(numbers).all():
        raise InputError(f"the line VIEWPOINT is not a pose: {shortened(' '.join(viewpoint))}")
    return from_camera_to_world(rigid_matrix(rotation_of(np.roll(numbers[3:], -1)), numbers[:3]))


def write(path: Path, cloud: PointCloud) -> str | None:
    """Write a binary PCD; colours are packed as `rgba`, radii are called `radius`, a viewpoint VIEWPOINT.
    Returns a remark where coordinates are float64, which many programs do not read."""
    columns = columns_from_cloud(cloud, ("normal_x", "normal_y", "normal_z"), _SLACK)
    if cloud.colors is not None:
        names = ("alpha", "red", "green", "blue")
        alpha, red, green, blue = (columns.pop(name).astype("u4") for name in names)
        columns["rgba"] = alpha << 24 | red << 16 | green << 8 | blue
    header: dict[str, list] = {
        "VERSION": ["0.7"],
        "FIELDS": list(columns),
        "SIZE": [column.itemsize for column in columns.values()],
        "TYPE": [column.dtype.kind.upper() for column in columns.values()],
        "COUNT": [1] * len(columns),
        "WIDTH": [len(cloud)],
        "HEIGHT": [1],
        "VIEWPOINT": _HERE if cloud.viewpoint is None else [*map(repr, cloud.viewpoint.tolist()), *_HERE[3:]],
        "POINTS": [len(cloud)],
        "DATA": ["binary"],
    }
    with open(path, "wb") as stream:
        for key, values in header.items():
            stream.write(f"{key} {' '.join(map(str, values))}\n".encode())
        records(columns).tofile(stream)
    return _IN_FLOAT64 if columns["x"].itemsize == 8 else None


def _read_header(head: bytes) -> _Header:
    check_encoding(head, "PCD")
    end = re.search(rb"^DATA[ \t]+(\w+)[ \t\r]*(\n|\Z)", head, re.MULTILINE)
    if end is None:
        raise InputError("is not a PCD file: it has no DATA line")
    lines = head[: end.start()].decode("utf-8", "replace").splitlines()
    words = {line.split()[0].upper(): line.split()[1:] for line in lines if line.strip()}
    remarks = tuple(line.strip("# \t") for line in lines if line.lstrip().startswith("#"))
    for key in ("FIELDS", *(["WIDTH", "HEIGHT"] if "POINTS" not in words else [])):
        if not words.get(key):
            raise InputError(f"the PCD header has no {key} line")
    names = words["FIELDS"]
    sizes, types = words.get("SIZE", []), words.get("TYPE", [])
    counts = [whole_number(count, "a COUNT") for count in words.get("COUNT", ["1"] * len(names))]
    if not len(names) == len(sizes) == len(types) == len(counts):
        raise InputError(
            "the lines FIELDS, SIZE, TYPE and COUNT of the PCD header have different numbers of entries"
        )
    for code in (type_ + size for type_, size in zip(types, sizes, strict=True)):
        if code not in _TYPES:
            raise unknown_name("PCD type and size", code[:_LONGEST_WORD], list(_TYPES))
    sides = words["POINTS"] if "POINTS" in words else words["WIDTH"] + words["HEIGHT"]
    points = math.prod(whole_number(side, "the number of points") for side in sides)
    if points == 0:
        raise EmptyFrame("contains no points, according to its header")
    if points < 1 or min(counts) < 1:
        raise InputError(f"the PCD header promises {points} points of {sum(counts)} values")
    check_count(sum(counts), MOST_COLUMNS, "values a point")
    fields = [_Field(n, (t + s).lower(), c) for n, t, s, c in zip(names, types, sizes, counts, strict=True)]
    encoding, viewpoint = end[1].decode().lower(), words.get("VIEWPOINT", [])
    return _Header(fields, points, encoding, end.end(), _grid(words, points), viewpoint, remarks)


def _grid(words: dict[str, list[str]], points: int) -> tuple[int, int] | None:
    """Rows and columns, where the header has several of both and they are the points."""
    sides = [*words.get("HEIGHT", []), *words.get("WIDTH", [])]
    if len(sides) != 2:
        return None
    height, width = (whole_number(side, "the number of points") for side in sides)
    return (height, width) if min(height, width) > 1 and height * width == points else None


def _read_ascii(stream: BinaryIO, header: _Header, decided: Decided) -> Columns:
    stream.seek(header.size)
    table = parse_table(text_lines(stream), header.points, decided)
    if len(table) < header.points:
        raise too_few(len(table), header.points, "points")
    ends = np.cumsum([f.count for f in header.fields])
    if table.shape[1] < ends[-1]:
        raise InputError(f"the rows have {table.shape[1]} values, but the header states {ends[-1]}")
    blocks = np.split(table, ends[:-1], axis=1)
    return _unpacked(
        _columns(
            header, [declared(f.name, block, f.type) for f, block in zip(header.fields, blocks, strict=True)]
        )
    )


def _read_binary(stream: BinaryIO, header: _Header, decided: Decided) -> Columns:
    rows = read_records(stream, header.dtype, header.points, "points")
    return _unpacked(_columns(header, [rows[name] for name in header.dtype.names or ()]))


def _read_compressed(stream: BinaryIO, header: _Header, decided: Decided) -> Columns:
    """One LZF stream that holds field after field, each for all points."""
    import lzf

    packed, unpacked = struct.unpack("<II", read_exactly(stream, 8))
    promised = header.points * header.dtype.itemsize
    if unpacked != promised:
        raise InputError(f"contains {unpacked} bytes of points, but its header states {promised}")
    held = size_of(stream) - stream.tell()
    if packed > held:
        raise InputError(f"contains only {held} of {packed} bytes of compressed data")
    if unpacked > packed * _LZF_MAX_RATIO:
        raise InputError(f"{packed} bytes of compressed data cannot contain {unpacked} bytes")
    admit(size_of(stream), packed + 2 * unpacked)  # the library has two, and so have the fields
    data = lzf.decompress(read_exactly(stream, packed), unpacked)
    if data is None or len(data) != unpacked:
        raise InputError("the compressed data are damaged")
    blocks, start = [], 0
    for f in header.fields:
        block = np.frombuffer(data, f"<{f.type}", header.points * f.count, start)
        blocks.append(block.reshape(header.points, f.count).copy())  # so that each may go by itself
        start += block.nbytes
    return _unpacked(_columns(header, blocks))


_ENCODINGS = {"ascii": _read_ascii, "binary": _read_binary, "binary_compressed": _read_compressed}


def _columns(header: _Header, blocks: list[NDArray]) -> dict[str, NDArray]:
    """blocks: (N, count) of every field."""
    return named(
        (name, block[:, i])
        for f, block in zip(header.fields, blocks, strict=False)
        if f.name != _PADDING
        for i, name in enumerate(f.columns)
    )


def _unpacked(columns: dict[str, NDArray]) -> Columns:
    """Split the packed colour 0xAARRGGBB, an integer or the bits of a float, into its four columns."""
    for name in ("rgba", "rgb"):
        if name in columns and columns[name].itemsize == 4:
            channels = np.ascontiguousarray(columns.pop(name))[:, None].view("u1")
            columns |= {"red": channels[:, 2], "green": channels[:, 1], "blue": channels[:, 0]}
            if name == "rgba" and channels[:, 3].any():  # many writers leave alpha 0
                columns["alpha"] = channels[:, 3]
    return columns

"""LAS and LAZ: points of airborne and terrestrial laser scanners, read by laspy, unpacked by lazrs.

Damaged LAZ can end the process that unpacks it, as the unpacker takes what memory the file asks for: it is
done in a process of its own.

Coordinates are whole numbers times a scale and an offset, as float64. Colours are of 16 bit, or of 8 bit as
many programs write them. Intensity, classification, returns, times and extra dimensions
are scalars; Scan4D leaves out those that are the same for all points.
"""

from __future__ import annotations

import logging
import os
import struct
import subprocess
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...errors import EmptyFrame, InputError
from ...helper import start_python
from ...task import checkpoint
from ...unfinished import temporary_folder
from ..admission import MOST_COLUMNS, admit, check_count, opened, size_of, too_few
from ..contents import PointContents
from ..reading.cloud import GEOMETRY
from ._columns import named

if TYPE_CHECKING:
    from laspy import LasReader

TITLE = "LAS"
SUFFIXES = (".las", ".laz")

_AT_ONCE = 1 << 16  # points unpacked together
_MOST_RATIO = 100  # of memory to the file: LAZ packs points of regular scanners to a twentieth
_COLORS = ("red", "green", "blue")
_WHOLE = {"X", "Y", "Z"}  # coordinates before scale and offset
_COPIES, _OTHERS = 2, 36  # of a point's bytes; bytes of its coordinates and of what becomes of them
_FIRST = struct.Struct("<96xIIB")  # where points begin, number of records before, format of points
_SMALLEST_RECORD = 54  # bytes
_PACKED = 0x80  # the bit of the format that marks LAZ
_LOOK = 0.1  # seconds between looks at whether reading is cancelled
_SAID = 200  # letters of what the unpacker says


def contents(path: Path, frame: int = 0) -> PointContents:
    """All points of a LAS or LAZ file. Raises InputError."""
    import laspy

    logging.getLogger("laspy").setLevel(logging.CRITICAL)  # the exception says what is wrong
    with opened(path) as stream:
        held = size_of(stream)
        if not _checked_format(stream.read(_FIRST.size), held) & _PACKED:
            stream.seek(0)
            with laspy.open(stream, closefd=False, read_evlrs=False) as reader:
                return PointContents(columns=_columns(reader, held))
    with temporary_folder() as folder:
        plain = folder / "plain.las"
        _unpack_beside(path, plain)
        with laspy.open(plain) as reader:
            return PointContents(columns=_columns(reader, plain.stat().st_size))


def column_names(path: Path) -> list[str]:
    """The names of the dimensions of a point, from the header. Raises InputError."""
    import laspy

    with opened(path) as stream:
        _checked_format(stream.read(_FIRST.size), size_of(stream))
        stream.seek(0)
        with laspy.open(stream, closefd=False, read_evlrs=False) as reader:
            return [*reader.header.point_format.dimension_names]


def unpack_laz(packed: str, plain: str) -> None:
    """Write the points of a LAZ file as LAS. Raises InputError where there are fewer than it promises."""
    import laspy

    logging.getLogger("laspy").setLevel(logging.CRITICAL)
    with laspy.open(packed, read_evlrs=False) as reader:
        header, done = reader.header, 0
        admit(
            os.path.getsize(packed),
            header.point_count * (_COPIES * header.point_format.size + _OTHERS),
            _MOST_RATIO,
        )
        # Without its records: some cannot be written, and nobody reads them here.
        bare = laspy.LasHeader(version=header.version, point_format=header.point_format)
        bare.scales, bare.offsets = header.scales, header.offsets
        with laspy.open(plain, mode="w", header=bare, do_compress=False) as writer:
            for points in reader.chunk_iterator(_AT_ONCE):
                writer.write_points(points)
                done += len(points)
        if done < header.point_count:
            raise too_few(done, header.point_count, "points")


def _unpack_beside(packed: Path, plain: Path) -> None:
    """`unpack_laz` in a process of its own. Raises InputError where that fails, however it ends."""
    code = f"import sys; from {__name__} import unpack_laz; unpack_laz(*sys.argv[1:])"
    with start_python(code, str(packed), str(plain), nice=0, stderr=subprocess.PIPE) as process:
        try:
            while True:
                checkpoint()
                try:
                    _, said = process.communicate(timeout=_LOOK)
                    break
                except subprocess.TimeoutExpired:
                    continue
        except BaseException:
            process.kill()
            raise
    if process.returncode:
        words = said.decode(errors="replace").strip().splitlines()
        raise InputError(
            f"Scan4D cannot unpack the points ({words[-1][:_SAID] if words else process.returncode})"
        )


def _checked_format(head: bytes, held: int) -> int:
    """The format of the points of a file of `held` bytes.

    Raises InputError where the file promises more than fits into it: laspy goes through all records before
    the points, and makes room for them. It does not read the records behind the points.
    """
    if not head.startswith(b"LASF") or len(head) < _FIRST.size:
        raise InputError("is not a LAS file")
    begin, records, form = _FIRST.unpack(head)
    if _SMALLEST_RECORD * records > held:
        raise InputError(f"states {records:,} records before its points, more than the file can contain")
    if begin > held:
        raise InputError(
            f"states that its points begin at byte {begin:,}, but the file has only {held:,} bytes"
        )
    return form


def _columns(reader: LasReader, held: int) -> dict[str, NDArray]:
    header = reader.header
    count, form = header.point_count, header.point_format
    check_count(len(list(form.dimension_names)), MOST_COLUMNS, "dimensions of a point")
    admit(held, count * (_COPIES * form.size + _OTHERS), _MOST_RATIO)
    parts: dict[str, list[NDArray]] = {}
    done = 0
    for points in reader.chunk_iterator(_AT_ONCE):
        checkpoint(done / count if count else None)
        for axis in "xyz":
            parts.setdefault(axis, []).append(np.array(points[axis], np.float64))
        for name in form.dimension_names:
            values = np.array(points[name])
            if name not in _WHOLE and values.ndim == 1:
                parts.setdefault(name, []).append(values)
        done += len(points)
    if not done:
        if not count:
            raise EmptyFrame("holds no points")
        raise InputError("contains none of the points that its header states")
    if done < count:
        raise too_few(done, count, "points")
    columns = {name: np.concatenate(parts.pop(name)) for name in list(parts)}
    if not any(columns[name].any() for name in _COLORS if name in columns):  # room for them alone
        for name in _COLORS:
            columns.pop(name, None)
    for name in [name for name in columns if name.lower() not in GEOMETRY]:
        if (columns[name] == columns[name][0]).all():
            del columns[name]
    return named(columns.items())

"""C3D, the format of motion capture: landmarks through time, as points (https://www.c3d.org).

Numbers are float32, the frame rate is one for all; a residual of -1 marks a point that is not there. Names
are the labels of points, up to 255 in each of POINT:LABELS, LABELS2 and so on. The package c3d reads and
writes the parameters and frames.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ....errors import InputError
from ...track import Known
from ..landmark_set import LandmarkNotes, LandmarkSet, check_cells
from ._text import read_bytes, without_states

if TYPE_CHECKING:
    from c3d import Reader

TITLE = "C3D"
SUFFIXES = (".c3d",)

_BLOCK = 512  # bytes
_MAGIC = 80
_MOST_BYTES = 1 << 30
_PER_PARAMETER = 255  # names, as a dimension is a byte
_LONGEST = 120  # bytes of a text, so that 255 of them are less than the 32767 that a parameter may have
_TEXTS = 30_000  # bytes of all names, and of all descriptions: the package has 127 blocks for parameters
_MOST_POINTS = 2500  # whose names then have twelve bytes each
_RATE = 30.0  # frames a second, where no times are known
_EVEN = 1e-3  # frames, by which times may be off even ones
_ROUNDED = 1e-5  # of the extent, by which float32 may be off


def read(path: Path) -> LandmarkSet:
    """All points in all frames. Raises InputError."""
    from c3d import Reader

    data = read_bytes(path, _MOST_BYTES)
    if len(data) < 2 * _BLOCK or data[1] != _MAGIC:
        raise InputError("is not a C3D file, or is not complete")
    with _library():
        reader = Reader(BytesIO(data))
        count, frames, first = int(reader.point_used), int(reader.frame_count), int(reader.first_frame)
        rate, words = float(reader.point_rate), 4 if reader.point_scale < 0 else 2
        analog = int(reader.analog_used) * int(reader.analog_per_frame)
        held = len(data) - (int(reader.header.data_block) - 1) * _BLOCK
    if not count:
        raise InputError("holds no points")
    if frames < 1 or frames * (4 * count + analog) * words > held:
        raise InputError(f"should contain {frames:,} frames of {count:,} points, but ends earlier")
    check_cells(frames, count)
    with _library():
        values = np.stack([points for _, points, _ in reader.read_frames(analog_transform=False)])
    there = (values[..., 3] >= 0) & np.isfinite(values[..., :3]).all(axis=2)
    numbers = np.arange(frames) + max(first, 1) - 1
    labels = _texts(reader, "LABELS", count)
    return LandmarkSet.of(
        labels or [str(number) for number in range(1, count + 1)],
        np.where(there[..., np.newaxis], values[..., :3], np.nan),
        known=np.where(there, Known.PLACED, Known.GAP),
        times=numbers / rate if rate > 0 and np.isfinite(rate) else None,
        frames=numbers,
        notes=LandmarkNotes(
            _unit(reader),
            _texts(reader, "DESCRIPTIONS", count),
            remarks=[] if labels else ["The points in the file have no names, so Scan4D numbers them"],
        ),
    )


@contextmanager
def _library() -> Iterator[None]:
    """The package at work on a file: silent, and whatever it stumbles over is the file's fault."""
    with warnings.catch_warnings(action="ignore"):
        try:
            yield
        except MemoryError:
            raise
        except Exception as error:
            raise InputError(
                f"the parameters or frames of the file are damaged ({error or type(error).__name__})"
            ) from error


def _texts(reader: Reader, name: str, count: int) -> list[str]:
    """The texts of POINT:NAME, NAME2 and so on, one a point; none where these parameters are not there."""
    found: list[str] = []
    for number in range(1, -(-count // _PER_PARAMETER) + 1):
        parameter = reader.get(f"POINT:{name}" + (str(number) if number > 1 else ""))
        if parameter is None or len(parameter.dimensions) != 2:
            break
        width, rows = parameter.dimensions
        if len(parameter.bytes) != width * rows:
            break
        pieces = [parameter.bytes[width * row : width * (row + 1)] for row in range(rows)]
        found += [_decoded(piece) for piece in pieces]
    found = found[:count]
    return [*found, *[""] * (count - len(found))] if found else []


def _decoded(text: bytes) -> str:
    text = text.rstrip(b" \0")
    try:
        return text.decode("utf-8")
    except UnicodeDecodeError:
        return text.decode("latin-1")


def _unit(reader: Reader) -> str | None:
    """The unit of the first point, where each has one, or of all."""
    parameter = reader.get("POINT:UNITS")
    if parameter is None or not parameter.dimensions:
        return None
    return _decoded(parameter.bytes[: parameter.dimensions[0]]).strip()


def write(path: Path, landmarks: LandmarkSet) -> str | None:
    """All frames from the first to the last; what is not defined has the residual -1."""
    from c3d import Writer

    landmarks = landmarks.even_rows()
    count = len(landmarks.names)
    if count > _MOST_POINTS:
        raise InputError(f"C3D files can contain at most {_MOST_POINTS} points", hint="Use .csv")
    rate, is_even = _rate(landmarks)
    longest = min(_LONGEST, _TEXTS // count)
    labels = _labels(landmarks.names, longest)
    writer = Writer(point_rate=rate, point_scale=-1.0)
    writer.set_start_frame(int(landmarks.frames[0]) + 1)
    unit = (landmarks.unit or "").encode()
    writer.point_group.add("UNITS", "Unit of lengths", -1, "", unit, len(unit))
    _add_texts(writer, "LABELS", "Names of the points", labels)
    _add_texts(
        writer, "DESCRIPTIONS", "How to find the points", [_cut(text, longest) for text in landmarks.about]
    )
    writer.add_frames(list(_points(landmarks)))
    with open(path, "wb") as stream, warnings.catch_warnings(action="ignore"):
        writer.write(stream)
    return _remark(landmarks, labels, longest, is_even)


def _points(landmarks: LandmarkSet) -> Iterator[tuple[Any, Any]]:
    there = landmarks.is_defined
    for row in range(len(landmarks)):
        points = np.zeros((len(landmarks.names), 5), np.float32)
        points[:, :3] = np.where(there[row][:, np.newaxis], landmarks.positions[row], 0)
        points[:, 3] = np.where(there[row], 0, -1)
        yield points, np.zeros((0, 0), np.float32)


def _rate(landmarks: LandmarkSet) -> tuple[float, bool]:
    """Frames a second, and whether the times are what these tell: the index of a frame, divided by them."""
    times = landmarks.times
    if not np.isfinite(times).all():
        return _RATE, not np.isfinite(times).any()
    steps = np.diff(times)
    if len(steps):
        rate = 1 / float(np.median(steps)) if np.median(steps) > 0 else _RATE
    else:
        rate = float(landmarks.frames[0] / times[0]) if times[0] > 0 and landmarks.frames[0] else _RATE
    rate = float(np.float32(rate))
    return rate, bool(
        (np.abs(times * rate - landmarks.frames) < _EVEN * np.maximum(landmarks.frames, 1)).all()
    )


def _labels(names: Sequence[str], longest: int) -> list[bytes]:
    """Labels that differ, of so many bytes at most."""
    labels: dict[bytes, None] = {}
    for number, name in enumerate(names, 1):
        label = _cut(name, longest)
        if label in labels:
            ending = f" #{number}".encode()
            label = _cut(name, longest - len(ending)) + ending
        labels[label] = None
    return list(labels)


def _cut(text: str, most: int) -> bytes:
    """The beginning of a text that so many bytes of UTF-8 hold."""
    return text.encode()[:most].decode(errors="ignore").encode()


def _add_texts(writer: Any, name: str, about: str, texts: Sequence[bytes]) -> None:
    for start in range(0, len(texts), _PER_PARAMETER):
        part = texts[start : start + _PER_PARAMETER]
        width = max(1, *map(len, part))
        number = start // _PER_PARAMETER + 1
        key = name if number == 1 else f"{name}{number}"
        data = b"".join(text.ljust(width) for text in part)
        writer.point_group.add(key, about, -1, "", data, width, len(part))


def _remark(landmarks: LandmarkSet, labels: Sequence[bytes], longest: int, is_even: bool) -> str | None:
    """Losses of the file, in words."""
    lost = []
    if any(label.decode() != name for label, name in zip(labels, landmarks.names, strict=True)):
        lost.append(f"Scan4D cuts names after {longest} bytes")
    if not is_even:
        lost.append("C3D stores only a frame rate, so the file gives the frames evenly spaced times from 0 s")
    points = landmarks.positions[landmarks.is_defined]
    if len(points):
        off = np.abs(points.astype(np.float32) - points).max()
        if off > _ROUNDED * max(float(np.ptp(points, axis=0).max()), 1e-300):
            lost.append(f"C3D rounds coordinates by up to {off:.2g}")
    return ". ".join(filter(None, [*lost, without_states(landmarks, TITLE)])) or None

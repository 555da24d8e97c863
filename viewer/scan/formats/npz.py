"""NPZ: NumPy arrays by name.

`positions` of one of the shapes in `viewer/scan/reading/arrays.py`, or an array that other programs call
otherwise, such as `points` or `world_points`; optional `normals` (…, N, 3), `colors` (…, N, 3 or 4) on any
scale, `radii` (…, N), `axes` (…, N, 4) as `PointCloud` has them, further scalars (…, N) by their names,
`origin` (3,) that is to be added to the positions, `viewpoint` (3,), where the scanner stood, `times` (T,) in
seconds or a rate such as `fps`, `faces` (F, 3) whole numbers, which tell the topology of all frames.
Attributes of a sequence may lack T: then all frames share them. Or each frame has arrays of its own, whose
names end in its number. Scan4D passes over arrays of other shapes.
Without `positions`, `depth`, `xyz` or `elevation` make a range view; see `_array_views`.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import BinaryIO
from zipfile import ZIP_DEFLATED, ZIP_STORED, ZipFile, ZipInfo

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from ...errors import InputError, shortened
from ..admission import MOST_MEMBERS, admit, check_count, opened, size_of
from ..contents import Deferred, PointContents
from ..faces import Faces
from ..points import PointCloud, choose_origin
from ..pose import Scanned
from ..reading.arrays import (
    PointArray,
    as_points,
    doubtful_times,
    point_array,
    points_among,
    stated_times,
    states_times,
    without_batch,
)
from ..reading.cloud import assemble, cloud_of, stored_colors
from ..reading.numbered_arrays import ArraysOfFrame, arrays_of_frames
from ..reading.range_arrays import (
    COLORS,
    RangeArrays,
    as_picture,
    image_source,
    range_arrays,
    states_a_camera,
)
from ..reading.sequence import Decided
from ._array_views import colors_of_arrays, unit_of_arrays, view_of_arrays
from ._columns import first_repeated, named
from ._precision import within_decimals
from ._stored import StoredArray, columns_of_array, rows_of_points
from ._topology import with_topology

TITLE = "NPZ"
SUFFIXES = (".npz",)

_OF_POINTS: dict[str, list[tuple[int, ...]]] = {
    "positions": [(3,)],
    "normals": [(3,)],
    "colors": [(3,), (4,)],
    "radii": [()],
    "axes": [(4,)],
}
_OF_VERTICES = ("rgba", "vertex_colors", "point_colors")  # more names of colours beside points
_NORMALS = ("normal", "vertex_normals", "point_normals")
_OF_ALL = {"origin", "times", "viewpoint"}
_FORM = "Name points 'positions', (N, 3), (T, N, 3) or (H, W, 3), and range images 'depth', (H, W)"
_SAVE_ANEW = "Save the arrays with numpy.savez"
_MOST_RATIO, _FREE = 64, 180 << 20  # bytes to unpack for those packed, and beyond: scans pack to a tenth
_ENCRYPTED = 1  # a bit of a member's flags
_MOST_IN_DIRECTORY = 4 * MOST_MEMBERS  # there may be others beside the arrays
_LONGEST_DIRECTORY = 1 << 20  # bytes
# Of the record at the end of an archive, and of that of large ones: how many members, bytes of their names.
_END, _END_64, _LOCATOR_BYTES = struct.Struct("<10xHI6x"), struct.Struct("<32xQQ8x"), 20
_LONGEST_END = (1 << 16) + _END.size + _LOCATOR_BYTES + _END_64.size  # bytes, with a remark
_FACES_AT_ONCE = 1 << 16
_SAMPLE = 1 << 13  # positions looked at
_FAR = 16  # radii of the points from their origin, where float32 still tells a millionth of one


def frame_count(path: Path, decided: Decided) -> int:
    """How many frames the points or the range views have."""
    with opened(path) as stream, _archive(stream) as archive:
        if frames := archive.frames(decided):
            return len(frames)
        arrays = archive.of_frame(0, decided)
        if _axes(arrays):
            return 1
        return found.frames if (found := _images(arrays)) else _points(arrays, decided).frames


def read_unit(path: Path, decided: Decided) -> str | None:
    """The unit of a range view, or None."""
    with opened(path) as stream, _arrays(stream, decided) as arrays:
        return unit_of_arrays(found, size_of(stream), decided) if (found := _images(arrays)) else None


def column_names(path: Path, decided: Decided) -> list[str]:
    """The names of the numbers that each of a list of points has. Raises InputError."""
    with opened(path) as stream, _arrays(stream, decided) as arrays:
        if _images(arrays) is not None or "positions" not in arrays:
            return []
        positions = arrays["positions"]
        if positions.dtype.names is not None:
            return [*positions.dtype.names]
        each = [name for name, array in arrays.items() if array.shape == positions.shape[:1]]
        return each if len(positions.shape) == 2 else []


def read_times(path: Path, decided: Decided) -> NDArray[np.float64] | None:
    """Seconds of the frames, (T,) float64, of an array of times, a rate or a step; or None."""
    with opened(path) as stream, _archive(stream) as archive:
        arrays = archive.of_frame(0, decided)
        if _axes(arrays):
            return None
        frames = len(archive.frames(decided))
        if not frames:
            images = _images(arrays)
            points = None if images else _points(arrays, decided)
            frames = images.frames if images else points.frames if points and points.sequence else 1
            if frames == 1 and images:
                return None
        stated = stated_times(arrays, frames)
        if stated is None:
            return None
        if (doubtful := doubtful_times(*stated)) is not None:
            decided.note(doubtful)
        return stated[0]


def read(path: Path, frame: int, decided: Decided) -> Scanned:
    """One frame; it reads no array that is not needed, and no other frame. Raises InputError."""
    with opened(path) as stream, _arrays(stream, decided, frame) as arrays:
        if axes := _axes(arrays):
            return assemble(_columns(arrays, axes, size_of(stream)), decided)
        if (images := _images(arrays)) is not None:
            return (view_of_arrays(images, size_of(stream), frame, decided),)
        points, held, array = _points(arrays, decided), size_of(stream), arrays["positions"]
        if array.dtype.names is not None or array.shape[-1] != 3:
            entry = frame if points.sequence else None
            admit(held, array.memory(entry))
            return assemble(columns_of_array(array.read(entry), held, decided), decided)
        shares = _shares(arrays, points, frame)
        _note_unused(arrays, shares, decided)
        share = shares.pop("positions")
        admit(held, array.memory(share))
        positions = [rows_of_points(array.read(share))]
        shift, origin = None, None
        if "origin" in arrays:
            stored = _vector(arrays["origin"], 3)
            shift, origin = _shifted(positions[0], stored)

        def rows(array: StoredArray, share: int | None) -> NDArray:
            values = array.read(share)
            return values.reshape(points.count, *values.shape[len(points.grid) :]) if points.grid else values

        values = {
            name: Deferred(partial(rows, array, share), array.dtype, width)
            for name, share in shares.items()
            for array in [arrays[name]]
            for width in [array.memory(share) // (points.count * array.dtype.itemsize)]
        }
        attributes = {name: values.pop(name) for name in _OF_POINTS if name in values}
        cloud = cloud_of(positions, attributes, values, shift, held, decided=decided)
        if origin is not None:
            cloud = replace(cloud, origin=origin)
        if "viewpoint" in arrays and arrays["viewpoint"].shape == (3,):
            cloud = replace(cloud, viewpoint=_vector(arrays["viewpoint"], 3))
        return with_topology(cloud, _faces(arrays, held, cloud.nbytes))


def read_colors(path: Path, frame: int, decided: Decided) -> NDArray | None:
    """The colours of a frame as stored, (N, C), or None. Raises InputError."""
    with opened(path) as stream, _arrays(stream, decided, frame) as arrays:
        held = size_of(stream)
        if axes := _axes(arrays):
            return stored_colors(_columns(arrays, axes, held))
        if (images := _images(arrays)) is not None:
            return colors_of_arrays(images, frame)
        points, array = _points(arrays, decided), arrays["positions"]
        if array.dtype.names is not None or array.shape[-1] != 3:
            entry = frame if points.sequence else None
            admit(held, array.memory(entry))
            return stored_colors(columns_of_array(array.read(entry), held, decided))
        shares = _shares(arrays, points, frame)
        if "colors" not in shares:
            return None
        stored = arrays["colors"]
        admit(held, stored.memory(shares["colors"]))
        return stored.read(shares["colors"]).reshape(points.count, -1)


def read_faces(path: Path, frame: int = 0, decided: Decided | None = None) -> Iterator[Faces]:
    """The triangles of the array `faces`, in pieces; none where it has another shape. Raises InputError."""
    with opened(path) as stream, _arrays(stream, decided or Decided(), frame) as arrays:
        yield from _faces(arrays, size_of(stream))


def read_arrays(path: Path, *names: str) -> list[NDArray]:
    """Some arrays of an archive by name, whatever they hold. Raises InputError where one is not there."""
    with opened(path) as stream, _archive(stream) as archive:
        arrays = {name: archive.array(name) for name in archive.members}
        if missing := [name for name in names if name not in arrays]:
            raise InputError(f"has no array '{missing[0]}', only: {', '.join(arrays) or 'none'}")
        admit(size_of(stream), sum(arrays[name].memory() for name in names))
        return [arrays[name].read() for name in names]


def _shifted(
    positions: NDArray, stored: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The move, (3,), of the stored origin with which float32 holds offsets from it, and where to.

    One that the positions are near to stays as it is.
    """
    sample = PointCloud.from_arrays(positions[:: max(1, len(positions) // _SAMPLE)])
    if len(sample):
        bounds = sample.bounds()
        if np.abs(bounds.center).max() > _FAR * bounds.radius:
            origin = choose_origin(sample.world() + stored)
            return origin - stored, origin
    return np.zeros(3), stored


def write(path: Path, cloud: PointCloud) -> None:
    """Write everything but the ids, unpacked for speed; positions as offsets from an origin, float64 where
    float32 is not enough."""
    positions: NDArray[np.floating] = cloud.positions
    if cloud.remainders is not None and not within_decimals(np.abs(cloud.remainders), cloud.world()):
        positions = cloud.positions + cloud.remainders.astype(np.float64)
    arrays = dict(cloud.scalars) | {
        "positions": positions,
        "origin": cloud.origin,
        "normals": cloud.normals,
        "colors": cloud.colors,
        "radii": cloud.radii,
        "axes": cloud.axes,
        "viewpoint": cloud.viewpoint,
    }
    with ZipFile(path, "w", ZIP_STORED) as archive:
        for name, array in arrays.items():
            if array is not None:
                with archive.open(f"{name}.npy", "w", force_zip64=True) as stream:
                    npy.write_array(stream, np.asarray(array), allow_pickle=False)


@dataclass(frozen=True)
class _Archive:
    """The arrays of an open file. members: by the names of arrays."""

    archive: ZipFile
    members: dict[str, ZipInfo]
    streams: ExitStack

    def array(self, name: str) -> StoredArray:
        """An array whose header this reads. Raises InputError."""
        member = self.members[name]
        stream = self.streams.enter_context(self.archive.open(member))
        return StoredArray.open(name, stream, member.file_size)

    def frames(self, decided: Decided) -> list[ArraysOfFrame]:
        """The arrays of each frame where each has its own; [] where none has. Raises InputError."""
        names = [*self.members]
        return decided.shared("arrays", names, lambda: arrays_of_frames(names, self.array, decided))

    def of_frame(self, frame: int, decided: Decided) -> dict[str, StoredArray]:
        """The arrays that a frame may use, as `_with_positions` names them. Raises InputError."""
        frames = self.frames(decided)
        chosen = frames[frame] if frames else {name: name for name in self.members}
        arrays = {called: self.array(name) for called, name in chosen.items()}
        return _with_positions(without_batch(arrays), decided)


@contextmanager
def _archive(stream: BinaryIO) -> Iterator[_Archive]:
    """The arrays of a file, open as long as the context lasts. Raises InputError."""
    _check_directory(stream)
    with ZipFile(stream) as archive, ExitStack() as streams:
        infos = [info for info in archive.infolist() if info.filename.endswith(".npy")]
        _check_members(infos, size_of(stream))
        members = {info.filename.removesuffix(".npy"): info for info in infos}
        yield _Archive(archive, members, streams)


@contextmanager
def _arrays(stream: BinaryIO, decided: Decided, frame: int = 0) -> Iterator[dict[str, StoredArray]]:
    """The arrays of a frame by name, open as long as the context lasts."""
    with _archive(stream) as archive:
        yield archive.of_frame(frame, decided)


def _with_positions(arrays: dict[str, StoredArray], decided: Decided) -> dict[str, StoredArray]:
    """The arrays, of which that of the points is `positions`, and its colours `colors`. Where the file holds
    depth with its camera as well, or nothing but range images, they stay as they are."""
    called = points_among(arrays)
    if called is None:
        return arrays
    source = image_source(arrays)
    if called != "positions" and source is not None and (source == called or states_a_camera(arrays)):
        return arrays
    positions = as_points(arrays.pop(called), decided)
    for role, names in (("colors", (*COLORS, *_OF_VERTICES)), ("normals", _NORMALS)):
        if role in arrays or positions.dtype.names is not None:
            continue
        pictures = {name: as_picture(array) for name, array in arrays.items() if name.lower() in names}
        alike = [name for name, array in pictures.items() if array.shape[:-1] == positions.shape[:-1]]
        if alike:
            del arrays[alike[0]]
            arrays[role] = pictures[alike[0]]
    return arrays | {"positions": positions}


def _check_directory(stream: BinaryIO) -> None:
    """Raise InputError where an archive promises far more members than arrays, before any is looked at.

    The bytes of the directory count too, since they tell where reading it ends.
    """
    stream.seek(max(0, size_of(stream) - _LONGEST_END))
    end = stream.read()
    at = end.rfind(b"PK\5\6")
    if at < 0 or len(end) - at < _END.size:
        return  # no archive, as ZipFile says
    counts = [_END.unpack_from(end, at)]
    locator = at - _LOCATOR_BYTES
    if locator >= _END_64.size and end[locator:].startswith(b"PK\6\7"):
        counts.append(_END_64.unpack_from(end, locator - _END_64.size))
    members, directory = counts[-1]
    check_count(members, _MOST_IN_DIRECTORY, "members")
    check_count(directory, _LONGEST_DIRECTORY, "bytes of names")


def _check_members(infos: Sequence[ZipInfo], held: int) -> None:
    """Raise InputError where an archive of `held` bytes is not as numpy writes it."""
    check_count(len(infos), MOST_MEMBERS, "arrays")
    if twice := first_repeated(info.filename for info in infos):
        raise InputError(f"two arrays have the name '{twice}'", hint=_SAVE_ANEW)
    for info in infos:
        if info.compress_type not in (ZIP_STORED, ZIP_DEFLATED) or info.flag_bits & _ENCRYPTED:
            raise InputError(
                f"'{info.filename}' is encrypted, or compressed in a way that numpy does not use",
                hint=_SAVE_ANEW,
            )
    unpacked = sum(info.file_size for info in infos)
    if unpacked > _FREE + _MOST_RATIO * held:
        raise InputError(
            f"the {held} bytes of the file would unpack to {unpacked} bytes, which is suspiciously much",
            hint=_SAVE_ANEW,
        )


def _shares(arrays: dict[str, StoredArray], points: PointArray, frame: int) -> dict[str, int | None]:
    """The arrays of points, and which entry of each belongs to the frame; None: all of it is shared.

    Raises InputError where a reserved name has another shape than the positions ask for.
    """
    sequence = points.sequence
    forms = [(points.count,), *([points.grid] if points.grid else [])]
    shares: dict[str, int | None] = {}
    for name, array in arrays.items():
        shapes = [(*form, *tail) for form in forms for tail in _OF_POINTS.get(name, [()])]
        if array.shape in shapes:
            share = None
        elif sequence and array.shape in [(*sequence, *shape) for shape in shapes]:
            share = frame
        elif name in _OF_POINTS:
            raise InputError(f"array '{name}' has shape {array.shape}, expected {shapes[-1]}")
        else:
            continue
        if name in _OF_POINTS or (name not in _OF_ALL and array.dtype.kind in "fiub"):
            shares[name] = share
    return shares


def _axes(arrays: dict[str, StoredArray]) -> list[str]:
    """The names of the columns of points whose x, y and z are arrays of their own; [] without these."""
    axes = [array for name, array in arrays.items() if name.lower() in ("x", "y", "z")]
    shape = axes[0].shape if axes else ()
    fits = len(axes) == 3 and 0 not in shape and all(array.shape == shape for array in axes)
    if not (fits and shape) or "positions" in arrays or image_source(arrays):
        return []
    return [name for name, array in arrays.items() if array.shape == shape and array.dtype.kind in "fiub"]


def _columns(arrays: dict[str, StoredArray], names: Sequence[str], held: int) -> PointContents:
    """The columns of points by the names of their arrays. Raises InputError."""
    admit(held, sum(arrays[name].memory() for name in names))
    return PointContents(columns=named((name, arrays[name].read().ravel()) for name in names), held=held)


def _note_unused(arrays: dict[str, StoredArray], used: Iterable[str], decided: Decided) -> None:
    """Put into the record which arrays no frame uses."""
    known = {*used, *_OF_ALL, "faces"}
    for name, array in arrays.items():
        if array.shape and name not in known and not states_times(name):
            decided.note_unused(f"array {name} {array.shape}")


def _images(arrays: dict[str, StoredArray]) -> RangeArrays | None:
    """The range images of an archive without points, None where it has none. Raises InputError."""
    return None if "positions" in arrays else range_arrays(arrays)


def _points(arrays: dict[str, StoredArray], decided: Decided) -> PointArray:
    """Decide what the array of points is. Raises InputError where there is none."""
    if "positions" not in arrays:
        there = ", ".join(f"{name} {array.shape}" for name, array in arrays.items())
        raise InputError(f"has no array of points, only: {shortened(there) or 'none'}", hint=_FORM)
    array = arrays["positions"]
    return point_array(array, array.first, decided, arrays)


def _faces(arrays: dict[str, StoredArray], held: int, held_before: int = 0) -> Iterator[Faces]:
    """The triangles of a file of `held` bytes, beside `held_before` bytes in memory."""
    faces = arrays.get("faces")
    if faces and len(faces.shape) == 2 and faces.shape[1] == 3 and faces.dtype.kind in "iu":
        admit(held, held_before + faces.memory())
        corners = faces.read()
        for start in range(0, len(corners), _FACES_AT_ONCE):
            yield Faces.of(corners[start : start + _FACES_AT_ONCE])


def _vector(array: StoredArray, length: int) -> NDArray[np.float64]:
    fits = array.shape == (length,) and array.dtype.kind in "fiu"
    if not (fits and np.isfinite(values := array.read()).all()):
        raise InputError(f"array '{array.name}' is not {length} finite numbers")
    return values.astype(np.float64)

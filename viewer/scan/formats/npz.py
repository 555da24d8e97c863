"""NPZ: NumPy arrays by name.

`positions` (N, 3), or (T, N, 3) for a sequence; optional `normals` (…, N, 3), `colors` (…, N, 3 or 4)
uint8 or float in 0..1, `radii` (…, N), `axes` (…, N, 4) as `PointCloud` has them, further scalars (…, N)
by their names, `origin` (3,) that is to be added to the positions, `times` (T,) in seconds, `faces` (F, 3)
whole numbers, which tell the topology of all frames. Attributes of a sequence may lack T: then all frames
share them. Arrays of other shapes are left alone.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from zipfile import ZIP_STORED, ZipFile

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from ...errors import InputError
from ..points import PointCloud
from ._faces import with_faces
from ._packed import check_unpacked_size
from ._stored import StoredArray

TITLE = "NPZ"
SUFFIXES = (".npz",)

_RESERVED = {"positions", "normals", "colors", "radii", "axes", "origin", "times"}
_MOST_RATIO = 250  # of unpacked to packed: scans pack to a half or a tenth


def frame_count(path: Path) -> int:
    """T of (T, N, 3) positions, else 1."""
    with _arrays(path) as arrays:
        return math.prod(_positions(arrays).sequence)


def read_times(path: Path) -> NDArray[np.float64] | None:
    """The array `times`, (T,) float64 seconds, or None."""
    with _arrays(path) as arrays:
        sequence = _positions(arrays).sequence
        return _vector(arrays["times"], *sequence) if sequence and "times" in arrays else None


def read(path: Path, frame: int = 0) -> PointCloud:
    """One frame; arrays that are not needed and other frames are not kept. Raises InputError."""
    with _arrays(path) as arrays:
        positions = _positions(arrays)
        count = positions.shape[-2]
        sequence = positions.sequence

        def of_points(name: str, *tails: tuple[int, ...]) -> NDArray | None:
            """The frame's share of an array, whose entries for a point have one of the shapes `tails`."""
            if name not in arrays:
                return None
            shapes = [(count, *tail) for tail in tails]
            if arrays[name].shape in shapes:
                return arrays[name].read()
            if sequence and arrays[name].shape in [(*sequence, *shape) for shape in shapes]:
                return arrays[name].read(frame)
            raise InputError(f"array '{name}' has shape {arrays[name].shape}, expected {shapes[-1]}")

        scalars = {
            name: array.read(None if array.shape == (count,) else frame)
            for name, array in arrays.items()
            if name not in _RESERVED
            and array.dtype.kind in "fiub"
            and array.shape in ((count,), (*sequence, count))
        }
        cloud = PointCloud.from_arrays(
            positions.read(frame if sequence else None),
            normals=of_points("normals", (3,)),
            colors=of_points("colors", (3,), (4,)),
            radii=of_points("radii", ()),
            axes=of_points("axes", (4,)),
            scalars=scalars,
            origin=np.zeros(3) if "origin" in arrays else None,
        )
        if "origin" in arrays:
            cloud = replace(cloud, origin=_vector(arrays["origin"], 3))
        return with_faces(cloud, _faces(arrays))


def write(path: Path, cloud: PointCloud) -> None:
    """Write everything but the ids, as it is in memory, unpacked for speed."""
    arrays = dict(cloud.scalars) | {
        "positions": cloud.positions,
        "origin": cloud.origin,
        "normals": cloud.normals,
        "colors": cloud.colors,
        "radii": cloud.radii,
        "axes": cloud.axes,
    }
    with ZipFile(path, "w", ZIP_STORED) as archive:
        for name, array in arrays.items():
            if array is not None:
                with archive.open(f"{name}.npy", "w", force_zip64=True) as stream:
                    npy.write_array(stream, np.asarray(array), allow_pickle=False)


@contextmanager
def _arrays(path: Path) -> Iterator[dict[str, StoredArray]]:
    """All arrays of the archive by name, open as long as the context lasts."""
    with ZipFile(path) as archive, ExitStack() as streams:
        members = [member for member in archive.infolist() if member.filename.endswith(".npy")]
        unpacked = sum(member.file_size for member in members)
        check_unpacked_size(path, unpacked, _MOST_RATIO, "Save it with numpy.savez")
        yield {
            name: StoredArray.open(name, streams.enter_context(archive.open(member)), member.file_size)
            for member in members
            for name in [member.filename.removesuffix(".npy")]
        }


def _positions(arrays: dict[str, StoredArray]) -> StoredArray:
    if "positions" not in arrays:
        found = f"has no array 'positions', only: {', '.join(arrays) or 'none'}"
        raise InputError(found, hint="Name the points 'positions', (N, 3) or (T, N, 3)")
    return arrays["positions"]


def _faces(arrays: dict[str, StoredArray]) -> Iterator[bytes]:
    faces = arrays.get("faces")
    if faces and len(faces.shape) == 2 and faces.shape[1] == 3 and faces.dtype.kind in "iu":
        yield faces.read().tobytes()


def _vector(array: StoredArray, length: int) -> NDArray[np.float64]:
    values = array.read()
    if values.shape != (length,) or values.dtype.kind not in "fiu" or not np.isfinite(values).all():
        raise InputError(f"array '{array.name}' is not {length} finite numbers")
    return values.astype(np.float64)

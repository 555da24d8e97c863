"""NPY: one NumPy array of points.

(N, 3), or (N, C) with more columns, or (N,) of fields; (T, N, 3) for a sequence; (H, W, 3) for an organised
cloud, (S, H, W, 3) for a sequence of these. See `viewer/scan/reading/arrays.py`.
"""

from __future__ import annotations

from pathlib import Path

from numpy.typing import NDArray

from ..admission import admit, opened, size_of
from ..points import PointCloud
from ..reading.arrays import as_points, point_array
from ..reading.cloud import assemble, cloud_of, stored_colors
from ..reading.sequence import Decided
from ._stored import StoredArray, columns_of_array, rows_of_points

TITLE = "NPY"
SUFFIXES = (".npy",)


def frame_count(path: Path, decided: Decided) -> int:
    """How many frames the array holds."""
    with opened(path) as stream:
        array = as_points(StoredArray.open("positions", stream, size_of(stream)), decided)
        return point_array(array, array.first, decided).frames


def column_names(path: Path) -> list[str]:
    """The names of the fields of a point, none where it has none."""
    with opened(path) as stream:
        return [*(StoredArray.open("positions", stream, size_of(stream)).dtype.names or ())]


def read(path: Path, frame: int, decided: Decided) -> PointCloud:
    """One frame of the points; the other frames are not read. Raises InputError."""
    with opened(path) as stream:
        held = size_of(stream)
        array = as_points(StoredArray.open("positions", stream, held), decided)
        what = point_array(array, array.first, decided)
        share = frame if what.sequence else None
        admit(held, array.memory(share))
        if array.dtype.names is not None or array.shape[-1] != 3:
            return assemble(columns_of_array(array.read(share), held, decided), decided)
        return cloud_of([rows_of_points(array.read(share))], {}, {}, held=held, decided=decided)


def read_colors(path: Path, frame: int, decided: Decided) -> NDArray | None:
    """The colours among columns as stored, (N, C), or None. Raises InputError."""
    with opened(path) as stream:
        held = size_of(stream)
        array = StoredArray.open("positions", stream, held)
        if array.dtype.names is None and array.shape[-1] == 3:
            return None
        share = frame if point_array(array, array.first, decided).sequence else None
        admit(held, array.memory(share))
        return stored_colors(columns_of_array(array.read(share), held, decided))

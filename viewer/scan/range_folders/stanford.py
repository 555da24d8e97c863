"""Stanford's laser scans: grids of points, and a .conf file that places them around their subject.

A line of the .conf file is `bmesh`, a file, a translation t and a quaternion x y z w. With R the rotation of
that quaternion, a point p of the scan is at transpose(R) p + t. All scans together are one pose. A scan is
a PLY file with a range grid, or an NPZ file of its name with the array `xyz` (rows, columns, 3): the lowest
row first, x to the right, y up, z towards the scanner.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError, shortened
from ...files import named_inside
from ...rigid import rigid_matrix
from ..admission import check_count
from ..formats.npz import read_arrays
from ..formats.ply import read_range_grid
from ..grids import view_of_grid
from ..image_poses import rotation_of
from ..range_view import RangeView
from ._source import MOST_VIEWS, RangeFrames
from ._texts import text_of

TITLE = "Stanford's laser scans"

_SCAN = "bmesh"
_UNIT = "m"


def find(folder: Path, names: Sequence[str]) -> RangeFrames | None:
    """The scans that the folder's .conf file names, as one frame; None where there is no such file."""
    found = {name: lines for name in names if name.endswith(".conf") if (lines := _lines(folder / name))}
    if not found:
        return None
    if len(found) > 1:
        raise InputError(f"contains several files with the positions of scans: {', '.join(found)}")
    (conf, lines) = found.popitem()
    check_count(len(lines), MOST_VIEWS, "scans to place")
    placed = [_placement(folder / conf, line) for line in lines]
    files = tuple(_file(named_inside(folder, name, folder / conf)) for name, _ in placed)
    if missing := [file.name for file in files if not file.is_file()]:
        raise InputError(f"{missing[0]} is missing, which {conf} lists", folder)
    read = partial(_read, [(file, to_scan) for file, (_, to_scan) in zip(files, placed, strict=True)])
    return RangeFrames(folder.resolve().name, (conf,), read, (*files, folder / conf), _UNIT)


def _lines(conf: Path) -> list[str]:
    """The lines that place scans; none where the file has none."""
    with suppress(InputError):  # it is of something else
        return [line for line in text_of(conf).splitlines() if line.split()[:1] == [_SCAN]]
    return []


def _placement(conf: Path, line: str) -> tuple[str, NDArray[np.float64]]:
    """The file of a scan, and the matrix (4, 4) from the world to it."""
    try:
        _, name, *words = line.split()
        numbers = np.array(words, np.float64)
    except ValueError:
        numbers = np.empty(0)
    if numbers.shape != (7,) or not np.isfinite(numbers).all():
        hint = f"Each line is {_SCAN}, a file name and 7 numbers: a translation and a quaternion x y z w"
        raise InputError(f"'{shortened(line)}' does not describe a scan", conf, hint)
    rotation = rotation_of(numbers[3:])
    return name, rigid_matrix(rotation, -rotation @ numbers[:3])


def _file(named: Path) -> Path:
    as_arrays = named.with_suffix(".npz")
    return as_arrays if as_arrays.is_file() else named


def _read(scans: Sequence[tuple[Path, NDArray[np.float64]]], _: int) -> Iterator[RangeView]:
    return (_view(file, to_scan) for file, to_scan in scans)


def _view(file: Path, to_scan: NDArray[np.float64]) -> RangeView:
    try:
        grid = read_arrays(file, "xyz")[0] if file.suffix == ".npz" else read_range_grid(file)
        if grid.ndim != 3 or grid.shape[2] != 3 or grid.dtype.kind != "f":
            raise InputError(f"array 'xyz' is {grid.shape} {grid.dtype}, expected (rows, columns, 3) floats")
        return view_of_grid(grid[::-1], to_scan, file.stem, _UNIT)
    except InputError as error:
        raise InputError(error.what, error.where or file, error.hint) from error

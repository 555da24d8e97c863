"""Points from what a file says: its columns get their roles, and become a PointCloud one after the other.

Few arrays are held beside what they become.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from itertools import chain

import numpy as np
from numpy.lib.stride_tricks import as_strided
from numpy.typing import NDArray

from ...errors import InputError
from ..admission import admit
from ..contents import Deferred, PointContents
from ..points import PointCloud, choose_origin, finite_rows
from .record import Decision, Source
from .sequence import Decided

_AT_ONCE = 1 << 18  # points worked on together, so that no second table of them is needed

# What the columns of a file may be called, in lower case; the first set that is complete is taken.
_POSITIONS = [("x", "y", "z")]
_NORMALS = [("nx", "ny", "nz"), ("normal_x", "normal_y", "normal_z")]
_COLORS = [
    ("red", "green", "blue", "alpha"),
    ("red", "green", "blue"),
    ("r", "g", "b", "a"),
    ("r", "g", "b"),
    ("diffuse_red", "diffuse_green", "diffuse_blue", "diffuse_alpha"),
    ("diffuse_red", "diffuse_green", "diffuse_blue"),
]
_RADII = [("radius",), ("surfel_radius",)]
ELLIPSES = ("radius_u", "radius_v", "tangent_x", "tangent_y", "tangent_z")
GEOMETRY = {"rgb", "rgba", *chain(*_POSITIONS, *_NORMALS, *_COLORS, *_RADII, ELLIPSES)}

_FINAL = {"normals": 12, "colors": 4, "radii": 4}  # bytes of a point in a PointCloud
_WORK = 20 << 20  # bytes of the points that are worked on together
_SPLAT = 20  # bytes of a half-axis and its radius
_IDS, _ID = 12, 4  # bytes of a point's number while it is found, and then


def assemble(contents: PointContents, decided: Decided) -> PointCloud:
    """Points from named columns; names count in any case, what is not geometry becomes a scalar.

    Notes which columns are what. Raises InputError where x, y or z is missing, and where all that takes too
    much memory.
    """
    columns = _by_role(contents, decided)
    names = {name.lower(): name for name in columns}

    def found(choices: Sequence[Sequence[str]]) -> list[str]:
        complete = (choice for choice in choices if all(name in names for name in choice))
        return [names[name] for name in next(complete, ())]

    def take(chosen: Sequence[str]) -> NDArray:
        return _joined([np.asarray(columns.pop(name)) for name in chosen])

    def native(name: str) -> NDArray:
        column = np.asarray(columns.pop(name))
        return column.astype(column.dtype.newbyteorder("="), copy=False)

    chosen = found(_POSITIONS)
    if not chosen:
        raise InputError(f"no x, y and z among the columns: {listed(columns)}")
    normals, colors, radii, ellipses = (found(choices) for choices in (_NORMALS, _COLORS, _RADII, [ELLIPSES]))
    normals, colors = (
        [] if _is_left_out(key, names, columns, decided) else names
        for key, names in (("normals", normals), ("colors", colors))
    )
    attributes: dict[str, Deferred] = {}
    if normals:
        attributes["normals"] = Deferred(lambda: take(normals), columns[normals[0]].dtype, 3)
    if colors:
        kind = columns[colors[0]].dtype
        attributes["colors"] = Deferred(lambda: _scaled(take(colors), decided), kind, len(colors))
    if radii:
        attributes["radii"] = Deferred(lambda: take(radii)[:, 0], columns[radii[0]].dtype)
    positions = [take(chosen)]
    if ellipses:
        axes, mean = _half_axes(take(ellipses))
        attributes.setdefault("radii", Deferred(lambda: mean, mean.dtype))
        attributes["axes"] = Deferred(lambda: axes, axes.dtype, 4)
    rest = columns.keys() - {*normals, *colors, *radii}
    scalars = {name: Deferred(partial(native, name), columns[name].dtype) for name in columns if name in rest}
    return cloud_of(positions, attributes, scalars, held=contents.held, at_hand=True)


def listed(names: Iterable[str], most: int = 12, longest: int = 24) -> str:
    """Names of a file for a message: some of them, shortened where they are long."""
    names = list(names)
    shown = [name if len(name) <= longest else name[:longest] + "..." for name in names[:most]]
    return ", ".join([*shown, f"and {len(names) - most} more"] if len(names) > most else shown) or "none"


def _by_role(contents: PointContents, decided: Decided) -> dict[str, NDArray]:
    """The columns by what they are: as the user says, else as the file or its reader names them."""
    columns = contents.columns
    stated = decided.corrections.get("columns")
    if stated is None:
        source: Source = "file" if contents.is_named else "assumed"
        decided.note(Decision("columns", list(columns), source, changes_numbers=True))
        return columns
    if len(stated) != len(columns):
        what = f"--read columns has {len(stated)} roles, but the file has {len(columns)} columns"
        raise InputError(what, hint=f"Its columns: {listed(columns)}")
    decided.note(Decision("columns", list(stated), "user", "--read"))
    by_role = {role: columns.pop(name) for role, name in zip(stated, list(columns), strict=True)}
    by_role.pop("-", None)
    return by_role


def _is_left_out(key: str, found: list[str], columns: dict[str, NDArray], decided: Decided) -> bool:
    """Whether the user has Scan4D leave out these columns, which then go."""
    if not found:
        return False
    if decided.corrections.get(key) != "none":
        if key == "normals":
            decided.note(decided.corrections.decision(key) or Decision(key, "stored"))
        return False
    decided.note(Decision(key, "none", "user", "--read"))
    for name in found:
        del columns[name]
    return True


def _scaled(colors: NDArray, decided: Decided) -> NDArray:
    """Colours as PointCloud takes them; notes the largest value that they can have."""
    made = _bytes_or_units(colors)
    full = 65535 if made.dtype == np.uint16 else 255 if made.dtype.kind == "u" else 1
    decided.note(Decision("colors", full, "file" if colors.dtype == np.uint8 else "assumed"))
    return made


def cloud_of(
    positions: list[NDArray],
    attributes: Mapping[str, Deferred],
    scalars: Mapping[str, Deferred],
    origin: NDArray[np.float64] | None = None,
    held: int | None = None,
    at_hand: bool = False,
) -> PointCloud:
    """`PointCloud.from_arrays` of deferred arrays.

    positions: (N, 3), alone in a list that gives it away. held: bytes of the file, which has to admit what
    that takes; None: its rows are not packed. at_hand: whether what the others are made of is in memory.
    Raises InputError.
    """
    if held is not None:
        admit(held, _memory(positions[0], attributes, scalars, origin, at_hand))
    points = Deferred(positions.pop, positions[0].dtype, 3)
    return PointCloud.from_arrays(
        points, **attributes, scalars=scalars, origin=origin, precise=True, unmeasured=None
    )


def _memory(
    points: NDArray,
    attributes: Mapping[str, Deferred],
    scalars: Mapping[str, Deferred],
    origin: NDArray[np.float64] | None,
    at_hand: bool,
) -> int:
    """Bytes that are held at most at a time, step by step as `PointCloud.from_arrays` goes."""
    rows, finite = len(points), finite_rows(points)
    retained = rows if finite is None else int(np.count_nonzero(finite))
    moved = points.dtype != np.float32 or (
        finite is not None or bool(choose_origin(points).any()) if origin is None else bool(origin.any())
    )

    def taken(array: Deferred) -> tuple[int, int]:
        made, freed = rows * array.size, rows * array.size if at_hand else 0
        return (
            (made, made - freed)
            if finite is None
            else (made + retained * array.size, retained * array.size - freed)
        )

    steps = [taken(array) for array in attributes.values()]  # bytes meanwhile, and then
    if finite is not None:
        steps.append((retained * points.itemsize * 3, (retained - rows) * points.itemsize * 3))
    if "axes" in attributes:
        steps.append((retained * _SPLAT, retained * _SPLAT))
    beyond = points.dtype != np.float32  # what float32 offsets do not hold
    steps.append((retained * 12 * (moved + beyond),) * 2)
    for name, size in _FINAL.items():
        if name in attributes and (name == "colors" or attributes[name].dtype != np.float32):
            steps.append((retained * size,) * 2)
    steps += [taken(array) for array in scalars.values()]
    if finite is not None:
        steps.append((retained * _IDS, retained * _ID))
    held = points.nbytes + (0 if finite is None else rows)
    if at_hand:
        held += rows * sum(array.size for array in [*attributes.values(), *scalars.values()])
    peak = held
    for meanwhile, then in steps:
        peak, held = max(peak, held + meanwhile), held + then
    return peak + _WORK


def _joined(columns: Sequence[NDArray]) -> NDArray:
    """(N, C) from C columns, without a copy where they lie side by side in one record."""
    first = columns[0]
    start, step = _address(first), first.itemsize
    side_by_side = all(
        (column.dtype, column.strides, _address(column)) == (first.dtype, first.strides, start + i * step)
        for i, column in enumerate(columns)
    )
    if side_by_side:
        return as_strided(first, (len(first), len(columns)), (first.strides[0], step), writeable=False)
    return np.stack(columns, axis=1)


def _address(array: NDArray) -> int:
    return array.__array_interface__["data"][0]


def _bytes_or_units(colors: NDArray) -> NDArray:
    """Colours as PointCloud takes them. Floats beyond 1 and small uint16 count in 0..255."""
    if colors.dtype.kind == "f" and np.nanmax(colors, initial=0) > 1:
        return _in_bytes(colors)
    if colors.dtype == np.uint16 and colors.max(initial=0) <= 255:
        return colors.astype(np.uint8)
    return colors


def _in_bytes(colors: NDArray) -> NDArray[np.uint8]:
    """Floats in 0..255 rounded; NaN: 0."""
    rounded = np.empty(colors.shape, np.uint8)
    for start in range(0, len(colors), _AT_ONCE):
        part = colors[start : start + _AT_ONCE]
        rounded[start : start + _AT_ONCE] = np.rint(np.clip(np.nan_to_num(part), 0, 255))
    return rounded


def _half_axes(ellipses: NDArray) -> tuple[NDArray, NDArray]:
    """Half-axes as PointCloud takes them, and radii of circles of the same area, from columns of ELLIPSES.

    Tangents have any length; where one has none, neither has the half-axis.
    """
    dtype = np.result_type(ellipses.dtype, np.float32)
    axes, mean = np.empty((len(ellipses), 4), dtype), np.empty(len(ellipses), dtype)
    for start in range(0, len(ellipses), _AT_ONCE):
        rows = slice(start, start + _AT_ONCE)
        numbers = ellipses[rows].astype(dtype)
        lengths = np.where(numbers[:, :2] > 0, numbers[:, :2], 0)
        with np.errstate(over="ignore", invalid="ignore"):
            tangent_length = np.linalg.norm(numbers[:, 2:], axis=1, keepdims=True)
            unit = numbers[:, 2:] / np.where(tangent_length > 0, tangent_length, 1)
            axes[rows] = np.hstack([lengths[:, :1] * unit, lengths[:, 1:]])
            mean[rows] = np.sqrt(lengths.prod(axis=1))
    return axes, mean

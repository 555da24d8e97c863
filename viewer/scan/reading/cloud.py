"""Points from what a file says: its columns get their roles, and become a PointCloud one after the other.

Few arrays are held beside what they become.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import chain

import numpy as np
from numpy.lib.stride_tricks import as_strided
from numpy.typing import NDArray

from ...errors import InputError
from ..admission import admit
from ..colors import rgba8
from ..contents import Column, Deferred, PointContents
from ..points import PointCloud, choose_origin, retained_rows
from . import axes, colors, missing, splats, unit
from .normals import with_usable_normals
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
    decided.note(axes.decide(contents.remarks, decided.corrections))
    unit.note_in_frame(contents, decided)

    def native(name: str) -> NDArray:
        column = np.asarray(columns.pop(name))
        return column.astype(column.dtype.newbyteorder("="), copy=False)

    chosen = _complete(_POSITIONS, columns)
    if not chosen:
        raise InputError(f"the columns do not include x, y and z: {listed(columns)}")
    positions = [_taken(columns, chosen)]
    attributes = _splats(columns, positions[0], decided) or _attributes(columns)
    used = [name for choices in (_NORMALS, _COLORS, _RADII) for name in _complete(choices, columns)]
    scalars = {
        name: Deferred(partial(native, name), columns[name].dtype) for name in columns if name not in used
    }
    cloud = cloud_of(positions, attributes, scalars, held=contents.held, at_hand=True, decided=decided)
    sensor = contents.stated.viewpoint
    return replace(
        cloud, topology=contents.topology, viewpoint=None if sensor is None else sensor[:3, 3].copy()
    )


def _attributes(columns: dict[str, NDArray]) -> dict[str, Deferred]:
    """Normals, colours, radii and half-axes of the columns that have these names, taken when asked for."""
    normals, colors, radii, ellipses = (
        _complete(choices, columns) for choices in (_NORMALS, _COLORS, _RADII, [ELLIPSES])
    )
    attributes: dict[str, Deferred] = {}
    if normals:
        attributes["normals"] = Deferred(lambda: _taken(columns, normals), columns[normals[0]].dtype, 3)
    if colors:
        attributes["colors"] = Deferred(
            lambda: _taken(columns, colors), columns[colors[0]].dtype, len(colors)
        )
    if radii:
        attributes["radii"] = Deferred(lambda: _taken(columns, radii)[:, 0], columns[radii[0]].dtype)
    if ellipses:
        half_axes, mean = _half_axes(_taken(columns, ellipses))
        attributes.setdefault("radii", Deferred(lambda: mean, mean.dtype))
        attributes["axes"] = Deferred(lambda: half_axes, half_axes.dtype, 4)
    return attributes


def _splats(columns: dict[str, NDArray], points: NDArray, decided: Decided) -> dict[str, Deferred]:
    """Colours, normals and half-axes of Gaussian splats, whose columns are taken; {} where these are none."""
    found = splats.splat_columns(columns)
    decision = splats.decide(found, decided.corrections)
    if decision.value is not None:
        decided.note(decision)
    if found is None or not decision.value:
        return {}
    for text in splats.unused(found):
        decided.note_unused(text)
    for name in (*found.higher, *_complete(_NORMALS, columns)):  # programs write zeros as normals
        del columns[name]
    opacity = _taken(columns, found.opacity)[:, 0] if found.opacity else None
    rgba = splats.splat_colors(_taken(columns, found.colors), opacity)
    scales, rotation = _taken(columns, found.scales), _taken(columns, found.rotation)
    half_axes, normals = splats.splat_ellipses(scales, rotation, points)
    decided.note(Decision("normals", "stored", "file", "the rotations of splats"))
    return {
        "normals": Deferred(lambda: normals, normals.dtype, 3),
        "colors": Deferred(lambda: rgba, rgba.dtype, 4),
        "axes": Deferred(lambda: half_axes, half_axes.dtype, 4),
    }


def _complete(choices: Sequence[Sequence[str]], columns: Mapping[str, Column]) -> list[str]:
    """The columns of the first choice of names that is complete, in any case; none where none is."""
    names = {name.lower(): name for name in columns}
    complete = (choice for choice in choices if all(name in names for name in choice))
    return [names[name] for name in next(complete, ())]


def color_columns(columns: Mapping[str, Column]) -> list[str]:
    """The columns that hold colours; none where there are none."""
    return _complete(_COLORS, columns)


def normal_columns(columns: Mapping[str, Column]) -> list[str]:
    """The columns that hold normals; none where there are none."""
    return _complete(_NORMALS, columns)


def _taken(columns: dict[str, NDArray], chosen: Sequence[str]) -> NDArray:
    """The values of columns, (N, C), which go from the others."""
    return _joined([np.asarray(columns.pop(name)) for name in chosen])


def stored_colors(contents: PointContents) -> NDArray | None:
    """The colours of a frame as its file stores them, (N, C); None where it has none."""
    names = _complete(_COLORS, contents.columns)
    return _taken(contents.columns, names) if names else None


def listed(names: Iterable[str], most: int = 12, longest: int = 24) -> str:
    """Names of a file for a message: some of them, shortened where they are long."""
    names = list(names)
    shown = [name if len(name) <= longest else name[:longest] + "..." for name in names[:most]]
    return ", ".join([*shown, f"and {len(names) - most} more"] if len(names) > most else shown) or "none"


def _by_role(contents: PointContents, decided: Decided) -> dict[str, NDArray]:
    """The columns by what they are: as the user says, else as the file or its reader names them."""
    columns = contents.columns
    stated = decided.corrections.get("columns")
    if contents.has_roles:
        return columns
    if stated is None:
        source: Source = "file" if contents.is_named else "assumed"
        decided.note(Decision("columns", list(columns), source, changes_numbers=True))
        return columns
    if len(stated) != len(columns):
        what = f"--read columns names {len(stated)} columns, but the file has {len(columns)} columns"
        raise InputError(what, hint=f"Its columns: {listed(columns)}")
    decided.note(Decision("columns", list(stated), "user", "--read"))
    by_role = {role: columns.pop(name) for role, name in zip(stated, list(columns), strict=True)}
    by_role.pop("-", None)
    return by_role


def cloud_of(
    positions: list[NDArray],
    attributes: Mapping[str, Deferred],
    scalars: Mapping[str, Deferred],
    origin: NDArray[np.float64] | None = None,
    held: int | None = None,
    at_hand: bool = False,
    decided: Decided | None = None,
) -> PointCloud:
    """`PointCloud.from_arrays` of deferred arrays as a file has them, whose meaning is decided here.

    positions: (N, 3), alone in a list that gives it away. attributes: "colors" on any scale, and "normals"
    that may be zero. held: bytes of the file, which has to admit what that takes; None: its rows are not
    packed. at_hand: whether what the others are made of is in memory. decided: the decisions about the scan;
    None: the file stands alone. Raises InputError.
    """
    decided, given = decided or Decided(), dict(attributes)
    if positions[0].shape[1:] != (3,):
        raise InputError(f"positions have shape {positions[0].shape}, expected (N, 3)")
    unmeasured = missing.find_in_frame(positions[0], decided)
    if decided.corrections.get("colors") == colors.NONE and given.pop("colors", None):
        decided.note(colors.decide([], decided.corrections))
    if "colors" in given:
        given["colors"] = _in_bytes(given["colors"], decided)
    if held is not None:
        admit(held, _memory(positions[0], given, scalars, origin, at_hand, unmeasured))
    points = Deferred(positions.pop, positions[0].dtype, 3)
    cloud = PointCloud.from_arrays(
        points, **given, scalars=scalars, origin=origin, precise=True, unmeasured=unmeasured
    )
    missing.note(unmeasured, cloud.dropped_by, decided)
    return with_usable_normals(cloud, decided)


def _in_bytes(stored: Deferred, decided: Decided) -> Deferred:
    """Colours in 8 bit, (N, 4), of colours on the scale of the scan."""

    def make() -> NDArray[np.uint8]:
        values = np.asarray(stored)
        full = colors.settled_scale(values, decided, decided.other_colors)
        return colors.opaque_if_unseen(rgba8(values, full))

    return Deferred(make, stored.dtype, stored.size // stored.dtype.itemsize)


def _memory(
    points: NDArray,
    attributes: Mapping[str, Deferred],
    scalars: Mapping[str, Deferred],
    origin: NDArray[np.float64] | None,
    at_hand: bool,
    unmeasured: missing.Unmeasured | None,
) -> int:
    """Bytes that are held at most at a time, step by step as `PointCloud.from_arrays` goes."""
    rows, (finite, _) = len(points), retained_rows(points, unmeasured)
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
            tangents = numbers[:, 2:] / np.where(tangent_length > 0, tangent_length, 1)
            axes[rows] = np.hstack([lengths[:, :1] * tangents, lengths[:, 1:]])
            mean[rows] = np.sqrt(lengths.prod(axis=1))
    return axes, mean

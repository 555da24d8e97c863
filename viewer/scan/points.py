"""Point clouds: float32 offsets from a float64 origin, with whatever attributes a scan has."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from threading import RLock
from typing import Any, Concatenate, Literal, ParamSpec, Protocol, TypedDict, TypeVar, Unpack, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..bounds import Bounds
from ..errors import InputError
from ..task import checkpoint
from .colors import full_scale, rgba8

P = ParamSpec("P")
T = TypeVar("T")

_CHUNK = 1 << 18  # points converted at a time, so that float64 copies stay small
_LARGEST = 1e18  # coordinates whose squares, and sums of them, float32 can hold
_SMALLEST = 1e-18  # lengths whose squares it can hold
_LONGEST_SPLAT = 1e6  # extents of the points: float32 cannot intersect a ray with much longer ones
SAMPLE = 1 << 13  # points that robust statistics look at
_ARRAYS = ("positions", "normals", "colors", "radii", "axes", "ids", "remainders")
_SCALAR = "scalar:"  # begins the names of scalars among those of all arrays

NOTHING = 0xFFFFFFFF  # the row, or the number of a face or node, where there is none
NOT_FINITE = "not finite"  # why points are dropped: a coordinate is NaN or infinite
Orientation = Literal["auto", "quick", "fine", "auto-flipped", "quick-flipped", "fine-flipped"]
ORIENTATIONS: tuple[Orientation, ...] = get_args(Orientation)
FLIPPED = "-flipped"  # ends the name of an orientation that turns all normals round
UNKNOWN_UNIT = "units"  # of length, where neither the file nor the user tells one


class CloudAttributes(TypedDict, total=False):
    """CloudAttributes of N points, as `PointCloud.from_arrays` takes them; all are optional.

    colors: (N, 3) or (N, 4), uint8 or float in 0..1. axes: (N, 4), of which rows without two lengths count as
    round, with the radius given; the others set it. scalars: name -> (N,).
    """

    normals: ArrayLike | None
    colors: ArrayLike | None
    radii: ArrayLike | None
    axes: ArrayLike | None
    scalars: Mapping[str, ArrayLike] | None


class Held(Protocol):
    """Data that a cloud holds for others."""

    @property
    def nbytes(self) -> int:
        """Bytes that it holds."""


@dataclass(frozen=True, eq=False)
class PointCloud:
    """N points of one moment. Make one with `from_arrays`, which guards the door.

    positions: (N, 3) float32, scan units, relative to origin
    origin:    (3,) float64, scan units
    normals:   (N, 3) float32 as stored in the file (unit length expected), or None
    colors:    (N, 4) uint8, sRGB and alpha, or None
    radii:     (N,) float32, scan units, or None; of an ellipse, that of a circle of its area, so that what
               goes by a radius stays as deep as the splat is wide; bounds go by `splat_reach`
    axes:      (N, 4) float32, scan units, or None: of elliptical splats, one half-axis as a vector, and the
               length of the other, which is perpendicular to it and to the normal; zeros: round
    scalars:   name -> (N,) array of any real type
    ids:       (N,) uint32, increasing, the index in the file before anything was dropped; None: 0..N-1
    dropped:   how many points were dropped because a coordinate was NaN or infinite, or was not measured
    dropped_by: reason -> how many were dropped for it: `NOT_FINITE`, or the value that means "not measured",
               such as "0 0 0"
    shortened: how many splats were, to a million times the extent of the points
    remainders: (N, 3) float32, scan units, or None: what the coordinates have beyond their float32 offsets,
               which are right to 3e-8 of the extent; None where they have nothing
    topology:  names the faces between the points: clouds with the same one hold the same points of the
               subject under the same ids; None where the scan does not tell
    viewpoint: (3,) float64, where the scanner stood that saw all points, absolute, scan units; None where the
               scan does not tell, or several did
    orientation: on which side normals point that Scan4D estimates, see `cloud_normals`
    octree:    that a file stores of these points, see `scan.octree.stored`; None where it stores none
    """

    positions: NDArray[np.float32]
    origin: NDArray[np.float64]
    normals: NDArray[np.float32] | None = None
    colors: NDArray[np.uint8] | None = None
    radii: NDArray[np.float32] | None = None
    axes: NDArray[np.float32] | None = None
    scalars: Mapping[str, NDArray[np.generic]] = field(default_factory=dict)
    ids: NDArray[np.uint32] | None = None
    dropped: int = 0
    dropped_by: Mapping[str, int] = field(default_factory=dict)
    shortened: int = 0
    topology: str | None = None
    remainders: NDArray[np.float32] | None = None
    viewpoint: NDArray[np.float64] | None = None
    orientation: Orientation = "auto"
    octree: Held | None = None
    _facts: dict[tuple[Any, ...], Any] = field(default_factory=dict, init=False, repr=False)
    _finding: dict[tuple[Any, ...], RLock] = field(default_factory=dict, init=False, repr=False)

    @classmethod
    def from_arrays(
        cls,
        positions: ArrayLike,
        *,
        origin: ArrayLike | None = None,
        precise: bool = True,
        viewpoint: ArrayLike | None = None,
        unmeasured: tuple[str, NDArray[np.bool_]] | None = None,
        **attributes: Unpack[CloudAttributes],
    ) -> PointCloud:
        """Points with a NaN or infinite coordinate are dropped and counted.

        positions: (N, 3) absolute, any real type. origin: (3,); chosen by `choose_origin` if None. precise:
        whether what the coordinates have beyond float32 offsets is stored. viewpoint: (3,) absolute.
        unmeasured: the value that means "not measured", and the rows that have it, (N,), dropped too.
        Raises InputError where shapes do not fit, and where the viewpoint is not finite; TypeError where an
        argument has another name.
        """
        if unknown := sorted(attributes.keys() - CloudAttributes.__optional_keys__):
            known = ", ".join(CloudAttributes.__annotations__)
            raise TypeError(
                f"PointCloud.from_arrays has no argument {', '.join(unknown)}. Attributes are "
                f"{known}; pass other values per point as scalars={{name: values}}"
            )
        points = np.asarray(positions)
        if points.ndim != 2 or points.shape[1] != 3:
            raise InputError(f"positions have shape {points.shape}, expected (N, 3)")
        if points.dtype.kind not in "fiu":
            raise InputError(f"positions are of type {points.dtype}, expected numbers")
        count = len(points)
        finite, dropped_by = retained_rows(points, unmeasured)

        def pick(values: ArrayLike | None, name: str, columns: tuple[int, ...]) -> NDArray | None:
            if values is None:
                return None
            array = np.asarray(values)
            width = array.shape[1] if array.ndim == 2 else 1 if array.ndim == 1 else -1
            if len(array) != count or width not in columns or array.dtype.kind not in "fiub":
                raise InputError(f"{name} have shape {array.shape} ({array.dtype}) for {count} points")
            return array if finite is None else array[finite]

        normals = pick(attributes.get("normals"), "normals", (3,))
        colors = pick(attributes.get("colors"), "colors", (3, 4))
        radii = pick(attributes.get("radii"), "radii", (1,))
        axes = pick(attributes.get("axes"), "axes", (4,))
        if finite is not None:
            points = points[finite]
        radii = None if radii is None else np.ascontiguousarray(radii, np.float32)
        shortened = 0
        if radii is not None or axes is not None:
            radii, axes, shortened = _splats(radii, axes, _LONGEST_SPLAT * (_robust_extent(points) or 1.0))
        base = choose_origin(points) if origin is None else np.array(origin, np.float64)
        offsets, remainders = _relative(points, base, precise)
        return cls(
            positions=offsets,
            origin=base,
            normals=None if normals is None else np.ascontiguousarray(normals, np.float32),
            colors=None if colors is None else rgba8(colors, full_scale(colors)),
            radii=radii,
            axes=axes,
            scalars={name: np.ascontiguousarray(pick(values, f"values of '{name}'", (1,)))
                     for name, values in (attributes.get("scalars") or {}).items()},
            ids=None if finite is None else np.flatnonzero(finite).astype(np.uint32),
            dropped=sum(dropped_by.values()),
            dropped_by=dropped_by,
            shortened=shortened,
            remainders=remainders,
            viewpoint=None if viewpoint is None else checked_viewpoint(viewpoint),
        )  # fmt: skip

    def __len__(self) -> int:
        return len(self.positions)

    @property
    def dropped_in_words(self) -> str:
        """The points that were left out, by reason, for a message: "12 points without finite coordinates"."""
        reasons = {**self.dropped_by}
        rest = self.dropped - sum(reasons.values()) + reasons.pop(NOT_FINITE, 0)
        parts = [f"{count:,} points at {value}, which were not measured" for value, count in reasons.items()]
        return " and ".join([*parts, *([f"{rest} points without finite coordinates"] if rest else [])])

    @property
    def nbytes(self) -> int:
        """Bytes held by all arrays."""
        held = 0 if self.octree is None else self.octree.nbytes
        return held + sum(values.nbytes for values in self._named_arrays().values())

    def bytes_beside(self, other: PointCloud) -> int:
        """Bytes held by the arrays that another cloud does not hold too."""
        held = {id(values) for values in other._named_arrays().values()}
        return sum(values.nbytes for values in self._named_arrays().values() if id(values) not in held)

    def world(self, rows: Any = slice(None)) -> NDArray[np.float64]:
        """Absolute positions, (N, 3) float64, as precise as the file has them. rows: of these alone."""
        offsets = self.positions[rows].astype(np.float64)
        if self.remainders is not None:
            offsets += self.remainders[rows]
        return offsets + self.origin

    def centered(self, origin: NDArray[np.float64]) -> PointCloud:
        """The points relative to another origin, (3,): as precise near it as the file has them."""
        shift, offsets = self.origin - origin, np.empty_like(self.positions)
        for start in range(0, len(self), _CHUNK):
            part = slice(start, start + _CHUNK)
            away = self.positions[part] + shift
            if self.remainders is not None:
                away += self.remainders[part]
            offsets[part] = away
        return replace(self, positions=offsets, origin=origin, remainders=None)

    def moved(self, by: NDArray[np.float64]) -> PointCloud:
        """The points and their viewpoint, moved by (3,) scan units; offsets stay as they are."""
        viewpoint = None if self.viewpoint is None else self.viewpoint + by
        return replace(self, origin=self.origin + by, viewpoint=viewpoint)

    def displaced(self, by: NDArray[np.floating]) -> PointCloud:
        """Each point moved by its own (N, 3), scan units: as precise as float32 offsets are."""
        offsets = self.positions + by
        if self.remainders is not None:
            offsets += self.remainders
        return replace(self, positions=offsets.astype(np.float32), remainders=None)

    def sharing(self, other: PointCloud) -> PointCloud:
        """The points with arrays of another cloud in place of their own where these hold the same to the bit,
        as colours and radii do in many a sequence: they are in memory, and go to the GPU, once."""
        ours, theirs = self._named_arrays(), other._named_arrays()
        same: dict[str, Any] = {
            name: theirs[name]
            for name, values in ours.items()
            if name in theirs and values is not theirs[name] and _are_same(values, theirs[name])
        }
        scalars = {name.removeprefix(_SCALAR): same.pop(name) for name in [*same] if name.startswith(_SCALAR)}
        if not (same or scalars):
            return self
        return replace(self, **same, scalars={**self.scalars, **scalars})

    def _named_arrays(self) -> dict[str, NDArray]:
        named = {name: getattr(self, name) for name in _ARRAYS}
        named |= {_SCALAR + name: values for name, values in self.scalars.items()}
        return {name: values for name, values in named.items() if values is not None}

    def of_rows(self, rows: NDArray[np.integer]) -> PointCloud:
        """Some of the points: rows (M,), ascending. They keep their ids."""
        names = ("positions", "normals", "colors", "radii", "axes", "remainders")
        arrays = {name: getattr(self, name) for name in names}
        retained = {name: values[rows] for name, values in arrays.items() if values is not None}
        ids = rows.astype(np.uint32) if self.ids is None else self.ids[rows]
        scalars = {name: values[rows] for name, values in self.scalars.items()}
        return replace(self, **retained, scalars=scalars, ids=ids)

    def between(self, start: int, stop: int) -> PointCloud:
        """A run of the points, which shares the memory of all. They keep their ids; what is known of the scan
        as a whole is not known of them."""
        run = slice(start, min(stop, len(self)))
        names = (*_ARRAYS, "remainders")
        arrays = {name: values[run] for name in names if (values := getattr(self, name)) is not None}
        scalars = {name: values[run] for name, values in self.scalars.items()}
        return replace(self, **arrays, scalars=scalars, dropped=0, dropped_by={}, topology=None)

    def splat_reach(self) -> NDArray[np.float32]:
        """How far each splat reaches from its point, (N,): its radius, or its longer half-axis."""
        assert self.radii is not None
        if self.axes is None:
            return self.radii
        longer = np.maximum(np.linalg.norm(self.axes[:, :3], axis=1), self.axes[:, 3])
        return np.where(longer > 0, longer, self.radii)

    def row_of(self, id: int) -> int | None:
        """The row of the arrays that holds the point of this id; None where it is not there."""
        if self.ids is None:
            return id if 0 <= id < len(self) else None
        row = int(np.searchsorted(self.ids, id))
        return row if row < len(self) and self.ids[row] == id else None

    def bounds(self) -> Bounds:
        """The box around the body of the points, which a few far outliers do not stretch.

        The 2 % to 98 % quantile box, grown on every side by half of its longest edge, and
        then shrunk to the points inside. Found once. Raises InputError where there is no point.
        """
        return self.remember(PointCloud._find_bounds)

    def whole_bounds(self) -> Bounds:
        """The box around all points, outliers too. Found once. Raises InputError where there is no point."""
        return self.remember(PointCloud._find_whole_bounds)

    def longest_reach(self) -> float:
        """The farthest that any splat reaches from its point, scan units; 0 where there are no radii."""
        return 0.0 if self.radii is None else self.remember(PointCloud._find_longest_reach)

    def reaches(self) -> tuple[float, float]:
        """How far nine of ten splats reach at most, by a sample, and how far any does, scan units; unknown
        radii aside. Found once. The cloud has radii."""
        return self.remember(PointCloud._find_reaches)

    def remember(self, find: Callable[Concatenate[PointCloud, P], T], *args: P.args, **kwargs: P.kwargs) -> T:
        """Find a small fact about the points, once for the same arguments. While one thread finds it, others
        that ask for it wait."""
        key = (find, *args, *kwargs.items())
        if key not in self._facts:
            with self._finding.setdefault(key, RLock()):
                if key not in self._facts:
                    self._facts[key] = find(self, *args, **kwargs)
            self._finding.pop(key, None)
        return self._facts[key]

    def recall(self, find: Callable[[PointCloud], T]) -> T | None:
        """The small fact that `remember(find)` found before; None where it did not yet."""
        return self._facts.get((find,))

    def __getstate__(self) -> dict[str, Any]:
        """All but the facts, which another process finds again where it needs them."""
        return {**self.__dict__, "_facts": {}, "_finding": {}}

    def _find_whole_bounds(self) -> Bounds:
        if not len(self):
            raise InputError("there are no points that a view could show")
        low, high = _extremes(self.positions)
        return Bounds(low + self.origin, high + self.origin)

    def _find_longest_reach(self) -> float:
        reach = self.splat_reach()
        return float(reach.max(where=np.isfinite(reach), initial=0.0))

    def _find_reaches(self) -> tuple[float, float]:
        return usual_reach(strided(self.splat_reach())), self.longest_reach()

    def _find_bounds(self) -> Bounds:
        if not len(self):
            raise InputError("there are no points that a view could show")
        low, high = robust_box(strided(self.positions))
        smallest, largest = np.full(3, np.inf), np.full(3, -np.inf)
        for start in range(0, len(self), _CHUNK):
            checkpoint()
            part = self.positions[start : start + _CHUNK]
            part_low, part_high = _extremes(part)
            if (part_low < low).any() or (part_high > high).any():
                # Column by column: numpy is 20 times slower along the short axis.
                inside = np.ones(len(part), bool)
                for axis in range(3):
                    inside &= (part[:, axis] >= low[axis]) & (part[:, axis] <= high[axis])
                if not inside.any():
                    continue
                part_low, part_high = _extremes(part[inside])
            smallest, largest = np.minimum(smallest, part_low), np.maximum(largest, part_high)
        return Bounds(smallest + self.origin, largest + self.origin)


def checked_viewpoint(given: ArrayLike) -> NDArray[np.float64]:
    """A viewpoint as a PointCloud holds it, (3,) float64; raises InputError where it is none."""
    viewpoint = np.array(given, np.float64)
    if viewpoint.shape != (3,) or not np.isfinite(viewpoint).all():
        raise InputError(f"{given!r} is not a viewpoint", hint="Write x, y and z in scan units")
    return viewpoint


def finite_rows(points: NDArray) -> NDArray[np.bool_] | None:
    """Mask of the rows that are finite in all columns, (N,) bool; None where all are.

    A coordinate of 1e18 or more counts as infinite: float32 cannot hold its square.
    """
    if points.dtype.kind != "f":
        return None
    finite = None
    for start in range(0, len(points), _CHUNK):
        part = points[start : start + _CHUNK]
        low, high = _extremes(part)  # NaN where there is one, and then not within
        if (low > -_LARGEST).all() and (high < _LARGEST).all():
            continue
        if finite is None:
            finite = np.ones(len(points), bool)
        finite[start : start + _CHUNK] = (np.abs(part) < _LARGEST).all(axis=1)
    return finite


def retained_rows(
    points: NDArray, unmeasured: tuple[str, NDArray[np.bool_]] | None
) -> tuple[NDArray[np.bool_] | None, dict[str, int]]:
    """Mask of the rows that a cloud retains, (N,), None: all; and how many it drops, by reason.

    unmeasured: the value that means "not measured", and the rows of points (N, 3) that have it, (N,).
    """
    finite = finite_rows(points)
    dropped_by = {}
    if finite is not None:
        dropped_by[NOT_FINITE] = len(finite) - int(np.count_nonzero(finite))
    if unmeasured is not None:
        value, rows = unmeasured
        retained = ~rows if finite is None else finite & ~rows
        before = len(points) - dropped_by.get(NOT_FINITE, 0)
        dropped_by[value] = before - int(np.count_nonzero(retained))
        finite = retained
    return finite, dropped_by


def _are_same(ours: NDArray, theirs: NDArray) -> bool:
    """Whether two arrays hold the same bits; it ends at the first difference."""
    if ours.shape != theirs.shape or ours.dtype != theirs.dtype:
        return False
    parts = [slice(0, SAMPLE), *(slice(start, start + _CHUNK) for start in range(0, len(ours), _CHUNK))]
    return all(ours[part].tobytes() == theirs[part].tobytes() for part in parts)


def _extremes(points: NDArray) -> tuple[NDArray, NDArray]:
    columns = points.T
    return np.array([c.min() for c in columns]), np.array([c.max() for c in columns])


def choose_origin(points: NDArray) -> NDArray[np.float64]:
    """The median position on a power-of-two grid of the robust extent, (3,) float64.

    The grid makes the poses of a sequence share one origin as a rule, and a body near
    zero keep its coordinates; medians and quantiles make one far outlier harmless.
    """
    if not len(points):
        return np.zeros(3)
    extent = _robust_extent(points)
    median = np.median(_sample(points), axis=0)
    largest = float(np.abs(median).max())
    if extent <= np.finfo(np.float64).eps * largest or not np.isfinite(extent):  # the grid would be too fine
        return median if largest > 0 else np.zeros(3)
    grid = 2.0 ** np.ceil(np.log2(extent))
    return np.round(median / grid) * grid + 0.0  # + 0.0: no negative zero


def stride(count: int) -> int:
    """The step at which so many values are looked at by robust statistics."""
    return max(1, count // SAMPLE)


def strided(values: NDArray) -> NDArray:
    """Some thousands of the values (N, ...), spread evenly: what robust statistics look at."""
    return values[:: stride(len(values))]


def usual_reach(sample: NDArray[np.float32]) -> float:
    """How far nine of ten splats reach at most, going by some, (n,) scan units; 0 where none is known."""
    known = sample[(sample > 0) & np.isfinite(sample)]
    return float(np.quantile(known, 0.9)) if known.size else 0.0


def robust_box(sample: NDArray) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The box that holds the body of points, going by some, (n, 3): the corners of the quantile box, grown on
    every side by half of its longest edge."""
    low, high = np.quantile(np.asarray(sample, np.float64), [0.02, 0.98], axis=0)
    margin = 0.5 * float((high - low).max())
    return low - margin, high + margin


def _sample(points: NDArray) -> NDArray[np.float64]:
    return np.asarray(strided(points), np.float64)


def _robust_extent(points: NDArray) -> float:
    """The longest edge of the box that holds most of the points, 0 where there is none."""
    low, high = _quantile_box(points) if len(points) else (np.zeros(3), np.zeros(3))
    return float((high - low).max())


def _quantile_box(points: NDArray) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    low, high = np.quantile(_sample(points), [0.02, 0.98], axis=0)
    return low, high


def _relative(
    points: NDArray, origin: NDArray[np.float64], precise: bool
) -> tuple[NDArray[np.float32], NDArray[np.float32] | None]:
    """Offsets from the origin, and their remainders, None where there are none."""
    if points.dtype == np.float32 and not origin.any():
        return np.ascontiguousarray(points), None
    offsets, remainders = np.empty(points.shape, np.float32), None
    for start in range(0, len(points), _CHUNK):
        checkpoint()
        part = slice(start, start + _CHUNK)
        away = points[part].astype(np.float64) - origin
        offsets[part] = away
        if not precise:
            continue
        away -= offsets[part]
        if away.any():
            if remainders is None:
                remainders = np.zeros(points.shape, np.float32)
            remainders[part] = away
    return offsets, remainders


def _splats(
    radii: NDArray[np.float32] | None, axes: NDArray | None, longest: float
) -> tuple[NDArray[np.float32] | None, NDArray[np.float32] | None, int]:
    """Radii and half-axes as a PointCloud holds them, and how many are `longest` now and were longer.

    Both are as they were given where no row of the half-axes has two lengths.
    """
    shortened = 0
    if radii is not None and (too_long := (radii > longest) & np.isfinite(radii)).any():
        radii, shortened = np.where(too_long, np.float32(longest), radii), int(too_long.sum())
    if axes is None:
        return radii, None, shortened
    mean = np.zeros(len(axes), np.float32) if radii is None else radii.copy()
    retained, shorter = np.zeros(axes.shape, np.float32), 0
    for start in range(0, len(axes), _CHUNK):
        checkpoint()
        part = axes[start : start + _CHUNK].astype(np.float64)
        with np.errstate(over="ignore", invalid="ignore"):
            lengths = np.stack([np.linalg.norm(part[:, :3], axis=1), part[:, 3]])
        rows = np.flatnonzero(((lengths > _SMALLEST) & (lengths < _LARGEST)).all(axis=0))
        factors = np.minimum(1, longest / lengths[:, rows])
        retained[start + rows, :3] = part[rows, :3] * factors[0][:, None]
        retained[start + rows, 3] = part[rows, 3] * factors[1]
        mean[start + rows] = np.sqrt((lengths[:, rows] * factors).prod(axis=0))
        shorter += int((factors < 1).any(axis=0).sum())
    return (mean, retained, shorter) if retained.any() else (radii, None, shortened)

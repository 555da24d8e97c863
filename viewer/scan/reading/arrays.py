"""Decides what the arrays of NPY and NPZ are: which one holds points, and what its axes mean.

| shape | what it is |
|---|---|
| (N, C) | rows of columns: x y z, and as `columns.py` decides |
| (3, N), (3, H, W), (S, 3, H, W) | the same with the coordinates in front |
| (N,) of fields | the same, with names |
| (T, N, 3), (T, N, C), (T, N) of fields | T frames of N points |
| (H, W, 3) | one organised cloud: rows of a picture, whose pixels are near to their neighbours both ways |
| (S, H, W, 3) | S frames, each an organised cloud |
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Literal, TypeVar

import numpy as np
from numpy.typing import NDArray

from ...errors import EmptyFrame, InputError
from ..admission import MOST_FRAMES, check_count
from ..contents import ArrayInFile
from .corrections import NOTHING_CORRECTED, Corrections
from .record import Decision
from .sequence import Decided
from .times_table import doubt_of

Meaning = Literal["cloud", "rows", "image", "images"]

ArrayT = TypeVar("ArrayT", bound=ArrayInFile)

KEY = "frames"
ROWS, IMAGE = "rows", "image"  # what `--read frames=` takes for (A, B, 3)
CLOUD = "cloud"  # and where columns or numbers of arrays may count frames
POINT_ARRAYS = (  # what programs call the array of points; the first that is there
    "positions", "points", "vertices", "xyz", "world_points", "pts3d", "point_map", "point_maps", "points3d",
    "pointmap", "pointmaps", "pcd", "point_cloud", "pointcloud", "pc", "cloud", "verts", "vertex", "position",
    "pos", "coords", "coordinates", "markers", "joints", "joints3d", "joints_3d", "keypoints3d",
    "keypoints_3d", "arr_0",
)  # fmt: skip
_PICTURES = ("world_points", "pts3d", "point_map", "point_maps", "points3d", "pointmap", "pointmaps")
_CONFIDENCES = ("conf", "confidence")  # names that end so belong to pictures
_RATES = (
    "fps", "rate", "framerate", "frame_rate", "mocap_framerate", "mocap_frame_rate", "frequency", "freq",
    "hz", "fs", "sampling_rate", "sample_rate", "sampling_frequency", "capture_rate",
    "video_fps", "frames_per_second",
)  # fmt: skip
_TIMES = ("times", "timestamps", "timestamp", "time", "t", "time_stamps", "frame_times")
_STEPS = ("dt", "frame_time", "timestep", "time_step")
_UNITS = {"s": 1.0, "sec": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}  # at the end of the name of times
_LEAST_ROWS, _LEAST_COLUMNS = 8, 16  # of a picture
_MOST_PIXELS = 1 << 23  # no camera has more, and a longer sequence need not be looked at
_FIRST_ROWS = 1  # that are looked at first: they tell most sequences
_LOOKED_AT = 256  # rows of a picture that are looked at, or up to twice as many
_LONGEST_CURVE = 8.0  # of the way along a row of a picture to its reach
_APART = 0.05  # the least variance of the middles of rows, as a part of that of all points
_NEAR = 0.1  # of the extent: how far neighbours in a picture may be apart
_ALIKE = 10.0  # how much farther apart neighbours along one axis may be than along the other
_FILLED = 0.02  # the least part of the pixels that hold a point
_MOST_COLUMNS = 64
_MOST_OF_FRAMES = 12  # columns where the array has frames or rows as well
_MOST_AXES = 4
_FRONT = (3, 4, 6, 7, 9)  # coordinates, and what may stand beside them, of arrays with these in front
_MOST_BESIDE = 16  # numbers of a point where there are so few rows
_FORM = "The shape of points must be (N, 3), (N, C) with x y z first, (T, N, 3), (H, W, 3) or (S, H, W, 3)"


@dataclass(frozen=True)
class PointArray:
    """An array of points, understood.

    meaning: "cloud": (N, C) or (N,) of fields. "rows": (T, N, 3). "image": (H, W, 3). "images": (S, H, W, 3)
    frames: how many. count: points of a frame. grid: (H, W) of a picture, else ()
    """

    meaning: Meaning
    frames: int
    count: int
    grid: tuple[int, ...] = ()

    @property
    def sequence(self) -> tuple[int, ...]:
        """(T,) where the first axis counts frames, else ()."""
        return (self.frames,) if self.meaning in ("rows", "images") else ()


def points_among(arrays: Mapping[str, ArrayInFile]) -> str | None:
    """The name of the array that holds the points, None where none does."""
    by_name = {name.lower(): name for name in arrays}
    named = [by_name[name] for name in POINT_ARRAYS if name in by_name]
    return next((name for name in named if may_be_points(arrays[name])), None)


def without_batch(arrays: Mapping[str, ArrayT]) -> dict[str, ArrayT]:
    """The arrays without a first axis of length 1, which networks add, where the array of points has it."""
    points = (array for name, array in arrays.items() if name.lower() in POINT_ARRAYS)
    if not any(len(array.shape) > _MOST_AXES and array.shape[0] == 1 for array in points):
        return dict(arrays)
    return {
        name: array.reshaped(array.shape[1:]) if len(array.shape) > 1 and array.shape[0] == 1 else array
        for name, array in arrays.items()
    }


def as_points(array: ArrayT, decided: Decided) -> ArrayT:
    """The array with the coordinates of a point last, where they stand in front, which the record says."""
    axis = _coordinates_first(array.shape) if array.dtype.names is None else 0
    if axis and 3 in (array.shape[0], array.shape[-3:][0]):
        why = f"In the array {array.shape}, the axis of coordinates comes before the axis of points"
        decided.note(Decision("columns", ["x", "y", "z"], "assumed", why=why, changes_numbers=True))
    return array.with_last(axis) if axis else array


def _coordinates_first(shape: tuple[int, ...]) -> int:
    """The axis, counted from the end, that holds x, y and z in front of the points: 2, 3 or 0, none."""
    if len(shape) == 2 and shape[0] in _FRONT and shape[1] > _MOST_BESIDE:
        return 2
    if len(shape) in (3, _MOST_AXES) and shape[-3] == 3 and min(shape[-2:]) >= _LEAST_ROWS:
        return 3
    return 0


def may_be_points(array: ArrayInFile) -> bool:
    """Whether the shape and the type of an array allow that it holds points."""
    names, shape = array.dtype.names, array.shape
    if names is not None:
        return len(shape) in (1, 2)
    if _coordinates_first(shape):
        return True
    if len(shape) == 3 and 3 < shape[-1] <= _MOST_OF_FRAMES:
        return array.dtype.kind == "f"  # others may be pictures
    return 2 <= len(shape) <= _MOST_AXES and (
        shape[-1] == 3 or (len(shape) == 2 and 3 < shape[1] <= _MOST_COLUMNS)
    )


def point_array(
    array: ArrayInFile, look: Callable[[int], NDArray], decided: Decided, beside: Iterable[str] = ()
) -> PointArray:
    """Decide what an array of points is, and note it. Raises InputError where it is none.

    look: reads the first so many entries along the first axis; called where three axes are uncertain. beside:
    the names of other arrays, which may say that it is a picture.
    """
    shape = array.shape
    if array.dtype.hasobject:
        raise InputError(
            f"array '{array.name}' contains pickled Python objects, which Scan4D does not read for safety"
        )
    if not may_be_points(array):
        raise InputError(f"array '{array.name}' has shape {shape}", hint=_FORM)
    if array.dtype.names is None and array.dtype.kind not in "fiu":
        raise InputError(f"array '{array.name}' is of type {array.dtype}, expected numbers")
    if not math.prod(shape):
        raise EmptyFrame(f"holds no points: array '{array.name}' has shape {shape}")
    if len(shape) == 1 or (len(shape) == 2 and array.dtype.names is None):
        return PointArray("cloud", 1, shape[0])
    if len(shape) == 3:

        def first(count: int) -> NDArray:
            return look(count)[..., :3]

        decision = decided.settle(KEY, lambda: decide(array, first, decided.corrections, beside))
        if decision.value == IMAGE:
            return PointArray("image", 1, shape[0] * shape[1], shape[:2])
    check_count(shape[0], MOST_FRAMES, "frames")
    if len(shape) == 4:
        return PointArray("images", shape[0], shape[1] * shape[2], shape[1:3])
    return PointArray("rows", shape[0], shape[1])


def decide(
    array: ArrayInFile,
    look: Callable[[int], NDArray],
    corrections: Corrections = NOTHING_CORRECTED,
    beside: Iterable[str] = (),
) -> Decision:
    """Whether the first axis of points (A, B, 3) counts frames ("rows") or rows of a picture ("image")."""
    rows, columns, _ = array.shape
    if corrections.get(KEY) in (ROWS, IMAGE):
        return Decision(KEY, corrections[KEY], "user", "--read")
    if says_picture(array.name, beside):
        why = f"The name of the array states that the array is a picture of {columns} x {rows} points"
        return Decision(KEY, IMAGE, "file", array.name, why, (), changes_numbers=True)
    is_size_of_picture = rows >= _LEAST_ROWS and columns >= _LEAST_COLUMNS and rows * columns <= _MOST_PIXELS
    if is_size_of_picture and may_be_organised(look(_FIRST_ROWS)) and is_organised(look(rows)):
        why = (
            f"Points that are neighbours in the array of {columns} x {rows} points are also neighbours in "
            "space"
        )
        return Decision(KEY, IMAGE, "assumed", "", why, (ROWS,), changes_numbers=True)
    return Decision(KEY, ROWS, "file", why="The first axis of the array counts frames")


def may_be_organised(first: NDArray) -> bool:
    """Whether the first rows of points (K, B, 3) are curves, or hold too few points to tell."""
    there = _measured(first)
    return all(_is_curve(row[ok]) for row, ok in zip(first.astype(np.float64), there, strict=True))


def _measured(points: NDArray) -> NDArray[np.bool_]:
    return np.isfinite(points).all(axis=-1) & (points != 0).any(axis=-1)


def _is_curve(points: NDArray[np.float64]) -> bool:
    """Whether the way from point to point, (N, 3), is not much longer than the points reach."""
    if len(points) < _LEAST_COLUMNS // 2:
        return True
    way = float(np.sqrt((np.diff(points, axis=0) ** 2).sum(axis=1)).sum())
    reach = float(np.linalg.norm(np.ptp(points, axis=0)))
    return way < _LONGEST_CURVE * reach


def says_picture(name: str, beside: Iterable[str] = ()) -> bool:
    """Whether the name of an array, or of one beside it, says that its points are pixels."""
    confidences = {f"{name}_{word}".lower() for word in _CONFIDENCES}
    return name.lower() in _PICTURES or bool(confidences & {other.lower() for other in beside})


def is_organised(block: NDArray) -> bool:
    """Whether the first axis of points (A, B, 3) counts the rows of a picture, not moments.

    In a picture, neighbours are near each other along both axes, about as near along both, and the rows lie
    side by side, while the moments of a scan lie over each other. Points that are not finite or at (0, 0, 0)
    do not count.
    """
    points = block[:: max(1, len(block) // (2 * _LOOKED_AT))].astype(np.float64)
    there = _measured(points)
    if there.mean() < _FILLED:
        return False

    def median_step(axis: int) -> float:
        with np.errstate(all="ignore"):
            steps = np.sqrt((np.diff(points, axis=axis) ** 2).sum(axis=2))
        both = there[1:] & there[:-1] if axis == 0 else there[:, 1:] & there[:, :-1]
        return float(np.median(steps[both])) if both.any() else 0.0

    down, across = median_step(0), median_step(1)
    seen = points[there]
    low, high = np.quantile(seen[:: max(1, len(seen) // 8192)], [0.02, 0.98], axis=0)
    near = _NEAR * float((high - low).max())
    if not (0 < down < near and 0 < across < near and 1 / _ALIKE < down / across < _ALIKE):
        return False
    filled = there.sum(axis=1) >= _LEAST_COLUMNS // 2
    if np.count_nonzero(filled) < _LEAST_ROWS // 2:
        return False
    centers = np.array([row[ok].mean(axis=0) for row, ok in zip(points[filled], there[filled], strict=True)])
    curves = [_is_curve(row[ok]) for row, ok in zip(points[filled], there[filled], strict=True)]
    return bool(np.mean(curves) > 0.5 and centers.var(axis=0).sum() > _APART * seen.var(axis=0).sum())


def stated_times(arrays: Mapping[str, ArrayInFile], frames: int) -> tuple[NDArray[np.float64], str] | None:
    """Times of frames, (frames,) seconds, and the name of the array that states them; None where none does.

    An array of times counts first, then a rate or a step. Time stamps of milliseconds, microseconds and
    nanoseconds become seconds from the first one on. Raises InputError where `times` is unusable.
    """
    by_name = {name.lower(): name for name in arrays}
    for name in by_name:
        base, _, unit = name.rpartition("_")
        if name in _TIMES or (base in _TIMES and unit in _UNITS):
            per_second = None if name in _TIMES else _UNITS[unit]
            times = _times_of(arrays[by_name[name]], frames, name == "times", per_second)
            if times is not None:
                return times, by_name[name]
    for name in (*_RATES, *_STEPS):
        if name in by_name and (number := _single(arrays[by_name[name]])) is not None and number > 0:
            step = number if name in _STEPS else 1 / number
            return np.arange(frames, dtype=np.float64) * step, by_name[name]
    return None


def doubtful_times(times: NDArray[np.float64], name: str) -> Decision | None:
    """The decision that marks times, (T,) seconds, of the array `name` where milliseconds are as likely."""
    has_unit = name.lower() not in _TIMES or name.lower() == "times"  # which are seconds, see formats/npz.py
    doubt = "" if has_unit else doubt_of(times, "array")
    if not doubt:
        return None
    return Decision("times", "stored", "assumed", name, doubt, ("index", "fps:30"), changes_numbers=True)


def states_times(name: str) -> bool:
    """Whether an array of this name states times, a rate or a step."""
    base, _, unit = name.lower().rpartition("_")
    return name.lower() in (*_TIMES, *_RATES, *_STEPS) or (base in _TIMES and unit in _UNITS)


def _times_of(
    array: ArrayInFile, frames: int, must: bool, per_second: float | None
) -> NDArray[np.float64] | None:
    """Seconds of an array of times; None where it holds something else. per_second: as stated."""
    values = (
        array.read().reshape(-1) if math.prod(array.shape) == frames and array.dtype.kind in "fiuM" else None
    )
    if values is not None and values.dtype.kind == "M":
        values, per_second = values.astype("M8[ns]").astype(np.int64), 1e9
    if values is None or not np.isfinite(values).all():
        if must:
            raise InputError(f"array '{array.name}' is not {frames} finite numbers")
        return None
    if must:
        return values.astype(np.float64)
    if (np.diff(values) <= 0).any():
        return None
    return (
        seconds_of_stamps(values)
        if per_second is None
        else (values - values[0]).astype(np.float64) / per_second
    )


def seconds_of_stamps(stamps: NDArray) -> NDArray[np.float64]:
    """Seconds from the first time stamp on, (T,). Whole stamps of 13, 16 and 19 digits count milliseconds,
    microseconds and nanoseconds, as those of clocks do; others count seconds."""
    largest = float(np.abs(stamps).max())
    unit = next((unit for least, unit in ((1e17, 1e9), (1e14, 1e6), (1e11, 1e3)) if largest >= least), 1.0)
    from_first = stamps - stamps[0]  # whole numbers stay exact
    return from_first.astype(np.float64) / unit


def _single(array: ArrayInFile) -> float | None:
    if not 0 < math.prod(array.shape) <= MOST_FRAMES or array.dtype.kind not in "fiuUS":
        return None
    try:
        numbers = array.read().ravel().astype(np.float64)
    except ValueError:
        return None
    return float(numbers[0]) if np.isfinite(numbers).all() and (numbers == numbers[0]).all() else None

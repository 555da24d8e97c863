"""Decides whether arrays of an NPZ file are frames, one array or a few for each: `frame_000`, `frame_001`.

`numpy.savez(path, *clouds)` calls such arrays `arr_0`, `arr_1` and so on. Arrays with the number of a frame
belong to this frame, as `colors_7` beside `points_7`. Arrays without a number belong to all frames.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ..contents import ArrayInFile
from .arrays import CLOUD, KEY, POINT_ARRAYS, may_be_points, points_among
from .range_arrays import IMAGE_ARRAYS, image_source
from .record import Decision
from .sequence import Decided

ArraysOfFrame = dict[str, str]  # what the frame calls an array -> its name in the file
_Numbered = Mapping[str, Mapping[int, str]]  # the name of arrays without their number -> number -> name
_NUMBERED = re.compile(r"(.*?)[_ .-]?(\d{1,9})")
_UNNAMED = "arr"  # what numpy calls arrays without a name
_FRAMES = {"frame", "frames"}
_LEAST_ROWS = 5  # matrices have fewer
_LOOKED_AT = 256  # rows of an array
_UNIT = 1e-3  # how far the length of normals may be from 1


def arrays_of_frames(
    names: Sequence[str], opened: Callable[[str], ArrayInFile], decided: Decided
) -> list[ArraysOfFrame]:
    """The arrays of each frame, in the order of their numbers, points as `positions`; [] where the numbers of
    arrays count no frames. The record says so.

    names: of all arrays of the file. opened: reads the header of an array by its name. Raises InputError.
    """
    by_number: dict[str, dict[int, str]] = {}
    for name in names:
        if match := _NUMBERED.fullmatch(name):
            by_number.setdefault(match[1], {})[int(match[2])] = name
    numbered = {called: found for called, found in by_number.items() if len(found) > 1}
    if not numbered:
        return []
    of_frames = {name for found in numbered.values() for name in found.values()}
    shared = {name: opened(name) for name in names if name not in of_frames}
    if points_among(shared) is not None or image_source(shared) is not None:
        return []
    images = _images(numbered, opened)
    points = _points(numbered, opened) if images is None else None
    source = images if points is None else points
    if source is None:
        return []
    if decided.corrections.get(KEY) == CLOUD:
        decided.note(Decision(KEY, CLOUD, "user", "--read"))
        return []
    numbers = sorted(numbered[source])
    partners = {called: found for called, found in by_number.items() if found.keys() <= {*numbers}}
    of_frames = {name for found in partners.values() for name in found.values()}
    of_all = {name: name for name in names if name not in of_frames}
    decided.note(_decision(source, [numbered[source][number] for number in numbers]))
    called_so = {called: "positions" if called == points else called for called in partners}
    return [
        of_all | {called_so[called]: found[number] for called, found in partners.items() if number in found}
        for number in numbers
    ]


def _decision(source: str, names: Sequence[str]) -> Decision:
    value, why = f"arrays {names[0]} to {names[-1]}", f"Each of the {len(names)} arrays is a frame"
    if source.lower() in _FRAMES | {*POINT_ARRAYS, *IMAGE_ARRAYS}:
        return Decision(KEY, value, "file", source, why)
    return Decision(KEY, value, "assumed", why=why, alternatives=(CLOUD,), changes_numbers=True)


def _images(numbered: _Numbered, opened: Callable[[str], ArrayInFile]) -> str | None:
    """The name of numbered range images without the number, None where there are none."""
    first = {called: opened(found[min(found)]) for called, found in numbered.items()}
    called = next((called for called in first if image_source({called: first[called]}) is not None), None)
    return called if called is not None and len(first[called].shape) == 2 else None


def _points(numbered: _Numbered, opened: Callable[[str], ArrayInFile]) -> str | None:
    """The name of numbered lists of points without the number, None where there are none."""
    lists: dict[str, ArrayInFile] = {}
    for called, found in numbered.items():
        arrays = [opened(found[number]) for number in sorted(found)]
        if all(_is_list(array) for array in arrays) and not (called == _UNNAMED and _differ(arrays)):
            lists[called] = arrays[0]
    return points_among(lists) or next(iter(lists), None)


def _is_list(array: ArrayInFile) -> bool:
    """Whether an array may hold one frame of points."""
    of_fields = array.dtype.names is not None
    return len(array.shape) == 2 - of_fields and may_be_points(array) and max(array.shape) >= _LEAST_ROWS


def _differ(arrays: Sequence[ArrayInFile]) -> bool:
    """Whether arrays without names hold different things, such as points with their normals or colours."""
    first, second = arrays[:2]
    if len({(array.dtype, array.shape[1:]) for array in arrays}) > 1:
        return True
    if first.shape != second.shape or first.dtype.names is not None:
        return False
    points, others = first.first(_LOOKED_AT), second.first(_LOOKED_AT)
    return any(holds(others) and not holds(points) for holds in (_are_normals, _are_colors))


def _are_normals(rows: NDArray) -> bool:
    lengths = np.linalg.norm(rows[:, :3].astype(np.float64), axis=1)
    return bool((np.abs(lengths - 1) < _UNIT).all())


def _are_colors(rows: NDArray) -> bool:
    return bool(((rows >= 0) & (rows <= 1)).all())

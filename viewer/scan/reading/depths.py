"""Decides which numbers of a depth picture were measured, and which pictures lie over it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..points import NOT_FINITE
from .camera import Size, have_same_aspect
from .missing import KEY, NONE, unmeasured_value
from .record import Decision, Source
from .sequence import Decided

_ALIKE = 0.02  # how far the ratio of aspect ratios of colours and depth may be from 1
_NOTHING_AHEAD = -1.0  # what some programs write where they measured nothing
_FARTHEST = 1e10  # what renderers write where nothing is, and more


def measured_depths(stored: NDArray, decided: Decided, always: tuple[float, ...] = ()) -> NDArray[np.bool_]:
    """A mask of the depths, of any type and shape, that were measured; the decision goes into the record.

    always: numbers that mean "not measured" in this kind of picture, whatever else it holds.
    """
    stated = decided.corrections.get(KEY)
    is_float = stored.dtype.kind == "f"
    measured = np.isfinite(stored) if is_float else np.ones(stored.shape, bool)
    if stated == NONE:
        decided.note(Decision(KEY, NONE, "user", "--read"))
        return measured
    if stated is not None:
        value = float(stated[-1] if isinstance(stated, tuple) else stated)
        decided.note(Decision(KEY, f"{value:g}", "user", "--read"))
        return measured & (stored != value)
    if is_float:
        measured &= np.abs(stored) < min(_FARTHEST, float(np.finfo(stored.dtype).max))
    values = list(always)
    if (found := unmeasured_value(stored)) is not None and found not in values:
        values.append(found)
    if _means_nothing(stored, measured):
        values.append(_NOTHING_AHEAD)
    removing, named = [], 0  # values, and how many pixels have one of them
    for value in values:
        rows = stored == stored.dtype.type(value)
        if rows.any():
            removing.append(f"{value:g}")
            named += int(np.count_nonzero(rows))
            measured &= ~rows
    removed = measured.size - int(np.count_nonzero(measured))
    if removed:
        why = f"Scan4D leaves out {removed:,} pixels of the picture"
        source: Source = "assumed" if removing else "file"
        alternatives = (NONE,) if removing else ()
        if removed > named:
            removing.append(NOT_FINITE)
        decided.note(Decision(KEY, ", ".join(removing), source, why=why, alternatives=alternatives))
    return measured


def _means_nothing(stored: NDArray, measured: NDArray[np.bool_]) -> bool:
    """Whether -1 means "not measured": all other depths are above 0, as depths ahead of a camera are."""
    if stored.dtype.kind == "u" or not stored.size or stored.min(initial=0, where=measured) != _NOTHING_AHEAD:
        return False
    others = measured & (stored != _NOTHING_AHEAD)
    return bool(others.any() and (stored[others] > 0).all())


def lying_over(image: NDArray, depth: NDArray, what: str, decided: Decided) -> NDArray | None:
    """The image over the depth, as `over_depth`; None where it has another shape, which the record and a
    message say. what: the image is, in words."""
    if (fitting := over_depth(image, depth)) is None:
        sizes = f"{_shown(image)} pixels, but its depth picture has {_shown(depth)}"
        decided.note_unused(f"{what} of {sizes}")
        decided.report("camera", f"Scan4D does not use the {what}, because a picture has {sizes}")
    return fitting


def over_depth(image: NDArray, depth: NDArray) -> NDArray | None:
    """The image, (h, w) or (h, w, C), at the pixels of the depth (H, W); None where it has another shape.

    Each pixel of the depth gets the nearest one of the image. Both show the same if aspect ratios agree.
    """
    (height, width), (rows, columns) = depth.shape, image.shape[:2]
    if (height, width) == (rows, columns):
        return image
    if not have_same_aspect((columns, rows), (width, height), _ALIKE):
        return None
    row, column = (
        (np.arange(count) * 2 + 1) * other // (2 * count)
        for count, other in ((height, rows), (width, columns))
    )
    return np.ascontiguousarray(image[row[:, None], column])


def size_of_image(image: NDArray) -> Size:
    """Width and height of an image, pixels."""
    return image.shape[1], image.shape[0]


def _shown(image: NDArray) -> str:
    return "{} x {}".format(*size_of_image(image))

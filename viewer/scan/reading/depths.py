"""Decides which numbers of a depth picture were measured."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .missing import KEY, NONE, unmeasured_value
from .record import Decision
from .sequence import Decided

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
    removing = []
    for value in values:
        rows = stored == stored.dtype.type(value)
        if rows.any():
            removing.append(f"{value:g}")
            measured &= ~rows
    if removing:
        why = f"Scan4D leaves out {measured.size - int(np.count_nonzero(measured)):,} pixels of the picture"
        decided.note(Decision(KEY, ", ".join(removing), "assumed", why=why, alternatives=(NONE,)))
    return measured

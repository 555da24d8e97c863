"""How commands print facts: a name and its value on each line."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import shortened
from ._console import escaped


def named_lines(rows: Sequence[tuple[str, Any]]) -> str:
    """Names and their values, below one another."""
    shown = [(escaped(shortened(name)), escaped(str(value))) for name, value in rows]
    width = max(len(name) for name, _ in shown)
    return "\n".join(f"{name:{width}}  {value}" for name, value in shown)


def extent(values: NDArray) -> list[float] | None:
    """[lowest, highest] of the finite values, None where there is none."""
    finite = values[np.isfinite(values)]
    return [float(finite.min()), float(finite.max())] if finite.size else None

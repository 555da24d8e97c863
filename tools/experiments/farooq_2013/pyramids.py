"""Pyramidal projection with numbers of levels, as the thesis draws it (7.3.1, Fig. 7.10)."""

from __future__ import annotations

from typing import Any

from experiments.papers import figures
from viewer.backends import backend

PAPER = figures("farooq_2013")  # Table 7.2 and the memory of 4.4
BACKEND = "pyramidal"
MOST_LEVELS = 5
HIDE = "hide"  # the parameter: whether the backend looks for samples behind others
PRIMITIVES = ("points", "polygons")


def with_levels(count: int, primitive: str, **others: Any) -> Any:
    """Parameters that show so many levels, the finest first; 1: what was measured alone."""
    shown = {f"level_{level}": level < count for level in range(MOST_LEVELS)}
    return backend(BACKEND).params({**shown, "fill": count > 1, "primitive": primitive, **others})

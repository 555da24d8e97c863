"""What a backend is given for a frame."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

from ..view import View
from .target import RenderTarget

CHANGES = ("pose", "camera", "parameters", "size", "values")  # what can differ from the last picture


class Before(NamedTuple):
    """A picture whose points are drawn again. known: see `Stats`."""

    target: RenderTarget
    known: float


@dataclass(frozen=True, eq=False)
class FrameView:
    """Order for one frame, as a backend gets it: a view, its own parameters, and its derived data.

    share: share of the points to draw, less than 1 while the picture moves and all points take too long.
    A backend that leaves points out returns True and counts them (`Points.of` does). A fast backend may draw
    all points. budget_ms: time after which a backend draws something coarser, if it can, and returns True;
    None: no limit. changed: the members of `CHANGES` that differ from the last call for this surface; all of
    them in the first call and after a failed one. "values" stands for the results of `Surface.row_values` and
    `Surface.resolve`. moving: whether other pictures follow at once. A backend that then draws something
    simpler sets `surface.stats.simplified`; it is called again at rest. before: the last picture of this pose
    with these parameters; a moving picture of a share may draw its points again (splatting/kept.py).
    coarsest: the `Stats.coarseness` of the picture before, of whatever pose; infinite if there is none. A
    backend does not draw an unfinished picture that is coarser.
    """

    view: View
    params: Any
    derived: Any = None
    share: float = 1.0
    budget_ms: float | None = None
    changed: frozenset[str] = frozenset(CHANGES)
    moving: bool = False
    before: Before | None = None
    coarsest: float = math.inf

"""What of lines and places over the picture is seen."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...analysis.pick import are_seen
from ...output.overlays import LINE_SLACK
from ..tool_context import ToolContext


def seen_in_view(
    context: ToolContext, places: NDArray[np.float64], slacks: NDArray[np.float64] | None = None
) -> NDArray[np.bool_]:
    """Whether places (N, 3), where the scan is shown, have nothing before them in the picture, (N,); all of
    them where there is no picture. slacks: (N,), how far before each the surface may be that is its own;
    None: as for lines."""
    viewport, pose = context.viewport, context.pose
    if viewport.surface is None or pose is None or not viewport.is_there:
        return np.ones(len(places), bool)
    if slacks is None:
        slacks = np.full(len(places), LINE_SLACK * viewport.bounds(pose).radius)
    return are_seen(viewport.surface, places, slacks)

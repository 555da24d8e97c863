"""What of the lines over the picture is seen."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ....analysis.pick import are_seen
from ....output.overlays import LINE_SLACK
from ...tool_context import ToolContext


def seen_in_view(context: ToolContext, places: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Whether places (N, 3), where the scan is shown, have nothing before them in the picture, (N,); all of
    them where there is no picture."""
    viewport, pose = context.viewport, context.pose
    if viewport.surface is None or pose is None or not viewport.is_there:
        return np.ones(len(places), bool)
    slack = LINE_SLACK * viewport.bounds(pose).radius
    return are_seen(viewport.surface, places, np.full(len(places), slack))

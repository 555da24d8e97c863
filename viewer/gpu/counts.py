"""What became of the points of a picture. Plain numpy, on any thread."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..scan.points import PointCloud
from ..task import checkpoint
from ..view import View
from .constants import NOTHING
from .sample import is_sampled

_CHUNK = 1 << 20  # points counted at a time


def count_points(
    cloud: PointCloud, view: View, rows: NDArray[np.uint32], share: float, faces_away: bool = False
) -> dict[str, int]:
    """Count what became of the points of the file: "in", and of these "drawn" (they have a pixel),
    "dropped" (not finite), "preview" (not in the share that was drawn from; only where that is not
    all), "outside" (the centre is not in the picture or not between near and far), "away" (they face
    away from the eye; only where such points were left out) and "hidden" (the rest).

    rows: (H, W), which point each pixel shows, 0xFFFFFFFF where none. faces_away: whether points
    that face away were left out.
    """
    shown = np.zeros(len(cloud), bool)
    shown[rows[rows != NOTHING]] = True
    hidden = left_out = away = 0
    for start in range(0, len(cloud), _CHUNK):
        checkpoint(start / len(cloud))
        part = slice(start, start + _CHUNK)
        others = ~shown[part]
        if share < 1:
            sampled = is_sampled(np.arange(start, start + len(others), dtype=np.uint32), share)
            left_out += int(np.count_nonzero(~sampled))
            others &= sampled
        inside = view.contains(cloud.positions[part]) & others
        if faces_away and cloud.normals is not None:
            turned = inside & view.faces_away(cloud.positions[part], cloud.normals[part])
            away += int(np.count_nonzero(turned))
            inside &= ~turned
        hidden += int(np.count_nonzero(inside))
    drawn = int(np.count_nonzero(shown))
    return {
        "in": len(cloud) + cloud.dropped,
        "drawn": drawn,
        "dropped": cloud.dropped,
        **({"preview": left_out} if share < 1 else {}),
        **({"away": away} if faces_away else {}),
        "outside": len(cloud) - drawn - hidden - left_out - away,
        "hidden": hidden,
    }

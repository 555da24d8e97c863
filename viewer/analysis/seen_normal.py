"""Where the surface in a pixel faces, from the picture around it: of a floor, what is up."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..picture.surface import Surface

_REACH = 24  # parts of the picture's height that are looked at to each side
_LEAST = 8  # pixels to each side, and of the surface at all
_ROUNDS = 4  # of leaving out what is off the plane
_OFF = 2.5  # median distances from it


def seen_normal(surface: Surface, x: int, y: int) -> NDArray[np.float64] | None:
    """The unit normal, (3,) in the world, of the plane through what pixel (x, y) and those around it show,
    towards the eye; None where too little of a surface is there. Row 0 is the top."""
    view, reach = surface.view, max(surface.size[1] // _REACH, _LEAST)
    depths = surface.depth_around(x, y, reach).astype(np.float64)
    is_seen = np.isfinite(depths)
    if not is_seen[reach, reach]:
        return None
    down, across = np.nonzero(is_seen)
    pixels = np.stack([across + x - reach + 0.5, down + y - reach + 0.5], axis=1)
    points = view.unproject(pixels, depths[is_seen])
    middle = view.unproject(np.array([[x + 0.5, y + 0.5]]), depths[reach, reach][None])[0]
    away = np.linalg.norm(points - middle, axis=1)
    radius = reach * view.footprint(depths[reach, reach])
    kept = points[away <= 2 * radius]  # else of what is before it or behind
    for _ in range(_ROUNDS):
        if len(kept) < _LEAST:
            return None
        center = kept.mean(axis=0)
        normal = np.linalg.eigh(np.cov((kept - center).T))[1][:, 0]
        off = np.abs((kept - center) @ normal)
        kept = kept[off <= max(_OFF * float(np.median(off)), 1e-6 * radius)]
    toward_eye = -view.along(np.array([x + 0.5, y + 0.5]))
    facing_eye = surface.layers.world_from_pose.directions(normal if normal @ toward_eye >= 0 else -normal)
    return facing_eye.astype(np.float64)

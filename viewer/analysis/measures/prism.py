"""All of a surface that lies in a prism: what a region goes around and what is before and behind it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ...mesh.cutting import plane_section
from ...mesh.geodesic import Line
from ...mesh.patch import Patch
from .outlines import Prism
from .surface import PoseSurface

_PARTS = 8  # into which each side of a face on the rim is divided
_SLAB = 2.0  # spacings around the prism that its patch reaches


def patch_through(surface: PoseSurface, prism: Prism) -> Patch:
    """The part of a surface in a prism and a little around it; the prism is relative to the origin."""
    return surface.patch(lambda points: prism.beyond(points) - _SLAB * surface.spacing)


def area_through(patch: Patch, prism: Prism) -> NDArray[np.float64]:
    """How much of each face of a patch lies in a prism, (F,), squared scan units; those on the rim as many of
    64 parts as have their middles in it."""
    widths = np.linalg.norm(patch.corners - np.roll(patch.corners, 1, axis=0), axis=2).max(axis=0)
    inside = prism.beyond(patch.vertices)[patch.faces]
    share = (inside.mean(axis=1) < 0).astype(np.float64)
    on_rim = np.flatnonzero((np.abs(inside) <= widths[:, None]).any(axis=1))
    share[on_rim] = prism.has(prism.flat(middles_of(patch, on_rim))).mean(axis=1)
    areas: NDArray[np.float64] = share * np.linalg.norm(patch.doubled, axis=1) / 2
    return areas


def share_through(patch: Patch, prism: Prism, flat: NDArray[np.float64]) -> float:
    """How much of some positions in the plane of a prism, (N, 2), has a surface before or behind it, 0 to 1;
    NaN without positions. Where surfaces face both ways, as those of a body do, the share is that of the side
    that has less, unless it has less than half as much as the other.
    """
    import open3d

    if not len(flat):
        return float("nan")
    reach = np.abs((patch.vertices - prism.center) @ prism.normal).max() + 1
    starts = prism.center + flat @ prism.axes - reach * prism.normal
    rays = np.concatenate([starts, np.broadcast_to(prism.normal, starts.shape)], axis=1, dtype=np.float32)
    scene, tensor = open3d.t.geometry.RaycastingScene(), open3d.core.Tensor.from_numpy
    scene.add_triangles(tensor(patch.vertices.astype(np.float32)), tensor(patch.faces.astype(np.uint32)))
    met = scene.list_intersections(tensor(rays))
    positions, faces = met["ray_ids"].numpy(), met["primitive_ids"].numpy()
    faces_up = patch.doubled[faces] @ prism.normal > 0
    sides = [len(np.unique(positions[faces_up == side])) / len(flat) for side in (True, False)]
    return min(share for share in sides if 2 * share >= max(sides))


def middles_of(patch: Patch, faces: NDArray[np.intp]) -> NDArray[np.float64]:
    """The middles of the 64 parts of equal area of faces by number, (F', 64, 3)."""
    return np.tensordot(patch.corners[:, faces], _MIDDLES, (0, 1)).transpose(0, 2, 1)


def near_rim(patch: Patch, prism: Prism, reach: float) -> Patch:
    """The faces of a patch that have a corner no farther than `reach` off the walls of a prism."""
    near = np.abs(prism.beyond(patch.vertices)) <= reach
    return Patch.of(patch.vertices, patch.faces[near[patch.faces].any(axis=1)])


def _middles(parts: int) -> NDArray[np.float64]:
    """The middles of the equal triangles that a triangle is divided into, as weights, (parts^2, 3)."""
    found = []
    for i in range(parts):
        for j in range(parts - i):
            found.append((i + 1 / 3, j + 1 / 3))
            if i + j < parts - 1:
                found.append((i + 2 / 3, j + 2 / 3))
    one, other = np.array(found).T / parts
    return np.stack([one, other, 1 - one - other], axis=1)


_MIDDLES = _middles(_PARTS)


def rim_through(patch: Patch, prism: Prism, walls: Sequence[int] | None = None) -> list[Line]:
    """The lines in which the walls of a prism cut a patch, each (P, 3). walls: of these corners to the next;
    None: all."""
    lines: list[Line] = []
    sides = np.roll(prism.corners, -1, axis=0) - prism.corners
    for wall in range(len(sides)) if walls is None else walls:
        length = float(np.hypot(*sides[wall]))
        if not length:
            continue
        along = sides[wall] @ prism.axes / length
        start = prism.center + prism.corners[wall] @ prism.axes
        for line in plane_section(patch, start, np.cross(along, prism.normal)):
            lines += _between(line, (line - start) @ along, length)
    return lines


def _between(line: Line, at: NDArray[np.float64], length: float) -> list[Line]:
    """The pieces of a line that are between 0 and a length, where its positions are `at`."""
    pieces: list[list[NDArray[np.float64]]] = []
    for start, end, a, b in zip(line[:-1], line[1:], at[:-1], at[1:], strict=True):
        low, high = (0.0, 1.0) if a == b else sorted((-a / (b - a), (length - a) / (b - a)))
        low, high = max(low, 0.0), min(high, 1.0)
        if low >= high or (a == b and not 0 <= a <= length):
            continue
        if not pieces or low > 0:
            pieces.append([start + low * (end - start)])
        pieces[-1].append(start + high * (end - start))
        if high < 1:
            pieces.append([])
    return [np.array(piece) for piece in pieces if len(piece) > 1]

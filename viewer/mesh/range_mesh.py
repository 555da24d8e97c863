"""Range views as triangle meshes: what scanners' own software makes of a range image."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..scan.faces import Triangles
from ..scan.range_view import RangeView, merge
from .scene import Rays
from .triangles import Mesh

_STEEPEST = 10.0  # the steepest depth step on a surface, in distances between neighbours: 84 degrees
_SCATTER = 2.0  # how far samples lie off the surface, in the same


def triangulated(views: Sequence[RangeView]) -> Mesh:
    """The mesh of range views: neighbours in each grid joined by triangles that face its pod.

    Four neighbours become two triangles, three become one, but for triangles with an edge along which depth
    steps by more than ten times the distance between neighbours. Vertices are the points of the views with
    colours and the normals of the grid, as `merge` has them; views are not joined with each other. Raises
    InputError where there is no triangle.
    """
    if not views:
        raise InputError("there are no range views from which to make a mesh")
    points = merge(views, normals=True)
    faces, before = [], 0
    for view in views:
        own = triangles_of(view)
        faces.append(own + np.uint32(before))
        before += int(np.count_nonzero(view.valid()))
    if not sum(map(len, faces)):
        raise InputError("neighbouring samples of the range views do not lie on the same surface")
    return Mesh(points, np.concatenate(faces))


def was_scanned(views: Sequence[RangeView], points: Rays) -> NDArray[np.bool_]:
    """Tell which places (N, 3) of the true surface the views have measured, (N,).

    A view has measured a place where the nine samples around its pixel are all there and of one surface, and
    its depth lies between theirs, or within two distances between neighbours of them. So the rim of a scan,
    where surfaces end between samples, has no part.
    """
    scanned = np.zeros(len(points), bool)
    for view in views:
        pixels, depth = view.project(points)
        height, width = view.depth.shape
        with np.errstate(invalid="ignore"):  # NaN: not before the pod
            inside = np.flatnonzero(((pixels >= 0) & (pixels < (width, height))).all(axis=1))
        column, row = np.floor(pixels[inside]).astype(np.intp).T
        depth, step = depth[inside], _largest_step(view, depth[inside])
        samples = np.pad(np.where(view.valid(), view.depth, np.float32(np.nan)), 1, constant_values=np.nan)
        own = samples[row + 1, column + 1]
        around = np.stack([samples[row + down, column + right] for down, right in np.ndindex(3, 3)])
        one_surface = (np.abs(around - own) <= step).all(axis=0)
        margin = _SCATTER / _STEEPEST * step
        between = (depth >= around.min(axis=0) - margin) & (depth <= around.max(axis=0) + margin)
        scanned[inside[one_surface & between]] = True
    return scanned


def triangles_of(view: RangeView) -> Triangles:
    """The triangles of one view: rows of its valid pixels, counterclockwise as its pod sees them."""
    return _triangles(view, [(0, 1, 2), (0, 2, 3)])


def replacements_of(view: RangeView) -> tuple[Triangles, NDArray[np.uint32]]:
    """The triangles that one view gains when pixels are masked: each takes the place of what had the pixel as
    a corner, between the three neighbours that stay. Faces (F, 3), and the masked pixels (F,), rows of its
    valid pixels."""
    corners = _triangles(view, [(1, 2, 3, 0), (3, 0, 1, 2)])
    return corners[:, :3], corners[:, 3]


def _triangles(view: RangeView, triangles: Sequence[tuple[int, ...]]) -> Triangles:
    """Corners of all quads of a view, picked by number, where the first three are of one surface and all are
    valid. Corners run around a quad counterclockwise; its triangles share those of number 0 and 2."""
    valid = view.valid()
    number = (np.cumsum(valid) - 1).reshape(valid.shape).astype(np.uint32)
    depth = np.where(valid, view.depth, np.float32(np.nan)).astype(np.float64)

    quad = [(slice(0, -1), slice(0, -1)), (slice(1, None), slice(0, -1)),
            (slice(1, None), slice(1, None)), (slice(0, -1), slice(1, None))]  # fmt: skip
    corners = np.stack([number[at].ravel() for at in quad])
    depths = np.stack([depth[at].ravel() for at in quad])
    # Of both diagonals the one along which depth changes less; where a corner lacks, the other one.
    change = np.abs(depths[:2] - depths[2:])
    turned = np.flatnonzero(np.isnan(change[0]) | (change[1] < change[0]))
    corners[:, turned], depths[:, turned] = (np.roll(rows[:, turned], -1, 0) for rows in (corners, depths))

    found = []
    for each in triangles:
        whole = ~np.isnan(depths[list(each)]).any(axis=0)
        found.append(corners[list(each)].T[whole & _on_one_surface(depths[list(each[:3])], view)])
    return np.concatenate(found)


def _on_one_surface(depths: NDArray[np.float64], view: RangeView) -> NDArray[np.bool_]:
    """Tell which triangles, depths of corners (3, N), have no edge that is too steep."""
    nearest, farthest = depths.min(axis=0), depths.max(axis=0)  # NaN where a corner lacks
    return farthest - nearest <= _largest_step(view, nearest)


def _largest_step(view: RangeView, depth: NDArray[np.floating]) -> NDArray[np.float64]:
    """How far depths of neighbours on one surface may lie apart, at depths of any shape, scan units."""
    away = np.ones(depth.shape) if view.kind == "height" else np.asarray(depth, np.float64)
    return _STEEPEST / min(view.fx, view.fy) * away

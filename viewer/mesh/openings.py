"""Openings of a patch: its borders, the pockets behind them, and paths that go around them.

An open mouth is a hole in a surface that cameras measured, and the neck of a bag in a model of a whole head.
Either way the skin ends at the rim of the lips. `without_pockets` takes bags away, so that all the rest has
to know about openings is borders.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .geodesic import Line
from .manifold import Rows, joined
from .patch import SMALL_HOLE, Patch

_OFF = 0.5  # spacings above the patch, where rays begin
_SAME = 1e-6  # of the length of a line, within which its places are on the border


def without_pockets(patch: Patch, seeds: Sequence[int], spacing: float) -> Patch:
    """The patch without the pockets behind its openings.

    seeds: numbers of faces. spacing: of points, scan units. The front is what connects to the seeds over
    faces that are open: the ray along the normal of most of their corners meets the patch nowhere. In a
    pocket, and in a fold, it meets the other side. A pocket is a connected part of what is not the front, see
    `_is_pocket`; holes of the patch do not interrupt it. A part with a seed is none.
    """
    whole = patch.closed(_inner_holes(patch))
    is_open = _misses(whole, spacing)[whole.faces].sum(axis=1) > 1
    before, after = whole.pairs
    one, other = before // 3, after // 3
    both = is_open[one] & is_open[other]
    _, part = joined(one[both], other[both], len(whole.faces))
    seen = [seed for seed in seeds if is_open[seed]]
    is_front = np.isin(part, part[np.array(seen, np.intp)])
    behind = ~is_front
    both = behind[one] & behind[other]
    count, part = joined(one[both], other[both], len(whole.faces))
    rim = np.concatenate([before[behind[one] & is_front[other]], after[behind[other] & is_front[one]]])
    of_rim, is_pocket = part[rim // 3], np.zeros(count, bool)
    for number in np.flatnonzero(np.bincount(of_rim, minlength=count) > SMALL_HOLE):
        faces, edges = np.flatnonzero(part == number), rim[of_rim == number]
        is_pocket[number] = not np.isin(faces, seeds).any() and _is_pocket(whole, faces, edges)
    stays = ~is_pocket[part[: len(patch.faces)]]
    return patch if stays.all() else patch.of_faces(np.flatnonzero(stays))


def _inner_holes(patch: Patch) -> Rows:
    """The holes of a patch by number, but for the longest of each connected part, around which it ends."""
    start, end = patch.border
    if not len(start):
        return patch.holes
    lengths = np.bincount(patch.holes, np.linalg.norm(patch.vertices[end] - patch.vertices[start], axis=1))
    part = np.zeros(len(lengths), np.int64)
    part[patch.holes] = patch.parts[start]
    order = np.lexsort((lengths, part))
    return order[:-1][part[order[1:]] == part[order[:-1]]]


def _misses(patch: Patch, spacing: float) -> NDArray[np.bool_]:
    """Whether the ray along the normal of each vertex meets the patch nowhere, (V,)."""
    import open3d

    lengths = np.linalg.norm(patch.vertex_normals, axis=1, keepdims=True)
    normals = patch.vertex_normals / np.maximum(lengths, np.finfo(float).tiny)
    middle = patch.vertices.mean(axis=0)
    local = patch.vertices - middle
    rays = np.concatenate([local + _OFF * spacing * normals, normals], axis=1, dtype=np.float32)
    scene, tensor = open3d.t.geometry.RaycastingScene(), open3d.core.Tensor.from_numpy
    scene.add_triangles(tensor(local.astype(np.float32)), tensor(patch.faces.astype(np.uint32)))
    return ~scene.test_occlusions(tensor(rays)).numpy()


def _is_pocket(patch: Patch, faces: Rows, rim: Rows) -> bool:
    """Whether faces by number are a pocket behind their rim, half-edges by number.

    The rim is closed. The faces lie inwards of it, and have more than twice the area that it spans: a
    hemisphere has just twice.
    """
    start, end = patch.faces.ravel()[rim], np.roll(patch.faces, -1, axis=1).ravel()[rim]
    if (np.sort(start) != np.sort(end)).any():
        return False
    a, b = patch.vertices[start], patch.vertices[end]
    middle = a.mean(axis=0)
    spanned = np.cross(a - middle, b - middle).sum(axis=0) / 2
    across = patch.doubled[faces] @ spanned
    heights = (patch.corners[:, faces].mean(axis=0) - middle) @ spanned
    area = np.linalg.norm(patch.doubled[faces], axis=1).sum() / 2
    return bool((heights * across).sum() < 0 and area > 2 * np.linalg.norm(spanned))


def detour(patch: Patch, line: Line) -> float:
    """How much longer a shortest path over a patch is, (P, 3), as it goes around holes or along borders, scan
    units.

    It is straight but for where it turns at a border. This is by how much it is longer than the straight line
    between its ends where it is rolled out into a plane, its pieces as long and its turns as large.
    """
    from scipy.spatial import cKDTree

    lengths = np.linalg.norm(np.diff(line, axis=0), axis=1)
    line, lengths = line[np.append(True, lengths > 0)], lengths[lengths > 0]
    border = np.unique(patch.border[0])
    if not len(border) or len(line) < 3:
        return 0.0
    away, which = cKDTree(patch.vertices[border]).query(line[1:-1])
    headings = np.zeros(len(lengths))
    for place in np.flatnonzero(away <= _SAME * lengths.sum()) + 1:
        headings[place] = _turn(patch, int(border[which[place - 1]]), line[place - 1], line[place + 1])
    across = np.abs((lengths * np.exp(1j * np.cumsum(headings))).sum())
    return max(float(lengths.sum() - across), 0.0)


def _turn(patch: Patch, vertex: int, before: NDArray[np.float64], after: NDArray[np.float64]) -> float:
    """The angle by which a path turns at a vertex on a border, from one place of the faces around it to
    another, (3,) each: the angle between these over the faces less pi, to the left positive, radians."""
    faces = patch.faces[(patch.faces == vertex).any(axis=1)]
    first = (faces == vertex).argmax(axis=1)[:, None]
    right, left = np.take_along_axis(faces, (first + np.array([1, 2])) % 3, axis=1).T
    following = dict(zip(right.tolist(), left.tolist(), strict=True))
    fan = [next(iter(following.keys() - set(following.values())))]
    while fan[-1] in following:
        fan.append(following[fan[-1]])
    edges = patch.vertices[fan] - patch.vertices[vertex]
    wide = _between(edges[:-1], edges[1:])
    angles = []
    for place in (before, after):
        from_right, from_left = (
            _between(side, place - patch.vertices[vertex]) for side in (edges[:-1], edges[1:])
        )
        face = int(np.argmin(from_right + from_left - wide))
        angles.append(float(wide[:face].sum() + from_right[face]))
    over = angles[1] - angles[0]
    return float(np.sign(over)) * max(abs(over) - np.pi, 0.0)


def _between(one: NDArray[np.float64], other: NDArray[np.float64]) -> NDArray[np.float64]:
    """The angles between vectors (N, 3), radians."""
    return np.arctan2(np.linalg.norm(np.cross(one, other), axis=-1), (one * other).sum(axis=-1))

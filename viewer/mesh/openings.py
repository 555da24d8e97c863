"""Openings of a patch: its borders, the pockets behind them, and paths that go around them.

An open mouth is a hole in a surface that cameras measured, and the neck of a bag in a model of a whole head.
Either way the skin ends at the rim of the lips. `without_pockets` takes bags away, so that all the rest has
to know about openings is borders.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from heapq import heappop, heappush
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from .geodesic import Line
from .manifold import Rows, joined
from .patch import SMALL_HOLE, Patch
from .smoothing import Points

_OFF = 0.5  # spacings above the patch, where rays begin
_RAYS = 12
_OPEN = 8  # of these that reach the sky, from which on a vertex is open; by a wall at a right angle half do
_THIN = 1e-5  # of the longest edge of a lid: the least width of its faces
_SAME = 1e-6  # of the length of a line, within which its places are on the border


Marks = Callable[[Points], NDArray[np.bool_]]  # takes places (N, 3), gives (N,)


def without_pockets(patch: Patch, seeds: Sequence[int], spacing: float) -> Patch:
    """The patch without the pockets behind its openings.

    seeds: numbers of faces. spacing: of points, scan units. The front is what connects to the seeds over
    faces of which most corners are open, see `_is_open`. A pocket is a connected part of what is not the
    front, see `_is_pocket`; holes of the patch do not interrupt it. A part with a seed is none.
    """
    whole = patch.closed(inner_holes(patch))
    is_open = _is_open(whole, spacing)[whole.faces].sum(axis=1) > 1
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


def inner_holes(patch: Patch, is_cut: Marks | None = None) -> Rows:
    """The holes of a patch by number, but for the longest of each connected part, around which it ends.

    is_cut: whether the patch was cut out of its surface at places; holes there are none.
    """
    start, end = patch.border
    if not len(start):
        return patch.holes
    lengths = np.bincount(patch.holes, np.linalg.norm(patch.vertices[end] - patch.vertices[start], axis=1))
    if is_cut is not None:
        lengths[patch.holes[is_cut(patch.vertices[start])]] = np.inf
    part = np.zeros(len(lengths), np.int64)
    part[patch.holes] = patch.parts[start]
    order = np.lexsort((lengths, part))
    inner = order[:-1][part[order[1:]] == part[order[:-1]]]
    return inner[np.isfinite(lengths[inner])]


def bridged(patch: Patch, holes: Rows) -> Patch:
    """The patch with lids over some of its holes, by number; their faces stand behind those that there are.

    The face on three vertices in a row with the least circumcircle comes first, again and again: so a lid
    joins the sides of a slit straight across, and has no flat faces. A vertex in the middle closes what is
    left where two vertices are joined already. A crack without width stays open.
    """
    start, end = patch.border
    chosen = np.isin(patch.holes, holes)
    before = dict(zip(end[chosen].tolist(), start[chosen].tolist(), strict=True))
    places = dict(zip(before, patch.vertices[list(before)].tolist(), strict=True))
    taken = _edges_among(patch, np.array(list(before), np.int64))
    vertices, faces = patch.vertices, [patch.faces]
    while before:
        loop = [next(iter(before))]
        while before[loop[-1]] != loop[0]:
            loop.append(before.pop(loop[-1]))
        del before[loop[-1]]
        lid, left = _zipped(loop, places, taken)
        added = [np.array(lid, np.int64).reshape(-1, 3)]
        wider = np.vstack([vertices, patch.vertices[left].mean(axis=0)]) if left else vertices
        if left:
            added.append(np.array([(a, b, len(vertices)) for a, b in pairwise([*left, left[0]])]))
        if _is_wide(wider[np.concatenate(added)]):
            faces, vertices = faces + added, wider
    sources = np.append(patch.sources, np.full(len(vertices) - len(patch.vertices), -1))
    return Patch(vertices, np.concatenate(faces), sources)


def _is_wide(corners: NDArray[np.float64]) -> bool:
    """Whether all faces with corners (F, 3, 3) are wider than rounding: paths over others cannot be found."""
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    doubled = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    return bool((doubled > _THIN * edges.max() * edges.max(axis=1)).all())


def _edges_among(patch: Patch, vertices: Rows) -> set[tuple[int, int]]:
    """The edges of a patch whose ends are both among some vertices, the lower number first."""
    is_among = np.zeros(len(patch.vertices), bool)
    is_among[vertices] = True
    ends = np.stack([patch.faces, np.roll(patch.faces, -1, axis=1)], axis=2).reshape(-1, 2)
    return set(map(tuple, np.sort(ends[is_among[ends].all(axis=1)], axis=1).tolist()))


def _zipped(
    loop: list[int], places: dict[int, list[float]], taken: set[tuple[int, int]]
) -> tuple[list[tuple[int, int, int]], list[int]]:
    """Faces over a loop of vertices, and the loop that is left where no two vertices may be joined; empty:
    none. taken: edges that there are; those of the faces are added."""
    before, after = dict(zip(loop[1:] + loop[:1], loop, strict=True)), dict(pairwise([*loop, loop[0]]))
    ears: list[tuple[float, int, int, int]] = []
    faces = []

    def offer(vertex: int) -> None:
        a, b = before[vertex], after[vertex]
        heappush(ears, (_circumradius(places[a], places[vertex], places[b]), vertex, a, b))

    for vertex in loop:
        offer(vertex)
    while ears and len(after) > 3:
        _, vertex, a, b = heappop(ears)
        edge = min(a, b), max(a, b)
        if before.get(vertex) != a or after.get(vertex) != b or edge in taken:
            continue
        faces.append((a, vertex, b))
        taken.add(edge)
        del before[vertex], after[vertex]
        before[b], after[a] = a, b
        offer(a)
        offer(b)
    first = next(iter(after))
    rest = [first]
    while after[rest[-1]] != first:
        rest.append(after[rest[-1]])
    return (faces, rest) if len(rest) > 3 else ([*faces, (rest[0], rest[1], rest[2])], [])


def _is_open(patch: Patch, spacing: float) -> NDArray[np.bool_]:
    """Whether most of the light that a bright sky would cast on each vertex reaches it, (V,).

    Enough rays in directions that carry equal light (Malley 1988) meet the patch nowhere. One ray along the
    normal does not tell: through a wide mouth the teeth see straight out.
    """
    import open3d

    lengths = np.linalg.norm(patch.vertex_normals, axis=1, keepdims=True)
    up = patch.vertex_normals / np.maximum(lengths, np.finfo(float).tiny)
    right = np.cross(up, np.eye(3)[np.abs(up).argmin(axis=1)])
    right /= np.maximum(np.linalg.norm(right, axis=1, keepdims=True), np.finfo(float).tiny)
    ahead = np.cross(up, right)
    local = patch.vertices - patch.vertices.mean(axis=0)
    scene, tensor = open3d.t.geometry.RaycastingScene(), open3d.core.Tensor.from_numpy
    scene.add_triangles(tensor(local.astype(np.float32)), tensor(patch.faces.astype(np.uint32)))
    starts, reached = local + _OFF * spacing * up, np.zeros(len(local), np.int64)
    for number in range(_RAYS):
        away, turn = math.sqrt((number + 0.5) / _RAYS), number * math.pi * (3 - math.sqrt(5))
        directions = away * (math.cos(turn) * right + math.sin(turn) * ahead) + math.sqrt(1 - away**2) * up
        rays = np.concatenate([starts, directions], axis=1, dtype=np.float32)
        reached += ~scene.test_occlusions(tensor(rays)).numpy()
    is_open: NDArray[np.bool_] = reached >= _OPEN
    return is_open


def _circumradius(a: list[float], b: list[float], c: list[float]) -> float:
    """The radius of the circle through three places; inf: they lie on a line."""
    x, y, z = math.dist(b, c), math.dist(c, a), math.dist(a, b)
    squared = (x + y + z) * (y + z - x) * (z + x - y) * (x + y - z)
    return x * y * z / math.sqrt(squared) if squared > 0 else math.inf


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

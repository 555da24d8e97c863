"""Where parts of a surface that are far apart along it come near each other in space, and fast."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from viewer.mesh.triangles import Mesh

_NEAR = 4.0  # spacings in space
_ALONG = 4.0  # times as far along the surface
_FAST = 1.0  # spacings a frame that the parts move against each other


def near_contact(
    meshes: Sequence[Mesh], paths: NDArray[np.float64], vertices: NDArray[np.integer], spacing: float
) -> NDArray[np.bool_]:
    """Tell in which frames positions are near fast contact of the surface with itself, (T, N).

    They are where a vertex moves against the position by more than a spacing to the frame before or after, is
    nearer to it than it moves so or than 4 spacings, and more than four times as far along the edges of the
    first mesh: then it may be taken for the position. meshes: T of the same faces. paths: (T, N, 3) of the
    positions; vertices: (N,), one beside each.
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import dijkstra

    points = np.array([mesh.points.world() for mesh in meshes])
    edges = np.concatenate(
        [meshes[0].faces[:, [0, 1]], meshes[0].faces[:, [1, 2]], meshes[0].faces[:, [2, 0]]]
    )
    lengths = np.linalg.norm(points[0][edges[:, 0]] - points[0][edges[:, 1]], axis=1)
    # An edge of two faces is there twice, which would add up.
    edges, first = np.unique(np.sort(edges, axis=1), axis=0, return_index=True)
    graph = coo_matrix((lengths[first], edges.T), shape=(points.shape[1],) * 2).tocsr()
    along = dijkstra(graph, directed=False, indices=vertices)
    steps = np.diff(points, axis=0)
    own_steps = np.diff(paths, axis=0)
    touching = np.zeros(paths.shape[:2], bool)
    for frame, number in np.ndindex(*touching.shape):
        moves = [
            np.linalg.norm(steps[step] - own_steps[step, number], axis=1)
            for step in (frame - 1, frame)
            if 0 <= step < len(steps)
        ]
        fast = np.max(moves, axis=0) > _FAST * spacing
        reach = np.maximum(np.max(moves, axis=0), _NEAR * spacing)
        near = np.linalg.norm(points[frame] - paths[frame, number], axis=1) < reach
        touching[frame, number] = (fast & near & (along[number] > _ALONG * reach)).any()
    return touching

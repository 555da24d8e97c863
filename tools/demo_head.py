"""Spreads the points of the demo scan over the head at rest, and colours them.

`python tools/demo_head.py` writes assets/demo_head.npz anew, in about a minute.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from viewer.files import whole_file
from viewer.scan.demo import colors, head
from viewer.scan.demo.asset import RestPoints, asset_path
from viewer.scan.demo.shapes import bump, ramp
from viewer.scan.demo.solids import Rows, Solid, projected

Shows: TypeAlias = Callable[[NDArray, float], NDArray[np.bool_]]

COUNT = 88_000  # points before those hidden for good are left out
SEED = 20
_NEIGHBORS = 12
_RELAXATIONS = 40
_MARGIN = 1.0  # mm of surface beyond what shows, so that relaxing leaves no thin edge
_BOX = ((-96.0, 96.0), (-144.0, 134.0), (-112.0, 118.0))  # mm, around the head
_CELL = 2.0  # mm
_EXACT = 1e-6  # mm; in a sharp fold Newton's steps may not settle, such points are left out
_BATCH = 1 << 15  # points evaluated at a time, so that intermediate results stay in the cache


def sample(count: int = COUNT, seed: int = SEED) -> RestPoints:
    """Spread points over skin and eyeballs, denser where there is more to see, and colour them."""
    rng = np.random.default_rng(seed)
    parts = [
        _spread(head.skin, _skin_shows, round(0.965 * count), rng),
        _spread(head.eyes, _eye_shows, round(0.035 * count), rng),
    ]
    points, normals, distances = (np.concatenate(arrays, axis=-1) for arrays in zip(*parts, strict=True))
    skin = parts[0][0].shape[1]
    return RestPoints(
        positions=points.astype(np.float32),
        normals=normals.astype(np.float32),
        colors=np.rint(255.0 * colors.albedo(points, normals, skin)).astype(np.uint8),
        radii=distances.astype(np.float32),
        skin=skin,
    )


def wanted_spacing(p: NDArray) -> NDArray:
    """How far apart points (3, N) should be, relative to those on the cheeks, (N,)."""
    side, y, z = np.abs(p[0]), p[1], p[2]
    wanted = 1.0 + 0.8 * ramp(-z, -40.0, 20.0) + 0.3 * ramp(y, 62.0, 80.0) + 0.1 * ramp(-y, 90.0, 125.0)
    wanted -= 0.7 * bump(side, y, z, (30.5, 10.0, 72.0), (13.0, 6.0, 9.0))  # eyes
    wanted -= 0.55 * bump(side, y, z, (0.0, -60.0, 90.0), (22.0, 6.0, 9.0))  # lips
    wanted -= 1.0 * bump(side, y, z, (80.0, 0.0, -18.0), (12.0, 28.0, 18.0))  # ears
    return np.maximum(wanted, 0.3)


def _skin_shows(p: NDArray, margin: float) -> NDArray[np.bool_]:
    """Points (3, N) of the skin that no eyeball hides; a margin in mm lets more pass."""
    return head.eyes(*p) > -0.3 - margin


def _eye_shows(p: NDArray, margin: float) -> NDArray[np.bool_]:
    """Points (3, N) of the eyeballs that the lids show, or could show as they move."""
    return head.skin(*p) > -1.2 - margin


def _spread(solid: Solid, shows: Shows, count: int, rng: np.random.Generator) -> tuple[Rows, Rows, Rows]:
    """About `count` points (3, N) on a solid, their normals (3, N) and distances to neighbours (N,).

    Random points, moved apart along the surface by repulsion until their distances are even
    (Witkin and Heckbert 1994, 4).
    """
    points, normals = projected(solid, _scattered(solid, shows, count, rng))
    for _ in range(_RELAXATIONS):
        near, distances = _neighbors(points, normals)
        reach = _even_spacing(points, distances)
        push = 0.3 * reach * np.maximum(1.0 - distances / reach, 0.0)
        away = (points[:, None, :] - points[:, near]) / np.maximum(distances, 1e-9)
        points, normals = projected(solid, points + (push * away).sum(axis=1), 1)
    points, normals = projected(solid, points)
    spacing = _even_spacing(points, distances)
    order = np.lexsort((points[1], points[2] < 0.0))  # by height, the front first, as `move` likes it
    order = order[shows(points[:, order], 0.0) & (np.abs(solid(*points[:, order])) < _EXACT)]
    return points[:, order], normals[:, order], spacing[order]


def _even_spacing(points: Rows, distances: Rows) -> Rows:
    """How far the neighbours of points (3, N) would be if all were evenly spread as wanted, (N,)."""
    wanted = wanted_spacing(points)
    return wanted * np.median(distances[5] / wanted)


def _scattered(solid: Solid, shows: Shows, count: int, rng: np.random.Generator) -> NDArray[np.float64]:
    """Random points (3, count) on the surface of a solid, by wanted density."""
    axes = (np.arange(low, high, _CELL) for low, high in _BOX)
    cells = np.stack(np.meshgrid(*axes, indexing="ij")).reshape(3, -1) + _CELL / 2
    cells = cells[:, np.abs(_batched(solid, cells)) < _CELL]
    found: list[NDArray[np.float64]] = []
    while sum(part.shape[1] for part in found) < count:
        points = cells[:, rng.integers(cells.shape[1], size=20 * count)]
        points = points + rng.uniform(-_CELL / 2, _CELL / 2, points.shape)
        points = points[:, rng.random(points.shape[1]) < 0.09 / np.square(wanted_spacing(points))]
        points = points[:, np.abs(_batched(solid, points)) < _CELL / 10]
        found.append(points[:, shows(points, _MARGIN)])
    return np.concatenate(found, axis=1)[:, :count]


def _neighbors(
    points: NDArray[np.float64], normals: NDArray[np.float64]
) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Nearest neighbours on the same sheet of the surface, (K, N) rows and ascending distances in mm.

    A neighbour that faces the other way counts as infinitely far.
    """
    import open3d

    cloud = open3d.core.Tensor.from_numpy(np.ascontiguousarray(points.T))
    search = open3d.core.nns.NearestNeighborSearch(cloud)
    search.knn_index()
    rows, squares = search.knn_search(cloud, _NEIGHBORS + 1)
    near = rows.numpy().T[1:].astype(np.intp)
    facing = (normals[:, near] * normals[:, None, :]).sum(axis=0) > 0.0
    distances = np.where(facing, np.sqrt(squares.numpy().T[1:]), np.inf)
    order = np.argsort(distances, axis=0, kind="stable")
    return np.take_along_axis(near, order, 0), np.take_along_axis(distances, order, 0)


def _batched(solid: Solid, points: NDArray[np.float64]) -> NDArray[np.float32]:
    """The values of a solid at points (3, N), (N,)."""
    single = points.astype(np.float32)
    return np.concatenate([solid(*single[:, i : i + _BATCH]) for i in range(0, single.shape[1], _BATCH)])


def save_asset(points: RestPoints, path: Path) -> None:
    """Write points as `rest_points` reads them: normals in 16 bits an axis, radii as halves."""
    with whole_file(path) as temporary:
        np.savez_compressed(
            temporary,
            positions=points.positions,
            normals=np.rint(points.normals * 32767.0).astype(np.int16),
            colors=points.colors,
            radii=points.radii.astype(np.float16),
            skin=points.skin,
        )


if __name__ == "__main__":
    save_asset(sample(), asset_path())

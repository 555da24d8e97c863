"""Neighbourhoods and planes through them the slow, obvious way, in float64, to compare with."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from viewer.scan.points import PointCloud

Floats = NDArray[np.float64]

_MORE = 24  # neighbours beyond the k-th among which ties with it are looked for


@dataclass(frozen=True, eq=False)
class PlainNeighborhoods:
    """What is to be found of M points.

    nearest: (M, K), rows of the k nearest participants, by distance, then by row; -1 where there are less.
    distances: (M, K), theirs; +inf where there are less. beyond: (M,), the distance of the next one.
    counts: (M,), how many belong to the neighbourhood.
    """

    nearest: NDArray[np.intp]
    distances: Floats
    beyond: Floats
    counts: NDArray[np.intp]

    @property
    def radii(self) -> Floats:
        """(M,), of the balls around the neighbourhoods."""
        return self.distances[np.arange(len(self.counts)), self.counts - 1]

    def clear(self, least: float) -> NDArray[np.bool_]:
        """Tell which have no candidate beyond their last neighbour that is nearly as far, by this share,
        (M,): where float32 rounds distances, it may take either."""
        after = np.column_stack([self.distances, self.beyond])[np.arange(len(self.counts)), self.counts]
        return after > self.radii * (1 + least)


def k_nearest(
    cloud: PointCloud, rows: NDArray[np.integer], participants: NDArray[np.integer], k: int
) -> tuple[NDArray[np.intp], Floats]:
    """(rows (M, K), distances (M, K)) of the k nearest participants of each row, itself among them.

    Ties go to the lowest row.
    """
    from scipy.spatial import cKDTree

    participants = np.sort(participants).astype(np.intp)
    points = cloud.positions[participants].astype(np.float64)
    centers = cloud.positions[rows].astype(np.float64)
    tree = cKDTree(points)
    found = min(k + _MORE, len(points))
    distances, places = (a.reshape(len(rows), -1) for a in tree.query(centers, found, workers=2))
    order = np.lexsort((places, distances), axis=-1)[:, :k]
    nearest = np.take_along_axis(places, order, axis=1)
    kept = np.take_along_axis(distances, order, axis=1)
    if found < len(points) and k <= found:
        crowded = np.flatnonzero(distances[:, -1] <= kept[:, -1] * (1 + 1e-12))  # more ties than were found
        for i in crowded:
            squared = ((points - centers[i]) ** 2).sum(axis=1)
            nearest[i] = np.lexsort((np.arange(len(points)), squared))[:k]
            kept[i] = np.sqrt(squared[nearest[i]])
    lacking = ((0, 0), (0, k - nearest.shape[1]))
    return (
        np.pad(participants[nearest], lacking, constant_values=-1),
        np.pad(kept, lacking, constant_values=np.inf),
    )


def neighborhoods(
    cloud: PointCloud,
    rows: NDArray[np.integer],
    participants: NDArray[np.integer],
    k: int,
    expected: NDArray[np.floating],
    alone: float,
    growth: float,
) -> PlainNeighborhoods:
    """Neighbourhoods that end with the k-th, or before a gap (Preiner 2012, 5.3).

    expected: (M,), the radius that the density of the picture lets expect. A first neighbour is at most
    `alone` times as far; each further one within `growth` times the area of the ball round those before,
    which is at least as large as the expected one.
    """
    nearest, distances = k_nearest(cloud, rows, participants, k + 1)
    nearest, distances, beyond = nearest[:, :k], distances[:, :k], distances[:, k]
    counts = np.ones(len(rows), np.intp)
    limit = alone * expected.astype(np.float64)
    is_open = np.ones(len(rows), bool)
    for place in range(1, k):
        is_open &= distances[:, place] <= limit
        counts[is_open] = place + 1
        reached = np.where(is_open, distances[:, place], 0)
        limit = np.sqrt(growth) * np.maximum(reached, expected)
    return PlainNeighborhoods(nearest, distances, beyond, counts)


@dataclass(frozen=True, eq=False)
class PlainPlanes:
    """Planes through M neighbourhoods: eigenvalues (M, 3), ascending, their vectors (M, 3, 3) in columns."""

    values: Floats
    vectors: Floats

    @property
    def normals(self) -> Floats:
        """(M, 3), of either sign."""
        return self.vectors[:, :, 0]

    @property
    def curvature(self) -> Floats:
        """(M,), the lowest eigenvalue over the sum; 0 where all points are in one place."""
        total = self.values.sum(axis=1)
        return np.divide(self.values[:, 0], total, out=np.zeros(len(total)), where=total > 0)

    def on_lines(self, most: float) -> NDArray[np.bool_]:
        """Tell where the second eigenvalue is less than this share of the largest, (M,): points on a line."""
        return self.values[:, 1] < most * self.values[:, 2]

    def distinct(self, least: float) -> NDArray[np.bool_]:
        """Tell where the two lowest eigenvalues differ by this share of the largest, (M,)."""
        return self.values[:, 1] - self.values[:, 0] > least * self.values[:, 2]


def planes(
    cloud: PointCloud, rows: NDArray[np.integer], found: PlainNeighborhoods, counts: NDArray | None = None
) -> PlainPlanes:
    """Planes by the covariance about the mean of each neighbourhood, over the square of its radius.

    counts: (M,), of the nearest that planes go through; None: all of the neighbourhood.
    """
    counts = found.counts if counts is None else counts
    belongs = np.arange(found.nearest.shape[1]) < counts[:, None]
    centers = cloud.positions[rows].astype(np.float64)
    offsets = cloud.positions[found.nearest].astype(np.float64) - centers[:, None]
    radii = np.where(found.radii > 0, found.radii, 1)
    offsets = np.where(belongs[..., None], offsets / radii[:, None, None], 0)
    mean = offsets.sum(axis=1) / counts[:, None]
    apart = np.where(belongs[..., None], offsets - mean[:, None], 0)
    values, vectors = np.linalg.eigh(np.einsum("mki,mkj->mij", apart, apart))
    return PlainPlanes(np.maximum(values, 0), vectors)


def certain_counts(
    cloud: PointCloud,
    rows: NDArray[np.integer],
    found: PlainNeighborhoods,
    least: int,
    certain: float,
    turned: float,
) -> NDArray[np.intp]:
    """The least number of the nearest (M,) whose plane the residuals leave certain to an angle, radians, and
    the next number turns by no more than another, degrees; else all.

    Tried are `least` and numbers a third larger each.
    """
    tried = [least]
    while tried[-1] + tried[-1] // 3 <= found.nearest.shape[1]:
        tried.append(tried[-1] + tried[-1] // 3)
    fitted = [planes(cloud, rows, found, np.minimum(found.counts, count)) for count in tried]
    counts = found.counts.copy()
    for count, one, other in reversed(list(zip(tried, fitted, fitted[1:], strict=False))):
        residual = one.values[:, 0] <= certain**2 * (count - 3) * one.values[:, 1]
        is_plane = one.values[:, 1] > 1e-5 * one.values[:, 2]
        agree = np.abs(np.einsum("mi,mi->m", one.normals, other.normals)) >= np.cos(np.radians(turned))
        counts[residual & is_plane & agree & (found.counts >= count + count // 3)] = count
    return counts


def cell_reaches(
    cloud: PointCloud,
    rows: NDArray[np.integer],
    found: PlainNeighborhoods,
    normals: NDArray[np.floating],
    shares: NDArray[np.bool_],
) -> tuple[Floats, Floats]:
    """How far each point's Voronoi cell reaches in the plane of its normal, in 24 directions, (M, 24), over
    the neighbourhood's radius, inf where it is open; and the radius of a point's share, (M,), in that unit.

    normals: (M, 3), unit. shares: (M, K), the neighbours that cells are between. Directions are counted from
    that of the nearest neighbour.
    """
    radii = np.where(found.radii > 0, found.radii, 1)[:, None, None]
    offsets = (cloud.positions[found.nearest].astype(np.float64) - cloud.positions[rows][:, None]) / radii
    first = offsets[:, 1] - np.einsum("mi,mi->m", offsets[:, 1], normals)[:, None] * normals
    length = np.linalg.norm(first, axis=1, keepdims=True)
    other = np.cross((0.3, 0.5, 0.8), normals)
    first = np.where(length > 1e-6, first / np.maximum(length, 1e-6), other)
    second = np.cross(normals, first)
    across = np.stack([np.einsum("mki,mi->mk", offsets, axis) for axis in (first, second)], axis=-1)
    squared = (across**2).sum(axis=-1)
    angles = np.arange(24) * np.pi / 12
    along = across @ np.array([np.cos(angles), np.sin(angles)])
    beyond = shares & (squared > 0) & (np.arange(squared.shape[1]) > 0)
    with np.errstate(divide="ignore", invalid="ignore"):
        edges = np.where(beyond[..., None] & (along > 1e-9), squared[..., None] / (2 * along), np.inf)
    return edges.min(axis=1), 2 / np.sqrt(np.maximum(1, shares[:, 1:].sum(axis=1) + 1))


def beside_lines(
    cloud: PointCloud,
    rows: NDArray[np.integer],
    along: Floats,
    participants: NDArray[np.integer],
    least: Floats,
    most: Floats,
) -> tuple[Floats, Floats]:
    """From the line through each of M points to the nearest participant that is beside it, (M, 3), and to the
    nearest that is opposite; 0 where there is none.

    along: (M, 3), unit, of the line. Beside is what is farther from the point across the line than along it;
    opposite what is at least 120 degrees round the line from the first. least, most: (M,), how far both are
    from the point.
    """
    points = cloud.positions[np.sort(participants)].astype(np.float64)
    found = np.zeros((2, len(rows), 3))
    for number, (row, line) in enumerate(zip(rows, along, strict=True)):
        offsets = points - cloud.positions[row]
        ahead = offsets @ line
        across = offsets - ahead[:, None] * line
        distances, widths = np.linalg.norm(offsets, axis=1), np.linalg.norm(across, axis=1)
        is_beside = (widths > np.abs(ahead)) & (distances > least[number]) & (distances <= most[number])
        for side in found[:, number]:
            if is_beside.any():
                side[:] = across[np.where(is_beside, distances, np.inf).argmin()]
                is_beside &= across @ side <= -0.5 * widths * np.linalg.norm(side)
    return found[0], found[1]

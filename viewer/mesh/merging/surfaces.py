"""Surfaces of range views, and how far one lies off another as a pod sees it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...bounds import Bounds
from ...scan.faces import Triangles
from ...scan.range_view import RangeView
from ..range_mesh import triangles_of
from ..scene import Rays

if TYPE_CHECKING:
    from .layer_kernels import LayerHits

LEAST_COSINE = 0.1  # of incidence: a surface seen more steeply is taken as seen so, 84 degrees


@dataclass(frozen=True, eq=False)
class RangeSurface:
    """A surface that a range view has measured, as triangles between neighbouring pixels.

    points: world positions of the valid pixels in row order, (N, 3) float64. normals: (N, 3) float32, unit
    length, towards the pod. faces: (F, 3), rows of points.
    """

    view: RangeView
    points: Rays
    normals: NDArray[np.float32]
    faces: Triangles

    @classmethod
    def of(cls, view: RangeView) -> RangeSurface:
        """The surface of a view."""
        return cls(view, view.positions(), view.normals(), triangles_of(view))

    @property
    def bounds(self) -> Bounds:
        """The box around its points."""
        return Bounds(self.points.min(axis=0), self.points.max(axis=0))

    def rays(self, points: Rays) -> Rays:
        """The directions in which the pod sees positions (N, 3), as long as brings them one unit of depth
        on."""
        if self.view.kind == "height":
            return np.broadcast_to(-self.view.world_to_camera[2, :3], points.shape)
        return (points - self.view.eye) / self.depths(points)[:, None]

    def depths(self, points: Rays) -> NDArray[np.float64]:
        """How far positions (N, 3) are along the pod's view axis, (N,), scan units."""
        matrix = self.view.world_to_camera
        return -(points @ matrix[2, :3] + matrix[2, 3])

    def spacing(self, points: Rays, normals: NDArray[np.floating]) -> NDArray[np.float64]:
        """How far apart, (N,), scan units, the pod measures a surface at these positions with these
        normals."""
        focal = min(self.view.fx, self.view.fy)
        away = 1.0 if self.view.kind == "height" else np.maximum(self.depths(points), 0)
        return away / focal / np.maximum(self.cosines(points, normals), LEAST_COSINE)

    def cosines(self, points: Rays, normals: NDArray[np.floating]) -> NDArray[np.float64]:
        """The cosines between unit normals (N, 3) at positions (N, 3) and the directions to the pod, (N,)."""
        rays = self.rays(points)
        with np.errstate(invalid="ignore", divide="ignore"):  # at the eye
            return np.nan_to_num(-(rays * normals).sum(axis=1) / np.linalg.norm(rays, axis=1))

    def smoothed(self, values: NDArray[np.floating], pixels: int) -> NDArray[np.float64]:
        """Means of values (N,) of the points over valid pixels so many away at most, twice."""
        valid = self.view.valid()
        counts = _box_sums(valid.astype(np.float64), pixels)[valid]
        for _ in range(2):
            values = _box_sums(self.on_grid(values), pixels)[valid] / counts
        return np.asarray(values, np.float64)

    def on_grid(self, values: NDArray) -> NDArray:
        """Values (N,) of the points in the picture, (H, W), 0 at the other pixels."""
        valid = self.view.valid()
        grid = np.zeros(valid.shape, values.dtype)
        grid[valid] = values
        return grid

    def face_areas(self) -> NDArray[np.float64]:
        """Areas of the faces, (F,)."""
        a, b, c = self.points[self.faces.T]
        return np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2


@dataclass(frozen=True, eq=False)
class Meeting:
    """Places that one pod sees, (Q, 3), where they meet the surface of another along its rays.

    Of several layers it is the one whose depth differs least, and NaN where there is none. depth: (Q,), how
    much farther from the pod it is, along the view axis. distance: (Q,), the same along its normal, at least
    0. spacing: (Q,), half the sum of the spacings with which both measure there. normal: (Q, 3), unit length.
    weight: (Q,), of the numbers of the surface's points.
    """

    depth: NDArray[np.float64]
    distance: NDArray[np.float64]
    spacing: NDArray[np.float64]
    normal: Rays
    weight: NDArray[np.float64]


def meet(
    seen: RangeSurface,
    positions: Rays,
    other: RangeSurface,
    weights: NDArray[np.floating] | None = None,
) -> Meeting:
    """Find where positions (Q, 3) near a view's surface meet another's along its rays.

    Triangles of the other that face away from the pod have no part: they are of the back of something. So
    nothing that lies behind or before the position counts as the same but by the caller's measure of
    distance. weights: (N,), of the other's points, else 1.
    """
    from .layer_kernels import LayerHits, PositionsByPixel, nearest_layer

    height, width = seen.view.depth.shape
    pixels, _ = seen.view.project(positions)
    depth = seen.depths(positions)
    column, row = np.clip(np.nan_to_num(pixels), 0, (width - 1, height - 1)).astype(np.intp).T
    pixel = row * width + column
    order = np.argsort(pixel, kind="stable")
    first = np.concatenate([[0], np.cumsum(np.bincount(pixel, minlength=width * height))])
    corners, takes_part = _in_picture(seen, other)
    rows = np.flatnonzero(takes_part)
    hits = LayerHits(
        np.full(len(positions), np.inf),
        np.full(len(positions), -1),
        np.zeros((len(positions), 2), np.float32),
    )
    by_pixel = PositionsByPixel(pixels, depth, order, first, width, height)
    nearest_layer(by_pixel, corners, other.faces[rows], seen.view.kind == "height", hits)
    return _met(seen, positions, other, hits._replace(found=np.append(rows, -1)[hits.found]), weights)


def _in_picture(seen: RangeSurface, other: RangeSurface) -> tuple[Rays, NDArray[np.bool_]]:
    """The points of a surface in the picture of another's pod as `nearest_layer` has them, (V, 3), and the
    faces that the pod can see, (F,)."""
    pixels, _ = seen.view.project(other.points)
    depth = seen.depths(other.points)
    with np.errstate(divide="ignore"):
        corners = np.column_stack([pixels, depth if seen.view.kind == "height" else 1 / depth])
    ahead = np.asarray(np.isfinite(corners).all(axis=1))
    facing = np.asarray(seen.cosines(other.points, other.normals) > 0)
    # The normals of several pixels tell it: triangles of noise lie in all directions.
    counts = [np.count_nonzero(flags[other.faces], axis=1) for flags in (ahead, facing)]
    return corners, (counts[0] == 3) & (counts[1] >= 2)


def _met(
    seen: RangeSurface,
    positions: Rays,
    other: RangeSurface,
    hits: LayerHits,
    weights: NDArray[np.floating] | None,
) -> Meeting:
    """The meeting of positions (Q, 3) with the triangles of a surface that are found for them."""
    hit = np.flatnonzero(hits.found >= 0)
    faces, share = other.faces[hits.found[hit]], hits.share[hit]
    shares = np.column_stack([1 - share.sum(axis=1), share])
    normal = (other.normals[faces] * shares[:, :, None]).sum(axis=1)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    normal /= np.where(length > 0, length, 1)
    rays, change = seen.rays(positions[hit]), hits.offset[hit]
    there = positions[hit] + change[:, None] * rays
    spacing = (seen.spacing(positions[hit], normal) + other.spacing(there, normal)) / 2
    weight = np.ones(len(hit)) if weights is None else (weights[faces] * shares).sum(axis=1)

    def spread(values: NDArray) -> NDArray[np.float64]:
        whole = np.full((len(positions), *values.shape[1:]), np.nan)
        whole[hit] = values
        return whole

    distance = np.abs(change * (rays * normal).sum(axis=1))
    return Meeting(spread(change), spread(distance), spread(spacing), spread(normal), spread(weight))


def _box_sums(image: NDArray[np.floating], pixels: int) -> NDArray[np.float64]:
    """Sums over squares of 2 * pixels + 1 around each pixel, (H, W)."""
    sums = np.asarray(image, np.float64)
    for _ in range(2):
        running = np.cumsum(np.pad(sums.T, ((0, 0), (pixels + 1, pixels))), axis=1)
        sums = running[:, 2 * pixels + 1 :] - running[:, : -2 * pixels - 1]
    return sums

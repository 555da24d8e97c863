"""A scan of a real thing with a truth: a phone's depth images of a head."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...mesh.scene import Rays
from ...mesh.triangles import Mesh
from ...scan.formats import read
from ...scan.open import find_source
from ...scan.points import PointCloud
from ...scan.pose import Pose
from ...scan.range_view import RangeView
from ...srgb import bytes_from_linear, linear_from_bytes
from ..truth.isosurface import isosurface
from .registration import OrientedPoints, register
from .subjects import Moment

# The head is nearer than this, the room behind it begins at a metre.
_ROOM = 0.75  # m
# The frame that looks as the reference does, turned: with the middles of both together it finds its position.
_FIRST = 9
_REACHES = (0.05, 0.02, 0.005)  # m, how far partners may be
_EVERY = 8  # pixels that are registered
_DOWN = np.diag([1.0, -1.0, -1.0, 1.0])  # from an image's axes to a camera's, that looks down -z
# From an upright picture's axes to those of the phone's sensor, which the reference has.
_ON_ITS_SIDE = np.array([[0.0, 1, 0, 0], [-1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
_MOST_RMS, _LEAST_SHARE = 1e-3, 0.9  # m to the planes of partners, and of points that have some

_CELL = 1.5e-3  # m, of the reference's mesh
_WIDTH = 1.5e-3  # m, standard deviation of the weights that blend surfels
_SURFELS = 24  # that are blended
_EDGE = 2e-3  # m, how far the mesh reaches beyond the last surfel


class DepthFrames:
    """A head seen by a phone's depth camera that moves around it, in the frame of its fused reference.

    Metres. The mask leaves out the room behind the head.
    """

    def __init__(self, folder: Path, reference: Path) -> None:
        self._source = find_source(folder)
        if len(self._source) <= _FIRST:
            raise InputError(
                f"contains {len(self._source)} frames, but the benchmark needs more than {_FIRST}", folder
            )
        times = self._source.times()
        self._times = np.zeros(len(self)) if times is None else times
        surfels = read(reference)
        assert isinstance(surfels, PointCloud), "the reference has surfels"
        self._surfels = surfels

    def __len__(self) -> int:
        return len(self._source)

    def moment(self, index: int) -> Moment:
        """One frame. Raises InputError where it cannot be registered."""
        view = self._view(index, self._motions[index])
        pose = Pose.of(index, float(self._times[index]), self._source.label(index), (view,))
        return Moment(pose, self._truth, self._truth)

    @cached_property
    def _truth(self) -> Mesh:
        return blended(self._surfels)

    @cached_property
    def _motions(self) -> dict[int, NDArray[np.float64]]:
        """The motion of each frame to the reference, (4, 4), found from one frame to the next."""
        assert self._surfels.normals is not None
        target = OrientedPoints(self._surfels.world(), self._surfels.normals.astype(np.float64))
        first = _ON_ITS_SIDE.copy()
        first[:3, 3] = target.positions.mean(axis=0) - first[:3, :3] @ self._points(_FIRST).mean(axis=0)
        motions = {_FIRST: self._registered(_FIRST, target, first)}
        for index in range(_FIRST + 1, len(self)):
            motions[index] = self._registered(index, target, motions[index - 1])
        for index in range(_FIRST - 1, -1, -1):
            motions[index] = self._registered(index, target, motions[index + 1])
        return motions

    def _points(self, index: int) -> Rays:
        return self._view(index).positions()[::_EVERY]

    def _registered(
        self, index: int, target: OrientedPoints, start: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        motion, rms, share = register(self._points(index), target, start, _REACHES)
        if rms > _MOST_RMS or share < _LEAST_SHARE:
            found = f"{1e3 * rms:.2f} mm rms, {share:.0%} of the points near it"
            raise InputError(f"does not match its reference: {found}", self._source.label(index))
        return motion

    def _view(self, index: int, motion: NDArray[np.float64] | None = None) -> RangeView:
        """The view of a frame. motion: from the image's axes (+y down, +z ahead) to the world."""
        views = self._source.load(index)
        assert isinstance(views, tuple), "each frame of a phone's depth camera is a range view"
        (view,) = views
        world_to_image = np.eye(4) if motion is None else np.linalg.inv(motion).astype(np.float64)
        near = view.mask & (np.nan_to_num(view.depth) < _ROOM)
        return replace(view, mask=near, world_to_camera=_DOWN @ world_to_image)


def blended(surfels: PointCloud) -> Mesh:
    """A mesh of surfels with normals and colours: the zero of the blended distances to their planes.

    Implicit moving least squares (Kolluri 2005) on a grid of 1.5 mm, by marching cubes; it ends 2 mm beyond
    the last surfel.
    """
    from scipy.ndimage import binary_dilation
    from scipy.spatial import cKDTree

    assert surfels.normals is not None and surfels.colors is not None
    positions, normals = surfels.positions.astype(np.float64), surfels.normals.astype(np.float64)
    colors = linear_from_bytes(surfels.colors[:, :3])
    tree = cKDTree(positions)

    def shares(points: Rays) -> tuple[NDArray[np.intp], NDArray[np.float64], NDArray[np.float64]]:
        """The surfels around points (N, K), their shares (N, K), and how far the nearest is (N,)."""
        distance, around = tree.query(points, _SURFELS)
        weight = np.exp((distance[:, :1] ** 2 - distance**2) / (2 * _WIDTH**2))
        return around, weight / weight.sum(axis=1, keepdims=True), distance[:, 0]

    low = positions.min(axis=0) - 2 * _EDGE
    cells = np.ceil((positions.max(axis=0) + 2 * _EDGE - low) / _CELL).astype(int)
    x, y, z = (start + _CELL * np.arange(count) for start, count in zip(low, cells, strict=True))
    near = np.zeros(cells, bool)
    near[tuple(((positions - low) / _CELL).astype(int).T)] = True
    near = binary_dilation(near, iterations=4)
    grid, at = np.full(cells, np.nan, np.float32), np.nonzero(near)
    points = np.stack([x[at[0]], y[at[1]], z[at[2]]], axis=1)
    around, share, _ = shares(points)
    grid[at] = (((points[:, None] - positions[around]) * normals[around]).sum(axis=2) * share).sum(axis=1)

    vertices, faces = isosurface(grid, (x, y, z))
    around, share, gap = shares(vertices)
    blend = share[:, None] @ np.concatenate([normals, colors], axis=1)[around]
    cloud = PointCloud.from_arrays(
        vertices + surfels.origin,
        normals=blend[:, 0, :3] / np.linalg.norm(blend[:, 0, :3], axis=1, keepdims=True),
        colors=bytes_from_linear(blend[:, 0, 3:]),
        origin=surfels.origin,
    )
    return Mesh(cloud, faces[(gap[faces] < _EDGE).all(axis=1)])

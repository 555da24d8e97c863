"""A scan of a real thing with a truth: a phone's depth images of a head."""

from __future__ import annotations

import json
from functools import cached_property
from pathlib import Path
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...mesh.scene import Rays
from ...mesh.triangles import Mesh
from ...scan.formats import read
from ...scan.points import PointCloud
from ...scan.pose import Pose
from ...scan.range_view import RangeView
from ...scan.times import natural_key
from ...srgb import bytes_from_linear, linear_from_bytes
from ..truth.isosurface import isosurface
from .registration import OrientedPoints, register
from .subjects import Moment

# The head is nearer than this, the room behind it begins at a metre.
_ROOM = 0.75  # m
# The frame that looks as the reference does: with the middles of both together it finds its place.
_FIRST = 9
_REACHES = (0.05, 0.02, 0.005)  # m, how far partners may be
_EVERY = 8  # pixels that are registered
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
        self._files = sorted(folder.glob("frame-*.npz"), key=lambda file: natural_key(file.name))
        if len(self._files) <= _FIRST:
            raise InputError(f"holds {len(self._files)} frames, more than {_FIRST} are needed", folder)
        self._camera = _intrinsics(folder / "camera_intrinsics.json")
        surfels = read(reference)
        assert isinstance(surfels, PointCloud), "the reference holds surfels"
        self._surfels = surfels

    def __len__(self) -> int:
        return len(self._files)

    def moment(self, index: int) -> Moment:
        """One frame. Raises InputError where it cannot be registered."""
        view, time = self._view(index, self._motions[index])
        pose = Pose.of(index, time - self._view(0)[1], self._files[index].name, (view,))
        return Moment(pose, self._truth, self._truth)

    @cached_property
    def _truth(self) -> Mesh:
        return blended(self._surfels)

    @cached_property
    def _motions(self) -> dict[int, NDArray[np.float64]]:
        """The motion of each frame to the reference, (4, 4), found from one frame to the next."""
        assert self._surfels.normals is not None
        target = OrientedPoints(self._surfels.world(), self._surfels.normals.astype(np.float64))
        first = np.eye(4)
        first[:3, 3] = target.positions.mean(axis=0) - self._points(_FIRST).mean(axis=0)
        motions = {_FIRST: self._registered(_FIRST, target, first)}
        for index in range(_FIRST + 1, len(self)):
            motions[index] = self._registered(index, target, motions[index - 1])
        for index in range(_FIRST - 1, -1, -1):
            motions[index] = self._registered(index, target, motions[index + 1])
        return motions

    def _points(self, index: int) -> Rays:
        return self._view(index)[0].positions()[::_EVERY]

    def _registered(
        self, index: int, target: OrientedPoints, start: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        motion, rms, share = register(self._points(index), target, start, _REACHES)
        if rms > _MOST_RMS or share < _LEAST_SHARE:
            found = f"{1e3 * rms:.2f} mm rms, {share:.0%} of the points"
            raise InputError(f"does not fit its reference: {found}", self._files[index])
        return motion

    def _view(self, index: int, motion: NDArray[np.float64] | None = None) -> tuple[RangeView, float]:
        """A frame and its time in seconds. motion: from the image's axes (+y down, +z ahead) to the world."""
        depth, color, time = _arrays(self._files[index], "depth", "color", "timestamp")
        linear = color / 255  # as it is stored: encoded as sRGB, it is that of the reference
        fx, fy, cx, cy = self._camera * depth.shape[1]
        down = np.diag([1.0, -1.0, -1.0, 1.0])  # from an image's axes to a camera's that looks down -z
        world_to_image = np.eye(4) if motion is None else np.linalg.inv(motion).astype(np.float64)
        view = RangeView(
            depth=depth,
            mask=np.isfinite(depth) & (np.nan_to_num(depth) < _ROOM),
            color=linear.astype(np.float16),
            fx=fx,
            fy=fy,
            cx=cx + 0.5,  # stored for pixels whose centres are whole numbers
            cy=cy + 0.5,
            world_to_camera=down @ world_to_image,
            name="truedepth",
            unit="m",
        )
        return view, float(time)


def _intrinsics(file: Path) -> NDArray[np.float64]:
    """fx, fy, cx and cy in widths of the picture, (4,)."""
    try:
        stored = json.loads(file.read_text(encoding="utf-8"))
        matrix = np.array(stored["intrinsic_matrix"], float)  # 3 x 3, by columns
        return matrix[[0, 4, 6, 7]] / float(stored["intrinsic_matrix_reference_dimensions_width"])
    except (OSError, ValueError, KeyError, IndexError) as error:
        raise InputError(f"is no calibration: {error}", file) from error


def _arrays(file: Path, *names: str) -> list[NDArray]:
    """Some arrays of an NPZ file. Raises InputError."""
    try:
        with np.load(file, allow_pickle=False) as arrays:
            return [arrays[name] for name in names]
    except (OSError, ValueError, KeyError, BadZipFile) as error:
        raise InputError(f"cannot be read: {error}", file) from error


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

"""What a search for visible points reads of the points of a pose, whatever the eye: how far apart they lie,
and where they lie without noise."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..gpu import gl
from ..gpu.pose import GpuPose
from ..scan.noise import noise_of, steadied
from ..scan.points import NOTHING, PointCloud
from ..scan.spacing import typical_spacing
from ..task import checkpoint
from .calibration import body_of, copies

NEAREST, FEWEST = 10, 8  # the nearest points that give the spacing are the eighth to the tenth
_BALL = 2.5  # first radius of the search, in usual distances; it is doubled where it finds too few points
_LEVELS = 6
_MOST_CELLS = 1 << 20  # to each side of the origin; what lies farther off counts as in the last one
_NET_STEPS = 4095  # along an axis of an octahedron's net


def copies_in(pose: GpuPose) -> gl.BufferTexture | None:
    """The copies in a pose: `copies` as texels, R32UI; None: there are none."""
    if body_of(pose.stored).count == len(pose.cloud):
        return None
    return pose.packed(copies, texel_format=gl.R32UI)


def is_steadied(pose: GpuPose) -> bool:
    """Whether `steady_points` gives other positions than the scan has, since these are noisy."""
    return noise_of(pose.stored).stands_out


def steady_points(pose: GpuPose) -> gl.BufferTexture:
    """The positions of a pose, with less noise where there is some: then with normals in the fourth number,
    as hpr/steady.glsl reads it."""
    if not is_steadied(pose):
        return pose.array("positions")
    return pose.packed(_steady_texels, pose.stored, texel_format=gl.RGBA32F)


def spacing_texels(pose: GpuPose) -> gl.BufferTexture:
    """`local_spacings` of a pose, R32F, a texel a row."""
    return pose.packed(local_spacings, of=pose.stored)


def local_spacings(cloud: PointCloud) -> NDArray[np.float32]:
    """The distance between neighbours around each point of a cloud, without noise, (N,), scan units.

    The `FEWEST`-th to the `NEAREST`-th nearest point each tell a spacing, and the largest counts, so that
    splats beside a gap reach across it. Other parts of the scan do not change it. Copies do not count. Found
    once.
    """
    return cloud.remember(_local_spacings)


def _local_spacings(cloud: PointCloud) -> NDArray[np.float32]:
    from .spacing_kernels import note_spacings

    points = cloud.positions
    if noise_of(cloud).stands_out:
        points = points + cloud.remember(_steadying)[:, :3]
    distinct = slice(None) if body_of(cloud).count == len(cloud) else np.flatnonzero(copies(cloud) == NOTHING)
    spacings = np.full(len(cloud), np.nan, np.float32)
    for level in range(_LEVELS):
        todo = np.flatnonzero(np.isnan(spacings))
        if not len(todo):
            break
        checkpoint()
        reach = _BALL * cloud.remember(_usual) * 2**level
        cells = _cells(points, reach)
        others, theirs = points[distinct], cells[distinct]
        order, own_order = (codes.argsort(kind="stable") for codes in (theirs, cells[todo]))
        todo, found = todo[own_order], np.empty(len(todo), np.float32)
        counts = FEWEST, NEAREST, NEAREST if level < _LEVELS - 1 else 0
        note_spacings(others[order], theirs[order], points[todo], cells[todo], reach, counts, found)
        spacings[todo] = found
    return spacings


def _cells(points: NDArray[np.float32], edge: float) -> NDArray[np.int64]:
    """Numbers of the cells of an edge that points lie in, (N,), as `note_spacings` has them."""
    at = np.clip(np.floor(points / edge), 2 - _MOST_CELLS, _MOST_CELLS - 2).astype(np.int64) + _MOST_CELLS
    return (at[:, 0] << 42) + (at[:, 1] << 21) + at[:, 2]


def _steadying(cloud: PointCloud) -> NDArray[np.float32]:
    """The moves that take noise from points, scan units, and their normals, (N, 4): a whole number with 12
    bits for each axis of an octahedron's net, and 1 more; 0: no normal."""
    steady = steadied(cloud, noise_of(cloud))
    normals = steady.normals
    size = np.abs(normals).sum(axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        net = normals[:, :2] / size[:, None]
    turned = (1 - np.abs(net[:, ::-1])) * np.where(net < 0, -1, 1)
    net = np.where(normals[:, 2:] < 0, turned, net)
    steps = np.rint((np.nan_to_num(net) + 1) * (0.5 * _NET_STEPS))
    word = np.where(size > 0, steps[:, 0] + (_NET_STEPS + 1) * steps[:, 1] + 1, 0)
    return np.concatenate([steady.positions - cloud.positions, word[:, None]], axis=1).astype(np.float32)


def _steady_texels(cloud: PointCloud, stored: PointCloud) -> NDArray[np.float32]:
    """The steadied positions of a cloud, relative to its origin, and their normals. stored: the same cloud,
    as the scan has it."""
    texels = stored.remember(_steadying).copy()
    texels[:, :3] += cloud.positions
    return texels


def _usual(cloud: PointCloud) -> float:
    """The usual distance between points, copies aside, scan units."""
    if noise_of(cloud).stands_out:
        return noise_of(cloud).spacing
    if body_of(cloud).count < len(cloud):
        cloud = PointCloud(positions=cloud.positions[copies(cloud) == NOTHING], origin=cloud.origin)
    return typical_spacing(cloud)


def foresee_spacing(cloud: PointCloud) -> None:
    """Find the facts that the search for visible points reads of a cloud with points, on any thread."""
    if noise_of(cloud).stands_out:
        cloud.remember(_steadying)
    local_spacings(cloud)

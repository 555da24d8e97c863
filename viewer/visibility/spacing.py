"""Spacings: how far apart the points of a pose lie, around each of them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..gpu import gl
from ..gpu.bindings import Storage, Texture
from ..gpu.bins import Bins
from ..gpu.compact import IndexList
from ..gpu.context import Program
from ..gpu.pose import GpuPose
from ..gpu.scatter import Visits
from ..scan.noise import Noise, noise_of, steadied
from ..scan.points import NOTHING, PointCloud
from ..scan.spacing import typical_spacing
from .calibration import body_of, copies

NEAREST, FEWEST = 10, 8  # the nearest points that give the spacing are the eighth to the tenth
_BALL = 2.5  # first radius of the search, in usual distances; it is doubled where it finds too few points
_LEVELS = 6
_NET_STEPS = 4095  # along an axis of an octahedron's net
_PER_CELL = 4  # points, in the table of voxels


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
    return pose.packed(_steady_texels, noise_of(pose.stored), texel_format=gl.RGBA32F)


def _steady_texels(cloud: PointCloud, noise: Noise) -> NDArray[np.float32]:
    """Positions with less noise and normals, (N, 4): a whole number with 12 bits for each axis of an
    octahedron's net, and 1 more; 0: no normal."""
    steady = steadied(cloud, noise)
    normals = steady.normals
    size = np.abs(normals).sum(axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        net = normals[:, :2] / size[:, None]
    turned = (1 - np.abs(net[:, ::-1])) * np.where(net < 0, -1, 1)
    net = np.where(normals[:, 2:] < 0, turned, net)
    steps = np.rint((np.nan_to_num(net) + 1) * (0.5 * _NET_STEPS))
    word = np.where(size > 0, steps[:, 0] + (_NET_STEPS + 1) * steps[:, 1] + 1, 0)
    return np.concatenate([steady.positions, word[:, None]], axis=1).astype(np.float32)


def _usual(cloud: PointCloud) -> float:
    """The usual distance between points, copies aside, scan units."""
    if noise_of(cloud).stands_out:
        return noise_of(cloud).spacing
    if body_of(cloud).count < len(cloud):
        cloud = PointCloud(positions=cloud.positions[copies(cloud) == NOTHING], origin=cloud.origin)
    return typical_spacing(cloud)


def foresee_spacing(cloud: PointCloud) -> None:
    """Find the facts that the search for visible points reads, on any thread (`Backend.foresee`)."""
    noise_of(cloud)
    body_of(cloud)
    cloud.remember(_usual)


class Spacings:
    """The distance between neighbours around each point of a pose, without noise.

    The `FEWEST`-th to the `NEAREST`-th nearest point each tell a spacing, and the largest counts, so that
    splats beside a gap reach across it. Other parts of the scan do not change it.

    texels: R32F, a texel a row, scan units. They lie in space, so that they are the same for all eyes; kept
    with the pose (`GpuPose.cached`).
    """

    def __init__(self, pose: GpuPose) -> None:
        self.texels = gl.BufferTexture(pose.gpu.buffer(reserve=4 * max(len(pose.cloud), 1)), gl.R32F)
        with pose.gpu.timers.measure("spacings"):
            self._find(pose)

    @property
    def nbytes(self) -> int:
        """Bytes held on the GPU."""
        return self.texels.buffer.size

    def _find(self, pose: GpuPose) -> None:
        gpu, count, repeated = pose.gpu, len(pose.cloud), copies_in(pose)
        cells = 1 << max(count // _PER_CELL, 1).bit_length()
        bins, todo, sparse = Bins(gpu, cells), IndexList(gpu, count), IndexList(gpu, count)
        todo.write(np.arange(count, dtype=np.uint32))
        edge = 2 * _BALL * pose.stored.remember(_usual)
        for level in range(_LEVELS):
            if not len(todo):
                break

            def bind(program: Program, per_voxel: float = 1 / (edge * 2**level)) -> None:
                gpu.set(program, per_voxel=per_voxel, table_mask=cells - 1)
                steady_points(pose).bind(Texture.POSITIONS)
                if repeated is not None:
                    repeated.bind(Texture.COPIES)

            defines = {"COPIES": int(repeated is not None)}
            visits = Visits("hpr/voxel_items.glsl", count, bind, defines)
            bins.count(visits)
            bins.fill(visits, count)
            last = level == _LEVELS - 1
            counts = {"NEAREST": NEAREST, "FEWEST": FEWEST}
            program = gpu.compute("hpr/spacing.comp", {"LAST": int(last), **counts})
            bind(program)
            bins.starts.bind(Texture.STARTS)
            bins.items.bind(Texture.LISTED)
            self.texels.buffer.bind_to_storage_buffer(Storage.SPACINGS)
            sparse.clear()
            sparse.bind(Storage.NEXT_LIST, Storage.NEXT_DISPATCH)
            todo.run(program)
            todo, sparse = sparse, todo
        for each in (bins, todo, sparse):
            each.release()

    def release(self) -> None:
        """Delete it."""
        self.texels.release()

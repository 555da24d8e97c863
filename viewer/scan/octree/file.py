"""SVO files: octrees of all poses, one after another; docs/reference/octree-files.md has the layout.

Each pose is its leaves: a point in the middle of each, with its colour and normal; and the few points far
outside, as they are. Written are geometry, colours, normals, radii, times and unit. A pose may refer to
the one before it: then Scan4D reads that, too.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import lru_cache, partial
from itertools import pairwise
from pathlib import Path
from threading import Lock
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...bounds import Bounds
from ...errors import InputError
from ...task import checkpoint
from ..admission import admit, check_count
from ..points import PointCloud
from ..pose import Pose
from .build import Stop, build
from .byte_sources import ByteSource, FileBytes
from .cube import Cube
from .leaves import leaf_points
from .octree import Octree
from .storage import (
    LARGEST_HEADER,
    CutShort,
    Header,
    Read,
    Strays,
    read_header,
    read_levels,
    read_strays,
    to_bytes,
)
from .stored import StoredOctree, with_discs

_MOST_POSES = 1 << 17  # an hour at 30 a second
_LONGEST = 8  # octrees read for one pose
_MARGIN = 1 / 8  # around the poses that a cube is made for, of its edge
_NODE_BYTES = 36  # that decoding takes for a node of the largest level, beside attributes
_AROUND_BYTES = 108  # the nodes around one, of two levels above those whose masks are decoded
_HELD_BYTES = 21  # of a node, its mask, colour, normal and radius
_STRAY_BYTES = 200  # that reading a point outside takes
_LEAF_BYTES = 60  # that points take for a leaf
_MOST_RATIO = 200  # of memory to the file: leaves of surfaces take 5 bits and more each
_TOO_LARGE = 2.5  # a cube, for a pose whose own is smaller by this factor
_FIRST_SHOWN = 512  # nodes of the first level that is shown before all are there
_FEW = 1 / 1024  # of a pose's points: what may be outside a cube that fits


def frame_count(path: Path) -> int:
    """How many octrees there are; reads their headers."""
    return len(_extents(path))


def read_times(path: Path) -> NDArray[np.float64]:
    """(T,) seconds."""
    return np.array([extent.header.time for extent in _extents(path)])


def read_unit(path: Path) -> str:
    """The unit of the first octree."""
    return read_header(FileBytes(path).read(0, LARGEST_HEADER))[0].unit


def check(path: Path) -> None:
    """Raise InputError where a pose is too large to be read again, by the headers alone."""
    for extent in _extents(path):
        leaves = extent.header.levels[-1].nodes
        needed = max(extent.memory, leaves * (_LEAF_BYTES + extent.header.width))
        admit(path.stat().st_size, needed, _MOST_RATIO)


class Frames:
    """The octrees of one file. It holds the one that it read last, so reading them in turn reads each once.

    Any thread may read.
    """

    def __init__(self, path: Path) -> None:
        """Reads the headers. Raises InputError where the file holds something else."""
        self._octrees = Octrees(FileBytes(path), _extents(path), lambda: path.stat().st_size)

    def read(self, frame: int) -> PointCloud:
        """The leaves of one pose. Raises InputError where it, or a pose that it refers to, is damaged."""
        *_, finest = self._octrees.levels(frame)
        return finest()

    def coarser(self, frame: int) -> Iterator[PointCloud]:
        """The leaves of coarser octrees of one pose, each finer than the one before; perhaps none."""
        return self._octrees.coarser(frame)


class Octrees:
    """Octrees one after the other in a source of bytes."""

    def __init__(self, source: ByteSource, extents: Sequence[OctreeExtent], held: Callable[[], int]) -> None:
        """held: the bytes that the source has, of which reading may take a multiple."""
        self._source, self.extents, self._held = source, extents, held
        self._last: tuple[int, Octree] | None = None
        self._reading = Lock()

    def levels(self, frame: int) -> Iterator[Callable[[], PointCloud]]:
        """The leaves of one octree level by level, as they are read, as functions that make the points; the
        last are those of the file. Raises InputError where it, or one that it refers to, is damaged."""
        with self._reading:
            start = frame - self.extents[frame].header.before
            octree = previous = None
            if self._last is not None and start <= self._last[0] < frame:
                start, previous = self._last[0] + 1, self._last[1]
            for index in range(start, frame):
                *_, previous = self._trees(index, previous)
            strays = read_strays(self.extents[frame].header, self._read_of(frame))
            is_held = self._last is not None and self._last[0] == frame
            trees = self._trees(frame, previous) if self._last is None or not is_held else [self._last[1]]
            for octree in trees:
                yield partial(self._points, octree, strays)
            assert octree is not None, "an octree has a level, or reading it fails"
            self._last = frame, octree

    def coarser(self, frame: int) -> Iterator[PointCloud]:
        """See `Frames.coarser`."""
        deepest = len(self.extents[frame].header.levels) - 1
        for level, points in enumerate(self.levels(frame)):
            if level < deepest and self.extents[frame].header.levels[level].nodes >= _FIRST_SHOWN:
                yield points()

    def _points(self, octree: Octree, strays: Strays) -> PointCloud:
        admit(self._held(), octree.nbytes + octree.leaves * _LEAF_BYTES, _MOST_RATIO)
        return stored_points(octree, strays)

    def _trees(self, index: int, previous: Octree | None) -> Iterator[Octree]:
        extent = self.extents[index]
        admit(self._held(), extent.memory, _MOST_RATIO)
        for octree in read_levels(extent.header, self._read_of(index), previous):
            checkpoint()
            yield octree

    def _read_of(self, index: int) -> Read:
        """Reads behind the header of an octree, not beyond its end."""
        extent = self.extents[index]
        if not extent.is_whole:
            read_header(self._source.read(extent.offset, LARGEST_HEADER))  # raises the error

        def read(start: int, size: int) -> bytes:
            return self._source.read(extent.behind + start, size)

        return read


def stored_points(octree: Octree, strays: Strays) -> PointCloud:
    """The leaves of an octree that a file stores, and the points outside; they carry the octree."""
    octree = with_discs(octree, len(strays))
    cloud = _joined(leaf_points(octree, means=False), strays)
    return replace(cloud, octree=StoredOctree(octree, cloud.positions, cloud.origin))


def _joined(leaves: PointCloud, strays: Strays) -> PointCloud:
    """Leaves, and behind them points outside; these are as large as half of the leaves are at most where
    they have no radius."""
    if not len(strays):
        return leaves
    own = PointCloud.from_arrays(
        strays.positions, colors=strays.colors, normals=strays.normals, origin=leaves.origin
    )
    assert leaves.radii is not None
    usual = np.full(len(own), np.median(leaves.radii), np.float32)
    known = usual if strays.radii is None else np.where(strays.radii > 0, strays.radii, usual)
    own = replace(own, radii=known)

    def both(first: NDArray | None, second: NDArray | None) -> NDArray | None:
        return None if first is None or second is None else np.concatenate([first, second])

    without = np.zeros_like(leaves.positions)
    return replace(
        leaves,
        positions=np.concatenate([leaves.positions, own.positions]),
        colors=both(leaves.colors, own.colors),
        normals=both(leaves.normals, own.normals),
        radii=both(leaves.radii, own.radii),
        remainders=both(without, own.remainders),
    )


def write_poses(
    path: Path,
    poses: Iterable[Pose],
    unit: str,
    stop: Stop | None = None,
    around: Bounds | None = None,
) -> None:
    """Write the octrees of all poses. stop: where their subdivision ends. around: the bounds of them all;
    None: those of the first, with a margin.

    They share the cube around these for as long as it fits, since only then one tells of the next.
    """
    cube = None if around is None else Cube.around(around.low, around.high)
    previous, chain = None, 0
    with open(path, "wb") as file:
        for pose in poses:
            cube = _cube_for(pose.cloud, cube, is_of_all=around is not None)
            octree = build(pose.cloud, stop, cube)
            reference, strays = previous if chain < _LONGEST else None, Strays.of(octree, pose.cloud)
            data = to_bytes(octree, reference, chain=chain, time=pose.time, unit=unit, strays=strays)
            file.write(data)
            previous, chain = octree, read_header(data)[0].before + 1


def _cube_for(cloud: PointCloud, cube: Cube | None, is_of_all: bool) -> Cube:
    """The cube of the pose before where it fits, else one with a margin. is_of_all: whether that before is of
    all poses, and so not too large for this one."""
    body = Cube.of(cloud)
    may_be_outside = max(len(body.outside(cloud)), _FEW * len(cloud))
    is_close = cube is not None and (is_of_all or cube.edge <= _TOO_LARGE * body.edge)
    if cube is not None and is_close and len(cube.outside(cloud)) <= may_be_outside:
        return cube
    return _with_margin(body)


def _with_margin(cube: Cube) -> Cube:
    margin = _MARGIN * cube.edge
    return Cube.around(cube.low - margin, cube.low + cube.edge + margin)


class OctreeExtent(NamedTuple):
    """Place of an octree. offset, behind: where its header begins, and what stands behind it. is_whole:
    whether the bytes hold its header."""

    offset: int
    behind: int
    header: Header
    is_whole: bool = True

    @property
    def memory(self) -> int:
        """Bytes that decoding it takes at most at a time."""
        nodes = [level.nodes for level in self.header.levels]
        # Twice: with the tree of the pose before.
        held = 2 * (_HELD_BYTES if self.header.width else 1) * sum(nodes)
        outside = _STRAY_BYTES * self.header.strays.nodes
        around = _AROUND_BYTES * sum(sorted(nodes[:-2])[-2:])
        return max(nodes) * (_NODE_BYTES + 4 * self.header.width) + around + held + outside


def _extents(path: Path) -> list[OctreeExtent]:
    """All octrees of a file. Raises InputError where there is something else, or a chain has no beginning."""
    status = path.stat()
    return _found(path, status.st_size, status.st_mtime_ns)


@lru_cache(maxsize=2)  # opening a scan asks for them several times
def _found(path: Path, size: int, changed: int) -> list[OctreeExtent]:
    """`_extents` of a file of this size and time of change."""
    return find_extents(FileBytes(path))


def find_extents(source: ByteSource) -> list[OctreeExtent]:
    """All octrees of a source of bytes, at least one; the first alone of a stream, whose end nobody knows.

    Raises InputError where there is something else, or a chain has no beginning.
    """
    extents: list[OctreeExtent] = []
    offset = 0
    while (data := source.read(offset, LARGEST_HEADER)) or not extents:
        try:
            header, taken = read_header(data)
        except CutShort as error:
            if not extents:
                error.what = f"octree 0, at byte 0: {error.what}"
                raise
            extents.append(_cut(extents, offset))  # reading it raises the error
            break
        except InputError as error:
            error.what = f"octree {len(extents)}, at byte {offset}: {error.what}"
            raise
        check_count(len(extents) + 1, _MOST_POSES, "octrees")
        if extents and header.unit != extents[0].header.unit:
            raise InputError(f"octree {len(extents)} has a different unit of length than the first octree")
        extents.append(OctreeExtent(offset, offset + taken, header))
        if source.is_stream:
            break
        offset += taken + header.stored
    counts = [0, *(extent.header.before for extent in extents)]
    for index, (above, here) in enumerate(pairwise(counts)):
        if here not in (0, above + 1) or here > index:
            raise InputError(f"octree {index} depends on {here} octrees before it, which are missing")
    return extents


def _cut(extents: list[OctreeExtent], offset: int) -> OctreeExtent:
    """The extent of an octree whose header is cut off, with the expected time."""
    last = extents[-1].header
    step = last.time - extents[-2].header.time if len(extents) > 1 else 1.0
    return OctreeExtent(offset, offset, replace(last, before=0, time=last.time + step), is_whole=False)

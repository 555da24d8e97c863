"""What octrees take on disk, in bits for each point of a pose: each alone, and told by the pose before.

Beside them the same leaves by Draco, which makes the same error, and the points as float32, as they are, by
gzip and by LZMA. Positions alone; headers are counted.
"""

from __future__ import annotations

import gzip
import lzma
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from experiments.slomp_2014.scans import scans
from viewer.bench.scenes import catalog
from viewer.scan.octree.build import Stop, build
from viewer.scan.octree.cube import Cube
from viewer.scan.octree.occupancy import OccupancyCoder
from viewer.scan.octree.octree import Octree
from viewer.scan.octree.storage import from_bytes, to_bytes
from viewer.scan.open import DEMO, open_scan
from viewer.scan.points import PointCloud

STOPS = {
    "2 %": Stop(delta=0.02),
    "5 %": Stop(delta=0.05),
    "depth 8": Stop(rule="depth", depth=8),
}
_SEQUENCES = {  # of depth cameras
    "hands-knot": "sequences/hands_knot_5",
    "waving-cat": "sequences/waving_cat_16",
}
_ROUNDS = 5  # that a time is the least of
_DRACO_LEVEL = 10  # its best


@dataclass(frozen=True)
class Sizes:
    """Sizes of one pose under one stop rule.

    points: of the pose. depth, leaves, loss: of its octree. psnr: `d1_psnr` of the leaves' middles, dB.
    bits: for each point, by method: "masks" one byte for each inner node; "intra" the octree alone; "inter"
    all levels told by the pose before; "chosen" as it is written, the shorter of both for each level;
    "draco", "float32", "gzip", "lzma". speeds: million points in a second of processor time, of "intra":
    "encode" and "decode", the fastest of some rounds.
    """

    scene: str
    points: int
    stop: str
    depth: int
    leaves: int
    loss: float
    psnr: float
    bits: dict[str, float]
    speeds: dict[str, float]


def d1_psnr(original: NDArray[np.float64], decoded: NDArray[np.float64]) -> float:
    """MPEG's point-to-point error D1 in dB: 10 log10(3 p^2 / e), infinite where there is no error.

    original, decoded: (N, 3), (M, 3). p: the longest edge of the original's bounding box. e: the mean squared
    distance from each point of one to the nearest of the other, the larger of both directions (Tian et al.
    2017, Geometric Distortion Metrics for Point Cloud Compression, and MPEG's pc_error).
    """
    from scipy.spatial import cKDTree

    error = max(
        float(np.mean(np.square(cKDTree(there).query(here)[0])))
        for here, there in ((original, decoded), (decoded, original))
    )
    peak = float((original.max(axis=0) - original.min(axis=0)).max())
    return 10 * float(np.log10(3 * peak**2 / error)) if error > 0 else np.inf


def measure(data: Path | None) -> Iterator[Sizes]:
    """Every scene under every stop rule. data: the folder of real scans; None: the demo alone."""
    for scene, before, pose in pairs(data):
        for name, stop in STOPS.items():
            yield _sizes(scene, before, pose, name, stop)


def pairs(data: Path | None) -> Iterator[tuple[str, PointCloud, PointCloud]]:
    """Scenes with two poses from their middle.

    The paper's stand-ins come as they are stored and with as many points as its scans have.
    """
    missing = catalog.scene_names(data)
    theirs = [scan for scan in scans() if scan.name and not missing[scan.scene]]
    counts = [*((scan.scene, None) for scan in theirs), *((scan.scene, scan.points) for scan in theirs)]
    for scene, count in dict.fromkeys(counts):
        subject = catalog.subject(scene, data, count=count)
        middle = subject.moments // 2
        before, pose = (subject.moment(index).pose.cloud for index in (middle - 1, middle))
        yield scene, before, pose
    for scene, path in _captures(data):
        with open_scan(path) as timeline:
            middle = len(timeline) // 2
            yield scene, timeline.pose(middle - 1).cloud, timeline.pose(middle).cloud


def _captures(data: Path | None) -> Iterator[tuple[str, str | Path]]:
    """The demo, and what depth cameras saw."""
    yield DEMO, DEMO
    for scene, folder in _SEQUENCES.items():
        if data is not None and (data / folder).is_dir():
            yield scene, data / folder


def _sizes(scene: str, before: PointCloud, pose: PointCloud, name: str, stop: Stop) -> Sizes:
    cube = _shared_cube(before, pose)
    previous, octree = (build(cloud, stop, cube, attributes=False) for cloud in (before, pose))
    alone, chosen = to_bytes(octree), to_bytes(octree, previous)
    leaves = from_bytes(chosen, previous).centers(octree.depth)
    raw = np.ascontiguousarray(pose.world(), np.float32).tobytes()
    stored = {
        "masks": sum(masks.nbytes for masks in octree.masks),
        "intra": len(alone),
        "inter": len(alone) - _masks(octree, None) + _masks(octree, previous),
        "chosen": len(chosen),
        "draco": len(_draco(octree)),
        "float32": len(raw),
        "gzip": len(gzip.compress(raw)),
        "lzma": len(lzma.compress(raw)),
    }
    return Sizes(
        scene=scene,
        points=len(pose),
        stop=name,
        depth=octree.depth,
        leaves=octree.leaves,
        loss=octree.loss,
        psnr=d1_psnr(pose.world(), leaves),
        bits={method: 8 * size / len(pose) for method, size in stored.items()},
        speeds={
            "encode": len(pose) / _processor_time(lambda: to_bytes(octree)) / 1e6,
            "decode": len(pose) / _processor_time(lambda: from_bytes(alone)) / 1e6,
        },
    )


def _processor_time(work: Callable[[], object]) -> float:
    """Seconds, all threads together."""
    times = []
    for _ in range(_ROUNDS):
        start = time.process_time()
        work()
        times.append(time.process_time() - start)
    return min(times)


def _masks(octree: Octree, previous: Octree | None) -> int:
    """Bytes of all masks, told by another tree on every level."""
    coder = OccupancyCoder(previous.masks if previous else ())
    size = 0
    for masks in octree.masks:
        stored, learnt = coder.encode(masks, predicted=True)
        size += len(stored)
        coder.descend(masks, learnt)
    return size


def _shared_cube(*clouds: PointCloud) -> Cube:
    places = [cloud.world() for cloud in clouds]
    return Cube.around(
        np.min([place.min(axis=0) for place in places], axis=0),
        np.max([place.max(axis=0) for place in places], axis=0),
    )


def _draco(octree: Octree) -> bytes:
    """The middles of the leaves by Draco, which keeps them, as its steps are made those between leaves."""
    import DracoPy

    size, steps = octree.size(octree.depth), 2**octree.depth - 1
    data: bytes = DracoPy.encode(
        octree.cells(octree.depth) * size,
        quantization_bits=max(octree.depth, 1),
        quantization_range=max(steps, 1) * size,
        quantization_origin=[0.0, 0.0, 0.0],
        compression_level=_DRACO_LEVEL,
    )
    return data

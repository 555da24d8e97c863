"""Bits a point of octree files: of what `convert` writes, and of positions alone by method."""

from __future__ import annotations

import tempfile
from argparse import Namespace
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np

from experiments.script import Script
from experiments.slomp_2014 import octree_sizes
from experiments.tables import Row, spaced
from viewer.bounds import Bounds
from viewer.scan import formats
from viewer.scan.octree.storage import Header, read_header
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose

GEOMETRY = {
    "masks": "masks", "intra": "intra", "inter": "inter", "written": "chosen", "Draco": "draco",
    "LZMA": "lzma"
}  # fmt: skip
STOP = "5 %"


def written(options: Namespace) -> Iterator[Row]:
    """Bits a point of what `convert` writes: of a pose that stands alone, and of the one after it."""
    for scene, *clouds in octree_sizes.pairs(options.data):
        row = {"pose": scene, "points": spaced(len(clouds[1]))}
        for prefix, (header, size) in zip(("", "relative: "), _written(clouds), strict=True):
            parts = {
                "masks": sum(level.masks for level in header.levels),
                "attributes": sum(level.attributes for level in header.levels),
                "in all": size,
            }
            points = header.points + header.strays.nodes
            row |= {f"{prefix}{part}": f"{8 * nbytes / points:.2f}" for part, nbytes in parts.items()}
        yield row


def geometry(options: Namespace) -> Iterator[Row]:
    """Bits a point of positions alone, by method, of poses that share a cube."""
    for row in octree_sizes.measure(options.data):
        if row.stop == STOP:
            bits = {title: f"{row.bits[method]:.2f}" for title, method in GEOMETRY.items()}
            shape = {"level": str(row.depth), "D1, dB": f"{row.psnr:.1f}"}
            yield {"pose": row.scene, "points": spaced(row.points), **shape, **bits}


def _written(clouds: list[PointCloud]) -> list[tuple[Header, int]]:
    """Header and bytes of each octree in the file that these poses become."""
    boxes = [cloud.bounds() for cloud in clouds]
    around = Bounds(np.min([box.low for box in boxes], axis=0), np.max([box.high for box in boxes], axis=0))
    around = around.grown(float((around.high - around.low).max()) / 8)  # as `convert` does with several
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "poses.svo"
        poses = (Pose(number, number / 25, "", cloud) for number, cloud in enumerate(clouds))
        formats.write_poses(path, poses, "mm", around=around)
        data = path.read_bytes()
    found, ends = [], [0]
    while ends[-1] < len(data):
        header, size = read_header(data[ends[-1] :])
        found.append(header)
        ends.append(ends[-1] + size + header.stored)
    return [(header, end - start) for header, (start, end) in zip(found, pairwise(ends), strict=True)]


EXPERIMENT = Script([written, geometry], {"data": None}, "octree-files.md")

"""The tables of docs/reference/octree-files.md, measured anew.

    python docs/tables/octree_files.py [NAME ...]

They give the same figures on any machine. All scenes but the demo need the data folder.
"""

from __future__ import annotations

import tempfile
from itertools import pairwise
from pathlib import Path

import numpy as np

from viewer.bench.papers.slomp_2014 import octree_sizes
from viewer.bench.report.measurement import markdown_table, remeasure_tables, spaced
from viewer.bounds import Bounds
from viewer.scan import formats
from viewer.scan.octree.storage import Header, read_header
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "reference" / "octree-files.md"
DATA = ROOT.parent / "shared" / "data"
GEOMETRY = ("masks", "intra", "inter", "chosen", "draco", "lzma")
STOP = "5 %"


def written() -> str:
    """Bits a point of what `convert` writes: of a pose that stands alone, and of the one after it."""
    lines = []
    for scene, *clouds in octree_sizes.pairs(DATA if DATA.is_dir() else None):
        first, second = (
            [_bits(sum(_masks(header)), header), _bits(sum(_attributes(header)), header), _bits(size, header)]
            for header, size in _written(clouds)
        )
        lines.append([scene, spaced(len(clouds[1])), *first, *second])
    head = [
        "pose",
        "points",
        "masks",
        "attributes",
        "in all",
        "told: masks",
        "told: attributes",
        "told: in all",
    ]
    return markdown_table(head, lines, left=["pose"])


def geometry() -> str:
    """Bits a point of positions alone, by method, of poses that share a cube."""
    rows = [row for row in octree_sizes.measure(DATA if DATA.is_dir() else None) if row.stop == STOP]
    lines = [
        [
            row.scene,
            spaced(row.points),
            str(row.depth),
            f"{row.psnr:.1f}",
            *(f"{row.bits[m]:.2f}" for m in GEOMETRY),
        ]
        for row in rows
    ]
    head = ["pose", "points", "level", "D1, dB", "masks", "intra", "inter", "written", "Draco", "LZMA"]
    return markdown_table(head, lines, left=["pose"])


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


def _masks(header: Header) -> list[int]:
    return [level.masks for level in header.levels]


def _attributes(header: Header) -> list[int]:
    return [level.attributes for level in header.levels]


def _bits(size: int, header: Header) -> str:
    return f"{8 * size / (header.points + header.strays.nodes):.2f}"


if __name__ == "__main__":
    remeasure_tables(PAGE, written, geometry)

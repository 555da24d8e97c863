"""Whole files of scans, one or more of each format."""

from __future__ import annotations

from pathlib import Path

import laspy
import lzf
import numpy as np
import OpenEXR
from PIL import Image
from PIL.TiffImagePlugin import ImageFileDirectory_v2
from word_scenes import GREY, front_view, scattered

from viewer.codewords.encode import encode_elements
from viewer.codewords.files import write_stream, writing_streams
from viewer.scan import formats
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose
from viewer.scan.range_view import RangeView, merge

_PCD = (
    "FIELDS x y z rgb n\nSIZE 4 4 4 4 2\nTYPE F F F F U\nCOUNT 1 1 1 1 2\nWIDTH 3\nHEIGHT 4\nPOINTS 12\nDATA "
)
_PLY = "ply\nformat ascii 1.0\nelement vertex 3\n" + "".join(f"property float {name}\n" for name in "xyz")
TEXTS = {
    "list.ply": f"{_PLY}property list uchar int seen_by\nend_header\n1 2 3 2 0 1\n4 5 6 0\n7 8 9 1 5\n",
    "mesh.ply": f"{_PLY}element face 1\nproperty list uchar int vertex_index\nend_header\n"
    "1 2 3\n4 5 6\n7 8 9\n3 0 1 2\n",
    "ascii.pcd": f"{_PCD}ascii\n" + "1 2 3 1e-38 7 8\n" * 12,
    "mesh.obj": "v 0 0 1 1 0 0\nv 1 2 3 0 1 0\nvn 0 0 1\nf 1//1 2//1 1//1\nf 1/2/1 -1//-1 2//1\n",
    "plain.xyz": "1 2 3 4 5 6\n7 8 9 1 2 3\n",
    "commas.xyz": "# x y z\n1,2,3\n4,5,6\n",
    "named.csv": '"x";"y";"z";"GPS Time"\r\n1;2;3;4\r\n5;6;7;8\r\n',
    "tabs.txt": "X\tY\tZ\tR\tG\tB\n1\t2\t3\t4\t5\t6\n",
    "plain.asc": "1 2 3\n4 5 6\n7 8 9\n",
    "normals.xyzn": "1 2 3 0 0 1\n4 5 6 0 1 0\n7 8 9 1 0 0\n",
    "colors.xyzrgb": "1 2 3 255 0 0\n4 5 6 0 255 0\n7 8 9 0 0 255\n",
    "both.xyznrgb": "1 2 3 0 0 1 255 0 0\n4 5 6 0 1 0 0 255 0\n7 8 9 1 0 0 0 0 255\n",
    "intensity.xyzi": "1 2 3 10\n4 5 6 20\n7 8 9 30\n",
    "count.pts": "2\n1 2 3 4 5 6 7\n8 9 1 2 3 4 5\n",
}


def write_scans(folder: Path) -> None:
    """Write the files into a folder."""
    for name, text in TEXTS.items():
        (folder / name).write_text(text)
    packed = lzf.compress(bytes(240))
    sizes = np.array([len(packed), 240], "<u4").tobytes()
    (folder / "packed.pcd").write_bytes(f"{_PCD}binary_compressed\n".encode() + sizes + packed)
    rng = np.random.default_rng(7)
    normals = rng.normal(size=(60, 3))
    cloud = PointCloud.from_arrays(
        rng.random((60, 3)) * 2,
        normals=normals / np.linalg.norm(normals, axis=1, keepdims=True),
        colors=rng.integers(0, 256, (60, 4), np.uint8),
        radii=rng.random(60),
        axes=rng.random((60, 4)),
        scalars={"intensity": rng.random(60, np.float32), "gps_time": rng.random(60) + 1e9},
    )
    for suffix in formats.writable_suffixes():
        formats.write(folder / f"full{suffix}", cloud)
    poses = [Pose(index, index / 25, "", cloud) for index in range(3)]
    formats.write_poses(folder / "scan.svo", poses, "mm")
    scanned = laspy.create(point_format=3)
    scanned.xyz = cloud.world()
    for suffix in (".las", ".laz"):
        scanned.write(folder / f"scanned{suffix}")
    sequence = np.ones((3, 8, 3), np.float32)
    np.save(folder / "sequence.npy", sequence)
    np.save(folder / "columns.npy", np.asfortranarray(sequence[0].astype(">f8")))
    np.savez(
        folder / "radii.npz", positions=sequence, radii=np.ones(8), origin=np.ones(3), times=np.arange(3)
    )
    np.savez_compressed(folder / "packed.npz", positions=sequence, label=np.ones((3, 8), np.int8))
    depth = rng.random((7, 9), np.float32) + 1
    to_camera = np.eye(4)
    views = [
        RangeView(
            depth=depth, mask=depth < 1.9, color=rng.random((7, 9, 3)).astype(np.float16), confidence=depth,
            fx=10.0, fy=10.0, cx=4.5, cy=3.5, world_to_camera=to_camera, name=name, unit="mm",
        )
        for name in ("left", "right")
    ]  # fmt: skip
    formats.write(folder / "views.exr", merge(views), views)
    _write_grids(folder)
    _write_words(folder)


def _write_words(folder: Path) -> None:
    """Code words of one picture, and of three."""
    view = front_view((20, 16), perspective=True)
    pictures = [encode_elements(scattered(9, view.size, seed), view, GREY) for seed in (1, 1, 2)]
    write_stream(pictures[0], folder / "words.cw")
    with writing_streams(folder / "moving.cw") as add:
        for number, stream in enumerate(pictures):
            add(stream, number / 25)


def _write_grids(folder: Path) -> None:
    """Range views as other programs write them."""
    row, column = np.mgrid[:7, :9].astype(np.float32)
    depth = 2 + 0.1 * column
    grid = np.stack([(column - 4) * depth / 9, (row - 3) * depth / 9, depth], axis=2)
    head = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 9\nHEIGHT 7\nVIEWPOINT 1 2 3 0 1 0 0\nDATA binary\n"
    (folder / "organised.pcd").write_bytes(head.encode() + grid.tobytes())
    np.savez(
        folder / "depth.npz", depth=depth, kind="range", unit="m", intrinsics=np.diag([9.0, 9, 1]),
        distortion=np.array([0.1, 0, 0, 0]), pose=np.eye(4), mask=depth > 2, color=depth / 9,
    )  # fmt: skip
    np.savez(folder / "grid.npz", xyz=grid)
    np.savez(folder / "scanner.npz", xyz=np.stack([column, row, np.sin(column)], axis=2), unit="mm")
    np.savez(folder / "terrain.npz", elevation=row.astype(np.int16), xmin=0, xmax=9, ymin=7, ymax=0)
    ground = ImageFileDirectory_v2()
    for tag, numbers in {33550: (2.0, 2.0, 0.0), 33922: (0.0, 0.0, 0.0, 5e5, 4e6, 0.0)}.items():
        ground.tagtype[tag], ground[tag] = 12, numbers
    ground.tagtype[34735], ground[34735] = 3, (1, 1, 0, 2, 1024, 0, 1, 1, 3076, 0, 1, 9001)
    ground.tagtype[42113], ground[42113] = 2, "3"
    Image.fromarray(row).save(folder / "terrain.tif", tiffinfo=ground)
    for suffix in (".tif", ".tiff"):
        Image.fromarray(row.astype(np.uint16)).save(folder / f"depth{suffix}", compression="tiff_lzw")
    layers = {f"L.Depth.{name}": np.ascontiguousarray(depth) for name in "ZA"} | {
        f"L.Combined.{name}": depth.astype(np.float16) for name in "RGBA"
    }
    header = {"type": OpenEXR.scanlineimage, "worldToCamera": np.eye(4, dtype=np.float32)}
    with open(folder / "render.exr", "wb") as stream:
        OpenEXR.File(header, layers).write(stream)

"""Every real scan file is read as its README has it, or refused in one clear message."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from viewer.errors import InputError
from viewer.scan.formats import known_suffixes, read, read_points

REFUSED = {
    "odd/ply/assimp_issue623.ply": "row 0 of vertex ends before its vertex_indices",
    "odd/ply/assimp_pond.0.ply": "contains only 70048 of the 70051 vertices",
    "odd/ply/pdal_no_vertex.ply": "has no vertex element",
    "odd/ply/pdal_sized_dims.ply": "no x, y and z among the columns: x, y, j, i",
    "odd/ply/pdal_unsized_dims.ply": "no x, y and z among the columns: y, x, i, j",
    "odd/ply/trimesh_empty.ply": "holds no vertices",
    "odd/ply/trimesh_ply_empty_ascii.ply": "holds no vertices",
    "odd/ply/trimesh_ply_empty_bin.ply": "holds no vertices",
    "odd/ply/trimesh_ply_empty_header.ply": "has no vertex element",
    "odd/ply/truedepth_raw_frame-045.ply": "has no vertex element, only: metadata, color, depth",
    "odd/pcd/missingheader.pcd": "has no DATA line",
    "odd/pcd/stereo_left.pcd": "the columns do not include x, y and z: red, green, blue",
    "odd/pts_ptx_txt/badheader.txt": "line 1 names 'x' twice, and lacks x, y or z",
    "odd/pts_ptx_txt/text.txt": "line 1 contains neither numbers nor the names x, y and z",
    "odd/other/no_vertex.obj": "holds no points",
}

# Where the README does not say, or says what a wrong count in the file says: counted by hand.
COUNTED = {
    "bunny_8.pts": 9,  # behind a count of 8
    "crlf_test.txt": 10, "largescan.txt": 6, "missingheader.txt": 5, "numeric_dim.txt": 5,
    "points_agisoft.xyz": 100, "points_cloudcompare.xyz": 101, "quoted.txt": 9, "site_56_8.pts": 8,
    "cat_header_missing_property_keyword_00022.ply": 13_533,
    "utm17_1.txt": 10, "utm17_2.txt": 10, "utm17_3.txt": 11,
}  # fmt: skip


def stated_count(line: str) -> int | None:
    """The number of points that a line of the README states."""
    for pattern in (
        r"vertex=(\d+)",
        r"POINTS (\d+)",
        r"([\d,]+) (?:points|vertices)",
        r"\| ([\d,]+) / [\d,]+ \|",
    ):
        if found := re.search(pattern, line):
            return int(found[1].replace(",", ""))
    return None


@pytest.mark.parametrize("folder", ["models", "odd/ply", "odd/pcd", "odd/pts_ptx_txt", "odd/other"])
def test_every_file_is_read_as_stated_or_refused(folder: str, data_dir: Path) -> None:
    readme = (data_dir / "README.md").read_text(encoding="utf-8").splitlines()
    files = [path for path in sorted((data_dir / folder).iterdir()) if path.suffix in known_suffixes()]
    assert files
    for path in files:
        name = path.relative_to(data_dir).as_posix()
        if name in REFUSED:
            with pytest.raises(InputError, match=re.escape(REFUSED[name])) as caught:
                read(path)
            assert str(caught.value).startswith(str(path))
            continue
        stated = [stated_count(line) for line in readme if line.startswith(f"| {name} |")]
        expected = COUNTED.get(path.name, stated[0] if stated else None)
        cloud = read(path)
        assert (name, len(cloud) + cloud.dropped) == (name, expected)


@pytest.mark.parametrize(
    ("pattern", "files", "fewest", "most"),
    [
        ("sequences/hands_knot_5/*.ply", 5, 145_752, 149_027),
        ("sequences/owlii_basketball_player_10/*.ply", 10, 20_604, 21_037),
        ("sequences/waving_cat_16/*.ply", 16, 13_500, 13_795),
        ("sequences/kitti_lidar_street_10/*.pcd", 10, 114_396, 119_978),
        ("sequences/crane_175/frames/*.ply", 175, 10_002, 10_002),
        ("sequences/horse_gallop_48/frames/*.ply", 48, 8_431, 8_431),
        ("range/pcl_pairwise_kinect_5/*.pcd", 5, 244_573, 249_931),
        ("range/pcl_organised/*.pcd", 1, 209_280, 209_280),
    ],
)
def test_sequences(pattern: str, files: int, fewest: int, most: int, data_dir: Path) -> None:
    counts = [len(read_points(path)) for path in sorted(data_dir.glob(pattern))]
    assert (len(counts), min(counts), max(counts)) == (files, fewest, most)


def test_the_same_points_in_six_spellings(data_dir: Path) -> None:
    """UTM coordinates to the centimetre, in float32 by declaration but not in the text."""
    names = ["pcd/utm17_comma.pcd", "pcd/utm17_space.pcd", "pcd/utm17_tab.pcd"]
    names += [f"pts_ptx_txt/utm17_{i}.txt" for i in (1, 2, 3)]
    for name in names:
        points = read(data_dir / "odd" / name).world()
        np.testing.assert_allclose(points[0], [289814.15, 4320978.61, 170.76], rtol=0, atol=1e-6)
        np.testing.assert_allclose(points[-1], [289818.50, 4320980.59, 170.58], rtol=0, atol=1e-6)


def test_colours_of_two_programs_agree(data_dir: Path) -> None:
    agisoft = read(data_dir / "odd/pts_ptx_txt/points_agisoft.xyz")
    cloudcompare = read(data_dir / "odd/pts_ptx_txt/points_cloudcompare.xyz")
    np.testing.assert_allclose(cloudcompare.world()[:100], agisoft.world(), rtol=0, atol=1e-6)
    np.testing.assert_array_equal(cloudcompare.colors[:100], agisoft.colors)
    assert not cloudcompare.scalars


def test_fields_of_a_survey(data_dir: Path) -> None:
    cloud = read(data_dir / "odd/pcd/autzen-utm.pcd")
    assert cloud.scalars["GpsTime"].dtype == np.float64
    assert cloud.scalars["Intensity"].dtype == np.uint16
    assert len(cloud.scalars) == 10
    assert cloud.colors[:, :3].max() > 100


def test_ascii_scan_equals_its_converted_range_image(data_dir: Path) -> None:
    folder = data_dir / "range/stanford_bunny_scans"
    with np.load(folder / "bun000.npz") as arrays:
        image = arrays["xyz"].reshape(-1, 3)
    image = image[np.isfinite(image).all(axis=1)]
    points = read(folder / "original/bun000.ply").world()
    assert points.shape == image.shape == (40_256, 3)
    np.testing.assert_allclose(np.sort(points, axis=0), np.sort(image, axis=0), rtol=0, atol=1e-7)


def test_fused_surfels_have_radii(data_dir: Path) -> None:
    cloud = read(data_dir / "range/truedepth_head_30/fused_reference_45428.ply")
    assert len(cloud) == 45_428
    assert cloud.normals is not None
    assert 0.0001 < np.median(cloud.radii) < 0.01  # metres
    assert not cloud.scalars


@pytest.mark.parametrize(
    "name",
    [
        "odd/pcd/room_scan1.pcd",
        "odd/pcd/milk_color.pcd",
        "odd/pcd/bun0.pcd",
        "odd/pcd/colored_cloud.pcd",
        "models/open3d_living_room_fragment.pcd",
        "sequences/kitti_lidar_street_10/0000000003.pcd",
    ],
)
def test_another_reader_sees_the_same(name: str, data_dir: Path) -> None:
    import open3d

    other = open3d.t.io.read_point_cloud(str(data_dir / name)).point
    cloud = read(data_dir / name)
    np.testing.assert_allclose(cloud.world(), other["positions"].numpy(), rtol=0, atol=1e-6)
    if "colors" in other:
        np.testing.assert_array_equal(cloud.colors[:, :3], other["colors"].numpy())
    if "normals" in other:
        np.testing.assert_array_equal(cloud.normals, other["normals"].numpy())
    for scalar in cloud.scalars:
        np.testing.assert_array_equal(cloud.scalars[scalar], other[scalar].numpy()[:, 0])

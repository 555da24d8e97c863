"""Which way is up is guessed of what a scan's frames tell: of every kind that there is, and of made ones."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from viewer.bounds import Bounds
from viewer.scan.open import open_scan
from viewer.scan.points import PointCloud
from viewer.scan.upright import first_elevation, guess_up

# Of each scan what is up in it, as people see, and whether it is ground, which is first seen from above.
REAL = {
    "models/bimba_points_80002.ply": "+y",
    "models/cyberware_horse_48485.ply": "+z",
    "models/cyberware_igea_134345.ply": "+y",
    "models/open3d_living_room_fragment.pcd": "-y",
    "models/stanford_armadillo_43243.ply": "+y",
    "models/stanford_bunny_35947.ply": "+y",
    "models/stanford_dragon_5205.ply": "+y",
    "sequences/crane_175": "+y",
    "sequences/hands_knot_5": "+y",
    "sequences/horse_gallop_48": "+y",
    "sequences/kitti_lidar_street_10": "+z from above",
    "sequences/owlii_basketball_player_10": "+y",
    "sequences/waving_cat_16": "+y",
    "range/middlebury_motorcycle_stereo": "+y",
    "range/open3d_rgbd": "+y",
    "range/openexr_beachball": "+y",
    "range/pcl_organised": "+y",
    "range/pcl_pairwise_kinect_5": "+y",
    "range/sevenscenes_kinect_31": "-y",
    "range/stanford_bunny_scans": "+y",
    "range/stanford_bunny_scans/bun000.npz": "+y",
    "range/stanford_dragon_stand_scans": "+y",
    "range/terrain/bigtujunga_30m.tif": "+z from above",
    "range/terrain/jacksboro_fault_dem.npz": "+z from above",
    "range/truedepth_head_30": "+y",
    "odd/pcd/CSite1_red2-utm.pcd": "+z from above",
    "odd/pcd/autzen-utm.pcd": "+z from above",
    "odd/pcd/bun0.pcd": "+y",
    "odd/pcd/ism_train_horse.pcd": "+z",
    "odd/pcd/lamppost.pcd": "+z",
    "odd/pcd/milk_color.pcd": "-y",
    "odd/pcd/room_scan1.pcd": "+z from above",
    "odd/pcd/samp11-utm.pcd": "+z from above",
    "odd/ply/trimesh_fuze_ascii.ply": "+z",
    "odd/ply/trimesh_reference.ply": "+y",
    "odd/pts_ptx_txt/autzen.pts": "+z from above",
    "demo": "+y",
}


@pytest.mark.parametrize("scan", REAL)
def test_real_scans_are_upright(scan: str, data_dir: Path) -> None:
    with open_scan(scan if scan == "demo" else data_dir / scan) as timeline:
        pose = timeline.pose(0)
        up, _, from_above = REAL[scan].partition(" ")
        assert pose.upright.up == up, pose.upright
        assert first_elevation(pose.bounds, up) == (35 if from_above else 0)
        assert pose.upright is pose.upright, "found once"


def box(size: tuple[float, float, float], center: tuple[float, float, float]) -> NDArray[np.float64]:
    """4000 points on the surface of a box."""
    rng = np.random.default_rng(5)
    points = rng.uniform(-0.5, 0.5, (4000, 3))
    axis = rng.integers(0, 3, 4000)
    points[np.arange(4000), axis] = rng.choice([-0.5, 0.5], 4000)
    return points * size + center


def person() -> NDArray[np.float64]:
    """Somebody who stands upright along z and holds out both arms: x to the sides."""
    parts = [
        box((0.15, 0.28, 0.9), (-0.15, 0, 0.45)), box((0.15, 0.28, 0.9), (0.15, 0, 0.45)),
        box((0.5, 0.25, 0.6), (0, 0, 1.2)), box((1.3, 0.1, 0.1), (0, 0, 1.4)),
        box((0.2, 0.2, 0.25), (0, 0, 1.65)),
    ]  # fmt: skip
    return np.concatenate(parts)


TURNED = {"+z": (0, 1, 2), "+y": (0, 2, 1)}  # the axes of the person that become x, y and z


@pytest.mark.parametrize(("up", "factor"), [("+z", 1), ("+y", 1), ("-y", -1)])
def test_who_stands_is_upright(up: str, factor: int) -> None:
    points = person()[:, [0, 2, 1] if up[1] == "y" else [0, 1, 2]]
    points[:, 1] *= factor
    for unit in (1.0, 1000.0, 1e-3):
        told = guess_up(PointCloud.from_arrays(points * unit))
        assert told.up == up, told
        assert told.confidence > 0.5


def ball(size: tuple[float, float, float], center: tuple[float, float, float]) -> NDArray[np.float64]:
    """2000 points on an ellipsoid."""
    rng = np.random.default_rng(6)
    away = rng.normal(size=(2000, 3))
    return away / np.linalg.norm(away, axis=1, keepdims=True) / 2 * size + center


@pytest.mark.parametrize("up", ["+y", "+z"])
@pytest.mark.parametrize("front", [0.0, 90.0, 180.0, -90.0])
def test_people_are_seen_from_where_their_toes_point(front: float, up: str) -> None:
    legs = [ball((0.15, 0.15, 1.0), (side, 0, 0.5)) for side in (-0.12, 0.12)]
    feet = [box((0.1, 0.25, 0.06), (side, -0.1, 0.03)) for side in (-0.12, 0.12)]
    body = [ball((0.9, 0.2, 0.7), (0, 0, 1.2)), ball((0.2, 0.2, 0.25), (0, 0, 1.65))]
    points = np.concatenate([*legs, *feet, *body])
    turn = np.radians(front)
    points[:, :2] = points[:, :2] @ [[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]]
    if up == "+y":
        points = points[:, [0, 2, 1]] * (1, 1, -1)
    told = guess_up(PointCloud.from_arrays(points))
    assert (told.up, told.front) == (up, front)


@pytest.mark.parametrize(("head", "front"), [(-1, 0.0), (1, 180.0)])
def test_animals_are_seen_from_where_their_head_is(head: int, front: float) -> None:
    legs = [ball((0.1, 0.1, 0.8), (x, y, 0.4)) for x in (-0.12, 0.12) for y in (-0.5, 0.5)]
    hooves = [box((0.1, 0.1, 0.03), (x, y, 0.015)) for x in (-0.12, 0.12) for y in (-0.5, 0.5)]
    points = np.concatenate([*legs, *hooves, ball((0.5, 1.6, 0.5), (0, 0, 1))])
    points = np.concatenate([points, ball((0.2, 0.5, 0.3), (0, head, 1.5))])
    told = guess_up(PointCloud.from_arrays(points))
    assert (told.up, told.front) == ("+z", front)
    aside = guess_up(PointCloud.from_arrays(points[:, [1, 0, 2]]))
    assert (aside.up, aside.front) == ("+z", 0.0), "its side tells more"


def seen_from_zero(height: float) -> NDArray[np.float64]:
    """What a depth camera at zero sees of somebody before a wall: y down, z away from it."""
    across, down = np.meshgrid(np.linspace(-0.5, 0.5, 90), np.linspace(-0.4, 0.4, 70))
    is_body = (np.abs(across) < 0.12) & (down > -0.3)
    depth = np.where(is_body, 1.8 + 0.4 * across**2, 3.0 + 0.1 * down)
    return np.stack([across * depth, down * depth + height, depth], axis=2).reshape(-1, 3)


def test_what_a_depth_camera_saw_has_y_down() -> None:
    assert guess_up(PointCloud.from_arrays(seen_from_zero(0.0))).up == "-y"
    assert guess_up(PointCloud.from_arrays(seen_from_zero(0.0) * (1, 1, -1))).up == "+y", "seen along -z"
    assert guess_up(PointCloud.from_arrays(seen_from_zero(30.0))).up == "+y", "not in a camera's picture"
    around = np.concatenate([box((1, 2, 1), (0, 0, 3)), box((0.3, 0.3, 0.3), (0, 1.2, 3))])
    assert guess_up(PointCloud.from_arrays(around)).up == "+y", "its back is there too"


@pytest.mark.parametrize("up", ["+z", "+y"])
def test_what_is_wide_and_low_lies_on_the_ground(up: str) -> None:
    hills = np.random.default_rng(7).uniform(-50, 50, (5000, 3))
    hills[:, 2] = 4 * np.sin(hills[:, 0] / 9) * np.cos(hills[:, 1] / 7)
    told = guess_up(PointCloud.from_arrays(hills[:, TURNED[up]]))
    assert (told.up, told.confidence > 0.5) == (up, True)
    sheet = hills * (1, 1, 0)
    assert guess_up(PointCloud.from_arrays(sheet)).confidence < 0.5, "a wall, or a floor"


@pytest.mark.parametrize("count", [2, 5000])
def test_map_coordinates_have_z_up(count: int) -> None:
    steep = np.add(np.random.default_rng(7).uniform(0, 300, (count, 3)), (512_000, 5_403_000, 350))
    told = guess_up(PointCloud.from_arrays(steep))
    assert told.up == "+z"
    assert first_elevation(Bounds(steep.min(axis=0), steep.max(axis=0)), "+z") == 35
    assert guess_up(PointCloud.from_arrays(np.add(steep, (0, 0, 400_000)))).up == "+y", "merely far away"


@pytest.mark.parametrize("count", [0, 1, 99])
def test_few_points_tell_nothing(count: int) -> None:
    told = guess_up(PointCloud.from_arrays(np.random.default_rng(7).normal(size=(count, 3)) * (1, 1, 9)))
    assert (told.up, told.confidence < 0.5) == ("+y", True)


def test_ground_is_first_seen_from_above() -> None:
    street, room, body = (
        Bounds(np.zeros(3), np.array(edges)) for edges in ((90, 60, 9), (6, 5, 1.6), (1, 2, 1))
    )
    assert [first_elevation(one, "+z") for one in (street, room, body)] == [35, 35, 0]
    assert first_elevation(street, "+y") == 0
    assert first_elevation(Bounds(np.zeros(3), np.array([9.0, 0, 0])), "+y") == 0, "a row"

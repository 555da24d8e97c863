"""Measured distances, on scenes whose points are where they are known to be."""

from __future__ import annotations

import csv
import itertools
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import filling
import numpy as np
import pytest
from numpy.typing import NDArray
from scenes import looking_down_z, plane, sphere

from viewer.analysis.measure import COLUMNS, Measurement, distance_in_words, reading_of, table
from viewer.analysis.pick import Neighbor, Picked, pick
from viewer.analysis.spot import Spot
from viewer.camera import Camera
from viewer.csv_text import save_rows, to_text
from viewer.errors import InputError
from viewer.gpu.constants import EMPTY
from viewer.picture.surface import NOTHING, Surface
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose

Draw = Callable[..., Surface]
SIZE = (60, 40)
FAR = np.array([1e7, -2e7, 1e7])  # of the size of UTM coordinates


def looking_from(eye: NDArray[np.float64], **fields: object) -> Camera:
    return Camera(**{**looking_down_z(**fields).to_json(), "eye": eye, "target": eye - np.array([0, 0, 1])})


def clicked(surface: Surface, camera: Camera, point: NDArray[np.float64]) -> Spot:
    """The end that a click on the pixel of a point sets."""
    offsets = (point - surface.pose.cloud.origin)[None]
    x, y = surface.view.project(offsets)[0][0]
    picked = pick(surface, int(x), int(y))
    assert picked is not None
    return Spot.of(picked, Pose(0, 0.0, "", surface.pose.cloud))


def end(position: tuple[float, float, float], spacing: float | None = 0.1, **fields: object) -> Spot:
    return Spot(**{"frame": 0, "time": 0.0, "position": position, "snapped": "point", "id": 0,
                  "spacing": spacing, "level": 0} | fields)  # fmt: skip


@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
@pytest.mark.parametrize("offset", [np.zeros(3), FAR], ids=["near", "far"])
def test_ends_are_the_picked_places_at_points_that_are_known(
    draw: Draw, projection: str, offset: NDArray[np.float64]
) -> None:
    rng = np.random.default_rng(5)
    # In steps of 2^-10, so that float64 holds them exactly at either place.
    points = np.round(rng.uniform([-1, -0.7, -5], [1, 0.7, -4], (7, 3)) * 1024) / 1024 + offset
    fields = {"projection": projection, "height": 2.0} if projection == "orthographic" else {"fov_y": 29}
    camera = looking_from(offset, **fields)
    surface = draw(PointCloud.from_arrays(points), camera, SIZE)
    seen = sorted(set(surface.id[surface.id != NOTHING].tolist()))
    assert len(seen) > 4
    pixel = 2.6 / SIZE[1]  # at depth 5
    for a, b in itertools.pairwise(seen):
        ends = [clicked(surface, camera, points[i]) for i in (a, b)]
        for made, i in zip(ends, (a, b), strict=True):
            assert (made.id, made.snapped, made.level) == (i, "surface", 0)
            assert math.dist(made.position, points[i]) <= pixel / math.sqrt(2), "within the pixel"
            np.testing.assert_allclose(made.position + np.array(made.neighbors[0].offset), points[i])
        made = Measurement(*ends)
        assert made.uncertainty is not None
        assert abs(made.distance - math.dist(points[a], points[b])) < made.uncertainty


def test_an_end_has_the_spacing_around_its_point_and_the_frame_of_its_pose(draw: Draw) -> None:
    surface = draw(plane(100, depth=4.0), looking_down_z(), SIZE, "surfels")
    picked = pick(surface, 30, 20)
    assert picked is not None
    made = Spot.of(picked, Pose(7, 0.28, "", surface.pose.cloud))
    assert (made.frame, made.time, made.id) == (7, 0.28, picked.id)
    assert made.spacing == pytest.approx(0.05, rel=0.2)


@pytest.mark.parametrize("hole", [0.0, 3.2])
def test_a_filled_place_between_points_of_one_surface_is_taken(draw: Draw, hole: float) -> None:
    """Not so in the middle of a hole that is some spacings wide to each side."""
    dense = sphere(3000)
    spacing = math.sqrt(4 * math.pi / 3000)
    points = dense.positions + dense.origin
    away = np.linalg.norm(points - np.array([0.0, 0.0, 1.0]), axis=1)
    cloud = PointCloud.from_arrays(points[(away > hole * spacing) & (points[:, 2] > 0)])
    camera = Camera(eye=(0.0, 0.0, 3.0), target=(0.0, 0.0, 0.0), fov_y=45.0)
    params = {"reach": 100.0, "widest": 3.0}
    surface = draw(cloud, camera, (120, 120), "pyramidal", params=params)
    filled = (surface.level > 0) & (surface.level < EMPTY)
    rows, columns = np.nonzero(filled[58:62, 58:62])
    assert len(rows) > 10
    taken, inside, pose = 0, 0, Pose(0, 0.0, "", cloud)
    for row, column in zip(rows.tolist(), columns.tolist(), strict=True):
        picked = pick(surface, 58 + column, 58 + row)
        assert picked is not None
        try:
            spot = Spot.of(picked, pose)
        except InputError:
            continue
        assert spot.uncertainty is not None
        taken, inside = taken + 1, inside + (abs(np.linalg.norm(spot.position) - 1) <= spot.uncertainty)
    if hole:
        assert taken == 0
    else:
        assert taken > 0.9 * len(rows)
        assert inside >= 0.95 * taken


def test_a_filled_place_is_refused_unless_allowed(draw: Draw) -> None:
    cloud = plane(10, depth=4.0, spacing=0.5)
    surface = draw(cloud, looking_down_z(), SIZE, filling.BACKEND)
    y, x = np.argwhere(surface.level == 2)[0].tolist()
    picked, pose = pick(surface, x, y), Pose(0, 0.0, "", cloud)
    assert picked is not None
    with pytest.raises(InputError, match="filled by the renderer"):
        Spot.of(picked, pose)
    made = Spot.of(picked, pose, filled=True)
    assert (made.snapped, made.id, made.level) == ("surface", None, 2)
    assert made.position == tuple(picked.position)
    nearest = np.linalg.norm(cloud.positions - picked.position, axis=1).min()
    assert made.spacing is not None
    assert made.spacing >= nearest * (1 - 1e-5)
    assert made.uncertainty is not None


def test_on_a_measured_surface_without_a_point_the_spacing_counts() -> None:
    cloud = plane(40, depth=4.0)
    made = Spot.of(Picked(np.array([0.01, 0.01, -4.0]), level=0), Pose(0, 0.0, "", cloud))
    assert made.snapped == "surface"
    assert made.spacing == pytest.approx(0.05, rel=0.2)


def spread(*deviations: float) -> tuple[float, float, float, float, float, float]:
    """The covariance of independent deviations along the axes."""
    x, y, z = (deviation**2 for deviation in deviations)
    return x, 0.0, 0.0, y, 0.0, z


def test_independent_errors_along_the_line_add_in_squares() -> None:
    one, other = end((0, 0, 0), covariance=spread(5, 5, 0.3)), end((0, 0, 50), covariance=spread(7, 7, 0.4))
    assert Measurement(one, other).uncertainty == pytest.approx(1.96 * 0.5)
    assert Measurement(one, end((0, 8, 6))).uncertainty is None, "of a session of before"
    close = replace(other, position=(0.0, 0, 1))
    assert Measurement(one, close).uncertainty == pytest.approx(1.96 * math.hypot(5, 7)), "not told apart"


def test_the_uncertainty_covers_what_ends_that_err_give() -> None:
    """Its formula against draws: ends that deviate differently in each direction."""
    rng, tilted = np.random.default_rng(1), np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))[0]
    spreads = [tilted @ np.diag([0.3, 0.1, 0.02]) ** 2 @ tilted.T, np.diag([0.05, 0.2, 0.1]) ** 2]
    places = np.array([[0.0, 0, 0], [20, 30, -10]])
    ends = [
        end(tuple(place), covariance=tuple(matrix[np.triu_indices(3)]))
        for place, matrix in zip(places, spreads, strict=True)
    ]
    drawn = [rng.multivariate_normal(place, m, 100_000) for place, m in zip(places, spreads, strict=True)]
    off = np.linalg.norm(drawn[1] - drawn[0], axis=1) - math.dist(*places)
    uncertainty = Measurement(*ends).uncertainty
    assert uncertainty is not None
    assert np.mean(np.abs(off) <= uncertainty) == pytest.approx(0.95, abs=0.003)


@pytest.mark.parametrize(
    ("distance", "uncertainty", "text"),
    [
        (12.3456, 0.4, "12.3 ± 0.4 mm (95 %)"),
        (12.3456, 0.04, "12.35 ± 0.04 mm (95 %)"),
        (12.3456, 0.149, "12.35 ± 0.15 mm (95 %)"),
        (12.3456, 0.196, "12.3 ± 0.2 mm (95 %)"),
        (12.3456, 0.97, "12.3 ± 1.0 mm (95 %)"),
        (1234.56, 30.0, "1230 ± 30 mm (95 %)"),
        (1234.56, 12.3, "1235 ± 12 mm (95 %)"),
        (0.000123456, 2e-6, "0.000123 ± 0.000002 mm (95 %)"),
        (1e-15, 2e-17, "1e-15 ± 2e-17 mm (95 %)"),
        (12.3456, None, "12.3456 mm"),
    ],
)
def test_digits_follow_the_uncertainty(distance: float, uncertainty: float | None, text: str) -> None:
    assert distance_in_words(distance, uncertainty, "mm") == text


# --- through time ---------------------------------------------------------------------------


def moved(index: int) -> Pose:
    """Four points that grow apart from frame to frame; number 1 is missing in frame 3."""
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]) * (1 + index) + FAR
    if index == 3:
        points[1] = np.nan
    return Pose(index, index / 25, "", PointCloud.from_arrays(points))


def measured(pose: Pose, *ids: int) -> Measurement:
    world = pose.cloud.world()  # without missing points, so that rows are ids
    return Measurement(*(end(tuple(world[id]), id=id, frame=pose.index, time=pose.time) for id in ids))


def test_it_follows_its_points_where_the_scan_has_one_topology() -> None:
    made = measured(moved(0), 0, 2)
    reading = reading_of(made, moved(4), True)
    assert (reading.fixed, reading.motion) == (None, "moves with the surface")
    assert reading.measurement == measured(moved(4), 0, 2)
    assert reading.measurement.distance == 5 * made.distance
    assert reading_of(reading.measurement, moved(0), True).measurement == made


@pytest.mark.parametrize("one_topology", [False, None])
def test_it_stays_in_space_where_the_scan_does_not_tell(one_topology: bool | None) -> None:
    made = measured(moved(0), 0, 2)
    reading = reading_of(made, moved(4), one_topology)
    assert reading.measurement == made
    assert reading.motion == "fixed in space"
    assert "does not tell" in str(reading.fixed)


def turned_patch(index: int) -> Pose:
    """Twelve points in a plane that turn about z by 20 degrees a frame, and go up; a point far away stays."""
    angle = math.radians(20 * index)
    turn = np.array(
        [[math.cos(angle), -math.sin(angle), 0], [math.sin(angle), math.cos(angle), 0], [0, 0, 1]]
    )
    x, y = np.meshgrid(np.arange(4.0), np.arange(3.0))
    patch = np.stack([x.ravel() + 10, y.ravel(), np.zeros(12)], axis=1) @ turn.T + [0, 0, index]
    return Pose(index, index / 25, "", PointCloud.from_arrays(np.concatenate([patch, [[0, 0, -50]]])))


def test_an_end_beside_its_points_turns_with_them() -> None:
    start, (ox, oy, oz) = turned_patch(0), (11.4, 0.7, 0.05)
    near = tuple(Neighbor(i, tuple(start.cloud.world(i) - [ox, oy, oz])) for i in (1, 2, 5, 6, 9))
    one = end((ox, oy, oz), id=1, snapped="surface", covariance=spread(0.3, 0.1, 0), neighbors=near)
    other = end((0, 0, -50), id=12, covariance=spread(0.1, 0.1, 0.1))
    made = Measurement(one, other)
    assert reading_of(made, start, True).measurement == made, "where it was made, nothing moves"
    reading = reading_of(made, turned_patch(2), True).measurement
    angle = math.radians(40)
    expected = [
        ox * math.cos(angle) - oy * math.sin(angle),
        ox * math.sin(angle) + oy * math.cos(angle),
        oz + 2,
    ]
    np.testing.assert_allclose(reading.first.position, expected, atol=1e-5)
    assert reading.first.spread is not None
    np.testing.assert_allclose(np.linalg.eigvalsh(reading.first.spread), [0, 0.01, 0.09], atol=1e-4)
    assert reading.first.spread[0, 1] > 0.01, "it is turned too"
    back = reading_of(reading, start, True).measurement
    np.testing.assert_allclose(back.first.position, one.position, atol=1e-5)


def test_points_that_move_each_their_own_way_make_an_end_less_sure() -> None:
    start = turned_patch(0)
    torn = start.cloud.world() + np.random.default_rng(3).normal(0, 0.2, (13, 3))
    near = tuple(Neighbor(i, tuple(start.cloud.world(i) - [11.4, 0.7, 0.0])) for i in range(12))
    ends = [end((11.4, 0.7, 0.0), id=i, covariance=spread(0.1, 0.1, 0.1), neighbors=near) for i in (1, 12)]
    moved_ = reading_of(Measurement(*ends), Pose(1, 0.04, "", PointCloud.from_arrays(torn)), True).measurement
    assert moved_.first.spread is not None
    assert np.sqrt(np.diag(moved_.first.spread)) == pytest.approx(math.hypot(0.1, 0.2), rel=0.3)


def test_it_stays_in_space_without_points_to_follow() -> None:
    made = measured(moved(0), 0, 1)
    assert reading_of(made, moved(2), True).fixed is None
    missing = reading_of(made, moved(3), True)
    assert (missing.measurement, missing.fixed) == (made, "point 1 is missing in this frame")
    on_surface = Measurement(made.first, end((1, 2, 3), snapped="surface", id=None))
    assert "surface" in str(reading_of(on_surface, moved(2), True).fixed)
    between_frames = Measurement(made.first, measured(moved(1), 0, 1).second)
    assert "two frames" in str(reading_of(between_frames, moved(2), True).fixed)


# --- as a file ------------------------------------------------------------------------------


def test_a_csv_holds_everything_with_all_digits(tmp_path: Path) -> None:
    made = measured(moved(2), 0, 3)
    made = Measurement(*(replace(e, covariance=spread(0.1, 0.2, 0.1)) for e in made.ends))
    surface = Measurement(end((0.1, 1 / 3, 2), None, snapped="surface", id=None, level=2), made.second)
    readings = [(1, reading_of(made, moved(2), True)), (2, reading_of(surface, moved(2), True))]
    file = tmp_path / "distances.csv"
    save_rows(file, table(readings, 'the "left", ear', "mm"))
    assert file.read_bytes().count(b"\r\n") == 3
    with open(file, newline="", encoding="utf-8") as stream:
        first, second = csv.DictReader(stream)
    assert tuple(first) == COLUMNS
    assert (first["scan"], first["measurement"], first["unit"]) == ('the "left", ear', "1", "mm")
    assert float(first["distance"]) == made.distance
    assert float(first["uncertainty"]) == made.uncertainty
    assert (first["motion"], second["motion"]) == ("moves with the surface", "fixed in space")
    for number, e in enumerate(made.ends, 1):
        assert int(first[f"frame_{number}"]) == 3, "as the window counts them"
        assert float(first[f"time_{number}"]) == e.time
        assert int(first[f"id_{number}"]) == e.id
        assert tuple(float(first[f"{axis}_{number}"]) for axis in "xyz") == e.position
        assert float(first[f"spacing_{number}"]) == e.spacing
        assert float(first[f"uncertainty_{number}"]) == e.uncertainty
    assert (second["id_1"], second["spacing_1"], second["uncertainty"]) == ("", "", "")
    assert (second["snapped_1"], second["level_1"]) == ("surface", "2")
    assert float(second["y_1"]) == 1 / 3


def test_a_table_for_the_clipboard_has_tabs() -> None:
    text = to_text(table([(1, reading_of(measured(moved(0), 0, 1), moved(0), True))], "scan", "units"), "\t")
    assert [len(line.split("\t")) for line in text.splitlines()] == [len(COLUMNS)] * 2


def test_a_table_tells_lengths_in_the_unit_that_it_names() -> None:
    reading = reading_of(measured(moved(0), 0, 1), moved(0), True)
    metres, millimetres = (
        dict(zip(COLUMNS, table([(1, reading)], "scan", unit, factor)[1], strict=True))
        for unit, factor in (("m", 1.0), ("mm", 1000.0))
    )
    lengths = {"distance", "x_1", "y_1", "z_1", "spacing_1", "x_2", "y_2", "z_2", "spacing_2"}
    assert (metres["unit"], millimetres["unit"]) == ("m", "mm")
    for name in lengths:
        assert millimetres[name] == 1000.0 * metres[name], name
    for name in set(COLUMNS) - lengths - {"unit", "uncertainty", "uncertainty_1", "uncertainty_2"}:
        assert millimetres[name] == metres[name], name


def test_a_csv_that_cannot_be_written_is_one_message(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be written"):
        save_rows(tmp_path / "no folder" / "a.csv", [["a"]])
    assert list(tmp_path.iterdir()) == []

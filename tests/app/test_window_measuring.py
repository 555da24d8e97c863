"""Measuring in the window with real clicks and keys, against scans whose points are known.

A click is right to the pixel: the places and distances that it gives are those of the points to about that.
"""

from __future__ import annotations

import csv
import io
import math
import re
import time
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from virtual_screen import PANEL, RunningApp, Screen, running_app, slow_pictures
from written import write_mesh

from viewer.camera import Camera
from viewer.scan.points import PointCloud
from viewer.view import View

FAR = np.array([1e7, -2e7, 1e7])  # of the size of UTM coordinates
FACES = ((0, 1, 2), (1, 2, 3))
CLICK = 0.45  # scan units, more than a pixel of the view that is started with


def grid(scale: float) -> NDArray[np.float64]:
    """15 x 11 points on z = 0, in steps that float32 and float64 hold exactly, (165, 3)."""
    x, y = np.meshgrid(np.arange(15) - 7, np.arange(11) - 5)
    return np.stack([x.ravel(), y.ravel(), np.zeros(165)], axis=1) * 8 * scale


def wall(columns: range, z: float) -> NDArray[np.float64]:
    """Points at a depth in the same steps, 17 in each column, (17 n, 3)."""
    x, y = np.meshgrid(np.array(columns), np.arange(17) - 8)
    return np.stack([8.0 * x.ravel(), 8.0 * y.ravel(), np.full(x.size, z)], axis=1)


def pixel_of(app: RunningApp, points: NDArray[np.float64], number: int) -> tuple[int, int]:
    """Where the screen shows a point."""
    left, top, width, height = app.view()
    cloud = PointCloud.from_arrays(points)
    camera = Camera.from_json(app.state.camera)
    view = View.of(camera, (width, height), cloud.origin, cloud.bounds())
    x, y = view.project(cloud.positions[number][None])[0][0]
    return left + int(x), top + int(y)


def click(app: RunningApp, place: tuple[int, int], times: int = 1) -> None:
    app.do(("mousemove", *place), ("click", "--repeat", times, "--delay", 0, 1))


def ctrl(screen: Screen, key: str) -> None:
    """As fingers do it: one key after the other."""
    screen.do("key", f"ctrl+{key}")


def measure(app: RunningApp, points: NDArray[np.float64], one: int, other: int) -> tuple[float, float]:
    """Click two points, the second one twice by habit; distance and uncertainty as the app has them."""
    click(app, pixel_of(app, points, one))
    app.see(is_under_way=True)
    click(app, pixel_of(app, points, other), times=2)
    made = app.see(lambda state: state.distances).distances[-1]
    for end, number in zip(made["ends"], (one, other), strict=True):
        assert (end["id"], end["frame"]) == (number, 0)
        assert math.dist(end["position"], points[number]) < CLICK
    return made["distance"], made["uncertainty"]


def expect_reading(app: RunningApp, *distances: float, state: str = "tracked") -> None:
    """Wait until the distances read so."""
    wanted = [(pytest.approx(distance, abs=2 * CLICK), state) for distance in distances]
    app.see(lambda seen: [(one["distance"], one["state"]) for one in seen.distances] == wanted)


def name_unit(app: RunningApp, name: str) -> None:
    """Say how long one unit of the scan is."""
    app.choose(PANEL, "##unit", f"###{name}")
    app.see(unit=name)


def read_back(app: RunningApp, folder: Path) -> None:
    """Read the folder's table by the command, after what is none and one of another scan."""
    screen, table = app.screen, (folder / "table.csv").read_text()
    (folder / "other.csv").write_text(table.replace("scan.npz", "another.npz"))
    ctrl(screen, "z")
    expect_reading(app)
    ctrl(screen, "k")
    app.settle()
    screen.do("type", "--delay", 40, "nowhere.csv")
    screen.do("key", "Return")
    app.settle()
    ctrl(screen, "a")  # the field has kept the keyboard
    screen.do("type", "--delay", 40, "other.csv")
    screen.do("key", "Return")
    app.told("belongs to the scan 'another.npz', not to 'scan.npz'")
    ctrl(screen, "k")
    app.settle()
    for _ in range(len([one for one in folder.iterdir() if one.is_dir()]) + 1):
        screen.do("key", "Down")  # over the folders and the newer of two tables
        app.settle()
    screen.do("key", "Return")
    app.told("Imported 1 distances")


@pytest.fixture
def keys_file(tmp_path: Path) -> None:
    """Keys for what has none of its own."""
    folder = tmp_path / "config" / "scan4d"
    folder.mkdir(parents=True)
    keys = '[keys]\nsave_distances = "Ctrl+L"\ncopy_distances = "Ctrl+C"\nread_distances = "Ctrl+K"\n'
    (folder / "keys.toml").write_text(keys)


@pytest.mark.usefixtures("keys_file")
@pytest.mark.slow
def test_distances_that_follow_their_points_are_undone_and_saved(screen: Screen, tmp_path: Path) -> None:
    frames = [grid(1.0) + FAR, grid(1.25) + FAR, grid(1.5) + FAR]
    np.savez(tmp_path / "scan.npz", positions=np.stack(frames), faces=np.array(FACES))
    distances = [math.dist(points[34], points[128]) for points in frames]
    with running_app(screen, tmp_path, "scan.npz") as app:
        screen.do("key", "m")
        app.see(clicking="measuring")
        name_unit(app, "cm")
        distance, uncertainty = measure(app, frames[0], 34, 128)
        assert abs(distance - distances[0]) < uncertainty < 2 * CLICK
        expect_reading(app, distances[0], state="placed")

        screen.do("key", "Right")
        expect_reading(app, distances[1])
        ctrl(screen, "z")
        expect_reading(app)
        ctrl(screen, "y")
        expect_reading(app, distances[1])

        ctrl(screen, "c")
        app.told("Copied")
        copied = list(csv.DictReader(io.StringIO(screen.clipboard()), delimiter="\t"))
        ctrl(screen, "l")
        app.settle()
        screen.do("key", "Escape")
        app.settle()
        assert app.state.clicking == "measuring", "Escape closes the dialog alone"
        ctrl(screen, "l")
        app.settle()
        screen.do("type", "--delay", 40, "nowhere/table")
        screen.do("key", "Return")
        app.settle()
        ctrl(screen, "a")  # the field has kept the keyboard
        screen.do("type", "--delay", 40, "table")
        screen.do("key", "Return")
        file = app.told("Saved (.*), in all 3 frames")[1]
        assert file == str(tmp_path / "table.csv")
        with open(file, newline="", encoding="utf-8") as stream:
            saved = list(csv.DictReader(stream))
        assert saved[:2] == copied
        for row, frame in zip(saved, (0, 1, 2), strict=True):
            assert (row["scan"], row["unit"], row["frame"]) == ("scan.npz", "cm", str(frame + 1))
            assert abs(float(row["distance"]) - distances[frame]) < 2 * CLICK
            assert row["state_1"] == row["state_2"] == ("tracked" if frame else "placed")
            assert (row["point_1"], row["point_2"]) == (("", "") if frame else ("34", "128"))
            place = [float(row[f"{axis}_2"]) for axis in "xyz"]
            assert math.dist(place, frames[frame][128]) < 2 * CLICK

        ctrl(screen, "z")
        expect_reading(app)
        for told in (
            "Imported 1 distances.",
            "Imported 0 distances. The scan already has 1 of the distances",
        ):
            app.drop(tmp_path / "table.csv")
            app.told(re.escape(told))
            expect_reading(app, distances[1])
        read_back(app, tmp_path)
        expect_reading(app, distances[1])

        ctrl(screen, "o")
        app.settle()
        screen.do("key", "Return")
        app.see(scan=str(tmp_path / "scan.npz"))
        expect_reading(app, distances[1])  # it is the same scan by another name

        screen.do("key", "Escape")
        app.see(clicking=None)
        click(app, pixel_of(app, frames[0], 34))
        after = app.settle()
        assert (after.is_under_way, len(after.distances)) == (False, 1), "clicks set no ends any longer"
        assert "Traceback" not in app.log()


def test_without_one_topology_it_is_tracked_or_has_a_reason(screen: Screen, tmp_path: Path) -> None:
    scan = tmp_path / "scan"
    scan.mkdir()
    for number, faces in enumerate((FACES, FACES, FACES[::-1])):
        write_mesh(scan / f"{number}.ply", grid(1 + number / 4), faces)
    points = grid(1.0)
    with running_app(screen, tmp_path, scan) as app:
        screen.do("key", "m")
        click(app, (app.view()[0] + 10, app.view()[1] + 10))
        app.told("No surface here")
        distance, _ = measure(app, points, 34, 128)
        expect_reading(app, distance, state="placed")
        screen.do("key", "End")
        app.see(lambda seen: seen.frame == 2 and seen.distances[0]["state"] != "not tracked yet")
        assert re.match("tracked|no data: ", app.state.distances[0]["state"])
        screen.do("key", "ctrl+Home")
        app.see(frame=0)

        before = app.settle()
        start = pixel_of(app, points, 34)
        after = app.drag(start, (start[0] + 90, start[1]))
        assert after.camera != before.camera
        assert (after.is_under_way, len(after.distances)) == (False, 1), (
            "a drag turns the view and sets no end"
        )
        assert "Traceback" not in app.log()


@pytest.mark.slow
def test_a_double_click_in_a_slow_window_sets_one_end(screen: Screen, tmp_path: Path) -> None:
    points = grid(1.0)
    write_mesh(tmp_path / "scan.ply", points, FACES)
    with running_app(screen, tmp_path, tmp_path / "scan.ply", before=slow_pictures(0.2)) as app:
        screen.do("key", "m")
        app.see(clicking="measuring")
        measure(app, points, 34, 128)
        after = app.settle()
        assert (after.is_under_way, len(after.distances)) == (False, 1)


@pytest.mark.slow
def test_where_another_surface_may_be_meant_the_second_click_counts(screen: Screen, tmp_path: Path) -> None:
    """Beside the last points of a wall before another, these do not tell which of the two is seen."""
    front, behind = (wall(*extent) for extent in ((range(-5, 1), 0.0), (range(-5, 6), -40.0)))
    points = np.concatenate([front, behind, [(3.0, 8.0, 0.0)]])
    write_mesh(tmp_path / "scan.ply", points[:-1], FACES)
    with running_app(screen, tmp_path, tmp_path / "scan.ply") as app:
        screen.do("key", "m")
        app.see(clicking="measuring")
        place = pixel_of(app, points, -1)
        click(app, place)
        app.told(r"This position may be on the surface in front or behind \(\d+%\)\. Click here again")
        assert not app.settle().is_under_way
        inside = int(np.flatnonzero((points == (-16.0, 8.0, 0.0)).all(axis=1))[0])
        click(app, pixel_of(app, points, inside))
        app.see(is_under_way=True)
        click(app, place)
        app.told("Click here again")
        assert not app.settle().distances, "a click elsewhere takes back what the first one was for"
        click(app, place)
        if not app.settle().distances:
            click(app, place)  # the one before was the second of a double click
        made = app.see(lambda state: state.distances).distances[-1]
        assert abs(made["distance"] - (16 + 3)) < made["uncertainty"]

        app.do(("key", "Escape"))
        app.see(clicking=None)
        screen.do("key", "k")
        app.see(clicking="landmarks")
        time.sleep(0.5)  # else it is the second of a double click
        click(app, place)
        app.told("Click here again")
        assert not app.settle().landmarks
        click(app, place)
        if not app.settle().landmarks:
            click(app, place)
        app.see(lambda state: len(state.landmarks) == 1)

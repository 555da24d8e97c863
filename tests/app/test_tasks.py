"""The tasks of docs/developing/survey.md (Farooq 2013, 7.2.1), done in a real window, with their actions."""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from scenes import sphere
from test_window import Screenshot, on_screen, shown
from virtual_screen import PANEL, ROOT, SIZE, RunningApp, running_app, virtual_screen

from viewer.analysis.pick import pick
from viewer.picture.surface import EMPTY, Surface
from viewer.scan import formats
from viewer.scan.open import open_scan
from viewer.scan.points import PointCloud

pytestmark = pytest.mark.slow

FACES = ("face_a.npz", "face_b.npz")
MOUTH = (-24.0, -62.0, 92.0), (24.0, -62.0, 92.0)  # its corners
NOSE, LEFT_EYE, RIGHT_EAR = (0.0, -28.5, 109.5), (31.0, 10.0, 74.0), (-84.0, 0.0, -18.0)  # of the demo, mm


class Person:
    """Does tasks and counts what it takes: a key, a click, a drag, a turn of the wheel is one action each."""

    def __init__(self, app: RunningApp) -> None:
        self.app = app
        self.task = ""
        self.actions: Counter[str] = Counter()

    def press(self, *keys: str) -> None:
        self._act("key", "+".join(keys))

    def drag(self, button: int, right: float, up: float) -> None:
        """From the middle of the view; right, up: in heights of it."""
        left, top, width, height = self.app.view()
        x, y = left + width // 2, top + height // 2
        end = x + round(right * height), y - round(up * height)
        middle = (x + end[0]) // 2, (y + end[1]) // 2
        self.app.drag((x, y), middle, end, button=button)
        self.actions[self.task] += 1

    def click(self, place: tuple[int, int]) -> None:
        self.app.do(("mousemove", *place))
        self._act("click", 1)

    def choose(self, name: str, word: str) -> None:
        """An item of a list in the panel; opening the list is part of it."""
        self.app.choose(PANEL, f"{name}/##value", f"###{word}")
        self.app.settle()
        self.actions[self.task] += 1

    def push(self, window: str, button: str) -> None:
        self.app.act(window, ("item_click", button))
        self.actions[self.task] += 1

    def turn_wheel(self, clicks: int) -> None:
        """Forward, or back for fewer than none."""
        self._act("click", "--repeat", abs(clicks), "--delay", 30, 4 if clicks > 0 else 5)

    def go_to_the_list(self) -> None:
        """See the list, and leave it again for what comes next, which is no action."""
        without = shown(self.app).copy()
        self.press("q")
        assert (shown(self.app) != without).mean() > 0.1, "the list lies over the view"
        self.app.screen.do("key", "Escape")
        self.app.settle()

    def point(self, position: tuple[float, float, float]) -> None:
        """Move the mouse there, which is no action."""
        self.app.screen.do("mousemove", *on_screen(self.app, *self.pixel(position)))
        self.app.settle()

    def _act(self, *words: object) -> None:
        self.app.screen.do(*words)
        self.app.settle()
        self.actions[self.task] += 1

    # --- what it sees -----------------------------------------------------------------

    def look(self) -> Screenshot:
        shot = Screenshot(self.app)
        self.app.send_notes_away()
        self.app.settle()
        return shot

    def pixel(self, position: tuple[float, float, float]) -> tuple[int, int]:
        """Where a position is in the picture."""
        _, _, width, height = self.app.view()
        place = self.look().camera.place_in_picture(position)
        assert place is not None
        return int(width / 2 + place[0] * height), int(height / 2 - place[1] * height)

    def sees(self, position: tuple[float, float, float], within: float) -> bool:
        """Whether the surface at its pixel is so near to it, mm: nothing is in front of it."""
        picked = pick(self.look().surface(), *self.pixel(position))
        return picked is not None and float(np.linalg.norm(picked.position - position)) < within


@pytest.fixture
def person(tmp_path: Path) -> Iterator[Person]:
    with open_scan("demo") as demo:
        for name, frame in zip(FACES, (0, 20), strict=True):
            formats.write(tmp_path / name, demo.pose(frame).cloud)
    with virtual_screen(tmp_path, SIZE) as screen, running_app(screen, tmp_path, tmp_path / FACES[0]) as app:
        yield Person(app)


def holes(surface: Surface) -> float:
    """The share of the face that shows nothing: of what has something left, right, above and below it."""
    seen = surface.level != EMPTY
    inside = np.ones_like(seen)
    for turns in range(4):
        turned = np.rot90(seen, turns)
        inside &= np.rot90(np.logical_or.accumulate(turned, axis=0), -turns)
    return float((inside & ~seen).sum() / inside.sum())


def told(tasks: str) -> dict[str, int]:
    """The actions that the survey's tables give for each task of a set."""
    rows = re.findall(
        rf"^\| ({tasks}\d) \|.*\| (\d+) \|$", (ROOT / "docs/developing/survey.md").read_text(), re.MULTILINE
    )
    return {task: int(count) for task, count in rows}


def test_set_a_open_zoom_fill_and_back_to_the_list(person: Person) -> None:
    for _ in FACES:
        before = person.look()
        person.task = "A1"
        person.press("Next")
        person.app.see(frame=0)
        person.task = "points, which break apart"
        while person.app.settle().backend != "points":
            person.press("shift", "b")
        assert person.look().description["scan"] != before.description["scan"]
        person.task = "A2"
        person.drag(3, 0, 0.45)
        broken = holes(person.look().surface())
        assert broken > 0.3
        person.task = "A3"
        person.press("b")
        assert holes(person.look().surface()) < 1e-4
        person.press("shift", "b")
        assert holes(person.look().surface()) == broken
        person.task = "A4"
        person.turn_wheel(-18)
        assert holes(person.look().surface()) < 0.01
        person.task = "A5"
        person.go_to_the_list()
    assert {task: person.actions[task] / len(FACES) for task in told("A")} == told("A")


def test_set_b_turn_pan_and_find_nose_eye_and_ear(person: Person) -> None:
    for _ in FACES:
        person.task = "B1"
        person.press("Next")
        person.app.see(frame=0, backend="surfels")
        person.app.settle()
        start = person.look().camera
        person.task = "B2"
        person.drag(1, 0.5, 0)
        turned = person.look().camera
        backs = [camera.rotation()[2] for camera in (start, turned)]
        assert np.degrees(np.arccos(np.dot(*backs))) == pytest.approx(90, abs=1)
        person.task = "B3"
        person.drag(2, 0.2, 0.1)
        panned = person.look().camera
        moved = np.subtract(turned.target, panned.target) @ turned.rotation().T / turned.view_height
        assert moved[:2] == pytest.approx([0.2, 0.1], abs=0.01)
        person.task = "B4"
        person.press("ctrl", "1")
        assert person.sees(NOSE, within=3)
        person.task = "B5"
        person.point(LEFT_EYE)
        person.turn_wheel(8)
        person.press("z")
        eye = person.look().camera
        assert eye.place_in_picture(LEFT_EYE) == pytest.approx((0, 0), abs=0.03)
        assert eye.view_height < 0.5 * start.view_height
        assert person.sees(LEFT_EYE, within=3)
        person.task = "B6"
        person.press("ctrl", "4")
        assert person.look().camera.rotation()[2] == pytest.approx([-1, 0, 0], abs=1e-3)
        assert person.sees(RIGHT_EAR, within=8)
        person.task = "B7"
        person.go_to_the_list()
    assert {task: person.actions[task] / len(FACES) for task in told("B")} == told("B")


def test_set_c_is_seen_well_and_upright_without_doing_anything(tmp_path: Path) -> None:
    ball = sphere(60_000)
    formats.write(tmp_path / "bare.npz", PointCloud.from_arrays(ball.positions))
    rng = np.random.default_rng(3)
    ground = np.column_stack([rng.uniform(-40, 40, (60_000, 2)), 0.1 * rng.standard_normal(60_000)])
    tree = np.column_stack([rng.normal((3, 5), 1.0, (8000, 2)), rng.uniform(0, 12, 8000)])
    formats.write(tmp_path / "ground.npz", PointCloud.from_arrays(np.concatenate([ground, tree])))
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
    with virtual_screen(tmp_path, SIZE) as screen:
        with running_app(screen, tmp_path / "one", tmp_path / "bare.npz") as app:
            surface = Person(app).look().surface()
            assert holes(surface) < 0.003
            lit = surface.image()[surface.level != EMPTY][:, 1].astype(int)
            assert np.ptp(np.quantile(lit, [0.05, 0.95])) > 40, "shaded by its shape"
        with running_app(screen, tmp_path / "two", tmp_path / "ground.npz") as app:
            camera = Person(app).look().camera
            assert camera.rotation()[1][2] > 0.5, "up in the picture is up"
            assert camera.rotation()[2][2] > 0.3, "from above"
    assert told("C")["C1"] == told("C")["C2"] == 0


def test_set_c_distances_to_a_table_a_film_colours_and_back(tmp_path: Path) -> None:
    with virtual_screen(tmp_path, SIZE) as screen, running_app(screen, tmp_path, "demo") as app:
        person = Person(app)
        corners = [on_screen(app, *person.pixel(corner)) for corner in MOUTH]
        person.task = "C3"
        person.press("m")
        for corner in corners:
            person.click(corner)
        person.push(PANEL, "Export distances...")
        person.press("Return")
        file = app.told(r"Saved (.*\.csv), in all 64 frames")[1]
        assert Path(file).name == "demo_distances.csv"
        with open(file, newline="", encoding="utf-8") as stream:
            rows = list(csv.DictReader(stream))
        assert sorted(int(row["frame"]) for row in rows) == list(range(1, 65))
        assert np.ptp([float(row["distance"]) for row in rows]) > 1, "the mouth moves"
        app.screen.do("key", "Escape")
        person.task = "C4"
        person.press("r")
        app.screen.do("key", "Right", "key", "Right")  # what is to be seen in it
        app.settle()
        person.press("r")
        app.told("Recorded")
        person.push("problems", "$$0/Save as film")
        assert Path(app.told(r"Saved (.+\.mp4)")[1]).stat().st_size > 1000
        person.task = "C5"
        person.choose("color_by", "displacement")
        person.choose("range", "fixed")
        look = app.settle().document["look"]
        assert look["high"] > look["low"]
        person.task = "C6"
        person.press("ctrl", "r")
        assert app.settle().document["look"]["color_by"] == "auto"
    counted = {task: count for task, count in told("C").items() if task in person.actions}
    assert person.actions == counted
    assert len(counted) == 4

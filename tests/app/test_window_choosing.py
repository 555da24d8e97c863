"""The automatic choice in the window: at rest alone, by what is shown, and not at all without a goal."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
from scenes import sphere

from viewer.app.playing.playback import Playback
from viewer.app.scene.choosing import Choosing
from viewer.app.scene.rendering import Rendering
from viewer.app.scene.viewport import Viewport
from viewer.app.session import Session
from viewer.camera import Camera
from viewer.choice import known
from viewer.choice.choose import choose_configuration
from viewer.choice.configurations import Configuration
from viewer.choice.goal import Goal
from viewer.choice.model import ERROR_TERMS, TIME_TERMS, Law
from viewer.document.document import Document
from viewer.drawing.renderer import shared_renderer
from viewer.drawing.request import view_of
from viewer.look import Look
from viewer.scan.open import open_scan
from viewer.scan.pose import Pose

POSE = Pose(0, 0.0, "sphere", sphere(30_000))
CAMERA = Camera.orbit(POSE.cloud.bounds())
SIZE = (90, 60)
LATER = 60.0  # seconds
ONE_PASS = Configuration("surfels", {"passes": "one", "surface": "nearest"})


def law(ms: float, error: float) -> Law:
    """What takes and errs the same in all views."""
    return Law((ms, *[0.0] * (TIME_TERMS - 1)), (error**2, *[0.0] * (ERROR_TERMS - 1)), 1.0, 0.0)


MODEL = {
    "points": law(5, 2.0), "points point_size=0": law(10, 1.5), ONE_PASS.key: law(20, 1.0),
    "surfels": law(40, 0.5),
}  # fmt: skip


@pytest.fixture(autouse=True)
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A home in which the device is known."""
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    known.keep_model(shared_renderer().gpu, MODEL)


class Shown:
    """The pose as a window shows it. chosen: the way that was chosen for it."""

    def __init__(self, session: Session, playback: Playback) -> None:
        self.session = session
        self.viewport = Viewport(shared_renderer(), (0, 0, *SIZE))
        self.told: list[str] = []
        self.is_at_rest = True
        activity = SimpleNamespace(rests=lambda now: self.is_at_rest)
        rendering = Rendering(session, playback, self.told.append)
        self.choosing = Choosing(
            session,
            playback,
            self.viewport,
            rendering,
            activity,
            self.told.append,  # type: ignore[arg-type]
        )

    def draw(self) -> None:
        """Draw until the picture is complete, as the window does while workers prepare the pose."""
        self.viewport.rest()
        self.viewport.draw(self.session.document.request(POSE))
        while not self.viewport.is_complete:
            time.sleep(0.001)
            self.viewport.draw(self.session.document.request(POSE))

    def advance(self, at_rest: bool = True) -> bool:
        self.is_at_rest = at_rest
        return self.choosing.advance(time.monotonic() + LATER)

    def settle(self) -> Configuration | None:
        self.draw()
        self.advance()
        while self.choosing.waits:
            time.sleep(0.001)
            self.advance()
        assert not self.choosing.is_due
        assert not self.advance(), "nothing else comes of the same"
        return self.session.document.configuration


@pytest.fixture
def shown() -> Iterator[Shown]:
    session = Session("sphere", Document(camera=CAMERA))
    with closing(open_scan("demo")) as timeline:
        found = Shown(session, Playback(timeline, session))
        yield found
        found.viewport.release()


def test_nothing_is_looked_at_without_a_goal(shown: Shown) -> None:
    shown.draw()
    assert not shown.advance()
    assert not shown.choosing.waits
    assert shown.choosing.comparison is None
    assert not shown.choosing.is_due


def test_the_best_way_within_the_bound_is_chosen_and_no_step_of_the_history(shown: Shown) -> None:
    for bound, key in ((45.0, "surfels"), (25.0, ONE_PASS.key), (6.0, "points"), (1.0, "points")):
        shown.session.change("Change bound", goal=Goal("time", bound))
        way = shown.settle()
        assert way is not None
        assert (way.key, way.scale) == (key, 1.0)
        choice = shown.choosing.choice
        assert choice is not None
        assert choice.meets_limit == (bound > 1)
        assert choice.expected.ms == MODEL[key].time[0]
    shown.session.history.undo()
    assert shown.session.document.goal == Goal("time", 6.0)


def test_undo_of_what_was_done_before_a_choice_keeps_the_choice(shown: Shown) -> None:
    shown.session.change("Choose automatically", goal=Goal("time", 25.0))
    shown.session.change("Change light", look=Look(light="flat"))
    way = shown.settle()
    assert way == ONE_PASS
    shown.session.history.undo()
    assert shown.session.document.configuration is None
    shown.draw()
    assert shown.advance()
    assert shown.session.document.configuration == way


def test_an_error_is_bounded_in_pixels_and_in_the_unit_of_the_scan(shown: Shown) -> None:
    shown.session.change("Name unit", unit="mm", goal=Goal("error", 1.2, "px"))
    assert shown.settle() == ONE_PASS
    comparison = shown.choosing.comparison
    assert comparison is not None
    for unit, factor in (("mm", 1.0), ("cm", 0.1)):
        bound = 0.6 * comparison.footprint * factor
        shown.session.change("Change bound", goal=Goal("error", bound, unit))
        assert shown.settle() == Configuration("surfels"), unit
    shown.session.change("Name unit", unit="units")
    shown.settle()
    assert "cannot be converted to the scan's 'units'" in shown.choosing.problem
    assert shown.choosing.choice is None


def test_it_is_chosen_at_rest_alone_and_once_for_a_view(shown: Shown) -> None:
    shown.session.change("Choose automatically", goal=Goal("time", 25.0))
    shown.draw()
    assert not shown.advance(at_rest=False)
    assert not shown.choosing.waits
    assert shown.choosing.is_due
    shown.settle()
    first = shown.choosing.comparison
    shown.settle()
    assert shown.choosing.comparison is first
    shown.session.change("Orbit", camera=CAMERA.orbited(30, 0))
    shown.draw()
    assert not shown.advance(at_rest=False)
    assert shown.choosing.comparison is first
    shown.settle()
    assert shown.choosing.comparison is not first


def test_it_is_what_a_command_chooses_for_the_same_picture(shown: Shown) -> None:
    shown.session.change("Choose automatically", goal=Goal("time", 25.0))
    way = shown.settle()
    shown.settle()
    request = shown.viewport.request
    assert request is not None
    expected = choose_configuration(POSE, view_of(request, SIZE), Goal("time", 25.0), MODEL, (1.0,))
    assert expected is not None
    assert way == expected.configuration
    assert shown.choosing.choice_of(request) == expected
    assert shown.choosing.choice_of(replace(request, backend="points", params=None)) is None


def test_pictures_that_take_far_longer_than_the_limit_are_told_once(shown: Shown) -> None:
    for bound in (0.01, 1e6, 0.01):
        shown.session.change("Change limit", goal=Goal("time", bound))
        for number in range(4):
            shown.session.change("Orbit", camera=CAMERA.orbited(10 * number, 0))
            shown.settle()
        shown.advance()
        ms = shown.choosing.measured_ms
        assert ms is not None
        is_over = bound < 1
        assert ms > 1.5 * bound or not is_over, "which no picture is within"
        assert (f"Pictures take {ms:.0f} ms; the limit is 0.01 ms" in shown.choosing.overrun) == is_over
    assert len(shown.told) == 2, "each time that it begins"


def test_what_pictures_took_is_told_from_the_second_one_on(shown: Shown) -> None:
    shown.session.change("Choose automatically", goal=Goal("time", 25.0))
    shown.settle()
    shown.settle()
    assert shown.choosing.measured_ms is None, "the first one takes what is made once"
    shown.session.change("Orbit", camera=CAMERA.orbited(30, 0))
    shown.settle()
    surface = shown.viewport.surface
    assert surface is not None
    assert shown.choosing.measured_ms == surface.stats.cpu_ms - surface.stats.upload_ms


def test_a_scan_that_no_measured_renderer_draws_is_told(shown: Shown) -> None:
    known.keep_model(shared_renderer().gpu, {"voxels": MODEL["points"]})
    shown.session.change("Choose automatically", goal=Goal("time", 25.0))
    assert shown.settle() is None
    assert shown.choosing.problem == ("no renderer with measured times on this device can draw this scan")


def test_a_device_that_was_not_measured_says_how_to_do_so(
    shown: Shown, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "new"))
    monkeypatch.setattr(shared_renderer().gpu, "software", False)
    assert "scan4d bench --calibrate" in shown.choosing.why_not
    shown.session.change("Choose automatically", goal=Goal("time", 25.0))
    assert shown.settle() is None

"""Playing shows what was chosen: no frame flashes up as points while workers are at what it needs."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from scenes import sphere
from virtual_screen import PANEL, PATIENCE, RunningApp, Screen, State, running_app, wait_until

FRAMES, POINTS = 16, 10_000
# Of which points alone need normals, and octrees.
CHOSEN = ("surfels", pytest.param("voxels", marks=pytest.mark.slow))


@pytest.fixture(scope="module")
def scan(tmp_path_factory: pytest.TempPathFactory) -> Path:
    scan = tmp_path_factory.mktemp("scan")
    for number in range(FRAMES):
        np.save(scan / f"{number:02}.npy", sphere(POINTS, radius=1 + 0.02 * number).positions)
    return scan


@pytest.fixture
def app(screen: Screen, scan: Path, tmp_path: Path) -> Iterator[RunningApp]:
    """One that has prepared nothing yet."""
    with running_app(screen, tmp_path, scan) as app:
        yield app


def choose(app: RunningApp, backend: str) -> State:
    """Draw with a backend; the first picture of it at rest."""
    app.choose(PANEL, "##backend", f"###{backend}")
    return app.see(lambda state: state.is_idle, backend=backend)


def frames_of(states: list[State]) -> list[int]:
    return [state.frame for state in states]


def children(process: int) -> list[int]:
    found = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                fields = (entry / "stat").read_text().rpartition(")")[2].split()
            except OSError:  # it has ended meanwhile
                continue
            if int(fields[1]) == process:
                found.append(int(entry.name))
    return found


@pytest.mark.slow
@pytest.mark.parametrize("backend", CHOSEN)
def test_no_frame_is_shown_as_points(app: RunningApp, backend: str) -> None:
    first = choose(app, backend)
    app.screen.do("key", "e", "key", "space")
    app.see(is_playing=True)
    app.see(lambda state: len(set(frames_of(app.pictures(first.pictures)))) == FRAMES)
    app.screen.do("key", "End", "key", "ctrl+Home", "key", "space")
    assert not app.settle().is_preview, "at rest it is drawn in full"
    played = app.pictures(first.pictures)
    assert {state.backend for state in played} == {backend}
    assert max(state.jobs for state in app.states) <= 3 * min(os.cpu_count() or 1, 4) + 1
    assert "Traceback" not in app.log()


@pytest.mark.slow
def test_once_prepared_all_play_and_at_rest_nothing_is_done(app: RunningApp) -> None:
    choose(app, "surfels")
    app.screen.do("key", "space")
    app.see(lambda state: state.ready_ahead == FRAMES - 1 and not state.jobs)
    before = app.state.held_bytes
    app.screen.do("key", "e")
    app.see(every_frame=True)
    number = app.state.pictures
    app.see(lambda _: len(app.pictures(number)) > 2 * FRAMES)
    assert {state.jobs for state in app.pictures(number)} == {0}
    assert app.state.held_bytes <= before + FRAMES * POINTS * (12 + 12), "uploads alone are new"
    app.screen.do("key", "space")
    app.settle()
    assert app.state.jobs == 0


@pytest.mark.slow
@pytest.mark.parametrize("backend", CHOSEN)
def test_stepping_keeps_the_picture_before_until_the_next_is_there(app: RunningApp, backend: str) -> None:
    first = choose(app, backend)
    for _ in range(3):
        app.screen.do("key", "Right")
        app.settle()
    app.screen.do("key", "End")
    app.settle()
    stepped = app.pictures(first.pictures)
    assert {state.backend for state in stepped} == {backend}
    assert frames_of(stepped)[-1] == FRAMES - 1


@pytest.mark.slow
def test_the_first_picture_is_of_points_and_another_renderer_takes_over_from_the_one_before(
    app: RunningApp,
) -> None:
    shown = app.state
    choose(app, "surfels")
    surfels = app.state.pictures
    before = {state.backend for state in app.pictures(shown.pictures)}
    assert before <= {shown.backend, "surfels"}
    app.screen.do("key", "Right")
    app.settle()
    choose(app, "voxels")
    assert {state.backend for state in app.pictures(surfels)} == {"surfels", "voxels"}


@pytest.mark.slow
def test_jumping_about_drops_what_was_queued(app: RunningApp) -> None:
    choose(app, "surfels")
    screen = app.screen
    screen.do("key", "bracketleft", "key", "bracketleft", "key", "bracketleft", "key", "space")
    app.see(is_playing=True)
    for _ in range(10):
        app.do(("key", "End"), ("key", "ctrl+Home"))
    screen.do("key", "space", "key", "End")
    state = app.settle()
    assert (state.frame, state.backend, state.jobs) == (FRAMES - 1, "surfels", 0)
    assert "Traceback" not in app.log()


@pytest.mark.slow
@pytest.mark.parametrize(
    "how",
    [
        "close",
        signal.SIGTERM,
        signal.SIGKILL,
    ],
)
def test_nothing_is_left_of_work_when_the_window_ends(app: RunningApp, how: str | int) -> None:
    choose(app, "surfels")
    app.screen.do("key", "space")
    app.see(lambda state: state.jobs > 1)
    helpers = children(app.process.pid)
    assert helpers
    if how == "close":
        app.screen.do("key", "ctrl+q")
    else:
        app.process.send_signal(how)
    app.process.wait(PATIENCE)
    wait_until(lambda: not [number for number in helpers if Path(f"/proc/{number}").exists()])

"""The picture is dimmed, and says what comes, while it is not the one that the window asks for."""

from __future__ import annotations

from pathlib import Path

import pytest
from scenes import sphere
from virtual_screen import RunningApp, Screen, running_app

from viewer.scan import formats

# Reading waits while one file is there, and frames but the first count as unprepared while another is.
GATES = """
import os, time
from viewer.app.playing.ahead import Ahead
from viewer.scan.timeline import Timeline
read, prepared = Timeline._read, Ahead.is_prepared
def slow_read(self, index):
    while os.path.exists("unread"):
        time.sleep(0.01)
    return read(self, index)
Timeline._read = slow_read
def slow_prepared(self, pose):
    return not (pose.index and os.path.exists("unprepared")) and prepared(self, pose)
Ahead.is_prepared = slow_prepared
"""


def brightness(app: RunningApp) -> float:
    """The mean of the view's lower left quarter, where neither the cube nor the middle is."""
    left, top, width, height = app.view()
    shown = app.screen.picture()[top + height // 2 : top + height, left + width // 4 : left + width // 2]
    return float(shown.mean())


@pytest.mark.slow
def test_no_picture_passes_for_another_scan_or_frame(screen: Screen, tmp_path: Path) -> None:
    scan = tmp_path / "ball.npz"
    formats.write(scan, sphere(2000))
    frames = tmp_path / "frames"
    frames.mkdir()
    for number in range(3):
        formats.write(frames / f"{number}.npz", sphere(2000))
    (frames / "1.npz").write_bytes(b"broken")
    unread, unprepared = tmp_path / "unread", tmp_path / "unprepared"
    with running_app(screen, tmp_path, "demo", scan, frames, before=GATES) as app:
        app.settle()
        bright = brightness(app)
        unprepared.touch()
        screen.do("key", "space")
        waited_for = app.see(lambda state: state.loading).loading
        assert waited_for.startswith("Preparing frame ")
        dropped = app.state.dropped
        begun = app.state.at
        waited = app.see(lambda state: state.at > begun + 1)  # in which 25 frames are due
        assert (waited.dropped, waited.loading) == (dropped, waited_for)
        assert brightness(app) < 0.6 * bright
        unprepared.unlink()
        app.see(lambda state: state.frame > dropped and state.loading is None)
        screen.do("key", "space", "key", "BackSpace")
        app.settle()

        unread.touch()
        screen.do("key", "Next")
        assert app.see(lambda state: state.loading).loading == "Loading ball.npz"
        assert app.state.scan == "demo"
        app.take_in()
        assert brightness(app) < 0.6 * bright
        before = len(app.states)
        unread.unlink()
        app.see(lambda state: state.scan == str(scan) and hasattr(state, "frame"))
        app.settle()
        new = [state for state in app.states[before:] if state.scan == str(scan)]
        assert not hasattr(new[0], "frame"), "it is said before it is drawn"
        assert all(hasattr(state, "frame") or state.loading == "Loading ball.npz" for state in new)
        assert app.state.loading is None

        app.screen.do("key", "Next")
        app.see(scan=str(frames))
        app.settle()
        app.screen.do("key", "Right")
        app.told("Scan4D leaves out frame 2")
        assert "rame 2" in app.settle().latest_note
        app.screen.do("key", "Next")
        app.see(scan="demo")
        state = app.settle()
        assert not [note for note in (*state.shown_notes, state.latest_note) if "rame 2" in note]

"""When the replay in the window is to be looked at again."""

from __future__ import annotations

from pathlib import Path

from viewer.app.output.replaying import Replaying
from viewer.backends import backend
from viewer.camera import Camera
from viewer.document.recording import Entry, Recording
from viewer.look import Look


def test_waiting_for_a_picture_takes_no_processor_time(tmp_path: Path) -> None:
    params = backend("points").params()
    entry = Entry("scan", None, 0, 0.0, (96, 64), Camera(eye=(0, 0, 2)), "points", params, Look())
    Recording((entry,), 1.0).save(tmp_path / "a.json")
    assert Replaying(tmp_path / "a.json").until_next(0.0) > 0.001

"""Two windows on one scan: what is made in either is kept, and each tells what the other has changed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from test_window_changes import points
from virtual_screen import PATIENCE, RunningApp, running_app, stored_of, virtual_screen, wait_until_stored

from viewer.document.saved_session import SavedSession

CHANGED = "another program, perhaps a second window of Scan4D, has saved work on this scan"


def add_bookmark(app: RunningApp, count: int, right: int) -> None:
    """Turn the camera by some pixels, and add the view to the bookmarks, of which there are so many then."""
    left, top, width, height = app.view()
    app.drag((left + width / 2, top + height / 2), (left + width / 2 + right, top + height / 2))
    app.screen.do("key", "ctrl+b")
    app.see(lambda state: len(state.document["bookmarks"]) == count)


@pytest.mark.slow
def test_what_is_made_in_two_windows_is_kept_of_both(tmp_path: Path) -> None:
    scan, folders = tmp_path / "a.npy", [tmp_path / name for name in ("one", "two")]
    np.save(scan, points(0))
    for folder in folders:
        folder.mkdir()
    size = (700, 500)
    with (
        virtual_screen(folders[0], size) as first,
        virtual_screen(folders[1], size) as second,
        running_app(first, folders[0], scan, home=tmp_path) as one,
        running_app(second, folders[1], scan, home=tmp_path) as two,
    ):
        add_bookmark(one, 1, 20)
        made = one.settle().document["bookmarks"]
        wait_until_stored(tmp_path, scan, one.state)
        add_bookmark(two, 1, -50)
        two.told(CHANGED)
        add_bookmark(one, 2, 40)
        one.told(CHANGED)
        first.do("key", "ctrl+q")
        assert one.process.wait(PATIENCE) == 0
        second.do("key", "ctrl+q")
        assert two.process.wait(PATIENCE) == 0
        for log in (one.log(), two.log()):
            assert CHANGED in log
            assert "Traceback" not in log
    folder = tmp_path / "config" / "scan4d" / "scans"
    sessions = [stored_of(tmp_path, scan), *(SavedSession.load(path) for path in folder.glob("*.old-*"))]
    counts = sorted(len(session.document.bookmarks) for session in sessions)
    assert counts in ([1, 1, 2], [1, 2]), "no bookmark is lost, whoever saved last"
    assert any(
        [mark.camera.to_json() for mark in session.document.bookmarks][:1]
        == [mark["camera"] for mark in made]
        for session in sessions
    )
    assert not list(folder.glob(".*")), "nothing is left of writing"

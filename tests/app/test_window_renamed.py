"""A scan whose folder was renamed, in the window: its bookmarks are offered, and come back by a click."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from test_window_changes import lowest_button, points
from virtual_screen import Screen, running_app, wait_until_stored


@pytest.mark.slow
def test_what_was_made_comes_back_under_another_name(screen: Screen, tmp_path: Path) -> None:
    old, new = tmp_path / "doe", tmp_path / "Doe, Jane"
    old.mkdir()
    for number in range(3):
        np.save(old / f"{number}.npy", points(number))
    with running_app(screen, tmp_path, old) as app:
        app.do(("key", "ctrl+b"), ("key", "Return"))
        made = app.see(lambda state: state.document["bookmarks"])
        wait_until_stored(tmp_path, old, made)
    old.rename(new)
    with running_app(screen, tmp_path, new) as app:
        app.told(
            "Scan4D has seen the files of this scan under another name: .*doe .bookmarks., which no longer"
        )
        assert not app.settle().document["bookmarks"]
        app.do(("mousemove", *lowest_button(app)), ("click", 1))
        used = app.see(lambda state: state.document["bookmarks"])
        assert used.document["bookmarks"] == made.document["bookmarks"]
        screen.do("key", "ctrl+z")
        app.see(lambda state: not state.document["bookmarks"])
        assert "Traceback" not in app.log()

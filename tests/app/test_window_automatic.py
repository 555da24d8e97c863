"""The automatic choice in the real window: turned on, bounded, ended by hand, and kept for the next start."""

from __future__ import annotations

from pathlib import Path

import pytest
from scenes import sphere
from virtual_screen import PANEL, PATIENCE, RunningApp, Screen, running_app

from viewer.scan import formats


def bound(app: RunningApp, most: float) -> str:
    """Set the bound; the renderer that is chosen."""
    app.act(PANEL, ("item_input_value", "##most", most))
    state = app.settle()
    assert state.document["goal"]["bound"] == most
    assert state.backend == state.document["configuration"]["backend"]
    return str(state.backend)


@pytest.mark.slow
def test_the_renderer_is_chosen_for_a_bound_until_a_hand_chooses(screen: Screen, tmp_path: Path) -> None:
    scan = tmp_path / "ball.npz"
    formats.write(scan, sphere(100_000))
    home = tmp_path / "home"
    for name in ("home", "first", "second"):
        (tmp_path / name).mkdir()
    with running_app(screen, tmp_path / "first", scan, home=home) as app:
        if not any("draws without a graphics card" in note for note in app.notes):
            pytest.skip("the model that comes with Scan4D is of software drivers")
        assert app.state.document["goal"] is None
        app.act(PANEL, ("item_click", "##automatic"))
        goal = app.settle().document["goal"]
        assert (goal["kind"], goal["bound"]) == ("time", 50)
        assert (bound(app, 1), bound(app, 1000)) == ("points", "surfels")

        app.choose(PANEL, "##bound", "###px")
        goal = app.settle().document["goal"]
        assert (goal["kind"], goal["bound"], goal["unit"]) == ("error", 0.5, "px")
        assert bound(app, 4) == "points"

        automatic = app.state.document
        app.choose(PANEL, "##backend", "###voxels")
        state = app.settle()
        assert (state.document["goal"], state.backend) == (None, "voxels")
        app.screen.do("key", "ctrl+z")
        state = app.settle()
        assert (state.document["goal"], state.backend) == (automatic["goal"], "points")
        app.act(PANEL, ("item_click", "##automatic"))
        state = app.settle()
        assert (state.document["goal"], state.document["configuration"], state.backend) == (
            None,
            None,
            "surfels",
        )
        app.screen.do("key", "ctrl+z")
        app.settle()
        app.screen.do("key", "ctrl+q")
        app.process.wait(PATIENCE)
    with running_app(screen, tmp_path / "second", scan, home=home) as app:
        state = app.settle()
        assert (state.document["goal"], state.backend) == (automatic["goal"], "points")

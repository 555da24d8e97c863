"""The renderer in the real window: its name, and for which scans it is chosen."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scenes import sphere
from virtual_screen import PANEL, PATIENCE, RunningApp, Screen, running_app

from viewer.backends import backends
from viewer.scan import formats
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose


def go_to(app: RunningApp, scan: object, key: str) -> str:
    """Open the scan beside the open one; the renderer that draws it."""
    app.screen.do("key", key)
    app.see(scan=str(scan))
    return str(app.settle().backend)


@pytest.mark.slow
def test_a_renderer_is_chosen_for_one_scan_unless_the_user_says_for_all(
    screen: Screen, tmp_path: Path
) -> None:
    smooth, bare, third = (tmp_path / name for name in ("a.npz", "b.npz", "c.npz"))
    ball = sphere(3000)
    for scan in (smooth, third):
        formats.write(scan, ball)
    formats.write(bare, PointCloud.from_arrays(np.asarray(ball.positions, float)))
    home = tmp_path / "home"
    for name in ("home", "first", "second"):
        (tmp_path / name).mkdir()
    with running_app(screen, tmp_path / "first", smooth, bare, third, home=home) as app:
        assert app.settle().backend == "surfels"
        screen.do("key", "b")
        named = app.see(lambda state: state.caption)
        app.see(caption=None)
        assert app.settle().backend != "surfels"
        assert named.caption == app.state.renderer
        drawn_by = [one for one in backends().values() if one.draws(Pose(0, 0.0, "ball", ball))]
        points = next(number for number, one in enumerate(drawn_by) if one.name == "points")
        app.act("toolbar", ("item_click", "###menu of backend"), ("item_click", f"//$FOCUSED/###{points}"))
        assert app.settle().backend == "points"
        own = go_to(app, bare, "Next")
        assert own != "points"
        assert go_to(app, smooth, "Prior") == "points", "where it was chosen"
        app.act(PANEL, ("item_click", "Use for all scans"))
        assert go_to(app, third, "Prior") == "points"
        assert go_to(app, smooth, "Next") == "points"
        assert go_to(app, bare, "Next") == own, "which was open before"
        screen.do("key", "ctrl+q")
        app.process.wait(PATIENCE)
    fourth = tmp_path / "d.npz"
    formats.write(fourth, ball)
    with running_app(screen, tmp_path / "second", fourth, home=home) as app:
        assert app.settle().backend == "points"

"""Numbers that a renderer finds, in the window: offered, shown, told under the mouse, drawn again."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import finding
import numpy as np
import pytest
from scenes import sphere
from test_window import replayed, shown
from virtual_screen import PANEL, ROOT, RunningApp, Screen, running_app
from written import picture

from viewer.backends import backends
from viewer.look import color_table
from viewer.scan import formats

CLOUD = sphere(20_000)
REGISTERED = (
    f"import sys; sys.path.append({str(ROOT / 'tests')!r}); import finding; "
    "from viewer.backends import backends; backends()['finding'] = finding.BACKEND; "
)


@pytest.fixture(scope="module")
def app(screen: Screen, tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningApp]:
    scan = tmp_path_factory.mktemp("scan") / "ball.npz"
    formats.write(scan, CLOUD)
    with running_app(screen, tmp_path_factory.mktemp("app"), scan, before=REGISTERED) as app:
        yield app
    assert "Traceback" not in app.log(), app.log()


def test_it_is_offered_shown_and_told(app: RunningApp, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(backends(), "finding", finding.BACKEND)
    app.choose(PANEL, "##backend", "###finding")
    app.act(PANEL, ("item_input_value", "renderer/point_size/##value", 6))
    app.choose(PANEL, "color_by/##value", "###gap")
    app.choose(PANEL, "light/##value", "###flat")
    app.choose(PANEL, "quality/##value", "###fast")  # colours of the map, unmixed
    assert app.settle().document["look"]["color_by"] == "gap"
    left, top, width, height = app.view()
    app.act("##MainMenuBar", ("menu_click", "View/###point_details"))
    app.screen.do("mousemove", left + width // 2, top + height // 2)
    words = app.settle().pointed
    point = next(int(word.split()[1].rstrip(",")) for word in words if word.startswith("point"))
    assert f"gap {finding.numbers(CLOUD)['gap'][point]:.6g}" in words
    app.screen.do("mousemove", left, top)
    app.settle()
    middle = shown(app)[height // 3 : height // 2, width // 3 : width // 2].reshape(-1, 3)
    colors, counts = np.unique(middle, axis=0, return_counts=True)
    is_of_map = (colors[:, None] == color_table("batlow")[None, :, :3]).all(axis=2).any(axis=1)
    assert is_of_map.sum() > 20
    assert counts[is_of_map].sum() > 0.9 * len(middle)
    app.screen.do("key", "p")
    saved = Path(app.told(r"Saved (.+)")[1])
    np.testing.assert_array_equal(picture(saved), replayed(saved, "again.png")[0])


def test_other_renderers_show_other_colours_and_say_so(app: RunningApp) -> None:
    above = slice(0, app.view()[3] // 2)  # the messages
    before = shown(app)[above].copy()
    app.choose(PANEL, "##backend", "###points")
    app.told("Points does not compute 'gap', but Finding can. The view shows other colours.")
    assert app.settle().backend == "points"
    assert app.state.document["look"]["color_by"] == "gap", "for when it is back"
    assert (shown(app)[above] != before).mean() > 0.1
    app.choose(PANEL, "##backend", "###finding")
    app.settle()
    app.screen.do("mousemove", app.view()[0], app.view()[1])
    app.settle()
    np.testing.assert_array_equal(shown(app)[above], before)

"""The panel's section on how Scan4D read the scan."""

from __future__ import annotations

from pathlib import Path

import pytest
from virtual_screen import PANEL, Screen, running_app

from viewer.app.panel.reading import explanation
from viewer.scan.reading.record import Decision


def test_an_assumption_is_explained_with_its_alternatives() -> None:
    decision = Decision("unit", "units", "assumed", "", "The file states none", ("mm", "m"), True)
    lines = explanation(decision)
    assert lines[0] == "units"
    assert "Source: assumed" in lines
    assert "The file states none" in lines
    assert [line for line in lines if "what you measure may be wrong" in line]
    assert lines[-1].endswith("for example: mm, m")
    assert len(explanation(Decision("format", "PLY"))) == 2


@pytest.mark.slow
def test_the_section_shows_every_decision(screen: Screen, tmp_path: Path) -> None:
    (tmp_path / "points.xyz").write_text("".join(f"{i % 9} {i // 9} {i % 4} {i}\n" for i in range(80)))
    with running_app(screen, tmp_path, tmp_path / "points.xyz") as app:
        before = screen.picture()
        app.act(PANEL, ("item_open", "How this was read"))
        app.settle()
        after = screen.picture()
        assert (before != after).any()
    assert "Traceback" not in app.log()

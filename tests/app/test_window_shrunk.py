"""A window that was large, and is small again: the memory that its pictures took is given back."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from test_window_changes import points
from virtual_screen import RunningApp, running_app, virtual_screen

LARGE, SMALL = (3000, 2000), (900, 600)
MB = 1 << 20


def own_memory(app: RunningApp) -> int:
    """Bytes that the process holds and shares with nobody, and would not get back by reading files."""
    status = Path(f"/proc/{app.process.pid}/status").read_text()
    return 1024 * int(next(line for line in status.splitlines() if line.startswith("RssAnon")).split()[1])


def shown_at(app: RunningApp, size: tuple[int, int]) -> int:
    """Memory when the window has this size, was turned in, and rests."""
    window = app.screen.do("search", "--name", "Scan4D").split()[-1]
    app.screen.do("windowsize", window, *size)
    app.see(lambda state: state.size == [*size])
    app.settle()
    left, top, width, height = app.view()
    app.drag((left + width / 2, top + height / 2), (left + width / 2 + 60, top + height / 2))
    app.settle()
    return own_memory(app)


@pytest.mark.slow
def test_a_large_window_gives_its_memory_back(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", points(0))
    with virtual_screen(tmp_path, LARGE) as screen, running_app(screen, tmp_path, tmp_path / "a.npy") as app:
        before = shown_at(app, SMALL)
        large = shown_at(app, LARGE)
        window = screen.do("search", "--name", "Scan4D").split()[-1]
        screen.do("windowsize", window, *SMALL)
        app.see(lambda state: state.size == [*SMALL])
        app.settle()
        after = own_memory(app)
    assert large - before > 150 * MB
    assert after - before < 40 * MB, f"{before / MB:.0f}, {large / MB:.0f}, {after / MB:.0f} MB"

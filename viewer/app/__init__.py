"""The window: panels, timeline bar, playback. It talks to the core through `render_frame` alone."""

from __future__ import annotations

from collections.abc import Sequence


def run(
    scans: Sequence[str],
    *,
    unit: str | None = None,
    fps: float | None = None,
    up: str = "+y",
    device: int | None = None,
) -> int:
    """Open a window on the first of the scans and return 0 when it is closed.

    scans: as a user names them (see `open_scan`); the others can be chosen in the window.
    up: the up axis. device: has no effect on a window, which says so.
    Raises InputError where the first scan cannot be opened, NoOpenGLError without a window.
    """
    from ..geometry import up_vector
    from ..scan.open import open_scan

    up_vector(up)
    timeline = open_scan(scans[0], unit, fps)
    from .app import App  # only now: a wrong name is told without waiting for ImGui
    from .window import Window

    window = Window("Scan4D")
    try:
        app = App(window, scans, timeline, unit=unit, fps=fps, up=up)
        if device is not None:
            app.note("The display's own GPU draws the window; a device number has no effect on it.")
        app.loop()
        app.close()
    finally:
        window.destroy()
    return 0

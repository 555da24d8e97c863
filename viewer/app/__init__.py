"""The window: panels, timeline bar, playback. It talks to the core through `render_frame` alone."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from ..document.saved_session import SavedSession
    from ..errors import InputError
    from ..scan.timeline import Timeline
    from .app import App


class Start(NamedTuple):
    """Choices that a window begins with, beside its scans.

    unit, fps, up: that the command line states for all scans; None: it states none. corrections: of how
    Scan4D reads the scans that it names, as `--read` takes them. average: frames that points are means of in
    all scans, 0: none; None: it states none. device: has no effect on
    a window, which says so. replay: a recording to show first. session: to open the first scan with. refused:
    what was wrong with what the user named, to be reported.
    """

    unit: str | None = None
    fps: float | None = None
    up: str | None = None
    device: int | None = None
    replay: Path | None = None
    session: SavedSession | None = None
    refused: InputError | None = None
    corrections: Mapping[str, str] | None = None
    average: int | None = None


def run(
    scans: Sequence[str],
    start: Start = Start(),  # noqa: B008, it never changes
    *,
    opened: Timeline | None = None,
    watch: Callable[[App], None] | None = None,
) -> int:
    """Open a window on the first of the scans and return 0 when it is closed, by a signal too.

    scans: as a user names them (see `named_scans`). The others can be chosen in the window, which reports
    those that cannot be opened. The window shows the demo if none can. opened: the first of the scans, if it
    is open already; the window closes it. watch: called at the end of each turn of the window's loop, with
    the app as it is then. Raises NoOpenGLError without a window, and InputError if then no scan can be opened
    either.
    """
    from ..errors import NoOpenGLError
    from ..geometry import up_vector
    from ..imports import uncollected
    from ..scan.listing import named_scans
    from ..scan.open import DEMO, open_scan
    from ..threads import give_way

    give_way()
    if start.up is not None:
        up_vector(start.up)
    found, problems = named_scans(scans)
    is_lost, found = not found, found or [DEMO]
    from .files.opening import Way, begin, find_stored

    def open_first(reading: Mapping[str, str]) -> Timeline:
        if opened is not None and reading == (start.corrections or {}):
            return opened
        return open_scan(found[0], start.unit, start.fps, reading)

    first = Way(lambda: find_stored(found[0], start.up), open_first, start.session, start.corrections or {})
    begun = begin(first)
    if opened is not None and begun.timeline is not opened:
        opened.close()
    from .closing import Signals

    with Signals() as signals:
        with uncollected():
            from ..folders import user_folder  # only now: a wrong name is told without waiting for ImGui
            from . import settings
            from .app import App, StatedOptions
            from .loop import Loop
            from .window import Window
            from .window_look import stored_placement

        stored, notes = settings.load(user_folder() / settings.FILE)
        try:
            window = Window("Scan4D", stored_placement(stored))
        except NoOpenGLError as error:
            if is_lost:  # which is nearer to the user than the window
                raise problems[0] from error
            raise
        try:
            with uncollected():  # tools are imported
                stated = StatedOptions(start.unit, start.fps, start.up, start.corrections, start.average)
                app = App(window, found, begun, stored, stated)
            try:
                for note in notes:
                    app.notices.tell(note)
                app.scans.tell([start.refused, *problems] if start.refused else problems)
                app.capture.find_unfinished()
                if start.device is not None:
                    app.notices.tell(
                        "Scan4D draws the window on the GPU of the display, so the device that you "
                        "chose has no effect."
                    )
                if start.replay is not None:
                    app.replayer.replay(start.replay)
                Loop(app, signals, watch).run()
            finally:
                app.close()
        finally:
            window.destroy()
    return 0

"""Session files in the window: saving the document of the open scan, and opening one with its scan."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from ...document.recording import place_of
from ...document.saved_session import SUFFIX, SavedSession
from ...errors import InputError
from ...files import free_file, printable, working_folder
from ...scan.inputs import refuse_input
from ...scan.listing import is_there
from ..save_dialog import SaveDialog
from ..session import known_as

if TYPE_CHECKING:
    from ..app import App


class Sessions:
    """saving: the dialog that saves. homeless: a session whose scan is not where it says, until the user has
    chosen that; None without one.
    """

    def __init__(self, app: App) -> None:
        self._app = app
        about = "View, look, renderer, bookmarks, measurements; the scan itself stays where it is"
        self.saving: SaveDialog = SaveDialog("Save session", about, SUFFIX, self._save)
        self.homeless: SavedSession | None = None

    def ask_to_save(self) -> None:
        """Open the dialog that saves, with a name that is free."""
        self.saving.ask(free_file(working_folder(), SUFFIX))

    def _save(self, file: Path) -> None:
        app = self._app
        refuse_input(file, app.playback.timeline)
        app.session.saved(app.hash, app.session.index).export(file)
        app.note(f"Saved {file}")

    def open(self, path: Path) -> None:
        """Open the scan of a session file with it; where it is not there, the user is asked to find it."""
        app = self._app
        try:
            session = SavedSession.load(path)
            scan = place_of(session.scan, path)
        except InputError as error:
            app.note(str(error))
            return
        if is_there(scan):
            self.open_with(session, scan)
            return
        self.homeless = session
        app.note(f"{path.name}: its scan '{printable(session.scan)}' is not there. Choose where it is now.")
        app.browser.show(path.parent)

    def open_with(self, session: SavedSession, scan: str) -> None:
        """Open a scan with a session; at once where it is the open one."""
        self.homeless = None
        if known_as(scan) == known_as(self._app.session.scan):
            self._app.take_up(session)
        else:
            self._app.open(scan, session)

"""Session files in the window: saving the document of the open scan, and opening one with its scan."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from ...document.recording import place_of
from ...document.saved_session import SUFFIX, SavedSession
from ...errors import InputError
from ...files import free_file, printable, working_folder
from ...scan.inputs import refuse_input
from ...scan.listing import is_there
from ..playing.playback import Playback
from ..save_dialog import SaveDialog
from ..session import Session, known_as


class Sessions:
    """Saves and opens session files.

    saving: the dialog that saves. homeless: a session whose scan is not where it says, until the user has
    chosen that; None without one.
    """

    def __init__(
        self,
        session: Session,
        playback: Playback,
        note: Callable[[str], None],
        refuse: Callable[[str], None],
        open: Callable[[str, SavedSession], None],
        take_up: Callable[[SavedSession], None],
        ask: Callable[[Path], None],
    ) -> None:
        """refuse: tells why nothing is opened. open: opens a scan with a session. take_up: shows the open one
        so. ask: for one in a folder."""
        self._session, self._playback, self._note = session, playback, note
        self._refuse, self._open, self._take_up, self._ask = refuse, open, take_up, ask
        about = "Saves view, look, renderer, bookmarks, distances and landmarks, not the scan itself"
        self.saving: SaveDialog = SaveDialog("Save session", about, SUFFIX, self._save)
        self.homeless: SavedSession | None = None

    def ask_to_save(self) -> None:
        """Open the dialog that saves, with a name that is free."""
        self.saving.ask(free_file(working_folder(), SUFFIX))

    def _save(self, file: Path) -> None:
        refuse_input(file, self._playback.timeline)
        self._session.saved(self._session.index).export(file)
        self._note(f"Saved {file}")

    def open(self, path: Path) -> None:
        """Open the scan of a session file with it; where it is not there, the user is asked to find it."""
        try:
            session = SavedSession.load(path)
            scan = place_of(session.scan, path)
        except InputError as error:
            self._refuse(str(error))
            return
        if is_there(scan):
            self.open_with(session, scan)
            return
        self.homeless = session
        self._note(f"{path.name}: its scan '{printable(session.scan)}' is missing. Choose where it is now.")
        self._ask(path.parent)

    def open_with(self, session: SavedSession, scan: str) -> None:
        """Open a scan with a session; at once where it is the open one."""
        if known_as(scan) == known_as(self._session.scan):
            self._take_up(session)
        else:
            self._open(scan, session)

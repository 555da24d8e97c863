"""Session files in the window: saving the document of the open scan, and opening one with its scan."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from ...document.recording import place_of
from ...document.saved_session import SUFFIX, SavedSession
from ...errors import InputError
from ...files import printable, working_folder
from ...scan.inputs import refuse_input
from ...scan.listing import is_there
from ..notices import Problem
from ..playing.playback import Playback
from ..save_dialog import SaveDialog
from ..session import Session, known_as, named_like


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
        redraw: Callable[[], None],
    ) -> None:
        """refuse: tells why nothing is opened. open: opens a scan with a session. take_up: shows the open one
        so. ask: for one in a folder. redraw: has the window drawn again."""
        self._session, self._playback, self._note = session, playback, note
        self._refuse, self._open, self._take_up, self._ask = refuse, open, take_up, ask
        about = "Saves view, look, renderer, bookmarks, distances and landmarks, not the scan itself"
        self.saving: SaveDialog = SaveDialog("Save session", about, SUFFIX, self._save, redraw)
        self.homeless: SavedSession | None = None
        self._files: dict[str, Path] = {}  # of scans, as `known_as` has them: saved to or opened from
        self._opened: tuple[SavedSession, Path] | None = None  # last, and its file

    def save(self) -> None:
        """Save the session to its file; where it has none yet, ask for one."""
        file = self._file
        if file is None or not file.exists():
            self.ask_to_save()
            return
        try:
            self._save(file)
        except InputError as error:
            self._note(Problem(f"The session is not saved: {error}"))

    def ask_to_save(self) -> None:
        """Open the dialog that saves, with the session's file, or one that is named like the scan."""
        self.saving.ask(self._file or named_like(self._session.scan, working_folder(), SUFFIX))

    @property
    def _file(self) -> Path | None:
        return self._files.get(known_as(self._session.scan))

    def _save(self, file: Path) -> None:
        refuse_input(file, self._playback.timeline)
        self._session.saved(self._session.index).export(file)
        self._files[known_as(self._session.scan)] = file
        self._note(f"Saved {file}")

    def open(self, path: Path) -> None:
        """Open the scan of a session file with it; where it is not there, the user is asked to find it."""
        try:
            session = SavedSession.load(path)
            scan = place_of(session.scan, path)
        except InputError as error:
            self._refuse(str(error))
            return
        self._opened = session, path
        if is_there(scan):
            self.open_with(session, scan)
            return
        self.homeless = session
        self._note(f"{path.name}: its scan '{printable(session.scan)}' is missing. Choose where it is now.")
        self._ask(path.parent)

    def open_with(self, session: SavedSession, scan: str) -> None:
        """Open a scan with a session; at once where it is the open one."""
        if self._opened is not None and self._opened[0] is session:
            self._files[known_as(scan)] = self._opened[1]
        if known_as(scan) == known_as(self._session.scan):
            self._take_up(session)
        else:
            self._open(scan, session)

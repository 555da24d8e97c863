"""Session files in the window: saving the document of the open scan, and opening one with its scan."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from ...document.recording import scan_path
from ...document.saved_session import SUFFIX, SavedSession
from ...errors import InputError
from ...files import printable, working_folder
from ...scan.inputs import refuse_input
from ...scan.listing import is_there
from ..commands import Command
from ..file_dialog import SAVE, FileDialog
from ..notices import Problem, Refusal
from ..part import ViewArea, WindowPart
from ..playing.playback import Playback
from ..session import Session, known_as, named_like


@dataclass(eq=False)
class Sessions(WindowPart):
    """Saves and opens session files.

    saving: the dialog that saves. take_located: takes the scan that the user is asked to locate; None while
    the user is not asked.
    """

    name = "sessions"
    layer = 81
    shows = "The dialog that saves sessions"
    OFFERS = {"open_with": "open_with", "offer_to_locate": "offer_to_locate"}
    session: Session
    playback: Playback
    note_of_work: Callable[[str], None]
    note_of_opening: Callable[[str], None]
    refuse: Callable[[str], None]
    open_scan: Callable[[str, SavedSession], None]
    take_up: Callable[[SavedSession], None]
    ask_for_scan: Callable[[Path], None]
    close_browser: Callable[[], None]
    redraw: Callable[[], None]

    def __post_init__(self) -> None:
        about = (
            "A session stores view, look, renderer, bookmarks, distances and landmarks, but not the scan "
            "itself"
        )
        self.saving: FileDialog = FileDialog(SAVE, "Save session", about, (SUFFIX,), self._save, self.redraw)
        self.take_located: Callable[[str], object] | None = None
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
            self.note_of_work(Problem(f"Scan4D cannot save the session: {error}"))

    def ask_to_save(self) -> None:
        """Open the dialog that saves, with the session's file, or one that is named like the scan."""
        self.saving.ask(self._file or named_like(self.session.scan, working_folder(), SUFFIX))

    @property
    def _file(self) -> Path | None:
        return self._files.get(known_as(self.session.scan))

    def _save(self, file: Path) -> None:
        refuse_input(file, self.playback.timeline)
        self.session.saved(self.session.index).export(file)
        self._files[known_as(self.session.scan)] = file
        self.note_of_work(f"Saved {file}")

    def open(self, path: Path) -> None:
        """Open the scan of a session file with it; where the scan is missing, offer to locate it."""
        try:
            session = SavedSession.load(path)
            scan = scan_path(session.scan, path)
        except InputError as error:
            self.refuse(str(error))
            return
        self._opened = session, path
        if is_there(scan):
            self.open_with(session, scan)
            return
        problem = f"{path.name}: Scan4D cannot find the scan '{printable(session.scan)}' of this session."
        self.offer_to_locate(problem, path.parent, partial(self.open_with, session))

    def offer_to_locate(self, problem: str, folder: Path, take: Callable[[str], object]) -> None:
        """Report that a scan is missing, and offer the dialog that locates it.

        folder: where to look first, or the nearest one above it that is there. take: gets the scan as the
        user has located it.
        """
        self.close_browser()
        self.note_of_opening(
            Refusal(problem, {"Locate scan...": partial(self._locate, folder, take)}, "locate")
        )

    def _locate(self, folder: Path, take: Callable[[str], object]) -> None:
        self.take_located = take
        self.ask_for_scan(next((one for one in (folder, *folder.parents) if one.is_dir()), working_folder()))

    def open_with(self, session: SavedSession, scan: str) -> None:
        """Open a scan with a session; at once where it is the open one.

        No scan begins then, so the dialog that opened the session closes here.
        """
        file = None
        if self._opened is not None and self._opened[0] is session:
            file = self._files[known_as(scan)] = self._opened[1]
        if known_as(scan) != known_as(self.session.scan):
            self.open_scan(scan, session)
            return
        self.take_up(session)
        self.close_browser()
        if file is not None:
            self.note_of_work(f"Opened the session {file}")

    def dialog(self, view: ViewArea) -> None:
        """Declare the dialog that saves."""
        self.saving.draw()

    COMMANDS = (
        Command("save_session", "Save session", save, "Ctrl+S", "view"),
        Command("save_session_as", "Save session as...", ask_to_save, "Ctrl+Shift+S", "view"),
    )

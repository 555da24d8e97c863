"""What comes back at the next start: the settings, and the document of each scan."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

from ...document.keeper import Keeper
from ...document.saved_session import SavedSession, keep
from .. import settings
from ..notices import Problem
from ..playing.playback import Playback
from ..session import Session
from ..settings import Settings

_EVERY = 3.0  # seconds between looks at what has changed in the settings
_EVERY_DOCUMENT = 0.5  # the same in the document


class Keeping:
    """Saves what has changed, beside the window."""

    def __init__(
        self,
        session: Session,
        playback: Playback,
        note: Callable[[str], None],
        remembered: Callable[[], Settings],
        kept: Settings,
        file: Path,
    ) -> None:
        """remembered: brings the settings to keep. kept: those that their file holds already."""
        self._session, self._playback, self._note, self._remembered = session, playback, note, remembered
        self._settings = Keeper("Settings", partial(settings.save, path=file), kept, _EVERY)
        self._document: Keeper[SavedSession] = Keeper(
            "Changes of scans", keep, None, _EVERY_DOCUMENT, lambda session: session.scan
        )
        self._index = 0

    def _saved(self) -> SavedSession:
        """The session of the open scan that is to come back; playing alone changes nothing of it."""
        if not self._playback.player.playing:
            self._index = self._session.index
        return self._session.saved(self._index)

    def advance(self, now: float) -> None:
        """Look at what has changed. now: by the clock, seconds."""
        self._tell(self._settings.look(now, self._remembered))
        if self._session.document.camera is not None:  # else nothing of it was seen yet
            self._tell(self._document.look(now, self._saved))

    def leave(self) -> None:
        """Save the document of the open scan before another one is shown."""
        if self._session.document.camera is not None:
            self._document.keep(self._saved())

    def close(self) -> None:
        """Save all, and wait for it."""
        self._playback.player.pause()
        self._tell(self._settings.close(self._remembered()))
        if self._session.document.camera is not None:
            self._tell(self._document.close(self._saved()))

    def _tell(self, problem: str | None) -> None:
        if problem:
            self._note(Problem(problem))

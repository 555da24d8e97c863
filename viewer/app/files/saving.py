"""What comes back at the next start: the settings, and the document of each scan."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

from ...document.saved_session import SavedSession, store
from ...document.saver import Saver
from ...folders import user_folder
from .. import settings
from ..notices import Problem
from ..part import Parts, WindowPart
from ..playing.playback import Playback
from ..session import Session

_EVERY = 3.0  # seconds between looks at what has changed in the settings
_EVERY_DOCUMENT = 0.5  # the same in the document


@dataclass(eq=False)
class Saving(WindowPart):
    """Saves what has changed, beside the window. stored: the settings that their file holds already."""

    name = "saving"
    doing = "Saving what has changed"
    turn = 10
    session: Session
    playback: Playback
    note: Callable[[str], None]
    parts: Parts
    stored: dict[str, Any]

    def __post_init__(self) -> None:
        save = partial(settings.save, path=user_folder() / settings.FILE)
        self._settings = Saver("Settings", save, self.stored, _EVERY)
        self._document: Saver[SavedSession] = Saver(
            "Changes to scans", store, None, _EVERY_DOCUMENT, lambda session: session.scan
        )
        self._index = 0

    def _saved(self) -> SavedSession:
        """The session of the open scan that is to come back; playing alone changes nothing of it."""
        if not self.playback.player.playing:
            self._index = self.session.index
        return self.session.saved(self._index)

    def advance(self, now: float) -> None:
        """Look at what has changed. now: by the clock, seconds."""
        self._tell(self._settings.look(now, self.parts.remembered))
        if self.session.document.camera is not None:  # else nothing of it was seen yet
            self._tell(self._document.look(now, self._saved))

    def leave_scan(self) -> None:
        """Save the document of the open scan before another one is shown."""
        if self.session.document.camera is not None:
            self._document.note(self._saved())

    def finish(self) -> None:
        """Save all, and wait for it."""
        self.playback.player.pause()
        self._tell(self._settings.close(self.parts.remembered()))
        if self.session.document.camera is not None:
            self._tell(self._document.close(self._saved()))

    def _tell(self, problem: str | None) -> None:
        if problem:
            self.note(Problem(problem))

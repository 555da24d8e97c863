"""What comes back at the next start: the settings, and the document of each scan."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from ...document.keeper import Keeper
from ...document.saved_session import SavedSession, keep, kept_file
from ...errors import InputError
from .. import settings
from ..settings import Settings

if TYPE_CHECKING:
    from ..app import App

_EVERY = 3.0  # seconds between looks at what has changed in the settings
_EVERY_DOCUMENT = 0.5  # the same in the document


def take_over(places: Iterable[SavedSession]) -> None:
    """Keep what earlier versions kept of scans in the settings, where nothing newer is kept of them."""
    for place in places:
        if not kept_file(place.scan).exists():
            with suppress(InputError):  # it is told when the document of the open scan cannot be kept
                keep(place)


class Keeping:
    """Saves what has changed, beside the window."""

    def __init__(self, app: App, file: Path, remembered: Settings) -> None:
        """file: of the settings, which hold what is remembered."""
        self._app = app
        self._settings = Keeper("Settings", partial(settings.save, path=file), remembered, _EVERY)
        self._document: Keeper[SavedSession] = Keeper("Changes of scans", keep, None, _EVERY_DOCUMENT)
        self._index = 0

    def _saved(self) -> SavedSession:
        """What is to come back of the open scan; playing alone changes nothing of it."""
        app = self._app
        if not app.playback.player.playing:
            self._index = app.session.index
        return app.session.saved(app.hash, self._index)

    def advance(self, now: float) -> None:
        """Look at what has changed. now: by the clock, seconds."""
        self._tell(self._settings.look(now, self._app.remembered))
        if self._app.document.camera is not None:  # else nothing of it was seen yet
            self._tell(self._document.look(now, self._saved))

    def leave(self) -> None:
        """Save the document of the open scan before another one is shown."""
        if self._app.document.camera is not None:
            self._document.keep(self._saved())

    def close(self) -> None:
        """Save all, and wait for it."""
        self._app.playback.player.pause()
        self._tell(self._settings.close(self._app.remembered()))
        if self._app.document.camera is not None:
            self._tell(self._document.close(self._saved()))

    def _tell(self, problem: str | None) -> None:
        if problem:
            self._app.note(problem)

"""The app: it finds all parts of the window, and drives them. They do the rest.

It always shows a scan: lists of others and dialogs lie over it, so that nothing asks whether there is one.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from ..document.schema import usable
from ..drawing.renderer import Renderer
from ..folders import user_folder
from ..gpu.context import Gpu
from . import keys
from .failures import Failures
from .files.opening import Opened
from .menus import Commands
from .notices import Notices
from .part import Parts
from .playing.playback import Playback
from .scene.viewport import Viewport
from .session import Session, SessionSettings
from .toolbox import ToolModules
from .window import Window

log = logging.getLogger(__name__)


class StatedOptions(NamedTuple):
    """The unit, rate, up axis and average that the command line states for all scans; None: it states none.

    corrections: of how Scan4D reads the scans that the command line names, as `--read` takes them.
    """

    unit: str | None = None
    fps: float | None = None
    up: str | None = None
    corrections: Mapping[str, str] | None = None
    average: int | None = None


class App:
    """All parts of the window, which are its attributes by their names, and what the parts share."""

    def __init__(
        self,
        window: Window,
        scans: Sequence[str],
        opened: Opened,
        stored: Mapping[str, Any],
        stated: StatedOptions,
    ) -> None:
        """opened: the first of the scans. stored: name of a part -> the values that come back, as JSON has
        them."""
        self.window, self.commands, self.notices = window, Commands(), Notices()
        log.debug("%s", window.placement)
        self.failures = Failures(self.notices.tell_of_scan)
        self.renderer = Renderer(Gpu(window.ctx))
        self.viewport = Viewport(self.renderer, (0, 0, *window.buffer_size))
        settings = usable(SessionSettings(), stored.get(Session.name, {}))
        document = settings.document if stated.up is None else settings.document.with_up(stated.up)
        self.session = Session(scans[0], document, settings.pace, opened.left)
        self.playback = Playback(opened.timeline, self.session, opened.first)
        modules = ToolModules(self.commands)
        self.keys, problems = keys.load_keys(user_folder() / keys.FILE, self.commands)
        shared = {
            "window": window, "redraw": window.touch, "notices": self.notices, "failures": self.failures,
            "commands": self.commands, "keys": self.keys, "renderer": self.renderer,
            "viewport": self.viewport, "session": self.session, "playback": self.playback,
            "modules": modules, "stored": stored, "opened": opened, "named": scans, **stated._asdict(),
        }  # fmt: skip
        self.parts = Parts(shared, stored)
        self.commands.bind_parts(self.parts)
        for problem in problems:
            self.notices.tell(problem)
        self.opener.begin(opened)

    def __getattr__(self, name: str) -> Any:
        try:
            return self.__dict__["parts"].of[name]
        except KeyError:
            raise AttributeError(f"the window has no part '{name}'") from None

    def advance(self, now: float) -> bool:
        """Let all parts take in what time and workers have brought; whether there is something to show."""
        changed = False
        for part in self.parts:
            with self.failures.reported(part.doing):
                changed |= bool(part.advance(now))
        return changed

    def patience(self, short: float, long: float, now: float) -> float:
        """Seconds to wait for events before looking at what else has changed. short, long: the most while a
        part waits for a worker, and while none does."""
        most = short if any(part.waits for part in self.parts) else long
        return min(most, *(part.next_change(now) for part in self.parts))

    def close(self) -> None:
        """Have all parts save what the user would be sorry to lose, and let go of all but the window."""
        last_first = list(self.parts)[::-1]
        ends = [(part.doing, part.finish) for part in last_first]
        ends.append(("Hiding the window", self.window.hide))  # what is being read may take a moment to stop
        ends += [(part.doing, part.close) for part in last_first]
        ends += [("Drawing", self.viewport.release), ("Preparing", self.renderer.release)]
        for name, end in ends:
            with self.failures.reported(name):
                end()

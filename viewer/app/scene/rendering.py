"""Which backend draws, and its pyramid levels."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ...backends import backends
from ...look import drawable
from ...scan.pose import Pose
from . import levels

if TYPE_CHECKING:
    from ..app import App


class Rendering:
    """Changes `session.backend` and `session.params`."""

    def __init__(self, app: App) -> None:
        self._app = app
        self._missed: set[tuple[str, str]] = set()  # scan and scalar, which were told

    def tell_missing(self, pose: Pose) -> None:
        """Tell, once a scan, that a frame has not the scalar that the user chose to colour by."""
        session = self._app.session
        missed = session.scan, session.look.color_by
        if missed not in self._missed and drawable(session.look, pose.cloud.scalars) != session.look:
            self._missed.add(missed)
            chosen = missed[1]
            name = f"scalar {chosen[1:]}" if chosen.startswith("#") else f"'{chosen}'"
            self._app.note(
                f"Frame {pose.index + 1} has no {name} to colour by: "
                "other colours are shown until a frame has it."
            )

    @property
    def backend(self) -> str | None:
        """The name of the backend that draws; None before the first pose."""
        pose = self._app.playback.pose
        return None if pose is None else self._app.session.chosen(pose)[0]

    def choose(self, name: str) -> None:
        """Draw with a backend."""
        self._app.session.backend = name

    def step(self, by: int) -> None:
        """Draw with the next backend, 1, or the one before, -1."""
        if self.backend is not None:
            names = list(backends())
            self.choose(names[(names.index(self.backend) + by) % len(names)])

    @property
    def _params(self) -> Any:
        """The backend's parameters; None before the first pose."""
        pose = self._app.playback.pose
        return None if pose is None else self._app.session.chosen(pose)[1]

    @_params.setter
    def _params(self, params: Any) -> None:
        if self.backend is not None:
            self._app.session.params[self.backend] = params

    @property
    def levels(self) -> dict[int, bool]:
        """The backend's pyramid levels and whether they are on; empty where it has none."""
        return {} if self._params is None else levels.levels(self._params)

    def toggle_level(self, number: int) -> None:
        """Switch one of the backend's pyramid levels on or off."""
        self._params = levels.toggled(self._params, number)

    @property
    def is_filling(self) -> bool:
        """Whether all levels that fill holes are on."""
        return self._params is not None and levels.is_filling(self._params)

    def toggle_filling(self) -> None:
        """Switch all levels that fill holes on or off."""
        self._params = levels.with_filling(self._params, not self.is_filling)

"""The panel's section on views: the projection, and cameras to go back to."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...camera import PROJECTIONS
from .. import widgets
from ..ui import Ui

if TYPE_CHECKING:
    from ...camera import Camera
    from ..scene.bookmarks import Bookmarks
    from ..scene.steering import Steering


def draw(steering: Steering, camera: Camera | None, bookmarks: Bookmarks, ui: Ui) -> None:
    """Declare the section."""
    widgets.label(
        "Projection", "Perspective: near things look larger. Orthographic: sizes are comparable at any depth"
    )
    now = camera.projection if camera else PROJECTIONS[0]
    chosen = widgets.combo("projection", now, PROJECTIONS, {name: name.capitalize() for name in PROJECTIONS})
    if chosen != now:
        steering.project(chosen)
    bookmarks.draw(ui)

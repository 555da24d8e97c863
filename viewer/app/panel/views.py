"""The panel's section on views: the projection, and cameras to go back to."""

from __future__ import annotations

from dataclasses import dataclass

from ...camera import PROJECTIONS
from .. import widgets
from ..part import Section, WindowPart
from ..scene.bookmarks import Bookmarks
from ..scene.steering import Steering
from ..session import Session
from ..ui import Ui


@dataclass(eq=False)
class ViewsSection(WindowPart):
    """The section."""

    name = "views_section"
    SECTION = Section("View and bookmarks", 40)
    session: Session
    steering: Steering
    bookmarks: Bookmarks

    def panel(self, ui: Ui) -> None:
        """Declare it."""
        widgets.label(
            "Projection",
            "Perspective: nearer objects look larger. Orthographic: an object has the same size at any "
            "distance",
        )
        camera = self.session.document.camera
        now = camera.projection if camera else PROJECTIONS[0]
        titles = {name: name.capitalize() for name in PROJECTIONS}
        chosen = widgets.combo("projection", now, PROJECTIONS, titles)
        if chosen != now:
            self.steering.project(chosen)
        self.bookmarks.draw(ui)

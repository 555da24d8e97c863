"""What moves the camera: commands, drags, the cube, the turntable."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from ...camera import Camera
from ...scan.pose import Pose
from . import navigation
from .cube import OrientationCube
from .turntable import Turntable

if TYPE_CHECKING:
    from ..app import App


class Steering:
    """Moves `session.camera`.

    gesture: what a drag in the view does, None without one. cube, turntable: how the view is turned, beside
    drags in it.
    """

    def __init__(self, app: App, cube: bool, turn_seconds: float) -> None:
        """cube: whether it is shown. turn_seconds: that the turntable takes."""
        self._app = app
        self.gesture: str | None = None
        self.cube: OrientationCube = OrientationCube(cube)
        self.turntable: Turntable = Turntable(turn_seconds)
        self._is_checked = False

    @property
    def moves(self) -> bool:
        """Whether the camera is dragged or turns by itself."""
        return self.gesture is not None or self.cube.is_dragged or self.turntable.is_on

    @property
    def is_orthographic(self) -> bool:
        """Whether the camera is."""
        camera = self._app.session.camera
        return camera is not None and camera.projection == "orthographic"

    def fit(self) -> None:
        """Show all of the current pose, from the same side."""
        app, session = self._app, self._app.session
        if app.playback.pose and session.camera:
            session.camera = session.camera.fit(app.viewport.bounds(app.playback.pose), app.viewport.aspect)
            session.pivot = None

    def look_from(self, azimuth: float, elevation: float) -> None:
        """Show all of the current pose from a direction in degrees, such as those of `navigation.VIEWS`."""
        app, session = self._app, self._app.session
        if app.playback.pose and session.camera:
            bounds = app.viewport.bounds(app.playback.pose)
            session.camera = navigation.view_from(
                azimuth, elevation, session.camera, bounds, app.viewport.aspect, app.up
            )
            session.pivot = None

    def project(self, projection: str) -> None:
        """Show the same in a projection of `camera.PROJECTIONS`."""
        session = self._app.session
        if session.camera:
            session.camera = session.camera.projected(projection)

    def switch_projection(self) -> None:
        """Perspective to orthographic and back."""
        self.project("perspective" if self.is_orthographic else "orthographic")

    def set_pivot(self) -> None:
        """Orbit about the surface under the mouse from now on; the picture stays as it is."""
        session, picked = self._app.session, self._app.pointer.in_full()
        if picked and session.camera:
            session.pivot = picked.place
            session.camera = session.camera.focused(session.pivot)

    def center(self) -> None:
        """Bring what is under the mouse to the middle of the view, and orbit about it from now on."""
        session, picked = self._app.session, self._app.pointer.in_full()
        if picked and session.camera:
            session.pivot = picked.place
            session.camera = session.camera.centered(session.pivot)

    def toggle_turntable(self) -> None:
        """Turn the view round the subject from now on, or stop."""
        if self.turntable.is_on:
            self.turntable.stop()
        else:
            self.turntable.start(time.monotonic())

    def advance(self, now: float) -> bool:
        """Turn the view as far as the turntable has; whether it did."""
        session = self._app.session
        camera = session.camera
        if camera is not None:
            session.camera = self.turntable.turned(camera, session.pivot, now)
        return session.camera is not camera

    def settle(self, pose: Pose) -> None:
        """Fit the camera to a pose that is to be drawn where there is none, or one that shows nothing of it.

        The latter is looked at once a scan: its file may have changed since it was left.
        """
        app, session = self._app, self._app.session
        bounds, aspect = app.viewport.bounds(pose), app.viewport.aspect
        if not self._is_checked:
            self._is_checked = True
            if session.camera is not None and not navigation.shows(session.camera, bounds, aspect):
                session.camera = None
        if session.camera is None:
            session.camera = Camera.orbit(bounds, aspect=aspect, up=app.up)

    def begin_scan(self) -> None:
        """Another scan is shown from now on."""
        self._is_checked = False

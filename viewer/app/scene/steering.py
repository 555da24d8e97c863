"""What moves the camera: commands, drags, the cube, the turntable."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING

from ...camera import Camera
from ...scan.pose import Pose
from . import navigation
from .cube import OrientationCube
from .turntable import Turntable

if TYPE_CHECKING:
    from ..app import App

_PAUSE = 0.5  # seconds without the wheel, after which turning it is another step


class Steering:
    """Moves the camera of the document.

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
        self._wheeled = -math.inf  # by the clock, when the wheel was turned last

    @property
    def moves(self) -> bool:
        """Whether the camera is dragged or turns by itself."""
        return self.gesture is not None or self.cube.is_dragged or self.turntable.is_on

    @property
    def is_orthographic(self) -> bool:
        """Whether the camera is."""
        camera = self._app.document.camera
        return camera is not None and camera.projection == "orthographic"

    def fit(self) -> None:
        """Show all of the current pose, from the same side."""
        app, camera = self._app, self._app.document.camera
        if app.playback.pose and camera:
            fitted = camera.fit(app.viewport.bounds(app.playback.pose), app.viewport.aspect)
            app.change("Fit", camera=fitted, pivot=None)

    def look_from(self, azimuth: float, elevation: float) -> None:
        """Show all of the current pose from a direction in degrees, such as those of `navigation.VIEWS`."""
        app, camera = self._app, self._app.document.camera
        if app.playback.pose and camera:
            bounds = app.viewport.bounds(app.playback.pose)
            turned = navigation.view_from(azimuth, elevation, camera, bounds, app.viewport.aspect, app.up)
            app.change("Look from there", camera=turned, pivot=None)

    def project(self, projection: str) -> None:
        """Show the same in a projection of `camera.PROJECTIONS`."""
        if camera := self._app.document.camera:
            self._app.change("Change projection", camera=camera.projected(projection))

    def switch_projection(self) -> None:
        """Perspective to orthographic and back."""
        self.project("perspective" if self.is_orthographic else "orthographic")

    def set_pivot(self) -> None:
        """Orbit about the surface under the mouse from now on; the picture stays as it is."""
        camera, picked = self._app.document.camera, self._app.pointer.in_full()
        if picked and camera:
            self._app.change("Set pivot", camera=camera.focused(picked.place), pivot=picked.place)

    def center(self) -> None:
        """Bring what is under the mouse to the middle of the view, and orbit about it from now on."""
        camera, picked = self._app.document.camera, self._app.pointer.in_full()
        if picked and camera:
            self._app.change("Centre the point", camera=camera.centered(picked.place), pivot=picked.place)

    def toggle_turntable(self) -> None:
        """Turn the view round the subject from now on, or stop."""
        if self.turntable.is_on:
            self.turntable.stop()
        else:
            self.turntable.start(time.monotonic())

    def advance(self, now: float) -> bool:
        """Turn the view as far as the turntable has; whether it did."""
        document = self._app.document
        if document.camera is None:
            return False
        turned = self.turntable.turned(document.camera, document.pivot, now)
        self._app.change("Turntable", merge="turntable", camera=turned)
        return turned is not document.camera

    def move(self, name: str, camera: Camera) -> None:
        """Follow the mouse; what it does without a pause is one step of the history. name: of that."""
        self._app.change(name, merge=name, camera=camera)

    def zoom(self, camera: Camera) -> None:
        """Follow the wheel: likewise, though nothing tells when it comes to rest."""
        self._wheeled = time.monotonic()
        self.move("Zoom", camera)

    def rests(self, now: float) -> bool:
        """Whether what moves the camera has come to an end. now: by the clock, seconds."""
        return not self.moves and now - self._wheeled > _PAUSE

    def settle(self, pose: Pose) -> None:
        """Fit the camera to a pose that is to be drawn where there is none, or one that shows nothing of it.

        The latter is looked at once a scan: its file may have changed since it was left.
        """
        app, camera = self._app, self._app.document.camera
        bounds = app.viewport.bounds(pose)
        if not self._is_checked:
            self._is_checked = True
            if camera is not None and not navigation.shows(camera, bounds, app.viewport.aspect):
                camera = None
        if camera is None:
            app.session.amend(camera=Camera.orbit(bounds, aspect=app.viewport.aspect, up=app.up))

    def begin_scan(self) -> None:
        """Another scan is shown from now on."""
        self._is_checked = False

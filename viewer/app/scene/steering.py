"""What moves the camera: commands, drags, the cube, the turntable."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from imgui_bundle import icons_fontawesome_6 as icons

from ...camera import Camera
from ...geometry import AXES, UP
from ...scan.pose import Pose
from ...scan.timeline import Timeline
from ...scan.upright import upright_camera
from ..commands import Command, Listing
from ..part import WindowPart, remembered
from ..playing.playback import Playback
from ..session import Session
from . import navigation, orientation
from .framing import Framing
from .pointed import Pointer
from .turntable import USUAL, Turntable, TurnTime
from .viewport import Viewport

_STEP = 1 / 12  # heights of the view that a key moves by: 15 degrees
_SIDES = {"left": (-1, 0), "right": (1, 0), "up": (0, 1), "down": (0, -1)}
_PAUSE = 0.5  # seconds without the wheel or a key that moves, after which these are another step


def _view(number: int, side: str) -> Command:
    """Shows the subject from a side."""
    return Command(
        f"view_{side}", side.capitalize(), lambda steering: steering.look_from(*navigation.VIEWS[side]),
        f"Ctrl+{number}", "view",
    )  # fmt: skip


def _nudge(gesture: str, title: str, side: str, key: str) -> Command:
    """Moves the view as a short drag to a side does."""
    return Command(
        f"{gesture}_{side}", title, lambda steering: steering.nudge(gesture, *_SIDES[side]), key, "view",
        repeats=True,
    )  # fmt: skip


@dataclass(eq=False)
class Steering(WindowPart):
    """Moves the camera of the document.

    up: the up axis of all scans that the command line states, None without one. gesture: what a drag in the
    view does, None without one. is_turned: whether the cube is dragged. turntable: turns the view by itself.
    """

    name = "steering"
    doing = "Turning the view"
    CONDITIONS = {"view": lambda steering: steering.session.document.camera is not None}
    session: Session
    playback: Playback
    viewport: Viewport
    framing: Framing
    pointer: Pointer
    up: str | None
    note_of_scan: Callable[[str], None]
    turn_seconds: TurnTime = remembered(USUAL)  # that the turntable takes

    def __post_init__(self) -> None:
        self.gesture: str | None = None
        self.is_turned = False
        self.turntable: Turntable = Turntable(self.turn_seconds)
        self._first: Camera | None = None  # that a scan was first shown with
        self._is_checked = False
        self._stepped = -math.inf  # by the clock, when the wheel or a key moved it last

    def remembered(self) -> dict[str, Any]:
        """The values that come back at the next start."""
        return {"turn_seconds": self.turntable.seconds}

    def next_change(self, now: float) -> float:
        """Seconds until the turntable turns on."""
        return self.turntable.next_change(now)

    @property
    def moves(self) -> bool:
        """Whether the camera is dragged or turns by itself."""
        return self.gesture is not None or self.is_turned or self.turntable.is_on

    @property
    def is_at_first(self) -> bool:
        """Whether the camera is still the one that the scan was first shown with."""
        return self._first is not None and self._first == self.session.document.camera

    @property
    def _up(self) -> str:
        return self.session.document.look.up

    @property
    def is_orthographic(self) -> bool:
        """Whether the camera's projection is."""
        camera = self.session.document.camera
        return camera is not None and camera.projection == "orthographic"

    def fit(self) -> None:
        """Show the subject from the same side: all of the scan, or of one depth camera's what it looks at."""
        pose, camera = self.playback.pose, self.session.document.camera
        if not (pose and camera):
            return
        framed = self.framing.framed(camera, pose)
        motion = self.session.laid.layers(pose).world_from_pose
        shown = np.abs(framed.places_in_picture(motion.points(pose.sample + pose.origin)))
        if self.framing.subject(pose) is not None and not (shown <= (self.viewport.aspect / 2, 0.5)).all():
            self.note_of_scan(
                "The view shows the area in front of the depth camera. Zoom out to see the rest of the scan."
            )
        self.session.change("Fit", camera=framed, pivot=None)

    def open_view(self) -> None:
        """Show the frame as a scan is first shown: as its pods see it, or from the front."""
        if pose := self.playback.pose:
            self._first = self.framing.first_camera(pose)
            self.session.change("Opening view", camera=self._first, pivot=None)

    def look_from(self, azimuth: float, elevation: float) -> None:
        """Show the subject from a direction in degrees, such as those of `navigation.VIEWS`."""
        pose, camera = self.playback.pose, self.session.document.camera
        if pose and camera:
            bounds, aspect = self.framing.whole(pose), self.viewport.aspect
            azimuth += self.session.document.front
            turned = navigation.view_from(azimuth, elevation, camera, bounds, aspect, self._up)
            self.session.change("Look from side", camera=self.framing.framed(turned, pose), pivot=None)

    def set_up(self, up: str) -> None:
        """Say what is up, as `up_vector` takes it, and show the subject upright, from the front."""
        pose, camera = self.playback.pose, self.session.document.camera
        look = replace(self.session.document.look, up=up)
        if pose and camera:
            turned = upright_camera(camera, self.framing.whole(pose), self.viewport.aspect, up)
            camera = self.framing.framed(turned, pose)
        self.session.change("Turn upright", look=look, camera=camera, pivot=None, front=0.0)

    def set_front(self) -> None:
        """Say that the scan is seen from the front now."""
        if camera := self.session.document.camera:
            self.session.change("Set front", front=orientation.azimuth_of(camera, self._up))

    def ups(self) -> Iterator[tuple[str, Callable[[], object], bool]]:
        """Axes to choose from which is up: title, what it does, whether it is the one."""
        for up in AXES:
            yield up, partial(self.set_up, up), up == self._up

    def project(self, projection: str) -> None:
        """Show the same in a projection of `camera.PROJECTIONS`."""
        if camera := self.session.document.camera:
            self.session.change("Change projection", camera=camera.projected(projection))

    def switch_projection(self) -> None:
        """Perspective to orthographic and back."""
        self.project("perspective" if self.is_orthographic else "orthographic")

    def set_pivot(self) -> None:
        """Orbit about the surface under the mouse from now on; the picture stays as it is."""
        camera, picked = self.session.document.camera, self.pointer.in_full()
        if picked and camera:
            self.session.change("Set pivot", camera=camera.focused(picked.place), pivot=picked.place)

    def center(self) -> None:
        """Bring what is under the mouse to the middle of the view, and orbit about it from now on."""
        camera, picked = self.session.document.camera, self.pointer.in_full()
        if picked and camera:
            self.session.change("Centre on point", camera=camera.centered(picked.place), pivot=picked.place)

    def toggle_turntable(self) -> None:
        """Turn the view round the subject from now on, or stop."""
        if self.turntable.is_on:
            self.turntable.stop()
        else:
            self.turntable.start(time.monotonic())

    def advance(self, now: float) -> bool:
        """Turn the view as far as the turntable has, and show the scan whole once it is known how far it
        reaches, if the view is still the first; whether it has changed."""
        pose, document = self.playback.pose, self.session.document
        if document.camera is None:
            return False
        if self.framing.extent.take_visited() and pose is not None and document.camera is self._first:
            self._first = self.framing.first_camera(pose)
            self.session.amend(camera=self._first)
            return True
        turned = self.turntable.turned(document.camera, document.pivot, now)
        self.session.change("Turntable", merge="turntable", camera=turned)
        return turned is not document.camera

    def move(self, name: str, camera: Camera) -> None:
        """Follow the mouse; what it does without a pause is one step of the history. name: of that."""
        self.session.change(name, merge=name, camera=camera)

    def drag(self, gesture: str, right: float, up: float, radius: float) -> None:
        """Follow a drag, see `navigation.drag`. right, up: in heights of the view. radius: of the scan."""
        if camera := self.session.document.camera:
            pivot = self.session.document.pivot
            self.move(gesture.capitalize(), navigation.drag(gesture, camera, right, up, radius, pivot))

    def nudge(self, gesture: str, right: float, up: float) -> None:
        """Move as a short drag does, without a mouse. right, up: in steps."""
        if pose := self.playback.pose:
            self.turntable.stop()
            self._stepped = time.monotonic()
            self.drag(gesture, _STEP * right, _STEP * up, self.viewport.bounds(pose).radius)

    def zoom(self, camera: Camera) -> None:
        """Follow the wheel, in one step as well, though nothing tells when it comes to rest."""
        self._stepped = time.monotonic()
        self.move("Zoom", camera)

    def rests(self, now: float) -> bool:
        """Whether what moves the camera has come to an end. now: by the clock, seconds."""
        return not self.moves and now - self._stepped > _PAUSE

    def settle(self, pose: Pose) -> None:
        """Fit the camera to a pose that is to be drawn where there is none, or one that shows nothing of it:
        where its pods look from, or from the front.

        The latter is looked at once a scan: its file may have changed since it was left. Where there is none
        at first, what is up is guessed of the pose, unless the user has stated it; a message says so where it
        is not +y.
        """
        camera = self.session.document.camera
        if not self._is_checked:
            self._is_checked = True
            if camera is None and self.up is None:
                look = replace(self.session.document.look, up=pose.upright.up)
                self.session.amend(look=look, front=pose.upright.front)
                if pose.upright.up != UP:
                    guess = f"{pose.upright.up} points up, because {pose.upright.why}"
                    self.note_of_scan(
                        f"Scan4D assumes that {guess}. You can change the up axis below the orientation cube."
                    )
            bounds, aspect = self.framing.bounds(pose), self.viewport.aspect
            if camera is not None and not navigation.shows(camera, bounds, aspect):
                camera = None
            self.framing.extent.visit()
        if camera is None:
            self._first = self.framing.first_camera(pose)
            self.session.amend(camera=self._first)
        self.framing.follow(pose, camera)

    def begin_scan(self, timeline: Timeline) -> None:
        """Take in that another scan is shown from now on."""
        self._is_checked, self._first = False, None

    COMMANDS = (
        Command("fit", "Fit", fit, "F", "view", short="Fit", icon=icons.ICON_FA_EXPAND),
        Command("opening_view", "Opening view", open_view, "Home", "view"),
        Command("center", "Centre on the point under the mouse", center, "Z", "view"),
        *(_view(number, side) for number, side in enumerate(navigation.VIEWS, 1)),
        *(_nudge("orbit", f"Turn {side}", side, f"Ctrl+{side.capitalize()}") for side in _SIDES),
        *(_nudge("pan", f"Shift {side}", side, f"Shift+{side.capitalize()}") for side in _SIDES),
        _nudge("zoom", "Nearer", "up", "="),
        _nudge("zoom", "Farther", "down", "-"),
        Listing("Up", ups, "ups"),
        Command("set_front", "Set current view as front", set_front, when="view"),
        Command("orthographic", "Orthographic", switch_projection, "O", "view",
            is_on=lambda steering: steering.is_orthographic),
        Command("turntable", "Turn", toggle_turntable, "Y", "view",
            is_on=lambda steering: steering.turntable.is_on),
        Listing("Seconds per turn", lambda steering: steering.turntable.items(), "turntable_seconds"),
    )  # fmt: skip

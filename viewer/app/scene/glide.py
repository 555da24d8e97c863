"""Views that glide: where the camera goes elsewhere at once, the picture goes there in a moment.

The document has the new camera from the beginning; only what is drawn lags behind.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...camera import Camera
from ...geometry import vector
from ...scan.timeline import Timeline
from ..commands import Command
from ..part import WindowPart, remembered

SECONDS = 0.2
_STEP = 1 / 60  # seconds between pictures at least
_SAME = 1e-9  # of the distance to the target, and of a turn


@dataclass(eq=False)
class Glide(WindowPart):
    """Follows the document's camera."""

    name = "glide"
    doing = "Animating the view"
    is_wanted: bool = remembered(True)  # whether views glide

    def __post_init__(self) -> None:
        self._start: Camera | None = None  # None while nothing glides
        self._end: Camera | None = None
        self._shown: Camera | None = None
        self._began = 0.0

    def toggle(self) -> None:
        """Have views glide, or jump."""
        self.is_wanted = not self.is_wanted

    @property
    def is_on(self) -> bool:
        """Whether a view glides."""
        return self._start is not None

    def next_change(self, now: float) -> float:
        """Seconds until there is another picture to show; infinite where none glides."""
        return _STEP if self.is_on else math.inf

    def seen(self, camera: Camera) -> Camera:
        """The camera that the picture shows while the document has this one."""
        return self._shown if self.is_on and self._shown is not None else camera

    def follow(self, camera: Camera, may_glide: bool, now: float) -> Camera:
        """The camera to draw. camera: the document's. may_glide: whether it went where it is at once, rather
        than being dragged. now: by the clock, seconds."""
        if camera != self._end:
            start, self._end, self._began = self._shown, camera, now
            glides = may_glide and self.is_wanted and start is not None and _differ(start, camera)
            self._start = start if glides else None
        share = (now - self._began) / SECONDS
        if self._start is None or share >= 1:
            self._start, self._shown = None, camera
        else:
            self._shown = between(self._start, camera, share * share * (3 - 2 * share))
        return self._shown

    def advance(self, now: float) -> bool:
        """Whether a view glides."""
        return self.is_on

    def begin_scan(self, timeline: Timeline) -> None:
        """Show the next camera as it is."""
        self._start = self._end = self._shown = None

    COMMANDS = (Command("glide", "Animate view changes", toggle, is_on=lambda glide: glide.is_wanted),)


def _differ(one: Camera, other: Camera) -> bool:
    """Whether two cameras of one projection show different pictures."""
    if one.projection != other.projection:
        return False
    moved = math.dist(one.eye, other.eye) > _SAME * other.distance
    turned = np.abs(one.rotation() - other.rotation()).max() > _SAME
    return bool(moved or turned or (one.fov_y, one.height) != (other.fov_y, other.height))


def between(start: Camera, end: Camera, share: float) -> Camera:
    """A camera between one and another of the same projection: it turns about what it looks at, the
    shortest way, at a distance that changes evenly. share: of the path."""
    first = start.rotation()
    rotation = _part_of(end.rotation() @ first.T, share) @ first
    target = (1 - share) * np.array(start.target) + share * np.array(end.target)
    distance = start.distance ** (1 - share) * end.distance**share
    height = end.height
    if start.height is not None and end.height is not None:
        height = start.height ** (1 - share) * end.height**share
    return replace(
        end,
        eye=vector(target + distance * rotation[2]),
        target=vector(target),
        up=vector(rotation[1]),
        fov_y=(1 - share) * start.fov_y + share * end.fov_y,
        height=height,
    )


def _part_of(rotation: NDArray[np.float64], share: float) -> NDArray[np.float64]:
    """The rotation, (3, 3), by a share of its angle."""
    axis = np.linalg.svd(rotation - np.eye(3))[2][2]  # which it leaves where it is
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    sine = float(np.sum(cross * rotation)) / 2
    angle = share * math.atan2(sine, (float(np.trace(rotation)) - 1) / 2)
    return np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross

"""Paints the region that counts as rigid: each drag over the reference frame lays spheres on the surface."""

from __future__ import annotations

import math

import numpy as np

from ....errors import InputError
from ....scan.times import frame_in_words
from ...scene.canvas import Canvas, ScreenView
from ...tool_context import Click, ToolContext
from .choices import PAINTED, Sphere, Stabilising

_SHARE = 0.1  # of the scan's radius, that a brush has at first
_STEP = 0.5  # radii from one sphere of a drag to the next
_COLOR = 0xF2C14E
_CORNERS = 24  # of a circle
_OPACITY = 0.8


class Painting:
    """The brush. radius: of its spheres, scan units."""

    def __init__(self, context: ToolContext) -> None:
        self._context = context
        self._radius = 0.0
        self._drawn: list[Sphere] = []  # of the drag that goes on

    @property
    def is_on(self) -> bool:
        """Whether drags in the view paint."""
        return self._context.has_clicks

    @property
    def is_under_way(self) -> bool:
        """Whether a drag goes on."""
        return bool(self._drawn)

    @property
    def radius(self) -> float:
        """The radius of the spheres: as the user has set it, else a share of the scan."""
        pose = self._context.pose
        if self._radius or pose is None:
            return self._radius
        return float(f"{_SHARE * self._context.viewport.bounds(pose).radius:.2g}")

    @radius.setter
    def radius(self, radius: float) -> None:
        self._radius = radius

    @property
    def _choices(self) -> Stabilising:
        return self._context.document.part(Stabilising)

    def toggle(self) -> None:
        """Have drags paint, in the reference frame, or not."""
        if not self.put_away():
            self._context.take_clicks()
            self._context.seek(self._choices.reference)

    def put_away(self) -> bool:
        """Let drags be as without the brush; whether they were not."""
        was_on = self.is_on
        self.abandon()
        self._context.leave_clicks()
        return was_on

    def abandon(self) -> None:
        """Let go of the drag that goes on."""
        self._drawn.clear()

    def take(self, click: Click, ends: bool) -> None:
        """The drag has come to a position. Raises InputError outside the reference frame, and where a drag
        ends that went over no surface."""
        choices = self._choices
        if click.pose.index != choices.reference:
            self.abandon()
            where = frame_in_words(choices.reference)
            raise InputError(f"Paint the region in the reference frame: go to {where}.")
        if click.picked is not None:
            x, y, z = click.motion.inverse.points(np.array(click.picked.place)).tolist()
            last = self._drawn[-1][:3] if self._drawn else (math.inf,) * 3
            if not math.dist(last, (x, y, z)) < _STEP * self.radius:
                self._drawn.append((x, y, z, self.radius))
        self._context.redraw()
        if ends:
            spheres = (*choices.spheres, *self._drawn)
            was_empty = not self._drawn
            self.abandon()
            if was_empty:
                raise InputError("No surface here: drag over the scan.")
            self._context.change("Paint region", choices.changed(region=PAINTED, spheres=spheres))

    def draw(self, canvas: Canvas, view: ScreenView) -> None:
        """Draw a circle for each sphere, in the reference frame while drags paint."""
        pose, camera = self._context.pose, self._context.document.camera
        if not self.is_on or pose is None or camera is None or pose.index != self._choices.reference:
            return
        spheres = np.array([*self._choices.spheres, *self._drawn], np.float64).reshape(-1, 4)
        ahead = np.array(camera.target) - np.array(camera.eye)
        right = np.cross(ahead, np.array(camera.up))
        above = np.cross(right, ahead)
        angles = np.linspace(0, 2 * np.pi, _CORNERS + 1)
        circle = np.outer(np.cos(angles), right / np.linalg.norm(right))
        circle += np.outer(np.sin(angles), above / np.linalg.norm(above))
        middles = self._context.motion(pose).points(spheres[:, :3])
        for middle, radius in zip(middles, spheres[:, 3], strict=True):
            pixels = view.all_on_screen(middle + radius * circle)
            canvas.path(pixels, [_COLOR] * len(pixels), np.full(len(pixels), _OPACITY), dots=False)

    def prompt(self) -> str:
        """The words that say what a drag does."""
        return "Drag over the parts that stay rigid, such as the forehead and the nose. Esc to stop."

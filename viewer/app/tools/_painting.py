"""Paints regions: each drag over a frame lays spheres on the surface, or takes them away."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from imgui_bundle import ImVec2, imgui

from ...analysis.motion.region import RigidRegion
from ...errors import InputError
from ...scan.times import frame_in_words
from .. import widgets
from ..scene.canvas import Canvas, ScreenView
from ..tool_context import Click, ToolContext
from ..ui import Ui

Sphere = tuple[float, float, float, float]  # middle and radius, see `RigidRegion`

_SHARE = 0.1  # of the scan's radius, that a brush has at first
_STEP = 0.5  # radii from one sphere of a drag to the next
_PAINTED, _ERASED = 0xF2C14E, 0xD55E00
_CORNERS = 24  # of a circle
_OPACITY = 0.8


def painted_region(spheres: tuple[Sphere, ...]) -> RigidRegion:
    """The region that was painted."""
    return RigidRegion(np.array(spheres, np.float64).reshape(-1, 4), np.empty(0, np.int64))


@dataclass(frozen=True)
class Painted:
    """A region to paint. name: in steps, such as "region". frame: whose surface is painted. spheres: so far.
    change: takes the name of a step, and the spheres after it. prompt: says what to drag over."""

    name: str
    frame: Callable[[], int]
    spheres: Callable[[], tuple[Sphere, ...]]
    change: Callable[[str, tuple[Sphere, ...]], object]
    prompt: str


class Painting:
    """The brush, and the eraser. is_erasing: whether drags take away."""

    def __init__(self, context: ToolContext, painted: Painted) -> None:
        self._context = context
        self._of = painted
        self._radius = 0.0
        self._drawn: list[Sphere] = []  # of the drag that goes on
        self.is_erasing = False

    @property
    def is_on(self) -> bool:
        """Whether drags in the view paint or erase."""
        return self._context.has_clicks

    @property
    def is_under_way(self) -> bool:
        """Whether a drag goes on."""
        return bool(self._drawn)

    @property
    def is_empty(self) -> bool:
        """Whether nothing is painted."""
        return not self._of.spheres()

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

    def toggle(self, *, erasing: bool = False) -> None:
        """Have drags paint, or erase, in the frame of the region, or do neither. Raises InputError where
        there is nothing to erase."""
        if self.is_on and self.is_erasing == erasing:
            self.put_away()
            return
        if erasing and self.is_empty:
            raise InputError(f"Nothing is painted yet: paint a {self._of.name} first.")
        self.abandon()
        self.is_erasing = erasing
        self._context.take_clicks()
        self._context.seek(self._of.frame())

    def put_away(self) -> bool:
        """Let drags be as without the brush; whether they were not."""
        was_on = self.is_on
        self.abandon()
        self._context.leave_clicks()
        return was_on

    def abandon(self) -> None:
        """Let go of the drag that goes on."""
        self._drawn.clear()

    def clear(self) -> None:
        """Delete all that is painted."""
        self._of.change(f"Clear {self._of.name}", ())

    def take(self, click: Click, ends: bool) -> None:
        """The drag has come to a position. Raises InputError outside the frame of the region, and where a
        drag ends that went over no surface."""
        frame = self._of.frame()
        if click.pose.index != frame:
            self.abandon()
            raise InputError(f"Paint the {self._of.name} in its frame: go to {frame_in_words(frame)}.")
        if click.picked is not None:
            x, y, z = click.motion.inverse.points(np.array(click.picked.place)).tolist()
            last = self._drawn[-1][:3] if self._drawn else (math.inf,) * 3
            if not math.dist(last, (x, y, z)) < _STEP * self.radius:
                self._drawn.append((x, y, z, -self.radius if self.is_erasing else self.radius))
        self._context.redraw()
        if ends:
            spheres, was_empty = (*self._of.spheres(), *self._drawn), not self._drawn
            self.abandon()
            if was_empty:
                raise InputError("No surface here: drag over the scan.")
            step = f"Erase from {self._of.name}" if self.is_erasing else f"Paint {self._of.name}"
            self._of.change(step, simplified(spheres))

    def draw(self, canvas: Canvas, view: ScreenView) -> None:
        """Draw a circle for each sphere, in the frame of the region while drags paint."""
        pose, camera = self._context.pose, self._context.document.camera
        if not self.is_on or pose is None or camera is None or pose.index != self._of.frame():
            return
        spheres = np.array([*self._of.spheres(), *self._drawn], np.float64).reshape(-1, 4)
        ahead = np.array(camera.target) - np.array(camera.eye)
        right = np.cross(ahead, np.array(camera.up))
        above = np.cross(right, ahead)
        angles = np.linspace(0, 2 * np.pi, _CORNERS + 1)
        circle = np.outer(np.cos(angles), right / np.linalg.norm(right))
        circle += np.outer(np.sin(angles), above / np.linalg.norm(above))
        middles = self._context.motion(pose).points(spheres[:, :3])
        for middle, radius in zip(middles, spheres[:, 3], strict=True):
            pixels = view.all_on_screen(middle + abs(radius) * circle)
            color = _PAINTED if radius > 0 else _ERASED
            canvas.path(pixels, [color] * len(pixels), np.full(len(pixels), _OPACITY), dots=False)

    def prompt(self) -> str:
        """The words that say what a drag does."""
        if self.is_erasing:
            return f"Drag over what to remove from the {self._of.name}. Esc to stop."
        return f"{self._of.prompt} Esc to stop."

    def panel(self, ui: Ui, about: str) -> None:
        """Declare the buttons that paint, erase and clear, and the radius. about: says where to drag."""
        name = self._of.name
        is_painting, is_erasing = (self.is_on and self.is_erasing == erases for erases in (False, True))
        row = ui.row(
            widgets.labelled("Stop painting" if is_painting else "Paint", f"paint {name}"),
            widgets.labelled("Stop erasing" if is_erasing else "Erase", f"erase {name}"),
            widgets.labelled("Clear", f"clear {name}"),
        )
        if row.button():
            self.toggle()
        widgets.tooltip(about)
        imgui.begin_disabled(self.is_empty)
        if row.button():
            self.toggle(erasing=True)
        widgets.tooltip(f"Drag over what to remove from the {name}. Undo restores it")
        if row.button():
            self.clear()
        imgui.end_disabled()
        widgets.tooltip("Delete what you have painted. Undo restores it")
        brush = length_field(self._context, "Brush", "Radius of the brush and the eraser", self.radius, name)
        if brush is not None:
            self.radius = brush


class PaintingTool:
    """The hooks of a tool that paints a region."""

    painting: Painting

    def overlay(self, canvas: Canvas, view: ScreenView) -> None:
        """Draw what is painted, while drags paint."""
        self.painting.draw(canvas, view)

    def prompt(self) -> str:
        """The words that say what a drag does."""
        return self.painting.prompt()

    def on_click(self, click: Click) -> bool:
        """Paint where the user clicked."""
        self.painting.take(click, ends=True)
        return True

    def on_press(self, mouse: ImVec2) -> bool:
        """Whether a drag paints."""
        return self.painting.is_on

    def on_drag(self, click: Click, ends: bool) -> None:
        """Paint over a position."""
        self.painting.take(click, ends)

    def on_escape(self) -> bool:
        """Put the brush away; whether it was there."""
        return self.painting.put_away()

    def is_under_way(self) -> bool:
        """Whether something is being painted."""
        return self.painting.is_under_way

    def abandon(self) -> None:
        """Let go of what is being painted."""
        self.painting.abandon()


def length_field(context: ToolContext, title: str, about: str, length: float, name: str = "") -> float | None:
    """Declare a field for a length, scan units; None where it is not edited. name: tells fields of one title
    apart."""
    scale = context.scale
    widgets.label(title, about)
    shown = scale.factor * length
    speed = 0.01 * shown or 0.01
    changed, new = imgui.drag_float(
        f"##{title}{name}", shown, speed, 0.0, 1e9, widgets.number_format("%.3g", scale.unit)
    )
    return max(float(f"{new / scale.factor:.6g}"), 1e-9) if changed else None


def simplified(spheres: tuple[Sphere, ...]) -> tuple[Sphere, ...]:
    """Spheres of the same region, without those that others have erased, and erasing ones that meet none."""
    kept: list[Sphere] = []
    for one in spheres:
        if one[3] < 0:
            kept = [old for old in kept if math.dist(old[:3], one[:3]) + abs(old[3]) > -one[3]]
            if not any(old[3] > 0 and math.dist(old[:3], one[:3]) < old[3] - one[3] for old in kept):
                continue
        kept.append(one)
    return tuple(kept)

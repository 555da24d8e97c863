"""Clicks in the view: which tool they go to, and what a pixel shows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..analysis.pick import Picked, before_gap, pick
from ..geometry import Vector
from ..rigid import STILL, Rigid
from ..scan.pose import Pose
from .scene.viewport import Viewport


@dataclass(frozen=True, eq=False)
class Click:
    """A click in the view.

    picked: what is seen there, with its spacing; None where nothing is. Its `place` is where the surface is
    at the pixel, its `point` the point of the scan that is seen there, None where a hole is filled. pose:
    that the picture shows, as measures use it. through_gap: whether the very pixel shows something farther,
    through a gap. motion: of the pose, see `ToolContext.lay`; positions of `picked` are in the moved scan.
    pixel: of the picture, the one that shows the surface that is meant, (column, row).
    """

    picked: Picked | None
    pose: Pose
    through_gap: bool = False
    motion: Rigid = STILL
    pixel: tuple[int, int] = (0, 0)


class Clicks:
    """The clicks in a view. owner: the tool that they go to, by name; None where they only move the view."""

    def __init__(self, viewport: Viewport) -> None:
        self._viewport = viewport
        self.owner: str | None = None

    def at(self, pixel: tuple[int, int], *, in_full: bool = True) -> Click | None:
        """The click at a pixel of the picture that is there; None without one. in_full: with the spacing,
        in a picture as large as the view."""
        viewport = self._viewport
        surface, request = viewport.surface, viewport.request
        if surface is None or request is None or not viewport.is_there:
            return None
        at = pixel if in_full else viewport.probe.pixel_of_picture(pixel)
        meant = before_gap(surface, *at)
        picked = pick(surface, *at, shown=meant, spacing=in_full)
        is_farther = meant != at and surface.texel(*at).depth < np.inf
        return Click(picked, request.pose.measured, is_farther, request.layers.world_from_pose, meant)

    def near(self, position: Vector, step: tuple[int, int]) -> Click | None:
        """The click that one beside a position would be, so many pixels to the right and up, in full; None
        without a picture, and where the position is not in it."""
        self._viewport.finish()
        surface = self._viewport.surface
        if surface is None:
            return None
        unmoved = surface.layers.world_from_pose.inverse.points(np.array([position])) - surface.view.origin
        if not surface.view.contains(unmoved)[0]:
            return None
        across, down = np.floor(surface.view.project(unmoved)[0][0]).astype(int).tolist()
        return self.at((across + step[0], down - step[1]))

"""Clicks in the view: which tool they go to, and what a pixel shows."""

from __future__ import annotations

import math
from collections.abc import Hashable
from dataclasses import dataclass

import numpy as np

from ..analysis.pick import Picked, before_gap, pick
from ..analysis.surface_point import SurfacePoint, UncertainPosition
from ..errors import InputError
from ..geometry import Vector
from ..picture.surface import Surface
from ..rigid import STILL, Rigid
from ..scan.pose import Pose
from .scene.viewport import Viewport

_FILLED = "Click beside the hole, or zoom in and click on a point."
_MAY_FILL = "Zoom in, or tick 'Allow clicks on filled holes'."
_DOUBTFUL = "Click here again to use it anyway, or turn the view to see the surface from its front."
_SAME = 3.0  # pixels, within which two clicks are in one place


@dataclass(frozen=True, eq=False)
class Click:
    """A click in the view.

    picked: what is seen there, with its spacing; None where nothing is. Its `place` is where the surface is
    at the pixel, its `point` the point of the scan that is seen there, None where a hole is filled. pose:
    that the picture shows, as measures use it. through_gap: whether the very pixel shows something farther,
    through a gap. motion: of the pose, see `ToolContext.lay`; positions of `picked` are in the moved scan.
    pixel: of the picture, the one that shows the surface that is meant, (column, row). is_again: whether the
    last click was there as well, and in doubt: whoever clicks twice takes what is there.
    """

    picked: Picked | None
    pose: Pose
    through_gap: bool = False
    motion: Rigid = STILL
    pixel: tuple[int, int] = (0, 0)
    is_again: bool = False

    def surface_point(self, *, filled: bool | None = None) -> SurfacePoint:
        """The surface point that was clicked. filled: as of `SurfacePoint.of`; None where the user has no
        choice. Raises InputError where nothing is seen, and where it may not be taken."""
        if self.picked is None:
            raise InputError("No surface here: click on the scan.")
        try:
            return SurfacePoint.of(
                self.picked, self.pose, filled=bool(filled), doubtful=self.is_again, place=self.motion
            )
        except UncertainPosition as error:
            what = f"{error.what[:1].upper()}{error.what[1:]}"
            in_hole = _FILLED if filled is None else _MAY_FILL
            hint = _DOUBTFUL if error.accepted_by == "doubtful" else in_hole
            raise InputError(what, hint=hint) from None


class Clicks:
    """The clicks in a view. owner: the tool that they go to, by name; None where they only move the view."""

    def __init__(self, viewport: Viewport) -> None:
        self._viewport = viewport
        self.owner: str | None = None
        self._doubted: tuple[Hashable, tuple[int, int]] | None = None  # view and pixel of the last click

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
        is_again = in_full and self._is_again(surface, at, picked)
        motion = request.layers.world_from_pose
        return Click(picked, request.pose.measured, is_farther, motion, meant, is_again)

    def _is_again(self, surface: Surface, pixel: tuple[int, int], picked: Picked | None) -> bool:
        """Whether a click is where the last one was in doubt."""
        view, before = (self.owner, surface.scanned.pose.index, surface.view.key), self._doubted
        is_again = before is not None and before[0] == view and math.dist(before[1], pixel) <= _SAME
        is_doubted = picked is not None and picked.at_outline and not is_again
        self._doubted = (view, pixel) if is_doubted else None
        return is_again

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

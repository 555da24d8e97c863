"""Numbers that tell how each followed point moves: its displacement, its speed, and the strain around it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...rigid import Rigid
from .dense import PointState, TrackedFrame
from .displacements import StrainGauge

DISPLACEMENT, SPEED = "point displacement", "point speed"
NORMAL, TANGENTIAL = "normal displacement", "tangential displacement"
FIRST, SECOND, AREA = "first principal strain", "second principal strain", "area change"

Float = NDArray[np.float64]


class MotionQuantity(NamedTuple):
    """Kind of a number of a followed point. kind: lengths are in scan units, speeds in scan units a second,
    strains in percent. is_signed: whether it may be below 0."""

    kind: Literal["length", "speed", "strain"]
    is_signed: bool = False


QUANTITIES = {
    DISPLACEMENT: MotionQuantity("length"),
    SPEED: MotionQuantity("speed"),
    NORMAL: MotionQuantity("length", is_signed=True),
    TANGENTIAL: MotionQuantity("length"),
    FIRST: MotionQuantity("strain", is_signed=True),
    SECOND: MotionQuantity("strain", is_signed=True),
    AREA: MotionQuantity("strain", is_signed=True),
}


def frames_needed(name: str, frame: int, count: int) -> range:
    """The frames on which a number of QUANTITIES in a frame depends, of so many, besides the reference."""
    around = 1 if name == SPEED else 0
    return range(max(frame - around, 0), min(frame + around + 1, count))


class StandingFrame(NamedTuple):
    """The points in a frame. time: seconds. world_from_frame: the motion by which the frame is shown."""

    points: TrackedFrame
    time: float
    world_from_frame: Rigid


class PointQuantities:
    """The numbers of some of the points of a reference frame.

    Displacements are from where the reference frame is shown to where a frame is shown: of a stabilised scan
    they lack the motion of the head. The normal part is along the normal of the reference frame. Strains are
    those of `StrainGauge`.
    """

    def __init__(
        self,
        reference: Float,
        normals: Callable[[], NDArray[np.floating]],
        rows: NDArray[np.integer],
        tree: Callable[[], Any],
    ) -> None:
        """reference: (N, 3) positions. rows: (n,), of the points. Asked for once they are needed: normals,
        (N, 3), zero where there is none, and tree, a cKDTree of the reference."""
        self._reference, self._rows, self._tree = reference, rows, tree
        self._rest, self._find_normals = reference[rows], normals

    @property
    def count(self) -> int:
        """The number of its points."""
        return len(self._rows)

    def of(
        self, name: str, frame: StandingFrame, reference_motion: Rigid, beside: Mapping[int, StandingFrame]
    ) -> Float:
        """A number of QUANTITIES of each of its points in a frame, (n,); NaN where a point is not seen.

        reference_motion: by which the reference frame is shown. beside: the frames before and after it, for
        speeds: that between those in which the point is known.
        """
        if QUANTITIES[name].kind == "strain":
            found = self._strain(name, frame.points)
        elif name == SPEED:
            found = self._speed(frame, [beside[number] for number in sorted(beside)])
        else:
            moved = self._places(frame) - reference_motion.points(self._rest)
            if name != DISPLACEMENT:
                along = np.einsum("nk,nk->n", moved, reference_motion.directions(self._normals))
                along[~self._normals.any(axis=1)] = np.nan
            squared = np.einsum("nk,nk->n", moved, moved)
            if name == TANGENTIAL:
                squared = np.maximum(squared - along**2, 0.0)
            found = along if name == NORMAL else np.sqrt(squared)
        found[frame.points.state[self._rows] != PointState.SEEN] = np.nan
        return found

    def _places(self, frame: StandingFrame) -> Float:
        """The places at which the points are shown in a frame, (n, 3); NaN where they are lost."""
        places = frame.world_from_frame.points(self._rest + frame.points.displacement[self._rows])
        places[frame.points.state[self._rows] == PointState.LOST] = np.nan
        return places

    def _speed(self, frame: StandingFrame, beside: list[StandingFrame]) -> Float:
        places = [self._places(one) for one in (frame, *beside)]
        times = [np.where(np.isnan(places[0][:, 0]), np.nan, frame.time)]
        first, last = places[0].copy(), places[0].copy()
        began, ended = times[0].copy(), times[0].copy()
        for one, there in zip(beside, places[1:], strict=True):
            is_known = np.isfinite(there[:, 0])
            ends, times_of = (first, began) if one.time < frame.time else (last, ended)
            ends[is_known], times_of[is_known] = there[is_known], one.time
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.sqrt(((last - first) ** 2).sum(axis=1)) / (ended - began)

    def _strain(self, name: str, points: TrackedFrame) -> Float:
        strain = self._gauge.strain(points.displacement, points.state)
        return 100 * {FIRST: strain.first, SECOND: strain.second, AREA: strain.area}[name]

    @cached_property
    def _gauge(self) -> StrainGauge:
        return StrainGauge(self._reference, self._tree(), self._rows)

    @cached_property
    def _normals(self) -> Float:
        return self._find_normals()[self._rows].astype(np.float64)

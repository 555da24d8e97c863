"""Many landmarks of one frame, carried through the others by its surface as that deforms (`deformation`)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..surface_point import SurfacePoint
from .deformation import LOST, DeformingSurface
from .follower import Sighting
from .pattern import FoundPattern, PointPattern
from .registration import rotations
from .surface import MomentSurface

if TYPE_CHECKING:
    from .deformation_kernels import CarriedPlaces

Float = NDArray[np.float64]

_REACH = 3.0  # spacings from the nearest point, that a landmark may be to lie on the surface
_NO_SURFACE = Sighting.gap("there is no surface where you placed the landmark")
_HIDDEN = Sighting.gap("the landmark is hidden, or lies in a hole")
_UNCERTAIN = Sighting.gap("the landmark's position along the surface is too uncertain")


class _Place(NamedTuple):
    """The surface at a landmark, in the frame in which it was set. normal: (3,)."""

    normal: Float
    pattern: PointPattern | None


class Carrier:
    """The surface of a frame in which landmarks were set, as it deforms from frame to frame.

    at: the frame that it is in.
    """

    def __init__(self, frame: int, surface: MomentSurface, origin: Float) -> None:
        """surface: of the frame, relative to an origin (3,), as those of all others."""
        self.at = frame
        self._origin, self._deforming, self._now = origin, DeformingSurface(surface), surface
        self._deformed = self._before = self._deforming.at_rest
        self._places: dict[SurfacePoint, _Place | None] = {}

    def move_to(self, frame: int, surface: MomentSurface) -> None:
        """Deform into the next frame, which has this surface."""
        last, rows = self._deformed.pose, self._deformed.rows
        found = self._deforming.follow(surface, self._now, last, self._before.pose, rows)
        self._before, self._deformed, self._now, self.at = self._deformed, found, surface, frame

    def sightings(self, spots: Sequence[SurfacePoint]) -> list[Sighting]:
        """See where spots of the frame in which landmarks were set are now."""
        positions = np.array([spot.position for spot in spots]) - self._origin
        places = [self._place(spot, position) for spot, position in zip(spots, positions, strict=True)]
        normals = np.array([np.zeros(3) if place is None else place.normal for place in places])
        held = self._deforming.hold(positions, normals, np.empty((len(spots), 0)))
        found, turns = self._deforming.find(held, self._deformed, self._now), self._turns(held)
        sightings = []
        for number, (spot, place, turn) in enumerate(zip(spots, places, turns, strict=True)):
            if place is None:
                sightings.append(_NO_SURFACE)
                continue
            position, covariance = found.positions[number], found.variances[number] * np.eye(3)
            pattern = self._followed(place, turn)
            if pattern is not None:
                position, covariance = pattern.position, pattern.covariance
            if np.linalg.eigvalsh(covariance)[-1] > (LOST * self._now.spacing) ** 2:
                sightings.append(_UNCERTAIN)
            elif pattern is None and not found.is_seen[number]:
                sightings.append(_HIDDEN)
            else:
                spread = np.zeros((3, 3)) if spot.spread is None else turn @ spot.spread @ turn.T
                sightings.append(Sighting(position + self._origin, covariance + spread, is_carried=True))
        return sightings

    def _place(self, spot: SurfacePoint, position: Float) -> _Place | None:
        """The surface at a landmark, None where there is none. position: relative to the origin."""
        if spot not in self._places:
            surface = self._deforming.surface
            axes = surface.axes_at(position, _REACH * surface.spacing)
            pattern = PointPattern.around(surface, position)
            self._places[spot] = None if axes is None else _Place(axes[2], pattern)
        return self._places[spot]

    def _turns(self, held: CarriedPlaces) -> Float:
        """How places are turned, (P, 3, 3)."""
        return rotations(np.einsum("nk,nkij->nij", held.weights, self._deformed.pose.turns[held.nodes]))

    def _followed(self, place: _Place, turn: Float) -> FoundPattern | None:
        """The landmark as the points around it tell that recur; None where too few do."""
        if place.pattern is None:
            return None
        rows = self._deformed.rows[place.pattern.rows].astype(np.int64)
        return place.pattern.followed(self._now, rows, turn)

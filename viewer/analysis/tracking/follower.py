"""One landmark, followed from the frame in which it was set through the frames after or before it.

In each frame the patch around it as it was when it was set is registered, so that errors do not add up; the
patch as it was in the frame before only tells where to begin. Registered back, the patch found shows how
sure the way is.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..spot import Spot
from .body import DeformableBody, Grip
from .registration import PatchLevel, Placement, best_registered, patch_of, registered
from .settings import TrackingSettings
from .surface import MomentSurface

Float = NDArray[np.float64]

_FAR = PatchLevel(points=300, search=12.0, rounds=12, uses_color=False)
_NEXT = (
    PatchLevel(points=120, search=9.0, rounds=8, uses_color=False),
    PatchLevel(points=120, search=3.0, rounds=4, uses_color=False),
)
_WIDE = PatchLevel(points=500, search=3.5, rounds=8, bending=0.05, turn=0.2)
_FINE = PatchLevel(points=300, search=2.6, rounds=8, bending=0.1, turn=0.2)
_BACK = PatchLevel(points=220, search=2.6, rounds=6, bending=0.05, turn=0.1)
_WRONG = 0.3  # of the patch as in the frame before; where less is matched, it is looked for in the region
_FREE = 8.0  # spacings: standard deviation of a place about which little is known
_LOOSE = 1.5  # of one that is nearly known
_MODEL = 0.06  # spacings that the wide patch is off, as it bends otherwise than the model says
_MIDDLE = 0.5  # of the points next to the place, that have to be matched
# How far a patch may be off the surface, standard deviation: times the noise, and spacings besides.
_OFF_WIDE = 3.0, 0.12
_OFF_FINE = 2.5, 0.12
_ASIDE = 2.0  # distances of a body's nodes that it may be off where the body carries it
_BY_BODY = 0.1  # of the way from where the body carries it: its share in the standard deviation
_UNSURE = 0.7  # spacings: standard deviation from which on a place of a body is not told
_CROP = 1.6  # wide radii of the surface that is kept of the frame in which it was set
_NOISE = 1.2  # factor of variances of registration: residuals are not independent
_FLOOR = 0.04  # spacings: what sampling leaves at least, standard deviation
_APART = 0.5  # of the way between results that should be one: its share in the standard deviation


@dataclass(frozen=True, eq=False)
class Sighting:
    """A landmark in one frame, as seen from where it was set.

    position: (3,) absolute, scan units; NaN where it is not known. covariance: (3, 3). reason: why it is
    not known, in words; "" where it is.
    """

    position: Float
    covariance: Float
    reason: str = ""

    @classmethod
    def gap(cls, reason: str) -> Sighting:
        """No sighting, and why."""
        return cls(np.full(3, np.nan), np.full((3, 3), np.nan), reason)


class Follower:
    """A landmark that is looked for in frame after frame.

    spot: where it was set. surface: of the frame in which it was, as all others relative to an origin,
    (3,).
    """

    def __init__(self, spot: Spot, surface: MomentSurface, origin: Float, settings: TrackingSettings) -> None:
        self._settings, self.spacing = settings, surface.spacing
        self._origin = origin
        self._place = np.array(spot.position, np.float64) - origin
        self._spread = np.zeros((3, 3)) if spot.spread is None else spot.spread

        def radius(share: tuple[float, float]) -> float:
            return max(share[0] * surface.size, share[1] * surface.spacing)

        self._wide_radius = radius(settings.wide)
        self._far = patch_of(surface, self._place, radius(settings.far), _FAR.points)
        self._wide = patch_of(surface, self._place, self._wide_radius, _WIDE.points)
        self._fine = patch_of(surface, self._place, radius(settings.fine), _FINE.points)
        self._own = surface.cropped(self._place, _CROP * self._wide_radius)
        self._found = self._fine_found = self._region = Placement(self._place)
        self._velocity = np.zeros(3)
        self._is_lost = False
        self._body: DeformableBody | None = None
        self._grip: Grip | None = None
        self._gripped_turn = np.eye(3)

    @property
    def place(self) -> Float | None:
        """The place where it was found last, (3,) relative to the origin; None while it is lost."""
        return None if self._is_lost else self._found.place

    def hold_on(self, body: DeformableBody) -> None:
        """Go along with a body, which is in the frame that was looked at last, from where it is found."""
        if body is not self._body:
            self._body, self._grip = body, None
        if self._grip is None and not self._is_lost:
            self._grip, self._gripped_turn = body.gripped(self._found.place), self._found.turn

    def step(self, surface: MomentSurface, before: MomentSurface) -> Sighting:
        """Look for it in the next frame. before: the surface of the frame that it was looked for in
        last. A body that it holds on to has been moved on."""
        if self._wide is None or self._fine is None:
            return Sighting.gap("there is no surface where it was set")
        loose = (_LOOSE * self.spacing) ** 2 * np.eye(3)
        carried = self._carried()
        reason, fits = "the region around it was not found", []
        for start in self._guesses(surface, before, carried):
            wide = registered(self._wide, surface, start, _WIDE, loose)
            if wide is None or wide.kept < self._settings.least_kept:
                reason = "too little of the surface around it was found"
            elif wide.deviation > self._limit(_OFF_WIDE):
                reason = "the surface around it has another shape"
            else:
                fits.append(wide)
                if carried is None:
                    break
        if not fits:
            return self._lose(reason)
        wide = fits[0]
        if any(np.linalg.norm(other.place - wide.place) > self._bound for other in fits[1:]):
            return self._lose("it fits in two places")
        slack = wide.covariance + (_MODEL * self.spacing) ** 2 * np.eye(3)
        fine = registered(
            self._fine, surface, Placement(wide.place, wide.turn, self._fine_found.bent), _FINE, slack
        )
        if fine is None or fine.middle < _MIDDLE:
            return self._lose("it is hidden, or there is a hole")
        if fine.deviation > self._limit(_OFF_FINE):
            return self._lose("the surface around it has another shape")
        patch = patch_of(surface, fine.place, self._wide_radius, _BACK.points)
        back = None
        if patch is not None:
            back = registered(patch, self._own, Placement(self._place, wide.turn.T), _BACK, loose)
        if back is None or back.kept < self._settings.least_kept:
            return self._lose("the way back was not found")
        if back.deviation > self._limit(_OFF_WIDE):
            return self._lose("the surface around it had another shape")
        returned = wide.turn @ (back.place - self._place)
        apart = float(np.linalg.norm(returned))
        if apart > self._bound:
            return self._lose(f"forward and backward are {apart:.3g} apart")
        between = fine.place - wide.place
        aside = np.zeros(3) if carried is None else fine.place - carried.place
        if self._body is not None and np.linalg.norm(aside) > _ASIDE * self._body.distance:
            return self._lose("the body around it went elsewhere")
        covariance = (
            _NOISE * fine.covariance
            + _APART**2 * (np.outer(returned, returned) + np.outer(between, between))
            + (_FLOOR * self.spacing) ** 2 * np.eye(3)
            + wide.turn @ self._spread @ wide.turn.T
        )
        if carried is not None:
            covariance += wide.deviation**2 * np.eye(3) + _BY_BODY**2 * np.outer(aside, aside)
        self._velocity = np.zeros(3) if self._is_lost else fine.place - self._found.place
        self._found, self._fine_found, self._is_lost = wide.at(fine.place), fine, False
        self._region = Placement(fine.place, wide.turn)
        if carried is not None and np.linalg.eigvalsh(covariance)[-1] > (_UNSURE * self.spacing) ** 2:
            return Sighting.gap("its place along the surface is not sure")
        return Sighting(fine.place + self._origin, covariance)

    def _carried(self) -> Placement | None:
        """The placement to which the body has carried it, None where it holds on to none."""
        if self._body is None or self._grip is None:
            return None
        place, turn = self._body.carried(self._grip)
        return Placement(place, turn @ self._gripped_turn, self._found.bent)

    def _guesses(
        self, surface: MomentSurface, before: MomentSurface, carried: Placement | None
    ) -> Iterator[Placement]:
        """About where it may be in a frame, the likelier first. carried: by the body."""
        free = (_FREE * self.spacing) ** 2 * np.eye(3)
        if not self._is_lost:
            patch = patch_of(before, self._found.place, self._wide_radius, _NEXT[0].points)
            if patch is not None:
                still = Placement(self._found.place)
                starts = [still.at(still.place + self._velocity), still]
                enough = self._limit(_OFF_FINE)
                moved = best_registered(patch, surface, starts, _NEXT, free, enough)
                if moved is not None and moved.kept >= _WRONG:
                    yield Placement(moved.place, moved.turn @ self._found.turn, self._found.bent)
        if carried is not None:
            assert self._wide is not None
            moved = best_registered(self._wide, surface, [carried], _NEXT, free)
            if moved is not None:
                yield moved
        elif self._far is not None:
            region = best_registered(self._far, surface, [self._region], [_FAR], free)
            if region is not None:
                self._region = Placement(region.place, region.turn)
                yield region

    @property
    def _bound(self) -> float:
        """How far apart may be what should be one place, scan units."""
        return self._settings.bound_at(self.spacing)

    def _limit(self, off: tuple[float, float]) -> float:
        """How far a patch may be off the surface, scan units."""
        assert self._wide is not None
        return off[0] * self._wide.noise + off[1] * self.spacing

    def _lose(self, reason: str) -> Sighting:
        self._is_lost = True
        return Sighting.gap(reason)

"""One landmark, followed from the frame in which it was set through the frames after or before it.

Where the points around it recur in each frame, they tell the position (`pattern`). Elsewhere, in each frame
the patch around it as it was when it was set is registered, so that errors do not add up; the patch as it was
in the frame before only tells where to begin. Registered back, the patch found shows how sure the way is.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..surface_point import SurfacePoint
from .body import DeformableBody, Grip
from .hold import Hold
from .pattern import FoundPattern, PointPattern, RecurringPoints
from .registration import WAYS, PatchLevel, Placement, best_registered, patch_of, registered, rotations
from .settings import TrackingSettings
from .surface import MomentSurface

if TYPE_CHECKING:
    from .patch_kernels import SurfacePatch

Float = NDArray[np.float64]

_FAR = PatchLevel(points=300, search=12.0, rounds=12, uses_color=False)
_NEXT = (
    PatchLevel(points=120, search=9.0, rounds=8, uses_color=False),
    PatchLevel(points=120, search=3.0, rounds=4, uses_color=False),
)


def _held_too(level: PatchLevel) -> tuple[PatchLevel, PatchLevel]:
    """A level without a body, and the same with one: there, bending is what patches are off by."""
    return level, replace(level, bends_alike=True)


_WIDE = _held_too(PatchLevel(points=500, search=3.5, rounds=8, bending=0.05, turn=0.2))
_FINE = _held_too(PatchLevel(points=300, search=2.6, rounds=8, bending=0.1, turn=0.2))
_BACK = _held_too(PatchLevel(points=220, search=2.6, rounds=6, bending=0.05, turn=0.1))
_WRONG = 0.3  # of the patch as in the frame before; where less is matched, it is looked for in the region
_FREE = 8.0  # spacings: standard deviation of a position about which little is known
_LOOSE = 1.5, 1.0  # of one that is nearly known, and of one to which a body has carried it
_MODEL = 0.06  # spacings that the wide patch is off, as it bends otherwise than the model says
_MIDDLE = 0.5  # of the points next to the position, that have to be matched
# How far a patch may be off the surface, standard deviation: times the noise, and spacings besides.
_OFF_WIDE = 3.0, 0.12
_OFF_FINE = 2.5, 0.12
_ASIDE = 8.0  # spacings that it may be off where the body carries it
_LEFT_OUT = 0.2  # of how a patch of a body is deformed, that the model of its deformation leaves out
_BY_BODY = 0.1  # of the way from where the body carries it: its share in the standard deviation
_UNSURE = 0.6  # spacings: standard deviation of following a body, from which on a position is a gap
_SLIPPED = 0.35  # the same where the body has not come back to where it was after a step and back
_CROP = 1.6  # wide radii of the surface that is kept of the frame in which it was set
_NOISE = 1.2  # factor of variances of registration: residuals are not independent
_FLOOR = 0.04  # spacings: what sampling leaves at least, standard deviation
_APART = 0.5  # of the way between results that should be one: its share in the standard deviation


@dataclass(frozen=True, eq=False)
class Sighting:
    """A landmark in one frame, as seen from where it was set.

    position: (3,) absolute, scan units; NaN where it is not known. covariance: (3, 3). reason: why it is
    not known, in words; "" where it is. is_carried: whether densely tracked points carried it there.
    """

    position: Float
    covariance: Float
    reason: str = ""
    is_carried: bool = False

    @classmethod
    def gap(cls, reason: str) -> Sighting:
        """No sighting, and why."""
        return cls(np.full(3, np.nan), np.full((3, 3), np.nan), reason)


class _Lost(Exception):
    """A landmark that is not found in a frame, and why."""


class Follower:
    """A landmark that is looked for in frame after frame.

    spot: where it was set. surface: of the frame in which it was, as all others relative to an origin,
    (3,).
    """

    def __init__(
        self, spot: SurfacePoint, surface: MomentSurface, origin: Float, settings: TrackingSettings
    ) -> None:
        self._settings, self.spacing = settings, surface.spacing
        self._origin = origin
        self._position = np.array(spot.position, np.float64) - origin
        self._spread = np.zeros((3, 3)) if spot.spread is None else spot.spread

        def radius(share: tuple[float, float]) -> float:
            return max(share[0] * surface.size, share[1] * surface.spacing)

        self._wide_radius = radius(settings.wide)
        self._far = patch_of(surface, self._position, radius(settings.far), _FAR.points)
        self._wide = patch_of(surface, self._position, self._wide_radius, _WIDE[0].points)
        self._fine = patch_of(surface, self._position, radius(settings.fine), _FINE[0].points)
        self._own = surface.cropped(self._position, _CROP * self._wide_radius)
        self._found = self._fine_found = self._region = Placement(self._position)
        self._velocity = np.zeros(3)
        self._is_lost = False
        self._hold: Hold | None = None
        self._grips: tuple[Grip, Grip] | None = None
        self._pattern = PointPattern.around(surface, self._position)
        self._recurring = None if self._pattern is None else FoundPattern.itself(self._pattern)

    @property
    def position(self) -> Float | None:
        """The position where it was found last, (3,) relative to the origin; None while it is lost."""
        return None if self._is_lost else self._found.position

    @property
    def velocity(self) -> Float:
        """How far it has come in the last step, (3,), scan units."""
        return self._velocity

    def hold_on(self, body: DeformableBody) -> None:
        """Go along with a body, which is in the frame that was looked at last, from where it is found."""
        if self._hold is not None and self._hold.body is body:
            return
        self._hold = None
        if not self._is_lost and self._wide is not None and self._fine is not None:
            self._hold = Hold.at(body, self._found)
            self._grips = self._hold.gripped(self._wide), self._hold.gripped(self._fine)

    def go_along(self, points: RecurringPoints, surface: MomentSurface) -> Sighting | None:
        """The position in the next frame as points around it tell it that recur there; None where too few
        do."""
        if self._pattern is None or self._recurring is None:
            return None
        rows, linear = points.carried(self._recurring.rows, self._recurring.linear)
        found = self._pattern.followed(surface, rows, linear)
        if found is None or np.linalg.eigvalsh(found.covariance)[-1] > (_UNSURE * self.spacing) ** 2:
            return None
        return self._go_to(found)

    def step(self, surface: MomentSurface, before: MomentSurface) -> Sighting:
        """Look for it in the next frame, where points do not carry it.

        before: the surface of the frame that it was looked for in last. A body that it holds on to has been
        moved on.
        """
        self._recurring = None
        was, carried = self._found, None if self._hold is None else self._hold.carried()
        sighting = self._by_patches(surface, before, carried)
        if self._pattern is None:
            return sighting
        if not self._is_lost:
            start = self._found
        elif carried is not None:
            start = carried
        else:
            return sighting
        found = self._pattern.found(surface, start.position, start.turn)
        if found is None:
            return sighting
        self._found = was
        return self._go_to(found)

    def _go_to(self, found: FoundPattern) -> Sighting:
        """Be where the pattern of points around it is found."""
        turn = rotations(found.linear)
        self._velocity = np.zeros(3) if self._is_lost else found.position - self._found.position
        self._recurring, self._hold, self._is_lost = found, None, False
        self._found = self._fine_found = self._region = Placement(found.position, turn)
        return Sighting(found.position + self._origin, found.covariance + turn @ self._spread @ turn.T)

    def _by_patches(
        self, surface: MomentSurface, before: MomentSurface, carried: Placement | None
    ) -> Sighting:
        """Look for it in the next frame by the surface around it. carried: where a body has carried it."""
        if self._wide is None or self._fine is None:
            return Sighting.gap("there is no surface where you placed the landmark")
        try:
            return self._registered(surface, self._guesses(surface, before, carried), carried)
        except _Lost as lost:
            self._is_lost = True
            return Sighting.gap(str(lost))

    def _registered(
        self, surface: MomentSurface, guesses: Iterator[Placement], carried: Placement | None
    ) -> Sighting:
        """Register the patches around it: the wide one, the fine one, and one back to where it was set.

        Raises _Lost.
        """
        assert self._wide is not None
        assert self._fine is not None
        hold, wide_patch, fine_patch = self._hold, self._wide, self._fine
        if hold is not None and self._grips is not None:
            wide_patch, fine_patch = (
                hold.bent(patch, grip)
                for patch, grip in zip((self._wide, self._fine), self._grips, strict=True)
            )
        wide = self._on_wide(wide_patch, surface, guesses)
        fine = self._on_fine(fine_patch, surface, wide)
        returned = wide.turn @ (self._back(surface, fine.position, wide.turn) - self._position)
        apart = float(np.linalg.norm(returned))
        if apart > self._bound:
            raise _Lost(f"the positions from tracking forward and backward differ by {apart:.3g}")
        between = fine.position - wide.position
        covariance = (
            _NOISE * fine.covariance
            + _APART**2 * (np.outer(returned, returned) + np.outer(between, between))
            + (_FLOOR * self.spacing) ** 2 * np.eye(3)
        )
        unsure = np.inf
        if hold is not None and carried is not None:
            aside = fine.position - carried.position
            if np.linalg.norm(aside) > _ASIDE * self.spacing:
                raise _Lost("the surface around the landmark moved differently")
            left_out = _LEFT_OUT * fine_patch.radius * np.linalg.norm(fine.bent)
            covariance += left_out**2 * np.eye(3) + _BY_BODY**2 * np.outer(aside, aside)
            unsure = (_SLIPPED if hold.slip() > self._bound else _UNSURE) * self.spacing
        self._velocity = np.zeros(3) if self._is_lost else fine.position - self._found.position
        self._found, self._fine_found, self._is_lost = wide.at(fine.position), fine, False
        self._region = Placement(fine.position, wide.turn)
        if np.linalg.eigvalsh(covariance)[-1] > unsure**2:
            return Sighting.gap("the landmark's position along the surface is too uncertain")
        placed = wide.turn @ self._spread @ wide.turn.T
        return Sighting(fine.position + self._origin, covariance + placed)

    @property
    def _is_held(self) -> bool:
        return self._hold is not None

    @property
    def _loose(self) -> Float:
        """The covariance of a position that is nearly known, (3, 3)."""
        return (_LOOSE[self._is_held] * self.spacing) ** 2 * np.eye(3)

    def _on_wide(
        self, patch: SurfacePatch, surface: MomentSurface, guesses: Iterator[Placement]
    ) -> Placement:
        """The wide patch on a surface, from the first guess from which it fits. Raises _Lost."""
        reason = "Scan4D did not find the surface around the landmark in this frame"
        for start in guesses:
            fit = registered(patch, surface, start, _WIDE[self._is_held], self._loose)
            if fit is None or fit.kept < self._settings.least_kept:
                reason = "Scan4D found too little of the surface around the landmark in this frame"
            elif fit.deviation > self._limit(_OFF_WIDE):
                reason = "the surface around the landmark has a different shape"
            else:
                return fit
        raise _Lost(reason)

    def _on_fine(self, patch: SurfacePatch, surface: MomentSurface, wide: Placement) -> Placement:
        """The fine patch on a surface, from where the wide one lies. Raises _Lost."""
        slack = wide.covariance + (_MODEL * self.spacing) ** 2 * np.eye(3)
        bent = np.zeros(WAYS) if self._is_held else self._fine_found.bent
        start = Placement(wide.position, wide.turn, bent)
        fine = registered(patch, surface, start, _FINE[self._is_held], slack)
        if fine is None or fine.middle < _MIDDLE:
            raise _Lost("the landmark is hidden, or lies in a hole")
        if fine.deviation > self._limit(_OFF_FINE):
            raise _Lost("the surface around the landmark has a different shape")
        return fine

    def _back(self, surface: MomentSurface, position: Float, turn: Float) -> Float:
        """The position, (3,), to which the surface around another goes back. Raises _Lost."""
        patch, back = patch_of(surface, position, self._wide_radius, _BACK[0].points), None
        if patch is not None:
            patch = patch if self._hold is None else self._hold.unbent(patch, turn)
            start = Placement(self._position, turn.T)
            back = registered(patch, self._own, start, _BACK[self._is_held], self._loose)
        if back is None or back.kept < self._settings.least_kept:
            raise _Lost("tracking from this frame back to the earlier frame did not return to the landmark")
        if back.deviation > self._limit(_OFF_WIDE):
            raise _Lost("the surface around the landmark had a different shape")
        return back.position

    def _guesses(
        self, surface: MomentSurface, before: MomentSurface, carried: Placement | None
    ) -> Iterator[Placement]:
        """About where it may be in a frame, the likelier first. carried: by the body."""
        free = (_FREE * self.spacing) ** 2 * np.eye(3)
        if carried is not None:
            yield carried
        if not self._is_lost:
            patch = patch_of(before, self._found.position, self._wide_radius, _NEXT[0].points)
            if patch is not None:
                still = Placement(self._found.position)
                starts = [still.at(still.position + self._velocity), still]
                enough = self._limit(_OFF_FINE)
                moved = best_registered(patch, surface, starts, _NEXT, free, enough)
                if moved is not None and moved.kept >= _WRONG:
                    bent = self._found.bent if carried is None else np.zeros(WAYS)
                    yield Placement(moved.position, moved.turn @ self._found.turn, bent)
        if carried is None and self._far is not None:
            region = best_registered(self._far, surface, [self._region], [_FAR], free)
            if region is not None:
                self._region = Placement(region.position, region.turn)
                yield region

    @property
    def _bound(self) -> float:
        """How far apart may be what should be one place, scan units."""
        return self._settings.bound_at(self.spacing)

    def _limit(self, off: tuple[float, float]) -> float:
        """How far a patch may be off the surface, scan units."""
        assert self._wide is not None
        return off[0] * self._wide.noise + off[1] * self.spacing

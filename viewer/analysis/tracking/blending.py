"""Tracks of landmarks from what is seen of them from the frames in which they were set."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from ..landmarks import Landmark
from ..surface_point import SurfacePoint
from ..track import Known, Track
from .follower import Sighting

Float = NDArray[np.float64]
Seen = Mapping[int, Sighting]  # by frame

_MISSING = "you marked the landmark as not visible"
_ELSEWHERE = "you placed the landmark in a frame that the scan does not have"


def track_of(
    landmark: Landmark,
    seen: Mapping[tuple[SurfacePoint, int], Seen],
    bound: float,
    so_far: Track,
    frames: Iterable[int],
) -> Track:
    """The track of a landmark as far as it was seen.

    seen: from a key of its, forward (1) and backward (-1), up to the next one. bound: how far what is seen
    from either side may be apart, scan units. so_far: holds in all but some frames.
    """
    positions, covariances = so_far.positions.copy(), so_far.covariances.copy()
    known, reasons = so_far.known.copy(), dict(so_far.reasons)
    keys = [key for key in landmark.keys if key.frame < len(known)]
    at = [key.frame for key in keys]
    for frame in frames:
        number = bisect_left(at, frame)
        reasons.pop(frame, None)
        if number < len(at) and at[number] == frame:
            known[frame], positions[frame] = Known.PLACED, keys[number].position
            spread = keys[number].spread
            covariances[frame] = np.zeros((3, 3)) if spread is None else spread
            continue
        if frame in landmark.missing:
            sighting: Sighting | None = Sighting.gap(_MISSING)
        elif not keys:
            sighting = Sighting.gap(_ELSEWHERE)
        else:
            before = keys[number - 1] if number else None
            after = keys[number] if number < len(keys) else None
            sighting = _between(before, after, seen, frame, bound)
        if sighting is None:
            known[frame], positions[frame], covariances[frame] = Known.PENDING, np.nan, np.nan
            continue
        there = Known.CARRIED if sighting.is_carried else Known.TRACKED
        known[frame] = Known.GAP if sighting.reason else there
        positions[frame], covariances[frame] = sighting.position, sighting.covariance
        if sighting.reason:
            reasons[frame] = sighting.reason
    return Track(so_far.times, positions, covariances, known, reasons)


def _between(
    before: SurfacePoint | None,
    after: SurfacePoint | None,
    seen: Mapping[tuple[SurfacePoint, int], Seen],
    frame: int,
    bound: float,
) -> Sighting | None:
    """A landmark in a frame between two in which it was set, or None where nobody has looked.

    What each side is off at the other one is drift: it is taken to grow evenly, and as a random walk that
    is held at both ends it adds to the variance.
    """
    forward = seen.get((before, 1), {}) if before else {}
    backward = seen.get((after, -1), {}) if after else {}
    if before is None or after is None:
        return (forward or backward).get(frame)
    share = (frame - before.frame) / (after.frame - before.frame)
    one = _held(forward.get(frame), forward.get(after.frame), after, share)
    other = _held(backward.get(frame), backward.get(before.frame), before, 1 - share)
    sides = [side for side in (one, other) if side is not None and not side.reason]
    if len(sides) < 2:
        return sides[0] if sides else one or other
    apart = sides[0].position - sides[1].position
    if (distance := float(np.linalg.norm(apart))) > bound:
        return Sighting.gap(f"the positions from tracking forward and backward differ by {distance:.3g}")
    spreads = np.array([np.trace(side.covariance) for side in reversed(sides)])  # each weighs by the other's
    weights = spreads / spreads.sum() if spreads.any() else np.full(2, 0.5)
    # Both look at the same points of this frame: their errors are taken to be the same ones.
    return Sighting(
        weights[0] * sides[0].position + weights[1] * sides[1].position,
        weights[0] * sides[0].covariance
        + weights[1] * sides[1].covariance
        + weights[0] * weights[1] * np.outer(apart, apart),
        is_carried=any(side.is_carried for side in sides),
    )


def _held(seen: Sighting | None, at_end: Sighting | None, end: SurfacePoint, share: float) -> Sighting | None:
    """A sighting from one side, held at the spot on the other side, where that was reached."""
    if seen is None or seen.reason or at_end is None or at_end.reason:
        return seen
    drift = np.array(end.position) - at_end.position
    return Sighting(
        seen.position + share * drift,
        seen.covariance + share * (1 - share) * np.outer(drift, drift),
        is_carried=seen.is_carried,
    )

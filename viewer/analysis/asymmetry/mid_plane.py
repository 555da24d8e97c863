"""The mid-plane of a subject: the plane that mirrors the subject onto itself best.

The mirror image of the surface is registered rigidly with the surface (point to plane, Tukey's weights), so
that what is unlike on both sides hardly counts. Mirroring and registration together are a reflection, whose
plane is the mid-plane (Benz et al. 2002: "The symmetry of faces"). A search over all directions finds where
to start.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...rigid import STILL
from ...scan.pose import Pose
from ...task import checkpoint
from ..landmarks.mirroring import MirrorPlane, mirrored
from ..motion.registration import LEVELS, RegionSurface, RegisteredRegion, distances, register_region
from ..motion.stabilise import moment_surface
from ..tracking.registration import PatchLevel

Float = NDArray[np.float64]

_DIRECTIONS = 200  # over half of a ball: 10 degrees apart
_TRIED = 8  # of them, that the search registers, and
_APART = 0.9  # the cosine of the angle between any two of them, at most
_SOME, _AMONG = 500, 4000  # points that the search mirrors, and between which it looks for their images
_TRIMMED = 0.7  # of the distances: the others may be of what has no counterpart
_FAR = 3.0  # spacings: a distance counts no more than that
_ROUNDS = 8
_SETTLED = 1e-5  # radians, and shares of the region's scale, by which the plane still turns and moves
_LOST = 0.9  # of the share that has a mirror image in the other moment
_HINT = "Name a region that is symmetric"
_PAIRED = 2.0  # Both of two mirrored points are registered, and err alike: variances are twice what they seem


@dataclass(frozen=True, eq=False)
class MidPlane:
    """The mid-plane of a pose.

    plane: its normal points to the left of the subject. turn, shift: standard deviations of the normal in its
    most uncertain direction, degrees, and of the place of the plane at the middle of the region, scan units.
    matched: the share of the region that has a mirror image.
    """

    plane: MirrorPlane
    turn: float
    shift: float
    matched: float


class MirroredPose:
    """A pose whose mid-plane is sought. places: (P, 3), near which the points lie that tell it; None: all do.

    Raises InputError where these points are too few.
    """

    def __init__(self, pose: Pose, places: Float | None = None) -> None:
        from ..motion.region_kernels import rows_nearest

        self._label, self._origin = pose.label, pose.cloud.origin
        self._surface = moment_surface(pose.cloud, self._origin)
        rows = np.arange(pose.count)
        if places is not None:
            near = rows_nearest(self._surface.held, places - self._origin, self._surface.spacing)
            rows = np.unique(near[near >= 0])
        region = RegionSurface.of(self._surface, rows) if len(rows) else None
        if region is None:
            what = "has too few points for a mid-plane"
            raise InputError(what, pose.label, "Use a scan, or a region, with more points")
        self._region = region

    def mid_plane(self, left: Float, near: MidPlane | None = None) -> MidPlane:
        """The mid-plane. left: a vector (3,) to about the left of the subject. near: that of another moment.

        Scan4D searches all directions where there is no plane near the other one, or where it mirrors less.
        Raises InputError where no plane mirrors the subject.
        """
        found = None
        if near is not None:
            found = self._registered(near.plane.in_frame(self._origin), LEVELS[1:])
        if found is None or near is None or found.matched < _LOST * near.matched:
            found = self._registered(self._searched(), LEVELS[1:]) or found
        if found is None:
            raise InputError("has no plane that mirrors it", self._label, _HINT)
        plane = found.plane.in_frame(-self._origin)
        if plane.normal @ left < 0:
            plane = MirrorPlane(-plane.normal, -plane.offset, plane.sigma)
        return replace(found, plane=plane)

    def _searched(self) -> MirrorPlane:
        """The plane that mirrors the subject best, relative to the origin. Raises InputError."""
        found = []
        for number, start in enumerate(self._starts()):
            checkpoint(number / _TRIED)
            nearer = self._registered(start, LEVELS[:2])
            if nearer is not None:
                found.append((self._misfit(nearer.plane), number, nearer.plane))
        if not found:
            raise InputError("has no plane that mirrors it", self._label, _HINT)
        return min(found, key=lambda one: one[:2])[2]

    def _starts(self) -> list[MirrorPlane]:
        """Planes through the middle that mirror some points best, relative to the origin."""
        from scipy.spatial import cKDTree

        points = self._region.points
        among = points[:: max(1, len(points) // _AMONG)]
        some, tree = points[:: max(1, len(points) // _SOME)], cKDTree(among)
        middle = np.median(points, axis=0)
        found = []
        for normal in _half_ball(_DIRECTIONS):
            plane = MirrorPlane(normal, float(normal @ middle), np.nan)
            away = np.sort(tree.query(mirrored(some, plane))[0])
            found.append((float(away[: round(_TRIMMED * len(away))].mean()), plane))
        chosen: list[MirrorPlane] = []
        for _, plane in sorted(found, key=lambda one: one[0]):
            if all(abs(plane.normal @ other.normal) < _APART for other in chosen):
                chosen.append(plane)
            if len(chosen) == _TRIED:
                break
        return chosen

    def _misfit(self, plane: MirrorPlane) -> float:
        """The mean square of the distances to the mirror image, cut off where they are large."""
        most = (_FAR * self._surface.spacing) ** 2
        away = distances(self._region.mirrored(plane), self._surface, STILL)
        return float(np.where(np.isfinite(away), np.minimum(away**2, most), most).mean())

    def _registered(self, plane: MirrorPlane, levels: Sequence[PatchLevel]) -> MidPlane | None:
        """The mid-plane near a plane, relative to the origin; None where too little has a mirror image."""
        middle, scale = self._region.patch.center, self._region.scale
        found = None
        for _ in range(_ROUNDS):
            image = self._region.mirrored(plane)
            found = register_region(image, self._surface, STILL, levels)
            if found is None:
                return None
            turned = found.motion.rotation @ (np.eye(3) - 2 * np.outer(plane.normal, plane.normal))
            normal = np.linalg.eigh((turned + turned.T) / 2)[1][:, 0]
            normal *= np.sign(normal @ plane.normal)
            between = (middle + found.motion.points(mirrored(middle, plane))) / 2
            offset = float(normal @ between)
            moved = abs(offset - plane.offset - (normal - plane.normal) @ middle)
            is_settled = np.linalg.norm(normal - plane.normal) < _SETTLED and moved < _SETTLED * scale
            plane, levels = MirrorPlane(normal, offset, np.nan), levels[-1:]
            if is_settled:
                break
        return None if found is None else _mid_plane(plane, found)


def _mid_plane(plane: MirrorPlane, found: RegisteredRegion) -> MidPlane:
    """The mid-plane as the registration of a mirror image tells it."""
    covariance = _PAIRED * found.covariance / 4  # the plane turns and moves half as far as the image
    across = np.linalg.svd(plane.normal[None])[2][1:]
    turn = float(np.sqrt(np.linalg.eigvalsh(across @ covariance[3:, 3:] @ across.T)[-1]))
    shift = float(np.sqrt(plane.normal @ covariance[:3, :3] @ plane.normal))
    return MidPlane(plane, float(np.degrees(turn)), shift, found.matched)


def _half_ball(count: int) -> Float:
    """Directions (count, 3), spread evenly over half of a ball (Fibonacci)."""
    number = np.arange(count) + 0.5
    height, turn = 1 - number / count, np.pi * (1 + 5**0.5) * number
    width = np.sqrt(1 - height**2)
    return np.stack([width * np.cos(turn), width * np.sin(turn), height], axis=1)

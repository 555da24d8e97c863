"""The surface of a pose as measures ask for it: a patch around landmarks, smoothed to the scan's noise."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from hashlib import blake2b

import numpy as np
from numpy.typing import NDArray

from ...mesh.cutting import length_over
from ...mesh.geodesic import Geodesics, Line, length_of
from ...mesh.openings import bridged, detour, inner_holes, without_pockets
from ...mesh.patch import Patch
from ...mesh.smoothing import Points, moved_to_quadrics, noise_over_faces, smoothing_radius
from ...scan.estimate import cloud_normals
from ...scan.faces import Triangles, rows_of_faces
from ...scan.noise import noise_of
from ...scan.pose import Pose
from ...scan.range_view import merged_normals
from .outlines import Prism
from .regions import NO_PLANE, Refused, Region, region_within

Beyond = Callable[[Points], NDArray[np.float64]]  # how far places (N, 3) are outside, negative within, (N,)

_FITTED = 2.0  # spacings in which points tell a normal where there is no noise
_RIM = 3.0  # spacings that a patch of points reaches farther, as it ends in a ragged rim
_ASTRAY = 4.0  # spacings, and deviations of noise, that a landmark may lie off the surface
_LONGER = 1.2  # times the straight line: the path that is looked for first
_WIDER = 1.1  # times the farthest corner from their middle: where a region is looked for first
_DEEPER = 0.5  # times the same: how far behind the deepest corner
_AROUND = 0.3  # times the same: how far around their outline
_GROWS = 1.6  # by which what is looked at grows where no path is found
_DETOUR = 0.05  # of its length, or a spacing: how much longer a path may be as it goes around openings
_TRIES = 8
_LOOKS = 3  # of these, how often an opening is looked for


@dataclass(frozen=True, eq=False)
class Found:
    """A value found on a surface.

    value: scan units, or their square or cube. gradient: (K, 3), its change as each landmark moves.
    deviation: standard deviation by what sampling and noise leave open of the surface. lines: those that were
    measured, or that are around it, each (P, 3), to be drawn. share: of the area within the outline of a
    region that has surface, or of a line that lies on it; NaN where the measure has none.
    """

    value: float
    gradient: NDArray[np.float64]
    deviation: float
    lines: tuple[Line, ...] = ()
    share: float = np.nan


@dataclass(frozen=True, eq=False)
class Circuit:
    """Landmarks on a patch, and paths from each to the next. numbers: (K,) of the vertices. lids: the number
    of the first face that is a lid over an opening."""

    patch: Patch
    numbers: tuple[int, ...]
    lines: tuple[Line, ...]
    lids: int

    @cached_property
    def region(self) -> Region | Refused:
        """The surface within the paths, which come back to the first landmark."""
        return region_within(self.patch, self.lines, self.lids)

    @cached_property
    def detours(self) -> tuple[float, ...]:
        """How much longer each path is as it goes around openings or along borders, scan units."""
        return tuple(detour(self.patch, line) for line in self.lines)

    @cached_property
    def share(self) -> float:
        """How much of the paths lies on the surface, the rest crosses openings."""
        over = sum(length_over(self.patch, line, self.lids) for line in self.lines)
        return 1 - over / max(sum(map(length_of, self.lines)), np.finfo(float).tiny)


class PoseSurface:
    """The surface of one pose.

    faces: (F, 3) ids of its points; None or none: faces are found where they are needed. Positions are scan
    units, absolute.
    """

    def __init__(self, pose: Pose, faces: Triangles | None = None) -> None:
        self._cloud, self._views, self.spacing = pose.cloud, pose.views, pose.spacing
        self._faces = None if faces is None or not len(faces) else rows_of_faces(faces, self._cloud.ids)
        self.origin = self._cloud.origin
        self._loops: dict[bytes, Circuit | Refused] = {}

    @cached_property
    def digest(self) -> str:
        """A hash of the points, their normals and faces: surfaces with the same one are the same."""
        found = blake2b(digest_size=16)
        cloud = self._cloud
        for part in (cloud.positions, cloud.remainders, self.origin, cloud.normals, self._faces):
            found.update(b"none" if part is None else part.dtype.str.encode())
            found.update(b"" if part is None else np.ascontiguousarray(part).data)
        return found.hexdigest()

    @cached_property
    def noise(self) -> float:
        """The standard deviation of the points off their surface, scan units."""
        if self._faces is None:
            return noise_of(self._cloud).deviation
        whole = Patch(self._points, self._faces, np.arange(len(self._points)))
        return noise_over_faces(self._points, self._faces, whole.vertex_normals)

    @cached_property
    def radius(self) -> float:
        """How far points are averaged, scan units; 0: they are taken as they are."""
        return smoothing_radius(self.noise, self.spacing)

    @cached_property
    def _points(self) -> Points:
        """All points, relative to the origin."""
        return self._cloud.world() - self.origin

    @cached_property
    def _normals(self) -> NDArray[np.float32] | None:
        """Normals that tell the sides; None where the scan has none that do."""
        normals = merged_normals(self._views, self._cloud) if self._views else self._cloud.normals
        if normals is None or not np.isfinite(normals).all() or not normals.any(axis=1).all():
            return None
        return normals

    def patch(self, beyond: Beyond) -> Patch:
        """The part of the surface that a function says is within; places are relative to the origin."""
        margin = 0.0 if self._faces is not None else max(self.radius, _FITTED * self.spacing)
        outside = beyond(self._points)
        if self._faces is not None:
            return self._patch_of_faces(outside <= 0)
        near = np.flatnonzero(outside <= margin + _RIM * self.spacing)
        if len(near) < 3:
            return Patch.of(np.zeros((0, 3)), np.zeros((0, 3), np.int64))
        points = self._points[near]
        normals = cloud_normals(self._cloud.of_rows(near)) if self._normals is None else self._normals[near]
        rows = np.flatnonzero(outside[near] <= _RIM * self.spacing)
        if not self.radius and self._normals is not None:
            return Patch.of_points(points[rows], normals[rows], self.spacing)
        moved, directions = moved_to_quadrics(points, max(self.radius, _FITTED * self.spacing), normals, rows)
        return Patch.of_points(moved if self.radius else points[rows], directions, self.spacing)

    def _patch_of_faces(self, within: NDArray[np.bool_]) -> Patch:
        assert self._faces is not None
        faces = self._faces[within[self._faces].any(axis=1)]
        patch = Patch.of(self._points, faces)
        if not self.radius or not len(faces):
            return patch
        moved, _ = moved_to_quadrics(patch.vertices, self.radius, patch.vertex_normals)
        return Patch(moved, patch.faces, patch.sources)

    def nearest(self, position: NDArray[np.float64]) -> NDArray[np.float64] | None:
        """The place of the surface nearest to another, (3,); None where that is farther than four spacings
        and as many deviations of noise."""
        local, reach = position - self.origin, _ASTRAY * (self.spacing + self.noise)
        patch = self.patch(lambda points: np.linalg.norm(points - local, axis=1) - 2 * reach)
        place = patch.nearest(local) if len(patch.faces) else None
        return place.position + self.origin if place is not None and place.away <= reach else None

    def has_opening(self, one: NDArray[np.float64], other: NDArray[np.float64]) -> bool:
        """Whether two places (3,), relative to the origin, are on the rim of one opening of the surface."""
        from scipy.spatial import cKDTree

        middle, reach = (one + other) / 2, float(np.linalg.norm(other - one)) / 2
        for _ in range(_LOOKS):
            reach = _GROWS * reach + _RIM * self.spacing

            def beyond(points: Points, reach: float = reach) -> NDArray[np.float64]:
                away: NDArray[np.float64] = np.linalg.norm(points - middle, axis=1) - reach
                return away

            def is_cut(points: Points, beyond: Beyond = beyond) -> NDArray[np.bool_]:
                return beyond(points) > 0

            patch = self.patch(beyond)
            start, _ = patch.border
            if not len(start):
                return False
            holes = patch.holes[cKDTree(patch.vertices[start]).query([one, other])[1]]
            if holes[0] == holes[1] and holes[0] in inner_holes(patch, is_cut):
                return True
        return False

    def path(self, start: NDArray[np.float64], end: NDArray[np.float64]) -> Circuit | Refused:
        """The shortest path over the surface from one place to another; a reason where they are not on it,
        nothing joins them, or it goes around an opening.

        It is looked for where paths of its length could be: within the ellipsoid about both places. The patch
        and its line are relative to the origin.
        """
        start, end = start - self.origin, end - self.origin
        reach = _LONGER * float(np.linalg.norm(end - start)) + 2 * _RIM * self.spacing

        def beyond(points: Points) -> NDArray[np.float64]:
            both = np.linalg.norm(points - start, axis=1) + np.linalg.norm(points - end, axis=1)
            return (both - reach) / 2

        for _ in range(_TRIES):
            found = self._joined(self.patch(beyond), [start, end], beyond, is_closed=False)
            length = length_of(found.lines[0]) if isinstance(found, Circuit) else np.inf
            if length <= reach or beyond(self._points).max() <= 0:
                break
            reach = min(length * (1 + 1e-6), _GROWS * reach)
        return self._straight(found)

    def loop(self, corners: NDArray[np.float64]) -> Circuit | Refused:
        """The paths from each of some places (K, 3) to the next and back to the first, on a patch that has
        what is within them; a reason where they are not on the surface, nothing joins them, or one goes
        along a border. Paths cross openings straight.

        The patch and its lines are relative to the origin. Found once for each places.
        """
        key = corners.tobytes()
        if key not in self._loops:
            self._loops[key] = self._loop(corners - self.origin)
        return self._loops[key]

    def _loop(self, corners: NDArray[np.float64]) -> Circuit | Refused:
        """Looked for within and around the outline of the corners, in a ball about their middle, and not far
        behind them; all of these grow until they hold the paths and what is within."""
        middle, prism = corners.mean(axis=0), Prism.over(corners)
        if prism is None:
            return Refused(NO_PLANE)
        size = float(np.linalg.norm(corners - middle, axis=1).max())
        inwards, factor = self._inwards(corners, prism.normal), 1.0
        deepest = float(((corners - middle) @ inwards).max())

        def beyond(points: Points) -> NDArray[np.float64]:
            offsets = points - middle
            away = np.sqrt(np.einsum("pi,pi->p", offsets, offsets)) - _WIDER * factor * size
            away = np.maximum(away, offsets @ inwards - deepest - _DEEPER * factor * size)
            near = np.flatnonzero(away <= 2 * _RIM * self.spacing)
            away[near] = np.maximum(away[near], prism.beyond(points[near]) - _AROUND * factor * size)
            return away - _RIM * self.spacing

        for _ in range(_TRIES):
            found = self._joined(self.patch(beyond), list(corners), beyond, is_closed=True)
            if isinstance(found, Circuit) and self._is_whole(found, beyond):
                break
            if beyond(self._points).max() <= 0:
                break
            factor *= _GROWS
        return self._straight(found)

    def _is_whole(self, found: Circuit, beyond: Beyond) -> bool:
        """Whether paths and what is within them do not reach where their patch was cut off."""
        if max(beyond(line).max() for line in found.lines) >= -_RIM * self.spacing:
            return False
        if isinstance(found.region, Refused):
            return False
        rim = np.intersect1d(found.patch.border[0], found.region.piece.faces)
        return not len(rim) or beyond(found.patch.vertices[rim]).max() <= 0

    def _inwards(self, corners: NDArray[np.float64], normal: NDArray[np.float64]) -> NDArray[np.float64]:
        """The normal of the plane of places (K, 3) on the surface, or its opposite: to the side that the
        surface faces away from; zeros where nothing tells that."""
        if self._normals is None:
            return np.zeros(3)
        reach = _ASTRAY * (self.spacing + self.noise)
        low, high = corners.min(axis=0) - reach, corners.max(axis=0) + reach
        near = np.flatnonzero(((self._points >= low) & (self._points <= high)).all(axis=1))
        if not len(near):
            return np.zeros(3)
        nearest = [
            int(np.einsum("pi,pi->p", away, away).argmin()) for away in self._points[near] - corners[:, None]
        ]
        faces_it = float(self._normals[near[nearest]].sum(axis=0) @ normal)
        return -normal if faces_it >= 0 else normal

    def _straight(self, found: Circuit | Refused) -> Circuit | Refused:
        """Paths, or the reason where one goes around an opening by more than the surface leaves open."""
        if isinstance(found, Refused):
            return found
        for number, (longer, line) in enumerate(zip(found.detours, found.lines, strict=True)):
            if longer > max(_DETOUR * length_of(line), self.spacing):
                return Refused("the path from {} to {} goes around an opening", (number, number + 1))
        return found

    def _joined(
        self, patch: Patch, corners: Sequence[NDArray[np.float64]], beyond: Beyond, is_closed: bool
    ) -> Circuit | Refused:
        """The paths over a patch from each place to the next, without the pockets behind its openings.

        is_closed: the paths come back to the first place, and cross openings straight.
        """
        if not len(patch.faces):
            return Refused("there is no surface near {}", (0,))
        places = [patch.nearest(corner) for corner in corners]
        for number, place in enumerate(places):
            if place.away > _ASTRAY * (self.spacing + self.noise):
                return Refused("{} is off the surface", (number,))
        patch, numbers = without_pockets(patch, [place.face for place in places], self.spacing), []
        for corner in corners:
            patch, number = patch.with_point(patch.nearest(corner))
            numbers.append(number)
        lids = len(patch.faces)
        if is_closed:
            patch = bridged(patch, inner_holes(patch, lambda points: beyond(points) > 0))
        geodesics, lines = Geodesics(patch), []
        for number, (start, end) in enumerate(
            zip(numbers, numbers[1:] + (numbers[:1] if is_closed else []), strict=False)
        ):
            line = geodesics.path(start, end)
            if line is None:
                return Refused("no surface connects {} and {}", (number, number + 1))
            lines.append(line)
        return Circuit(patch, tuple(numbers), tuple(lines), lids)

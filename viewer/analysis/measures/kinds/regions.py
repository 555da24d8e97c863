"""Measures of a region: what the shortest paths from landmark to landmark go around."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ....mesh.geodesic import Line, length_of, steps_along
from ....mesh.patch import Patch
from .. import WHOLE
from ..outlines import Prism, crosses_itself
from ..prism import area_through, near_rim, patch_through, rim_through, share_through
from ..regions import CROSSES, NO_PLANE, across, below, plane_facing
from ..surface import Circuit, Found, PoseSurface, Refused
from . import MeasureKind, Options
from .along import direction, off_smooth

FRONT, ALL = "front", "through"
DEPTHS = (FRONT, ALL)  # the surface that the landmarks are on, or all that is before and behind it as well
_STEP = 1e-3  # spacings that a landmark is moved by to find a gradient
_WIDE_STEP = 1.0  # the same, where all in a prism is measured
_RIM = 4.0  # spacings off the walls of a prism within which that changes something
_BENT = 3.0  # of the squared angles at a face's edges, by which it is smaller than what it stands for


def _perimeter(surface: PoseSurface, positions: NDArray[np.float64], options: Options) -> Found | Refused:
    if options.get("depth") == ALL:
        return _through(surface, positions, is_rim=True)
    loop = surface.loop(positions)
    if isinstance(loop, Refused):
        return loop
    gradient = -np.array([direction(line) for line in loop.lines])
    gradient -= np.roll([direction(line[::-1]) for line in loop.lines], 1, axis=0)
    deviation = off_smooth(surface, loop.lines) + sum(loop.detours)
    value = sum(map(length_of, loop.lines))
    return Found(value, gradient, deviation, _absolute(surface, loop), loop.share)


def _area(surface: PoseSurface, positions: NDArray[np.float64], options: Options) -> Found | Refused:
    if options.get("depth") == ALL:
        return _through(surface, positions, is_rim=False)
    loop = surface.loop(positions)
    if isinstance(loop, Refused):
        return loop
    region = loop.region
    if isinstance(region, Refused):
        return region
    piece = region.piece
    deviation = float((piece.areas * loop.patch.bends[piece.sources]).sum()) / _BENT + _beside(loop)
    return Found(float(piece.areas.sum()), _widening(loop), deviation, _absolute(surface, loop), region.share)


def _through(surface: PoseSurface, positions: NDArray[np.float64], *, is_rim: bool) -> Found | Refused:
    """The area, or the rim, of all of a surface in the prism over the polygon of landmarks."""
    prism = Prism.over(positions - surface.origin)
    if prism is None:
        return Refused(NO_PLANE)
    if crosses_itself(prism.corners):
        return Refused(CROSSES)
    patch = patch_through(surface, prism)
    lines = rim_through(patch, prism) if len(patch.faces) else []
    if not lines:
        return Refused("there is no surface in front of or behind the outline")
    if is_rim:
        value, deviation = sum(map(length_of, lines)), off_smooth(surface, lines)
    else:
        areas = area_through(patch, prism)
        value, deviation = float(areas.sum()), float((areas * patch.bends).sum()) / _BENT
    gradient = _gradient_through(
        near_rim(patch, prism, _RIM * surface.spacing), prism, surface.spacing, is_rim
    )
    share = share_through(patch, prism, prism.around() if is_rim else prism.within())
    return Found(value, gradient, deviation, tuple(line + surface.origin for line in lines), share)


def _gradient_through(rim: Patch, prism: Prism, spacing: float, is_rim: bool) -> NDArray[np.float64]:
    """How the area, or the rim, changes as each landmark moves in the plane of them all, (K, 3)."""
    count, step = len(prism.corners), _WIDE_STEP * spacing
    middles = prism.flat(rim.corners.mean(axis=0))
    areas = np.linalg.norm(rim.doubled, axis=1) / 2

    def value(number: int, corner: NDArray[np.float64]) -> float:
        moved = prism.with_corner(number, corner)
        if is_rim:
            return sum(map(length_of, rim_through(rim, moved, [number - 1, number])))
        return float(areas[moved.has(middles)].sum())

    gradient = np.zeros((count, 3))
    for number, corner in enumerate(prism.corners):
        for axis, away in zip(prism.axes, step * np.eye(2), strict=True):
            change = value(number, corner + away) - value(number, corner - away)
            gradient[number] += change / (2 * step) * axis
    return gradient


def _volume(surface: PoseSurface, positions: NDArray[np.float64], _: Options) -> Found | Refused:
    loop = surface.loop(positions)
    if isinstance(loop, Refused):
        return loop
    region = loop.region
    if isinstance(region, Refused):
        return region
    if region.share < WHOLE:
        return Refused(f"the surface fills only {100 * region.share:.0f} % of the outline")
    piece = region.piece
    edges = [steps_along(line, surface.spacing)[:-1] for line in loop.lines]
    around = np.concatenate(edges)
    center, normal = plane_facing(piece, around)
    value = below(piece, center, normal)
    normals = _upright(loop.patch, around)  # across which nothing moves: the outline stays on the surface
    gradient, step = np.zeros_like(positions), _STEP * surface.spacing
    for number, pulled in enumerate(_pulled(edges)):
        for axis in range(3):
            sides = []
            for side in (step, -step):
                moved = around + side * pulled[:, None] * (np.eye(3)[axis] - normals[:, [axis]] * normals)
                sides.append(below(piece, *plane_facing(piece, moved)))
            gradient[number, axis] = (sides[0] - sides[1]) / (2 * step)
    flat = np.abs(across(piece, normal))
    sag = np.sqrt(piece.areas * loop.patch.bends[piece.sources]) / 8
    noise = surface.noise * surface.spacing * np.sqrt(flat.sum())
    deviation = float(np.hypot((flat * sag).sum(), noise))
    deviation += (1 - min(region.share, 1)) * abs(value) + _beside(loop) * np.abs(value) / piece.areas.sum()
    return Found(value, gradient, float(deviation), _absolute(surface, loop), region.share)


def _absolute(surface: PoseSurface, loop: Circuit) -> tuple[Line, ...]:
    return tuple(line + surface.origin for line in loop.lines)


def _beside(loop: Circuit) -> float:
    """The area that may lie between paths that go around openings and straight ones, squared scan units."""
    return sum(loop.detours) * max(map(length_of, loop.lines)) / 2


def _widening(loop: Circuit) -> NDArray[np.float64]:
    """How the area within changes as each landmark moves, (K, 3): the paths beside it swing about their other
    ends, by half their lengths across them."""
    lengths = np.array([length_of(line) for line in loop.lines])[:, None] / 2
    leaving = lengths * [direction(line) for line in loop.lines]
    arriving = lengths * [-direction(line[::-1]) for line in loop.lines]
    corners = np.concatenate([line[:-1] for line in loop.lines])
    corners = corners - corners.mean(axis=0)
    normals = _upright(loop.patch, loop.patch.vertices[list(loop.numbers)])
    turning = np.cross(corners, np.roll(corners, -1, axis=0)).sum(axis=0) @ normals.sum(axis=0)
    along = leaving + np.roll(arriving, 1, axis=0)
    return np.sign(turning) * np.cross(along, normals)


def _upright(patch: Patch, places: NDArray[np.float64]) -> NDArray[np.float64]:
    """The unit normals of a patch at the vertices nearest to places (N, 3)."""
    from scipy.spatial import cKDTree

    normals = patch.vertex_normals[cKDTree(patch.vertices).query(places)[1]]
    return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), np.finfo(float).tiny)


def _pulled(edges: list[Line]) -> list[NDArray[np.float64]]:
    """How much each landmark takes every place of the outline along: all at itself, none at the next ones."""
    shares = [np.arange(len(edge)) / len(edge) for edge in edges]
    count = len(edges)
    pulled = []
    for number in range(count):
        parts = [np.zeros(len(edge)) for edge in edges]
        parts[number] = 1 - shares[number]
        parts[number - 1] = parts[number - 1] + shares[number - 1]
        pulled.append(np.concatenate(parts))
    return pulled


KINDS = (
    MeasureKind(
        "area", "Area of a region",
        "area of the surface inside an outline, which runs along the surface from landmark to landmark",
        "area", 3, None, _area, True, {"depth": DEPTHS},
    ),
    MeasureKind(
        "perimeter", "Perimeter of a region",
        "length of an outline, which runs along the surface from landmark to landmark",
        "length", 3, None, _perimeter, True, {"depth": DEPTHS},
    ),
    MeasureKind(
        "volume", "Volume above the outline's plane",
        "volume between the surface inside an outline and the plane of the outline; negative below the plane",
        "volume", 3, None, _volume, True,
    ),
)  # fmt: skip

"""Measures along the surface: the path through landmarks, and what a plane cuts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ....mesh.cutting import plane_section
from ....mesh.geodesic import Line, kinked, length_of
from ....mesh.patch import Patch
from ....mesh.smoothing import Points
from ..planes import PLANES, plane_of
from ..surface import Found, PoseSurface, Refused
from . import MeasureKind, Options

_STEP = 1e-3  # spacings that a landmark is moved by to find a gradient
_SLAB = 2.0  # spacings to both sides of a plane


def _path(surface: PoseSurface, positions: NDArray[np.float64], options: Options) -> Found | Refused:
    closed = options.get("closed") == "yes"
    ends = np.concatenate([positions, positions[:1]]) if closed else positions
    lines, gradient, detour = [], np.zeros_like(ends), 0.0
    for number, (start, end) in enumerate(pairwise(ends)):
        found = surface.path(start, end)
        if isinstance(found, Refused):
            return replace(found, landmarks=tuple(number + each for each in found.landmarks))
        line = found.lines[0] + surface.origin
        lines.append(line)
        detour += sum(found.detours)
        gradient[number] -= direction(line)
        gradient[number + 1] -= direction(line[::-1])
    if closed:
        gradient[0] += gradient[-1]
    deviation = off_smooth(surface, lines) + detour
    return Found(sum(map(length_of, lines)), gradient[: len(positions)], deviation, tuple(lines))


def off_smooth(surface: PoseSurface, lines: Sequence[Line]) -> float:
    """The standard deviation of the length of lines by what lies between the points, see `kinked`."""
    return sum(kinked(line, surface.spacing) for line in lines)


def direction(line: Line) -> NDArray[np.float64]:
    """The unit vector in which a line begins, (3,); zeros where it has no length."""
    pieces = np.diff(line, axis=0)
    lengths = np.linalg.norm(pieces, axis=1)
    first = np.flatnonzero(lengths > 0)[:1]
    return (pieces[first] / lengths[first, None]).sum(axis=0)


def _section(surface: PoseSurface, positions: NDArray[np.float64], options: Options) -> Found | Refused:
    local = positions - surface.origin
    how = options.get("plane", PLANES[0])
    center, normal = plane_of(local, how)
    if not np.isfinite(normal).all():
        return Refused("the landmarks of the measure lie on a line, so they define no plane")

    def beyond(points: Points) -> NDArray[np.float64]:
        return np.abs((points - center) @ normal) - _SLAB * surface.spacing

    patch = surface.patch(beyond)
    lines = _contours(patch, center, normal, local[0], options)
    if not lines:
        return Refused("the plane through the landmarks does not cut the surface")
    if options.get("lines") != "all" and _ends_at_opening(
        surface, lines[0], plane_section(patch, center, normal)
    ):
        return Refused(
            "the line where the plane cuts the surface ends at an opening. Fill the opening, or measure "
            "all parts of the line (option lines = all)"
        )
    gradient = np.zeros_like(positions)
    step = _STEP * surface.spacing
    for number in range(len(local)):
        lengths = []
        for side in (step, -step):
            moved = local.copy()
            moved[number] += side * normal
            found = _contours(patch, *plane_of(moved, how), local[0], options)
            lengths.append(sum(map(length_of, found)))
        gradient[number] = (lengths[0] - lengths[1]) / (2 * step) * normal
    value, deviation = sum(map(length_of, lines)), off_smooth(surface, lines)
    return Found(value, gradient, deviation, tuple(line + surface.origin for line in lines))


def _contours(
    patch: Patch,
    center: NDArray[np.float64],
    normal: NDArray[np.float64],
    first: NDArray[np.float64],
    options: Options,
) -> list[Line]:
    """Lines that the plane cuts: all, or the one nearest to the first landmark."""
    lines = plane_section(patch, center, normal)
    if options.get("lines") == "all" or not lines:
        return lines
    return [min(lines, key=lambda line: float(np.linalg.norm(line - first, axis=1).min()))]


def _ends_at_opening(surface: PoseSurface, line: Line, lines: Sequence[Line]) -> bool:
    """Whether a line, of these lines in one plane, goes on across an opening that is narrower than half of
    the line and what follows; where none is, the surface ends."""
    if (line[0] == line[-1]).all():
        return False
    for end in (line[0], line[-1]):
        ends = [
            (
                float(np.linalg.norm(other - end)),
                length_of(line) + length_of(each) * (not np.array_equal(each, line)),
                other,
            )
            for each in lines
            for other in (each[0], each[-1])
            if (other != end).any()
        ]
        away, whole, other = min(ends, key=lambda found: found[0])
        if away < whole / 2 and surface.has_opening(end, other):
            return True
    return False


KINDS = (
    MeasureKind(
        "path", "Path along the surface",
        "length of the shortest path along the surface, from each landmark to the next",
        "length", 2, None, _path, True, {"closed": ("no", "yes")},
    ),
    MeasureKind(
        "section", "Cross-section", 
            "length of the line where the plane through the landmarks cuts the surface"
        ,
        "length", 3, None, _section, True, {"lines": ("nearest", "all"), "plane": PLANES},
    ),
)  # fmt: skip

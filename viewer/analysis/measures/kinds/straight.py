"""Measures of landmarks alone: distances, angles, planes, and curves through the air."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ....mesh.geodesic import Line
from ..planes import PLANES, plane_of
from . import MeasureKind, Options

_BETWEEN = 32  # places on a curve from one landmark to the next
_PLANE = (
    "the other landmarks define the plane, which fits three or more landmarks or lies halfway between "
    "the two landmarks of each pair"
)

Positions = NDArray[np.float64]  # (T, K, 3)
Values = NDArray[np.float64]  # (T,)


def _distance(positions: Positions, _: Options) -> Values:
    return np.linalg.norm(positions[:, 1] - positions[:, 0], axis=1)


def _between(one: NDArray[np.float64], other: NDArray[np.float64]) -> Values:
    """The angles between vectors (T, 3), degrees; NaN where one has no length."""
    cosine = (one * other).sum(axis=1)
    sine = np.linalg.norm(np.cross(one, other), axis=1)
    return np.where((cosine == 0) & (sine == 0), np.nan, np.degrees(np.arctan2(sine, cosine)))


def _angle(positions: Positions, _: Options) -> Values:
    return _between(positions[:, 0] - positions[:, 1], positions[:, 2] - positions[:, 1])


def _plane(positions: Positions, options: Options) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    return plane_of(positions, options.get("plane", PLANES[0]))


def _plane_angle(positions: Positions, options: Options) -> Values:
    _, normal = _plane(positions[:, 2:], options)
    to_normal = _between(positions[:, 1] - positions[:, 0], normal)
    return np.abs(90 - to_normal)


def _plane_distance(positions: Positions, options: Options) -> Values:
    center, normal = _plane(positions[:, 1:], options)
    return ((positions[:, 0] - center) * normal).sum(axis=1)


def _joined(positions: NDArray[np.float64], _: Options) -> list[Line]:
    return [positions]


def _plane_angle_lines(positions: NDArray[np.float64], options: Options) -> list[Line]:
    """The line, and its foot in the plane."""
    line = positions[:2]
    return [line, _feet(line, positions[2:], options)]


def _plane_distance_lines(positions: NDArray[np.float64], options: Options) -> list[Line]:
    """The line from the landmark to its foot, and on to the middle of the plane."""
    foot = _feet(positions[:1], positions[1:], options)
    center, _ = plane_of(positions[1:], options.get("plane", PLANES[0]))
    return [np.concatenate([positions[:1], foot]), np.concatenate([foot, center[None]])]


def _feet(places: Line, of_plane: NDArray[np.float64], options: Options) -> Line:
    """The places of a plane that are nearest to others, (P, 3)."""
    center, normal = plane_of(of_plane, options.get("plane", PLANES[0]))
    return places - ((places - center) @ normal)[:, None] * normal


def _curve(positions: Positions, options: Options) -> Values:
    return np.linalg.norm(np.diff(_along(positions, options), axis=1), axis=2).sum(axis=1)


def _curve_lines(positions: NDArray[np.float64], options: Options) -> list[Line]:
    return [_along(positions[None], options)[0]]


def _along(positions: Positions, options: Options) -> Positions:
    """Places along the curves, (T, P, 3)."""
    if options.get("closed") == "yes":
        positions = np.concatenate([positions, positions[:, :1]], axis=1)
        before, after = positions[:, -2], positions[:, 1]
    else:
        before, after = 2 * positions[:, 0] - positions[:, 1], 2 * positions[:, -1] - positions[:, -2]
    if options.get("shape") == "straight":
        return positions
    knots = np.concatenate([before[:, None], positions, after[:, None]], axis=1)
    pieces = [_catmull_rom(knots[:, number : number + 4]) for number in range(positions.shape[1] - 1)]
    return np.concatenate([*(piece[:, :-1] for piece in pieces), positions[:, -1:]], axis=1)


def _catmull_rom(knots: Positions) -> Positions:
    """Places on centripetal Catmull-Rom curves from the second to the third of four places, (T, 4, 3), with
    the pyramid of Barry and Goldman (1988). Centripetal ones have no loops (Yuksel 2011)."""
    steps = np.sqrt(np.maximum(np.linalg.norm(np.diff(knots, axis=1), axis=2), np.finfo(float).tiny))
    times = np.concatenate([np.zeros((len(knots), 1)), np.cumsum(steps, axis=1)], axis=1)[:, :, None, None]
    share = np.linspace(0, 1, _BETWEEN + 1)[None, :, None]
    time = times[:, 1] + share * (times[:, 2] - times[:, 1])
    level = [knots[:, number, None] for number in range(4)]
    for height in (1, 2, 3):
        level = [
            level[n] + (time - times[:, n]) / (times[:, n + height] - times[:, n]) * (level[n + 1] - level[n])
            for n in range(4 - height)
        ]
    return level[0]


KINDS = (
    MeasureKind(
        "distance", "Distance", "length of the straight line from the first landmark to the second",
        "length", 2, 2, _distance, lines=_joined,
    ),
    MeasureKind(
        "angle", "Angle", "angle between two lines that meet at the second of three landmarks",
        "angle", 3, 3, _angle, lines=_joined,
    ),
    MeasureKind(
        "plane_angle", "Angle to a plane",
        f"angle between a plane and the line through the first two landmarks; {_PLANE}",
        "angle", 5, None, _plane_angle, choices={"plane": PLANES}, lines=_plane_angle_lines,
    ),
    MeasureKind(
        "plane_distance", "Distance to a plane",
        f"distance of the first landmark from a plane, negative on one side; {_PLANE}",
        "length", 4, None, _plane_distance, choices={"plane": PLANES}, lines=_plane_distance_lines,
    ),
    MeasureKind(
        "curve", "Curve", 
            "length of a smooth or straight line through all landmarks, which does not follow the surface"
        ,
        "length", 2, None, _curve, choices={"shape": ("smooth", "straight"), "closed": ("no", "yes")},
        lines=_curve_lines,
    ),
)  # fmt: skip

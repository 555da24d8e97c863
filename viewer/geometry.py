"""Vectors, and names of axes."""

from __future__ import annotations

import math
from collections.abc import Iterable

from .errors import unknown_name

Vector = tuple[float, float, float]

_AS_GOOD_AS = 1e-3  # an axis, from which a direction is so far
UP = "+y"  # where nobody says otherwise; a name of AXES
AXES: dict[str, Vector] = {
    "+x": (1, 0, 0),
    "-x": (-1, 0, 0),
    "+y": (0, 1, 0),
    "-y": (0, -1, 0),
    "+z": (0, 0, 1),
    "-z": (0, 0, -1),
}


# The front of a subject, at right angles to each up axis; azimuth 0 looks from there, along y or z with x to
# the right. With y down, as depth cameras have it, z points away from them.
_FRONTS: dict[str, Vector] = {
    "+x": (0, 0, 1),
    "-x": (0, 0, 1),
    "+y": (0, 0, 1),
    "-y": (0, 0, -1),
    "+z": (0, -1, 0),
    "-z": (0, 1, 0),
}


def vector(values: Iterable[float | str]) -> Vector:
    """The vector of three numbers, such as an array's."""
    x, y, z = (float(value) for value in values)
    return x, y, z


def up_vector(name: str) -> Vector:
    """The unit vector of what is up: an axis name such as '+y' or '-z', or a direction as three numbers, such
    as '0.1 0 0.9'. Raises InputError."""
    if name in AXES:
        return AXES[name]
    try:
        x, y, z = vector(name.split())
        length = math.hypot(x, y, z)
        if not math.isfinite(length):
            raise ValueError
        return x / length, y / length, z / length
    except (ValueError, ZeroDivisionError):
        raise unknown_name("up axis", name, list(AXES)) from None


def up_name(direction: Iterable[float]) -> str:
    """The name of what is up, as `up_vector` takes it, for a direction of any length but 0."""
    given = vector(direction)
    nearest, length = nearest_axis(given), math.hypot(*given)
    if math.dist([value / length for value in given], AXES[nearest]) < _AS_GOOD_AS:
        return nearest
    return " ".join(f"{value / length:.4f}" for value in given)


def nearest_axis(direction: Vector) -> str:
    """The name of the axis that a direction is nearest to, of `AXES`."""
    return max(AXES, key=lambda name: _dot(direction, AXES[name]))


def front_vector(up: str) -> Vector:
    """The unit vector towards the front of a subject that stands along what is up, see `up_vector`."""
    above = up_vector(up)
    front = _FRONTS[nearest_axis(above)]
    along = _dot(front, above)
    level = [value - along * by for value, by in zip(front, above, strict=True)]
    return vector(value / math.hypot(*level) for value in level)


def _dot(a: Vector, b: Vector) -> float:
    return sum(one * other for one, other in zip(a, b, strict=True))

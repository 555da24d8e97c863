"""Vectors, and names of axes."""

from __future__ import annotations

from collections.abc import Iterable

from .errors import unknown_name

Vector = tuple[float, float, float]

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


def vector(values: Iterable[float]) -> Vector:
    """The vector of three numbers, such as an array's."""
    x, y, z = (float(value) for value in values)
    return x, y, z


def up_vector(name: str) -> Vector:
    """The unit vector of an axis name such as '+y' or '-z'; raises InputError."""
    if name not in AXES:
        raise unknown_name("up axis", name, list(AXES))
    return AXES[name]


def front_vector(up: str) -> Vector:
    """The unit vector towards the front of a subject that stands along an up axis such as '+y'."""
    up_vector(up)
    return _FRONTS[up]

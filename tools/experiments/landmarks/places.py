"""Places of the demo's face that anatomists name, as exact points of its skin, and their exact paths."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from viewer.errors import unknown_name
from viewer.scan.demo import head
from viewer.scan.demo.motion import HeadMotion, move
from viewer.scan.demo.solids import projected

_NEWTON_STEPS = 12
_LONGEST_STEP = 2.0  # mm

# Soft-tissue landmarks (Farkas, Anthropometry of the Head and Face, 1994): near the skin, mm; of pairs the
# left one, at +x.
_MIDDLE = {
    "glabella": (0.0, 27.0, 85.0),
    "nasion": (0.0, 15.0, 84.0),
    "pronasale": (0.0, -28.5, 110.0),
    "subnasale": (0.0, -44.0, 93.0),
    "labiale superius": (0.0, -54.0, 90.5),
    "labiale inferius": (0.0, -67.3, 89.0),
    "sublabiale": (0.0, -79.0, 80.0),
    "pogonion": (0.0, -90.0, 87.0),
    "gnathion": (0.0, -100.5, 78.0),
}
_PAIRS = {
    "exocanthion": (46.8, 11.0, 66.0),
    "endocanthion": (14.0, 8.6, 73.0),
    "alare": (17.5, -33.0, 90.0),
    "crista philtri": (5.5, -52.3, 90.5),
    "cheilion": (27.5, -57.3, 78.5),
    "tragion": (74.0, 0.0, 9.0),
}
_NEAR = {
    **_MIDDLE,
    **{
        f"{name} {side}": (sign * x, y, z)
        for name, (x, y, z) in _PAIRS.items()
        for side, sign in (("left", 1.0), ("right", -1.0))
    },
}

PLACES = tuple(_NEAR)


def truth_places(names: Iterable[str] = PLACES) -> NDArray[np.float64]:
    """Places of the skin at rest, (N, 3) mm, of `PLACES` by name; within 1e-9 mm of the exact surface.

    Raises InputError for a name that there is not.
    """
    chosen = list(names)
    if unknown := [name for name in chosen if name not in _NEAR]:
        raise unknown_name("place of the face", unknown[0], PLACES)
    near = np.array([_NEAR[name] for name in chosen]).reshape(-1, 3)
    return projected(head.skin, near.T, _NEWTON_STEPS, _LONGEST_STEP)[0].T


def skin_normals(rest: ArrayLike) -> NDArray[np.float64]:
    """The outward unit normals (N, 3) at places (N, 3) of the skin at rest."""
    return projected(head.skin, np.asarray(rest, np.float64).T, 0)[1].T


def path_of(rest: ArrayLike, times: ArrayLike, motion: HeadMotion) -> NDArray[np.float64]:
    """Positions of places (N, 3) of the skin at rest at times (T,) in seconds: (T, N, 3), exactly."""
    places = np.asarray(rest, np.float64).T
    normals = np.zeros_like(places)
    normals[2] = 1
    return np.stack([move(places, normals, float(time), motion)[0].T for time in np.atleast_1d(times)])

"""The geometry of the orientation cube. Plain functions, no window.

The cube's axes are the subject's left, up and front; it spans -1..1 along each of them. A direction names
one of its 26 parts by where it lies: (0, 0, 1) is the front face, (1, 0, 1) the edge between left and
front, (1, 1, 1) the corner at left, top and front.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ...camera import Camera
from ...geometry import front_vector, up_vector
from .navigation import POLE

Direction = tuple[int, int, int]

FACES: dict[str, Direction] = {
    "front": (0, 0, 1), "back": (0, 0, -1), "left": (1, 0, 0), "right": (-1, 0, 0),
    "top": (0, 1, 0), "bottom": (0, -1, 0),
}  # fmt: skip
_INNER = 0.6  # half the width of what belongs to a face itself; edges and corners lie round it


def rotation(camera: Camera, up: str, front: float = 0.0) -> NDArray[np.float64]:
    """The rotation from the cube's axes to the picture's right, up and backward, (3, 3). up: the scan's.
    front: degrees that its front is turned about that."""
    above, ahead = np.array(up_vector(up), float), np.array(front_vector(up), float)
    left, turn = np.cross(above, ahead), math.radians(front)
    axes = [
        math.cos(turn) * left - math.sin(turn) * ahead,
        above,
        math.cos(turn) * ahead + math.sin(turn) * left,
    ]
    return camera.rotation() @ np.column_stack(axes)


def azimuth_of(camera: Camera, up: str) -> float:
    """The azimuth in degrees that a camera looks from, as `Camera.orbit` takes it. up: the scan's."""
    left, _, ahead = rotation(camera, up)[2]
    return math.degrees(math.atan2(left, ahead))


def part_at(turned: NDArray[np.float64], right: float, up: float) -> Direction | None:
    """The part of the cube that is seen at a position of its picture, None beside it.

    right, up: from the picture's centre, in half edges of the cube.
    """
    start, toward_eye = turned.T @ (right, up, 0.0), turned.T[:, 2]
    # Where the line of sight is parallel to faces it is either between them or beside them.
    slope = np.where(np.abs(toward_eye) < 1e-9, 1e-9, toward_eye)
    bounds = np.sort([(-1 - start) / slope, (1 - start) / slope], axis=0)
    enters, leaves = bounds[0].max(), bounds[1].min()
    if enters > leaves:
        return None
    point = start + leaves * toward_eye
    left, above, front = (round(v) for v in np.where(np.abs(point) > _INNER, np.sign(point), 0))
    return left, above, front


def angles(direction: Direction) -> tuple[float, float]:
    """Azimuth and elevation, degrees, that look at a part of the cube from outside."""
    left, up, front = direction
    elevation = math.degrees(math.atan2(up, math.hypot(left, front)))
    return math.degrees(math.atan2(left, front)), min(max(elevation, -POLE), POLE)


def name(direction: Direction) -> str:
    """The faces that meet at a part of the cube, such as "front, left"."""
    return ", ".join(face for face, axis in FACES.items() if np.dot(axis, direction) > 0)


def square(face: Direction) -> NDArray[np.float64]:
    """The corners of a face, round it, (4, 3)."""
    return _rectangle(face, (-1, 1), (-1, 1))


def patch(face: Direction, direction: Direction) -> NDArray[np.float64]:
    """The corners of what belongs to a direction on one of its faces, round it, (4, 3)."""
    ranges = {0: (-_INNER, _INNER), 1: (_INNER, 1.0), -1: (-1.0, -_INNER)}
    first, second = (ranges[part] for part, axis in zip(direction, face, strict=True) if not axis)
    return _rectangle(face, first, second)


def _rectangle(
    face: Direction, first: tuple[float, float], second: tuple[float, float]
) -> NDArray[np.float64]:
    """A part of a face. first, second: its ranges along the two axes that lie in the face."""
    corners = np.tile(np.array(face, float), (4, 1))
    (a, b), (c, d) = first, second
    corners[:, np.equal(face, 0)] = [(a, c), (b, c), (b, d), (a, d)]
    return corners


def writing(turned: NDArray[np.float64], face: Direction) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Unit vectors of the cube to the right and up, for a text on a face; read from outside.

    On top and bottom it turns with the view, so that it stands as upright as it can.
    """
    candidates = np.array([(0, 1, 0)] if face[1] == 0 else [(0, 0, -1), (0, 0, 1), (1, 0, 0), (-1, 0, 0)])
    up = candidates[(candidates @ turned[1]).argmax()]
    return np.cross(up, face).astype(float), up.astype(float)

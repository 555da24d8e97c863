"""The demo subject at rest: a human head, mouth closed and eyes open, as an implicit surface.

Millimetres; +y up, the face towards +z, the subject's left at +x. Sizes follow common adult
averages: 230 mm from chin to crown, 148 mm wide, pupils 62 mm apart.
"""

from __future__ import annotations

import numpy as np

from .shapes import (
    Scalar,
    bell,
    bump,
    carve,
    ellipsoid,
    intersection,
    length,
    limb,
    ramp,
    union,
)

EYE = (31.0, 10.0, 62.0)  # centre of the left eyeball
EYE_RADIUS = 12.0


def skin(x: Scalar, y: Scalar, z: Scalar) -> Scalar:
    """All but the eyeballs: skin, hair and the inside of the mouth; negative inside."""
    side = np.absolute(x)
    solid = _skull_and_neck(x, y, z)
    solid = _brow_ridge(solid, side, y, z)
    solid = _eye_socket(solid, side, y, z)
    solid = _nose(solid, side, y, z)
    solid = _lips(solid, side, y, z)
    solid = solid - hair_thickness(x, y, z)
    solid = union(solid, ear(side, y, z), 6.0)
    solid = solid + _grooves(side, y, z)
    solid = carve(solid, mouth_void(side, y, z), 1.0)
    return intersection(solid, -140.0 - y, 14.0)


def eyes(x: Scalar, y: Scalar, z: Scalar) -> Scalar:
    """The two eyeballs, with the flesh of the corners of the eye; negative inside."""
    side = np.absolute(x)
    ball = length(side - EYE[0], y - EYE[1], z - EYE[2]) - EYE_RADIUS
    return union(ball, ellipsoid(side, y, z, (30.5, 10.0, 62.0), (15.2, 7.5, 10.8)), 1.0)


def lip_line(side: Scalar) -> Scalar:
    """The height y at which the closed lips meet, over the distance from the middle."""
    square = np.square(side)
    return -59.0 - 1.1 * np.exp(-square / 30.0) + 0.9 * bell(square, 144.0, 75.0) + 0.0022 * square


def mouth_sheet(side: Scalar, z: Scalar) -> Scalar:
    """The height y of the sheet that parts upper from lower jaw; lower behind the lips, by an overbite."""
    return lip_line(side) - 1.5 - 1.5 * np.tanh((81.5 - 0.016 * np.square(side) - z) / 1.2)


def lid_margins(side: Scalar) -> tuple[Scalar, Scalar]:
    """The heights of the upper and the lower lid's edge above the centre of the eye."""
    t = (side - 30.5) / 14.5
    rest = 1.0 - np.square(t)
    opening = 0.5 * (rest + np.sqrt(np.square(rest) + 0.003))
    return opening * (5.0 - 0.7 * t) + 0.9 * t, 0.9 * t - opening * (4.7 + 0.6 * t)


def hair_region(side: Scalar, y: Scalar, z: Scalar) -> Scalar:
    """The region where the scalp bears hair: negative inside, in mm from the hairline."""
    peak = 4.0 * bump(side, y, z, (0.0, 70.0, 75.0), (14.0, 20.0, 30.0))
    temple = 9.0 * bump(side, y, z, (46.0, 64.0, 58.0), (15.0, 18.0, 22.0))
    crown = 0.75 * (30.0 + 43.0 * ramp(z, 22.0, 84.0) + temple - peak - y)
    sideburn = intersection(intersection(z - 21.0 - 0.15 * (y - 10.0), 8.0 - z, 5.0), -6.0 - y, 6.0)
    behind_ear = z + 34.0 + 0.25 * np.minimum(y - 20.0, 0.0)
    nape = intersection(behind_ear, -62.0 - 0.004 * np.square(side) - y, 20.0)
    return union(union(crown, sideburn, 14.0), nape, 10.0)


def hair_flow(x: Scalar, y: Scalar, z: Scalar) -> tuple[Scalar, Scalar]:
    """Around and away from the whorl at the back of the crown: an angle, and a distance in mm."""
    ahead = 0.85 * (z + 45.0) + 0.53 * (y - 105.0)
    return np.arctan2(x - 9.0, ahead + 0.5), length(x - 9.0, ahead, 0.6 * (y - 105.0))


def hair_thickness(x: Scalar, y: Scalar, z: Scalar) -> Scalar:
    """How far the hair stands off the scalp: locks that run away from the whorl."""
    inside = -hair_region(np.absolute(x), y, z)
    long = ramp(y, 35.0, 100.0)
    angle, away = hair_flow(x, y, z)
    sway = 1.2 * np.sin(0.045 * away + 0.4) + 0.8 * np.sin(0.06 * y - 0.05 * x)
    locks = np.sin(34.0 * angle + 1.6 * sway) + 0.7 * np.sin(55.0 * angle - 2.3 * sway + 0.12 * away)
    locks = locks * ramp(away, 10.0, 45.0) * (0.3 + 0.5 * long)
    return (1.6 + 7.0 * long) * ramp(inside, -2.0, 30.0) + locks * ramp(inside, 0.0, 10.0)


def mouth_void(side: Scalar, y: Scalar, z: Scalar) -> Scalar:
    """The hollow of the mouth and the slit between the lips, less teeth and tongue; negative inside."""
    sheet = mouth_sheet(side, z)
    slit = intersection(np.absolute(y - sheet) - 0.3, intersection(side - 26.0, 60.0 - z, 4.0), 1.0)
    hollow = union(slit, ellipsoid(side, y, z, (0.0, -60.0, 60.0), (27.0, 15.0, 22.5)), 2.0)
    return carve(hollow, union(teeth(side, y, z), tongue(side, y, z), 2.0), 0.8)


def teeth(side: Scalar, y: Scalar, z: Scalar) -> Scalar:
    """The two rows of teeth, the lower one behind the upper one."""
    sheet = mouth_sheet(side, z)
    depth = z - 80.0 + 0.026 * np.square(side)
    gaps = 0.35 * np.exp(-8.0 * np.square(np.sin(0.39 * side)))
    upper = intersection(np.absolute(depth) - 2.2 + gaps, intersection(sheet + 0.6 - y, y + 44.0, 1.0), 1.5)
    lower = intersection(
        np.absolute(depth + 1.0) - 1.9 + gaps, intersection(y - sheet + 0.6, -76.0 - y, 1.0), 1.5
    )
    return intersection(union(upper, lower, 0.3), side - 24.0, 1.0)


def tongue(side: Scalar, y: Scalar, z: Scalar) -> Scalar:
    """The tongue, on the floor of the mouth."""
    return ellipsoid(side, y, z, (0.0, -70.5, 55.0), (17.0, 6.5, 20.0))


def lips_red(side: Scalar, y: Scalar) -> Scalar:
    """The coloured part of the lips, seen from the front; negative inside, in mm."""
    width = np.sqrt(np.maximum(1.0 - np.square(side / 28.0), 0.0))
    above = y - lip_line(side) - 7.3 * width + 1.4 * np.exp(-np.square(side / 3.5)) + 0.3
    below = -59.3 - 8.6 * width - y + 0.3
    return intersection(above, below, 1.0)


def nostril(side: Scalar, y: Scalar, z: Scalar) -> Scalar:
    """The hollow of a nostril."""
    return limb(side, y, z, (5.8, -42.0, 97.0), (5.0, -30.0, 92.0), 2.7, 2.0)


def ear(side: Scalar, y: Scalar, z: Scalar) -> Scalar:
    """An outer ear: plate, rim, lobe, inner fold, tragus and hollow."""
    a, b, c = _ear_frame(side, y, z)
    across = 15.5 + 3.0 * np.tanh(b / 14.0)  # egg-shaped, wide at the top
    rho = length(a / across, b / 31.0)
    plate = intersection((rho - 1.0) * 17.0, np.absolute(c - 0.06 * a) - 1.6, 3.0)
    rim = length((rho - 0.88) * 16.0, c - 2.2) - 3.0 + ramp(-b, 8.0, 20.0)
    solid = union(plate, rim, 3.5)
    solid = union(solid, ellipsoid(a, b, c, (-5.0, -25.0, 1.0), (7.5, 9.0, 4.0)), 5.0)
    fold = length((length((a - 0.5) / 9.0, (b - 2.0) / 19.0) - 0.95) * 11.0, c - 1.6) - 2.0
    solid = union(solid, intersection(fold, -1.0 - a, 5.0), 3.0)
    solid = union(solid, ellipsoid(a, b, c, (-13.5, -4.0, 3.0), (3.2, 6.0, 3.5)), 4.0)
    return carve(solid, ellipsoid(a, b, c, (-5.5, -4.0, 4.4), (6.5, 11.0, 5.0)), 3.5)


def _ear_frame(side: Scalar, y: Scalar, z: Scalar) -> tuple[Scalar, Scalar, Scalar]:
    """Backward, upward and outward from the middle of an ear that stands off and leans back."""
    off, lean = np.radians(17.0), np.radians(12.0)
    cos_off, sin_off, cos_lean, sin_lean = (float(f(v)) for v in (off, lean) for f in (np.cos, np.sin))
    out, back = side - 72.0, -4.0 - z
    backward = back * cos_off + out * sin_off
    return (
        backward * cos_lean - y * sin_lean - 14.0,
        y * cos_lean + backward * sin_lean,
        out * cos_off - back * sin_off,
    )


def _skull_and_neck(x: Scalar, y: Scalar, z: Scalar) -> Scalar:
    p = (np.sqrt(np.square(x) + 36.0), y, z)  # |x|, rounded off where the halves of the jaw meet
    solid = ellipsoid(*p, (0.0, 38.0, -10.0), (73.0, 80.0, 89.0))  # cranium
    solid = union(solid, ellipsoid(*p, (0.0, 46.0, 16.0), (60.0, 52.0, 69.0)), 22.0)  # forehead
    solid = union(solid, ellipsoid(*p, (0.0, -28.0, 17.0), (58.0, 75.0, 66.0)), 28.0)  # face
    solid = union(solid, limb(*p, (44.0, -50.0, 2.0), (12.0, -90.0, 60.0), 11.0, 14.0), 30.0)  # jaw
    solid = union(solid, ellipsoid(*p, (0.0, -89.0, 66.0), (17.0, 14.0, 20.0)), 18.0)  # chin
    solid = union(solid, limb(*p, (33.0, -17.0, 60.0), (56.0, -4.0, 22.0), 12.0, 7.0), 24.0)  # cheekbone
    solid = union(solid, ellipsoid(*p, (35.0, -38.0, 36.0), (20.5, 35.0, 28.0)), 22.0)  # cheek
    solid = union(solid, ellipsoid(*p, (0.0, -53.0, 58.0), (32.0, 27.0, 31.0)), 18.0)  # round the teeth
    neck = limb(*p, (0.0, -40.0, -24.0), (0.0, -175.0, -40.0), 44.0, 50.0)
    neck = union(neck, limb(*p, (42.0, -50.0, -26.0), (11.0, -168.0, 8.0), 8.0, 8.0), 22.0)  # tendon
    neck = union(neck, ellipsoid(*p, (0.0, -190.0, -46.0), (120.0, 46.0, 58.0)), 44.0)  # shoulders begin
    return union(solid, neck, 24.0)


def _brow_ridge(solid: Scalar, side: Scalar, y: Scalar, z: Scalar) -> Scalar:
    square = np.square(side)
    height = 24.5 + 5.0 * square / (square + 900.0)
    depth = 79.5 - 0.0092 * square - 1e-6 * np.square(square)
    ridge = length(y - height, z - depth) - 5.5 + 0.0012 * square + 6e-7 * np.square(square)
    return union(solid, ridge, 20.0)


def _eye_socket(solid: Scalar, side: Scalar, y: Scalar, z: Scalar) -> Scalar:
    solid = carve(solid, ellipsoid(side, y, z, (31.0, 11.0, 84.0), (20.0, 11.5, 15.0)), 17.0)
    solid = union(solid, ellipsoid(side, y, z, (31.0, 10.6, 62.0), (15.8, 13.2, 13.5)), 8.0)  # lids
    crease = bell(y - EYE[1] + 0.022 * np.square(side - 30.0), 9.8, 1.3)
    solid = solid + 0.9 * crease * bell(side, 31.0, 11.0) * bell(z, 72.0, 12.0)
    upper, lower = lid_margins(side)
    height = y - EYE[1]
    gap = intersection(intersection(height - upper, lower - height, 0.5), EYE[2] - z, 1.0)
    gap = intersection(gap, np.absolute(side - 30.5) - 14.5, 0.5)
    return carve(solid, gap, 1.2)


def _nose(solid: Scalar, side: Scalar, y: Scalar, z: Scalar) -> Scalar:
    p = (side, y, z)
    nose = limb(*p, (0.0, 18.0, 76.0), (0.0, -24.0, 97.0), 6.5, 9.0)  # bridge
    nose = union(nose, ellipsoid(*p, (0.0, -28.5, 99.0), (9.8, 9.0, 10.5)), 9.0)  # tip
    nose = union(nose, ellipsoid(*p, (10.3, -33.3, 90.0), (6.3, 6.8, 9.8)), 11.0)  # wings
    nose = union(nose, limb(*p, (0.0, -36.0, 100.0), (0.0, -41.0, 88.0), 4.5, 4.5), 6.0)  # septum
    return carve(union(solid, nose, 13.0), nostril(*p), 2.5)


def _lips(solid: Scalar, side: Scalar, y: Scalar, z: Scalar) -> Scalar:
    square = np.square(side / 27.5)
    taper = 1.0 - square
    front = 92.6 - 0.0145 * np.square(side) - 4.5 * np.square(square)
    upper, lower = 3.7 * taper, 4.6 * taper
    roll = length(y - lip_line(side) - 0.95 * upper, z - front + upper + 1.5) - upper
    solid = union(solid, roll, 6.5)
    roll = length(y + 59.2 + 0.95 * lower, z - front + lower + 2.1) - lower
    return union(solid, roll, 6.5)


def _grooves(side: Scalar, y: Scalar, z: Scalar) -> Scalar:
    """Depths of the groove over the upper lip, the one over the chin, and those from nose to mouth."""
    philtrum = 1.4 * bump(side, y, z, (0.0, -47.5, 95.0), (3.0, 6.0, 10.0))
    chin = 2.0 * bump(side, y, z, (0.0, -78.0, 88.0), (18.0, 5.0, 12.0))
    cheek = bell(y + 1.15 * (side - 24.0), -44.0, 4.0) * bell(side, 27.0, 9.0) * bell(z, 80.0, 16.0)
    return philtrum + chin + cheek

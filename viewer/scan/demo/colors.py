"""The colours of the demo subject, as a texture camera would see them in even light."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import head
from .shapes import bell, bump, ellipsoid, ramp

_GRAIN_SEED = 4  # of the faint grain of a camera
_LATTICE = np.random.default_rng(7).random((32, 32, 32))


def albedo(points: NDArray[np.float64], normals: NDArray[np.float64], skin: int) -> NDArray[np.float64]:
    """sRGB colours 0..1, (N, 3), of points (3, N): the first `skin` on skin, the others on eyeballs."""
    hidden = 0.75 * occlusion(points, normals) * (1.0 - 0.8 * _lips(points))
    colors = _mouth(_blend(_skin(points), (0.10, 0.05, 0.04), hidden), points)
    colors[skin:] = _eyeball(points[:, skin:])
    rng = np.random.default_rng(_GRAIN_SEED)
    grain = rng.normal(0.0, 0.012, (len(colors), 1)) + rng.normal(0.0, 0.006, colors.shape)
    return np.clip(colors * (1.0 + grain), 0.0, 1.0)


def occlusion(points: NDArray[np.float64], normals: NDArray[np.float64]) -> NDArray[np.float64]:
    """How much of the sky nearby surface hides, about 0..1, from distances to it along the normal.

    Evans 2006, "Fast approximations for global illumination on dynamic scenes".
    """
    hidden = np.zeros_like(points[0])
    for reach, share in ((1.5, 0.4), (4.0, 0.35), (10.0, 0.25)):
        away = points + reach * normals
        clearance = np.minimum(head.skin(*away), head.eyes(*away))
        hidden += share * np.clip(1.0 - clearance / reach, 0.0, 1.0)
    return hidden


def _skin(p: NDArray[np.float64]) -> NDArray[np.float64]:
    x, (side, y, z) = p[0], (np.abs(p[0]), p[1], p[2])
    colors = np.full((len(x), 3), (0.83, 0.645, 0.55))
    colors = _blend(colors, (0.845, 0.67, 0.56), 0.8 * ramp(y, 20.0, 60.0))  # forehead
    colors = _blend(
        colors, (0.79, 0.52, 0.455), 0.5 * bump(side, y, z, (40.0, -20.0, 65.0), (15.0, 13.0, 30.0))
    )
    colors = _blend(
        colors, (0.78, 0.51, 0.445), 0.35 * bump(side, y, z, (0.0, -30.0, 104.0), (13.0, 9.0, 14.0))
    )
    colors = _blend(colors, (0.66, 0.47, 0.43), 0.3 * bump(side, y, z, (30.0, 4.0, 75.0), (15.0, 9.0, 15.0)))
    colors = _blend(colors, (0.79, 0.52, 0.455), 0.5 * ramp(-head.ear(side, y, z), -1.5, 0.5))
    colors = _blend(
        colors, (0.69, 0.55, 0.49), 0.4 * ramp(-y, 50.0, 78.0) * ramp(z, 0.0, 40.0)
    )  # beard shadow
    mottle = 0.5 * noise(p, 14.0) + 0.3 * noise(p, 5.0) + 0.35 * noise(p, 1.6) - 0.575
    colors = colors * (1.0 + 0.11 * mottle[:, None] * (1.0, 1.25, 1.3))
    colors = _blend(colors, (0.71, 0.44, 0.42), 0.85 * _lips(p))
    colors = _blend(colors, (0.22, 0.15, 0.11), _brow(p))
    hair = np.array((0.19, 0.13, 0.09)) + _strands(p)[:, None] * (0.24, 0.175, 0.115)
    edge = 2.5 * noise(p, 2.2) - 1.2
    scalp = ramp(edge - head.hair_region(side, y, z), -2.5, 4.0) * ramp(head.ear(side, y, z), 0.5, 2.5)
    colors = _blend(colors, hair, scalp)
    upper, lower = head.lid_margins(side)
    height = y - head.EYE[1]
    rim = (np.abs(side - 30.5) < 15.3) & (z > 62.0) & (head.eyes(side, y, z) < 2.2)
    rim = rim * ramp(-np.abs(side - 30.5), -14.3, -11.0)
    lashes = 0.95 * ramp(-np.abs(height - upper - 0.1), -1.3, -0.4) + 0.5 * ramp(
        -np.abs(height - lower + 0.1), -0.9, -0.2
    )
    colors = _blend(colors, (0.17, 0.11, 0.09), rim * lashes)
    return _blend(colors, (0.20, 0.09, 0.08), ramp(-head.nostril(side, y, z), -0.9, 0.3))


def _lips(p: NDArray[np.float64]) -> NDArray[np.float64]:
    """How much of the red of the lips points (3, N) have, 0..1, (N,)."""
    return ramp(-head.lips_red(np.abs(p[0]), p[1]), -0.7, 2.2) * (p[2] > 70.0)


def _brow(p: NDArray[np.float64]) -> NDArray[np.float64]:
    """How thickly the eyebrows cover the skin, 0..1, (N,)."""
    side, y, z = np.abs(p[0]), p[1], p[2]
    middle = 26.3 + 6.0 * np.sin((side - 9.0) / 17.3)
    half = 3.4 * ramp(side, 7.0, 15.0) * (1.0 - 0.8 * ramp(side, 24.0, 49.0))
    hairs = noise(np.stack([p[0] - np.sign(p[0]) * 0.55 * y, 0.25 * y, 0.2 * z]), 1.1)
    inside = ramp(half - np.abs(y - middle) + 1.4 * (hairs - 0.5), -1.0, 1.2)
    return inside * (0.5 + 0.45 * hairs) * (z > 30.0) * (side < 50.0) * (side > 7.0)


def _strands(p: NDArray[np.float64]) -> NDArray[np.float64]:
    """How light the hair is, 0..1, (N,): streaks along its flow."""
    angle, away = head.hair_flow(*p)
    around = np.stack([55.0 * np.cos(angle), 55.0 * np.sin(angle), 0.05 * away])
    return 0.55 * noise(around, 1.3) + 0.45 * noise(around + 9.0, 3.5)


def _mouth(colors: NDArray[np.float64], p: NDArray[np.float64]) -> NDArray[np.float64]:
    """Colours with those of the inside of the mouth, which gets darker towards the throat."""
    side, y, z = np.abs(p[0]), p[1], p[2]
    front = 93.0 - 0.0155 * np.square(side)
    inside = ramp(front - z, 7.0, 10.0) * (
        ellipsoid(side, y, z, (0.0, -60.0, 60.0), (29.0, 17.0, 24.5)) < 0.0
    )
    flesh = _blend(np.full_like(colors, (0.46, 0.17, 0.16)), (0.17, 0.055, 0.05), ramp(-z, -76.0, -50.0))
    flesh = _blend(
        flesh, (0.60, 0.30, 0.29), ramp(-head.tongue(side, y, z), -0.9, -0.2) * ramp(z, 40.0, 70.0)
    )
    gaps = np.exp(-20.0 * np.square(np.sin(0.39 * side)))
    enamel = np.array((0.89, 0.855, 0.78)) * (1.0 - 0.3 * gaps - 0.4 * ramp(-z, -78.0, -62.0))[:, None]
    flesh = _blend(
        flesh, enamel, ramp(-head.teeth(side, y, z), -0.6, -0.2) * ramp(12.0 - np.abs(y + 61.0), 0.0, 1.0)
    )
    moist = (
        ramp(front - z, 1.5, 6.0)
        * ramp(-np.abs(y - head.mouth_sheet(side, z)), -3.0, -0.8)
        * ramp(-side, -27.0, -22.0)
        * (z > 60.0)
    )
    colors = _blend(colors, (0.52, 0.26, 0.25), moist)
    return _blend(colors, flesh, inside)


def _eyeball(p: NDArray[np.float64]) -> NDArray[np.float64]:
    """White, iris and pupil, with the glint of a lamp."""
    across, up = np.sign(p[0]) * (np.abs(p[0]) - head.EYE[0]), p[1] - head.EYE[1]
    inward = np.abs(p[0]) - head.EYE[0] + 0.2
    radius = np.hypot(inward, up)
    white = _blend(
        np.full((p.shape[1], 3), (0.87, 0.845, 0.82)), (0.78, 0.56, 0.52), ramp(np.abs(inward), 7.0, 13.0)
    )
    spokes = 0.16 * np.sin(23.0 * np.arctan2(up, inward)) * ramp(radius, 2.0, 4.0) + 0.25 * bell(
        radius, 3.2, 0.7
    )
    iris = _blend(
        np.array((0.33, 0.43, 0.48)) * (1.0 + spokes)[:, None], (0.10, 0.12, 0.14), ramp(radius, 4.5, 5.6)
    )
    colors = _blend(white, iris, ramp(-radius, -5.8, -5.2))
    colors = _blend(colors, (0.02, 0.02, 0.025), ramp(-radius, -2.8, -2.2))
    upper, lower = head.lid_margins(np.abs(p[0]))
    colors = _blend(
        colors, (0.66, 0.45, 0.41), 0.85 * ramp(lower + 1.1 - up, -0.3, 0.3)
    )  # rim of the lower lid
    colors = _blend(colors, (0.0, 0.0, 0.0), 0.45 * ramp(up - upper, -3.0, 0.3))  # shade of the lid
    return _blend(colors, (1.0, 1.0, 1.0), ramp(-np.hypot(across + 1.9, up - 2.0), -1.4, -0.7))


def noise(p: NDArray[np.float64], size: float) -> NDArray[np.float64]:
    """Smooth random values 0..1, (N,), with features of about `size` mm at points (3, N).

    Value noise on a cubic lattice that repeats every 32 cells (Ebert et al., Texturing and
    Modeling, ch. 2).
    """
    scaled = p / size
    cell = np.floor(scaled).astype(int)
    part = ramp(scaled - cell, 0.0, 1.0)
    total = np.zeros(p.shape[1])
    for corner in np.ndindex(2, 2, 2):
        i, j, k = (cell + np.array(corner)[:, None]) % 32
        weight = np.where(np.array(corner)[:, None] == 1, part, 1.0 - part).prod(axis=0)
        total += weight * _LATTICE[i, j, k]
    return total


def _blend(colors: NDArray[np.float64], other: ArrayLike, share: NDArray[np.float64]) -> NDArray[np.float64]:
    """Colours (N, 3) mixed with others by shares (N,), 0..1."""
    return colors + (np.asarray(other) - colors) * np.clip(share, 0.0, 1.0)[:, None]

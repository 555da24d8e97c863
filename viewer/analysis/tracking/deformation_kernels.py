"""Loops over the places of a reference frame that a body carries, compiled by numba; see `deformation`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...compiled import compiled
from .robust_kernels import tukey_weight
from .surface_kernels import Cells, fit_at, nearest_within, parabola_height, parabola_slopes

Float = NDArray[np.float64]

_FACING = (
    0.5  # cosine of the angle between the normals of a place and of the surface that it is compared with
)
_KNOWN = 4.0  # weight of places whose points recur, against those that only lie on the surface


class CarriedPlaces(NamedTuple):
    """P places of the reference frame and the k nodes of a body around each (embedded deformation: Sumner,
    Schmid and Pauly 2007)."""

    nodes: NDArray[np.int32]  # (P, k)
    weights: Float  # (P, k), their sum 1
    offsets: Float  # (P, k, 3), from each node, at rest
    normals: Float  # (P, 3), at rest
    colors: Float  # (P, C)


class PlaceMatches(NamedTuple):
    """The surface of a frame beside P carried places; `match_places` fills the arrays."""

    places: Float  # (P, 3), where they are carried to
    rows: NDArray[np.int64]  # (P,), of the nearest points of the frame, or -1
    is_matched: NDArray[np.bool_]  # (P,), whether a surface is there that faces as the place does
    off: Float  # (P,), distances above the surface
    normals: Float  # (P, 3), of the surface
    colors: Float  # (P, C), of the surface less those of the place
    slopes: Float  # (P, C, 3), of the surface's colours, along it


@compiled
def carry_places(
    held: CarriedPlaces, positions: Float, turns: Float, first: int, last: int, places: Float
) -> None:
    """Fill the places (P, 3) from first to last - 1 as nodes at positions (N, 3) carry them, turned by (N, 3,
    3)."""
    for i in range(first, last):
        x, y, z = 0.0, 0.0, 0.0
        for j in range(held.nodes.shape[1]):
            n, weight, arm = held.nodes[i, j], held.weights[i, j], held.offsets[i, j]
            r = turns[n]
            x += weight * (positions[n, 0] + r[0, 0] * arm[0] + r[0, 1] * arm[1] + r[0, 2] * arm[2])
            y += weight * (positions[n, 1] + r[1, 0] * arm[0] + r[1, 1] * arm[1] + r[1, 2] * arm[2])
            z += weight * (positions[n, 2] + r[2, 0] * arm[0] + r[2, 1] * arm[1] + r[2, 2] * arm[2])
        places[i, 0], places[i, 1], places[i, 2] = x, y, z


@compiled
def find_beside(surface: Cells, reach: float, first: int, last: int, found: PlaceMatches) -> None:
    """Find the points of a frame that are nearest to places, within reach."""
    for i in range(first, last):
        x, y, z = found.places[i, 0], found.places[i, 1], found.places[i, 2]
        found.rows[i] = nearest_within(surface, x, y, z, reach)


@compiled
def fit_rows(
    surface: Cells, rows: NDArray[np.int64], points: Float, normals: Float, fitted: NDArray[np.bool_]
) -> None:
    """Fit the surface at rows (n,): fills points (n, 3), moved onto it, its normals (n, 3), and whether there
    is one, (n,)."""
    normal = np.empty(3)
    for i in range(len(rows)):
        row = rows[i]
        fitted[i] = fit_at(surface, row)
        if not fitted[i]:
            continue
        f, p = surface.frames[row], surface.parabolas[row]
        squared = 0.0
        for k in range(3):
            points[i, k] = surface.points[row, k] + p[0, 0] * f[2, k]
            normal[k] = f[2, k] - p[0, 1] * f[0, k] - p[0, 2] * f[1, k]
            squared += normal[k] * normal[k]
        for k in range(3):
            normals[i, k] = normal[k] / np.sqrt(squared)


@compiled
def fit_surface(surface: Cells, rows: NDArray[np.int64], first: int, last: int) -> None:
    """Fit the surface at some of the rows; no other thread may fit the same ones."""
    for i in range(first, last):
        fit_at(surface, rows[i])


@compiled
def match_places(
    surface: Cells, held: CarriedPlaces, turns: Float, first: int, last: int, found: PlaceMatches
) -> None:
    """Compare places with the surface at the rows that are nearest, which is fitted there already."""
    channels = found.colors.shape[1]
    normal = np.empty(3)
    for i in range(first, last):
        found.is_matched[i] = False
        row = found.rows[i]
        if row < 0 or surface.state[row] <= 0:
            continue
        f, p = surface.frames[row], surface.parabolas[row]
        u, v, w = 0.0, 0.0, 0.0
        for k in range(3):
            away = found.places[i, k] - surface.points[row, k]
            u += f[0, k] * away
            v += f[1, k] * away
            w += f[2, k] * away
        if u * u + v * v > surface.reaches[row] ** 2:
            continue
        along_u, along_v = parabola_slopes(p[0], u, v)
        length = np.sqrt(1.0 + along_u * along_u + along_v * along_v)
        for k in range(3):
            normal[k] = (f[2, k] - along_u * f[0, k] - along_v * f[1, k]) / length
        cosine, squared = 0.0, 0.0
        for k in range(3):
            turned = 0.0
            for j in range(held.nodes.shape[1]):
                r, weight = turns[held.nodes[i, j]], held.weights[i, j]
                for q in range(3):
                    turned += weight * r[k, q] * held.normals[i, q]
            cosine += turned * normal[k]
            squared += turned * turned
        facing = cosine if len(surface.normals) > 0 else abs(cosine)
        if facing < _FACING * np.sqrt(squared) or not squared > 0.0:
            continue
        found.is_matched[i] = True
        found.off[i] = (w - parabola_height(p[0], u, v)) / length
        for k in range(3):
            found.normals[i, k] = normal[k]
        for c in range(channels):
            found.colors[i, c] = parabola_height(p[1 + c], u, v) - held.colors[i, c]
            along_u, along_v = parabola_slopes(p[1 + c], u, v)
            for k in range(3):
                found.slopes[i, c, k] = along_u * f[0, k] + along_v * f[1, k]


class PullScales(NamedTuple):
    """The deviations by which pulls are weighed."""

    off: float  # standard deviation of distances, scan units
    colors: Float  # (C,), the same of colours
    shifts: Float  # (C,), medians of colours


@compiled
def gather_pulls(
    held: CarriedPlaces,
    found: PlaceMatches,
    known: Float,
    scales: PullScales,
    loose: float,
    pulls: Float,
    pushes: Float,
) -> None:
    """Fill pulls (N, 3, 3), the weights with which places draw nodes, and pushes (N, 3), weights times ways.

    known: (P, 3), where places are known to be, NaN elsewhere. loose: see `deformation`. A place draws each
    of its nodes by its share: that bounds the squared distance from above (Jensen), so each step lowers the
    sum.
    """
    pulls[:], pushes[:] = 0.0, 0.0
    one, way = np.empty((3, 3)), np.empty(3)
    for i in range(len(found.rows)):
        if not np.isnan(known[i, 0]):
            one[:] = 0.0
            for k in range(3):
                one[k, k] = _KNOWN
                way[k] = _KNOWN * (known[i, k] - found.places[i, k])
        elif found.is_matched[i]:
            weight = tukey_weight(found.off[i], loose * scales.off)
            for k in range(3):
                way[k] = -weight * found.off[i] * found.normals[i, k]
                for q in range(3):
                    one[k, q] = weight * found.normals[i, k] * found.normals[i, q]
            for c in range(found.colors.shape[1]):
                residual = found.colors[i, c] - scales.shifts[c]
                weight = (
                    tukey_weight(residual, loose * scales.colors[c]) * (scales.off / scales.colors[c]) ** 2
                )
                for k in range(3):
                    way[k] -= weight * residual * found.slopes[i, c, k]
                    for q in range(3):
                        one[k, q] += weight * found.slopes[i, c, k] * found.slopes[i, c, q]
        else:
            continue
        for j in range(held.nodes.shape[1]):
            n, share = held.nodes[i, j], held.weights[i, j]
            for k in range(3):
                pushes[n, k] += share * way[k]
                for q in range(3):
                    pulls[n, k, q] += share * one[k, q]

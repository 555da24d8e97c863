"""Deferred blending on the CPU: groups of discs that do not overlap, their layers, and how these blend."""

from __future__ import annotations

from typing import Any

import numpy as np

from experiments.farooq_2013.pull_push_kernels import CELL, STEEPEST, place
from viewer.compiled import compiled

_FALL = np.float32(-2)  # exponent of a weight at the edge of a disc
_EMPTY = np.float32(np.inf)


@compiled
def assign(starts: Any, neighbours: Any, groups: Any) -> int:
    """Give each disc the first group that none of its neighbours has; the number of groups, 64 at most, or
    -1 where more are needed. starts, neighbours: those of disc i from starts[i] to starts[i + 1]. groups:
    (N,), -1."""
    count = 0
    for i in range(len(groups)):
        taken = np.uint64(0)
        for n in range(starts[i], starts[i + 1]):
            if groups[neighbours[n]] >= 0:
                taken |= np.uint64(1) << np.uint64(groups[neighbours[n]])
        group = 0
        while group < 64 and (taken >> np.uint64(group)) & np.uint64(1):
            group += 1
        if group == 64:
            return -1
        groups[i] = group
        count = max(count, group + 1)
    return count


@compiled
def draw_layers(points: Any, groups: Any, view: Any, size: Any, depths: Any, weights: Any, rows: Any) -> None:
    """Draw each group into its layer, nearest first, by the plane of each disc. depths, infinite before,
    weights, rows: (groups, height * width)."""
    width, height = size
    disc = np.empty(CELL, np.float32)
    for i in range(len(points)):
        if not place(points[i], view, disc):
            continue
        x, y, reach, group = disc[2], disc[3], disc[4], groups[i]
        for row in range(max(int(y - reach), 0), min(int(y + reach) + 1, height)):
            for column in range(max(int(x - reach), 0), min(int(x + reach) + 1, width)):
                right, down = np.float32(column) + np.float32(0.5) - x, np.float32(row) + np.float32(0.5) - y
                away = (disc[5] * right + disc[6] * down) / max(disc[7], STEEPEST)
                share = (right * right + down * down + away * away) / (reach * reach)
                depth = disc[0] + away * points[i, 9] / reach
                pixel = row * width + column
                if share <= 1 and depth < depths[group, pixel]:
                    depths[group, pixel] = depth
                    weights[group, pixel] = np.exp(_FALL * share)
                    rows[group, pixel] = i


@compiled
def blend(points: Any, view: Any, depths: Any, weights: Any, rows: Any, cells: Any) -> None:
    """Blend what the layers show of each pixel, up to a radius behind the nearest."""
    disc = np.empty(CELL, np.float32)
    for pixel in range(len(cells)):
        nearest = 0
        for group in range(1, len(depths)):
            if depths[group, pixel] < depths[nearest, pixel]:
                nearest = group
        near = depths[nearest, pixel]
        cell = cells[pixel]
        cell[0] = near
        if near == _EMPTY:
            continue
        far = near + points[rows[nearest, pixel], 9]
        cell[1:] = 0
        total = np.float32(0)
        for group in range(len(depths)):
            if depths[group, pixel] <= far:
                weight = weights[group, pixel]
                place(points[rows[group, pixel]], view, disc)
                for k in range(5, 11):
                    cell[k] += weight * disc[k]
                cell[11] += weight * depths[group, pixel]
                total += weight
        for k in range(5, CELL):
            cell[k] /= total
        cell[1] = far

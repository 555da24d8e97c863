"""Clouds that experiments draw."""

from __future__ import annotations

import numpy as np

from viewer.scan.points import PointCloud

ORDERS = ("random", "scan")


def dented_sphere(count: int, seed: int = 0) -> PointCloud:
    """A dented sphere, `count` points in random order, coloured by position."""
    rng = np.random.default_rng(seed)
    points = rng.standard_normal((count, 3), dtype=np.float32)
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    points *= 1 + 0.15 * np.sin(7 * points[:, :1]) * np.cos(5 * points[:, 1:2])
    return PointCloud.from_arrays(points, colors=np.clip(points * 0.4 + 0.5, 0, 1), origin=np.zeros(3))


def even_sphere(count: int, order: str) -> PointCloud:
    """Even points of a unit sphere, with radii of 1.5 times the spacing. order: random, or columns of equal
    azimuth, top to bottom, as a scanner has them."""
    i = np.arange(count) + 0.5
    polar, turn = np.arccos(1 - 2 * i / count), np.pi * (1 + 5**0.5) * i
    points = np.stack([np.cos(turn) * np.sin(polar), np.cos(polar), np.sin(turn) * np.sin(polar)], axis=1)
    spacing = (4 * np.pi / count) ** 0.5
    if order == "scan":
        column = np.floor(np.arctan2(points[:, 2], points[:, 0]) / spacing)
        points = points[np.lexsort((points[:, 1], column))]
    else:
        points = np.random.default_rng(1).permutation(points)
    return PointCloud.from_arrays(points, normals=points, radii=np.full(count, 1.5 * spacing))

"""Which triangles cover which places, and masks under which no place loses its last one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from covering import bumpy_ball, scanned

from viewer.mesh.merging.covering import TriangleCover
from viewer.mesh.merging.surfaces import RangeSurface
from viewer.mesh.range_mesh import replacements_of, triangles_of
from viewer.scan.range_view import RangeView
from viewer.simulate.scanner import Faults

WITHIN = 0.03


@pytest.fixture(scope="module")
def views() -> tuple[RangeView, ...]:
    return scanned(bumpy_ball(60), (40, 30), Faults(noise=0.004), Faults(noise=0.004))


def covering_of(views: tuple[RangeView, ...]) -> TriangleCover:
    scatter = np.full(len(views), WITHIN)
    return TriangleCover([RangeSurface.of(view) for view in views], scatter, WITHIN, spaced=False)


def test_covers_are_what_each_line_meets(views: tuple[RangeView, ...]) -> None:
    covering = covering_of(views)
    surfaces = [RangeSurface.of(view) for view in views]
    points = np.concatenate([surface.points for surface in surfaces])
    normals = np.concatenate([surface.normals for surface in surfaces]).astype(np.float64)
    first, places = covering.covers
    # The places of a triangle in the order of `find_covers`, by the definition in `TriangleCover`.
    grid = np.array([(0, 0, 2), (0, 1, 1), (0, 2, 0), (1, 0, 1), (1, 1, 0), (2, 0, 0)])
    shares = 0.7 * grid / 2 + 0.1
    hosts = covering.faces[covering.shown]
    position = (shares @ points[hosts]).reshape(-1, 3)
    normal = (shares @ normals[hosts]).reshape(-1, 3)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    met = 0
    for face in range(0, len(covering.faces), 97):
        a, b, c = points[covering.faces[face]]
        sides = np.stack([np.cross(normal, c - a), np.cross(position - a, b - a)])
        whole = sides[0] @ (b - a)
        second = ((position - a) * sides[0]).sum(axis=1) / whole
        third = (normal * sides[1]).sum(axis=1) / whole
        along = sides[1] @ (c - a) / whole
        same_side = normal @ normals[covering.faces[face]].sum(axis=0) > 0
        inside = (second >= 0) & (third >= 0) & (second + third <= 1)
        expected = np.flatnonzero(inside & (np.abs(along) <= WITHIN) & same_side)
        assert set(places[first[face] : first[face + 1]]) == set(expected)
        met += len(expected)
    assert met > 100


def test_no_place_loses_its_last_triangle(views: tuple[RangeView, ...]) -> None:
    covering = covering_of(views)
    area = covering.shared_area(covering.shown)
    every = np.ones(len(covering.kept), bool)
    covering.mask(np.zeros(len(every)), ~every, every)
    first, places = covering.covers
    covered = np.zeros(int(places.max()) + 1, bool)
    for face in np.flatnonzero(covering.shown):
        covered[places[first[face] : first[face + 1]]] = True
    assert covered[places].all()
    assert covering.shared_area(covering.shown) < 0.3 * area


def test_exchanges_make_less_overlap(views: tuple[RangeView, ...]) -> None:
    shared = []
    for good in (False, True):
        covering = covering_of(views)
        every = np.ones(len(covering.kept), bool)
        weights = np.random.default_rng(0).random(len(every))  # a seam everywhere
        covering.mask(weights, ~every, every & good)
        shared.append(covering.shared_area(covering.shown))
    assert shared[1] < 0.7 * shared[0]


def test_shown_are_the_triangles_of_the_masked_views(views: tuple[RangeView, ...]) -> None:
    covering = covering_of(views)
    every = np.ones(len(covering.kept), bool)
    covering.mask(np.arange(len(every), dtype=float), ~every, every)
    expected = set()
    for view, own in zip(views, covering.own, strict=True):
        surface, kept = RangeSurface.of(view), covering.kept[own]
        rows = np.flatnonzero(kept) + own.start
        left = triangles_of(replace(view, mask=surface.on_grid(kept)))
        expected |= {frozenset(face) for face in rows[left].tolist()}
    assert {frozenset(face) for face in covering.faces[covering.shown].tolist()} == expected
    assert len(expected) == np.count_nonzero(covering.shown)


def test_fixed_pixels_stay(views: tuple[RangeView, ...]) -> None:
    covering = covering_of(views)
    every = np.ones(len(covering.kept), bool)
    covering.mask(np.zeros(len(every)), every, every)
    assert covering.kept.all()


def test_a_masked_corner_leaves_the_triangle_of_the_others() -> None:
    view = RangeView(
        depth=np.ones((2, 2), np.float32), mask=np.ones((2, 2), bool), fx=2, fy=2, cx=1, cy=1,
        world_to_camera=np.eye(4), name="quad",
    )  # fmt: skip
    given = triangles_of(view)
    faces, pixels = replacements_of(view)
    assert len(given) == len(faces) == 2
    for face, pixel in zip(faces, pixels, strict=True):
        mask = np.ones(4, bool)
        mask[pixel] = False
        (left,) = triangles_of(replace(view, mask=mask.reshape(2, 2)))
        assert set(np.flatnonzero(mask)[left]) == set(face)

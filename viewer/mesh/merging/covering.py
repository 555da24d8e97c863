"""Which triangles of several range views lie over each other, and which pixels can be masked so that no place
that a view has measured loses its last triangle.

As in zippered meshes (Turk and Levoy 1994), what is redundant goes until the rest just covers
the surface. Here it is pixels that go: a mask cannot cut triangles.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...task import checkpoint
from ..range_mesh import replacements_of
from ..scene import Rays
from .surfaces import RangeSurface

if TYPE_CHECKING:
    from .covering_kernels import Lists, TriangleCells

_PLACES_AT_ONCE = 1 << 17
_PIXELS_AT_ONCE = 1 << 16
_EXCHANGES_AT_ONCE = 1 << 12
_RINGS = (0, 1, 2, 3, 4) * 4  # around a pixel, that are exchanged with it, time after time
_LEAST = 1e-12  # of the area: what an exchange has to save
_MOST_CELLS = 16  # of space in which a triangle lies, on average
_FINEST = 6  # parts of an edge in which what covers a triangle is looked at, at most
_INSET = 0.7  # of a triangle, in which that is: a sliver along its edge brings back none


class TriangleCover:
    """The triangles of range views, and which of them cover which places.

    Places are spread over the triangles of all views. A triangle covers a place if the line along the
    surface's normal there meets it no farther away than the scatter of the place's view and the spacing of
    its samples, nor than a limit, and if its normals are to the same side.

    own: for each view, the slice of its points among those of all views, V. faces: (F, 3), their rows: the
    triangles that masks may show. shown: (F,), those that they show. kept: (V,), the points not masked.
    covers: for each triangle, the places that it covers. area: of all surface, each patch once, scan units
    squared.
    """

    def __init__(
        self,
        surfaces: Sequence[RangeSurface],
        scatter: NDArray[np.float64],
        limit: float,
        spaced: bool = True,
    ) -> None:
        """scatter: (views,), and limit, scan units. spaced: whether the spacing counts."""
        from .covering_kernels import TriangleCells, sort_into_cells

        ends = np.cumsum([0, *(len(surface.points) for surface in surfaces)])
        self.own = [slice(*pair) for pair in pairwise(ends)]
        replacements = [replacements_of(surface.view) for surface in surfaces]
        faces = [surface.faces for surface in surfaces] + [corners for corners, _ in replacements]
        before = np.tile(ends[:-1], 2).astype(np.uint32)
        self.faces = np.concatenate([each + rows for each, rows in zip(faces, before, strict=True)])
        self._replaced = np.concatenate(
            [pixels + rows for (_, pixels), rows in zip(replacements, before, strict=False)]
        )
        self._view = np.repeat(np.tile(np.arange(len(surfaces)), 2), [len(each) for each in faces])
        self.kept = np.ones(ends[-1], bool)
        self.shown = np.arange(len(self.faces)) < len(self.faces) - len(self._replaced)

        spacing = [surface.spacing(surface.points, surface.normals) for surface in surfaces]
        within = [own * spaced + far for own, far in zip(spacing, scatter, strict=True)]
        points = np.concatenate([surface.points for surface in surfaces])
        edge = float(np.median(np.concatenate(spacing)))
        boxes = np.ptp(points[self.faces], axis=1)
        while np.prod(boxes / edge + 1, axis=1).sum() > _MOST_CELLS * len(self.faces):
            edge *= 2
        triangles = TriangleCells(
            points,
            np.concatenate([surface.normals for surface in surfaces]),
            np.minimum(np.concatenate(within), limit),
            self.faces,
            edge,
            _lists(np.zeros(1, np.int64)),
        )
        at = np.zeros(4 << len(self.faces).bit_length(), np.int64)
        sort_into_cells(triangles, at)
        triangles = triangles._replace(cells=_lists(at))
        sort_into_cells(triangles, triangles.cells.first[:-1].copy())

        typical = np.array([np.median(each) for each in spacing])
        parts = np.clip(np.rint(2 * typical / typical.min()), 2, _FINEST).astype(int)
        shares = [_shares(each) for each in parts]
        areas = [
            np.repeat(surface.face_areas() / len(own), len(own))
            for surface, own in zip(surfaces, shares, strict=True)
        ]
        self._patches = np.concatenate(areas)
        self.covers = _inverted(self._search(triangles, shares), len(self.faces))
        self._patches /= np.maximum(self._times(self.shown), 1)
        self.area = float(self._patches.sum())

    def shared_area(self, shown: NDArray[np.bool_]) -> float:
        """The area, each patch once, that these triangles (F,) of several views cover."""
        return float(self._patches[self._times(shown) > 1].sum())

    def mask(self, weights: NDArray[np.float64], fixed: NDArray[np.bool_], good: NDArray[np.bool_]) -> None:
        """Mask the pixels that no place needs to keep a triangle, those of the lowest weights (V,) first.

        Then exchange kept pixels for masked ones where less lies over each other so.

        fixed: (V,), pixels that stay all the same. good: (V,), those that others may be exchanged for.
        """
        from .covering_kernels import Exchanged, Masking, count_shown, exchange, mask_unneeded

        rows, pixels = np.arange(len(self.faces), dtype=np.uint32), len(self.kept)
        measured = len(rows) - len(self._replaced)
        per_face = np.diff(self.covers.first)
        masking = Masking(
            self.faces,
            np.concatenate([np.full(measured, -1), self._replaced.astype(np.int64)]),
            _inverted([(self.faces.ravel(), np.repeat(rows, 3))], pixels),
            _inverted([(self._replaced, rows[measured:])], pixels),
            self.covers,
            _inverted([(self.covers.numbers, np.repeat(rows, per_face))], len(self._patches)),
            self._patches,
            np.zeros(len(self._patches), np.int32),
            self.shown,
            self.kept,
        )
        count_shown(masking)
        order = np.argsort(weights, kind="stable")
        order = order[~fixed[order]]
        for some in np.split(order, range(_PIXELS_AT_ONCE, len(order), _PIXELS_AT_ONCE)):
            checkpoint()
            mask_unneeded(masking, some)
        for rings in _RINGS:
            corners = self.kept[self.faces[:measured]]
            beside = np.zeros(pixels, bool)
            beside[self.faces[:measured][corners.any(axis=1)].ravel()] = True
            choice = Exchanged(weights, fixed, good, np.zeros(pixels, bool))
            seam = order[::-1][(beside & good & ~self.kept)[order[::-1]]]
            for some in np.split(seam, range(_EXCHANGES_AT_ONCE, len(seam), _EXCHANGES_AT_ONCE)):
                checkpoint()
                exchange(masking, some, rings, choice, _LEAST * self.area)

    def _times(self, shown: NDArray[np.bool_]) -> NDArray[np.int32]:
        """The number of views of which one of these triangles, (F,), covers each place, (P,)."""
        from .covering_kernels import count_views

        latest, times = np.full(len(self._patches), -1, np.int32), np.zeros(len(self._patches), np.int32)
        faces = np.argsort(self._view, kind="stable")
        count_views(self.covers, faces[shown[faces]], self._view, latest, times)
        return times

    def _search(self, triangles: TriangleCells, shares: Sequence[Rays]) -> Iterator[tuple[NDArray, NDArray]]:
        """Yield faces, and places on the given ones that they cover: pairs of rows, view after view.

        shares: for each view, (M, 3), those of the corners in the places of each of its faces.
        """
        from .covering_kernels import find_covers

        places, covers = np.empty((2, 8 * _PLACES_AT_ONCE), np.uint32)
        before = 0
        for view, parts in enumerate(shares):
            own, step = np.flatnonzero(self.shown & (self._view == view)), _PLACES_AT_ONCE // len(parts)
            for hosts in np.split(own, range(step, len(own), step)):
                checkpoint()
                while (found := find_covers(triangles, hosts, parts, places, covers)) > len(places):
                    places, covers = np.empty((2, 2 * found), np.uint32)
                yield covers[:found].copy(), places[:found] + np.uint32(before)
                before += len(hosts) * len(parts)


def _lists(counts: NDArray[np.int64]) -> Lists:
    """Lists of so many numbers each, (N,), yet to be filled in."""
    from .covering_kernels import Lists

    first = np.concatenate([[0], np.cumsum(counts)])
    return Lists(first, np.empty(first[-1], np.uint32))


def _inverted(pairs: Iterable[tuple[NDArray, NDArray]], count: int) -> Lists:
    """The numbers of each of `count` keys. pairs: keys and their numbers, (N,) each."""
    from .covering_kernels import fill_lists

    counts, parts = np.zeros(count, np.int64), []
    for keys, numbers in pairs:
        counts += np.bincount(keys, minlength=count)
        parts.append((keys, numbers))
    lists = _lists(counts)
    at = lists.first[:-1].copy()
    while parts:  # each goes once it is filled in
        fill_lists(lists, at, *parts.pop())
    return lists


def _shares(parts: int) -> Rays:
    """The corners' shares in places spread over a triangle, (M, 3)."""
    grid = [(a, b, parts - a - b) for a in range(parts + 1) for b in range(parts + 1 - a)]
    return _INSET * np.array(grid) / parts + (1 - _INSET) / 3

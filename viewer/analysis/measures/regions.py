"""The region that a loop of paths over a patch goes around."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...mesh.cutting import Piece, pieces_along
from ...mesh.geodesic import Line, length_of
from ...mesh.patch import Patch
from .outlines import area_of, crosses_itself, is_within
from .planes import THROUGH, plane_of

NO_PLANE = "the landmarks of the measure lie on a line, so they define no plane"
CROSSES = "the outline crosses itself: check the order of the landmarks"
_NOTHING = "the outline encloses no surface"
_BAG = "the surface within the outline continues behind an opening or a fold"

Vector = NDArray[np.float64]  # (3,)


@dataclass(frozen=True)
class Refused:
    """Why a surface gives no value. reason: in words, with {} for each of the landmarks by number."""

    reason: str
    landmarks: tuple[int, ...] = ()

    def in_words(self, names: Sequence[str]) -> str:
        """The reason with the names of landmarks, (K,)."""
        return self.reason.format(*(names[number % len(names)] for number in self.landmarks))


@dataclass(frozen=True, eq=False)
class Region:
    """The surface within a loop. share: of the area within the loop, as seen across its plane, that has
    surface; the rest is openings."""

    piece: Piece
    share: float


def region_within(patch: Patch, lines: Sequence[Line], lids: int) -> Region | Refused:
    """The piece of a patch that lines go around, each (P, 3), together closed: of those on their sides, what
    lies within them as seen across their plane, without the lids of openings. A reason where they go around
    none. lids: the number of the first face that is a lid.

    By Stokes' theorem a surface has, seen against a normal, the area of its outline less that of its
    openings, however it bends. A piece that goes inwards and is larger than a hemisphere on its outline is a
    bag.
    """
    pieces = pieces_along(patch, lines)
    around = np.concatenate([line[:-1] for line in lines])
    center, normal = plane_of(around, THROUGH)
    if not np.isfinite(normal).all():
        return Refused(NO_PLANE)
    axes = np.linalg.svd(normal[None])[2][1:]
    outline = (around - center) @ axes.T
    if len(pieces) > 2 and crosses_itself(outline):
        return Refused(CROSSES)
    if len(pieces) < 2:
        return Refused(_NOTHING)
    shares = []
    for piece in pieces:
        within = is_within((piece.corners.mean(axis=0) - center) @ axes.T, outline)
        shares.append(float(piece.areas[within].sum() / max(piece.areas.sum(), np.finfo(float).tiny)))
    most = max(shares)
    piece = Piece.joined(
        [piece for piece, share in zip(pieces, shares, strict=True) if share > 0.5 or share == most]
    )
    piece = piece.of_faces(piece.sources < lids)
    if not len(piece.faces):
        return Refused(_NOTHING)
    length = sum(map(length_of, lines))
    if piece.areas.sum() > length**2 / (2 * np.pi) and below(piece, *plane_facing(piece, around)) < 0:
        return Refused(_BAG)
    share = abs(float(across(piece, normal).sum())) / area_of(outline)
    return Region(piece, min(share, 1.0))


def plane_facing(piece: Piece, around: Line) -> tuple[Vector, Vector]:
    """The plane of an outline, (P, 3): a point, and the normal to the side to which the piece faces."""
    center, normal = plane_of(around, THROUGH)
    return center, normal if across(piece, normal).sum() >= 0 else -normal


def across(piece: Piece, normal: Vector) -> NDArray[np.float64]:
    """The areas of faces as seen along a normal, (F,), negative from behind."""
    a, b, c = piece.corners
    seen: NDArray[np.float64] = np.cross(b - a, c - a) @ normal / 2
    return seen


def below(piece: Piece, center: Vector, normal: Vector) -> float:
    """The volume from a plane to a piece, negative where the piece is beneath."""
    heights = (piece.corners.mean(axis=0) - center) @ normal
    return float((heights * across(piece, normal)).sum())

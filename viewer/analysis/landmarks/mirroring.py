"""The plane of symmetry of landmarks, and where a landmark whose mirror image is set would lie.

The plane of a bilateral object is the one for which mirroring pairs onto each other and midline landmarks
onto themselves changes least (Klingenberg, Barluenga and Meyer 2002, object symmetry). For errors that are
the same in all coordinates that is a quadratic form of the plane's normal, so its least eigenvector; pairs
and midline landmarks that are far off, as of a paralysed side, count less (Tukey's biweight).
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ...rigid import Rigid

Positions = Mapping[str, NDArray[np.float64]]

_STEPS = 30  # of the iteration, which ends where weights stay
_BIWEIGHT = 4.685  # standard deviations beyond which an item counts nothing (Holland and Welsch 1977)
_NORMAL = 1.4826  # median of absolute deviations to standard deviation
_DISTINCT = 1e-9  # share of the largest eigenvalue, by which the least has to be less than the next
_ENOUGH = 3  # items besides, by which a plane is found anew for the uncertainty of a proposal
_SIDES = (
    (r"(?i)\b(left|right)\b", {"left": "right", "right": "left"}),
    (r"(?<=[^A-Z])[LR]$", {"l": "r", "r": "l"}),
    (r"^[LR](?=[^A-Za-z])", {"l": "r", "r": "l"}),
    (r"(?i)(?<=[_. -])[lr]$", {"l": "r", "r": "l"}),
    (r"(?i)(left|right)", {"left": "right", "right": "left"}),
)


@dataclass(frozen=True, eq=False)
class MirrorPlane:
    """A plane of symmetry: all x with normal @ x = offset.

    normal: (3,), of length 1. sigma: standard deviation of the coordinates of a landmark about its mirror
    image, scan units: asymmetry and placing; NaN where the landmarks do not tell.
    """

    normal: NDArray[np.float64]
    offset: float
    sigma: float

    def in_frame(self, origin: NDArray[np.float64]) -> MirrorPlane:
        """The plane, relative to an origin (3,)."""
        return replace(self, offset=float(self.offset - self.normal @ origin))

    def moved(self, motion: Rigid) -> MirrorPlane:
        """The plane, moved."""
        normal = motion.rotation @ self.normal
        on_plane = motion.points(self.offset * self.normal)
        return replace(self, normal=normal, offset=float(normal @ on_plane))


@dataclass(frozen=True, eq=False)
class Proposal:
    """A place where a landmark would lie.

    position: (3,) scan units. sigma: standard deviation of each of its coordinates; NaN where not known.
    """

    position: NDArray[np.float64]
    sigma: float


@dataclass(frozen=True, eq=False)
class _Items:
    """Pairs and midline landmarks.

    on: (N, 3), what should lie in the plane. across: (N, 3), what should be at right angles to it, 0 for the
    midline. weights: (N,), of `on`, by the errors of one landmark and of the mean of two.
    """

    on: NDArray[np.float64]
    across: NDArray[np.float64]
    weights: NDArray[np.float64]

    def residuals(self, normal: NDArray[np.float64], offset: float) -> NDArray[np.float64]:
        """(N,) how far each is off symmetry, as standard deviations of a coordinate."""
        beside = self.across - (self.across @ normal)[:, np.newaxis] * normal
        squares = self.weights * (self.on @ normal - offset) ** 2 + (beside**2).sum(axis=1) / 2
        return np.sqrt(squares / np.where(self.across.any(axis=1), 3, 1))


def mirrored(positions: NDArray[np.float64], plane: MirrorPlane) -> NDArray[np.float64]:
    """The mirror images of places, (..., 3)."""
    off = positions @ plane.normal - plane.offset
    return positions - 2 * off[..., np.newaxis] * plane.normal


def mirror_plane(positions: Positions, partners: Mapping[str, str]) -> MirrorPlane | None:
    """The plane of symmetry of landmarks; None where they do not tell one, as one point or a line does not.

    positions: of those that are set, (3,) each. partners: the name of the mirror image of each; one that has
    none, or itself, is of the midline.
    """
    items = _items(positions, partners)
    if items is None:
        return None
    best = _start(items)
    if best is None:
        return None
    robust = np.ones(len(items.on))
    for _ in range(_STEPS):
        before = robust
        residuals = items.residuals(*best)
        scale = _NORMAL * float(np.median(residuals))
        if scale <= _DISTINCT * float(np.ptp(items.on, axis=0).max() + np.abs(items.across).max()):
            robust = (
                residuals <= _BIWEIGHT * scale + np.finfo(np.float64).eps * np.abs(items.on).max()
            ) * 1.0
        else:
            robust = np.maximum(1 - (residuals / (_BIWEIGHT * scale)) ** 2, 0) ** 2
        best = _plane(items, robust) or best
        if np.abs(robust - before).max() < _DISTINCT:
            break
    return MirrorPlane(*best, _sigma(items, best, robust))


def _items(positions: Positions, partners: Mapping[str, str]) -> _Items | None:
    on, across, weights = [], [], []
    for name, place in positions.items():
        partner = partners.get(name) or name
        if partner == name:
            on.append(place)
            across.append(np.zeros(3))
            weights.append(1.0)
        elif partner in positions and name < partner:
            on.append((place + positions[partner]) / 2)
            across.append(place - positions[partner])
            weights.append(2.0)
    return _Items(np.array(on), np.array(across), np.array(weights)) if on else None


def _plane(items: _Items, robust: NDArray[np.float64]) -> tuple[NDArray[np.float64], float] | None:
    """The plane of least squares, None where several are as good."""
    weights = items.weights * robust
    if not weights.any():
        return None
    center = weights @ items.on / weights.sum()
    off = items.on - center
    form = (weights * off.T) @ off - (robust / 2 * items.across.T) @ items.across
    values, vectors = np.linalg.eigh(form)
    if values[1] - values[0] <= _DISTINCT * max(abs(values[0]), abs(values[2])):
        return None
    normal = vectors[:, 0]
    return normal, float(normal @ center)


def _start(items: _Items) -> tuple[NDArray[np.float64], float] | None:
    """The plane from which the least median of squares is least: that of all, or of a single pair."""
    planes = [_plane(items, np.ones(len(items.on)))]
    for on, across in zip(items.on, items.across, strict=True):
        if length := float(np.linalg.norm(across)):
            planes.append((across / length, float(across @ on) / length))
    found = [plane for plane in planes if plane is not None]
    if planes[0] is None:  # a pair alone is as good as a plane of all only where there is nothing else
        found = found if items.across.any() else []
    return min(found, key=lambda plane: float(np.median(items.residuals(*plane))), default=None)


def _sigma(items: _Items, plane: tuple[NDArray[np.float64], float], robust: NDArray[np.float64]) -> float:
    """The standard deviation that the items which count leave, by their degrees of freedom."""
    free = np.where(items.across.any(axis=1), 3.0, 1.0)
    left = float(robust @ free) - 3
    if left <= 0:
        return math.nan
    return math.sqrt(float(robust @ (free * items.residuals(*plane) ** 2)) / left)


def proposal_for(name: str, positions: Positions, partners: Mapping[str, str]) -> Proposal | None:
    """The place of a landmark as the mirror image of its partner; None where that is not set, or the
    others tell no plane.

    Its uncertainty is by how far the other pairs are off such proposals, each made without the pair.
    """
    partner = partners.get(name, "")
    if partner in ("", name) or partner not in positions:
        return None
    others = {key: place for key, place in positions.items() if key != name}
    plane = mirror_plane(
        others, {key: value for key, value in partners.items() if key != partner} | {partner: name}
    )
    if plane is None:
        return None
    return Proposal(mirrored(positions[partner], plane), _error_of_proposals(others, partners))


def _error_of_proposals(positions: Positions, partners: Mapping[str, str]) -> float:
    """The standard deviation of a coordinate of proposals for landmarks that are set; NaN for too few."""
    squares = []
    for name in positions:
        partner = partners.get(name, "")
        if partner not in positions or partner == name:
            continue
        others = {key: place for key, place in positions.items() if key not in (name, partner)}
        items = _items(others, partners)
        plane = mirror_plane(others, partners) if items and len(items.on) >= _ENOUGH else None
        if plane is not None:
            off = mirrored(positions[partner], plane) - positions[name]
            squares.append(float(off @ off) / 3)
    # The median stands for the mean, so that one paralysed corner of the mouth does not count for all.
    return math.sqrt(float(np.median(squares)) / _MEDIAN_OF_SQUARES) if squares else math.nan


_MEDIAN_OF_SQUARES = 0.7887  # of chi squared of three degrees of freedom, a degree


def partners_of(names: Iterable[str]) -> dict[str, str]:
    """The mirror image of each name that has one, by what tells left from right: chL, L-ch, left ear."""
    listed = set(names)
    found = {}
    for name in listed:
        for pattern, other in _SIDES:
            swapped = re.sub(pattern, partial(_swapped, other), name)
            if swapped != name and swapped in listed:
                found[name] = swapped
                break
    return found


def _swapped(other: Mapping[str, str], match: re.Match[str]) -> str:
    """Word for the other side, in the case of this one."""
    word, like = other[match[0].lower()], match[0]
    if like.isupper():
        return word.upper()
    return word.capitalize() if like[0].isupper() else word

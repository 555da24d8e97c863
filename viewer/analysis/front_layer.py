"""The front layer on the ray through a pixel: which of the surfaces behind each other a click means.

Renderers can show the wrong one: a splat reaches over what lies behind, and small points leave gaps through
which one sees a surface farther back. The points of the cloud around the ray tell all surfaces on it
(`local_surface`), and each with the chance that it ends before the ray. The front one is meant, unless it
may end.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .local_surface import Column, LocalSurface, Unclear, local_surface

LEFT_OUT = 0.05  # the share of cases beyond what is said
_BESIDE = 1.5  # spacings from the ray to points that may be of a surface on it
_STEP = 1.5  # spacings from one depth at which a surface is looked for to the next
_START = 0.5  # spacings behind the nearest point
_BEHIND = 2.0  # spacings behind a certain surface, from which on nothing is looked for
_TRIES = 12  # depths at most
_SAME = 1.0, 2.0  # spacings and deviations within which two surfaces are one
_CERTAIN = 1e-3  # doubt below which nothing is looked for behind a surface
_FEW = 4  # points at least that hide what lies behind them
_WIDEST = 5 / 6 * np.pi  # angle without any of those that lie all round


def front_layer(column: Column, shown: float) -> LocalSurface | Unclear:
    """The surface that is most likely seen on a ray; `Unclear` where points in front tell none.

    shown: the depth that a picture shows. The doubt of the surface is the chance of the others together. If
    it is more than what is left out of 95 %, the deviation holds how far apart they are.
    """
    found, unclear = _surfaces(column, shown)
    if Unclear.NARROW in unclear.values():
        return Unclear.NARROW
    if not found:
        return unclear.get(shown, Unclear.FEW)
    if _chances(found).sum() < LEFT_OUT:
        return Unclear.FEW
    likeliest = _likeliest(found)
    if unclear.get(shown) is Unclear.THICK and shown < likeliest.depth - _BEHIND * column.spacing:
        return Unclear.THICK
    if _hides(column, found, [start for start, why in unclear.items() if why is not Unclear.FEW]):
        return Unclear.THICK
    return likeliest


def _surfaces(column: Column, shown: float) -> tuple[list[LocalSurface], dict[float, Unclear]]:
    """The surfaces on the ray from front to back, and why there is none at other depths. Behind what is
    certain and shown, none are looked for."""
    found: list[LocalSurface] = []
    unclear: dict[float, Unclear] = {}

    def look(start: float) -> None:
        surface = local_surface(column, start)
        if isinstance(surface, Unclear):
            unclear[start] = surface
        elif surface.doubt < 1 and not any(_are_one(surface, other) for other in found):
            found.append(surface)

    look(shown)
    back, spacing = (found[0].depth, found[0].spacing) if found else (shown, column.spacing)
    start, tries = -np.inf, 0
    for depth in np.sort(column.depths[column.away < _BESIDE * spacing]):
        if depth < start + _STEP * spacing:
            continue
        start = float(depth) + _START * spacing
        is_certain = min((surface.doubt for surface in found), default=1.0) < _CERTAIN
        if tries == _TRIES or (is_certain and start > back + _BEHIND * spacing):
            break
        if all(abs(start - surface.depth) >= spacing for surface in found):
            look(start)
            tries += 1
    return sorted(found, key=lambda surface: surface.depth), unclear


def _are_one(surface: LocalSurface, other: LocalSurface) -> bool:
    spacings, deviations = _SAME
    same = spacings * surface.spacing + deviations * min(surface.deviation, other.deviation)
    return abs(surface.depth - other.depth) < same


def _hides(column: Column, found: list[LocalSurface], starts: list[float]) -> bool:
    """Whether points that tell no surface, at some depths, hide the front one of those that were found."""
    front = next((surface for surface in found if surface.doubt < 0.5), found[-1])
    for start in starts:
        near = np.abs(column.depths - start) < _BESIDE * front.spacing
        near &= column.away < _BESIDE * front.spacing
        if start < front.depth - _BEHIND * front.spacing and np.count_nonzero(near) >= _FEW:
            across, down = column.offsets[near].T
            if lie_all_round(down, across):
                return True
    return False


def _likeliest(found: list[LocalSurface]) -> LocalSurface:
    """The most likely of surfaces from front to back. What lies behind them all counts as none."""
    chances = _chances(found)
    shares = chances / chances.sum()
    likeliest = found[int(shares.argmax())]
    likeliest = likeliest._replace(doubt=float(1 - shares.max()))
    if likeliest.doubt <= LEFT_OUT:
        return likeliest
    apart = shares @ (np.array([surface.depth for surface in found]) - likeliest.depth) ** 2
    return likeliest._replace(deviation=float(np.hypot(likeliest.deviation, np.sqrt(apart))))


def _chances(found: list[LocalSurface]) -> NDArray[np.float64]:
    """The chance that each of some surfaces, from front to back, is seen: where none before it is, and it
    does not end."""
    doubts = np.array([surface.doubt for surface in found])
    return np.cumprod(np.append(1.0, doubts[:-1])) * (1 - doubts)


def lie_all_round(down: NDArray, across: NDArray) -> bool:
    """Whether places lie round the origin in all directions; not so on one side of a line."""
    angles = np.sort(np.arctan2(down, across))
    return len(angles) > 0 and bool(np.diff(angles, append=angles[0] + 2 * np.pi).max() < _WIDEST)

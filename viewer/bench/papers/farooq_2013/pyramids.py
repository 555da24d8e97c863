"""What Farooq 2013 shows of hole filling (7.3.1, Fig. 7.10) and hidden points (6.3), with errors beside it.

Scans of two pods, and real ones with a truth, are looked at from far and from near: by each number of levels,
as polygons, and as the triangles of their neighbours, which scanners' own software makes of them.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from functools import cache
from typing import Any

from ....backends import backend
from ....resources import resource_path
from ...baselines import RANGE_MESH
from ...plan import Contender, Group

BACKEND = "pyramidal"
MOST_LEVELS = 5
HIDE = "hide"  # the parameter: whether samples behind others are looked for
PRIMITIVES = ("points", "polygons")
ZOOMS = (0.25, 1.0, 2.0, 4.0, 8.0)
HIDDEN_ZOOM = 4.0

_NOISE = 0.0  # of the virtual scanner: the real scans have their own
_SCENES = ("demo-pair", "armadillo-pair", "dragon-scans", "bunny-scans", "truedepth-head")
_COVERED_SCENES = ("armadillo-pair", "hand-before-face-pair")  # which cover themselves


@cache
def paper() -> dict[str, Any]:
    """Table 7.2 and the memory of 4.4, as assets/farooq-2013.json has them."""
    return json.loads(resource_path("assets", "farooq-2013.json").read_text(encoding="utf-8"))


def with_levels(count: int, primitive: str, **others: Any) -> Any:
    """Parameters that show so many levels, the finest first; 1: what was measured alone."""
    shown = {f"level_{level}": level < count for level in range(MOST_LEVELS)}
    return backend(BACKEND).params({**shown, "fill": count > 1, "primitive": primitive, **others})


def levels_of(params: dict[str, Any]) -> int:
    """The number of levels that the parameters of a row show."""
    return sum(params[f"level_{level}"] for level in range(MOST_LEVELS)) if params["fill"] else 1


def groups() -> list[Group]:
    """A group for each scene and zoom; then those of hidden points."""
    drawn = [with_levels(count, "points") for count in range(1, MOST_LEVELS + 1)]
    drawn.append(with_levels(MOST_LEVELS, "polygons"))
    contenders = (*(Contender(BACKEND, params) for params in drawn), Contender(RANGE_MESH))
    return [
        *(_group(scene, zoom, contenders) for scene in _SCENES for zoom in ZOOMS),
        *(_group(scene, HIDDEN_ZOOM, tuple(_hiding())) for scene in _COVERED_SCENES),
    ]


def _hiding() -> Iterator[Contender]:
    """Contenders with and without looking for hidden points, by primitive and number of levels."""
    for primitive in PRIMITIVES:
        for count in (1, MOST_LEVELS):
            for hides in (False, True):
                yield Contender(BACKEND, with_levels(count, primitive, **{HIDE: hides}), HIDE)


def _group(scene: str, zoom: float, contenders: tuple[Contender, ...]) -> Group:
    noise = _NOISE if scene.endswith("-pair") else None
    return Group(scene, contenders, noise=noise, zoom=zoom, sweep="zoom")

"""What Preiner 2012 shows of splats found in each picture, and the pictures that show it here."""

from __future__ import annotations

import json
from collections.abc import Sequence
from functools import cache
from typing import Any

from ....analysis.visible_normals import VisibleNormals, estimate_normals
from ....backends import backend
from ....camera import Camera
from ....picture.surface import Surface
from ....resources import resource_path
from ....scan.pose import Pose
from ...baselines import PRECOMPUTED
from ...plan import Contender, Group

BACKEND = "auto_splats"
SIZE = (1760, 900)  # the paper's
K = 10
STAGES = ("projection", "search", "splats", "shading")
# The stage of each pass that has a name of its own; lists and counts before one are of its stage.
_STAGE_OF = {
    "depth": "projection",
    "id": "projection",
    **dict.fromkeys(
        ("nearest", "planes", "arrange", "usual", "active", "search", "unknown", "late"), "search"
    ),
    **dict.fromkeys(("work", "show", "shrink", "again", "limit", "limits", "visibility", "blend"), "splats"),
    **dict.fromkeys(("splat", "normals", "copy", "resolve", "values"), "splats"),
    "shade": "shading",
}
_MODELS = ("bunny", "armadillo", "igea", "dragon")  # Fig. 6
_TWO_SCALES = "two-bunnies"  # Fig. 7
DEEP = "horses"  # its depth complexity is 5 to 6


@cache
def paper() -> dict[str, Any]:
    """Table 1, as assets/preiner-2012.json has it."""
    return json.loads(resource_path("assets", "preiner-2012.json").read_text(encoding="utf-8"))


def parameters(values: dict[str, Any]) -> Any:
    """Parameters of the backend by name; the others are its defaults."""
    return backend(BACKEND).params(values)


def normals(pose: Pose, camera: Camera, size: tuple[int, int], values: dict[str, Any]) -> VisibleNormals:
    """Normals of the points that a camera sees, by parameters of the backend by name."""
    return estimate_normals(pose, camera, size=size, **values)


def rounds(surface: Surface) -> list[int]:
    """How many points were left before each round of the search for a surface's last picture."""
    known = list(surface.stats.counted["neighborhoods by searches"]().values())
    return [sum(known[number:]) for number in range(len(known))]


def by_stage(passes: Sequence[tuple[str, float]]) -> dict[str, float]:
    """Milliseconds of each stage, of the passes of a picture in their order.

    The search is all from the list of what is seen to radii and planes.
    """
    taken, stage = dict.fromkeys(STAGES, 0.0), STAGES[-1]
    for name, ms in reversed(passes):
        stage = _STAGE_OF.get(name, stage)
        taken[stage] += ms
    return taken


def fitted(noise: float) -> list[dict[str, Any]]:
    """Parameters whose fits are looked at: with hidden neighbours and without; under noise, of more.

    As many as told, and as few of these as tell the plane ("adaptive").
    """
    ks = (K, 2 * K, 3 * K) if noise else (K,)
    fixed = [{"k": k, "hidden_neighbors": True, "adaptive": False} for k in ks]
    alone = [] if noise else [{"k": K, "hidden_neighbors": False, "adaptive": False}]
    return [*fixed, *alone, {"k": ks[-1], "hidden_neighbors": True, "adaptive": True}]


def groups() -> list[Group]:
    """Pictures that are judged: with and without hidden neighbours, and with the paper's two savings."""
    return [
        *(Group(scene, _against_precomputed("hidden_neighbors")) for scene in (*_MODELS, _TWO_SCALES)),
        Group(DEEP, tuple(_saving())),
    ]


def _against_precomputed(switched: str) -> tuple[Contender, ...]:
    return (
        Contender(BACKEND, parameters({})),
        Contender(BACKEND, parameters({switched: False}), switched),
        Contender(PRECOMPUTED, backend("surfels").params({"passes": "two"})),
    )


def _saving() -> list[Contender]:
    """Grid culling and depth refinement, each on and off."""
    return [
        Contender(BACKEND, parameters({"cull": cull, "refine": refine}), "cull, refine")
        for cull in (False, True)
        for refine in (False, True)
    ]

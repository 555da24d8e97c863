"""What a benchmark measures: scenes x backends, and sweeps that vary one thing at a time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

from ..backends import Backend, backend
from ..camera import Camera
from ..scan.points import PointCloud
from .baselines import CEILING, FLOOR
from .scenes import catalog
from .scenes.catalog import Sweep

COUNTS = (10_000, 100_000, 1_000_000, 10_000_000)
NOISES = (0.0, 0.5, 1.0, 2.0, 4.0)  # footprints of a scanner's pixel
_SWEPT_SCENES = 2
_PREFERRED = ("torus", "dragon", "torus-simulated", "bunny-simulated")  # to vary counts and noise on


@dataclass(frozen=True)
class Contender:
    """A backend with its parameters. params: None for the floor and the ceiling, which have none.

    sweep: the parameter that differs from its default; empty: none does. drawn: for what no user chooses:
    gives the points that are drawn instead of the scan's for a camera, and the backend that draws them."""

    backend: str
    params: Any = None
    sweep: str = ""
    drawn: Callable[[PointCloud, Camera], tuple[PointCloud, str | Backend]] | None = None


@dataclass(frozen=True)
class Group:
    """A scene and the contenders that take turns on it.

    count, noise: None for the scene's own. zoom: pixels of the picture for a sample of its range views,
    which cameras then look at (`pod_viewpoints`); None: they look from all round. sweep: "n", "noise" or
    "zoom" where the group is a step of such a sweep, or the parameter that all its contenders vary; else
    empty. judged: whether errors are found, which takes longer than drawing.
    """

    scene: str
    contenders: tuple[Contender, ...]
    count: int | None = None
    noise: float | None = None
    zoom: float | None = None
    sweep: str = ""
    judged: bool = True


def plan(
    scenes: Sequence[str],
    backends: Sequence[str],
    counts: Sequence[int] = COUNTS,
    noises: Sequence[float] = NOISES,
    swept_scenes: int | None = None,
) -> list[Group]:
    """The groups to measure. scenes, backends: names, or files of meshes.

    Each scene meets the defaults of all backends, and every value that their declarations sweep and that
    matters beside the other defaults; then
    counts and noise vary on two scenes each, with the defaults, but for what is usual for the scene.
    swept_scenes: on how many scenes anything is swept; None: no limit. Raises InputError for unknown
    backends.
    """
    limit = len(scenes) if swept_scenes is None else swept_scenes
    defaults = [Contender(FLOOR), Contender(CEILING)]
    defaults += [Contender(name, backend(name).params()) for name in backends]
    swept = [*defaults, *(contender for name in backends for contender in _sweeps(name))]
    groups = [
        Group(scene, tuple(swept if number < limit else defaults)) for number, scene in enumerate(scenes)
    ]
    varied = min(limit, _SWEPT_SCENES)
    for scene, count in product(_varying(scenes, "n")[:varied], counts):
        if count != catalog.usual(scene, "n"):
            groups.append(Group(scene, tuple(defaults), count=count, sweep="n"))
    for scene, noise in product(_varying(scenes, "noise")[:varied], noises):
        if noise != catalog.usual(scene, "noise"):
            groups.append(Group(scene, tuple(defaults), noise=noise, sweep="noise"))
    return groups


def _varying(scenes: Sequence[str], sweep: Sweep) -> list[str]:
    """The scenes that a sweep can be made on, those that show most first."""
    able = [scene for scene in scenes if catalog.varies(scene, sweep)]
    return sorted(able, key=lambda scene: scene not in _PREFERRED)


def _sweeps(name: str) -> list[Contender]:
    """One contender for each value that a backend's declaration sweeps, but for the defaults, and for
    parameters that do not matter beside them."""
    declared = backend(name)
    return [
        Contender(name, declared.params({parameter.name: value}), parameter.name)
        for parameter in declared.parameters
        if parameter.matters(declared.params())
        for value in parameter.sweep
        if value != parameter.default
    ]

"""Whether defaults are the best that the declarations offer: each other value beside them, scene by scene."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ..backends import backend
from ..drawing.request import backend_for
from ..params import Parameter
from .baselines import FLOOR
from .plan import Contender, Group
from .run import BenchSettings

# What scans are like: exact, bare, uneven, noisy, thin, with strays, merged, range views.
SCENES = (
    "demo", "bunny", "bunny-bare", "bunny-ramp", "bunny-ramp-bare", "bunny-noise-0.5", "bunny-strays-bare",
    "armadillo-bare", "sheets", "sheets-bare", "bunny-scans", "bunny-scans-merged", "torus-pair",
)  # fmt: skip


def default_groups(settings: BenchSettings, scenes: Sequence[str]) -> list[Group]:
    """Groups of each scene: the backend that is its default, and every other value of each of its parameters.

    Raises InputError for scenes that cannot be had.
    """
    made = []
    for scene in scenes:
        pose = settings.subject(Group(scene, ())).moment(0).pose
        name, params = backend_for(pose)
        made.append(Group(scene, (Contender(FLOOR), Contender(name, params), *_others(name, params))))
    return made


def _others(name: str, params: Any) -> list[Contender]:
    """A contender for each other value of each parameter that matters beside the rest."""
    declared = backend(name)
    values = {parameter.name: getattr(params, parameter.name) for parameter in declared.parameters}
    return [
        Contender(name, declared.params({**values, parameter.name: value}), parameter.name)
        for parameter in declared.parameters
        if parameter.matters(params)
        for value in _offered(parameter)
        if value != values[parameter.name]
    ]


def _offered(parameter: Parameter) -> tuple[Any, ...]:
    """The values that a declaration offers: those of its sweep, else its choices, else on and off."""
    return parameter.sweep or parameter.choices or ((True, False) if parameter.type is bool else ())

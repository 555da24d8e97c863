"""Levels of a pyramid, where a backend has them: boolean parameters named `level_0`, `level_1` and so on.

Farooq 2013, 7.2.1.2: level 0 is the native one, each coarser one fills larger holes.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TypeVar

from ...params import describe

T = TypeVar("T")
LEVELS = range(10)  # a digit each
_PREFIX = "level_"


def levels(params: object) -> dict[int, bool]:
    """Level -> whether it is on; empty where the parameters have none."""
    declared = {parameter.name for parameter in describe(type(params))}
    return {n: getattr(params, name) for n in LEVELS if (name := f"{_PREFIX}{n}") in declared}


def toggled(params: T, number: int) -> T:
    """With a level switched on or off; the same where there is no such level."""
    now = levels(params)
    return _with(params, {number: not now[number]}) if number in now else params


def is_filling(params: object) -> bool:
    """Whether all levels that fill holes are on."""
    filling = [on for number, on in levels(params).items() if number]
    return bool(filling) and all(filling)


def with_filling(params: T, on: bool) -> T:
    """With all levels that fill holes on or off; the native one stays as it is."""
    return _with(params, {number: on for number in levels(params) if number})


def _with(params: T, values: dict[int, bool]) -> T:
    return replace(params, **{f"{_PREFIX}{n}": on for n, on in values.items()})  # type: ignore[type-var]

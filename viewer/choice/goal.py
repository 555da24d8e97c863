"""What a choice is to keep: a time, or an error."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

from ..errors import InputError, shortened
from ..scan.units import conversion

PIXELS = "px"


@dataclass(frozen=True)
class Goal:
    """A bound: of the time of a picture, ms, or of its error, in pixels ("px") or a unit of length.

    kind: "time" or "error".
    """

    kind: str
    bound: float
    unit: str = "ms"

    def __str__(self) -> str:
        return f"{self.bound:g} {self.unit}"


def time_goal(text: str) -> Goal:
    """The goal of a time such as 50ms, 50 or 0.05s. Raises InputError."""
    number, unit = _parts(text, "--budget", "such as 50ms")
    if unit not in ("", "ms", "s"):
        raise InputError(f"'{shortened(text)}' is not a time", "--budget", "Use milliseconds, such as 50ms")
    return Goal("time", number * (1000 if unit == "s" else 1))


def error_goal(text: str) -> Goal:
    """The goal of an error such as 0.5px, 0.5 or 0.1mm. Raises InputError."""
    number, unit = _parts(text, "--error", "such as 0.5px or 0.1mm")
    return Goal("error", number, unit or PIXELS)


def in_unit(goal: Goal, unit: str) -> Goal:
    """The goal of an error in a scan's unit of length, where it is not in pixels. Raises InputError where
    that is not known of either."""
    if goal.kind != "error" or goal.unit in (PIXELS, unit):
        return goal
    factor = conversion(goal.unit, unit)
    if factor is None:
        hint = f"Use pixels, such as 0.5px, or the scan's unit: --error {goal.bound:g}{unit}"
        raise InputError(
            f"'{goal.unit}' of the limit cannot be converted to the scan's '{unit}'", "--error", hint
        )
    return Goal("error", goal.bound * factor, unit)


def _parts(text: str, name: str, example: str) -> tuple[float, str]:
    found = re.fullmatch(r"\s*([0-9.eE+-]+?)\s*([^\W\d_]*)\s*", text)
    try:
        number = float(found[1]) if found else math.nan
    except ValueError:
        number = math.nan
    if found is None or not (0 < number < math.inf):
        raise InputError(
            f"'{shortened(text)}' is neither a limit of time nor of error",
            name,
            f"Use more than 0, {example}",
        )
    return number, found[2]

"""The colours of a tool's numbers: the map that suits them, and its ends, which follow the numbers."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

from ...document.part import Part
from ...look import Look
from ..tool_context import ToolContext

_SIGNED_MAP = "vik"  # readable with colour-blindness; its middle is 0
_GREY = "#6e6e6e"  # of points without a number: in neither map
_ROUND = (1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0)


class Colored:
    """Sets colours of numbers that a tool lays, and keeps those that the user has set."""

    def __init__(self, context: ToolContext, signed: Mapping[str, bool]) -> None:
        """signed: whether numbers have a sign, by name, of all that the tool lays."""
        self._context, self._signed = context, signed
        self._ends: tuple[object, ...] = ()  # of the colour map, as set here last

    @property
    def name(self) -> str:
        """The number of the tool that the colours show; "" for none."""
        name = self._context.document.look.color_by
        return name if name in self._signed else ""

    def show(self, step: str, name: str, end: float, *parts: Part) -> None:
        """Colour by a number, up to an end; on both sides of 0 where it has a sign. step: what Undo calls it.
        parts: of the document that change as well."""
        look, usual = self._context.document.look, Look()
        color_map = usual.color_map if self._has_own_map(look) else look.color_map
        low, high = self._of(name, end)
        look = replace(
            look, color_by=name, low=low, high=high,
            color_map=_SIGNED_MAP if self._signed[name] else color_map,
            plain=_GREY if look.plain == usual.plain else look.plain,
        )  # fmt: skip
        self._context.change(step, *parts, look=look)
        self._ends = name, low, high

    def reset(self) -> None:
        """Colour as usual."""
        look, usual = self._context.document.look, Look()
        look = replace(
            look, color_by=usual.color_by, low=usual.low, high=usual.high,
            color_map=usual.color_map if self._has_own_map(look) else look.color_map,
            plain=usual.plain if look.plain == _GREY else look.plain,
        )  # fmt: skip
        self._context.change("Change colours", look=look)

    def fit(self, name: str, end: float | None) -> None:
        """Have the colour map end where the numbers do, unless the user has set its ends. end: None where it
        is not known."""
        look = self._context.document.look
        if end is None or (name, look.low, look.high) != self._ends:
            return
        low, high = self._of(name, end)
        if (name, low, high) != self._ends:
            self._ends = name, low, high
            self._context.amend(look=replace(look, low=low, high=high))

    def _has_own_map(self, look: Look) -> bool:
        """Whether the colour map was set here, for numbers with a sign."""
        return self._signed.get(look.color_by, False) and look.color_map == _SIGNED_MAP

    def _of(self, name: str, end: float) -> tuple[float, float]:
        """The ends of the colour map, alike on both sides of 0 where the number has a sign."""
        return (-end if self._signed[name] else 0.0), end


def rounded_up(value: float) -> float:
    """The next number of few digits, of one above 0."""
    power = 10.0 ** math.floor(math.log10(value))
    return next(float(f"{step * power:.3g}") for step in _ROUND if step * power >= value * (1 - 1e-9))

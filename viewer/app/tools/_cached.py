"""Results that a tool asks for in every frame, and that are made anew only where their inputs changed."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

T = TypeVar("T")


class Cached:
    """Results by key, each returned again until it is asked for with other inputs."""

    def __init__(self) -> None:
        self._results: dict[object, tuple[tuple[object, ...], Any]] = {}

    def of(self, key: object, inputs: tuple[object, ...], make: Callable[[], T]) -> T:
        """The result of a key, made anew where an input is not the object, or equal number, that it was."""
        known = self._results.get(key)
        if known is None or not all(map(_is_same, known[0], inputs)):
            known = self._results[key] = inputs, make()
        result: T = known[1]
        return result

    def forget_others(self, keys: set[object]) -> None:
        """Forget the results of all but these keys."""
        self._results = {key: result for key, result in self._results.items() if key in keys}


def _is_same(one: object, other: object) -> bool:
    return one is other or (isinstance(one, int) and one == other)

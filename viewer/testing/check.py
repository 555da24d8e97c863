"""A check of a conformance suite."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Check:
    """A check of one subject, such as a backend. Calling it raises AssertionError where the subject fails.

    name: what has to hold. subject: what is checked. variant: of the subject, such as parameter values.
    """

    name: str
    subject: str
    run: Callable[[], object]
    variant: str = ""

    def __call__(self) -> None:
        self.run()

    def __str__(self) -> str:
        return f"{self.name}-{self.variant or self.subject}"

"""What tests of experiments share: the tables of a suite as text, and their cells."""

from __future__ import annotations

from collections.abc import Sequence

from experiments.suite import Suite
from experiments.tables import StoredRun


def tables_of(suite: Suite, runs: Sequence[StoredRun]) -> str:
    """All tables of the page of a suite, one below the other."""
    return "\n\n".join(suite.made(runs).values())


def cells(text: str, *start: str) -> list[list[str]]:
    """The cells of the lines of tables that begin so."""
    lines = [[cell.strip() for cell in line.split("|")[1:-1]] for line in text.splitlines() if "|" in line]
    return [line for line in lines if tuple(line[: len(start)]) == start]

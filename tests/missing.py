"""Libraries that tests leave out, as where they are not installed."""

from __future__ import annotations

from importlib.machinery import PathFinder

import pytest


def leave_out(monkeypatch: pytest.MonkeyPatch, *libraries: str) -> None:
    """Let no path lead to these libraries; those that were imported before stay."""
    found = PathFinder.find_spec
    monkeypatch.setattr(
        PathFinder, "find_spec", lambda name, *more: None if name in libraries else found(name, *more)
    )

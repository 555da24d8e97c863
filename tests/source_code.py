"""The source of the package, which tests read: each module is parsed once."""

from __future__ import annotations

import ast
from functools import cache
from pathlib import Path

PACKAGE = Path(__file__).resolve().parents[1] / "viewer"


@cache
def modules() -> list[Path]:
    """The modules of the package, in order of their paths."""
    return sorted(PACKAGE.rglob("*.py"))


@cache
def syntax_of(path: Path) -> ast.Module:
    """The syntax of a module."""
    return ast.parse(path.read_text(encoding="utf-8"))

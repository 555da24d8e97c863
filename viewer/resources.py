"""Where shaders and assets are: inside the package in a wheel, beside it in a checkout."""

from __future__ import annotations

from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent
_ROOT = _PACKAGE if (_PACKAGE / "shaders").is_dir() else _PACKAGE.parent


def resource_path(*parts: str) -> Path:
    """A file or folder of the project: resource_path("shaders", "common", "view.glsl")."""
    return Path(_ROOT, *parts)

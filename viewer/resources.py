"""Where shaders and assets are: inside the package in a wheel, beside it in a checkout."""

from __future__ import annotations

from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent
# Folders with `shaders` and `assets`, the project's own first; what is appended is looked through as well.
ROOTS = [_PACKAGE if (_PACKAGE / "shaders").is_dir() else _PACKAGE.parent]


def resource_path(*parts: str) -> Path:
    """A file or folder in the first of `ROOTS` that has it: resource_path("shaders", "common", "view.glsl").

    Where none has it, a path in the project's own: opening it raises FileNotFoundError.
    """
    paths = [Path(root, *parts) for root in ROOTS]
    return next((path for path in paths if path.exists()), paths[0])

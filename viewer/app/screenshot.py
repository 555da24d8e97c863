"""Saving the picture as it is shown."""

from __future__ import annotations

import json
from itertools import count
from pathlib import Path

from ..files import whole_file
from ..frame import Request
from ..gpu.surface import Surface
from .session import describe

METADATA_KEY = "scan4d"  # of the PNG's text


def save_screenshot(surface: Surface, request: Request, scan: str, folder: Path) -> Path:
    """Write scan4d_0001.png, or the next number that is free, and return its path.

    Its text `scan4d` is the JSON of `describe`: all that is needed to draw it again.
    Raises InputError where it cannot be written.
    """
    from PIL import Image
    from PIL.PngImagePlugin import PngInfo

    path = next(p for n in count(1) if not (p := folder / f"scan4d_{n:04d}.png").exists())
    info = PngInfo()
    info.add_itxt(METADATA_KEY, json.dumps(describe(request, scan, surface.size)))
    with whole_file(path) as temporary:
        Image.fromarray(surface.image()).save(temporary, pnginfo=info)
    return path

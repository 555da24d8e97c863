"""The figures that papers print, as the folder of each has them in paper.json."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any


@cache
def figures(folder: str) -> dict[str, Any]:
    """The figures of a paper, by the name of its folder."""
    return json.loads((Path(__file__).parent / folder / "paper.json").read_text(encoding="utf-8"))

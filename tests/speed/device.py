"""What scripts of this folder write down for another machine: a file with the device's name in it."""

from __future__ import annotations

import json
import os
import re
from datetime import date
from pathlib import Path
from typing import Any

from viewer import __version__
from viewer.files import whole_file
from viewer.gpu.context import Gpu


def slug(gpu: Gpu) -> str:
    """The device's name as a part of a file's: what stands before the first bracket or slash."""
    name = re.split(r"[(/]", gpu.device)[0].lower()
    return re.sub(r"[^a-z0-9]+", "-", name).strip("-")


def write_rows(folder: Path, name: str, gpu: Gpu, rows: list[dict[str, Any]], **told: Any) -> Path:
    """Write rows, and where they were measured, into NAME-DEVICE.json of a folder."""
    path = folder / f"{name}-{slug(gpu)}.json"
    circumstances = {
        "device": gpu.device,
        "driver": gpu.driver,
        "processors": len(os.sched_getaffinity(0)),
        "timer": gpu.timers.kind,
        "version": __version__,
        "date": date.today().isoformat(),
        **told,
    }
    lines = [f" {json.dumps(key)}: {json.dumps(value)}" for key, value in circumstances.items()]
    lines.append(' "rows": [\n' + ",\n".join(f"  {json.dumps(row)}" for row in rows) + "\n ]")
    folder.mkdir(parents=True, exist_ok=True)
    with whole_file(path) as temporary:
        temporary.write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")
    return path

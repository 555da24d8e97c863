"""Measurements that stand beside a paper's: what they keep of results, their files, and their machines.

A measurement is one small JSON file; those of several machines make one page of docs/. Another machine's
goes to docs/data/ under a name of its own, with what its numbers do not tell in its `note`; then `python
-m pytest tests/test_docs.py --bless` makes the page.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ...errors import InputError
from ...files import whole_file
from .results import Row

Measurement = dict[str, Any]

_ONCE = ("device", "driver", "processors", "timer", "version", "date", "size", "repeat", "seed")
_SPACE = "\N{NARROW NO-BREAK SPACE}"
_TIMERS = {"query": "timer queries", "finish": "wall time between finishes"}


def circumstances(rows: Sequence[Row]) -> Measurement:
    """Place and manner of measuring rows of one backend. params: those that all have in common."""
    first, *others = rows
    params = first["params"].items()
    return {
        **{name: first[name] for name in _ONCE},
        "params": {k: v for k, v in params if all(row["params"][k] == v for row in others)},
        "note": "",
    }


def write_measurement(folder: Path, name: str, measurement: Measurement, page: str) -> Path:
    """Write NAME.json and NAME.md; gives the page."""
    path = folder / f"{name}.md"
    for file, text in ((folder / f"{name}.json", _to_text(measurement)), (path, page)):
        with whole_file(file) as temporary:
            temporary.write_text(text, encoding="utf-8")
    return path


def read_measurement(path: Path, parts: Sequence[str], suite: str) -> Measurement:
    """A measurement as it was written. parts: the lists that it must have. suite: what makes one.

    Raises InputError for what is none.
    """
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(f"cannot be read: {error}", path) from error
    if not isinstance(found, dict) or not {*_ONCE, "params", "note", *parts} <= found.keys():
        raise InputError("is no such measurement", path, f"Run scan4d bench --suite {suite}")
    return found


def _to_text(measurement: Measurement) -> str:
    """JSON with a line for each row of a list."""
    parts = []
    for name, value in measurement.items():
        if isinstance(value, list) and value and isinstance(value[0], dict):
            rows = ",\n  ".join(json.dumps(row) for row in value)
            parts.append(f' "{name}": [\n  {rows}\n ]')
        else:
            parts.append(f' "{name}": {json.dumps(value, ensure_ascii=False)}')
    return "{\n" + ",\n".join(parts) + "\n}\n"


# --- of a page ------------------------------------------------------------------------


def machines(measurements: Sequence[Measurement], backend: str, paper: Mapping[str, Any]) -> str:
    """A Markdown list of where the paper's and ours were measured, and with what parameters of a backend.

    paper: its `year` and `gpu`, and of `cpu`, `system` and `timing` what it tells.
    """
    told = (paper[part] for part in ("gpu", "cpu", "system", "timing") if part in paper)
    lines = (f"**{paper['year']}**: {'; '.join(told)}", *(_machine(each, backend) for each in measurements))
    return "\n".join(f"* {line}" for line in lines)


def _machine(measurement: Measurement, backend: str) -> str:
    """Place and manner of a measurement, in words."""
    views = sorted(
        {len(row["gpu_ms"]) for row in measurement["rows"]}
    )  # fewer of a scan where it was stopped
    params = (f"{name} {str(value).lower()}" for name, value in measurement["params"].items())
    parts = (
        f"**{measurement['device']}**: {measurement['driver']}, {measurement['processors']} processors",
        _TIMERS[measurement["timer"]],
        f"{'x'.join(map(str, measurement['size']))}, {' or '.join(map(str, views))} views a scan",
        f"Scan4D {measurement['version']}, {measurement['date']}, `{backend}` with {', '.join(params)}",
    )
    return "; ".join(parts) + (f". {measurement['note']}" if measurement["note"] else "")


def spaced(number: float) -> str:
    """A whole number with thin spaces."""
    return f"{number:,.0f}".replace(",", _SPACE)


def markdown_table(head: Sequence[str], rows: Sequence[Sequence[str]], left: Sequence[str]) -> str:
    """A Markdown table. left: the columns of text, the others are of numbers."""
    rule = ["---" if name in left else "---:" for name in head]
    return "\n".join(f"| {' | '.join(row)} |" for row in (head, rule, *rows))

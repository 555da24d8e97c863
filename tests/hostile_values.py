"""Values that no field of a JSON file expects."""

from __future__ import annotations

from typing import Any

_NESTED: list[Any] = []
for _ in range(400):
    _NESTED = [_NESTED]

HOSTILE: list[Any] = [
    None, True, False, [], {}, "", "auto", "\ud800", "\x00", "\x1b[31m", "x" * 5000, "../..", "%d", "#ff 00 ",
    0, -0.0, -1, 1, 0.5, 1e-320, 1e-30, 1e30, 1e308, -1e308, 2**31, 2**63, 10**400,
    float("nan"), float("inf"), float("-inf"), "nan", "1e999", "9" * 5000,
    [1, 2, 3], [0, 0], [1e308, -1e308, 0], [None, 1, 2], [10**400, 0, 0], ["1", "2", "3"], {"x": 1}, _NESTED,
]  # fmt: skip


def variants(data: Any) -> list[Any]:
    """Copies of JSON data, each with one of these values in the place of one of its own."""
    found = list(HOSTILE)
    if isinstance(data, dict):
        found += [{**data, name: other} for name in data for other in variants(data[name])]
        found += [{other: value for other, value in data.items() if other != name} for name in data]
        found.append({**data, "\x1b" * 300: 1})
    elif isinstance(data, list):
        found += [
            [*data[:i], other, *data[i + 1 :]] for i, value in enumerate(data) for other in variants(value)
        ]
    return found

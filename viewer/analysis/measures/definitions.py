"""Measures defined in files: JSON or TOML with a list of `measures`, as templates have it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ...errors import InputError, shortened
from ...files import parsed_json, parsed_toml, read_text, reading
from . import Measure
from .kinds import kind_of

_MOST_BYTES = 4 * 2**20
_MOST = 10_000
_FIELDS = ("name", "kind", "landmarks", "options")
_HINT = "docs/how-it-works/landmarks.md shows how to define measures"


def read_measures(path: Path | str) -> tuple[Measure, ...]:
    """The measures of a file, of a template as well, at least one. Raises InputError, which says what is
    wrong and where."""
    path = Path(path)
    with reading(path, "is neither a JSON nor a TOML file", _HINT):
        text = read_text(path, _MOST_BYTES)
        return _measures(parsed_toml(text) if path.suffix.lower() == ".toml" else parsed_json(text))


def _measures(data: Any) -> tuple[Measure, ...]:
    held = data.get("measures") if isinstance(data, dict) else data
    if not isinstance(held, list) or not 0 < len(held) <= _MOST:
        raise InputError(f"must contain 'measures', a list of 1 to {_MOST} measures")
    found = tuple(measure_of(each, f"measures[{number}]") for number, each in enumerate(held))
    names = [measure.name for measure in found]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"two measures have the name {shortened(name)!r}", "measures")
    return found


def measure_of(data: Any, where: str) -> Measure:
    """The measure of an object of a file, which stands there. Raises InputError for what is wrong in it."""
    if not isinstance(data, dict):
        raise InputError("is not a JSON object", where)
    for field in data:
        if field not in _FIELDS:
            raise InputError(f"has an unknown field '{shortened(field)}'", where)
    name, kind = data.get("name"), data.get("kind")
    landmarks, options = data.get("landmarks", []), data.get("options", {})
    if not (isinstance(name, str) and name and name.isprintable() and isinstance(kind, str)):
        raise InputError("must have a 'name' and a 'kind', both of them texts", where)
    if not (isinstance(landmarks, list) and all(isinstance(landmark, str) for landmark in landmarks)):
        raise InputError("'landmarks' is not a list of names", where)
    if not (isinstance(options, dict) and all(isinstance(value, str) for value in options.values())):
        raise InputError("'options' must be names with texts as values", where)
    measure = Measure(name, kind, tuple(landmarks), options)
    try:
        kind_of(measure)
    except InputError as error:
        raise InputError(
            error.what, ", ".join(filter(None, (where, str(error.where or "")))), error.hint
        ) from None
    return measure

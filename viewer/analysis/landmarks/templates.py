"""Templates: which landmarks are placed in which order, and what is measured of them.

A template is a JSON file: `format` (1), `name`, `title`, `source`, `landmarks` (each a `name`, and where
there are any its `partner` in the mirror and `about`, how it is found) and `measures` (each a `name`, its
`kind`, its `landmarks` and `options`). Those in assets/templates/ come with Scan4D.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

from ...errors import InputError, shortened
from ...files import parsed_json, read_text, reading, save_json
from ...resources import resource_path
from ..measures import Measure
from ..measures.definitions import measure_of
from ..measures.kinds import kind_of
from . import Landmark, Template
from .landmark_set import LONGEST_LANDMARK_NAME

_FORMAT = 1
_MOST_BYTES = 4 * 2**20
_MOST = 10_000  # landmarks, and measures
_LONGEST = 4000  # characters of a text
_HINT = "docs/reference/formats.md shows how to write a template"
_FIELDS = ("format", "name", "title", "source", "landmarks", "measures")


@cache
def templates() -> Mapping[str, Template]:
    """Shipped templates, by name."""
    found = [read_template(path) for path in sorted(resource_path("assets", "templates").glob("*.json"))]
    return {template.name: template for template in found}


def is_template_file(path: Path | str) -> bool:
    """Whether a file is a template, perhaps one with mistakes, and no other JSON."""
    if Path(path).suffix.lower() != ".json":
        return False
    try:
        data = parsed_json(read_text(Path(path), _MOST_BYTES))
    except (OSError, ValueError):
        return False
    return isinstance(data, dict) and "landmarks" in data and set(data) <= set(_FIELDS)


def read_template(path: Path | str) -> Template:
    """The template of a file. Raises InputError, which tells the place of what is wrong."""
    path = Path(path)
    with reading(path, "is not JSON", _HINT):
        return _template(parsed_json(read_text(path, _MOST_BYTES)))


def _template(data: Any) -> Template:
    fields = _fields(data, _FIELDS, "")
    if fields.get("format") != _FORMAT:
        raise InputError(f"has the format {shortened(fields.get('format'))}, but Scan4D reads {_FORMAT}")
    landmarks = tuple(
        _landmark(value, f"landmarks[{number}]") for number, value in enumerate(_list(fields, "landmarks"))
    )
    if not landmarks:
        raise InputError("has no landmarks")
    _check_names([landmark.name for landmark in landmarks], "landmark")
    partners = {landmark.name: landmark.partner for landmark in landmarks if landmark.partner}
    for name, partner in partners.items():
        if partners.get(partner) != name:
            raise InputError(
                f"'{name}' has the mirror partner '{partner}', but '{name}' is not the mirror partner of "
                f"'{partner}'",
                "landmarks",
            )
    names = {landmark.name for landmark in landmarks}
    measures = tuple(
        _measure(value, names, f"measures[{number}]")
        for number, value in enumerate(_list(fields, "measures"))
    )
    _check_names([measure.name for measure in measures], "measure")
    name = _text(fields, "name", "", needed=True)
    return Template(
        name, _text(fields, "title", "") or name, landmarks, measures, _text(fields, "source", "")
    )


def _landmark(data: Any, where: str) -> Landmark:
    fields = _fields(data, ("name", "partner", "about"), where)
    name = _text(fields, "name", where, needed=True)
    if len(name) > LONGEST_LANDMARK_NAME:
        raise InputError(f"the name of a landmark is longer than {LONGEST_LANDMARK_NAME} characters", where)
    return Landmark(name, partner=_text(fields, "partner", where), about=_text(fields, "about", where))


def _measure(data: Any, names: set[str], where: str) -> Measure:
    measure = measure_of(data, where)
    for name in measure.landmarks:
        if name not in names:
            raise InputError(f"the template has no landmark {shortened(name)!r}", where)
    return measure


def _fields(data: Any, known: tuple[str, ...], where: str) -> dict[str, Any]:
    if not isinstance(data, dict):
        raise InputError("is not a JSON object", where or None)
    for name in data:
        if name not in known:
            raise InputError(f"has an unknown field '{shortened(name)}'", where or None)
    return data


def _list(fields: Mapping[str, Any], key: str, where: str = "") -> list[Any]:
    values = fields.get(key, [])
    if not isinstance(values, list) or len(values) > _MOST:
        raise InputError(f"'{key}' is not a list of at most {_MOST} entries", where or None)
    return values


def _text(fields: Mapping[str, Any], key: str, where: str, *, needed: bool = False) -> str:
    value = fields.get(key, "")
    if not isinstance(value, str) or not (value.isprintable() and len(value) <= _LONGEST):
        raise InputError(f"'{key}' must be one line of text, not {shortened(value)}", where or None)
    if (needed and value.strip() != value) or (needed and not value):
        raise InputError(f"'{key}' is missing, or has blanks at its start or end", where or None)
    return value


def _check_names(names: list[str], what: str) -> None:
    if len(set(names)) < len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise InputError(f"the {what} '{shortened(twice)}' appears twice")


def template_of(name: str, landmarks: Sequence[Landmark], measures: Sequence[Measure]) -> Template:
    """The template of landmarks that are there, wherever they are set, and of the measures of them.

    Partners that do not name each other are left out, and measures of a kind that is not known. Raises
    InputError where there is no landmark.
    """
    if not landmarks:
        raise InputError("A template needs at least one landmark.")
    partners = {one.name: one.partner for one in landmarks}
    listed = tuple(
        Landmark(
            one.name, partner=one.partner if partners.get(one.partner) == one.name else "", about=one.about
        )
        for one in landmarks
    )
    return Template(name, name, listed, tuple(one for one in measures if _is_usable(one, partners)))


def _is_usable(measure: Measure, names: Collection[str]) -> bool:
    try:
        kind_of(measure)
    except InputError:
        return False
    return all(name in names for name in measure.landmarks)


def save_template(path: Path | str, template: Template) -> None:
    """Write a template as `read_template` reads it, without where landmarks are set. Raises InputError."""
    landmarks = [
        {"name": one.name} | {key: text for key in ("partner", "about") if (text := getattr(one, key))}
        for one in template.landmarks
    ]
    measures = [
        {"name": one.name, "kind": one.kind, "landmarks": list(one.landmarks)}
        | ({"options": dict(one.options)} if one.options else {})
        for one in template.measures
    ]
    data = {
        "format": _FORMAT, "name": template.name, "title": template.title, "source": template.source,
        "landmarks": landmarks, "measures": measures,
    }  # fmt: skip
    save_json(path, data)

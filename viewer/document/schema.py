"""The schema of what is kept as JSON: documents and sessions, recordings, the text in pictures, settings.

The declarations are the dataclasses themselves: what a file may hold is what the types of their fields say,
and `Annotated` with a `Kind` where a type alone does not say enough. The library cattrs goes through them;
here it is set to be strict, to read parameters and cameras as the rest of the project does, and to say what
is wrong as a user reads it.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import cache, partial
from pathlib import Path
from types import UnionType
from typing import (
    TYPE_CHECKING,
    Annotated,
    Any,
    Literal,
    TypeVar,
    Union,
    get_args,
    get_origin,
    get_type_hints,
)

from ..backends import backend
from ..camera import Camera
from ..errors import InputError, explained, shortened, unknown_name
from ..files import parsed_json, read_text
from ..output.export import read_description
from ..params import describe, parse, renamed
from ..scan.averaging import MOST_FRAMES
from ..scan.reading.corrections import Corrections
from ..scan.times import FPS_LIMITS
from ..scan.units import checked_unit

if TYPE_CHECKING:
    from cattrs import Converter

T = TypeVar("T")


class NewerFormatError(InputError):
    """File of a later Scan4D, whose format is not known here."""


DAMAGED = "The file is damaged, or another program wrote it. Create the file again with Scan4D"
_MOST_BYTES = 256 * 2**20
_MOST_SECONDS = 86_400.0
_LATEST = 1e12  # seconds, of a scan
_LONGEST_WORD = 200
_DEEPEST = 40  # levels of what is kept unread
_KEPT = (
    "Scan4D stores only bool, int, float, str, None, tuple[...], Mapping[str, ...], frozen "
    "dataclasses of these"
)


@dataclass(frozen=True)
class Kind:
    """Rule for the values of a type: what they are, in words, and which of them fit."""

    words: str
    fits: Callable[[Any], bool]


@dataclass(frozen=True)
class ReadBy:
    """How values of a type are read from plain ones; the function raises InputError."""

    read: Callable[[Any], Any]


def _is_word(value: str) -> bool:
    return value.isprintable() and 0 < len(value) <= _LONGEST_WORD


def _is_unit(value: str) -> bool:
    return _is_word(value) and checked_unit(value) == value


def _is_name(value: str) -> bool:
    """Whether the system takes it for the name of a file."""
    try:
        return value != "" and b"\0" not in os.fsencode(value)
    except UnicodeEncodeError:
        return False


def is_object(value: Any) -> bool:
    """Whether a plain value is a JSON object."""
    return isinstance(value, dict)


def _is_stamp(value: float) -> bool:
    return 0 <= value <= _MOST_SECONDS


Word = Annotated[str, Kind("a word", _is_word)]
Unit = Annotated[str, Kind("a unit", _is_unit)]
Hash = Annotated[str, Kind("a hash", _is_word)]
ScanName = Annotated[str, Kind("the name of a scan", _is_name)]
Count = Annotated[int, Kind("a whole number", lambda value: 0 <= value < 2**31)]
PoseNumber = Annotated[int, Kind("the index of a frame", lambda value: 0 <= value < 2**31)]
Time = Annotated[float, Kind("a time in seconds", lambda value: abs(value) <= _LATEST)]
AverageFrames = Annotated[
    int, Kind("0, or a number of frames from 2 to 64", lambda value: value == 0 or 2 <= value <= MOST_FRAMES)
]
FrameRate = Annotated[float, Kind("frames a second", lambda value: FPS_LIMITS[0] <= value <= FPS_LIMITS[1])]
Stamp = Annotated[float, Kind("a time from 0 to 86400 s", _is_stamp)]
Values = Annotated[Any, Kind("an object with named values", is_object)]


def _read_corrections(data: Any) -> dict[str, str]:
    if not is_object(data) or not all(isinstance(text, str) for text in data.values()):
        raise InputError(f"must be an object with texts, not {shortened(data)}", hint=DAMAGED)
    return dict(Corrections.parse(data).texts)


CorrectedTexts = Annotated[Mapping[str, str], ReadBy(_read_corrections)]


def _known_backend(value: Any) -> str:
    if not isinstance(value, str):
        raise _Unfit("the name of a renderer", value)
    return backend(value).name


BackendName = Annotated[str, ReadBy(_known_backend)]


def read_json(path: Path) -> Any:
    """The JSON of a file, or of the description in a picture. Raises InputError, which names the file."""
    try:
        is_picture = path.suffix.lower() in (".png", ".exr")
        return parsed_json(read_description(path) if is_picture else read_text(path, _MOST_BYTES))
    except OSError as error:
        what, hint = explained(error)
        raise InputError(f"cannot be read: {what}", path, hint) from error
    except ValueError as error:  # of the text's encoding as well
        raise InputError(f"is not JSON ({error})", path, DAMAGED) from error


def structured(kind: type[T], data: Any, where: object = None) -> T:
    """The value of plain JSON data, by the types of the fields of `kind`.

    Raises InputError, which names the position within the data after `where`.
    """
    from cattrs.errors import BaseValidationError

    try:
        return _converter().structure(data, kind)
    except (BaseValidationError, InputError, _Unfit) as error:
        raise _in_words(error, where) from None


def usable(default: T, data: Any) -> T:
    """A dataclass with those values of plain JSON data that can be used; `default` has the others.

    Each value is read by itself, also those of dataclasses within. Nothing is raised.
    """
    values: Any = default
    if not is_object(data):
        return values
    kind = type(default)
    given = renamed(kind, data) if _is_declaration(kind) else data
    for name, read in _readers(default).items():
        if name in given:
            with suppress(InputError, RecursionError):
                values = replace(values, **{name: read(given[name])})
    return values


def _readers(default: Any) -> dict[str, Callable[[Any], Any]]:
    """Readers of a dataclass's fields: as a parameter, value by value, or whole."""
    kind = type(default)
    if _is_declaration(kind):
        return {parameter.name: parameter.parse for parameter in describe(kind)}
    hints = get_type_hints(kind, include_extras=True)
    now = {field.name: getattr(default, field.name) for field in fields(kind)}
    return {
        name: partial(usable, value) if is_dataclass(value) else partial(structured, hints[name])
        for name, value in now.items()
    }


def plain(value: Any) -> Any:
    """A value as JSON has it, which `structured` reads again."""
    if is_dataclass(value):
        return {field.name: plain(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, Mapping):
        return {name: plain(inner) for name, inner in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(inner) for inner in value]
    return value


def check_declaration(kind: Any, where: str) -> None:
    """Check that values of a type never change and can be kept as JSON, and if it is a dataclass those of its
    fields. where: the name that it has in the message of a TypeError."""
    if kind in (*_PLAIN, None, type(None), Camera):
        return
    origin, inner = get_origin(kind), get_args(kind)
    if origin is Literal:
        return
    if origin is Annotated:
        if not isinstance(inner[1], ReadBy):
            check_declaration(inner[0], where)
    elif origin in (Union, UnionType, tuple) or (origin is Mapping and inner[0] is str):
        for one in inner[origin is Mapping :]:
            if one is not Ellipsis:
                check_declaration(one, where)
    elif isinstance(kind, type) and is_dataclass(kind):
        if not kind.__dataclass_params__.frozen:  # type: ignore[attr-defined]
            raise TypeError(f"{where}: {kind.__name__} is mutable; declare it with @dataclass(frozen=True)")
        hints = get_type_hints(kind, include_extras=True)
        for field in fields(kind):
            check_declaration(hints[field.name], f"{kind.__name__}.{field.name}")
    else:
        name = kind.__name__ if isinstance(kind, type) and origin is None else kind
        raise TypeError(f"{where} cannot be stored as {name}: {_KEPT}")


def check_storable(value: Any, name: str, known: Any = None) -> None:
    """Check that a value of a declared dataclass is read again from JSON as it is.

    known: one of the same kind that was checked; what its tuples have in common with the value's, as the very
    same objects, is not checked again. Raises TypeError, which names the position within it after `name`:
    "notes.all[0].position".
    """
    if type(known) is type(value):
        try:
            return _check_storable(_new_in(value, known), name)
        except (TypeError, InputError):
            pass  # reported with its position in the whole
    _check_storable(value, name)


def _new_in(value: Any, known: Any) -> Any:
    """A dataclass's value with those elements of its tuples of any length alone that another one lacks."""
    hints, new = get_type_hints(type(value)), {}
    for field in fields(value):
        now, before = getattr(value, field.name), getattr(known, field.name)
        of_any_length = get_origin(hints[field.name]) is tuple and get_args(hints[field.name])[-1] is Ellipsis
        if of_any_length and type(now) is tuple and type(before) is tuple:
            held = {id(one) for one in before}
            new[field.name] = tuple(one for one in now if id(one) not in held)
    return replace(value, **new)


def _check_storable(value: Any, name: str) -> None:
    from cattrs.errors import BaseValidationError

    try:
        again = _converter().structure(plain(value), type(value))
    except (BaseValidationError, InputError, _Unfit) as error:
        path, cause = _first(error)
        where = ".".join(filter(None, (name, path)))
        if isinstance(cause, _Unfit):
            expected = cause.words.replace("a list", "a tuple")  # which JSON has as a list
            raise TypeError(f"{where} must be {expected}, not {_typed(cause.value)}") from None
        raise TypeError(f"{where} cannot be stored: {cause}") from None
    if again != value:
        where, kept, read = _difference(value, again, name)
        raise TypeError(f"{where} does not survive saving: {_typed(kept)} would become {_typed(read)}")


def _typed(value: Any) -> str:
    return f"{shortened(value)} ({type(value).__name__})"


def _difference(value: Any, other: Any, where: str) -> tuple[str, Any, Any]:
    """The innermost position where two values differ, and what each has there."""
    within: list[tuple[str, Any, Any]] = []
    if type(value) is type(other) and is_dataclass(value):
        names = [field.name for field in fields(value)]
        within = [(f"{where}.{name}", getattr(value, name), getattr(other, name)) for name in names]
    elif isinstance(value, tuple) and isinstance(other, tuple):
        within = [(f"{where}[{n}]", *pair) for n, pair in enumerate(zip(value, other, strict=True))]
    elif isinstance(value, Mapping) and isinstance(other, Mapping):
        within = [(f"{where}.{name}", value[name], other[name]) for name in value]
    for inner, one, another in within:
        if one != another:
            return _difference(one, another, inner)
    return where, value, other


def unread(value: Any, depth: int = 0) -> Any:
    """Plain data of a kind that is not known here, to be kept as it is. Raises InputError where it is
    nested so deeply that it could not be written again."""
    if depth > _DEEPEST:
        raise InputError("is nested too deeply", hint=DAMAGED)
    for inner in value.values() if isinstance(value, dict) else value if isinstance(value, list) else ():
        unread(inner, depth + 1)
    return value


def check_format(data: Mapping[str, Any], expected: int, where: object) -> None:
    """Check that JSON data has a format. Raises InputError where it has none, or another one."""
    from .. import __version__

    found = data.get("format")
    if type(found) is not int or found != expected:
        what = f"has the format {found!r:.40}, but this version of Scan4D ({__version__}) reads {expected}"
        kind = NewerFormatError if type(found) is int and found > expected else InputError
        raise kind(what, where, f"Use version {data.get('version')!r:.40} of Scan4D, which wrote the file")


# --- how the library reads ------------------------------------------------------------------


class _Unfit(Exception):
    """A value that is not of its kind."""

    def __init__(self, words: str, value: Any) -> None:
        super().__init__(words, value)
        self.words, self.value = words, value


_PLAIN: dict[type, Kind] = {
    bool: Kind("true or false", lambda value: type(value) is bool),
    int: Kind("a whole number", lambda value: type(value) is int),
    float: Kind("a finite number", lambda value: type(value) in (int, float) and _is_finite(value)),
    str: Kind("a text", lambda value: type(value) is str),
}


def _is_finite(value: float) -> bool:
    try:
        return math.isfinite(value)
    except OverflowError:  # of hundreds of digits
        return False


@cache
def _converter() -> Converter:
    from cattrs import Converter

    converter = Converter(forbid_extra_keys=True)
    for kind, rule in _PLAIN.items():
        converter.register_structure_hook(kind, _checking(rule, kind))
    converter.register_structure_hook_func(_is_tuple, lambda data, kind: _tuple(data, kind, converter))
    converter.register_structure_hook_factory(is_dataclass, lambda kind: _reading_fields(kind, converter))
    converter.register_structure_hook_func(_is_declaration, _declaration)
    converter.register_structure_hook(Camera, lambda data, _: Camera.from_json(data))
    converter.register_structure_hook_factory(_is_annotated, lambda kind: _annotated(kind, converter))
    return converter


def _checking(rule: Kind, kind: type) -> Callable[[Any, Any], Any]:
    def read(data: Any, _: Any) -> Any:
        if not rule.fits(data):
            raise _Unfit(rule.words, data)
        return kind(data)

    return read


def _is_annotated(kind: Any) -> bool:
    return get_origin(kind) is Annotated


def _annotated(kind: Any, converter: Converter) -> Callable[[Any, Any], Any]:
    inner, *rules = get_args(kind)
    (rule,) = rules
    if isinstance(rule, ReadBy):
        return lambda data, _: rule.read(data)

    def read(data: Any, _: Any) -> Any:
        try:
            value = converter.structure(data, inner)
        except _Unfit:
            raise _Unfit(rule.words, data) from None
        if not rule.fits(value):
            raise _Unfit(rule.words, data)
        return value

    return read


def _is_tuple(kind: Any) -> bool:
    return get_origin(kind) is tuple


def _tuple(data: Any, kind: Any, converter: Converter) -> tuple[Any, ...]:
    from cattrs.cols import homogenous_tuple_structure_factory

    if not isinstance(data, list):
        raise _Unfit("a list", data)
    inner = get_args(kind)
    if inner[-1] is Ellipsis:
        return tuple(homogenous_tuple_structure_factory(kind, converter)(data, kind))
    if len(data) != len(inner):
        raise _Unfit(f"{len(inner)} values", data)
    return tuple(converter.structure(one, of) for one, of in zip(data, inner, strict=True))


def _is_declaration(kind: Any) -> bool:
    """Whether its fields are parameters (see viewer/params.py)."""
    return (
        is_dataclass(kind) and bool(fields(kind)) and all("help" in field.metadata for field in fields(kind))
    )


def _declaration(data: Any, kind: type) -> Any:
    if not isinstance(data, dict):
        raise _Unfit("an object with named values", data)
    return parse(kind, data, kind.__name__.lower().removesuffix("s"))


def _reading_fields(kind: type, converter: Converter) -> Callable[[Any, Any], Any]:
    from cattrs.gen import make_dict_structure_fn

    for name, hint in get_type_hints(kind, include_extras=True).items():
        if name in kind.__dataclass_fields__:  # type: ignore[attr-defined]
            kind.__dataclass_fields__[name].type = hint  # type: ignore[attr-defined]
    read_fields: Any = make_dict_structure_fn(kind, converter, _cattrs_forbid_extra_keys=True)

    def read(data: Any, _: Any) -> Any:
        if not isinstance(data, dict):
            raise _Unfit("an object with named values", data)
        return read_fields(data, kind)

    return read


# --- what is wrong, in words ------------------------------------------------------------------


def _in_words(error: BaseException, where: object) -> InputError:
    """The first thing that is wrong, as a user reads it."""
    path, cause = _first(error)
    outer, _, name = path.rpartition(".")

    def problem(what: str, within: str, hint: str | None = DAMAGED) -> InputError:
        return InputError(what, ", ".join(filter(None, (str(where or ""), within))) or None, hint)

    if isinstance(cause, _Unfit):
        named = f"'{name}'" if name else "It"
        return problem(f"{named} must be {cause.words}, not {shortened(cause.value)}", outer)
    if isinstance(cause, InputError):
        inner = "" if cause.where is None else f"{cause.where}: "
        return problem(inner + cause.what, path, cause.hint)
    if isinstance(cause, KeyError):
        return problem(f"has no '{cause.args[0]}'", outer)
    return problem(f"cannot be used ({shortened(str(cause))})", path)


def _first(error: BaseException) -> tuple[str, BaseException]:
    """The position of the first thing that is wrong, such as "bookmarks[2].camera", and what it is."""
    from cattrs.errors import BaseValidationError, ForbiddenExtraKeysError

    path = ""
    while isinstance(error, BaseValidationError):
        error = min(error.exceptions, key=lambda one: not isinstance(one, ForbiddenExtraKeysError))
        path += "".join(_steps(error))
    if isinstance(error, ForbiddenExtraKeysError):  # which a misspelt name is more than what it leaves out
        known = [field.name for field in fields(error.cl)]
        return path.removeprefix("."), unknown_name("field", next(iter(error.extra_fields)), known)
    return path.removeprefix("."), error


def _steps(error: BaseException) -> Iterator[str]:
    """Steps from a value to the one within it that is wrong."""
    for note in getattr(error, "__notes__", ()):
        if hasattr(note, "name"):
            yield f".{note.name}"
        elif hasattr(note, "index"):
            yield f"[{note.index}]" if isinstance(note.index, int) else f".{note.index}"

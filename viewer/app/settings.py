"""What comes back at the next start: one JSON file of the user's.

Each value is read by itself, so that a wrong one costs no other: a field of `Settings` has a reader.
Values of parameters that are the defaults are not written, since a later version may change those.
"""

from __future__ import annotations

import errno
import json
import os
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, field, is_dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

from ..backends import backend
from ..camera import Camera
from ..document.document import Bookmark, Document
from ..document.saved_session import SavedSession
from ..document.schema import PoseNumber, Unit, structured
from ..errors import InputError
from ..files import parsed_json, read_text, whole_file
from ..look import COLOR_BY, Look
from ..output.marks import Marks
from ..params import describe, renamed
from . import theme
from .output.export_plan import Choices
from .place import Place
from .playing.player import Pace
from .scene import legend, turntable
from .session import Session

T = TypeVar("T")
FORMAT = 1
FILE = "settings.json"
MOST_RECENT = 15
_OF_ONE_SCAN = ("up", "low", "high")  # of a look: no use for the next scan
_MOST_BYTES = 32 * 2**20  # of the file
_WRONG = (  # by odd JSON
    InputError, TypeError, ValueError, KeyError, AttributeError, ArithmeticError, RecursionError,
)  # fmt: skip


@dataclass(frozen=True)
class Settings:
    """The choices that outlive the window.

    window: None until it was open once. backend: None for the scan's own default. params: backend ->
    its `Params`. marks: over the view. cube: whether the orientation cube is shown. turn_seconds: of the
    turntable. export, export_marks: of the export dialog. recent: the scans opened last, newest first.
    places: what earlier versions kept here of each scan, whose documents have files of their own now.
    tools: name of a tool -> values of its `Settings` that are not the defaults.
    """

    window: Place | None = None
    theme: str = theme.DEFAULT
    text_scale: float = 1.0
    backend: str | None = None
    params: Mapping[str, Any] = field(default_factory=dict)
    look: Look = field(default_factory=Look)
    pace: Pace = field(default_factory=Pace)
    marks: Marks = legend.SHOWN_FIRST
    cube: bool = True
    turn_seconds: float = turntable.USUAL
    export: Choices = field(default_factory=Choices)
    export_marks: Marks = field(default_factory=Marks)
    recent: tuple[str, ...] = ()
    places: Mapping[str, SavedSession] = field(default_factory=dict)
    tools: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)

    @classmethod
    def of(cls, session: Session, **others: Any) -> Settings:
        """Settings of what a session holds, and of other fields by name."""
        now = session.document
        params = {
            name: of for name, of in now.params.items() if is_dataclass(of)
        }  # of backends that are there
        return cls(
            backend=now.backend, params=params, look=now.look, pace=session.pace, **others
        )  # fmt: skip

    @property
    def document(self) -> Document:
        """The document of a scan that was never open."""
        return Document(look=self.look, backend=self.backend, params=self.params)

    def to_json(self) -> dict[str, Any]:
        """A JSON object."""
        data = {"format": FORMAT} | asdict(replace(self, places={}))
        del data["places"]
        data["params"] = {name: chosen(values) for name, values in self.params.items()}
        data["look"] = {k: value for k, value in chosen(self.look).items() if k not in _OF_ONE_SCAN}
        return data

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Settings:
        """Use what can be used of a JSON object, whatever is in it; the defaults hold for the rest."""
        usable = cls(**_usable(data, _READERS))
        return replace(usable, places=_places(data.get("places"), usable.document))


def load(path: Path) -> tuple[Settings, list[str]]:
    """The settings of a file, the defaults where there is none, and what the user should know.

    A file that is damaged or of another version is put aside, and all starts anew.
    """
    try:
        data = parsed_json(read_text(path, _MOST_BYTES))
    except FileNotFoundError:
        return Settings(), []
    except OSError as error:
        if error.errno == errno.EINVAL:  # too long, or no plain file
            return Settings(), [_put_aside(path, error.strerror or str(error))]
        return Settings(), [str(InputError(f"cannot be read ({error.strerror})", path, "All starts anew"))]
    except ValueError:  # of encoding as well
        return Settings(), [_put_aside(path, "is damaged")]
    if not isinstance(data, dict) or data.get("format") != FORMAT:
        return Settings(), [_put_aside(path, "is of another version of Scan4D")]
    return Settings.from_json(data), []


def save(settings: Settings, path: Path) -> None:
    """Write the file, and its folder. Raises InputError where it cannot be written."""
    text = json.dumps(settings.to_json(), indent=1)
    with whole_file(path) as temporary:
        path.parent.mkdir(parents=True, exist_ok=True)
        temporary.write_text(text + "\n", encoding="utf-8")


def chosen(values: Any) -> dict[str, Any]:
    """The values of a declaration that are not its defaults."""
    read = {parameter.name: getattr(values, parameter.name) for parameter in describe(type(values))}
    return {name: value for name, value in read.items() if value != getattr(type(values)(), name)}


def _put_aside(path: Path, what: str) -> str:
    kept = path.with_name(f"{path.stem}.old{path.suffix}")
    try:
        os.replace(path, kept)
    except OSError as error:
        return str(InputError(f"{what}, and cannot be moved ({error.strerror})", path, "All starts anew"))
    return str(InputError(what, path, f"It is kept as {kept.name}; all starts anew"))


# --- reading what may be wrong ----------------------------------------------------------------


def _usable(data: Mapping[str, Any], readers: Mapping[str, Callable[[Any], Any]]) -> dict[str, Any]:
    """The values that their readers take, by name; what is wrong or has no reader is left out."""
    values = {}
    for name, read in readers.items():
        with suppress(*_WRONG):
            values[name] = read(data[name])
    return values


def declared(cls: type[T], data: Mapping[str, Any], default: T | None = None) -> T:
    """An instance of a declaration (see viewer/params.py) with those values that it takes."""
    values: Any = cls() if default is None else default
    now = renamed(cls, data)
    current = {now.get(name, name): value for name, value in data.items()}
    for parameter in describe(cls):
        with suppress(*_WRONG):
            values = replace(values, **{parameter.name: parameter.parse(current[parameter.name])})
    return values


def _look(data: Mapping[str, Any]) -> Look:
    look = declared(Look, {name: value for name, value in data.items() if name not in _OF_ONE_SCAN})
    return look if look.color_by in COLOR_BY else replace(look, color_by="auto")  # a scalar of one scan


def _params(data: Mapping[str, Any]) -> dict[str, Any]:
    read = {}
    for name, values in data.items():
        with suppress(*_WRONG):
            read[name] = declared(backend(name).module.Params, values)
    return read


def _theme(data: Any) -> str:
    if data not in theme.PALETTES:
        raise InputError("there is no such theme")
    return str(data)


def _window(data: Any) -> Place:
    numbers = [data[name] for name in ("left", "top", "width", "height")]
    if not all(type(number) is int and abs(number) < 2**15 for number in numbers):
        raise InputError("is no place of a window")
    left, top, width, height = numbers
    return Place(left, top, width, height, data.get("maximised") is True)


def _text_scale(data: Any) -> float:
    if data not in theme.TEXT_SCALES:
        raise InputError("there is no such size of text")
    return float(data)


def _turn_seconds(data: Any) -> float:
    if data not in turntable.SECONDS:
        raise InputError("there is no such time for a turn")
    return float(data)


def _text(data: Any) -> str:
    if not isinstance(data, str) or not data or "\0" in data:
        raise InputError("is no text")
    os.fsencode(data)  # else it cannot be shown, nor be a path
    return data


def _recent(data: Any) -> tuple[str, ...]:
    return tuple(dict.fromkeys(_text(name) for name in data))[:MOST_RECENT]


def _places(data: Any, document: Document) -> dict[str, SavedSession]:
    """How earlier versions left each scan. document: of one that was never open."""
    places = {}
    for name, left in data.items() if isinstance(data, dict) else ():
        with suppress(*_WRONG):
            fields = _usable(left, _OF_A_SCAN)
            index = fields.pop("index", 0)
            places[_text(name)] = SavedSession(name, None, index, replace(document, **fields))
    return places


def _tools(data: Any) -> dict[str, dict[str, Any]]:
    """Settings of tools as the file has them: each tool reads its own."""
    return {_text(name): values for name, values in data.items() if isinstance(values, dict)}


_READERS: dict[str, Callable[[Any], Any]] = {
    "window": _window,
    "theme": _theme,
    "text_scale": _text_scale,
    "backend": lambda data: backend(data).name,
    "params": _params,
    "look": _look,
    "pace": lambda data: declared(Pace, data),
    "marks": lambda data: declared(Marks, data, legend.SHOWN_FIRST),
    "cube": lambda data: data is not False,
    "turn_seconds": _turn_seconds,
    "export": lambda data: declared(Choices, data),
    "export_marks": lambda data: declared(Marks, data),
    "recent": _recent,
    "tools": _tools,
}
_OF_A_SCAN: dict[str, Callable[[Any], Any]] = {
    "index": partial(structured, PoseNumber),
    "camera": Camera.from_json,
    "unit": partial(structured, Unit),
    "bookmarks": partial(structured, tuple[Bookmark, ...]),
}

"""What comes back at the next start: one JSON file of the user's.

Each value is read by itself, by the type of its field in `Settings`, so that a wrong one costs no other.
Values of parameters that are the defaults are not written, since a later version may change those.
"""

from __future__ import annotations

import errno
import json
import os
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, field, is_dataclass, replace
from pathlib import Path
from typing import Annotated, Any, TypeVar

from ..backends import backend
from ..document.document import Document, KeptGoal
from ..document.schema import (
    BackendName,
    Kind,
    ReadBy,
    ScanName,
    Values,
    is_object,
    structured,
    unread,
    usable,
)
from ..errors import InputError
from ..files import parsed_json, read_text, whole_file
from ..look import Look
from ..output.legend import Marks
from ..params import describe
from . import drawer, theme
from .files.scans import MOST_RECENT
from .output.export_plan import Choices
from .panel import PanelChoices
from .place import Place
from .playing.player import Pace
from .scene import legend, turntable
from .session import Session

T = TypeVar("T")
FORMAT = 1
FILE = "settings.json"
_MOST_BYTES = 32 * 2**20  # of the file
ThemeName = Annotated[str, Kind("a theme", theme.PALETTES.__contains__)]
TextScale = Annotated[float, Kind("a size of text", theme.TEXT_SCALES.__contains__)]
TurnTime = Annotated[float, Kind("a time for a turn", turntable.SECONDS.__contains__)]


def _by_name(data: Any, read: Callable[[str, Any], T]) -> dict[str, T]:
    """Values by name as `read` gives them of name and value; those that it refuses are left out."""
    found = {}
    for name, value in data.items() if is_object(data) else ():
        with suppress(InputError):
            found[name] = read(name, value)
    return found


def _read_params(data: Any) -> dict[str, Any]:
    return _by_name(data, lambda name, values: usable(backend(name).params(), values))


def _read_tools(data: Any) -> dict[str, Any]:
    """Settings of tools as the file has them: each tool reads its own."""
    return _by_name(data, lambda _, values: unread(structured(Values, values)))


def _read_recent(data: Any) -> tuple[str, ...]:
    return tuple(dict.fromkeys(structured(tuple[ScanName, ...], data)))[:MOST_RECENT]


@dataclass(frozen=True)
class Settings:
    """The choices that outlive the window.

    window: None until it was open once. backend, params, goal: what the user chose for all scans, see
    `Session.for_all`. marks: over the view. marks_in_files: whether
    saved pictures have them. cube: whether the orientation cube is shown. turn_seconds: of the turntable.
    export, export_marks: of the export dialog. recent: the scans opened last, newest first. places: what
    earlier versions kept here of each scan, whose documents have files of their own now.
    panel: its width, and which of its sections are open. drawer: its height. glide: whether views glide.
    point_details: whether the status bar has all that is known of the point under the mouse.
    slow_devices: those of which the user was told that they draw in software. welcomed: whether the card of
    the first start was seen.
    tools: name of a tool -> values of its `Settings` that are not the defaults.
    """

    window: Place | None = None
    theme: ThemeName = theme.DEFAULT
    text_scale: TextScale = 1.0
    backend: BackendName | None = None
    params: Annotated[Mapping[str, Any], ReadBy(_read_params)] = field(default_factory=dict)
    goal: KeptGoal = None
    look: Look = field(default_factory=Look)
    pace: Pace = field(default_factory=Pace)
    marks: Marks = legend.SHOWN_FIRST
    marks_in_files: bool = True
    cube: bool = True
    turn_seconds: TurnTime = turntable.USUAL
    export: Choices = field(default_factory=Choices)
    export_marks: Marks = field(default_factory=lambda: Marks(plot=True))  # where it is shown
    recent: Annotated[tuple[str, ...], ReadBy(_read_recent)] = ()
    panel: PanelChoices = field(default_factory=PanelChoices)
    drawer: drawer.DrawerHeight = drawer.USUAL
    glide: bool = True
    point_details: bool = False
    welcomed: bool = False
    slow_devices: tuple[str, ...] = ()
    tools: Annotated[Mapping[str, Mapping[str, Any]], ReadBy(_read_tools)] = field(default_factory=dict)

    @classmethod
    def of(cls, session: Session, **others: Any) -> Settings:
        """Settings of what a session holds, and of other fields by name."""
        look, for_all = session.document.look.of_any_scan, session.for_all
        params = {
            name: of for name, of in for_all.params.items() if is_dataclass(of)
        }  # of backends that are there
        return cls(
            backend=for_all.backend, params=params, goal=for_all.goal, look=look, pace=session.pace, **others
        )  # fmt: skip

    @property
    def document(self) -> Document:
        """The document of a scan that was never open."""
        return Document(look=self.look, backend=self.backend, params=self.params, goal=self.goal)

    def to_json(self) -> dict[str, Any]:
        """A JSON object."""
        data = {"format": FORMAT} | asdict(self)
        data["params"] = {name: chosen(values) for name, values in self.params.items()}
        data["look"] = chosen(self.look.of_any_scan)
        return data

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Settings:
        """Use what can be used of a JSON object, whatever is in it; the defaults hold for the rest."""
        read = usable(cls(), data)
        return replace(read, look=read.look.of_any_scan)


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
        return Settings(), [
            str(InputError(f"cannot be read ({error.strerror})", path, "Scan4D starts with the defaults"))
        ]
    except ValueError:  # of encoding as well
        return Settings(), [_put_aside(path, "is damaged")]
    if not isinstance(data, dict) or data.get("format") != FORMAT:
        return Settings(), [_put_aside(path, "is of another version of Scan4D")]
    return Settings.from_json(data), []


def save(settings: Settings, path: Path) -> None:
    """Write the file. Raises InputError where it cannot be written."""
    text = json.dumps(settings.to_json(), indent=1)
    with whole_file(path) as temporary:
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
        what = f"{what}, and cannot be moved ({error.strerror})"
        return str(InputError(what, path, "Scan4D starts with the defaults"))
    return str(InputError(what, path, f"It is kept as {kept.name}; Scan4D starts with the defaults"))

"""Which keys do what: the usual ones, and those of the user's file."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Protocol

from imgui_bundle import imgui

from ..errors import InputError, did_you_mean, shortened, unknown_name
from ..files import parsed_toml, read_text, whole_file
from .commands import Command


class CommandTable(Protocol):
    """The table of commands, see `menus.Commands`."""

    of: Mapping[str, Command]
    tool_of: Mapping[str, str]


FILE = "keys.toml"
_MOST_BYTES, _MOST_SHOWN = 64 * 2**10, 5
_MODIFIERS = {"Ctrl": imgui.Key.mod_ctrl, "Shift": imgui.Key.mod_shift, "Alt": imgui.Key.mod_alt}
_NAMED = {
    "Space": "space", "Enter": "enter", "Tab": "tab", "Backspace": "backspace", "Delete": "delete",
    "Insert": "insert", "Right": "right_arrow", "Left": "left_arrow", "Up": "up_arrow", "Down": "down_arrow",
    "Home": "home", "End": "end", "PageUp": "page_up", "PageDown": "page_down", "[": "left_bracket",
    "]": "right_bracket", ",": "comma", ".": "period", "-": "minus", "=": "equal", "/": "slash",
    ";": "semicolon", "'": "apostrophe", "\\": "backslash", "`": "grave_accent",
}  # fmt: skip
KEYS = {
    **{name: getattr(imgui.Key, attribute) for name, attribute in _NAMED.items()},
    **{letter: getattr(imgui.Key, letter.lower()) for letter in "ABCDEFGHIJKLMNOPQRSTUVWXYZ"},
    **{digit: getattr(imgui.Key, f"_{digit}") for digit in "0123456789"},
    **{f"F{n}": getattr(imgui.Key, f"f{n}") for n in range(1, 13)},
}
MODIFIER_BITS = sum(int(bit) for bit in _MODIFIERS.values())
ARROWS = {"Right": (1, 0), "Left": (-1, 0), "Up": (0, 1), "Down": (0, -1)}
_HEAD = """\
# The keys of Scan4D. Remove the '#' at the start of a line and change its keys; "" means no key.
# Scan4D reads this file when it starts. Keys: letters, digits, F1 to F12, {named}. Write Ctrl+, Shift+
# or Alt+ before a key, and a space between several keys. Escape stops what is going on; its key is fixed.

[keys]
"""


def chord(text: str) -> int:
    """The ImGui chord of keys such as "Ctrl+Shift+1". Raises InputError."""
    *modifiers, key = text.split("+") if text != "+" else [text]
    for name in modifiers:
        if name not in _MODIFIERS:
            raise unknown_name("modifier key", name, list(_MODIFIERS))
    if key.upper() not in KEYS and key not in KEYS:
        raise unknown_name("key", key, list(KEYS))
    value = int(KEYS.get(key, KEYS.get(key.upper(), 0)))
    for name in modifiers:
        value |= int(_MODIFIERS[name])
    return value


def chords(text: str) -> list[int]:
    """The chords of keys with a space between, such as "Ctrl+Y Ctrl+Shift+Z". Raises InputError."""
    return [chord(keys) for keys in text.split()]


class Keys:
    """The keys of every command.

    of: command's name -> its keys as text, empty for none. chords: names of commands, each with the ImGui
    chord of keys that it has.
    """

    def __init__(self, commands: CommandTable, changes: Mapping[str, str] | None = None) -> None:
        """changes: command's name -> its keys, where they are not the usual ones."""
        self._titles = {name: command.title for name, command in commands.of.items()}
        self.of: dict[str, str] = {name: command.key for name, command in commands.of.items()} | dict(
            changes or {}
        )
        self.chords = [(name, keys) for name, text in self.of.items() for keys in chords(text)]

    def has(self, keys: str) -> bool:
        """Whether a command has these keys."""
        wanted = chord(keys)
        return any(pressed == wanted for _, pressed in self.chords)

    def hint(self, name: str) -> str:
        """A command's title, and its keys where it has some."""
        keys, title = self.of[name], self._titles[name]
        return f"{title} ({keys})" if keys else title

    @property
    def is_arrow_held(self) -> bool:
        """Whether an arrow key is down: what it repeats is one step."""
        return any(imgui.is_key_down(KEYS[name]) for name in ARROWS)


def load_keys(path: Path, commands: CommandTable) -> tuple[Keys, list[str]]:
    """The keys that a TOML file gives, and what is wrong in it; the usual keys where there is no file.

    What is wrong is left out: the usual keys hold for it. Of two commands whose usual keys are the same, as
    tools may bring them, the later one has none.
    """
    given, problems = _read(path)
    changes = _checked(given, commands, problems)
    shown = [
        str(InputError(problem.what, problem.where or path, problem.hint))
        for problem in problems[:_MOST_SHOWN]
    ]
    if len(problems) > _MOST_SHOWN:
        shown.append(f"{path}: {len(problems) - _MOST_SHOWN} more lines have errors")
    return Keys(commands, changes), shown


def _read(path: Path) -> tuple[dict[str, Any], list[InputError]]:
    """The content of a TOML file, and why it cannot be read; nothing where there is no file."""
    try:
        return parsed_toml(read_text(path, _MOST_BYTES)), []
    except FileNotFoundError:
        return {}, []
    except (OSError, ValueError) as error:  # of encoding and of TOML as well
        what = getattr(error, "strerror", None) or error
        return {}, [InputError(f"cannot be read ({what})", hint="Scan4D uses the default keys")]


def _checked(given: Mapping[str, Any], commands: CommandTable, problems: list[InputError]) -> dict[str, str]:
    """The keys of a file that can be used; what cannot is added to the problems."""
    problems += [unknown_name("table", name, ["keys"]) for name in given if name != "keys"]
    table = given.get("keys", {})
    if not isinstance(table, dict):
        problems.append(
            InputError(
                "'keys' is not a TOML table", hint="Write the line [keys] above the lines that set keys"
            )
        )
        table = {}
    changes = {}
    for name, text in table.items():
        try:
            if name not in commands.of:
                hint = f"{did_you_mean(name, commands.of)}F1 lists all commands"
                raise InputError(f"unknown command '{shortened(name)}'", hint=hint)
            if not isinstance(text, str):
                raise InputError(f"the value of '{name}' is not a text", hint=f'Write {name} = "Ctrl+K"')
            chords(text)
            changes[name] = text
        except InputError as problem:
            problems.append(problem)
    return _without_clashes(changes, commands, problems)


def _without_clashes(
    changes: dict[str, str], commands: CommandTable, problems: list[InputError]
) -> dict[str, str]:
    """Leave out changes, last first, until no keys do two things."""
    usual = {name: command.key for name, command in commands.of.items()}
    while True:
        taken: dict[int, str] = {}
        for name, text in ((name, one) for name, keys in (usual | changes).items() for one in keys.split()):
            other = taken.setdefault(chord(text), name)
            if other != name:
                what = f"{text} is set for both '{other}' and '{name}'"
                guilty = next((n for n in reversed(changes) if n in (name, other)), None)
                if guilty:
                    hint = f"Set different keys for the two commands. '{guilty}' keeps its default keys"
                    problems.append(InputError(what, hint=hint))
                    del changes[guilty]
                else:
                    tool = commands.tool_of.get(name)
                    where = f"The tool '{tool}'" if tool else "The default keys"
                    hint = f"'{name}' has no keys now. Set other keys in {FILE}. F1 lists the keys in use"
                    problems.append(InputError(what, where, hint))
                    usual[name] = ""
                break
        else:
            return {name: text for name, text in (usual | changes).items() if text != commands.of[name].key}


def write_template(path: Path, commands: CommandTable) -> None:
    """Write a file that names every command and its usual keys. Raises InputError where it cannot."""
    named = " ".join(_NAMED)
    lines = [f"# {name} = {_quoted(command.key)}  # {command.title}" for name, command in commands.of.items()]
    with whole_file(path) as temporary:
        temporary.write_text(_HEAD.format(named=named) + "\n".join(lines) + "\n", encoding="utf-8")


def _quoted(text: str) -> str:
    return '"' + text.replace("\\", "\\\\") + '"'

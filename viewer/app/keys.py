"""Which keys do what: the usual ones, and those of the user's file."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from imgui_bundle import imgui

from ..errors import InputError, did_you_mean, shortened, unknown_name
from ..files import parsed_toml, read_text, whole_file
from .keyboard import VIEW

if TYPE_CHECKING:
    from .app import App
    from .commands import Commands

FILE = "keys.toml"
_MOST_BYTES, _MOST_TOLD = 64 * 2**10, 5
_MODIFIERS = {"Ctrl": imgui.Key.mod_ctrl, "Shift": imgui.Key.mod_shift, "Alt": imgui.Key.mod_alt}
_NAMED = {
    "Space": "space", "Enter": "enter", "Tab": "tab", "Backspace": "backspace", "Delete": "delete",
    "Insert": "insert", "Right": "right_arrow", "Left": "left_arrow", "Up": "up_arrow", "Down": "down_arrow",
    "Home": "home", "End": "end", "PageUp": "page_up", "PageDown": "page_down", "[": "left_bracket",
    "]": "right_bracket", ",": "comma", ".": "period", "-": "minus", "=": "equal", "/": "slash",
    ";": "semicolon", "'": "apostrophe", "\\": "backslash", "`": "grave_accent",
}  # fmt: skip
_KEYS = {
    **{name: getattr(imgui.Key, attribute) for name, attribute in _NAMED.items()},
    **{letter: getattr(imgui.Key, letter.lower()) for letter in "ABCDEFGHIJKLMNOPQRSTUVWXYZ"},
    **{digit: getattr(imgui.Key, f"_{digit}") for digit in "0123456789"},
    **{f"F{n}": getattr(imgui.Key, f"f{n}") for n in range(1, 13)},
}
_SHIFT = int(imgui.Key.mod_shift)
_MODIFIER_BITS = sum(int(bit) for bit in _MODIFIERS.values())
_REPEATED = int(imgui.InputFlags_.route_global | imgui.InputFlags_.repeat)  # of shortcuts
_ARROWS = {"Right": (1, 0), "Left": (-1, 0), "Up": (0, 1), "Down": (0, -1)}
# What leads the keyboard through widgets, and works them.
_WIDGETS_OWN = {
    int(_KEYS[name]) for name in (
        "Tab", "Space", "Enter", "Left", "Right", "Up", "Down", "Home", "End", "PageUp",
        "PageDown", "Backspace",
    )
}  # fmt: skip
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
    if key.upper() not in _KEYS and key not in _KEYS:
        raise unknown_name("key", key, list(_KEYS))
    value = int(_KEYS.get(key, _KEYS.get(key.upper(), 0)))
    for name in modifiers:
        value |= int(_MODIFIERS[name])
    return value


def chords(text: str) -> list[int]:
    """The chords of keys with a space between, such as "Ctrl+Y Ctrl+Shift+Z". Raises InputError."""
    return [chord(keys) for keys in text.split()]


class Keys:
    """The keys of every command. of: command's name -> its keys as text, empty for none."""

    def __init__(self, commands: Commands, changes: Mapping[str, str] | None = None) -> None:
        """changes: command's name -> its keys, where they are not the usual ones."""
        self._commands = commands.of
        self.of: dict[str, str] = {name: command.key for name, command in commands.of.items()} | dict(
            changes or {}
        )
        self._chords = [
            (self._commands[name], keys) for name, text in self.of.items() for keys in chords(text)
        ]
        self._used: imgui.Key | None = None  # the key of the last command, until it is released

    def has(self, keys: str) -> bool:
        """Whether a command has these keys."""
        wanted = chord(keys)
        return any(pressed == wanted for _, pressed in self._chords)

    def hint(self, name: str) -> str:
        """A command's title, and its keys where it has some."""
        keys, title = self.of[name], self._commands[name].title
        return f"{title} ({keys})" if keys else title

    @property
    def is_arrow_held(self) -> bool:
        """Whether an arrow key is down: what it repeats is one step."""
        return any(imgui.is_key_down(_KEYS[name]) for name in _ARROWS)

    def handle(self, app: App) -> None:
        """Do what the keys pressed since the last frame say; keys typed into a text or a dialog go there,
        and to widgets those that lead through them."""
        self._run_commands(app)
        self._drop_characters()

    def _drop_characters(self) -> None:
        """Keep the characters of a key that ran a command out of the text field that the command opened.

        The system sends a character with the key, or later, and again while the user holds the key. Another
        key ends this: what the user types next goes into the field.
        """
        if self._used is None:
            return
        others = (key for key in _KEYS.values() if key != self._used)
        if any(imgui.is_key_pressed(key, repeat=False) for key in others):
            self._used = None
            return
        imgui.get_io().input_queue_characters.clear()
        if not imgui.is_key_down(self._used):
            self._used = None

    def _run_commands(self, app: App) -> None:
        if imgui.is_popup_open("", imgui.PopupFlags_.any_popup):
            return
        is_in_widgets = app.keyboard.part != VIEW or app.help.focused is not None
        of_tool = set() if is_in_widgets else _arrows_of_tool(app)
        for command, pressed in self._chords:
            if pressed in of_tool or (is_in_widgets and pressed & ~_SHIFT in _WIDGETS_OWN):
                continue
            if not imgui.shortcut(pressed, _REPEATED if command.repeats else imgui.InputFlags_.route_global):
                continue
            with app.failures.told(command.title):
                if command.can(app):
                    self._used = imgui.Key(pressed & ~_MODIFIER_BITS)
                    command.act(app)


def _arrows_of_tool(app: App) -> set[int]:
    """The arrow keys that were pressed since the last frame and that a tool has taken, as chords."""
    return {
        pressed
        for name, way in _ARROWS.items()
        if imgui.shortcut(pressed := int(_KEYS[name]), _REPEATED) and app.tools.arrow(*way)
    }


def load_keys(path: Path, commands: Commands) -> tuple[Keys, list[str]]:
    """The keys that a TOML file gives, and what is wrong in it; the usual keys where there is no file.

    What is wrong is left out: the usual keys hold for it. Of two commands whose usual keys are the same, as
    tools may bring them, the later one has none.
    """
    given, problems = _read(path)
    changes = _checked(given, commands, problems)
    told = [
        str(InputError(problem.what, problem.where or path, problem.hint))
        for problem in problems[:_MOST_TOLD]
    ]
    if len(problems) > _MOST_TOLD:
        told.append(f"{path}: {len(problems) - _MOST_TOLD} more lines cannot be used")
    return Keys(commands, changes), told


def _read(path: Path) -> tuple[dict[str, Any], list[InputError]]:
    """The content of a TOML file, and why it cannot be read; nothing where there is no file."""
    try:
        return parsed_toml(read_text(path, _MOST_BYTES)), []
    except FileNotFoundError:
        return {}, []
    except (OSError, ValueError) as error:  # of encoding and of TOML as well
        what = getattr(error, "strerror", None) or error
        return {}, [InputError(f"cannot be read ({what})", hint="Scan4D uses the default keys")]


def _checked(given: Mapping[str, Any], commands: Commands, problems: list[InputError]) -> dict[str, str]:
    """The keys of a file that can be used; what cannot is added to the problems."""
    problems += [unknown_name("table", name, ["keys"]) for name in given if name != "keys"]
    table = given.get("keys", {})
    if not isinstance(table, dict):
        problems.append(InputError("'keys' is not a TOML table", hint="Write [keys] above the lines"))
        table = {}
    changes = {}
    for name, text in table.items():
        try:
            if name not in commands.of:
                hint = f"{did_you_mean(name, commands.of)}F1 lists them"
                raise InputError(f"unknown command '{shortened(name)}'", hint=hint)
            if not isinstance(text, str):
                raise InputError(f"the value of '{name}' is not a text", hint=f'Write {name} = "Ctrl+K"')
            chords(text)
            changes[name] = text
        except InputError as problem:
            problems.append(problem)
    return _without_clashes(changes, commands, problems)


def _without_clashes(
    changes: dict[str, str], commands: Commands, problems: list[InputError]
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
                    hint = f"Give one of them other keys. '{guilty}' keeps its usual ones"
                    problems.append(InputError(what, hint=hint))
                    del changes[guilty]
                else:
                    tool = commands.tool_of.get(name)
                    where = f"The tool '{tool}'" if tool else "The default keys"
                    hint = f"'{name}' has no keys now. Give it others in {FILE}; F1 lists the keys in use"
                    problems.append(InputError(what, where, hint))
                    usual[name] = ""
                break
        else:
            return {name: text for name, text in (usual | changes).items() if text != commands.of[name].key}


def write_template(path: Path, commands: Commands) -> None:
    """Write a file that names every command and its usual keys. Raises InputError where it cannot."""
    named = " ".join(_NAMED)
    lines = [f"# {name} = {_quoted(command.key)}  # {command.title}" for name, command in commands.of.items()]
    with whole_file(path) as temporary:
        temporary.write_text(_HEAD.format(named=named) + "\n".join(lines) + "\n", encoding="utf-8")


def _quoted(text: str) -> str:
    return '"' + text.replace("\\", "\\\\") + '"'

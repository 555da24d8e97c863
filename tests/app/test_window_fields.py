"""Keys that open a text field, in the window with real keys: the field does not take the key's character."""

from __future__ import annotations

import importlib
from collections.abc import Iterator

import numpy as np
import pytest
from scenes import rarely
from virtual_screen import RunningApp, Screen, running_app

from viewer.app import tools
from viewer.app.menus import Commands

XDO = {
    "Space": "space", "Right": "Right", "Left": "Left", "Up": "Up", "Down": "Down", "Home": "Home",
    "End": "End", "PageUp": "Prior", "PageDown": "Next", "Backspace": "BackSpace", "Enter": "Return",
    "Delete": "Delete",
    "[": "bracketleft", "]": "bracketright", ",": "comma", ".": "period", "-": "minus", "=": "equal",
    "/": "slash", ";": "semicolon", "'": "apostrophe", "\\": "backslash", "`": "grave", "Tab": "Tab",
}  # fmt: skip
# What Escape ends, in states.
KINDS = (
    "fields", "lists", "pages", "is_export_open", "is_browser_open", "clicking", "shown_notes", "works",
)  # fmt: skip
NOT_PRESSED = {"quit", "full_screen", "play", "turntable"}  # they end the window, or never come to rest


def all_keys() -> dict[str, str]:
    """The usual keys of every command, of the tools as well, by the command's name."""
    commands = Commands()
    for tool in tools.tool_names():
        module = importlib.import_module(f"{tools.__name__}.{tool}")
        for menu, entries in module.COMMANDS.items():
            commands.add(menu, list(entries), tool)
    return {name: command.key for name, command in commands.of.items() if command.key}


@pytest.fixture(scope="module")
def app(screen: Screen, tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningApp]:
    folder = tmp_path_factory.mktemp("scan")
    for number in range(2):
        np.save(folder / f"{number}.npy", np.random.default_rng(number).random((500, 3)))
    home = tmp_path_factory.mktemp("app")
    keys = home / "config" / "scan4d" / "keys.toml"
    keys.parent.mkdir(parents=True)
    keys.write_text(
        '[keys]\nkeys = "F1 Shift+U"\nsave_session_as = "Ctrl+Shift+S Alt+M"\nexport = "Ctrl+E U"\n'
        'stabilise = "F8"\ndistance_colors = "F7"\n'  # U and Shift+U are theirs
    )
    with running_app(screen, home, folder) as app:
        yield app


def pressed(app: RunningApp, keys: str) -> dict[str, str]:
    """The text fields, by their labels, once these keys were pressed."""
    *modifiers, key = keys.split("+")
    key = XDO.get(key, key if len(key) > 1 else key.lower())
    app.screen.do("key", "+".join([*map(str.lower, modifiers), key]))
    return dict(app.settle().fields)


def put_away(app: RunningApp) -> None:
    """Close what is open."""
    for _ in range(6):
        app.screen.do("key", "Escape")
        state = app.settle()
        if not any(getattr(state, kind) for kind in KINDS):
            break


def holds(fields: dict[str, str], keys: str) -> list[str]:
    """The fields that hold the character of these keys, and nothing else."""
    return [label for label, text in fields.items() if text.lower() == keys.rpartition("+")[2].lower()]


@pytest.mark.parametrize("keys", ["Q", "Shift+U", *rarely("Alt+M"), "U"])
def test_a_key_that_opens_a_field_is_not_typed_into_it(app: RunningApp, keys: str) -> None:
    fields = pressed(app, keys)
    assert fields
    assert not holds(fields, keys), fields
    put_away(app)


def test_what_is_typed_after_the_key_is_in_the_field(app: RunningApp) -> None:
    app.do(("key", "q"), ("type", "--delay", 60, "qa"))
    app.settle()
    assert app.state.fields["##filter"] == "qa"
    put_away(app)


def test_a_key_that_is_held_types_nothing(app: RunningApp) -> None:
    before = app.state.typed
    app.screen.do("keydown", "q")
    app.see(lambda state: state.typed > before + 3)
    app.screen.do("keyup", "q")
    app.settle()
    assert app.state.fields["##filter"] == ""
    put_away(app)


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(all_keys().keys() - NOT_PRESSED))
def test_no_key_of_a_command_is_typed_into_a_field(app: RunningApp, name: str) -> None:
    for keys in all_keys()[name].split():
        fields = pressed(app, keys)
        assert not holds(fields, keys), fields
        put_away(app)

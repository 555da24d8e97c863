"""The contract of tools: a module that declares itself, whose hooks take what the window hands them."""

from __future__ import annotations

import ast
import dataclasses
import inspect
from collections.abc import Iterator
from functools import partial
from importlib import import_module
from types import ModuleType
from typing import Any

from ..document.part import Part
from ..errors import unknown_name
from .check import Check

# The modules of the window that a tool may import.
KNOWN = ("commands", "file_dialog", "scene.canvas", "tool_context", "tools", "ui", "widgets")
# The hooks of a Tool, and how many arguments the window hands each.
HOOKS = {
    "panel": 1, "overlay": 2, "drawn": 1, "below": 1, "is_below": 0, "is_bare": 0, "dialog": 0, "prompt": 0,
    "on_click": 1, "on_press": 1, "on_drag": 2, "on_arrow": 2, "spans": 0, "on_file": 1, "on_escape": 0,
    "is_under_way": 0, "abandon": 0, "advance": 1,
}  # fmt: skip


def tool_checks(name: str) -> list[Check]:
    """The contract of the tool of this name. No check opens a window.

    Raises InputError for an unknown name.
    """
    from ..app.tools import tool_modules

    modules = tool_modules()
    if name not in modules:
        raise unknown_name("tool", name, modules)
    return [Check(f.__name__[1:], name, partial(f, modules[name])) for f in _FOR_ALL]


def _it_declares_itself(module: str) -> None:
    tool = import_module(module)
    assert (tool.__doc__ or "").strip(), "the docstring of the tool must say what the tool does"
    assert isinstance(tool.TITLE, str), "TITLE must name its section of the panel"
    assert tool.TITLE
    assert isinstance(tool.Tool, type), "Tool is a class"
    _assert_takes(tool.Tool, 1, "Tool(context)")


def _its_commands_have_names_and_titles(module: str) -> None:
    from ..app.commands import Command

    menus = getattr(import_module(module), "COMMANDS", {})
    entries = [one for entries in menus.values() for entry in entries for one in _flat(entry)]
    commands = [entry for entry in entries if isinstance(entry, Command)]
    assert len({command.name for command in commands}) == len(commands), "two commands have the same name"
    for command in commands:
        assert command.name.isidentifier(), f"'{command.name}' is not a valid name for keys.toml"
        assert command.title, f"{command.name} has no title"
        _assert_takes(command.act, 1, f"the function of {command.name}")


def _flat(entry: object) -> Iterator[object]:
    """An entry of a menu, or those of a menu within it."""
    from ..app.commands import Command, Listing, Menu

    if isinstance(entry, Menu):
        for inner in (inner for group in entry.groups for inner in group):
            yield from _flat(inner)
        return
    assert isinstance(entry, Command | Listing), f"{entry!r} is not a command: is a comma missing?"
    yield entry


def _its_hooks_take_what_they_get(module: str) -> None:
    tool = import_module(module).Tool
    for hook, count in HOOKS.items():
        if (function := getattr(tool, hook, None)) is not None:
            _assert_takes(function, count + 1, f"Tool.{hook}")


def _its_settings_have_defaults(module: str) -> None:
    settings: Any = getattr(import_module(module), "Settings", None)
    if settings is not None:
        fields = dataclasses.fields(settings)
        assert all(field.default is not dataclasses.MISSING for field in fields), (
            "every field of a document part must have a default"
        )


def _its_parts_can_be_stored(module: str) -> None:
    for part in _own(import_module(module)):
        part.check_declared()
        part()


def _it_knows_its_context_alone(module: str) -> None:
    window = f"{__package__.partition('.')[0]}.app."
    tree = ast.parse(inspect.getsource(import_module(module)))
    names = [
        f"{node.module}.{alias.name}"
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom) and node.module and not node.level
        for alias in node.names
    ]
    names += [alias.name for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names]
    for name in names:
        inner = name.removeprefix(window)
        known = inner == name or any(f"{inner}.".startswith(f"{each}.") for each in KNOWN)
        assert known, (
            f"it imports {name}; a tool may import only these parts of the window: {', '.join(KNOWN)}"
        )


_FOR_ALL = (
    _it_declares_itself,
    _its_commands_have_names_and_titles,
    _its_hooks_take_what_they_get,
    _its_settings_have_defaults,
    _its_parts_can_be_stored,
    _it_knows_its_context_alone,
)


def _own(module: ModuleType) -> Iterator[type[Part]]:
    """The parts of the document that a module defines."""
    for value in vars(module).values():
        if isinstance(value, type) and issubclass(value, Part) and value.__module__ == module.__name__:
            yield value


def _assert_takes(function: object, count: int, what: str) -> None:
    """That a function can be called with so many positional arguments."""
    assert callable(function), f"{what} is not a function"
    try:
        inspect.signature(function).bind(*range(count))
    except TypeError as error:
        raise AssertionError(f"{what} cannot be called with {count} arguments: {error}") from error

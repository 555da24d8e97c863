"""Parts of the window: found in their folder, made of what they need, and remembered."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import pytest

pytest.importorskip("imgui_bundle")

from viewer.app import part
from viewer.app.commands import Command
from viewer.app.menus import Commands
from viewer.app.part import Parts, WindowPart, part_classes, remembered, stored_values


@dataclass(eq=False)
class Lamp(WindowPart):
    name = "lamp"
    OFFERS: ClassVar = {"is_lit": "is_on", "light": "switch"}
    is_on: bool = remembered(False)

    def switch(self, is_on: bool = True) -> None:
        self.is_on = is_on


@dataclass(eq=False)
class Room(WindowPart):
    name = "room"
    turn = -1
    lamp: Lamp
    light: Callable[[], None]
    is_lit: Callable[[], bool]
    size: int


@dataclass(eq=False)
class Circle(WindowPart):
    name = "circle"
    arc: Arc


@dataclass(eq=False)
class Arc(WindowPart):
    name = "arc"
    circle: Circle


def made(monkeypatch: pytest.MonkeyPatch, *classes: Any, stored: Any = None, **given: Any) -> Parts:
    monkeypatch.setattr(part, "part_classes", lambda: {cls.name: cls for cls in classes})
    return Parts(given, stored or {})


def test_parts_get_what_they_need_and_requests_go_to_whoever_offers_them(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    parts = made(monkeypatch, Lamp, Room, size=3)
    room = parts.of["room"]
    assert (room.lamp, room.size) == (parts.of["lamp"], 3)
    assert not room.is_lit()
    room.light()
    assert room.is_lit()
    assert [one.name for one in parts] == ["room", "lamp"], "in the order of their turns"


def test_remembered_fields_come_back_and_values_that_cannot_be_used_do_not(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert made(monkeypatch, Lamp).remembered() == {"lamp": {"is_on": False}}
    assert made(monkeypatch, Lamp, stored={"lamp": {"is_on": True}}).of["lamp"].is_on
    for stored in ({"lamp": {"is_on": "yes"}}, {"lamp": 3}, {"lamp": {}}):
        assert not made(monkeypatch, Lamp, stored=stored).of["lamp"].is_on


def test_a_need_that_nobody_has_and_a_circle_of_needs_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(TypeError, match="'room' needs 'size', which no part provides"):
        made(monkeypatch, Lamp, Room)
    with pytest.raises(TypeError, match="circle -> arc -> circle"):
        made(monkeypatch, Circle, Arc)


def test_each_part_of_the_window_is_found_and_its_remembered_fields_have_a_type() -> None:
    found = part_classes()
    assert {"steering", "side_panel", "tools", "exporting", "opener"} <= found.keys()
    for cls in found.values():
        stored_values(
            cls, {name: object() for name in vars(cls)}
        )  # raises where an annotation cannot be read


def test_each_command_and_listing_of_a_part_stands_in_a_menu_and_each_condition_is_declared() -> None:
    commands, found = Commands(), part_classes().values()
    of_parts = {entry.name for cls in found for entry in cls.COMMANDS if isinstance(entry, Command)}
    assert of_parts == commands.of.keys()
    wanted = {entry.when for cls in found for entry in cls.COMMANDS if isinstance(entry, Command)} - {""}
    assert wanted <= commands.conditions


def test_every_offer_is_something_that_the_part_has() -> None:
    for cls in part_classes().values():
        names = {*dir(cls), *getattr(cls, "__dataclass_fields__", ())}
        own = {word for method in vars(cls).values() if callable(method) for word in _names_in(method)}
        assert set(cls.OFFERS.values()) <= names | own, cls.name


def _names_in(method: Any) -> tuple[str, ...]:
    code = getattr(method, "__code__", None)
    return code.co_names if code else ()

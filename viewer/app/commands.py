"""What the user can do, as each part of the window and each tool declares it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any

Item = tuple[str, Callable[[], object], bool]  # title, what it does, whether it is ticked


def _always(*_: Any) -> bool:
    return True


def _nothing(*_: Any) -> str:
    return ""


@dataclass(frozen=True)
class Command:
    """Something to do. Its functions take the part or the tool that declares it; `menus.Commands` binds them.

    name: in the file of keys. title: in menus. key: its default keys, such as "Ctrl+1", several with a space
    between; empty: none. when: the name of a condition of the window that must hold. can: whether it can be
    done now beyond that. why_not: why it cannot be done, for a user who presses its keys; empty: nothing to
    say. is_there: whether the toolbar shows it. repeats: again and again while the keys are held. is_on:
    whether to tick it, None for what is not on or off. short: on the toolbar. icon: beside that. title_now:
    what the menu says where that changes.
    """

    name: str
    title: str
    act: Callable[..., object]
    key: str = ""
    when: str = ""
    repeats: bool = False
    is_on: Callable[..., bool] | None = None
    can: Callable[..., bool] = _always
    why_not: Callable[..., str] = _nothing
    is_there: Callable[..., bool] = _always
    short: str = ""
    icon: str = ""
    title_now: Callable[..., str] | None = None


@dataclass(frozen=True)
class Listing:
    """A menu of what is there at the moment; without a title its items stand in the menu that it is in.

    name: in `menus.py`; a tool's needs none. title_now: what the toolbar calls the menu that it is in, one of
    `titles`.
    """

    title: str
    items: Callable[..., Iterable[Item]]
    name: str = ""
    title_now: Callable[..., str] | None = None
    titles: Callable[[], Iterable[str]] = tuple


@dataclass(frozen=True)
class Menu:
    """Groups of entries, with a line between them. when: the name of a condition of the window; the menu is
    there while it holds. icon: on the toolbar."""

    title: str
    groups: tuple[tuple[str | Command | Listing | Menu, ...], ...]
    when: str = ""
    icon: str = ""

    def entries(self) -> Iterator[str | Command | Listing | Menu]:
        """The entries of all groups, in order."""
        return (entry for group in self.groups for entry in group)

    def commands(self) -> Iterator[Command]:
        """The commands in it and in the menus in it, in order."""
        for entry in self.entries():
            if isinstance(entry, Menu):
                yield from entry.commands()
            elif isinstance(entry, Command):
                yield entry

    @property
    def listing(self) -> Listing | None:
        """The listing that gives its toolbar button a title, None without one."""
        return next((one for one in self.entries() if isinstance(one, Listing) and one.title_now), None)


Entry = Command | Listing | Menu
Toolbar = tuple[tuple[str | Menu, ...], ...]  # groups of names of commands, and of menus

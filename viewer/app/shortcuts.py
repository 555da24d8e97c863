"""What pressed keys do: the commands that have them."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass

from imgui_bundle import imgui

from ..errors import InputError
from ..folders import user_folder
from . import keys as key_file
from .commands import Command
from .failures import Failures
from .keyboard import VIEW, Keyboard
from .keys import ARROWS, KEYS, MODIFIER_BITS, Keys
from .menus import Commands
from .notices import Problem
from .part import WindowPart

_SHIFT = int(imgui.Key.mod_shift)
_REPEATED = int(imgui.InputFlags_.route_global | imgui.InputFlags_.repeat)  # of shortcuts
# What leads the keyboard through widgets, and works them.
_WIDGETS_OWN = {
    int(KEYS[name]) for name in (
        "Tab", "Space", "Enter", "Left", "Right", "Up", "Down", "Home", "End", "PageUp",
        "PageDown", "Backspace",
    )
}  # fmt: skip


@dataclass(eq=False)
class Shortcuts(WindowPart):
    """Does what the keys say that were pressed."""

    name = "shortcuts"
    commands: Commands
    keys: Keys
    keyboard: Keyboard
    failures: Failures
    note: Callable[[str], None]
    focused_page: Callable[[], str | None]
    take_arrow: Callable[[int, int], bool]

    def __post_init__(self) -> None:
        self._used: imgui.Key | None = None  # the key of the last command, until it is released

    def handle(self) -> None:
        """Do what the keys pressed since the last frame say; keys typed into a text or a dialog go there,
        and to widgets those that lead through them."""
        self._run_commands()
        self._drop_characters()

    def _drop_characters(self) -> None:
        """Keep the characters of a key that ran a command out of the text field that the command opened.

        The system sends a character with the key, or later, and again while the user holds the key. Another
        key ends this: what the user types next goes into the field.
        """
        if self._used is None:
            return
        others = (key for key in KEYS.values() if key != self._used)
        if any(imgui.is_key_pressed(key, repeat=False) for key in others):
            self._used = None
            return
        imgui.get_io().input_queue_characters.clear()
        if not imgui.is_key_down(self._used):
            self._used = None

    def _run_commands(self) -> None:
        if imgui.is_popup_open("", imgui.PopupFlags_.any_popup):
            return
        is_in_widgets = self.keyboard.part != VIEW or self.focused_page() is not None
        of_tool = set() if is_in_widgets else self._arrows_of_tool()
        for name, pressed in self.keys.chords:
            command = self.commands.of[name]
            if pressed in of_tool or (is_in_widgets and pressed & ~_SHIFT in _WIDGETS_OWN):
                continue
            if not imgui.shortcut(pressed, _REPEATED if command.repeats else imgui.InputFlags_.route_global):
                continue
            with self.failures.reported(command.title):
                if command.can():
                    self._used = imgui.Key(pressed & ~MODIFIER_BITS)
                    command.act()
                elif why := command.why_not():
                    self.note(why)

    def _arrows_of_tool(self) -> set[int]:
        """The arrow keys that were pressed since the last frame and that a tool has taken, as chords."""
        return {
            pressed
            for name, direction in ARROWS.items()
            if imgui.shortcut(pressed := int(KEYS[name]), _REPEATED) and self.take_arrow(*direction)
        }

    def write(self) -> None:
        """Write the file of keys where there is none yet, and say where it is."""
        path = user_folder() / key_file.FILE
        try:
            if not os.path.exists(path):
                key_file.write_template(path, self.commands)
            self.note(f"Your keyboard shortcuts are in {path}. Edit this file and start Scan4D again.")
        except InputError as error:
            self.note(Problem(str(error)))

    COMMANDS = (Command("edit_keys", "Edit keys file", write),)

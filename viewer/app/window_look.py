"""How the window looks, beside the picture: its colours, the size of its text, and where it is."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Any

from ..document.schema import Kind, is_object, plain, structured
from ..errors import InputError
from . import theme
from .commands import Command, Item, Listing
from .part import WindowPart, remembered
from .theme import Palette
from .window import Window, WindowPlacement

ThemeName = Annotated[str, Kind("a theme", theme.PALETTES.__contains__)]
TextScale = Annotated[float, Kind("a text size", theme.TEXT_SCALES.__contains__)]


@dataclass(eq=False)
class WindowLook(WindowPart):
    """Changes colours and size of text. theme: one of `theme.PALETTES`, by name."""

    name = "window_look"
    window: Window
    theme: ThemeName = remembered(theme.DEFAULT)
    text_scale: TextScale = remembered(1.0)

    def __post_init__(self) -> None:
        self.window.text_scale = self.text_scale
        self.choose(self.theme)

    def remembered(self) -> dict[str, object]:
        """The values that come back at the next start, as JSON has them."""
        return super().remembered() | {"window": plain(self.window.placement)}

    def choose(self, name: str) -> None:
        """Show panels in the colours of one of `theme.PALETTES`; the picture's are the look's."""
        self.theme = name
        theme.set_colors(self.palette)
        self.window.touch()

    def step(self) -> None:
        """Dark to light and back."""
        names = list(theme.PALETTES)
        self.choose(names[(names.index(self.theme) + 1) % len(names)])

    @property
    def palette(self) -> Palette:
        """The colours of the panels."""
        return theme.PALETTES[self.theme]

    def change_text(self, direction: int) -> None:
        """Larger text and widgets for 1, smaller for -1, the usual ones for 0."""
        scales, now = theme.TEXT_SCALES, self.text_scale
        beyond = [scale for scale in scales if (scale - now) * direction > 0]
        nearest = min(beyond, key=lambda scale: abs(scale - now), default=now)
        self.text_scale = self.window.text_scale = nearest if direction else 1.0
        self.window.touch()

    def items(self) -> Iterator[Item]:
        """The themes for a menu."""
        for name in theme.PALETTES:
            yield name.capitalize(), partial(self.choose, name), name == self.theme

    COMMANDS = (
        Command("quit", "Quit", lambda look: look.window.close(), "Ctrl+Q"),
        Listing("Theme", items, "themes"),
        Command("theme", "Switch theme", step, "T"),
        Command("text_larger", "Larger text", lambda look: look.change_text(1), "Ctrl+="),
        Command("text_smaller", "Smaller text", lambda look: look.change_text(-1), "Ctrl+-"),
        Command("text_usual", "Default text size", lambda look: look.change_text(0), "Ctrl+0"),
    )


def stored_placement(stored: Mapping[str, Any]) -> WindowPlacement | None:
    """The placement of the window among the values of all parts that come back; None: it was never open."""
    values: Any = stored.get(WindowLook.name)
    with suppress(InputError, RecursionError):
        return structured(WindowPlacement, values.get("window")) if is_object(values) else None
    return None

"""What sections of the panel have in common."""

from __future__ import annotations

from collections.abc import Sequence

from imgui_bundle import ImVec2, imgui

from . import widgets
from .keys import Keys


class Ui:
    """Helpers that declare a section of the panel, beside ImGui and `widgets`."""

    def __init__(self, keys: Keys) -> None:
        self._keys = keys

    def tooltip(self, text: str, command: str) -> None:
        """Explain the last widget, and name the keys of the command that does the same."""
        keys = self._keys.of[command]
        widgets.tooltip(text + (f" ({keys})" if keys else ""))

    def row(self, *words: str) -> ButtonRow:
        """Begin a row of buttons, which `ButtonRow.button` declares one by one. words: their labels."""
        return ButtonRow(words)


class ButtonRow:
    """Buttons that fill a line, or several lines where their words need more room."""

    def __init__(self, words: Sequence[str]) -> None:
        room, gap = imgui.get_content_region_avail().x, imgui.get_style().item_spacing.x
        lines: list[list[tuple[str, float]]] = []
        left = 0.0
        for label in words:
            label = _broken(label, room)
            width = min(widgets.button_width(label), room)
            if not lines or left < gap + width:
                lines.append([])
                left = room + gap
            lines[-1].append((label, width))
            left -= gap + width
        self._buttons = (
            (label, width, number)
            for line in lines
            for number, (label, width) in enumerate(_filled(line, room, gap))
        )

    def button(self) -> bool:
        """Declare the next button; True when it is pressed."""
        label, width, number = next(self._buttons)
        if number:
            imgui.same_line()
        return imgui.button(label, ImVec2(width, 0))


def _filled(line: Sequence[tuple[str, float]], room: float, gap: float) -> list[tuple[str, float]]:
    """Labels of a line with the widths of their buttons: the same for all where the words allow that."""
    share = (room - gap * (len(line) - 1)) / len(line)
    if max(width for _, width in line) <= share:
        return [(label, share) for label, _ in line]
    more = share - sum(width for _, width in line) / len(line)
    return [(label, width + more) for label, width in line]


def _broken(label: str, room: float) -> str:
    """A label in two lines where one is too wide; its name stays."""
    words, mark, _ = label.partition("###")
    if widgets.button_width(label) <= room or " " not in words:
        return label
    middle = min(
        (i for i, letter in enumerate(words) if letter == " "), key=lambda i: abs(i - len(words) / 2)
    )
    return f"{words[:middle]}\n{words[middle + 1 :]}{label[len(words) :] if mark else f'###{words}'}"

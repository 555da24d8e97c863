"""What sections of the panel have in common."""

from __future__ import annotations

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

    def button_size(self, count: int) -> ImVec2:
        """The size of a button of which so many stand in a row."""
        gaps = (count - 1) * imgui.get_style().item_spacing.x
        return ImVec2((imgui.get_content_region_avail().x - gaps) / count, 0)

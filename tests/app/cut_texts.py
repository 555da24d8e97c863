"""Finds texts that a window shows in part: cut by their widget, or by the edge of the window or screen."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

from imgui_bundle import imgui

TEXTS = (
    "text",
    "text_disabled",
    "text_unformatted",
    "text_wrapped",
    "checkbox",
    "radio_button",
    "separator_text",
)
BUTTONS = ("button", "small_button")
ROWS = ("selectable", "collapsing_header", "menu_item")
SLACK = 1.0  # pixels, of rounding


class CutTexts:
    """The texts that were cut in the frame that was declared last, by window."""

    def __init__(self) -> None:
        self._frame, self._found = 0, dict[str, set[str]]()
        for name in TEXTS:
            self._watch(name, lambda label: 0.0)
        for name in BUTTONS:
            self._watch(name, lambda label: _wide(label) + 2 * imgui.get_style().frame_padding.x)
        for name in ROWS:
            arrow = imgui.get_font_size if name == "collapsing_header" else float
            self._watch(name, lambda label, arrow=arrow: _wide(label) + 2 * arrow())
        self._watch("begin_combo", lambda label: 0.0, of_combo=True)

    @property
    def found(self) -> dict[str, list[str]]:
        """Texts by window; empty where all are whole."""
        return {name: sorted(texts) for name, texts in self._of_frame().items() if texts}

    def _of_frame(self) -> dict[str, set[str]]:
        if self._frame != imgui.get_frame_count():
            self._frame, self._found = imgui.get_frame_count(), {}
        return self._found

    def _watch(self, name: str, least: Callable[[str], float], of_combo: bool = False) -> None:
        """Look at each widget that a function of ImGui declares. least: width that shows all of a label."""
        declare = getattr(imgui, name)

        @functools.wraps(declare)
        def declared(label: str, *arguments: Any, **others: Any) -> Any:
            answer = declare(label, *arguments, **others)
            if of_combo:
                if not answer:  # else the item is the list's
                    self._look(arguments[0], _wide(arguments[0]) + imgui.get_frame_height())
            else:
                self._look(label, least(label))
            return answer

        setattr(imgui, name, declared)

    def _look(self, label: str, least: float) -> None:
        window = imgui.internal.get_current_window()
        low, high = imgui.get_item_rect_min().x, imgui.get_item_rect_max().x
        left, right = window.clip_rect.min.x, window.clip_rect.max.x
        display = imgui.get_io().display_size.x
        is_outside = low < max(left, 0) - SLACK or high > min(right, display) + SLACK
        if window.hidden:  # until ImGui has found its size
            return
        if label.partition("##")[0] and (is_outside or high - low < least - SLACK):
            self._of_frame().setdefault(window.name.partition("/")[0], set()).add(label.partition("##")[0])


def _wide(label: str) -> float:
    return imgui.calc_text_size(label, hide_text_after_double_hash=True).x

"""What dialogs on how Scan4D reads a scan share: their size, and a foot with the problem and the buttons."""

from __future__ import annotations

from typing import Any, ClassVar, Protocol

from imgui_bundle import ImVec2, imgui
from imgui_bundle import icons_fontawesome_6 as icons

from ...files import printable
from .. import widgets
from ..part import ViewArea, WindowPart

_SIZE = ImVec2(52.0, 34.0)  # in heights of the font


class ReadingChoices(Protocol):
    """Choices of the user about how a scan is read. No widgets.

    problem: why the choices are unusable; empty if usable.
    """

    problem: str

    @property
    def summary(self) -> str:
        """A sentence on the data that Scan4D reads, and one on the decisions that the user changes."""

    @property
    def can_open(self) -> bool:
        """Whether Scan4D can read the scan with these choices."""

    def reset(self) -> None:
        """Leave all decisions to Scan4D."""


class ReadingDialog(WindowPart):
    """A dialog of choices, which the user opens the scan with. choices: None while it is closed."""

    title: ClassVar[str]
    layer = 82
    choices: Any
    _takes_keyboard = False

    def show(self, choices: ReadingChoices) -> None:
        """Open the dialog. Its first button takes the keyboard as soon as the choices are usable."""
        self.choices, self._takes_keyboard = choices, True

    def draw_choices(self, choices: Any, foot: float) -> None:
        """Declare the widgets of the choices. foot: height of what stands below them, pixels."""
        raise NotImplementedError

    def open_scan(self, choices: Any) -> None:
        """Open the scan with the choices."""
        raise NotImplementedError

    def dialog(self, view: ViewArea) -> None:
        """Declare it while it is open."""
        em, display = imgui.get_font_size(), imgui.get_io().display_size
        size = ImVec2(min(_SIZE.x * em, 0.94 * display.x), min(_SIZE.y * em, 0.9 * display.y))
        with widgets.modal(self.title, self.choices is not None, size) as is_drawn:
            if is_drawn and self.choices is not None:
                self.draw_choices(self.choices, _foot_height(self.choices))
                self._draw_foot(self.choices)
                if self.choices is None:
                    imgui.close_current_popup()

    def _draw_foot(self, choices: ReadingChoices) -> None:
        """Declare the problem, or else the summary, and the buttons."""
        if choices.problem:
            imgui.text_wrapped(f"{icons.ICON_FA_TRIANGLE_EXCLAMATION}  {printable(choices.problem)}")
        else:
            widgets.faint(printable(choices.summary))
        imgui.begin_disabled(not choices.can_open)
        if self._takes_keyboard and choices.can_open:
            imgui.set_keyboard_focus_here()
            self._takes_keyboard = False
        opens = imgui.button("Open")
        imgui.end_disabled()
        opens = (widgets.is_taken() and choices.can_open) or opens
        imgui.same_line()
        if imgui.button("Reset"):
            choices.reset()
        widgets.tooltip("Let Scan4D make all choices")
        imgui.same_line()
        leaves = imgui.button("Cancel") or imgui.is_key_pressed(imgui.Key.escape)
        if opens or leaves:
            self.choices = None
        if opens:
            self.open_scan(choices)


def _foot_height(choices: ReadingChoices) -> float:
    """The height of the foot, pixels. The text wraps at the width of the dialog."""
    text = f"     {choices.problem}" if choices.problem else choices.summary
    wrapped = imgui.calc_text_size(printable(text), wrap_width=imgui.get_content_region_avail().x)
    return wrapped.y + 2 * imgui.get_style().item_spacing.y + imgui.get_frame_height()

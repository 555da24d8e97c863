"""The panel's section on how Scan4D read the scan: each decision, its source, and what is assumed. The user
corrects each of them here."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from imgui_bundle import icons_fontawesome_6 as icons
from imgui_bundle import imgui

from ...errors import InputError
from ...scan.reading.corrections import CORRECTED
from ...scan.reading.record import Decision, Reading
from .. import widgets
from ..files.frames_dialog import FramesDialog
from ..files.rereading import Rereading
from ..files.table_dialog import TableDialog
from ..part import Section, WindowPart
from ..ui import Ui

_MARKED = "Scan4D assumes this value. If the value is wrong, what you measure may be wrong too."
_AUTOMATIC, _OTHER = "Automatic", "Other..."


@dataclass(eq=False)
class ReadingSection(WindowPart):
    """The section: a row a decision. Enter or a click on its value lists other values."""

    name = "reading_section"
    SECTION = Section("How this was read", 12, is_open=False)
    rereading: Rereading
    table_dialog: TableDialog
    frames_dialog: FramesDialog

    def __post_init__(self) -> None:
        self._field = widgets.NameField()  # its subject is the key whose value the user types
        self._problems: dict[str, str] = {}  # key -> why what the user typed is unusable

    @property
    def mark(self) -> str:
        """Words on what is assumed and can change a number."""
        return words_on_assumed(self.rereading.record)

    def begin_scan(self, timeline: object) -> None:
        """Drop what was typed."""
        self._field.subject, self._problems = None, {}

    def panel(self, ui: Ui) -> None:
        """Declare it."""
        record = self.rereading.record
        for key, decision in record.decisions.items():
            if decision.value is not None or self.rereading.is_corrected(key):
                imgui.push_id(key)
                self._draw(decision, record)
                imgui.pop_id()
        for name, text, help in _others(record):
            widgets.fact(name, text)
            widgets.tooltip(help)
        self._draw_dialogs(ui)

    def _draw_dialogs(self, ui: Ui) -> None:
        """Declare a button for each dialog that suits the scan."""
        buttons: dict[str, Callable[[], object]] = {}
        if self.table_dialog.table is not None:
            buttons["Table..."] = self.table_dialog.ask
        if self.frames_dialog.files is not None:
            buttons["Folder..."] = self.frames_dialog.ask
        if buttons:
            row = ui.row(*buttons)
            for act in buttons.values():
                if row.button():
                    act()

    def _draw(self, decision: Decision, record: Reading) -> None:
        """Declare one decision: its name and its source on a line, and below them its value as a list."""
        key = decision.key
        if decision.is_marked:
            widgets.dot()
        imgui.text_unformatted(decision.label)
        imgui.same_line()
        room = imgui.get_content_region_avail().x
        source = "set by you" if decision.source == "user" else decision.shown_source
        imgui.text_disabled(widgets.fitted(source, room))
        if key not in CORRECTED:
            imgui.text_wrapped(decision.shown)
            widgets.tooltip("\n".join(explanation(decision)))
            return
        gutter = imgui.get_frame_height() if self.rereading.is_corrected(key) else 0.0
        if self._field.subject == key:
            self._draw_field(key)
        else:
            self._draw_values(decision, record, gutter)
            if gutter:
                imgui.same_line(0, 0)
                if widgets.flat_button(icons.ICON_FA_ARROW_ROTATE_LEFT, "Reset: let Scan4D decide"):
                    self._correct(key, None)
        if key in self._problems:
            imgui.text_wrapped(self._problems[key])

    def _draw_values(self, decision: Decision, record: Reading, gutter: float) -> None:
        """Declare the list of values. gutter: width to leave at its right, pixels."""
        imgui.set_next_item_width(-1 - gutter if gutter else -1)
        room = imgui.get_content_region_avail().x - 2 * imgui.get_frame_height() - gutter
        is_open = imgui.begin_combo("##value", widgets.unhidden(widgets.fitted(decision.shown, room)))
        if not is_open:
            widgets.tooltip("\n".join(explanation(decision)))
            return
        key, is_corrected = decision.key, self.rereading.is_corrected(decision.key)
        if imgui.selectable(_AUTOMATIC, not is_corrected)[0] and is_corrected:
            self._correct(key, None)
        for text in choices(decision, record):
            if imgui.selectable(widgets.labelled(text, text), False)[0]:
                self._correct(key, text)
        if imgui.selectable(_OTHER, False)[0]:
            self._field.begin(key, self.rereading.text_of(key) or as_text(decision))
        imgui.end_combo()

    def _draw_field(self, key: str) -> None:
        """Declare the field that the user types a value into."""
        text = self._field.draw(-1)
        widgets.tooltip(f"Type {CORRECTED[key].form}. Press Enter to read the scan with it.")
        if text is not None and text.strip():
            self._correct(key, text.strip())

    def _correct(self, key: str, text: str | None) -> None:
        """Correct a decision, or tell why that is impossible."""
        self._problems.pop(key, None)
        try:
            self.rereading.correct(key, text)
        except InputError as error:
            self._problems[key] = str(error)


def as_text(decision: Decision) -> str:
    """The value of a decision as `--read` takes it, for the user to change."""
    value = decision.value
    if isinstance(value, dict) and {"fx", "fy", "cx", "cy"} <= value.keys():
        lens = value.get("distortion") or []
        return ",".join(f"{one:g}" for one in (*(value[name] for name in ("fx", "fy", "cx", "cy")), *lens))
    return "" if value is None else decision.shown


def choices(decision: Decision, record: Reading) -> list[str]:
    """The values that the list of a decision offers, as `--read` takes them: its alternatives first."""
    takes = [take.name for take in record.takes] if decision.key == "take" else []
    found = [*decision.alternatives, *takes, *CORRECTED[decision.key].choices]
    return [text for text in dict.fromkeys(found) if text != decision.shown]


def words_on_assumed(record: Reading) -> str:
    """Words on the assumptions that can change a number; empty where there is none."""
    if not (marks := record.marks()):
        return ""
    warning = "If a value is wrong, what you measure may be wrong too."
    return "\n".join(
        ["Scan4D assumes:", *marks, warning, "Change a value in the section 'How this was read'."]
    )


def explanation(decision: Decision) -> list[str]:
    """Lines on a decision: its source, its reason, and how to change it on the command line."""
    lines = [decision.shown, f"Source: {decision.shown_source}"]
    if decision.is_marked:
        lines.append(_MARKED)
    if decision.why:
        lines.append(decision.why)
    if decision.alternatives:
        listed = ", ".join(decision.alternatives)
        lines.append(f"On the command line: --read {decision.key}=VALUE, for example: {listed}")
    return lines


def _others(record: Reading) -> Iterator[tuple[str, str, str]]:
    """Yield the other entries of the record: a name, a text, and a tooltip."""
    for take in record.takes:
        yield "Take", f"{take.name}, {take.frames} frames", take.pattern
    for aside in record.aside:
        yield "Left aside", aside.file, aside.why
    for text in record.unused:
        yield "Not used", text, "The file contains these data, but Scan4D does not use them"
    for one in record.contradictions:
        yield "Contradiction", one.what, "This frame contradicts what Scan4D decided for the whole scan"

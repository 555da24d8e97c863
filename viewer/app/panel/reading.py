"""The panel's section on how Scan4D read the scan: each decision, its source, and what is assumed. The user
corrects each of them here."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from imgui_bundle import icons_fontawesome_6 as icons
from imgui_bundle import imgui

from ...errors import InputError
from ...files import printable
from ...scan.reading.corrections import CORRECTED, Corrections
from ...scan.reading.record import Decision, Reading, shown_value, words_of_value
from ...scan.times import frame_in_words
from .. import widgets
from ..files.frames_dialog import CHOOSE_FRAMES, FramesDialog
from ..files.rereading import Rereading
from ..files.table_dialog import READ_TABLE, TableDialog
from ..part import Section, WindowPart
from ..ui import Ui

_MARKED = "Scan4D assumes this value. If the value is wrong, your measurements may be wrong too."
_AUTOMATIC, _OTHER = "Automatic", "Other..."
_MOST_FACTS = 4  # of one kind, such as files left aside
_MOST_NAMED = 20  # entries of a tooltip


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
        self._draw_dialogs(ui)
        record = self.rereading.record
        for key, decision in record.decisions.items():
            if decision.value is not None or self.rereading.is_corrected(key):
                imgui.push_id(key)
                self._draw(decision, record)
                imgui.pop_id()
        for fact in other_facts(record):
            widgets.fact(fact.name, printable(fact.text))
            widgets.tooltip(printable(fact.help))

    def _draw_dialogs(self, ui: Ui) -> None:
        """Declare a button for each dialog that suits the scan."""
        buttons: dict[str, Callable[[], object]] = {}
        if self.table_dialog.table is not None:
            buttons[READ_TABLE] = self.table_dialog.ask
        if self.frames_dialog.files is not None:
            buttons[CHOOSE_FRAMES] = self.frames_dialog.ask
        if buttons:
            row = ui.row(*buttons)
            for act in buttons.values():
                if row.button():
                    act()

    def _draw(self, decision: Decision, record: Reading) -> None:
        """Declare one decision: its name and its source on a line, and below them its value as a list."""
        key = decision.key
        if key not in CORRECTED:
            widgets.fact(decision.label, printable(decision.shown))
            widgets.tooltip("\n".join(explanation(decision)))
            return
        if decision.is_marked:
            widgets.dot()
        imgui.text_unformatted(decision.label)
        imgui.same_line()
        room = imgui.get_content_region_avail().x
        imgui.text_disabled(widgets.fitted(printable(decision.shown_source), room))
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
        is_open = imgui.begin_combo(
            "##value", widgets.unhidden(widgets.fitted(printable(decision.shown), room))
        )
        if not is_open:
            widgets.tooltip("\n".join(explanation(decision)))
            return
        key, is_corrected = decision.key, self.rereading.is_corrected(decision.key)
        if imgui.selectable(_AUTOMATIC, not is_corrected)[0] and is_corrected:
            self._correct(key, None)
        for text in choices(decision, record):
            if imgui.selectable(widgets.labelled(printable(words_of_value(key, text)), text), False)[0]:
                self._correct(key, text)
        if imgui.selectable(_OTHER, False)[0]:
            self._field.begin(key, self.rereading.text_of(key) or as_text(decision))
        imgui.end_combo()

    def _draw_field(self, key: str) -> None:
        """Declare the field that the user types a value into."""
        text = self._field.draw(-1)
        widgets.tooltip(f"Type {CORRECTED[key].form}. Press Enter to read the scan with this value.")
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
    """The value of a decision as `--read` takes it, for the user to change; empty without one."""
    value = decision.value
    if isinstance(value, dict) and {"fx", "fy", "cx", "cy"} <= value.keys():
        lens = value.get("distortion") or []
        return ",".join(f"{one:g}" for one in (*(value[name] for name in ("fx", "fy", "cx", "cy")), *lens))
    if decision.key == "frames" and decision.source != "user":
        return "*"
    text = shown_value(value) if not isinstance(value, (list, tuple)) else " ".join(map(str, value))
    try:
        return Corrections.parse({decision.key: text}).texts[decision.key]
    except InputError:
        return ""


def choices(decision: Decision, record: Reading) -> list[str]:
    """The values that the list of a decision offers, as `--read` takes them: its alternatives first."""
    takes = [take.name for take in record.takes] if decision.key == "take" else []
    found, now = [*decision.alternatives, *takes, *CORRECTED[decision.key].choices], as_text(decision)
    return [text for text in dict.fromkeys(found) if text != now]


def words_on_assumed(record: Reading) -> str:
    """Words on the assumptions that can change a number; empty where there is none."""
    if not (marks := record.marks()):
        return ""
    warning = "If a value is wrong, your measurements may be wrong too."
    return "\n".join(
        ["Scan4D assumes:", *marks, warning, "Change a value in the section 'How this was read'."]
    )


def explanation(decision: Decision) -> list[str]:
    """Lines on a decision: its source, its reason, and how to change it on the command line."""
    lines = [decision.shown, f"Source: {decision.shown_source.removeprefix('from ')}"]
    if decision.is_marked:
        lines.append(_MARKED)
    if decision.why:
        lines.append(decision.why)
    if decision.alternatives:
        listed = ", ".join(decision.alternatives)
        lines.append(f"On the command line: --read {decision.key}=VALUE, for example: {listed}")
    return lines


class OtherFact(NamedTuple):
    """An entry of the record that is no decision. help: its tooltip."""

    name: str
    text: str
    help: str


def other_facts(record: Reading) -> list[OtherFact]:
    """Facts of the record that are no decisions, at most a few of each kind: there may be thousands."""
    takes = [
        OtherFact("Take", f"{take.name}, {take.frames} frames", f"Files: {take.pattern}")
        for take in record.takes
    ]
    files: dict[str, list[str]] = {}
    for one in record.aside:
        files.setdefault(one.why, []).append(one.file)
    aside = [
        OtherFact("Left aside", f"{names[0] if len(names) == 1 else f'{len(names)} files'} ({why})",
                  _listed(names))
        for why, names in files.items()
    ]  # fmt: skip
    help = "The file also contains these data, which Scan4D does not use"
    unused = [OtherFact("Not used", text, help) for text in record.unused]
    help = "This frame contradicts what Scan4D decided for the whole scan"
    contradictions = [
        OtherFact("Contradiction", f"{frame_in_words(one.frame)}: {one.what}", help)
        for one in record.contradictions
    ]
    return [fact for facts in (takes, aside, unused, contradictions) for fact in _first(facts)]


def _first(facts: Sequence[OtherFact]) -> list[OtherFact]:
    """The first facts of one kind, and one that counts the others."""
    if len(facts) <= _MOST_FACTS:
        return list(facts)
    shown, rest = facts[: _MOST_FACTS - 1], facts[_MOST_FACTS - 1 :]
    return [*shown, OtherFact(facts[0].name, f"and {len(rest)} more", _listed([one.text for one in rest]))]


def _listed(texts: Sequence[str]) -> str:
    """Texts below one another, the first ones of many."""
    more = [f"and {len(texts) - _MOST_NAMED} more"] if len(texts) > _MOST_NAMED else []
    return "\n".join([*texts[:_MOST_NAMED], *more])

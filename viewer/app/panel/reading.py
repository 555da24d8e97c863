"""The panel's section on how Scan4D read the scan: each decision, its source, and what is assumed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from imgui_bundle import imgui

from ...scan.reading.record import Decision, Reading
from .. import widgets
from ..part import Section, WindowPart
from ..playing.playback import Playback
from ..session import Session
from ..ui import Ui

MARK = "\u2022"  # before an assumption that can change a number
_MARKED = "Scan4D assumes this value. If the value is wrong, what you measure may be wrong too."


@dataclass(eq=False)
class ReadingSection(WindowPart):
    """The section."""

    name = "reading_section"
    SECTION = Section("How this was read", 12, is_open=False)
    session: Session
    playback: Playback

    def panel(self, ui: Ui) -> None:
        """Declare it."""
        record = self.record
        for decision in record.decisions.values():
            if decision.value is not None:
                _draw(decision)
        for name, text, help in _others(record):
            widgets.fact(name, text)
            widgets.tooltip(help)

    @property
    def record(self) -> Reading:
        """The record of the open scan, with what the user states about it in the panel."""
        record, document = self.playback.timeline.reading, self.session.document
        if document.unit is not None and document.unit != record["unit"].value:
            stated = Decision("unit", document.unit, "user", "the panel", changes_numbers=True)
            record = record.with_(stated)
        return record


def _draw(decision: Decision) -> None:
    """Declare one decision: its name, its value, and its source as a tooltip."""
    mark = f"{MARK} " if decision.is_marked else ""
    widgets.fact(f"{mark}{decision.label}", f"{decision.shown} ({decision.shown_source})")
    if imgui.is_item_hovered():
        widgets.tooltip("\n".join(explanation(decision)))


def explanation(decision: Decision) -> list[str]:
    """Lines on a decision: its source, its reason, and how to change it."""
    lines = [decision.shown, f"Source: {decision.shown_source}"]
    if decision.is_marked:
        lines.append(_MARKED)
    if decision.why:
        lines.append(decision.why)
    if decision.alternatives:
        choices = ", ".join(decision.alternatives)
        lines.append(f"Change it with --read {decision.key}=VALUE, for example: {choices}")
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

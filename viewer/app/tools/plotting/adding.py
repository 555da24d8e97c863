"""The measure that is to be added: its kind, its landmarks, and what the kind leaves to choose."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from imgui_bundle import icons_fontawesome_6 as icons
from imgui_bundle import imgui

from ....analysis.measures import Measure
from ....analysis.measures.kinds import MeasureKind, measure_kinds
from ... import widgets
from ...ui import Ui

if TYPE_CHECKING:
    from . import Tool

_USUAL = "distance"


class Adding:
    """A measure that is being put together.

    kind: by name. chosen: landmarks that the user chose, by their number in the measure; the others are those
    placed last. count: of landmarks, None for as few as the kind takes. options: of the kind, as chosen.
    """

    def __init__(self) -> None:
        self.kind = _USUAL
        self.chosen: dict[int, str] = {}
        self.count: int | None = None
        self.options: dict[str, str] = {}

    def measure(self, placed: Sequence[str], taken: Sequence[str]) -> Measure | None:
        """The measure as it stands; None where fewer landmarks are placed than it takes. placed: landmarks,
        by name. taken: names of measures."""
        kind = measure_kinds()[self.kind]
        count = kind.least if self.count is None else self.count
        if len(placed) < kind.least:
            return None
        names = (list(placed) * count)[-count:]
        for number, name in self.chosen.items():
            if number < count and name in placed:
                names[number] = name
        options = {name: word for name, word in self.options.items() if word != kind.choices[name][0]}
        return Measure(free_title(kind, names, taken), kind.name, tuple(names), options)

    def begin_anew(self) -> None:
        """Forget what was chosen of landmarks, after a measure was added."""
        self.chosen.clear()
        self.count = None


def free_title(kind: MeasureKind, landmarks: Sequence[str], taken: Sequence[str]) -> str:
    """A name for a measure that no other has."""
    name = f"{kind.title} {', '.join(landmarks)}"
    number = next(number for number in range(1, len(taken) + 2) if _numbered(name, number) not in taken)
    return _numbered(name, number)


def _numbered(name: str, number: int) -> str:
    return name if number == 1 else f"{name} ({number})"


def draw(tool: Tool, ui: Ui) -> None:
    """Declare the rows that put a measure together, and the button that adds it."""
    adding, kinds = tool.adding, measure_kinds()
    titles = {name: kind.title for name, kind in kinds.items()}
    widgets.label("Measure", "What to measure between landmarks")
    chosen = widgets.combo("kind", adding.kind, list(titles), titles)
    widgets.tooltip(kinds[chosen].about)
    if chosen != adding.kind:
        adding.kind, adding.count, adding.options = chosen, None, {}
    kind, placed = kinds[chosen], tool.placed
    measure = adding.measure(placed, [one.name for one in tool.landmarks.measures])
    if measure is None:
        widgets.faint(f"{kind.title} needs {kind.least} landmarks: place them first.")
        return
    _draw_landmarks(adding, kind, measure, placed)
    for option, words in kind.choices.items():
        widgets.label(option.replace("_", " ").capitalize())
        adding.options[option] = widgets.combo(option, adding.options.get(option, words[0]), list(words))
    if ui.row("Add measure").button():
        tool.add(measure)
        adding.begin_anew()
    widgets.tooltip(f"Measure {measure.name} in all frames")


def _draw_landmarks(adding: Adding, kind: MeasureKind, measure: Measure, placed: Sequence[str]) -> None:
    """A row for each landmark of the measure; more or fewer of them where the kind takes any number."""
    count = len(measure.landmarks)
    for number, name in enumerate(measure.landmarks):
        widgets.label(f"{number + 1}.")
        imgui.push_id(number)
        new = widgets.combo("landmark", name, list(placed))
        imgui.pop_id()
        if new != name:
            adding.chosen[number] = new
    if kind.most == kind.least:
        return
    for icon, about, other in (
        (icons.ICON_FA_PLUS, "One more landmark", count + 1),
        (icons.ICON_FA_MINUS, "One landmark fewer", count - 1),
    ):
        imgui.begin_disabled(other < kind.least or other > (kind.most or len(placed)))
        if widgets.icon_button(icon, about):
            adding.count = other
        imgui.end_disabled()
        imgui.same_line()
    imgui.new_line()

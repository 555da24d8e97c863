"""What the marks of a picture say: which there are, and the words and numbers that they show."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, fields

import numpy as np
from numpy.typing import NDArray

from ..analysis.deviation import chosen
from ..analysis.motion import distances
from ..analysis.motion.quantities import QUANTITIES
from ..camera import Camera
from ..look import HOLE_COLOR, LEVEL_COLORS, Look, ValueKind, rgba
from ..params import describe, param
from ..scan.times import frame_in_words
from .labels import LabelPlaces, LabelSpot
from .overlays import DrawnPlot, Overlay

Color = tuple[int, int, int, int]  # sRGB and alpha, bytes

_MEASURED: Color = (150, 150, 150, 255)
# Units of the numbers that looks colour by; "{}" is the unit of length.
_UNITS = dict.fromkeys(("depth", "height", distances.NAME, chosen.NAME), "{}")
_OF_KINDS = {"length": "{}", "speed": "{}/s", "strain": "%"}
_UNITS |= {name: _OF_KINDS[one.kind] for name, one in QUANTITIES.items()}
_BAR_SHARE = 1 / 6  # of the picture's width that a scale bar takes at most
_MOST_DIGITS = 15  # that a float64 holds


@dataclass(frozen=True)
class Marks:
    """A choice of what is drawn over a picture."""

    scale_bar: bool = param(
        False,
        (
            "Scale bar with a round length. In perspective, the scale bar is valid only at the depth of "
            "the pivot"
        ),
    )
    color_bar: bool = param(
        False,
        "Colour bar, if the colours show values, levels or holes",
    )
    stamp: bool = param(False, "Number and time of the current frame")
    notes: bool = param(False, "Notes at positions of the subject, and notes on the frame")
    landmarks: bool = param(False, "Landmarks of the frame")
    trajectories: bool = param(False, "Paths of landmarks through all frames, as shown in the view")
    measure_lines: bool = param(False, "Distances and other measures in this frame, with their values")
    plot: bool = param(
        False,
        ("Plot of the measures over time, with a line at the current frame, if the plot is open"),
    )

    def __bool__(self) -> bool:
        return any(getattr(self, field.name) for field in fields(self))


MARKS = tuple(parameter.name for parameter in describe(Marks))


def marks_of(names: Sequence[str] | None) -> Marks:
    """The choice of these names of MARKS."""
    return Marks(**dict.fromkeys(names or (), True))


@dataclass(frozen=True)
class Legend:
    """The words and numbers that the marks of a picture show.

    unit: of length. pose: its index, of `count`. time: the pose's, seconds. range_note: what the colour bar
    says of its numbers. notes: on the frame. factor: how many of `unit` one unit of the scan is. overlay:
    landmarks, lines and notes at places, None where none are drawn.
    covered: the cells of the picture that show the subject (see `labels.covered_cells`), None where not
    known. places: of labels in the pictures before, which change with
    this one. labels: where they stand in the view that this is a picture of. plot: None where none is drawn.
    """

    marks: Marks
    camera: Camera
    look: Look
    unit: str
    pose: int
    count: int
    time: float
    range_note: str = ""
    notes: tuple[str, ...] = ()
    factor: float = 1.0
    overlay: Overlay | None = None
    plot: DrawnPlot | None = None
    covered: NDArray[np.bool_] | None = field(default=None, compare=False)
    places: LabelPlaces = field(default_factory=LabelPlaces, compare=False)
    labels: tuple[LabelSpot, ...] = ()


def round_length(most: float) -> float:
    """The largest of 1, 2 and 5 times a power of ten that is no longer than `most`, which is positive."""
    power = 10.0 ** math.floor(math.log10(most))
    return max((factor * power for factor in (1, 2, 5) if factor * power <= most), default=power)


def scale_bar(camera: Camera, size: tuple[float, float], factor: float = 1.0) -> tuple[float, float]:
    """A round length, and how many pixels it takes at the depth of the camera's target.

    It takes at most a sixth of the picture's width. size: (width, height), pixels. factor: from scan units to
    those that the length is in.
    """
    width, height = size
    view_height = factor * camera.view_height
    length = round_length(_BAR_SHARE * width * view_height / height)
    return length, length * height / view_height


def value_unit(name: str, unit: str) -> str:
    """The unit of numbers of this name, as looks colour by them; "" where they have none that is known. unit:
    of length."""
    return _UNITS.get(name, "").format(unit)


def goes_by_length(name: str) -> bool:
    """Whether numbers of this name, as looks colour by them, depend on the unit of length."""
    return "{}" in _UNITS.get(name, "")


def quantity(look: Look, unit: str, kind: ValueKind | None = None) -> str:
    """The number that the look colours by, with its unit where that is known. kind: of what a backend
    finds."""
    of_kind = unit if kind is not None and kind.is_length else ""
    words = value_unit(look.color_by, unit) if kind is None else of_kind
    if kind is not None or words:
        unit_words = f" ({words})" if words else ""
        return look.color_by.replace("_", " ").capitalize() + unit_words
    return "Value" if look.color_by.startswith("#") else look.color_by


def shows_length(look: Look, kind: ValueKind | None) -> bool:
    """Whether the number that the look colours by is one in the scan's unit. kind: as for `quantity`."""
    return goes_by_length(look.color_by) if kind is None else kind.is_length


def number(value: float, span: float) -> str:
    """A number with three digits of the span that it is one of, the shorter way."""
    if not math.isfinite(value):
        return str(value)
    magnitude = math.floor(math.log10(span)) if span > 0 else math.floor(math.log10(abs(value) or 1))
    decimals = max(2 - magnitude, 0)
    plain = f"{round(value, decimals) + 0.0:,.{decimals}f}"  # + 0.0: no minus before zero
    if not value:
        return "0"
    digits = min(max(math.floor(math.log10(abs(value))) + 2 - magnitude, 2), _MOST_DIGITS)
    scientific = f"{value:.{digits}e}"
    return plain if len(plain) <= len(scientific) + 1 else scientific


def range_note(legend: Legend) -> str:
    """Words on where the range of colours is from, where it is not that of all frames or given."""
    look = legend.look
    is_own = look.range == "frame" and None in (look.low, look.high) and look.color_by != "depth"
    return legend.range_note or ("range of this frame" if is_own and legend.count > 1 else "")


def swatches(look: Look) -> list[tuple[Color, str]]:
    """Colours that the look shows something else by than numbers, and what each says."""
    found = []
    if look.color_by == "level":
        levels = [f"Level {number}" for number in range(1, len(LEVEL_COLORS) + 1)]
        levels[-1] += " and above"
        found = [(_MEASURED, "Measured"), *zip(map(rgba, LEVEL_COLORS), levels, strict=True)]
    return [*found, (rgba(HOLE_COLOR), "Hole")] if look.holes else found


def stamp(legend: Legend) -> str:
    """The frame, counted from 1, and its time."""
    return f"{frame_in_words(legend.pose).capitalize()} of {legend.count}, {legend.time:.3f} s"


def ticks(low: float, high: float, kind: ValueKind | None = None) -> list[tuple[float, str]]:
    """Shares of the colour bar at which numbers stand, from its foot, and these. kind: as for `draw`."""
    shares = (0.0, 0.5, 1.0) if high != low else (0.0,)
    if kind is not None and kind.goes_by_log(low, high):
        values = [math.exp((1 - share) * math.log(low) + share * math.log(high)) for share in shares]
        return [(share, number(value, value)) for share, value in zip(shares, values, strict=True)]
    return [(share, number(low + share * (high - low), abs(high - low))) for share in shares]

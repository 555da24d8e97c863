"""What the user chooses about curves: some of it is the scan's, the rest comes back whatever the scan."""

from __future__ import annotations

from dataclasses import dataclass, replace

from ....analysis.curves import ORDERS, Smoothing
from ....document.part import Part
from ....params import param

TIME, AGAINST, REPEATS = "time", "against", "repeats"
VALUE, SPEED, ACCELERATION = ORDERS
SCAN, ANCHORS = "scan", "anchors"
MODE_WORDS = {TIME: "Over time", AGAINST: "Against another", REPEATS: "Repeats"}
ORDER_WORDS = {VALUE: "Values", SPEED: "Speed", ACCELERATION: "Acceleration"}


@dataclass(frozen=True)
class CurveChoices(Part, name="curves"):
    """Choices about the curves of a scan.

    hidden: measures that are not plotted. abscissa: the measure that others are plotted against, "" for the
    first that is plotted. aligned: the one whose peaks repeats are aligned by, likewise. traced: landmarks
    whose trajectories are drawn. anchors: those that hold the scan still. noise: of the scanner, standard
    deviation of a coordinate, scan units.
    """

    hidden: tuple[str, ...] = ()
    abscissa: str = ""
    aligned: str = ""
    traced: tuple[str, ...] = ()
    anchors: tuple[str, ...] = ()
    noise: float = 0.0

    def with_measure_renamed(self, old: str, new: str) -> CurveChoices:
        """Choices that call a measure by another name."""

        def now(name: str) -> str:
            return new if name == old else name

        hidden = tuple(map(now, self.hidden))
        return replace(self, hidden=hidden, abscissa=now(self.abscissa), aligned=now(self.aligned))


@dataclass(frozen=True)
class Settings:
    """Choices that come back at the next start, whatever the scan."""

    is_open: bool = param(False, "Show the plot under the timeline")
    mode: str = param(TIME, "Quantities on the axes of the plot", choices=tuple(MODE_WORDS), words=MODE_WORDS)
    order: str = param(
        VALUE, "Values of the measures, or their rate of change", choices=ORDERS, words=ORDER_WORDS
    )
    bands: bool = param(
        True, "Band around each curve, which contains the true value in 95 % of cases", title="±"
    )
    seconds: float = param(
        0.3, (
            "Width of the window, in seconds, that smooths speeds, accelerations and the numbers under "
            "the plot"
        ),
        low=0.02, high=5.0, unit="s", title="Smoothing",
    )  # fmt: skip
    lines: bool = param(True, "Draw each measure in the view, with its value", title="In the view")
    least: float = param(
        0.5, "Smallest peak that counts as a repeat, as a share of the curve's range",
        low=0.05, high=1.0, title="Smallest repeat",
    )  # fmt: skip
    trajectories: bool = param(
        True, "Draw the paths of the landmarks that are ticked", title="Show paths", basic=True
    )
    coordinates: str = param(
        SCAN, "Show paths as recorded, or without head motion (the motion of the rigid references)",
        choices=(SCAN, ANCHORS), words={SCAN: "As recorded", ANCHORS: "With head motion removed"}, basic=True,
    )  # fmt: skip
    hold: bool = param(
        False, "Show the scan itself without head motion (the motion of the rigid references)",
        title="Remove head motion", basic=True,
    )  # fmt: skip
    by_speed: bool = param(
        True, "Colour paths by speed. If this option is off, each landmark has its own colour",
        title="Colour by speed", basic=True,
    )  # fmt: skip

    @property
    def smoothing(self) -> Smoothing:
        """How curves are smoothed."""
        return Smoothing(self.seconds)

    @property
    def derivative(self) -> int:
        """How often curves are differentiated."""
        return ORDERS.index(self.order)

"""The numbers of a movement in words."""

from __future__ import annotations

import math

from ....analysis.measures.curves import MeasureCurve
from ....analysis.words import SURE, UNKNOWN, with_uncertainty

WARNING = "(!)"  # before numbers of a movement that the user should know more about
NUMBERS_HELP = {
    "Amplitude": "Value at the peak minus the value at rest, which is the mean of the first frames. "
    "In 95 % of cases, the true difference lies within ±",
    "Onset": "Time when the curve has moved away from its value at rest by 10 % of the amplitude",
    "Peak": "Time when the curve is farthest from its value at rest",
    "Duration": "Time from the onset until the curve returns to its value at rest, within 10 % of the "
    "amplitude",
    "Fastest": "Largest rate of change of the measure, rising or falling",
}


def numbers_in_words(curve: MeasureCurve) -> tuple[str, ...]:
    """The numbers of a curve's movement, in the order of NUMBERS_HELP."""
    movement = curve.movement
    fastest = UNKNOWN if math.isnan(curve.fastest) else f"{curve.fastest:.3g} {curve.unit}/s"
    if movement is None:
        return *(UNKNOWN,) * (len(NUMBERS_HELP) - 1), fastest
    times = (
        (movement.onset, movement.onset_sigma),
        (movement.peak, 0.0),
        (movement.duration, movement.duration_sigma),
    )
    amplitude = with_uncertainty(movement.amplitude, movement.amplitude_sigma, curve.unit)
    if curve.warning:
        amplitude = f"{WARNING} {amplitude}"
    return amplitude, *(_seconds(*time) for time in times), fastest


def _seconds(time: float, sigma: float) -> str:
    return UNKNOWN if math.isnan(time) else f"{time:.2f} s" + (f" ± {SURE * sigma:.2f}" if sigma > 0 else "")

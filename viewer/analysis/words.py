"""Values with their uncertainty in words."""

from __future__ import annotations

import math

SURE = 1.96  # standard deviations within which 95 % of a normal distribution lie
UNKNOWN = "-"
_DECIMALS = (-6, 12)  # that a number is written out with
_COVERED = "(95 %)"  # of cases in which the true value is within what ± says


def with_uncertainty(value: float, sigma: float, unit: str = "") -> str:
    """A value with the digits that its uncertainty leaves it, such as "12.3 ± 0.4 mm"; a dash where it is not
    known. sigma: its standard deviation, NaN or 0 where not known."""
    if math.isnan(value):
        return UNKNOWN
    uncertainty = SURE * sigma
    if not uncertainty > 0:
        return f"{value:.6g} {unit}".rstrip()
    power = math.floor(math.log10(uncertainty))
    decimals = (
        -power if float(f"{uncertainty:.1e}") >= 2 * 10.0**power else 1 - power
    )  # two digits from 1.0 to 1.9
    if not _DECIMALS[0] <= decimals <= _DECIMALS[1]:
        return f"{value:.6g} ± {uncertainty:.1g} {unit}".rstrip()
    shown = (f"{round(number, decimals) + 0.0:.{max(decimals, 0)}f}" for number in (value, uncertainty))
    return f"{' ± '.join(shown)} {unit}".rstrip()


def measured_in_words(value: float, sigma: float, unit: str) -> str:
    """A value as above, and how often the true one is within ±: "12.3 ± 0.4 mm (95 %)"."""
    words = with_uncertainty(value, sigma, unit)
    return f"{words} {_COVERED}" if "±" in words else words


def with_note(words: str, note: str) -> str:
    """A value in words, with what to know about it."""
    return f"{words} ({note})" if note else words

"""Values of measures in words."""

from __future__ import annotations

import math

import pytest

from viewer.analysis.words import measured_in_words, with_uncertainty


@pytest.mark.parametrize(
    ("value", "uncertainty", "text"),
    [
        (12.3456, 0.4, "12.3 ± 0.4 mm (95 %)"),
        (12.3456, 0.04, "12.35 ± 0.04 mm (95 %)"),
        (12.3456, 0.149, "12.35 ± 0.15 mm (95 %)"),
        (12.3456, 0.196, "12.3 ± 0.2 mm (95 %)"),
        (12.3456, 0.97, "12.3 ± 1.0 mm (95 %)"),
        (1234.56, 30.0, "1230 ± 30 mm (95 %)"),
        (1234.56, 12.3, "1235 ± 12 mm (95 %)"),
        (0.000123456, 2e-6, "0.000123 ± 0.000002 mm (95 %)"),
        (1e-15, 2e-17, "1e-15 ± 2e-17 mm (95 %)"),
        (12.3456, math.nan, "12.3456 mm"),
        (12.3456, 0.0, "12.3456 mm"),
        (-0.01, 0.3, "0.0 ± 0.3 mm (95 %)"),
        (math.nan, 0.1, "-"),
    ],
)
def test_digits_follow_the_uncertainty(value: float, uncertainty: float, text: str) -> None:
    assert measured_in_words(value, uncertainty / 1.96, "mm") == text
    assert with_uncertainty(value, uncertainty / 1.96) == text.removesuffix(" (95 %)").removesuffix(" mm")

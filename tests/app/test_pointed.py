"""What the line under the timeline says."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from viewer.analysis.pick import Picked
from viewer.app.scene.pointed import describe_pick, point_details
from viewer.scan.units import Scale


def test_it_says_where_what_and_how_it_was_seen() -> None:
    picked = Picked(
        np.array([12.345678, -0.5, 1e3]),
        level=0,
        covariance=np.diag([0.01, 0.0, 0.04]),
        row=3,
        id=7,
        point=np.array([12.0, -0.5, 1e3]),
        color=np.array([255, 128, 0, 255], np.uint8),
        normal=np.array([0, 0.6, 0.8], np.float32),
        scalars={"temperature": 36.6123456789, "label": 4},
    )
    assert describe_pick(picked, "frame 3/25", Scale("mm"), 150.0, "temperature") == [
        "12.35, -0.50, 1000.00 ± 0.39 mm",
        "frame 3/25",
        "temperature 36.6123",
    ], "colours show the temperature"
    far = replace(picked, scalars={"distance from reference": 0.0015})
    words = describe_pick(far, "", Scale.of("m", "mm"), 0.15, "distance from reference")
    assert words[-1] == "distance from reference 1.5 mm"
    assert point_details(picked, "temperature") == [
        "point 7",
        "label 4",
        "colour #ff8000",
        "normal 0.00, 0.60, 0.80",
    ]


def test_it_says_where_another_surface_may_be_meant() -> None:
    words = [
        describe_pick(Picked(np.zeros(3), level=0, doubt=doubt), "", Scale("m"), 1.0)
        for doubt in (0.04, 0.06)
    ]
    assert [(any("in front or behind" in word for word in some)) for some in words] == [False, True]


def test_what_was_filled_is_no_point() -> None:
    assert describe_pick(Picked(np.zeros(3), level=2), "frame 1/1", Scale("units"), 1.0)[1:] == [
        "frame 1/1",
        "in a hole that the renderer filled from level 2",
    ]


@pytest.mark.parametrize(
    ("radius", "text"),
    [
        (0.12, "10000000.12346"),
        (99.0, "10000000.123"),
        (5e6, "10000000"),
        (0.0, "10000000.1235"),
        (1e-30, "10000000.123456789"),
    ],
)
def test_positions_have_the_digits_that_matter_for_the_scans_size(radius: float, text: str) -> None:
    words = describe_pick(Picked(np.full(3, 1e7 + 0.123456789), level=0), "", Scale("m"), radius)[0]
    assert words == f"{text}, {text}, {text} m"


def test_lengths_are_told_in_the_unit_that_is_shown() -> None:
    picked = Picked(np.array([0.1, 0.02, -0.25]), level=0, covariance=np.diag([1e-8, 0, 0]))
    metres, millimetres = (describe_pick(picked, "", Scale.of("m", unit), 0.125)[0] for unit in ("m", "mm"))
    assert metres.startswith("0.10000, 0.02000, -0.25000 ±")
    assert millimetres.startswith("100.00, 20.00, -250.00 ±")
    assert metres.endswith(" m")
    assert millimetres.endswith(" mm")
    told = [float(words.partition("±")[2].split()[0]) for words in (metres, millimetres)]
    assert told[1] == pytest.approx(1000 * told[0])

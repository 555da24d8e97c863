"""Anatomical spaces as remarks of files state them."""

from __future__ import annotations

import pytest

from viewer.scan.reading import axes
from viewer.scan.reading.corrections import Corrections


@pytest.mark.parametrize(
    ("remark", "space"),
    [
        ("SPACE=RAS", "RAS"),
        ("SPACE=LPS", "LPS"),
        ("Space: lps", "LPS"),
        ('space = "RAS"', "RAS"),
        ("space: left-posterior-superior", "LPS"),
        ("space right anterior superior", "RAS"),
        ("Coordinate system: RAS", "RAS"),
        ("3D Slicer output. SPACE=RAS;", "RAS"),
        ("axes RAS", "RAS"),
    ],
)
def test_remarks_state_the_space(remark: str, space: str) -> None:
    decision = axes.decide(["made by a scanner", remark])
    assert (decision.value, decision.source) == (space, "file")
    assert remark in decision.where


@pytest.mark.parametrize("remark", ["", "space", "free space: 12", "this axis is no space", "raster space"])
def test_other_remarks_do_not(remark: str) -> None:
    decision = axes.decide([remark])
    assert (decision.value, decision.source) == ("unknown", "assumed")
    assert decision.alternatives == ("LPS", "RAS")


def test_the_user_wins() -> None:
    assert axes.decide(["SPACE=RAS"], Corrections.parse({"axes": "lps"})).value == "LPS"

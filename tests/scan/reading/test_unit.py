"""The unit of length as files, remarks and users state it."""

from __future__ import annotations

import pytest

from viewer.scan.reading import unit
from viewer.scan.reading.corrections import Corrections


@pytest.mark.parametrize(
    ("remark", "wanted"),
    [
        ("units: mm", "mm"),
        ("Unit = meters", "m"),
        ("length unit is cm", "cm"),
        ("UNITS millimetres", "mm"),
        ("all units are in", "in"),
        ("unit: foot", "ft"),
    ],
)
def test_remarks_state_the_unit(remark: str, wanted: str) -> None:
    decision = unit.decide(None, ["VCGLIB generated", remark])
    assert (decision.value, decision.source, decision.where) == (wanted, "file", f"comment {remark}")


@pytest.mark.parametrize("remark", ["a unit of work", "units", "unit: radians", "unit sphere", "United"])
def test_other_remarks_do_not(remark: str) -> None:
    decision = unit.decide(None, [remark])
    assert (decision.value, decision.source) == ("units", "assumed")
    assert decision.is_marked


def test_the_user_wins_over_the_file_and_the_file_over_remarks() -> None:
    assert unit.decide("m", ["units: mm"]).value == "m"
    assert unit.decide("m", [], Corrections.parse({"unit": "ft"})).value == "ft"
    assert unit.decide("no word at all", ["units: mm"]).value == "mm"

"""Corrections as a user writes them."""

from __future__ import annotations

from typing import Any

import pytest

from viewer.errors import InputError
from viewer.scan.reading.corrections import CORRECTED, Corrections, parsed_pair
from viewer.scan.reading.record import KEYS


@pytest.mark.parametrize(
    ("key", "text", "value"),
    [
        ("columns", "x,y,z,intensity", ("x", "y", "z", "intensity")),
        ("columns", "number - x y z curvature", ("number", "-", "x", "y", "z", "curvature")),
        ("separator", "Semicolon", "semicolon"),
        ("decimal", ",", ","),
        ("skip", "3", 3),
        ("encoding", "Latin-1", "latin-1"),
        ("colors", "65535", "65535"),
        ("normals", "none", "none"),
        ("orientation", "Fine", "fine"),
        ("orientation", "auto-flipped", "auto-flipped"),
        ("missing", "0,0,0", (0.0, 0.0, 0.0)),
        ("missing", "-9999", -9999.0),
        ("missing", "none", "none"),
        ("camera", "290,290,159.5,89.5", (290.0, 290.0, 159.5, 89.5)),
        ("camera", "290,290,159.5,89.5,0.1,0,0,0", (290.0, 290.0, 159.5, 89.5, 0.1, 0.0, 0.0, 0.0)),
        ("camera", "other/info.txt", "other/info.txt"),
        ("depth-scale", "1000", 1000.0),
        ("depth-channel", "Depth.V", "Depth.V"),
        ("axes", "ras", "RAS"),
        ("axes", "x -z y", "+x -z +y"),
        ("unit", "mm", "mm"),
        ("frames", "*.ply", "*.ply"),
        ("take", "take2", "take2"),
        ("times", "Names", "names"),
        ("times", "fps:50", "fps:50"),
        ("times", "column:Zeit", "column:Zeit"),
        ("texture", "dense", "dense"),
        ("splats", "no", "no"),
    ],
)
def test_texts_become_values(key: str, text: str, value: Any) -> None:
    corrections = Corrections.parse({key: text})
    assert corrections[key] == value
    assert corrections.texts == {key: text}


@pytest.mark.parametrize(
    ("key", "text"),
    [
        ("columns", "x,y"),
        ("columns", "x,x,y,z"),
        ("columns", ""),
        ("separator", "|"),
        ("decimal", "-"),
        ("skip", "-1"),
        ("skip", "many"),
        ("colors", "256"),
        ("missing", "0,0"),
        ("missing", "nan"),
        ("camera", "290,290,159.5"),
        ("camera", "290,290,159.5,nan"),
        ("camera", "290,290,159.5,89.5,0.1"),
        ("camera", "0,290,159.5,89.5"),
        ("depth-scale", "0"),
        ("depth-scale", "inf"),
        ("axes", "x y"),
        ("axes", "x x z"),
        ("times", "fps:0"),
        ("unit", "1 2"),
        ("take", ""),
    ],
)
def test_unusable_values_are_refused_with_what_is_expected(key: str, text: str) -> None:
    with pytest.raises(InputError) as refused:
        Corrections.parse({key: text})
    assert key in refused.value.what or key == "unit"
    assert (refused.value.hint or "").startswith(("Give ", "Use "))


def test_unknown_keys_are_refused_with_the_known_ones() -> None:
    with pytest.raises(InputError, match=r"unknown correction 'columms'.*Did you mean 'columns'"):
        Corrections.parse({"columms": "x,y,z"})
    assert set(CORRECTED) <= set(KEYS)


def test_later_corrections_win() -> None:
    corrections = Corrections.parse({"decimal": ",", "skip": "2"}).amended({"skip": "3"})
    assert dict(corrections) == {"decimal": ",", "skip": 3}
    assert corrections == Corrections.parse({"skip": "3", "decimal": ","})
    assert hash(corrections) == hash(Corrections.parse({"skip": "3", "decimal": ","}))


def test_a_correction_is_a_decision_of_the_user() -> None:
    decision = Corrections.parse({"columns": "x y z"}).decision("columns")
    assert decision is not None
    assert (decision.value, decision.source, decision.where) == (["x", "y", "z"], "user", "--read")
    assert Corrections().decision("columns") is None


def test_a_pair_of_the_command_line() -> None:
    assert parsed_pair("times=column:a=b") == ("times", "column:a=b")
    with pytest.raises(InputError, match="KEY=VALUE"):
        parsed_pair("decimal")

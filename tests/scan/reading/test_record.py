"""The record of how a scan was read."""

from __future__ import annotations

import json

import pytest

from viewer.errors import InputError
from viewer.scan.reading.record import KEYS, Aside, Contradiction, Decision, Reading, Take

CAMERA = Decision(
    "camera",
    {"fx": 290.0, "cx": 159.5, "file": "info.txt"},
    "assumed",
    "",
    "No file states it.",
    ("290",),
    True,
)
FORMAT = Decision("format", "PLY")


def full() -> Reading:
    return Reading(
        {"camera": CAMERA, "format": FORMAT},
        (Aside("f002 - Copy.ply", "copy of f002.ply"),),
        ("45 harmonics",),
        (Take("take1", "take1_*.ply", 3),),
        (Contradiction(4, "colors", "its colors go up to 65535"),),
    )


def test_every_key_is_there_in_one_order() -> None:
    """A decision that does not arise has no value."""
    record = Reading.of(CAMERA)
    assert list(record.decisions) == list(KEYS)
    assert record["columns"].value is None
    assert record.with_(FORMAT)["format"].value == "PLY"


def test_only_assumptions_that_change_numbers_are_marked() -> None:
    assert Reading.of(CAMERA, Decision("decimal", ".", "assumed")).assumed == ("camera",)
    assert Reading.of(Decision("camera", {}, "user", changes_numbers=True)).assumed == ()
    assert Reading.of(Decision("unit", None, "assumed", changes_numbers=True)).assumed == ()


def test_json_brings_back_the_record() -> None:
    data = json.loads(json.dumps(full().to_json()))
    assert Reading.from_json(data) == full()
    assert data["decisions"]["camera"]["from"] == ""
    assert data["assumed"] == ["camera"]
    data["decisions"]["of a later version"] = {}
    assert Reading.from_json(data) == full()


@pytest.mark.parametrize(
    "data", [None, [], {}, {"decisions": {"camera": 1}}, {"decisions": {}, "aside": [1]}]
)
def test_damaged_json_is_refused(data: object) -> None:
    with pytest.raises(InputError, match="not a record"):
        Reading.from_json(data)


def test_lines_say_all_and_the_short_form_one_line() -> None:
    rows = full().lines()
    assert rows == [
        ("read as", "PLY; camera fx 290, cx 159.5, file info.txt"),
        ("assumed", "camera fx 290, cx 159.5, file info.txt"),
    ]
    texts = dict(full().lines(verbose=True))
    assert texts["camera"].endswith("(assumed). No file states it. Alternatives: 290")
    assert texts["left aside"] == "f002 - Copy.ply: copy of f002.ply"
    assert texts["not used"] == "45 harmonics"
    assert "take1" in texts["take"]
    assert texts["contradiction"].startswith("frame 5")


def test_without_names_no_file_is_named() -> None:
    record = full().with_(Decision("frames", "anna_*.ply", "folder"), Decision("take", "anna", "folder"))
    text = json.dumps(record.without_names().to_json())
    assert not [name for name in ("anna", "info.txt", "Copy", "take1") if name in text]
    assert record.without_names()["camera"].value == {"fx": 290.0, "cx": 159.5}
    assert record.without_names().assumed == ("camera",)


def test_unknown_keys_and_sources_are_refused() -> None:
    with pytest.raises(InputError, match=r"unknown decision 'colour'.*colors"):
        Decision("colour", 1)
    with pytest.raises(InputError, match="unknown source"):
        Decision("camera", 1, "guess")  # type: ignore[arg-type]

"""Templates of landmarks: those that are shipped, and files of users."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from viewer.analysis.landmarks import Landmark
from viewer.analysis.landmarks.mirroring import partners_of
from viewer.analysis.landmarks.templates import (
    is_template_file,
    read_template,
    save_template,
    template_of,
    templates,
)
from viewer.analysis.measures import Measure
from viewer.analysis.surface_point import SurfacePoint
from viewer.errors import InputError


def test_those_that_are_shipped() -> None:
    assert set(templates()) == {"body", "eyes", "face-21", "lips"}
    assert len(templates()["face-21"].landmarks) == 21
    for template in templates().values():
        names = [landmark.name for landmark in template.landmarks]
        assert all(landmark.about and landmark.state == "not placed" for landmark in template.landmarks)
        assert template.title
        assert template.source
        partners = {landmark.name: landmark.partner for landmark in template.landmarks if landmark.partner}
        assert partners == partners_of(names)
        for landmark in template.landmarks:
            assert ("right" in landmark.about) == landmark.name.endswith("R")
            assert ("left" in landmark.about) == landmark.name.endswith("L")
        assert {measure.kind for measure in template.measures} <= {"distance", "angle"}
        for measure in template.measures:
            assert len(measure.landmarks) == (2 if measure.kind == "distance" else 3)
            assert len(set(measure.landmarks)) == len(measure.landmarks)
    measured = {measure.name: measure.landmarks for measure in templates()["face-21"].measures}
    assert measured["mouth width"] == ("chR", "chL")
    assert measured["mouth opening"] == ("ls", "li")


def test_a_template_is_read_as_it_was_written(tmp_path: Path) -> None:
    for template in templates().values():
        save_template(tmp_path / "mine.json", template)
        assert read_template(tmp_path / "mine.json") == template


def own(**changes: Any) -> dict[str, Any]:
    data = {
        "format": 1,
        "name": "mine",
        "landmarks": [{"name": "aL", "partner": "aR"}, {"name": "aR", "partner": "aL"}, {"name": "鼻"}],
        "measures": [{"name": "w", "kind": "distance", "landmarks": ["aL", "aR"]}],
    }
    return data | changes


def test_a_template_of_present_landmarks_is_read_again(tmp_path: Path) -> None:
    spot = SurfacePoint(0, 0.0, (1.0, 2.0, 3.0), None, None, 0)
    landmarks = (
        Landmark("left", (spot,), partner="right", about="the left one"), Landmark("right", partner="left"),
        Landmark("alone", partner="left", skipped=True), Landmark("lost", partner="nobody"),
    )  # fmt: skip
    width = Measure("width", "distance", ("left", "right"))
    odd = (replace(width, name="gone", landmarks=("left", "gone")), replace(width, name="?", kind="?"))
    template = template_of("own", landmarks, (width, *odd))
    assert [(one.name, one.partner, one.keys) for one in template.landmarks] == [
        ("left", "right", ()), ("right", "left", ()), ("alone", "", ()), ("lost", "", ()),
    ]  # fmt: skip
    assert template.measures == (width,)
    save_template(tmp_path / "own.json", template)
    assert read_template(tmp_path / "own.json") == template
    with pytest.raises(InputError, match="at least one landmark"):
        template_of("own", (), ())


def test_a_template_of_a_user(tmp_path: Path) -> None:
    (tmp_path / "mine.json").write_text(json.dumps(own()), encoding="utf-8")
    found = read_template(tmp_path / "mine.json")
    assert (found.name, found.title, found.source) == ("mine", "mine", "")
    assert [landmark.partner for landmark in found.landmarks] == ["aR", "aL", ""]
    assert found.measures[0].landmarks == ("aL", "aR")


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"format": 2}, "has the format 2, but Scan4D reads 1"),
        ({"landmarks": []}, "has no landmarks"),
        ({"landmarks": 3}, "'landmarks' is not a list"),
        ({"landmarks": [3]}, r"landmarks\[0\]: is not a JSON object"),
        ({"landmarks": [{"name": ""}]}, r"landmarks\[0\]: 'name' is missing"),
        ({"landmarks": [{"name": "a\nb"}]}, "must be one line of text"),
        ({"landmarks": [{"name": "a" * 300}]}, "longer than 200"),
        ({"landmarks": [{"name": "a"}, {"name": "a"}]}, "the landmark 'a' appears twice"),
        ({"landmarks": [{"name": "a", "partner": "b"}, {"name": "b"}]}, "is not the mirror partner of"),
        ({"landmarks": [{"name": "a", "colour": "b"}]}, "unknown field 'colour'"),
        (
            {"measures": [{"name": "w", "kind": "distance", "landmarks": ["x", "y"]}]},
            r"measures\[0\]: the template has no landmark",
        ),
        ({"measures": [{"name": "w"}]}, r"measures\[0\]: must have a 'name' and a 'kind'"),
        ({"measures": [{"name": "w", "kind": "k", "options": {"a": 1}}]}, "'options' must be names"),
        ({"measures": [{"name": "w", "kind": "width"}]}, r"measures\[0\]: unknown kind of measure 'width'"),
        ({"measures": [{"name": "w", "kind": "angle", "landmarks": ["aL"]}]}, "takes 3 landmarks, not 1"),
        ({"more": 1}, "unknown field 'more'"),
        ({"name": " mine"}, "has blanks at its start or end"),
    ],
)
def test_a_template_that_is_wrong(changes: dict[str, Any], words: str, tmp_path: Path) -> None:
    path = tmp_path / "mine.json"
    path.write_text(json.dumps(own(**changes)))
    with pytest.raises(InputError, match=words) as caught:
        read_template(path)
    assert str(caught.value).startswith(str(path))


@pytest.mark.parametrize("data", [b"", b"{", b"\xff\xfe", b"[" * 100_000, b"3"])
def test_a_template_that_is_damaged(data: bytes, tmp_path: Path) -> None:
    (tmp_path / "mine.json").write_bytes(data)
    with pytest.raises(InputError, match=r"mine\.json"):
        read_template(tmp_path / "mine.json")
    with pytest.raises(InputError, match="no such file"):
        read_template(tmp_path / "other.json")


def test_a_template_is_told_from_other_files(tmp_path: Path) -> None:
    texts = {"mine.json": own(), "wrong.json": own(title=3), "other.json": {"landmarks": [], "document": {}}}
    for name, data in texts.items():
        (tmp_path / name).write_text(json.dumps(data))
    (tmp_path / "broken.json").write_text("{")
    names = [name for name in (*texts, "broken.json", "missing.json") if is_template_file(tmp_path / name)]
    assert names == ["mine.json", "wrong.json"]

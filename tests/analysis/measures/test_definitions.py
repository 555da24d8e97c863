"""Measures out of files: what cannot be used is one message with the place."""

from __future__ import annotations

from pathlib import Path

import pytest

from viewer.analysis.measures import Measure
from viewer.analysis.measures.definitions import read_measures
from viewer.errors import InputError


def test_measures_are_read_of_toml_and_json(tmp_path: Path) -> None:
    (tmp_path / "m.toml").write_text('[[measures]]\nname = "m"\nkind = "distance"\nlandmarks = ["a", "b"]\n')
    (tmp_path / "m.json").write_text('[{"name": "m", "kind": "distance", "landmarks": ["a", "b"]}]')
    for name in ("m.toml", "m.json"):
        assert read_measures(tmp_path / name) == (Measure("m", "distance", ("a", "b")),)


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("m.toml", "measures = " + "[" * 10_000),
        ("m.toml", "m = " + "{a=" * 10_000),
        ("m.json", "[" * 100_000),
    ],
)
def test_what_is_nested_too_deeply_is_told(tmp_path: Path, name: str, text: str) -> None:
    (tmp_path / name).write_text(text)
    with pytest.raises(InputError, match="nested too deeply") as caught:
        read_measures(tmp_path / name)
    assert str(caught.value).startswith(str(tmp_path / name))

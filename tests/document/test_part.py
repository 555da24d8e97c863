"""Parts that could not be kept are refused by their declaration, values that could not by their place."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest

from viewer.document.landmarks import Landmarks
from viewer.document.part import Part
from viewer.geometry import Vector


@dataclass(frozen=True)
class Note:
    text: str
    position: Vector = (0.0, 0.0, 0.0)
    size: float | None = None


@dataclass
class Loose:
    text: str = ""


@pytest.fixture(autouse=True)
def known() -> Iterator[None]:
    """No part of these tests stays known."""
    before = dict(Part.kinds)
    yield
    Part.kinds.clear()
    Part.kinds.update(before)


def test_what_the_tools_keep_is_declared_as_it_has_to_be() -> None:
    assert Landmarks in Part.kinds.values()
    for kind in Part.kinds.values():
        kind.check_declared()


def declared(kind: Any, default: Any = (), frozen: bool = True) -> type[Part]:
    class Notes(Part, name="notes"):
        all = default

    Notes.__annotations__ = {"all": kind}
    if default is None:
        del Notes.all
    return dataclass(frozen=frozen)(Notes)


@pytest.mark.parametrize(
    ("kind", "words"),
    [
        (list[Note], r"Notes\.all cannot be stored as list\[.*Note\]: Scan4D stores .*tuple\[...\]"),
        (list, r"Notes\.all cannot be stored as list"),
        (np.ndarray, r"Notes\.all cannot be stored as ndarray"),
        (dict[str, Note], r"Notes\.all cannot be stored as dict.*Mapping\[str, ...\]"),
        (Mapping[int, str], r"Notes\.all cannot be stored as .*Mapping\[int, str\]"),
        (Any, r"Notes\.all cannot be stored as .*Any"),
        (tuple[Loose, ...], r"Notes\.all: Loose is mutable; .*frozen=True"),
    ],
)
def test_a_field_that_could_change_or_not_be_kept_is_refused(kind: Any, words: str) -> None:
    with pytest.raises(TypeError, match=words):
        declared(kind).check_declared()


def test_a_part_that_is_no_frozen_dataclass_with_defaults_is_refused() -> None:
    declared(tuple[Note, ...]).check_declared()
    with pytest.raises(TypeError, match=r"Notes: Notes is mutable; .*frozen=True"):
        declared(tuple[Note, ...], frozen=False).check_declared()
    with pytest.raises(TypeError, match=r"Notes\.all has no default"):
        declared(tuple[Note, ...], default=None).check_declared()

    class Undeclared(Part, name="undeclared"):
        pass

    with pytest.raises(TypeError, match=r"Undeclared is not a dataclass"):
        Undeclared.check_declared()


@dataclass(frozen=True)
class Kept:
    all: tuple[Note, ...] = ()
    named: Mapping[str, int] = field(default_factory=dict)


def part(**values: Any) -> Part:
    class Notes(Part, Kept, name="notes"):
        pass

    return dataclass(frozen=True)(Notes)(**values)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        (
            {"all": (Note("a", np.zeros(3)),)},  # type: ignore[arg-type]
            r"^notes\.all\[0\]\.position must be a tuple, not array\(\[0\., 0\., 0\.\]\) \(ndarray\)$",
        ),
        ({"all": (Note("a"), Note("b", (1.0, 2.0)))}, r"^notes\.all\[1\]\.position must be 3 values"),  # type: ignore[arg-type]
        (
            {"all": (Note("a", size=np.float32(1)),)},  # type: ignore[arg-type]
            r"^notes\.all\[0\]\.size must be a finite number, not .* \(float32\)$",
        ),
        (
            {"all": (Note("a", size=float("nan")),)},
            r"^notes\.all\[0\]\.size must be a finite .* nan",
        ),
        ({"named": {"a": 0.5}}, r"^notes\.named\.a must be a whole number, not 0\.5 \(float\)$"),
        (
            {"all": [Note("a")]},
            r"^notes\.all does not survive saving: \[.*\(list\) would become \(.*\(tuple\)$",
        ),
    ],
)
def test_a_value_that_could_not_be_read_again_is_refused_with_its_place(
    values: dict[str, Any], words: str
) -> None:
    with pytest.raises(TypeError, match=words):
        part(**values).check_storable()


def test_a_value_that_can_be_read_again_is_kept() -> None:
    part(all=(Note("a", (1, 2, 3), 4),), named={"a": 1}).check_storable()
    part().check_storable()


def test_of_a_change_what_is_new_is_checked_and_told_with_its_place_in_the_whole() -> None:
    before = part(all=(Note("a"), Note("b")), named={"a": 1})
    kind: Any = type(before)
    kept = kind(all=(before.all[1], Note("c")), named={"a": 1})  # type: ignore[attr-defined]
    kept.check_storable(before)
    wrong = Note("c", (1.0, 2.0))  # type: ignore[arg-type]
    with pytest.raises(TypeError, match=r"^notes\.all\[2\]\.position must be 3 values"):
        kind(all=(*before.all, wrong)).check_storable(before)  # type: ignore[attr-defined]
    with pytest.raises(TypeError, match=r"^notes\.named\.a must be a whole number"):
        kind(all=before.all, named={"a": 0.5}).check_storable(before)  # type: ignore[attr-defined]


def test_what_was_checked_is_not_gone_through_again(monkeypatch: pytest.MonkeyPatch) -> None:
    from viewer.document import schema

    before = part(all=tuple(Note(str(number)) for number in range(50)))
    plain, gone_through = schema.plain, []

    def counted(value: Any) -> Any:
        gone_through.append(value)
        return plain(value)

    monkeypatch.setattr(schema, "plain", counted)
    kind: Any = type(before)
    kind(all=(*before.all, Note("new"))).check_storable(before)  # type: ignore[attr-defined]
    assert [value for value in gone_through if isinstance(value, Note)] == [Note("new")]

"""What is kept as JSON is read by the types of its dataclass; what is wrong is told with its place."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal

import pytest

from viewer.camera import Camera
from viewer.document.schema import Kind, PoseNumber, check_format, plain, structured, unread
from viewer.errors import InputError
from viewer.look import Look


@dataclass(frozen=True)
class Pin:
    name: str
    place: tuple[float, float, float]
    kind: Literal["note", "mark"] = "note"
    frame: PoseNumber | None = None


@dataclass(frozen=True)
class Pins:
    all: tuple[Pin, ...] = ()
    even: Annotated[int, Kind("an even number", lambda value: value % 2 == 0)] = 0
    seen: bool = True
    camera: Camera | None = None
    look: Look = field(default_factory=Look)


FULL = Pins(
    (Pin("a", (1.0, 2.5, 3.0), "mark", 7), Pin("b", (0.0, 0.0, 0.0))), 4, False, Camera(), Look(low=1)
)


def test_a_value_comes_back_from_json_as_it_was() -> None:
    assert structured(Pins, json.loads(json.dumps(plain(FULL)))) == FULL
    assert structured(Pins, {}) == Pins(), "what is not told has its default"


def changed(*path: Any, to: Any) -> Any:
    data = inner = json.loads(json.dumps(plain(FULL)))
    for step in path[:-1]:
        inner = inner[step]
    inner[path[-1]] = to
    return data


@pytest.mark.parametrize(
    ("data", "words"),
    [
        ([], "f: It must be an object with named values, not []"),
        (changed("all", to="pin"), "f: 'all' must be a list, not pin"),
        (changed("all", to={"a": 1}), "f: 'all' must be a list"),
        (changed("all", 1, to=7), "f: 'all[1]' must be an object with named values, not 7"),
        (changed("all", 1, "name", to=None), "f, all[1]: 'name' must be a text, not None"),
        (changed("all", 0, "place", to=[1, 2]), "f, all[0]: 'place' must be 3 values, not [1, 2]"),
        (changed("all", 0, "place", 2, to=True), "f, all[0]: 'place' must be a finite number, not True"),
        (
            changed("all", 0, "place", 2, to=float("nan")),
            "f, all[0]: 'place' must be a finite number, not nan",
        ),
        (changed("all", 0, "place", 2, to=10**400), "f, all[0]: 'place' must be a finite number, not 1000"),
        (changed("all", 0, "kind", to=["note"]), "f, all[0].kind: cannot be used"),
        (changed("all", 0, "frame", to=-1), "f, all[0]: 'frame' must be the index of a frame, not -1"),
        (changed("all", 0, "nmae", to=1), "f, all[0]: unknown field 'nmae'. Did you mean 'name'?"),
        (changed("all", 0, to={"place": [1, 2, 3]}), "f, all[0]: has no 'name'"),
        (changed("even", to=3), "f: 'even' must be an even number, not 3"),
        (changed("even", to=2.0), "f: 'even' must be an even number, not 2.0"),
        (changed("seen", to=1), "f: 'seen' must be true or false, not 1"),
        (changed("camera", "fov_y", to=0), "f, camera: the camera's fov_y is 0"),
        (changed("look", "light", to="dim"), "f, look: unknown light 'dim'"),
        (changed("look", to=3), "f: 'look' must be an object with named values, not 3"),
    ],
)
def test_what_is_wrong_is_told_with_its_place(data: Any, words: str) -> None:
    with pytest.raises(InputError) as caught:
        structured(Pins, data, "f")
    assert str(caught.value).startswith(words)
    assert "\n" not in str(caught.value)


def test_another_format_is_refused_with_the_one_that_is_read() -> None:
    check_format({"format": 3}, 3, "f")
    for unknown in (0, 4, "3", True, None, [1], 1.0, 3.0):
        with pytest.raises(InputError, match="reads 3"):
            check_format({"format": unknown}, 3, "f")


def test_what_nothing_here_reads_is_kept_unless_it_could_not_be_written_again() -> None:
    nested: Any = 1
    for _ in range(30):
        nested = {"a": [nested]} if isinstance(nested, int) else [nested]
    assert unread({"later": nested}) == {"later": nested}
    for _ in range(30):
        nested = [nested]
    with pytest.raises(InputError, match="nested"):
        unread(nested)

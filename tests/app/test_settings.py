"""What comes back at the next start, and what damaged files do: nothing worse than the defaults."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from dataclasses import MISSING, asdict, fields, replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from viewer.app import settings
from viewer.app.output.export_plan import Choices
from viewer.app.output.exporting import Exporting
from viewer.app.part import part_classes, stored_values
from viewer.app.playing.player import Pace
from viewer.app.session import Session, SessionSettings, known_as
from viewer.app.settings import load, save
from viewer.app.window import WindowPlacement, reachable
from viewer.app.window_look import stored_placement
from viewer.backends import backend
from viewer.camera import Camera
from viewer.choice.goal import Goal
from viewer.document.schema import usable
from viewer.look import Look
from viewer.output.legend import Marks

CAMERA = Camera(eye=(1, 2, 3), target=(0.5, 0, 0), fov_y=25)
PLACEMENT = WindowPlacement(10, 20, 800, 600, maximised=True)
FULL = {
    "session": {
        "backend": "surfels", "params": {"points": {"point_size": 7}},
        "goal": {"kind": "error", "bound": 0.5, "unit": "px"},
        "look": {"light": "fixed", "azimuth": 12, "background": "#102030"},
        "pace": {"speed": 0.5, "reverse": True, "loop": False, "every_frame": False},
    },
    "window_look": {"window": asdict(PLACEMENT), "theme": "light", "text_scale": 1.35},
    "marks": {"shown": asdict(Marks(stamp=True)), "in_files": False},
    "cube": {"is_shown": False},
    "steering": {"turn_seconds": 24.0},
    "exporting": {
        "choices": asdict(Choices(what="turntable", width=640, anonymous=True)),
        "marks": asdict(Marks(scale_bar=True)),
    },
    "scans": {"recent": ["/scans/b", "demo"]},
    "side_panel": {"width": 30.0, "opened": {"Statistics": True}},
    "drawer": {"height": 22.5},
    "glide": {"is_wanted": False},
    "pointer": {"has_details": True},
    "drawing": {"slow_devices": ["llvmpipe"]},
    "welcome": {"is_over": True},
}  # fmt: skip


def read(data: Any) -> dict[str, Any]:
    """Name of a part -> the values that come back of what a file has; and the placement of the window."""
    found = {name: stored_values(cls, data.get(name)) for name, cls in part_classes().items()}
    found["session"] = usable(SessionSettings(), data.get("session"))
    found["window"] = stored_placement(data)
    return found


@pytest.fixture(autouse=True)
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "home"))


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "home" / "scan4d" / settings.FILE


def written(file: Path, data: Any) -> Path:
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(data if isinstance(data, str) else json.dumps(data))
    return file


def test_all_of_it_comes_back(file: Path) -> None:
    found = read(FULL)
    for name, cls in part_classes().items():
        declared = {of.name: of for of in getattr(cls, "__dataclass_fields__", {}).values() if of.metadata}
        assert declared.keys() <= FULL.get(name, {}).keys(), f"the example has every value of {name}"
        for one, of in declared.items():
            default = of.default if of.default_factory is MISSING else of.default_factory()
            assert found[name][one] != default, f"{name}.{one}"
    assert found["session"] == SessionSettings(
        backend="surfels", params={"points": backend("points").params({"point_size": 7})},
        goal=Goal("error", 0.5, "px"), look=Look(light="fixed", azimuth=12, background="#102030"),
        pace=Pace(speed=0.5, reverse=True, loop=False),
    )  # fmt: skip
    assert found["window"] == PLACEMENT
    save(FULL, file)
    assert load(file) == (FULL, [])
    assert [path.name for path in file.parent.iterdir()] == [settings.FILE]


def test_without_a_file_the_defaults_hold(file: Path) -> None:
    assert load(file) == ({}, [])
    assert not file.parent.exists()


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "damaged"), ("{", "damaged"), ("[1, 2]", "another version"), ("{}", "another version"),
        ('{"format": 99, "theme": "light"}', "another version"), ("[" * 100_000, "damaged"),
    ],
)  # fmt: skip
def test_a_damaged_file_is_put_aside_and_told_once(file: Path, text: str, why: str) -> None:
    loaded, (message,) = load(written(file, text))
    assert loaded == {}
    assert why in message
    assert str(file) in message
    kept = file.with_name("settings.old.json")
    assert kept.read_text() == text
    assert load(file) == ({}, []), "the next start begins anew"


def test_a_file_that_is_not_utf_8(file: Path) -> None:
    written(file, "").write_bytes(b'{"format": 1, "theme": "\xff"}')
    assert "damaged" in load(file)[1][0]


def test_a_file_that_cannot_be_read_is_told_and_stays(file: Path) -> None:
    file.mkdir(parents=True)
    loaded, (message,) = load(file)
    assert loaded == {}
    assert "cannot be read" in message
    assert file.is_dir()


def changed(change: Callable[[dict[str, Any]], object]) -> dict[str, Any]:
    data = json.loads(json.dumps(FULL))
    change(data)
    return read(data)


@pytest.mark.parametrize(
    ("change", "part", "lost"),
    [
        (lambda data: data["window_look"].update(theme="pink", later="?"), "window_look", {"theme"}),
        (lambda data: data["window_look"].update(text_scale=77), "window_look", {"text_scale"}),
        (lambda data: data["side_panel"].update(width=3), "side_panel", {"width"}),
        (lambda data: data["drawer"].update(height="high"), "drawer", {"height"}),
        (lambda data: data["steering"].update(turn_seconds=-1), "steering", {"turn_seconds"}),
        (lambda data: data["scans"].update(recent=["/a", 3]), "scans", {"recent"}),
        (lambda data: data.update(glide=[1]), "glide", {"is_wanted"}),
        (lambda data: data.update(later={"is_wanted": 1}), "glide", set()),
    ],
)  # fmt: skip
def test_what_is_wrong_is_left_out_alone(
    change: Callable[[dict[str, Any]], object], part: str, lost: set[str]
) -> None:
    expected = read(FULL)
    for name in lost:
        del expected[part][name]
    assert changed(change) == expected


@pytest.mark.parametrize("window", [[1, 2], {"left": "x"}, asdict(replace(PLACEMENT, left=10**9)), None])
def test_a_placement_that_cannot_be_used_is_left_out(window: Any) -> None:
    assert changed(lambda data: data["window_look"].update(window=window))["window"] is None


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (lambda data: data.update(backend="gone"), {"backend": None}),
        (lambda data: data["goal"].update(bound=-1), {"goal": None}),
        (lambda data: data["goal"].update(kind="speed"), {"goal": None}),
        (lambda data: data["params"].update(gone={"x": 1}), {}),
        (lambda data: data["params"]["points"].update(point_size="big", gone=3), {
            "params": {"points": backend("points").params()}
        }),
        (lambda data: data["look"].update(azimuth=1e9, background="no colour"), {
            "look": Look(light="fixed")
        }),
        (lambda data: data["pace"].update(speed=0), {"pace": Pace(1.0, reverse=True, loop=False)}),
    ],
)  # fmt: skip
def test_what_is_wrong_of_the_first_document_is_left_out_alone(
    change: Callable[[dict[str, Any]], object], expected: dict[str, Any]
) -> None:
    found = changed(lambda data: change(data["session"]))["session"]
    assert found == replace(read(FULL)["session"], **expected)


json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=8), inner, max_size=4),
    max_leaves=8,
)


@given(st.data())
def test_whatever_stands_in_the_file_some_settings_come_of_it(data: st.DataObject) -> None:
    """One value anywhere in it is replaced by any other."""
    content = json.loads(json.dumps(FULL))
    inside: Any = content
    while True:
        keys = list(inside) if isinstance(inside, dict) else list(range(len(inside)))
        key = data.draw(st.sampled_from(keys))
        if not (isinstance(inside[key], dict | list) and inside[key] and data.draw(st.booleans())):
            break
        inside = inside[key]
    inside[key] = data.draw(json_values)
    assert read(content).keys() == read(FULL).keys()


def test_the_renderer_for_all_scans_and_the_last_look_come_back() -> None:
    first = usable(SessionSettings(), FULL["session"])
    session = Session("/scans/b", first.document, first.pace)
    assert (session.document.backend, session.document.params["points"].point_size) == ("surfels", 7)
    session.change(
        "Go on", camera=CAMERA, params={**session.document.params, "of a backend that is gone": {}}
    )
    assert usable(SessionSettings(), session.remembered()) == first


def test_the_first_document_has_nothing_that_is_of_one_scan() -> None:
    of_scan = changed(lambda data: data["session"]["look"].update(up="-x", low=3, high=4))["session"]
    assert of_scan.document.look == read(FULL)["session"].look
    by_name = changed(lambda data: data["session"]["look"].update(color_by="strain"))["session"]
    assert by_name.document.look == read(FULL)["session"].look


def test_scans_are_known_by_their_place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert Session("one.ply").saved(3).scan == str(tmp_path / "one.ply")
    assert known_as("demo") == "demo"


SCREENS = [(0, 0, 1920, 1040), (1920, -200, 1280, 1024)]


@pytest.mark.parametrize(
    ("place", "expected"),
    [
        (WindowPlacement(100, 50, 800, 600), WindowPlacement(100, 50, 800, 600)),
        (WindowPlacement(2000, -150, 800, 600, True), WindowPlacement(2000, -150, 800, 600, True)),
        (WindowPlacement(0, 0, 4000, 3000), WindowPlacement(0, 0, 1920, 1040)),
        (WindowPlacement(-700, 30, 800, 600), WindowPlacement(-700, 30, 800, 600)),
        (WindowPlacement(-790, 30, 800, 600), None),
        (WindowPlacement(100, -30, 800, 600), None),
        (WindowPlacement(100, 1030, 800, 600), None),
        (WindowPlacement(5000, 30, 800, 600), None),
        (WindowPlacement(10, 10, 3, 0), None),
    ],
)
def test_a_window_comes_back_only_where_it_can_be_reached(
    place: WindowPlacement, expected: WindowPlacement | None
) -> None:
    assert reachable(place, SCREENS) == expected


def test_a_pipe_is_put_aside_rather_than_waited_for(file: Path) -> None:
    file.parent.mkdir(parents=True)
    os.mkfifo(file)
    loaded, (message,) = load(file)
    assert loaded == {}
    assert "not a regular file" in message
    assert load(file) == ({}, []), "the next start begins anew"


def test_a_huge_file_is_put_aside_unread(file: Path) -> None:
    written(file, "")
    os.truncate(file, 400 * 2**20)  # a hole, which takes no room
    loaded, (message,) = load(file)
    assert loaded == {}
    assert "longer than" in message
    assert not file.exists()


@pytest.mark.parametrize(
    ("part", "name"),
    [("steering", "turn_seconds"), ("window_look", "text_scale"), ("marks", "shown"), ("session", "look"),
     ("session", "pace"), ("session", "params")],
)  # fmt: skip
@pytest.mark.parametrize("text", ["1" + "0" * 400, "[" * 900 + "]" * 900, '{"a": ' * 400 + "1" + "}" * 400])
def test_numbers_and_nesting_without_end_are_left_out(file: Path, part: str, name: str, text: str) -> None:
    other = "" if part == "window_look" else '"window_look": {"theme": "light"}, '
    loaded, problems = load(written(file, f'{{"format": 1, {other}"{part}": {{"{name}": {text}}}}}'))
    assert problems == []
    found, default = read(loaded), read({})
    assert found[part] == default[part] or found[part] == {"shown": Marks(scale_bar=True, color_bar=True)}
    assert part == "window_look" or found["window_look"] == {"theme": "light"}, "the rest holds"


def test_names_of_files_that_are_not_utf_8_come_back_and_impossible_ones_do_not(file: Path) -> None:
    name = os.fsdecode(b"/scans/caf\xe9")
    save({"scans": {"recent": [name]}}, file)
    assert read(load(file)[0])["scans"] == {"recent": (name,)}
    data = json.loads(file.read_text()) | {"scans": {"recent": ["\ud800"]}}
    assert read(load(written(file, data))[0])["scans"] == {}


def test_exports_have_the_plot_that_is_shown_unless_a_user_says_otherwise() -> None:
    marks = next(of for of in fields(Exporting) if of.name == "marks")
    assert marks.default_factory is not MISSING
    assert marks.default_factory() == Marks(plot=True)

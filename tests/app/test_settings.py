"""What comes back at the next start, and what damaged files do: nothing worse than the defaults."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from viewer.app import settings
from viewer.app.output.export_plan import Choices
from viewer.app.panel import PanelChoices
from viewer.app.place import Place, reachable
from viewer.app.playing.player import Pace
from viewer.app.session import Session, known_as
from viewer.app.settings import Settings, load, save
from viewer.backends import backend
from viewer.camera import Camera
from viewer.choice.goal import Goal
from viewer.look import Look
from viewer.output.legend import Marks

CAMERA = Camera(eye=(1, 2, 3), target=(0.5, 0, 0), fov_y=25)
FULL = Settings(
    window=Place(10, 20, 800, 600, maximised=True),
    theme="light",
    text_scale=1.35,
    backend="surfels",
    params={"points": backend("points").params({"point_size": 7})},
    look=Look(light="fixed", azimuth=12, background="#102030"),
    pace=Pace(speed=0.5, reverse=True, loop=False),
    marks=Marks(stamp=True),
    marks_in_files=False,
    cube=False,
    turn_seconds=24.0,
    export=Choices(what="turntable", width=640, anonymous=True),
    export_marks=Marks(scale_bar=True),
    recent=("/scans/b", "demo"),
    panel=PanelChoices(30.0, {"Statistics": True}),
    drawer=22.5,
    goal=Goal("error", 0.5, "px"),
    glide=False,
    point_details=True,
    slow_devices=("llvmpipe",),
    welcomed=True,
    tools={"notes": {"texts": False}},
)


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
    default = Settings()
    unlike = [of.name for of in fields(Settings) if getattr(FULL, of.name) == getattr(default, of.name)]
    assert not unlike, "the example says something about every field"
    save(FULL, file)
    assert load(file) == (FULL, [])
    assert [path.name for path in file.parent.iterdir()] == [settings.FILE]


def test_without_a_file_the_defaults_hold(file: Path) -> None:
    assert load(file) == (Settings(), [])
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
    assert loaded == Settings()
    assert why in message
    assert str(file) in message
    kept = file.with_name("settings.old.json")
    assert kept.read_text() == text
    assert load(file) == (Settings(), []), "the next start begins anew"


def test_a_file_that_is_not_utf_8(file: Path) -> None:
    written(file, "").write_bytes(b'{"format": 1, "theme": "\xff"}')
    assert "damaged" in load(file)[1][0]


def test_a_file_that_cannot_be_read_is_told_and_stays(file: Path) -> None:
    file.mkdir(parents=True)
    loaded, (message,) = load(file)
    assert loaded == Settings()
    assert "cannot be read" in message
    assert file.is_dir()


def changed(change: Callable[[dict[str, Any]], object]) -> Settings:
    data = json.loads(json.dumps(FULL.to_json()))
    change(data)
    return Settings.from_json(data)


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (lambda data: data.update(theme="pink", later="?"), {"theme": "dark"}),
        (lambda data: data.update(window=[1, 2]), {"window": None}),
        (lambda data: data["window"].update(left="x"), {"window": None}),
        (lambda data: data["window"].update(left=10**9), {"window": None}),
        (lambda data: data.update(text_scale=77), {"text_scale": 1.0}),
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
        (lambda data: data["look"].update(color_by="strain"), {}),
        (lambda data: data["pace"].update(speed=0), {"pace": replace(FULL.pace, speed=1.0)}),
        (lambda data: data.update(recent=["/a", 3]), {"recent": ()}),
    ],
)  # fmt: skip
def test_what_is_wrong_is_left_out_alone(
    change: Callable[[dict[str, Any]], object], expected: dict[str, Any]
) -> None:
    assert changed(change) == replace(FULL, **expected)


json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=8), inner, max_size=4),
    max_leaves=8,
)


@given(st.data())
def test_whatever_stands_in_the_file_some_settings_come_of_it(data: st.DataObject) -> None:
    """One value anywhere in it is replaced by any other."""
    content = json.loads(json.dumps(FULL.to_json()))
    inside: Any = content
    while True:
        keys = list(inside) if isinstance(inside, dict) else list(range(len(inside)))
        key = data.draw(st.sampled_from(keys))
        if not (isinstance(inside[key], dict | list) and inside[key] and data.draw(st.booleans())):
            break
        inside = inside[key]
    inside[key] = data.draw(json_values)
    usable = Settings.from_json(content)
    assert Settings.from_json(json.loads(json.dumps(usable.to_json()))) == usable


def test_the_renderer_for_all_scans_and_the_last_look_come_back() -> None:
    session = Session("/scans/b", FULL.document, FULL.pace)
    assert (session.document.backend, session.document.params["points"].point_size) == ("surfels", 7)
    session.change(
        "Go on", camera=CAMERA, params={**session.document.params, "of a backend that is gone": {}}
    )
    kept = Settings.of(session)
    for name in ("backend", "params", "goal", "look", "pace"):
        assert getattr(kept, name) == getattr(FULL, name), name


def test_the_look_keeps_nothing_that_is_of_one_scan() -> None:
    assert changed(lambda data: data["look"].update(up="-x", low=3, high=4)).look == FULL.look


def test_scans_are_known_by_their_place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert Session("one.ply").saved(3).scan == str(tmp_path / "one.ply")
    assert known_as("demo") == "demo"


SCREENS = [(0, 0, 1920, 1040), (1920, -200, 1280, 1024)]


@pytest.mark.parametrize(
    ("place", "expected"),
    [
        (Place(100, 50, 800, 600), Place(100, 50, 800, 600)),
        (Place(2000, -150, 800, 600, True), Place(2000, -150, 800, 600, True)),
        (Place(0, 0, 4000, 3000), Place(0, 0, 1920, 1040)),
        (Place(-700, 30, 800, 600), Place(-700, 30, 800, 600)),
        (Place(-790, 30, 800, 600), None),
        (Place(100, -30, 800, 600), None),
        (Place(100, 1030, 800, 600), None),
        (Place(5000, 30, 800, 600), None),
        (Place(10, 10, 3, 0), None),
    ],
)
def test_a_window_comes_back_only_where_it_can_be_reached(place: Place, expected: Place | None) -> None:
    assert reachable(place, SCREENS) == expected


def test_a_pipe_is_put_aside_rather_than_waited_for(file: Path) -> None:
    file.parent.mkdir(parents=True)
    os.mkfifo(file)
    loaded, (message,) = load(file)
    assert loaded == Settings()
    assert "not a regular file" in message
    assert load(file) == (Settings(), []), "the next start begins anew"


def test_a_huge_file_is_put_aside_unread(file: Path) -> None:
    written(file, "")
    os.truncate(file, 400 * 2**20)  # a hole, which takes no room
    loaded, (message,) = load(file)
    assert loaded == Settings()
    assert "longer than" in message
    assert not file.exists()


@pytest.mark.parametrize("name", ["turn_seconds", "text_scale", "window", "look", "pace", "params"])
@pytest.mark.parametrize("text", ["1" + "0" * 400, "[" * 900 + "]" * 900, '{"a": ' * 400 + "1" + "}" * 400])
def test_numbers_and_nesting_without_end_are_left_out(file: Path, name: str, text: str) -> None:
    loaded, problems = load(written(file, f'{{"format": 1, "theme": "light", "{name}": {text}}}'))
    assert problems == []
    assert loaded.theme == "light", "the rest holds"
    assert getattr(loaded, name) == getattr(Settings(), name)


def test_names_of_files_that_are_not_utf_8_come_back_and_impossible_ones_do_not(file: Path) -> None:
    name = os.fsdecode(b"/scans/caf\xe9")
    save(replace(FULL, recent=(name,)), file)
    assert load(file)[0].recent == (name,)
    data = json.loads(file.read_text()) | {"recent": ["\ud800"]}
    assert load(written(file, data))[0].recent == ()


def test_exports_have_the_plot_that_is_shown_unless_a_user_says_otherwise() -> None:
    assert Settings().export_marks == Marks(plot=True)

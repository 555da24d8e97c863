"""Sessions come back as they were, find their scan, and damaged ones are one message; documents are kept."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hostile_values import variants

from viewer.analysis.surface_point import SurfacePoint
from viewer.backends import backend
from viewer.camera import Camera
from viewer.choice.configurations import Configuration
from viewer.choice.goal import Goal
from viewer.document import saved_session
from viewer.document.document import Bookmark, Document
from viewer.document.landmarks import Landmarks
from viewer.document.part import Part
from viewer.document.recording import scan_path
from viewer.document.saved_session import SavedSession, is_session, store, stored, stored_file
from viewer.errors import InputError
from viewer.look import Look
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose

CAMERA = Camera(eye=(0.1, 1 / 3, 5e7), fov_y=30.5)
ENDS = (
    (SurfacePoint(2, 0.08, (0.1, 1e-17, 3), 7, 0.2, 0),),
    (SurfacePoint(2, 0.08, (1, 2, 3), None, None, 2),),
)
FULL = Document(
    camera=CAMERA, pivot=(1.0, 2.0, 3.0), look=Look(color_by="height", low=1e-17), backend="points",
    params={"points": backend("points").params({"point_size": 5}), "voxels": backend("voxels").params()},
    goal=Goal("time", 1 / 3), configuration=Configuration("surfels", {"passes": "one"}),
    unit="mm", shown_unit="cm", front=-30.0, span=(2, 7), fps=30.0, times_by_names=True,
    average=8, measure_averaged=True,
    reading={"columns": "x y z", "skip": "2"},
    bookmarks=(Bookmark("the left \u00e9ye", CAMERA), Bookmark("", CAMERA)),
    parts={"landmarks": Landmarks().with_distance(*ENDS).with_distance(*ENDS[::-1])},
    unread={"clips": [{"plane": [1, 0, 0]}]},
)  # fmt: skip
SESSION = SavedSession("/scans/knot", "files:0123456789abcdef", 3, FULL)


@pytest.fixture(autouse=True)
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "home"))
    return tmp_path / "home"


def test_all_of_a_session_comes_back(tmp_path: Path) -> None:
    same = [of.name for of in fields(Document) if getattr(FULL, of.name) == getattr(Document(), of.name)]
    assert same == [], "the example says something about every field"
    SESSION.save(tmp_path / "a.scan4d.json")
    assert SavedSession.load(tmp_path / "a.scan4d.json") == SESSION
    (tmp_path / "b.scan4d.json").write_text(
        '{"format": 1, "scan": "demo", "hash": null, "pose": 0, "document": {}}'
    )
    assert SavedSession.load(tmp_path / "b.scan4d.json") == SavedSession("demo", None, 0, Document())


def test_a_scan_and_its_session_move_together(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "one" / "scans" / "knot").mkdir(parents=True)
    session = replace(SESSION, scan=str(tmp_path / "one" / "scans" / "knot"))
    session.export(tmp_path / "one" / "notes" / "a.scan4d.json")
    os.rename(tmp_path / "one", tmp_path / "two")
    monkeypatch.chdir(tmp_path / "home" if (tmp_path / "home").exists() else "/")
    path = tmp_path / "two" / "notes" / "a.scan4d.json"
    found = SavedSession.load(path)
    assert found.scan == "../scans/knot"
    assert os.path.samefile(scan_path(found.scan, path), tmp_path / "two" / "scans" / "knot")
    replace(SESSION, scan="demo").export(path)
    assert SavedSession.load(path).scan == "demo"


def test_sessions_are_known_by_their_names() -> None:
    assert is_session(Path("a.scan4d.json"))
    assert is_session(Path("A.SCAN4D.JSON"))
    assert not is_session(Path("scan4d_0001.json"))


def test_what_other_tools_and_renderers_keep_survives_untouched(tmp_path: Path) -> None:
    data = json.loads(json.dumps(SESSION.to_json()))
    unknown: dict[str, Any] = {
        "all": [{"text": "a note", "place": [1, 2.5, None]}],
        "later": {"deep": [[[1e300]]]},
    }
    data["document"]["parts"]["tests.pins"] = data["document"]["params"]["a backend"] = unknown
    (tmp_path / "a.json").write_text(json.dumps(data))
    read = SavedSession.load(tmp_path / "a.json")
    changed = replace(read, document=read.document.with_part(Landmarks()))
    changed.save(tmp_path / "b.json")
    again = json.loads((tmp_path / "b.json").read_text())["document"]
    assert again["parts"] == {"tests.pins": unknown}
    assert again["params"]["a backend"] == unknown

    @dataclass(frozen=True)
    class Pins(Part, name="tests.pins"):
        all: tuple[str, ...] = ()

    try:
        assert read.document.part(Pins) == Pins()
        assert SavedSession.load(tmp_path / "b.json").document.part(Pins) == Pins()
        pinned = replace(read, document=read.document.with_part(Pins(("a", "b"))))
        assert pinned.document.unread["parts.tests.pins"] == unknown
        pinned.save(tmp_path / "b.json")
        del Part.kinds["tests.pins"]
        raw = SavedSession.load(tmp_path / "b.json").document
        Part.kinds["tests.pins"] = Pins
        assert raw.part(Pins).all == ("a", "b"), "a tool that comes later finds what it kept"
    finally:
        Part.kinds.pop("tests.pins", None)


def changed(*path: Any, to: Any) -> Callable[[dict[str, Any]], None]:
    def change(data: dict[str, Any]) -> None:
        inner: Any = data
        for step in path[:-1]:
            inner = inner[step]
        inner[path[-1]] = to

    return change


@pytest.mark.parametrize(
    ("damage", "words"),
    [
        (changed("format", to=2), "has the format 2, but this version of Scan4D"),
        (lambda data: data.pop("format"), "has the format None"),
        (lambda data: data.pop("document"), "is not a session"),
        (lambda data: data.pop("scan"), "has no 'scan'"),
        (changed("scan", to="a\0b"), "'scan' must be the name of a scan"),
        (changed("hash", to=7), "'hash' must be a hash, not 7"),
        (changed("pose", to=-1), "'pose' must be the index of a frame, not -1"),
        (changed("document", to=[1]), ", document: must be an object with named values, not [1]"),
        (changed("document", "unread", to=[1]), ", document: must be an object with named values, not"),
    ],
)
def test_a_wrong_session_is_one_message(damage: Any, words: str, tmp_path: Path) -> None:
    data = json.loads(json.dumps(SESSION.to_json()))
    damage(data)
    path = tmp_path / "a.scan4d.json"
    path.write_text(json.dumps(data))
    with pytest.raises(InputError) as caught:
        SavedSession.load(path)
    assert words in str(caught.value)
    assert str(caught.value).startswith(str(path))
    assert "\n" not in str(caught.value)


UNREADABLE = [
    (("camera", "fov_y"), 0, "camera"),
    (("pivot",), [1, 2], "pivot"),
    (("look", "light"), "dim", "look"),
    (("look", "haze"), 0.5, "look"),
    (("backend",), 7, "backend"),
    (("params", "points", "point_size"), 99, "params.points"),
    (("params", "points", "blur"), 1, "params.points"),
    (("params",), [1], "params"),
    (("goal", "bound"), 0, "goal"),
    (("goal", "kind"), "speed", "goal"),
    (("configuration", "backend"), "gone", "configuration"),
    (("configuration", "values"), {"passes": "nine"}, "configuration"),
    (("unit",), " ", "unit"),
    (("bookmarks", 1, "name"), 3, "bookmarks"),
    (("bookmarks", 0, "colour"), "#ffffff", "bookmarks"),
    (("parts", "landmarks", "all", 1, "keys", 0, "level"), "x", "parts.landmarks"),
    (("parts", "landmarks", "measures", 0, "note"), "left", "parts.landmarks"),
    (("sections",), [{"plane": [0, 0, 1]}], "sections"),
]


@pytest.mark.parametrize(("path", "to", "name"), UNREADABLE)
def test_what_cannot_be_read_of_a_document_costs_no_more_and_is_written_again(
    path: tuple[Any, ...], to: Any, name: str
) -> None:
    store(SESSION)
    file = stored_file(SESSION.scan)
    data = json.loads(file.read_text())
    changed("document", *path, to=to)(data)
    file.write_text(json.dumps(data))

    found = stored(SESSION.scan)
    assert found is not None
    assert found.problem is not None
    assert name in found.problem
    document = found.document
    for of in fields(Document):
        if of.name not in (path[0], "unread"):
            assert getattr(document, of.name) == getattr(FULL, of.name), of.name
    assert document.look == (replace(FULL.look, light="auto") if to == "dim" else FULL.look)

    # Whatever the user does now, it is there.
    document = document.with_part(Landmarks().with_distance(*ENDS))
    document = document.with_params("points", backend("points").params({"point_size": 2}))
    store(replace(found, document=replace(document, camera=Camera(), bookmarks=(), unit="m")))
    again = json.loads(file.read_text())["document"]["unread"]
    raw = data["document"]
    for step in name.split("."):
        raw = raw[step]
    assert again == FULL.unread | {name: raw}


def test_what_a_later_version_added_is_read_again_by_one_that_knows_it() -> None:
    data = json.loads(json.dumps(replace(SESSION, document=replace(FULL, unread={})).to_json()))
    data["document"]["unread"] = {"unit": data["document"].pop("unit")}
    assert SavedSession.from_json(data, "a").document == replace(FULL, unread={})


def test_fields_of_a_session_that_are_not_known_are_kept_in_its_document() -> None:
    data = json.loads(json.dumps(SESSION.to_json())) | {"tags": ["knot"]}
    read = SavedSession.from_json(data, "a")
    assert read.document == replace(FULL, unread={**FULL.unread, "session.tags": ["knot"]})


def test_parameters_that_cannot_be_read_as_a_whole_draw_with_those_that_can() -> None:
    data = json.loads(json.dumps(SESSION.to_json()))
    data["document"]["params"]["points"] |= {"blur": 1}
    document = SavedSession.from_json(data, "a").document.drawn_by("points")
    pose = Pose(0, 0.0, "a", PointCloud.from_arrays(np.eye(3)))
    assert document.chosen(pose) == ("points", FULL.params["points"])


@pytest.mark.slow
def test_whatever_stands_in_a_session_it_is_read_or_refused() -> None:
    data = json.loads(json.dumps(SESSION.to_json()))
    data["document"]["bookmarks"] = data["document"]["bookmarks"][:1]
    data["document"]["params"].pop("voxels")
    read = 0
    for variant in variants(data):
        try:
            session = SavedSession.from_json(variant, "a")
        except InputError:
            continue
        read += 1
        again = json.loads(json.dumps(session.to_json()))
        assert json.dumps(SavedSession.from_json(again, "a").to_json()) == json.dumps(session.to_json())
    assert read > 100


# --- those of all scans -----------------------------------------------------------------------


def test_each_scan_has_its_own(home: Path) -> None:
    sessions = [replace(SESSION, scan=name) for name in ("demo", "/a", "/b", os.fsdecode(b"/caf\xe9"))]
    for session in sessions:
        store(session)
    assert [stored(session.scan) for session in sessions] == sessions
    assert stored("/c") is None
    assert all("knot" not in path.name for path in home.rglob("*")), "names of files tell nothing"


def test_those_kept_last_stay(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(saved_session, "MOST_STORED", 5)
    seen = replace(SESSION, document=Document(camera=CAMERA, unit="mm"))
    for number in range(12):
        store(replace(seen, scan=f"/{number}"))
        os.utime(stored_file(f"/{number}"), (number, number))
    store(replace(seen, scan="/8", pose=1))
    store(replace(seen, scan="/12"))
    there = [number for number in range(13) if stored(f"/{number}") is not None]
    assert there == [8, 9, 10, 11, 12]


def test_what_a_user_made_is_never_deleted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(saved_session, "MOST_STORED", 3)
    nothing = Document(camera=CAMERA)
    made = [
        replace(nothing, bookmarks=FULL.bookmarks),
        replace(nothing, parts=FULL.parts),
        replace(nothing, unread=FULL.unread),
    ]
    sessions = [replace(SESSION, scan=f"/{n}", document=document) for n, document in enumerate(made)]
    for session in sessions:
        store(session)
    other_window(replace(sessions[0], document=replace(FULL, parts={})))
    assert store(sessions[0]) is not None
    later = stored_file("/later")
    later.write_text(json.dumps(SESSION.to_json() | {"format": 2}))
    for path in later.parent.iterdir():
        os.utime(path, (1, 1))
    before = set(later.parent.iterdir())
    assert len(before) == 5
    for number in range(10, 20):
        store(replace(SESSION, scan=f"/{number}", document=nothing))
    assert before <= set(later.parent.iterdir())
    assert len(list(later.parent.iterdir())) == len(before) + 3
    assert [stored(session.scan) for session in sessions] == sessions


def test_what_is_damaged_is_put_aside_and_told_once() -> None:
    store(SESSION)
    file = stored_file(SESSION.scan)
    file.write_text(file.read_text()[:-40])
    with pytest.raises(InputError) as caught:
        stored(SESSION.scan)
    assert str(caught.value).startswith(
        "/scans/knot: Scan4D cannot read your saved work on this scan (is not JSON"
    )
    aside = file.with_name(f"{file.stem}.old-1.scan4d.json")
    assert str(aside) in str(caught.value)
    assert stored(SESSION.scan) is None
    former = aside.read_bytes()
    file.write_text("{")
    with pytest.raises(InputError, match="old-2"):
        stored(SESSION.scan)
    assert aside.read_bytes() == former, "what was put aside before stays"


def other_window(session: SavedSession) -> None:
    """Keep a session as another process does."""
    session.save(stored_file(session.scan))


def asides() -> list[SavedSession]:
    folder = stored_file(SESSION.scan).parent
    return [SavedSession.load(path) for path in sorted(folder.glob("*.old-*.scan4d.json"))]


def with_bookmarks(*names: str) -> SavedSession:
    marks = tuple(Bookmark(name, CAMERA) for name in names)
    return replace(SESSION, document=replace(FULL, bookmarks=marks))


def test_what_another_window_made_is_put_aside_once_and_told() -> None:
    store(with_bookmarks("a"))
    assert stored(SESSION.scan) == with_bookmarks("a")
    theirs = with_bookmarks("a", "b")
    other_window(theirs)
    mine = replace(with_bookmarks("a"), pose=7)
    told = store(mine)
    (aside,) = stored_file(SESSION.scan).parent.glob("*.old-*")
    assert told is not None
    assert told.startswith("/scans/knot: another program, perhaps a second window of Scan4D, has saved work")
    assert str(aside) in told
    assert asides() == [theirs]
    assert stored(SESSION.scan) == mine
    assert is_session(aside)
    assert store(replace(mine, pose=8)) is None
    other_window(replace(theirs, pose=4))  # which goes on moving its camera
    assert store(replace(mine, pose=9)) is None
    assert asides() == [theirs]
    other_window(with_bookmarks("a", "b", "c"))
    assert store(mine) is not None
    assert asides() == [theirs, with_bookmarks("a", "b", "c")]


def test_what_another_window_made_stays_where_it_is_while_nothing_can_be_written(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    store(with_bookmarks("a"))
    other_window(with_bookmarks("b"))

    def refuse(session: SavedSession, path: Path) -> None:
        raise InputError("cannot be written", path)

    with monkeypatch.context() as patch:
        patch.setattr(SavedSession, "save", refuse)
        with pytest.raises(InputError):
            store(SESSION)
    assert asides() == []
    assert store(SESSION) is not None
    assert asides() == [with_bookmarks("b")]


def test_another_window_that_made_nothing_costs_nothing() -> None:
    store(with_bookmarks("a"))
    other_window(replace(with_bookmarks("a"), pose=9))
    assert store(with_bookmarks("a", "b")) is None, "it had what this one had"
    other_window(replace(SESSION, document=Document(camera=CAMERA)))
    assert store(with_bookmarks("a", "b")) is None
    assert asides() == []


def test_a_document_that_was_damaged_meanwhile_is_put_aside_and_told() -> None:
    store(SESSION)
    stored_file(SESSION.scan).write_text("{")
    assert "moved that work to" in str(store(SESSION))
    assert stored(SESSION.scan) == SESSION


def test_a_document_of_a_later_version_is_neither_moved_nor_written_over() -> None:
    store(SESSION)
    file = stored_file(SESSION.scan)
    text = json.dumps(json.loads(file.read_text()) | {"format": 2})
    file.write_text(text)
    for _ in range(2):
        with pytest.raises(InputError, match=r"has the format 2.* The work stays in"):
            stored(SESSION.scan)
        with pytest.raises(InputError, match="has the format 2"):
            store(replace(SESSION, pose=1))
    assert [path.read_text() for path in file.parent.iterdir()] == [text]


def test_a_document_that_the_system_refuses_to_read_is_neither_moved_nor_written_over() -> None:
    file = stored_file(SESSION.scan)
    file.mkdir(parents=True)  # which root cannot read either
    with pytest.raises(InputError, match="The work stays in"):
        stored(SESSION.scan)
    with pytest.raises(InputError, match="cannot be read"):
        store(SESSION)
    assert [path.name for path in file.parent.iterdir()] == [file.name]
    assert file.is_dir()


_KEEP_ON = """
import sys
from dataclasses import replace
from pathlib import Path
from viewer.document.saved_session import SavedSession, store
session = SavedSession.load(Path(sys.argv[1]))
store(session)
print("begins", flush=True)
for number in range(10**9):
    store(replace(session, pose=number % 1000))
"""


def test_a_kill_leaves_a_whole_document_and_nothing_else(tmp_path: Path, home: Path) -> None:
    SESSION.save(tmp_path / "a.scan4d.json")
    for moment in range(6):
        command = [sys.executable, "-c", _KEEP_ON, str(tmp_path / "a.scan4d.json")]
        with subprocess.Popen(command, stdout=subprocess.PIPE, cwd=Path(__file__).parents[2]) as process:
            assert process.stdout is not None
            process.stdout.readline()
            time.sleep(0.05 + 0.013 * moment)
            process.send_signal(signal.SIGKILL)
        found = stored(SESSION.scan)
        assert found is not None
        assert replace(found, pose=3) == SESSION
    shutil.rmtree(home)

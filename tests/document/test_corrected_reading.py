"""Corrections of how Scan4D reads a scan are stored in documents and recordings, and can be undone."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from viewer import cli
from viewer.camera import Camera
from viewer.document.document import Document
from viewer.document.history import History
from viewer.document.recording import Entry, Recording
from viewer.document.saved_session import SavedSession
from viewer.document.schema import plain
from viewer.look import Look
from viewer.output.export import read_description
from viewer.scan.open import open_scan

READING = {"columns": "x y z - intensity", "camera": "290,290,159.5,89.5"}


def entry(**fields: object) -> Entry:
    values = {
        "scan": "scan", "hash": None, "pose": 0, "time": 0.0, "size": (8, 8), "camera": Camera(),
        "backend": "points", "params": {}, "look": Look(),
    }  # fmt: skip
    return Entry.from_json(plain({**values, **fields}))


def test_a_document_stores_its_corrections(tmp_path: Path) -> None:
    path = tmp_path / "face.scan4d.json"
    SavedSession("scan", None, 0, Document(reading=READING)).save(path)
    assert SavedSession.load(path).document.reading == READING
    assert SavedSession.load(path).document.unreadable == ()


@pytest.mark.parametrize("reading", [{"colour": "1"}, {"skip": "many"}, {"skip": 3}, ["skip"]])
def test_corrections_that_cannot_be_used_stay_unread(reading: object) -> None:
    document = Document.from_json({"reading": reading})
    assert document.reading == {}
    assert document.unread == {"reading": reading}


def test_a_correction_is_a_step_of_the_history() -> None:
    history = History(Document())
    history.change("Correct the camera", replace(history.document, reading=READING))
    history.undo()
    assert history.document.reading == {}
    history.redo()
    assert history.document.reading == READING


def test_another_scan_begins_without_corrections() -> None:
    assert Document(reading=READING).for_another(Document()).reading == {}


def test_an_entry_has_the_corrections_and_the_record_of_its_scan(tmp_path: Path) -> None:
    table = tmp_path / "points.txt"
    np.savetxt(table, np.random.default_rng(0).random((20, 4)))
    with open_scan(table, read={"columns": "- x y z"}) as timeline:
        timeline.pose(0)
        told = entry().with_reading(timeline)
    assert told.reading == {"columns": "- x y z"}
    assert told.record["decisions"]["columns"]["source"] == "user"
    path = tmp_path / "recording.json"
    Recording((told,)).save(path)
    assert Recording.load(path).entries == (told,)


def test_an_anonymous_entry_has_no_names_in_its_corrections_and_record() -> None:
    reading = {
        "camera": "jane.txt", "take": "jane_", "frames": "jane*.ply", "times": "column:jane", "unit": "jane",
        "columns": "x y z jane", "skip": "2", "depth-channel": "jane",
    }  # fmt: skip
    record = {
        "decisions": {
            "frames": {
                "value": "jane1.ply", "source": "folder", "from": "jane", "why": "jane",
                "alternatives": ["jane"],
            },
        },
        "assumed": [], "aside": [{"file": "jane.ply", "why": "copy"}], "unused": [], "takes": [],
        "contradictions": [],
    }  # fmt: skip
    nameless = entry(reading=reading, record=record).without_names()
    assert nameless.reading == {"skip": "2"}
    assert "jane" not in json.dumps(nameless.to_json())


def test_a_replayed_picture_reads_the_scan_as_the_first_did(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    np.savetxt("points.txt", np.random.default_rng(0).uniform(0, (1, 2, 3, 4), (300, 4)))
    small = ["--size", "64x48", "--backend", "points"]
    assert cli.main(["render", "points.txt", *small, "--read", "columns=- x y z", "-o", "a.png"]) == 0
    assert cli.main(["render", "--replay", "a.png", "-o", "b.png"]) == 0
    first, again = (np.asarray(Image.open(name)) for name in ("a.png", "b.png"))
    assert np.array_equal(first, again)
    told = json.loads(read_description(Path("b.png")))
    assert told["reading"] == {"columns": "- x y z"}
    assert told["record"]["decisions"]["columns"]["source"] == "user"


def test_a_picture_says_how_its_normals_were_oriented(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    points = np.random.default_rng(0).normal(size=(400, 3))
    np.savetxt("ball.xyz", points / np.linalg.norm(points, axis=1, keepdims=True))
    small = ["--size", "64x48", "--backend", "surfels"]
    assert cli.main(["render", "ball.xyz", *small, "-o", "a.png"]) == 0
    assert cli.main(["render", "ball.xyz", *small, "--read", "orientation=fine-flipped", "-o", "b.png"]) == 0
    assert cli.main(["render", "--replay", "b.png", "-o", "c.png"]) == 0
    for name, value, source in (("a", "quick", "assumed"), *((one, "fine-flipped", "user") for one in "bc")):
        decision = json.loads(read_description(Path(f"{name}.png")))["record"]["decisions"]["orientation"]
        assert (decision["value"], decision["source"]) == (value, source)
        assert "doubtful" in decision["why"]
    for out, read in (("a.npz", "auto"), ("b.npz", "auto-flipped")):
        assert cli.main(["convert", "ball.xyz", out, "--normals", "--read", f"orientation={read}"]) == 0
    first, flipped = (np.load(name)["normals"] for name in ("a.npz", "b.npz"))
    assert np.array_equal(first, -flipped)

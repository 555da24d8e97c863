"""Recordings come back as they were, keep their pace, and damaged ones are one message."""

from __future__ import annotations

import hashlib
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from viewer.backends import backend
from viewer.camera import Camera
from viewer.document import recording
from viewer.document.landmarks import Note
from viewer.document.recording import FORMAT, Entry, Recorder, Recording, fingerprint
from viewer.drawing.request import Request
from viewer.errors import InputError
from viewer.look import Look
from viewer.output.export import write_png
from viewer.output.legend import Marks
from viewer.output.overlays import DrawnLandmark, DrawnMarks, DrawnPath
from viewer.rigid import Rigid
from viewer.scan.layers import Layers
from viewer.scan.open import find_source, open_scan
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose

POSE = Pose(3, 0.12, "three", PointCloud.from_arrays(np.eye(3)))
FIRST = Entry(
    scan="knot", hash="files:0123456789abcdef", pose=0, time=0.0, size=(96, 64),
    camera=Camera(eye=(0.1, 1 / 3, 5e7), fov_y=30.5), backend="points",
    params=backend("points").params({"point_size": 5}),
    look=Look(color_by="height", low=1e-17, eye_dome=True), marks=Marks(scale_bar=True), unit="mm",
)  # fmt: skip
SECOND = replace(FIRST, pose=1, time=0.04, at=0.52)
THIRD = replace(SECOND, backend="surfels", params=backend("surfels").params(), at=1.5)
RECORDING = Recording((FIRST, SECOND, THIRD), 2.4)


def saved(folder: Path, shown: Recording = RECORDING) -> Path:
    shown.save(folder / "a.json")
    return folder / "a.json"


# --- as it was --------------------------------------------------------------------------------


def test_a_recording_comes_back_as_it_was(tmp_path: Path) -> None:
    again = Recording.load(saved(tmp_path))
    assert again == RECORDING
    assert [entry.at for entry in again.entries] == [0, 0.52, 1.5]


def test_a_recording_tells_only_what_has_changed_an_entry_a_line(tmp_path: Path) -> None:
    text = saved(tmp_path).read_text()
    data = json.loads(text)
    assert (data["format"], data["seconds"]) == (FORMAT, 2.4)
    assert data["entries"][1] == {"at": 0.52, "pose": 1, "time": 0.04}
    assert list(data["entries"][2]) == ["at", "backend", "params"]
    assert len(text.splitlines()) == 3 + 3


def test_an_entry_holds_all_of_a_request() -> None:
    request = Request(POSE, FIRST.camera, "points", FIRST.params, FIRST.look)
    entry = Entry.of(request, "knot", None, (96, 64), "mm")
    assert (entry.pose, entry.time) == (3, 0.12)
    again = Entry.from_json(json.loads(json.dumps(entry.to_json()))).request(POSE)
    assert vars(again) == vars(request)


def test_an_entry_has_the_place_that_the_scan_is_moved_to() -> None:
    place = Rigid(np.array([[0.6, -0.8, 0, 1e6], [0.8, 0.6, 0, 1 / 3], [0, 0, 1, -2], [0, 0, 0, 1]]))
    request = Request(POSE, FIRST.camera, "points", FIRST.params, FIRST.look, Layers(world_from_pose=place))
    entry = Entry.of(request, "knot", None, (96, 64), "mm")
    again = Entry.from_json(json.loads(json.dumps(entry.to_json())))
    assert again == entry
    np.testing.assert_array_equal(again.request(POSE).layers.world_from_pose.matrix, place.matrix)
    back = replace(entry, place=None)
    assert back.to_json(entry) == {"place": None}
    for place_of_none in ([[1, 0], [0, 1]], (2 * np.eye(4)).tolist(), "here"):
        with pytest.raises(InputError, match="a rotation and a translation, 4 x 4"):
            Entry.from_json(entry.to_json() | {"place": place_of_none}, "a.json")


def test_colours_by_numbers_that_are_in_no_file_are_refused() -> None:
    pose = replace(POSE, points=replace(POSE.cloud, scalars={"heat": np.arange(3.0)}))
    layers = Layers({"deviation": np.arange(3.0)})

    def entry(color_by: str, layers: Layers) -> Entry:
        look = replace(FIRST.look, color_by=color_by)
        request = Request(pose, FIRST.camera, "points", FIRST.params, look, layers)
        return Entry.of(request, "knot", None, (96, 64), "mm")

    assert entry("heat", layers).look.color_by == "heat"
    assert entry("#1", layers).look.color_by == "#1"
    for color_by, over in (
        ("deviation", layers), ("#2", layers), ("heat", Layers({"heat": np.arange(3.0)})),
    ):  # fmt: skip
        with pytest.raises(InputError, match="which Scan4D computes"):
            entry(color_by, over)


def test_what_earlier_versions_did_not_tell_has_its_default(tmp_path: Path) -> None:
    path = saved(tmp_path)
    data = json.loads(path.read_text())
    for name in ("marks", "unit"):
        del data["entries"][0][name]
    path.write_text(json.dumps(data))
    assert Recording.load(path).entries[0] == replace(FIRST, marks=Marks(), unit=None)


def test_notes_are_shown_in_their_frame_and_left_out_of_anonymous_pictures(tmp_path: Path) -> None:
    notes = (Note("on it", 3), Note("at it", 3, (1.0, 0.0, 0.0)), Note("always"), Note("later", 4))
    request = Request(POSE, FIRST.camera, "points", FIRST.params, Look())

    def entry(marks: Marks) -> Entry:
        return Entry.of(request, "knot", None, (96, 64), "mm", marks).with_notes(notes)

    shown = entry(Marks(notes=True))
    assert (shown.notes, entry(Marks(stamp=True)).notes) == (notes, ())
    assert Recording.load(saved(tmp_path, Recording((shown,)))).entries == (shown,)
    with open_scan("demo") as timeline:
        legend = shown.legend(timeline, POSE)
    assert legend.notes == ("on it", "always")
    assert legend.overlay is not None
    assert [(path.places, path.name) for path in legend.overlay.paths] == [(((1.0, 0.0, 0.0),), "at it")]
    assert shown.without_names().notes == ()


def test_landmarks_and_lines_are_kept_where_marks_show_them_and_lose_their_names() -> None:
    path = DrawnPath(((1.0, 0.0, 0.0), (2.0, 0.0, 0.0)), (0xFF0000,), name="jane", value="1 mm")
    held = Rigid(np.array([[0.0, -1, 0, 5], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]))
    landmark = DrawnLandmark((1.0, 2.0, 3.0), "doe", True, 0.5, 0.1)
    drawn = DrawnMarks((landmark,), (replace(path, name="", value=""),), held, (path,))
    request = Request(POSE, FIRST.camera, "points", FIRST.params, Look())

    def entry(**marks: bool) -> Entry:
        return Entry.of(request, "knot", None, (96, 64), "mm", Marks(**marks)).with_drawn(drawn)

    assert entry(notes=True) == replace(entry(), marks=Marks(notes=True))
    assert (entry(landmarks=True).landmarks, entry(landmarks=True).trajectories) == ((landmark,), ())
    shown = entry(landmarks=True, trajectories=True, measure_lines=True)
    again = Recording.from_json(json.loads(shown.description()), Path("a.json")).entries
    assert again == (shown,)
    with open_scan("demo") as timeline:
        overlay = shown.legend(timeline, POSE).overlay
        assert entry().legend(timeline, POSE).overlay is None
    assert overlay is not None
    assert overlay.places.tolist() == [[1, 2, 3], [5, 1, 0], [5, 2, 0], [1, 0, 0], [2, 0, 0]]
    moved = shown.drawn_from(np.array([1.0, 0.0, 0.0]))
    assert (moved.landmarks[0].place, moved.measure_lines[0].places[1]) == ((0.0, 2.0, 3.0), (1.0, 0.0, 0.0))
    with open_scan("demo") as timeline:
        there = moved.legend(timeline, POSE).overlay
    assert there is not None
    np.testing.assert_allclose(there.places + np.array([1, 0, 0]), overlay.places)
    told = shown.without_names().description()
    assert not any(name in told for name in ("jane", "doe"))
    assert "1 mm" in told


def test_an_anonymous_description_tells_neither_scan_nor_a_unit_of_its_own() -> None:
    told, whole = (json.loads(entry.description()) for entry in (FIRST.without_names(), FIRST))
    assert (whole["scan"], whole["anonymous"]) == ("knot", False)
    assert told == whole | {"scan": None, "anonymous": True}
    assert replace(FIRST, unit="jane").without_names().unit == "units"
    assert replace(FIRST, shown_unit="m").without_names().shown_unit == "m"


def test_the_recorder_notes_what_changes_and_when() -> None:
    recorder = Recorder(100.0)
    for entry, now in [(FIRST, 100.0), (FIRST, 100.2), (SECOND, 100.52), (SECOND, 101), (FIRST, 102.0004)]:
        recorder.note(entry, now)
    found = recorder.finish(103.25)
    assert found == Recording((FIRST, SECOND, FIRST), 3.25)
    assert [entry.at for entry in found.entries] == [0, 0.52, 2.0]


def test_what_is_found_of_the_scan_while_a_picture_stays_makes_no_entry() -> None:
    recorder = Recorder(0.0)
    found = replace(FIRST, record={"decisions": {"orientation": {"value": "quick"}}})
    for entry, now in [(FIRST, 0.0), (found, 0.5), (replace(SECOND, record=found.record), 1.0)]:
        recorder.note(entry, now)
    first, second = recorder.finish(2.0).entries
    assert (first.at, second.at) == (0.0, 1.0)
    assert first.record == second.record == found.record


# --- its pace -----------------------------------------------------------------------------------


# --- what is refused -----------------------------------------------------------------------------


def changed(**changes: Any) -> Any:
    """The JSON of the recording with other values; those of `first` in its first entry."""

    def damage(data: dict[str, Any]) -> None:
        data["entries"][0].update(changes.pop("first", {}))
        data.update(changes)

    return damage


def without(name: str) -> Any:
    return lambda data: data["entries"][0].pop(name)


def second(**changes: Any) -> Any:
    return lambda data: data["entries"][1].update(changes)


CAMERA = FIRST.camera.to_json()


@pytest.mark.parametrize(
    ("damage", "words"),
    [
        (changed(format=2), ["format 2", "reads 1", "version"]),
        (changed(format="1"), ["format '1'"]),
        (lambda data: data.pop("format"), ["is not a recording"]),
        (changed(entries=[]), ["no entries"]),
        (changed(entries={}), ["no entries"]),
        (changed(entries=[7]), ["entry 0", "JSON object"]),
        (changed(seconds=-1), ["'seconds'"]),
        (lambda data: data.pop("entries"), ["field 'seconds'"]),
        (without("camera"), ["entry 0", "no 'camera'"]),
        (without("scan"), ["entry 0", "no 'scan'"]),
        (changed(first={"sceen": 1}), ["entry 0", "'sceen'", "scan"]),
        (changed(first={"scan": 7}), ["'scan'", "7"]),
        (changed(first={"scan": "a\0b"}), ["'scan'"]),
        (changed(first={"hash": 7}), ["'hash'"]),
        (changed(first={"pose": -1}), ["'pose'", "-1"]),
        (changed(first={"pose": True}), ["'pose'", "True"]),
        (changed(first={"pose": 1.5}), ["'pose'"]),
        (changed(first={"time": None}), ["'time'"]),
        (changed(first={"size": [96]}), ["'size'"]),
        (changed(first={"size": [96.5, 64]}), ["'size'"]),
        (changed(first={"backend": "nope"}), ["'nope'", "points", "surfels"]),
        (changed(first={"backend": ["points"]}), ["'backend'"]),
        (changed(first={"params": {"nope": 1}}), ["'nope'", "Known: hide_hidden, point_size"]),
        (changed(first={"params": {"point_size": 99}}), ["point_size", "0 to 32"]),
        (changed(first={"params": {"point_size": 1e999}}), ["point_size"]),
        (changed(first={"params": [5]}), ["'params'"]),
        (changed(first={"look": {"nope": 1}}), ["'nope'", "color_by"]),
        (changed(first={"marks": {"nope": True}}), ["unknown mark 'nope'", "scale_bar"]),
        (changed(first={"marks": {"stamp": 7}}), ["'7'", "stamp"]),
        (changed(first={"marks": ["stamp"]}), ["'marks'"]),
        (changed(first={"unit": 7}), ["'unit'"]),
        (changed(first={"look": {"background": "red"}}), ["'red'", "#rrggbb"]),
        (changed(first={"camera": {"nope": 1}}), ["camera field 'nope'", "eye"]),
        (changed(first={"camera": {**CAMERA, "eye": [1, 2]}}), ["eye", "three"]),
        (changed(first={"camera": {**CAMERA, "eye": None}}), ["camera"]),
        (changed(first={"camera": {**CAMERA, "fov_y": 10**400}}), ["fov_y"]),
        (changed(first={"camera": {**CAMERA, "eye": [10**400, 0, 0]}}), ["three finite numbers"]),
        (second(at=-0.5), ["entry 1", "'at'"]),
        (second(at=1e300), ["entry 1", "'at'"]),
        (second(at=2.0), ["entry 2", "earlier"]),
        (second(backend="surfels"), ["entry 1", "point_size"]),  # the parameters are those of points
    ],
)
def test_a_wrong_recording_is_one_message(damage: Any, words: list[str], tmp_path: Path) -> None:
    path = saved(tmp_path)
    data = json.loads(path.read_text())
    damage(data)
    path.write_text(json.dumps(data))
    with pytest.raises(InputError) as caught:
        Recording.load(path)
    assert all(word in str(caught.value) for word in [str(path), *words]), caught.value
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "content",
    [b"", b"{", b"\xff\xfe\x00", b"[" * 100_000, b'{"format": 1' + b"0" * 5000 + b"}", b"[]", b"null", b"7"],
)
def test_what_is_no_json_object_is_one_message(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    path.write_bytes(content)
    with pytest.raises(InputError) as caught:
        Recording.load(path)
    assert str(path) in str(caught.value)


def test_a_recording_cut_off_anywhere_is_one_message(tmp_path: Path) -> None:
    path = saved(tmp_path)
    whole = path.read_bytes()
    for end in range(0, len(whole.rstrip()) - 1, 37):
        path.write_bytes(whole[:end])
        with pytest.raises(InputError):
            Recording.load(path)


@pytest.mark.parametrize("suffix", [".png", ".exr"])
def test_pictures_without_a_description_and_damaged_ones_are_refused(suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"a{suffix}"
    with pytest.raises(InputError, match="no such file"):
        Recording.load(path)
    path.write_bytes(b"")
    with pytest.raises(InputError, match="cannot be read as a picture"):
        Recording.load(path)
    if suffix == ".png":
        write_png(np.zeros((4, 4, 4), np.uint8), path)
    else:
        import OpenEXR

        OpenEXR.File({}, {"Z": np.zeros((4, 4), np.float32)}).write(str(path))
    with pytest.raises(InputError, match="does not contain the view and scan of the picture"):
        Recording.load(path)


# --- hashes --------------------------------------------------------------------------------------


def test_the_hash_of_a_file_is_that_of_its_bytes(tmp_path: Path) -> None:
    (tmp_path / "a.ply").write_bytes(b"some points")
    assert fingerprint([tmp_path / "a.ply"]) == f"sha256:{hashlib.sha256(b'some points').hexdigest()[:16]}"


def test_several_and_large_files_count_by_their_content(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    files = [tmp_path / name for name in ("a.ply", "b.ply", "c.ply")]
    for file in files:
        file.write_bytes(b"points")
    before = fingerprint(files)
    assert before is not None
    assert before.startswith("content:")
    files[0].write_bytes(b"POINTS")  # of another subject: of the same size
    assert fingerprint(files) != before
    files[0].write_bytes(b"points")
    files[2].write_bytes(b"more points")
    assert fingerprint(files) not in (before, fingerprint(files[::-1]))
    files[2].write_bytes(b"points")
    assert fingerprint([file.rename(file.with_name(f"0{file.name}")) for file in files]) == before
    monkeypatch.setattr(recording, "_HASHED_BYTES", 4)
    large = tmp_path / "large.ply"
    large.write_bytes(b"points")
    assert str(fingerprint([large])).startswith("content:")


@pytest.mark.parametrize("changed", [0, 1, 50, 99])
def test_of_many_files_the_first_one_counts_as_a_whole_and_the_ends_of_some(
    tmp_path: Path, changed: int
) -> None:
    files = [tmp_path / f"{number}.ply" for number in range(100)]
    content = bytes(300_000)
    for file in files:
        file.write_bytes(content)
    before = fingerprint(files)
    files[changed].write_bytes(content[:150_000] + b"x" + content[150_001:])
    assert (fingerprint(files) == before) == (changed > 0)
    files[changed].write_bytes(content + b"x")  # sizes count of all
    assert fingerprint(files) != before


@pytest.mark.parametrize(
    ("scan", "where"),
    [("/**/*.ply", "a pattern that would search"), ("//host/a.ply", "another"), (r"\\host\a.ply", "another")],
)
def test_a_recording_neither_searches_nor_leads_to_another_machine(scan: str, where: str) -> None:
    with pytest.raises(InputError, match=where):
        recording.scan_path(scan, Path("/recordings/a.json"))
    assert recording.scan_path("../scans/a.ply", Path("/recordings/a.json")) == "../scans/a.ply"


def test_without_files_there_is_no_hash(tmp_path: Path) -> None:
    assert fingerprint([]) is None
    assert fingerprint([tmp_path / "gone.ply"]) is None


@pytest.mark.parametrize(
    ("list_name", "image", "text"),
    [
        (
            "pods.json",
            "left.tif",
            json.dumps({"pods": [{"name": "left", "range": "left.tif", "fx": 1, "fy": 1, "cx": 0, "cy": 0}]}),
        ),
        ("scans.conf", "scan.ply", "bmesh scan.ply 0 0 0 0 0 0 1"),
    ],
)
def test_a_subject_between_empty_borders_tells_range_scans_apart(
    list_name: str, image: str, text: str, tmp_path: Path
) -> None:
    """The scans share list and size, and the ends of their images are empty."""
    hashes = []
    for number in range(2):
        folder = tmp_path / str(number)
        folder.mkdir()
        (folder / list_name).write_text(text)
        (folder / image).write_bytes(bytes(1 << 17) + bytes([number]) + bytes(1 << 17))
        hashes.append(fingerprint(find_source(folder).files))
    assert len(set(hashes) - {None}) == 2

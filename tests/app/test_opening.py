from __future__ import annotations

import threading
import time
from collections.abc import Callable
from concurrent.futures import Future
from pathlib import Path

import numpy as np
import pytest

from viewer.app.files.opening import Opening, Way, begin, find_facts, read_from
from viewer.document.document import Document
from viewer.document.saved_session import SavedSession
from viewer.errors import InputError, Scan4DError
from viewer.scan.open import open_scan
from viewer.scan.points import PointCloud
from viewer.scan.pose import Pose
from viewer.scan.spacing import _spacings
from viewer.scan.timeline import Timeline


def save(folder: Path, count: int = 3) -> Path:
    folder.mkdir()
    for number in range(count):
        np.save(folder / f"{number}.npy", np.random.default_rng(number).random((100, 3)))
    return folder


def taken(opening: Opening) -> tuple[str, Timeline]:
    while (taken := opening.take()) is None:
        assert opening.scan is not None
        time.sleep(0.001)
    scan, opened = taken
    assert opened.hash.done(), "nobody has to wait for it"
    return scan, opened.timeline


def no_session() -> None:
    """Nothing is to come back."""


def start(opening: Opening, scan: Path, index: int = 0) -> None:
    saved = SavedSession("scan", None, index, Document())
    opening.start(str(scan), scan.name, Way(lambda: saved, lambda read: open_scan(scan, read=read)))


def test_an_opened_scan_has_its_first_pose_in_memory(tmp_path: Path) -> None:
    opening = Opening()
    start(opening, save(tmp_path / "scan"), index=1)
    assert opening.task is not None
    assert opening.task.name == "Opening scan"
    scan, timeline = taken(opening)
    assert scan == str(tmp_path / "scan")
    assert timeline.ready(1) is not None
    assert opening.scan is None
    assert opening.task is None
    assert opening.take() is None
    timeline.close()


def test_a_place_beyond_the_end_is_the_end(tmp_path: Path) -> None:
    opening = Opening()
    start(opening, save(tmp_path / "scan"), index=9)
    _, timeline = taken(opening)
    assert timeline.ready(2) is not None
    timeline.close()


def test_what_cannot_be_opened_says_why(tmp_path: Path) -> None:
    opening = Opening()
    start(opening, tmp_path / "none")
    with pytest.raises(InputError, match="no such file"):
        taken(opening)
    assert opening.scan is None
    (tmp_path / "bad.ply").write_bytes(b"ply\nformat ascii 1.0\n")
    start(opening, tmp_path / "bad.ply")
    with pytest.raises(InputError, match=r"bad\.ply"):
        taken(opening)


def test_a_sequence_opens_where_its_first_frame_is_broken(tmp_path: Path) -> None:
    scan = save(tmp_path / "scan")
    (scan / "0.npy").write_bytes(b"nothing")
    opening = Opening()
    start(opening, scan)
    _, timeline = taken(opening)
    assert set(timeline.broken) == {0}
    timeline.close()


def test_whatever_goes_wrong_is_one_message(tmp_path: Path) -> None:
    def fail(_: object) -> Timeline:
        raise KeyError("x")

    opening = Opening()
    opening.start("scan", "scan", Way(no_session, fail))
    with pytest.raises(Scan4DError, match=r"scan: cannot be opened \(KeyError: 'x'\)"):
        taken(opening)


def slow(folder: Path, gate: threading.Event, opened: Future[Timeline]) -> Callable[[object], Timeline]:
    """Opens a scan when the gate does."""

    def open_it(_: object) -> Timeline:
        gate.wait()
        opened.set_result(open_scan(folder))
        return opened.result()

    return open_it


def is_closed(timeline: Timeline) -> bool:
    try:
        timeline.pose(0)
    except ValueError:
        return True
    return False


def test_another_scan_takes_the_place_of_the_one_being_opened(tmp_path: Path) -> None:
    gate, opened, opening = threading.Event(), Future[Timeline](), Opening()
    opening.start("slow", "slow", Way(no_session, slow(save(tmp_path / "slow"), gate, opened)))
    former = opening.task
    assert former is not None
    start(opening, save(tmp_path / "fast"))
    assert former.cancelled
    scan, timeline = taken(opening)
    assert scan == str(tmp_path / "fast")
    timeline.close()
    gate.set()
    left = opened.result()
    while not is_closed(left):
        time.sleep(0.001)
    assert opening.take() is None


def test_what_was_cancelled_never_comes(tmp_path: Path) -> None:
    gate, opened, opening = threading.Event(), Future[Timeline](), Opening()
    opening.start("slow", "slow", Way(no_session, slow(save(tmp_path / "slow"), gate, opened)))
    opening.cancel()
    assert opening.scan is None
    assert opening.take() is None
    gate.set()
    left = opened.result()
    while not is_closed(left):
        time.sleep(0.001)
    assert opening.take() is None
    opening.cancel()


def test_what_was_ready_and_never_taken_is_closed(tmp_path: Path) -> None:
    gate, opened, opening = threading.Event(), Future[Timeline](), Opening()
    gate.set()
    opening.start("slow", "slow", Way(no_session, slow(save(tmp_path / "slow"), gate, opened)))
    left = opened.result()
    threads = [thread for thread in threading.enumerate() if thread.name == "Opening slow"]
    for thread in threads:
        thread.join()
    assert not is_closed(left)
    opening.cancel()
    assert is_closed(left)


def test_large_poses_come_with_what_drawing_asks_of_them() -> None:
    rng = np.random.default_rng(0)
    small, large = (PointCloud.from_arrays(rng.random((count, 3))) for count in (1000, 200_001))
    for cloud in (small, large):
        find_facts(Pose(0, 0.0, "x", cloud))
    assert large.bounds() is large.bounds()
    assert [(_spacings,) in cloud._facts for cloud in (small, large)] == [False, True]


def test_a_folder_that_cannot_be_read_at_all_is_refused_in_one_message(tmp_path: Path) -> None:
    scan = save(tmp_path / "scan")
    for number in range(3):
        (scan / f"{number}.npy").write_bytes(b"nothing")
    opened: list[Timeline] = []

    def open_it(_: object) -> Timeline:
        opened.append(open_scan(scan))
        return opened[0]

    opening = Opening()
    opening.start("scan", "scan", Way(no_session, open_it))
    with pytest.raises(
        InputError, match=r"scan: Scan4D cannot read any of the 3 frames\. The first problem: \S+0\.npy"
    ):
        taken(opening)
    assert is_closed(opened[0])


def test_a_scan_begins_with_the_next_frame_that_can_be_read(tmp_path: Path) -> None:
    scan = save(tmp_path / "scan", 4)
    for broken in (0, 1, 3):
        (scan / f"{broken}.npy").write_bytes(b"nothing")
    for start_at, order in ((0, {0, 1}), (3, {3, 0, 1})):
        with open_scan(scan) as timeline:
            assert read_from(timeline, start_at) == 2
            assert set(timeline.broken) == order
            assert timeline.ready(2) is not None


@pytest.mark.slow
def test_every_odd_or_hostile_file_opens_or_is_refused_in_one_message(data_dir: Path) -> None:
    opening, refused = Opening(), dict[str, str]()
    found = [path for folder in ("odd", "hostile") for path in (data_dir / folder).rglob("*")]
    files = [path for path in found if path.is_file()]
    for path in files:
        start(opening, path)
        try:
            _, timeline = taken(opening)
        except InputError as error:
            refused[path.name] = str(error)
        else:
            assert timeline.cached(), "a frame of it was read"
            timeline.close()
    assert 0 < len(refused) < len(files) / 2
    for name, told in refused.items():
        assert name in told
        assert len(told) < 1000


def table(path: Path) -> Path:
    """Four columns without names, x = y = z, so that nothing but a correction says what they are."""
    rows = np.random.default_rng(0).random((50, 4))
    np.savetxt(path, rows)
    return path


def test_a_scan_is_opened_with_the_corrections_of_its_document(tmp_path: Path) -> None:
    scan = table(tmp_path / "points.txt")
    left = SavedSession("scan", None, 0, Document(reading={"columns": "- x y z"}))
    with begin(Way(lambda: left, lambda read: open_scan(scan, read=read))).timeline as timeline:
        pose = timeline.pose(0)
        assert np.allclose(pose.cloud.positions + pose.origin, np.loadtxt(scan)[:, 1:], atol=1e-6)


def test_corrections_of_the_command_line_win_over_those_of_the_document(tmp_path: Path) -> None:
    scan = table(tmp_path / "points.txt")
    left = SavedSession("scan", None, 0, Document(reading={"columns": "- x y z", "unit": "mm"}))
    way = Way(lambda: left, lambda read: open_scan(scan, read=read), stated={"columns": "x - y z"})
    opened = begin(way)
    opened.timeline.close()
    assert opened.reading == {"columns": "x - y z", "unit": "mm"}


def test_a_scan_opens_without_corrections_that_it_cannot_be_read_with(tmp_path: Path) -> None:
    scan = save(tmp_path / "scan")
    left = SavedSession("scan", None, 1, Document(reading={"times": "none.csv"}))
    way = Way(lambda: left, lambda read: open_scan(scan, read=read))
    opened = begin(way, read_from)
    opened.timeline.close()
    assert opened.reading == {}
    assert "ignores the corrections" in str(opened.problem)
    with pytest.raises(InputError):
        begin(way._replace(must_correct=True), read_from)

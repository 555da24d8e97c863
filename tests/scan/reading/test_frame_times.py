"""Names into numbers, and numbers and tables into times."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from viewer.errors import InputError
from viewer.scan.reading.corrections import Corrections
from viewer.scan.reading.times import counted_times, decide, times_in_names
from viewer.scan.reading.times_table import read_times_csv

LABELS = ["a.ply", "b.ply", "c.ply"]


def table(folder: Path, text: str | bytes) -> Path:
    path = folder / "times.csv"
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return path


def test_counted_times_start_at_zero_and_leave_gaps() -> None:
    assert counted_times(["7.ply", "8.ply", "10.ply"], fps=10) == pytest.approx([0, 0.1, 0.3])
    assert counted_times(["x.ply", "y.ply"]) == pytest.approx([0, 0.04])


@pytest.mark.parametrize(
    "text",
    [
        "a.ply,0.5\nb.ply,1\nc.ply,2.25\n",
        "file,time\nc.ply,2.25\na.ply,0.5\nb.ply,1\n",
        "index,time\n0,0.5\n1,1\n2,2.25\n",
        "0,0.5\n1,1\n2,2.25",
        "Time, quality, File\r\n0.5, 9, a.ply\r\n\r\n1, 9, b.ply\r\n2.25, 9, c.ply\r\n",
        "\ufefffile,time\nframes/a.ply,0.5\nframes/b.ply,1\nframes/c.ply,2.25\n",
        "Datei;Zeit\na.ply;0,5\nb.ply;1,0\nc.ply;2,25\n",
        "a.ply;0,5\nb.ply;1\nc.ply;2,25\n",
        "file\ttime\na.ply\t0.5\nb.ply\t1\nc.ply\t2.25\n",
        'file,time\na.ply,"0,5"\nb.ply,1\nc.ply,"2,25"\n',
        "file,time_ms\na.ply,500\nb.ply,1000\nc.ply,2250\n",
        "Filename;Timestamp [us]\na.ply;500000\nb.ply;1000000\nc.ply;2250000\n",
        "file,seconds\na.ply,0.5\nb.ply,1\nc.ply,2.25\n",
        "a.ply,0.5\nb.ply,1\nc.ply,2.25\nnot_in_this_scan.ply,0.1\n",
    ],
)
def test_times_csv(tmp_path: Path, text: str) -> None:
    times = read_times_csv(table(tmp_path, text), LABELS).seconds
    assert times.dtype == np.float64
    assert times.tolist() == [0.5, 1, 2.25]


@pytest.mark.parametrize(
    "text",
    [
        "frame,time\n1,0.5\n2,1\n6,2.25\n",
        "Nr.;Zeit in ms\n1;500\n2;1.000,0\n6;2.250,0\n",
        "Bild;Zeit\n0;0,5\n1;1\n2;2,25\n",
        "frame_id\telapsed_time_ms\n1\t500\n2\t1000\n3\t2250\n",
        "index,milliseconds\n1,500\n2,1000\n3,2250\n",
        "time\n0.5\n1\n2.25\n",
        "Zeit\n0,5\n1\n2,25\n",
        "f001 0.5\nf002 1\nf006 2.25\n",
        "file,time\nC:\\scans\\F001.PLY,0.5\nC:\\scans\\F002.PLY,1\nC:\\scans\\F006.PLY,2.25\n",
        "0.5,f001.png\n1,f002.png\n2.25,f006.png\n",
        "# recorded in May\n# file time\nf001.ply 0.5\nf002.ply 1\nf006.ply 2.25\n",
        "file,time\nf001.ply,500 ms\nf002.ply,1000 ms\nf006.ply,2250 ms\n",
        "Datei;Zeit;Ort\nf001.ply;0,5;Köln\nf002.ply;1;Köln\nf006.ply;2,25;Köln\n".encode("cp1252"),
        "file\ttime\nf001.ply\t0,5\nf002.ply\t1\nf006.ply\t2,25\n".encode("utf-16-le"),
    ],
)
def test_tables_of_times_as_people_write_them(tmp_path: Path, text: str | bytes) -> None:
    assert read_times_csv(table(tmp_path, text), NUMBERED).seconds.tolist() == [0.5, 1, 2.25]


@pytest.mark.parametrize(
    "times",
    [
        ["2024-05-01T12:30:01.000", "2024-05-01T12:30:01.250Z", "2024-05-01T12:30:02Z"],
        ["2024-05-01 23:59:59.5", "2024-05-01 23:59:59.75", "2024-05-02 00:00:00.5"],
        ["01.05.2024 12:30:01,5", "01.05.2024 12:30:01,75", "01.05.2024 12:30:02,5"],
        ["12:30:01.000", "12:30:01.250", "12:30:02.000"],
        ["59:01.000", "59:01.250", "59:02.000"],
    ],
)
def test_clock_times_count_from_the_first_frame(tmp_path: Path, times: list[str]) -> None:
    rows = "".join(f"{label};{time}\n" for label, time in zip(LABELS, times, strict=True))
    found = read_times_csv(table(tmp_path, f"file;time\n{rows}"), LABELS)
    assert found.seconds == pytest.approx([0, 0.25, 1])


@pytest.mark.parametrize("unit", [1e3, 1e6, 1e9])
def test_times_since_1970_tell_their_unit(tmp_path: Path, unit: float) -> None:
    seconds = [1716383012.25, 1716383012.5, 1716383013.0]
    rows = "".join(f"{at},{int(time * unit)}\n" for at, time in enumerate(seconds))
    assert read_times_csv(table(tmp_path, rows), LABELS).seconds == pytest.approx(seconds, abs=1e-6)


def test_long_steps_without_a_unit_are_marked(tmp_path: Path) -> None:
    found = decide(LABELS, table=table(tmp_path, "file,time\na.ply,0\nb.ply,33\nc.ply,66\n"))
    assert (found.seconds.tolist(), found.is_measured) == ([0, 33, 66], True)
    assert found.decision.is_marked
    assert "time_ms" in found.decision.why
    found = decide(LABELS, table=table(tmp_path, "file,time [s]\na.ply,0\nb.ply,33\nc.ply,66\n"))
    assert (found.decision.source, found.decision.is_marked) == ("neighbour", False)


def test_the_times_csv_in_the_documentation(tmp_path: Path) -> None:
    page = Path(__file__).resolve().parents[3] / "docs" / "reference" / "scans.md"
    rows = [line.strip() for line in page.read_text(encoding="utf-8").splitlines() if line.startswith("    ")]
    times = read_times_csv(table(tmp_path, "\n".join(rows)), ["00001.ply", "00002.ply"]).seconds
    assert times.tolist() == [0, 0.033]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "times.csv: contains no time for 'a.ply'"),
        ("file,time\na.ply,0\nb.ply,1\n", "times.csv: contains no time for 'c.ply'"),
        ("file,time\na.ply,0\nb.ply,soon\n", "line 3: time 'soon' is not a number"),
        ("a.ply,0\nb.ply,nan\n", "line 2: time 'nan' is not a number"),
        ("a.ply,0\n\nb.ply\n", "line 3: a column is missing"),
        ("a.ply,0\nb.ply,1\nb.ply,2\n", "line 3: states a second time for 'b.ply', after line 2"),
        ("a.ply,0\nb.ply,2\nc.ply,2\n", "line 3: 'c.ply' is not later than 'b.ply'"),
        ("0,0\n1,1\n3,2\n", "line 3: index 3 is outside 0..2"),
        ("0,0\n1,1\n99999999999999999999,2\n", "line 3: index 99999999999999999999 is outside 0..2"),
        ("frame,time\n0,0\n", "times.csv: contains no time for 'b.ply'"),
        ("time\n0\n1\n2\n3\n", "times.csv: has 4 times for 3 frames"),
        ("file,minute\na.ply,0\n", "line 1: time 'minute' is not a number"),
        ("a.ply;0,5\nb.ply;1,2,5\n", "line 2: time '1,2,5' is not a number"),
        ("a.ply,0,5\nb.ply,1,0\nc.ply,2,2\n", "decimal marks"),
        ("0 0 0\n", "times.csv: contains no time for 'b.ply'"),
        ("file,time\na.ply,12:30:01\nb.ply,1\nc.ply,2\n", "line 3: time '1' is not a clock time"),
        (b"a.ply,0\nb.ply,\xff\xfe\n", "line 2: time 'ÿþ' is not a number"),
        ("a" * 200_000, "times.csv: has 1 times for 3 frames"),
        ("a" * 200_000 + ",1", "times.csv: cannot be read"),
    ],
)
def test_times_csv_that_make_no_sense(tmp_path: Path, text: str | bytes, message: str) -> None:
    with pytest.raises(InputError) as caught:
        read_times_csv(table(tmp_path, text), LABELS)
    assert message in str(caught.value)
    assert str(tmp_path) in str(caught.value)


@pytest.mark.parametrize(
    ("labels", "times"),
    [
        (["a_0.5.ply", "a_0.75.ply"], [0, 0.25]), (["10.ply", "50.ply", "90.ply"], [0, 0.04, 0.08]),
        (["1305031102175304.ply", "1305031102211214.ply"], [0, 0.03591]),
        (["1305031102175304000.ply", "1305031102211214000.ply"], [0, 0.03591]),
        (["a_1.ply", "a_2.ply"], None), (["2_0.5.ply", "3_0.75.ply"], None), (["a.ply", "b.ply"], None),
        (["a_9.5.ply", "a_0.75.ply"], None), (["a_1.ply"], None), ([], None),
    ],
)  # fmt: skip
def test_times_in_names(labels: list[str], times: list[float] | None) -> None:
    found = times_in_names(labels)
    assert (found is None) == (times is None)
    if found is not None:
        np.testing.assert_allclose(found, times, atol=1e-9)


def test_times_csv_of_another_encoding(tmp_path: Path) -> None:
    file = table(tmp_path, "file,time\na.ply,0\nb.ply,1\nc.ply,2\n".encode("utf-16"))
    assert read_times_csv(file, LABELS).seconds.tolist() == [0, 1, 2]


NUMBERED = ["f001.ply", "f002.ply", "f006.ply"]
STAMPED = ["1716383012345678.ply", "1716383012378678.ply", "1716383012412001.ply"]


def test_each_source_of_times_wins_over_the_next(tmp_path: Path) -> None:
    file = table(tmp_path, "0,0\n1,1\n2,3\n")
    stored = np.array([0, 2, 5.0])
    found = decide(STAMPED, table=file, stored=stored, fps=10)
    assert (found.seconds.tolist(), found.is_measured) == ([0, 1, 3], True)
    assert (found.decision.source, found.decision.where) == ("neighbour", "times.csv")
    found = decide(STAMPED, stored=stored, fps=10)
    assert (found.seconds.tolist(), found.decision.value) == ([0, 0.1, 0.2], "fps:10")
    found = decide(STAMPED, stored=stored)
    assert (found.seconds.tolist(), found.decision.source) == ([0, 2, 5], "file")
    found = decide(STAMPED)
    assert found.seconds == pytest.approx([0, 0.033, 0.066323], abs=1e-6)
    assert (found.decision.value, found.decision.source) == ("names", "folder")


@pytest.mark.parametrize(
    ("labels", "seconds", "words"),
    [
        (NUMBERED, [0, 0.04, 0.2], "25 frame numbers per second"),
        (["f-2.ply", "f-1.ply", "f0.ply"], [0, 0.04, 0.08], "25 frame numbers"),
        (["20240501.ply", "20240601.ply", "20240702.ply"], [0, 0.04, 0.08], "dates"),
        (["left.ply", "right.ply"], [0, 0.04], "25 frames"),
    ],
)
def test_a_rate_is_assumed_and_marked(labels: list[str], seconds: list[float], words: str) -> None:
    found = decide(labels)
    assert found.seconds == pytest.approx(seconds)
    assert found.decision.is_marked
    assert words in found.decision.why
    assert "fps:50" in found.decision.alternatives


def test_frames_without_names_are_evenly_spaced() -> None:
    assert decide([], count=4).seconds == pytest.approx([0, 0.04, 0.08, 0.12])
    assert decide([], count=3, corrections=Corrections.parse({"times": "fps:10"})).seconds.tolist() == [
        0,
        0.1,
        0.2,
    ]


@pytest.mark.parametrize(
    ("times", "seconds"),
    [("fps:10", [0, 4, 8]), ("index", [0, 0.04, 0.08]), ("names", [0, 0.04, 0.08]), ("t.csv", [0, 1, 2])],
)
def test_a_user_states_the_times(times: str, seconds: list[float], tmp_path: Path) -> None:
    (tmp_path / "t.csv").write_text("0,0\n1,1\n2,2\n")
    labels = ["f1000.ply", "f1040.ply", "f1080.ply"]
    table_beside = table(tmp_path, "0,0\n1,7\n2,9\n")
    corrections = Corrections.parse({"times": times})
    found = decide(labels, tmp_path, table=table_beside, fps=5, corrections=corrections)
    assert found.seconds == pytest.approx(seconds)
    assert found.decision.source == "user"


@pytest.mark.parametrize("times", ["names", "column:t", "gone.csv"])
def test_times_of_a_user_that_are_not_there_are_refused(times: str, tmp_path: Path) -> None:
    with pytest.raises(InputError):
        decide(["left.ply", "right.ply"], tmp_path, corrections=Corrections.parse({"times": times}))

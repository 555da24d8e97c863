"""Names into numbers, and numbers and tables into times."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from viewer.errors import InputError
from viewer.scan.times import frame_numbers, natural_key, paced_times, read_times_csv, times_in_names

LABELS = ["a.ply", "b.ply", "c.ply"]


def table(folder: Path, text: str | bytes) -> Path:
    path = folder / "times.csv"
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return path


def test_natural_order() -> None:
    names = ["f10.ply", "F2.ply", "f1.ply", "f01.ply", "f2b.ply", "10.ply", "9.ply", "a.ply"]
    in_order = ["9.ply", "10.ply", "a.ply", "f01.ply", "f1.ply", "F2.ply", "f2b.ply", "f10.ply"]
    assert sorted(names, key=natural_key) == in_order
    assert sorted(reversed(names), key=natural_key) == in_order


@pytest.mark.parametrize(
    ("labels", "numbers"),
    [
        (["00001.ply", "00002.ply", "00006.ply"], [1, 2, 6]),
        (["hand2_f8_v3.ply", "hand2_f10_v3.ply"], [8, 10]),
        (["only.ply"], None),
        (["left.ply", "right.ply"], None),
        (["left_1.ply", "right_2.ply"], None),
        (["1_17.ply", "2_34.ply"], None),  # a frame number and a clock: which is which?
        (["1623412345123456.ply", "1623412345156789.ply"], None),  # a clock
        (["1.ply", "01.ply"], None),
        (["1.ply", "1b2.ply"], None),
    ],
)
def test_frame_numbers(labels: list[str], numbers: list[int] | None) -> None:
    assert frame_numbers(labels) == numbers


def test_paced_times_start_at_zero_and_leave_gaps() -> None:
    assert paced_times(["7.ply", "8.ply", "10.ply"], fps=10) == pytest.approx([0, 0.1, 0.3])
    assert paced_times(["x.ply", "y.ply"]) == pytest.approx([0, 0.04])


@pytest.mark.parametrize(
    "text",
    [
        "a.ply,0.5\nb.ply,1\nc.ply,2.25\n",
        "file,time\nc.ply,2.25\na.ply,0.5\nb.ply,1\n",
        "index,time\n0,0.5\n1,1\n2,2.25\n",
        "0,0.5\n1,1\n2,2.25",
        "Time, quality, File\r\n0.5, 9, a.ply\r\n\r\n1, 9, b.ply\r\n2.25, 9, c.ply\r\n",
        "\ufefffile,time\nframes/a.ply,0.5\nframes/b.ply,1\nframes/c.ply,2.25\n",
        "a.ply,0.5\nb.ply,1\nc.ply,2.25\nnot_in_this_scan.ply,0.1\n",
    ],
)
def test_times_csv(tmp_path: Path, text: str) -> None:
    times = read_times_csv(table(tmp_path, text), LABELS)
    assert times.dtype == np.float64
    assert times.tolist() == [0.5, 1, 2.25]


def test_the_times_csv_in_the_documentation(tmp_path: Path) -> None:
    page = Path(__file__).resolve().parents[2] / "docs" / "reference" / "scans.md"
    rows = [line.strip() for line in page.read_text(encoding="utf-8").splitlines() if line.startswith("    ")]
    times = read_times_csv(table(tmp_path, "\n".join(rows)), ["00001.ply", "00002.ply"])
    assert times.tolist() == [0, 0.033]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "times.csv: no time for 'a.ply'"),
        ("file,time\na.ply,0\nb.ply,1\n", "times.csv: no time for 'c.ply'"),
        ("file,time\na.ply,0\nb.ply,soon\n", "line 3: time 'soon' is not a number"),
        ("a.ply,0\nb.ply,nan\n", "line 2: time 'nan' is not a number"),
        ("a.ply,0\n\nb.ply\n", "line 3: a column is missing"),
        ("a.ply,0\nb.ply,1\nb.ply,2\n", "line 3: has a second time for 'b.ply', which line 2 already has"),
        ("a.ply,0\nb.ply,2\nc.ply,2\n", "line 3: 'c.ply' is not later than 'b.ply'"),
        ("0,0\n1,1\n3,2\n", "line 3: index 3 is outside 0..2"),
        ("0,0\n1,1\n99999999999999999999,2\n", "line 3: index 99999999999999999999 is outside 0..2"),
        ("frame,time\n0,0\n", "line 1: no column called 'file' or 'index'"),
        ("file,seconds\na.ply,0\n", "line 1: time 'seconds' is not a number"),
        (b"a.ply,0\nb.ply,\xff\xfe\n", "times.csv: cannot be read"),
        ("a" * 200_000, "times.csv: cannot be read"),
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

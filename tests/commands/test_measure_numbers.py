"""`scan4d measure`: the numbers of a movement that is known, its speed, and what is refused."""

from __future__ import annotations

import csv
import json
import math
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from command_line import Run
from PIL import Image

from viewer.analysis.measures.curves import NUMBER_COLUMNS, REPEAT_COLUMNS
from viewer.output.plots import PLOT_COLORS

FPS, HEIGHT, OWN, NOISE = 30, 4.0, 0.03, 0.04
TIMES = np.arange(FPS + 1) / FPS
LENGTHS = 10 + HEIGHT * (1 - (2 * TIMES - 1) ** 2)  # up and down again within a second
WORDS = (
    "measure", "seq", "--landmarks", "landmarks.csv", "--measures", "measures.json", "--no-snap",
    "--fps", f"{FPS}", "--unit", "mm", "--noise", f"{NOISE}", "-o", "out.csv",
)  # fmt: skip
SIGMA = math.sqrt(2) * math.hypot(OWN, NOISE)  # of a distance
# Savitzky and Golay's table for a cubic through nine points
MIDDLE, SLOPES = 59 / 231, np.array([86, -142, -193, -126, 0, 126, 193, 142, -86]) / 1188


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working directory: a scan, landmarks in all its frames LENGTHS apart, and measures."""
    monkeypatch.chdir(tmp_path)
    Path("seq").mkdir()
    rows: list[tuple[object, ...]] = [("frame", "name", "x", "y", "z", "sigma")]
    for number, length in enumerate(LENGTHS, 1):
        places = np.array([[0, 0, 0], [0, length, 0], [0, 0, length]])
        np.save(f"seq/f{number:02d}.npy", places)
        rows += [(number, name, *place, OWN) for name, place in zip("abc", places.tolist(), strict=True)]
    write_table(Path("landmarks.csv"), rows)
    measures = [
        {"name": "way", "kind": "distance", "landmarks": ["a", "b"]},
        {"name": "still", "kind": "angle", "landmarks": ["b", "a", "c"]},
    ]
    Path("measures.json").write_text(json.dumps({"measures": measures}))
    return tmp_path


def write_table(path: Path, rows: list[tuple[object, ...]]) -> None:
    with open(path, "w", encoding="utf-8", newline="") as stream:
        csv.writer(stream).writerows(rows)


def table(path: str) -> list[dict[str, str]]:
    with open(path, encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


def told(path: str, name: str, column: str) -> np.ndarray:
    """A column of the rows of a measure, (T,), NaN where it is empty."""
    return np.array([float(row[column] or "nan") for row in table(path) if row["name"] == name])


def test_the_numbers_of_a_movement_are_those_of_its_formula(run: Run) -> None:
    done = run(*WORDS, "--numbers", "numbers.csv")
    assert done.code == 0, done.err
    assert done.out.splitlines()[-2:] == ["out.csv", "numbers.csv"]
    way, still = table("numbers.csv")
    assert tuple(way) == NUMBER_COLUMNS
    assert (way["measure"], way["unit"]) == ("way", "mm")
    first = TIMES <= 0.3
    rest = LENGTHS[first].mean()
    amplitude = 10 + HEIGHT - rest
    assert float(way["rest"]) == pytest.approx(rest, rel=1e-5)
    assert float(way["amplitude"]) == pytest.approx(amplitude, rel=1e-5)
    spread = 1.96 * SIGMA * math.sqrt(MIDDLE + 1 / first.sum())
    assert float(way["amplitude ±"]) == pytest.approx(spread, rel=1e-5)
    assert float(way["peak [s]"]) == pytest.approx(0.5, abs=1e-5)
    # where 10 + HEIGHT (1 - (2 t - 1)^2) is rest + 0.1 amplitude
    half = math.sqrt(0.9 * amplitude / HEIGHT) / 2
    assert float(way["onset [s]"]) == pytest.approx(0.5 - half, abs=1e-3)
    assert float(way["end [s]"]) == pytest.approx(0.5 + half, abs=1e-3)
    assert float(way["duration [s]"]) == pytest.approx(2 * half, abs=2e-3)
    onset, end, duration = (float(way[f"{name} ± [s]"]) for name in ("onset", "end", "duration"))
    assert onset == pytest.approx(1.96 * SIGMA * math.sqrt(MIDDLE) / (8 * HEIGHT * half), rel=0.05)
    assert duration == pytest.approx(math.hypot(onset, end), rel=1e-5)
    assert float(way["fastest per s"]) == pytest.approx(4 * HEIGHT, rel=1e-5)
    assert abs(float(still.pop("fastest per s"))) < 1e-9
    nothing = dict.fromkeys((name for name in NUMBER_COLUMNS if name != "fastest per s"), "")
    assert still == {**nothing, "measure": "still", "unit": "°"}


def test_json_holds_the_same_numbers(run: Run) -> None:
    assert run(*WORDS, "--numbers", "numbers.csv").code == 0
    assert run(*WORDS, "--numbers", "numbers.json", "--force").code == 0
    held = json.loads(Path("numbers.json").read_text(encoding="utf-8"))
    assert (held["scan"], held["unit"]) == ("seq", "mm")
    assert held["rows"][0]["peak [s]"] == pytest.approx(0.5)
    for one, other in zip(held["rows"], table("numbers.csv"), strict=True):
        assert {name: "" if value is None else str(value) for name, value in one.items()} == other


def test_speed_and_acceleration_are_those_of_the_formula(run: Run) -> None:
    assert run(*WORDS).code == 0
    values = table("out.csv")
    assert run(*WORDS, "--order", "speed", "--force").code == 0
    np.testing.assert_allclose(told("out.csv", "way", "value"), 8 * HEIGHT * (0.5 - TIMES), atol=1e-9)
    middle = told("out.csv", "way", "sigma")[4:-4]
    np.testing.assert_allclose(middle, SIGMA * FPS * np.linalg.norm(SLOPES), rtol=1e-5)
    speeds = [row for row in table("out.csv") if row["kind"] != "trajectory"]
    assert {row["name"]: row["unit"] for row in speeds} == dict(
        a="mm", b="mm", c="mm", way="mm/s", still="°/s"
    )
    changed = ("value", "sigma", "unit")
    for value, speed in zip(values, speeds, strict=True):
        for column, text in value.items():
            assert speed[column] == text or (value["kind"] == "measure" and column in changed)
    assert run(*WORDS, "--order", "acceleration", "--force").code == 0
    np.testing.assert_allclose(told("out.csv", "way", "value"), -8 * HEIGHT, rtol=1e-9)
    assert {row["unit"] for row in table("out.csv") if row["name"] == "way"} == {"mm/s²"}


@pytest.mark.parametrize(("seconds", "side"), [("0.6", 9), ("1e300", 15), ("1e-300", 2)])
def test_smoothing_is_as_wide_as_is_told(run: Run, seconds: str, side: int) -> None:
    """From the least window that a cubic takes up to all frames; side: points to a side of the middle one."""
    done = run(*WORDS, "--order", "speed", "--smoothing", seconds)
    assert done.code == 0, done.err
    np.testing.assert_allclose(told("out.csv", "way", "value"), 8 * HEIGHT * (0.5 - TIMES), atol=1e-9)
    cubic = np.vander(np.arange(-side, side + 1) / FPS, 4, increasing=True)
    expected = SIGMA * np.linalg.norm(np.linalg.pinv(cubic)[1])
    assert told("out.csv", "way", "sigma")[15] == pytest.approx(expected, rel=1e-5)


def test_chosen_frames_are_a_curve_of_their_own_and_too_few_are_told(run: Run) -> None:
    done = run(*WORDS, "--order", "speed", "--poses", "0:31:3")
    assert done.code == 0, done.err
    np.testing.assert_allclose(told("out.csv", "way", "value"), 8 * HEIGHT * (0.5 - TIMES[::3]), atol=1e-9)
    done = run(*WORDS, "--order", "speed", "--numbers", "numbers.csv", "--poses", "4:7", "--force")
    assert done.code == 0, done.err
    assert "the speed of 'way' has no value in 3 of 3 frames" in done.err
    rows = [row for row in table("out.csv") if row["name"] == "way"]
    assert {(row["state"], row["value"]) for row in rows} == {("gap", "")}
    assert set(table("numbers.csv")[0].values()) == {"way", "mm", ""}


@pytest.mark.slow
def test_repeats_are_the_pieces_around_the_peaks_of_a_measure(run: Run) -> None:
    times, peaks, heights = np.arange(121) / FPS, (0.8, 2.0, 3.2), (4.0, 5.0, 6.0)
    bumps = [h * np.exp(-0.5 * ((times - at) / 0.15) ** 2) for at, h in zip(peaks, heights, strict=True)]
    rows: list[tuple[object, ...]] = [("frame", "name", "x", "y", "z", "sigma")]
    for number, length in enumerate(10 + np.sum(bumps, axis=0), 1):
        np.save(f"seq/f{number:03d}.npy", np.array([[0, 0, 0], [0, length, 0], [0, 0, length]]))
        places = {"a": (0, 0, 0), "b": (0, length, 0), "c": (0, 0, length)}
        rows += [(number, name, *place, OWN) for name, place in places.items()]
    for old in Path("seq").glob("f??.npy"):
        old.unlink()
    write_table(Path("landmarks.csv"), rows)
    done = run(*WORDS, "--repeats", "repeats.csv", "--aligned", "way")
    assert done.code == 0, done.err
    assert "Scan4D found 3 repeats, and aligned them by the peaks of 'way'" in done.err + done.out
    found = [row for row in table("repeats.csv") if row["measure"] == "way"]
    assert tuple(found[0]) == REPEAT_COLUMNS
    at_peak = {row["repeat"]: row for row in found if float(row["time [s]"]) == 0}
    for repeat, at, height in zip("123", peaks, heights, strict=True):
        assert float(at_peak[repeat]["event [s]"]) == pytest.approx(at, abs=0.005)
        assert float(at_peak[repeat]["value"]) == pytest.approx(10 + height, abs=0.02)
        assert at_peak[repeat]["deviation"] == ""
    mean = at_peak["mean"]
    assert (mean["event [s]"], mean["unit"]) == ("", "mm")
    assert float(mean["value"]) == pytest.approx(15, abs=0.02)
    assert float(mean["deviation"]) == pytest.approx(1, abs=0.02)
    assert {float(row["time [s]"]) for row in found} == {float(f"{k / FPS:.6g}") for k in range(-18, 19)}
    assert {row["measure"] for row in table("repeats.csv")} == {"way", "still"}
    still = run(*WORDS, "--repeats", "repeats.csv", "--aligned", "still", "--force")
    assert still.code == 0
    assert "'still' has no peak of at least 50 % of its range, so Scan4D finds no repeats" in still.err
    assert table("repeats.csv") == []


@pytest.mark.slow
def test_plots_are_those_of_the_window(run: Run) -> None:
    done = run(*WORDS, "--plot", "plot.csv")
    assert done.code == 0, done.err
    assert done.out.splitlines()[-1] == "plot.csv"
    rows = table("plot.csv")
    assert list(rows[0]) == ["frame", "time [s]", "way [mm]", "way ± [mm]", "still [°]", "still ± [°]"]
    np.testing.assert_allclose([float(row["way [mm]"]) for row in rows], LENGTHS, rtol=1e-8)
    np.testing.assert_allclose([float(row["way ± [mm]"]) for row in rows], 1.96 * SIGMA, rtol=1e-5)
    done = run(*WORDS, "--plot", "plot.svg", "--order", "speed", "--force")
    assert done.code == 0, done.err
    words = [part.text for part in ElementTree.parse("plot.svg").iter("{http://www.w3.org/2000/svg}text")]
    assert {"mm/s", "°/s", "time [s]", "way", "still"} <= set(words)
    assert run(*WORDS, "--plot", "plot.png", "--force").code == 0
    with Image.open("plot.png") as image:
        pixels = np.array(image.convert("RGB")).reshape(-1, 3)
    blue = np.array([(PLOT_COLORS[0] >> shift) & 255 for shift in (16, 8, 0)])
    assert (np.abs(pixels.astype(int) - blue).max(axis=1) < 3).sum() > 500


def test_gaps_and_chosen_frames_are_as_such_in_plots(run: Run) -> None:
    done = run(*WORDS, "--plot", "plot.csv", "--order", "speed", "--poses", "4:7")
    assert done.code == 0, done.err
    assert [(row["frame"], row["way [mm/s]"]) for row in table("plot.csv")] == [
        ("5", ""),
        ("6", ""),
        ("7", ""),
    ]


def test_measures_go_against_one_of_them(run: Run) -> None:
    held = json.loads(Path("measures.json").read_text())
    for name, landmarks in (("across", "bc"), ("up", "ac")):
        held["measures"].append({"name": name, "kind": "distance", "landmarks": list(landmarks)})
    Path("measures.json").write_text(json.dumps(held))
    done = run(*WORDS, "--against", "across", "--numbers", "numbers.csv", "--plot", "plot.csv")
    assert done.code == 0, done.err
    numbers = {row["measure"]: row for row in table("numbers.csv")}
    assert tuple(numbers["way"]) == (*NUMBER_COLUMNS, "r")
    assert numbers["across"]["r"] == ""
    assert float(numbers["way"]["r"]) == pytest.approx(1, abs=1e-6)
    rows = table("plot.csv")
    names = ("way [mm]", "way ± [mm]", "still [°]", "still ± [°]", "up [mm]", "up ± [mm]")
    assert tuple(rows[0]) == ("frame", "across [mm]", *names)
    across = [float(row["across [mm]"]) for row in rows]
    np.testing.assert_allclose(across, math.sqrt(2) * LENGTHS, rtol=1e-8)
    assert run(*WORDS, "--against", "way", "--plot", "plot.csv", "--order", "speed", "--force").code == 0
    assert list(table("plot.csv")[0])[:3] == ["frame", "way [mm/s]", "still [°/s]"]


def test_the_only_measure_goes_against_nothing(run: Run) -> None:
    held = json.loads(Path("measures.json").read_text())
    Path("measures.json").write_text(json.dumps({"measures": held["measures"][:1]}))
    done = run(*WORDS, "--against", "way", "--numbers", "numbers.csv")
    assert done.code == 2
    assert "--against: there is only one measure" in done.err
    assert not Path("out.csv").exists()


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("--against", "weg", "--plot", "a.svg"), "unknown measure 'weg'. Known: still, way"),
        (("--plot", "plot.pdf"), "plot.pdf: cannot write '.pdf' files. Known: .csv, .png, .svg"),
        (("--plot", "seq/../out.csv"), "is already the name of another output. Write --plot to another file"),
        (("--numbers", "numbers.txt"), "numbers.txt: cannot write '.txt' files. Known: .csv, .json"),
        (("--numbers", "no/numbers.csv"), "there is no folder 'no'"),
        (("--numbers", "seq/../out.csv"), "is already the name of another output"),
        (("--numbers", "a.csv", "--repeats", "seq/../a.csv"), "is already the name of another output"),
        (("--repeats", "a.csv", "--aligned", "weg"), "unknown measure 'weg'. Known: still, way"),
        (("--repeats", "a.csv", "--least", "1.5"), "'1.5' is not a share above 0, up to 1"),
        (
            ("--aligned", "way"),
            "--aligned: applies only to repeats of a movement, but the command asks for no repeats. Add "
            "--repeats FILE",
        ),
        (("--numbers", "measures.json"), "is an input of this command, and Scan4D does not replace inputs"),
        (("--order", "jerk"), "jerk"),
        (("--smoothing", "0", "--order", "speed"), "'0' is not a time above 0, in seconds"),
        (("--smoothing", "nan", "--order", "speed"), "'nan' is not a time above 0, in seconds"),
    ],
)
def test_what_cannot_be_done_is_told_before_any_work(run: Run, words: tuple[str, ...], told: str) -> None:
    done = run(*WORDS, *words)
    assert done.code == 2
    assert told in done.err
    assert "Traceback" not in done.err
    assert not Path("out.csv").exists()


@pytest.mark.parametrize(
    "words",
    [("--numbers", "n.csv"), ("--repeats", "r.csv"), ("--plot", "a.svg"), ("--against", "way")],
)
def test_movements_without_measures_are_told(run: Run, words: tuple[str, ...]) -> None:
    done = run("measure", "seq", "--landmarks", "landmarks.csv", "-o", "out.csv", *words)
    assert done.code == 2
    assert f"{words[0]}: needs measures, but the command names none. Name them with --measures" in done.err
    assert not Path("out.csv").exists()


def test_smoothing_without_measures_or_speeds_is_refused(refused: Callable[..., str]) -> None:
    words = ("measure", "seq", "--landmarks", "landmarks.csv", "-o", "out.csv", "--smoothing", "0.5")
    assert "--smoothing: has nothing to smooth. Use this option with --measures" in refused(*words)
    assert not Path("out.csv").exists()

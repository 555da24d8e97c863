"""`scan4d measure`: speeds of landmarks whose motion is known, and the motion of anchors taken off."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import numpy as np
import pytest
from command_line import Run

from viewer.analysis.landmarks.files import read_landmarks

FPS, OWN = 30, 0.1
TIMES = np.arange(2 * FPS + 1) / FPS
ANCHORS = {"left": (40.0, 0, 0), "right": (-40.0, 0, 0), "nose": (0, -30.0, 20.0)}
OPENING = 8 * np.sin(math.pi * TIMES)
WORDS = (
    "measure", "seq", "--landmarks", "landmarks.csv", "--no-snap", "--fps", f"{FPS}", "--unit", "mm",
    "-o", "out.csv",
)  # fmt: skip
HELD = ("--anchors", "left, right,nose")


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working directory: a head that turns and is carried on, and a chin that opens meanwhile."""
    monkeypatch.chdir(tmp_path)
    Path("seq").mkdir()
    rows: list[tuple[object, ...]] = [("frame", "name", "x", "y", "z", "sigma")]
    for number, (time, opening) in enumerate(zip(TIMES, OPENING, strict=True), 1):
        angle = math.radians(15) * math.sin(math.pi * time)
        turn = np.array(
            [[math.cos(angle), 0, math.sin(angle)], [0, 1, 0], [-math.sin(angle), 0, math.cos(angle)]]
        )
        head = np.array([*ANCHORS.values(), (0, -40 - opening, 15)])
        places = head @ turn.T + [10 * time, 0, 0]
        np.save(f"seq/f{number:02d}.npy", places)
        names = (*ANCHORS, "chin")
        rows += [(number, name, *place, OWN) for name, place in zip(names, places.tolist(), strict=True)]
    with open("landmarks.csv", "w", encoding="utf-8", newline="") as stream:
        csv.writer(stream).writerows(rows)
    return tmp_path


def rows_of(kind: str, name: str, path: str = "out.csv") -> list[dict[str, str]]:
    with open(path, encoding="utf-8", newline="") as stream:
        return [row for row in csv.DictReader(stream) if (row["kind"], row["name"]) == (kind, name)]


def numbers(rows: list[dict[str, str]], column: str) -> np.ndarray:
    return np.array([float(row[column] or "nan") for row in rows])


def test_what_anchors_leave_of_places_and_speeds_is_the_motion_against_them(run: Run) -> None:
    done = run(*WORDS, *HELD, "--order", "speed")
    assert done.code == 0, done.err
    places = rows_of("landmark", "chin")
    np.testing.assert_allclose(numbers(places, "x"), 0, atol=1e-9)
    np.testing.assert_allclose(numbers(places, "y"), -40 - OPENING, rtol=1e-9)
    np.testing.assert_allclose(numbers(places, "z"), 15, rtol=1e-9)
    np.testing.assert_allclose(numbers(places, "sigma"), OWN, rtol=1e-6)
    speeds = rows_of("trajectory", "chin")
    assert [(row["frame"], row["x"], row["unit"]) for row in speeds] == [
        (str(number), "", "mm/s") for number in range(1, len(TIMES) + 1)
    ]
    wanted = 8 * math.pi * np.abs(np.cos(math.pi * TIMES))
    np.testing.assert_allclose(numbers(speeds, "value")[4:-4], wanted[4:-4], atol=0.1)
    assert numbers(rows_of("trajectory", "left"), "value").max() < 1e-9
    # Savitzky and Golay's table for a cubic through nine points
    slopes = np.array([86, -142, -193, -126, 0, 126, 193, 142, -86]) / 1188
    sigma = OWN * FPS * np.linalg.norm(slopes)
    np.testing.assert_allclose(numbers(speeds, "sigma")[10], sigma, rtol=1e-5)


def test_without_anchors_speeds_are_those_in_the_scan(run: Run) -> None:
    done = run(*WORDS, "--order", "speed", "--traced", "chin", "--plot", "plot.csv")
    assert done.code == 0, done.err
    angle = math.radians(15) * np.sin(math.pi * TIMES)
    turning = math.radians(15) * math.pi * np.cos(math.pi * TIMES)
    velocity = [
        10 + 15 * np.cos(angle) * turning,
        -8 * math.pi * np.cos(math.pi * TIMES),
        -15 * np.sin(angle) * turning,
    ]
    speeds = numbers(rows_of("trajectory", "chin"), "value")
    np.testing.assert_allclose(speeds[4:-4], np.linalg.norm(velocity, axis=0)[4:-4], atol=0.15)
    assert rows_of("trajectory", "left") == []
    with open("plot.csv", encoding="utf-8", newline="") as stream:
        plotted = list(csv.DictReader(stream))
    assert list(plotted[0]) == ["frame", "time [s]", "chin [mm/s]", "chin ± [mm/s]"]
    np.testing.assert_allclose(numbers(plotted, "chin [mm/s]"), speeds, rtol=1e-8)


def test_places_that_are_held_still_are_landmarks_again(run: Run) -> None:
    assert run(*WORDS, *HELD, "--order", "speed").code == 0
    found = read_landmarks(Path("out.csv"))
    assert found.names == (*ANCHORS, "chin")
    left = found.positions[:, 0]
    np.testing.assert_allclose(left, np.broadcast_to(ANCHORS["left"], left.shape), atol=1e-9)


def test_chosen_frames_are_the_trajectory_and_too_few_are_told(run: Run) -> None:
    done = run(*WORDS, *HELD, "--order", "speed", "--traced", "chin", "--poses", "4:7")
    assert done.code == 0, done.err
    assert "the speed of the landmark 'chin' has no value in 3 of 3 frames" in done.err
    speeds = rows_of("trajectory", "chin")
    assert [(row["frame"], row["state"], row["value"]) for row in speeds] == [
        (frame, "gap", "") for frame in "567"
    ]


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("--anchors", "left,left,nose"), "--anchors: removing head motion needs at least three landmarks"),
        (("--anchors", "left,right,nase"), "unknown landmark 'nase'. Did you mean 'nose'? Known: chin, left"),
        (("--order", "speed", "--traced", "kinn"), "unknown landmark 'kinn'. Known: chin, left, nose, right"),
        (
            ("--traced", "chin"),
            "--traced: needs speeds, but this command computes no speeds. Add --order speed",
        ),
    ],
)
def test_what_cannot_be_done_is_told_before_any_work(run: Run, words: tuple[str, ...], told: str) -> None:
    done = run(*WORDS, *words)
    assert done.code == 2
    assert told in done.err
    assert not Path("out.csv").exists()

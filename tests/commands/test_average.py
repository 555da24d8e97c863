"""`scan4d render --average`: less noise, and every file says so."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from command_line import Run
from scenes import sphere
from small_scans import SMALL, stored

from viewer.document.recording import Recording
from viewer.output.export import read_description
from viewer.scan import formats
from viewer.scan.points import PointCloud

FRAMES, NOISE = 5, 0.01


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working directory, with the noisy frames of a ball, half of which turns, in sequence/."""
    monkeypatch.chdir(tmp_path)
    Path("sequence").mkdir()
    ball = sphere(4000).positions
    for index in range(FRAMES):
        rng = np.random.default_rng(index)
        points = ball * (1 + NOISE * rng.normal(size=(len(ball), 1)))
        points[ball[:, 0] > 0.1] += (0.3 * index, 0, 0)
        formats.write(Path("sequence") / f"f{index}.npz", PointCloud.from_arrays(points))
    return tmp_path


def test_files_say_what_is_averaged(run: Run) -> None:
    for name in ("a.png", "a.exr", "a.npz"):
        assert run("render", "sequence", "-o", name, "--pose", 4, "--average", 4, *SMALL).code == 0
    for name in ("a.png", "a.exr"):
        assert json.loads(read_description(Path(name)) or "")["average"] == 4
    arrays = stored(Path("a.npz"))
    counts = arrays["averaged"]
    assert counts.dtype == np.uint8
    assert set(np.unique(counts)) <= {0, 1, 4}, "nothing, as scanned, and the mean of all"
    assert ((counts == 0) == (arrays["id"] == 0xFFFFFFFF)).all()
    assert (counts == 4).sum() > 300
    assert (counts == 1).sum() > 300

    import OpenEXR

    channels = OpenEXR.File("a.exr", separate_channels=True).channels()
    assert np.array_equal(channels["averaged"].pixels, counts)


def test_without_the_option_frames_are_as_scanned(run: Run) -> None:
    assert run("render", "sequence", "-o", "a.npz", "--pose", 4, *SMALL).code == 0
    assert run("render", "sequence", "-o", "b.npz", "--pose", 4, "--average", 0, *SMALL).code == 0
    assert "averaged" not in stored(Path("a.npz"))
    for name, values in stored(Path("a.npz")).items():
        assert np.array_equal(values, stored(Path("b.npz"))[name], equal_nan=values.dtype.kind == "f")


def test_several_frames_are_averaged_as_each_alone(run: Run) -> None:
    assert run("render", "sequence", "-o", "all%d.png", "--all", "--average", 3, *SMALL).code == 0
    for index in (1, 4):
        assert run("render", "--replay", f"all{index}.png", "-o", "again.png", "--force").code == 0
        assert Path(f"all{index}.png").read_bytes() == Path("again.png").read_bytes()


def test_a_replay_averages_the_same_frames(run: Run) -> None:
    assert run("render", "sequence", "-o", "a.png", "--pose", 3, "--average", 4, *SMALL).code == 0
    assert Recording.load(Path("a.png")).entries[0].average == 4
    assert run("render", "-o", "b.png", "--replay", "a.png").code == 0
    assert Path("a.png").read_bytes() == Path("b.png").read_bytes()


@pytest.mark.parametrize("frames", ["1", "65", "-2", "many"])
def test_a_wrong_number_of_frames_is_one_message(run: Run, frames: str) -> None:
    done = run("render", "sequence", "-o", "a.png", "--average", frames)
    assert done.code == 2
    assert "from 2 to 64" in done.err

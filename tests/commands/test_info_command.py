"""`scan4d info`."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from command_line import Run
from small_scans import ROOT, SMALL, cloud_at

from viewer.codewords.files import read_stream
from viewer.codewords.words import decode_words
from viewer.commands._scans import first_readable
from viewer.errors import InputError
from viewer.scan import formats
from viewer.scan.open import open_scan
from viewer.scan.points import PointCloud


def test_info_as_json(run: Run, scans: Path) -> None:
    done = run("info", scans / "sequence", "--json", "--unit", "mm", "--fps", 10)
    assert (done.code, done.err) == (0, "")
    facts = json.loads(done.out)
    cloud = formats.read(scans / "sequence" / "f00.npz")
    world = cloud.world()
    assert facts["name"] == "sequence"
    assert (facts["poses"], facts["unit"], facts["pose"], facts["label"]) == (5, "mm", 0, "f00.npz")
    assert facts["times"] == {"first": 0, "last": 0.4, "median_step": pytest.approx(0.1)}
    assert (facts["points"], facts["dropped"]) == (2000, 0)
    assert np.allclose(facts["bounds"]["low"], world.min(axis=0))
    assert np.allclose(facts["bounds"]["high"], world.max(axis=0))
    assert facts["origin"] == cloud.origin.tolist()
    assert list(facts["attributes"]) == ["normals", "colors", "radii", "height"]
    assert facts["attributes"]["colors"] == {
        "type": "uint8", "columns": 4, "range": [cloud.colors.min(), 255],
    }  # fmt: skip
    assert facts["attributes"]["height"]["range"] == [
        pytest.approx(cloud.scalars["height"].min()), pytest.approx(cloud.scalars["height"].max()),
    ]  # fmt: skip


def test_info_as_text(run: Run, scans: Path) -> None:
    done = run("info", scans / "sequence", "--unit", "mm")
    lines = dict(re.split(" {2,}", line, maxsplit=1) for line in done.out.splitlines())
    assert lines["poses"] == "5, 0 to 0.16 s, 25 a second"
    assert lines["points"] == "2,000"
    assert lines["unit"] == "mm"
    assert lines["colors"].startswith("uint8 x 4")


def test_info_says_how_it_read_the_scan(run: Run, tmp_path: Path) -> None:
    """One line on the contents, one on what it assumes; --verbose and --json say all."""
    table = tmp_path / "points.xyz"
    table.write_text("1 2 3\n4 5 6\n7 8 10\n")
    short = run("info", table).out
    assert "columns x y z" in re.search("^read as .*$", short, re.M)[0]  # type: ignore[index]
    assert "unit not known" in re.search("^assumed .*$", short, re.M)[0]  # type: ignore[index]
    assert "how Scan4D read" not in short
    assert "Alternatives: mm, m, cm" in run("info", table, "--verbose").out
    record = json.loads(run("info", table, "--json").out)["reading"]
    assert record["decisions"]["columns"]["value"] == ["x", "y", "z"]
    assert "unit" in record["assumed"]


def test_corrections_of_the_command_line(run: Run, tmp_path: Path) -> None:
    """They may stand in several options, and before the scan."""
    table = tmp_path / "points.xyz"
    table.write_text("1 2 3 4\n5 6 7 8\n")
    done = run("info", "--read", "columns=- x y z", "unit=mm", "--read", "texture=dense", table, "--json")
    facts = json.loads(done.out)
    assert facts["bounds"]["low"] == [2, 3, 4]
    assert facts["reading"]["decisions"]["unit"]["from"] == "--read"
    assert "texture=dense" in done.err
    refused = run("info", table, "--read", "columms=x y z")
    assert refused.code == 2
    assert "Did you mean 'columns'" in refused.err
    assert run("info", table, "--read", "decimal").code == 2


def test_info_reads_the_first_readable_pose_alone(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for index in range(4):
        formats.write(tmp_path / f"f{index}.npz", cloud_at(index))
    (tmp_path / "f0.npz").write_bytes(b"nothing")
    read: list[str] = []
    original = formats.read

    def noted(path: Path, *rest: int, **named: object) -> PointCloud:
        read.append(path.name)
        return original(path, *rest, **named)

    monkeypatch.setattr(formats, "read", noted)
    done = run("info", tmp_path, "--json")
    assert json.loads(done.out)["pose"] == 1
    assert "f0.npz" in done.err
    assert read == ["f1.npz"]


FRAMES = 1000


@pytest.mark.parametrize("kind", ["files", "pods", "tum", "open3d"])
def test_info_tries_few_of_many_broken_poses(kind: str, run: Run, tmp_path: Path) -> None:
    numbers = range(FRAMES)
    match kind:
        case "files":
            for n in numbers:
                (tmp_path / f"f{n}.npz").touch()
        case "pods":
            for n in numbers:
                (tmp_path / f"left_{n}.tif").touch()
            pod = {"name": "left", "range": "left_*.tif", "fx": 9, "fy": 9, "cx": 2, "cy": 2}
            (tmp_path / "pods.json").write_text(json.dumps({"pods": [pod]}))
        case "tum":
            (tmp_path / "depth.txt").write_text("".join(f"{n} {n}.png\n" for n in numbers))
            (tmp_path / "groundtruth.txt").write_text("".join(f"{n} 0 0 0 0 0 0 1\n" for n in numbers))
        case "open3d":
            (tmp_path / "depth").mkdir()
            (tmp_path / "rgbd.match").write_text("".join(f"depth/{n}.png {n}.png\n" for n in numbers))
    with open_scan(tmp_path) as timeline:
        assert len(timeline) == FRAMES
        with pytest.raises(
            InputError, match=f"^{tmp_path.name}: Scan4D tried to read 100 of {FRAMES} frames"
        ):
            first_readable(timeline, range(FRAMES))
        assert len(timeline.broken) == 100
    done = run("info", tmp_path)
    assert done.code == 2
    assert f"Scan4D tried to read 100 of {FRAMES} frames, and all of them failed. The first: " in done.err


@pytest.mark.parametrize(("readable", "broken"), [((0, 7), 0), ((7, 40), 7), ((49, 50), 49), ((999,), 99)])
def test_info_says_how_many_poses_it_tried(
    readable: tuple[int, ...], broken: int, run: Run, tmp_path: Path
) -> None:
    for n in range(FRAMES):
        (tmp_path / f"f{n}.npz").touch()
    for n in readable:
        formats.write(tmp_path / f"f{n}.npz", cloud_at(0))
    facts = json.loads(run("info", tmp_path, "--json").out)
    assert (facts["pose"], facts["unreadable"]) == (readable[0], broken)
    told = f"unreadable  {broken} of the {broken + 1} poses that Scan4D tried to read\n"
    assert (told in run("info", tmp_path).out) == (broken > 0)


def test_info_copes_with_values_that_are_not_finite(run: Run, tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", positions=np.eye(3), some=[1, np.nan, 2.5], none=np.full(3, np.inf))
    attributes = json.loads(run("info", tmp_path / "a.npz", "--json").out)["attributes"]
    assert attributes["some"]["range"] == [1, 2.5]
    assert attributes["none"]["range"] is None
    assert "no finite value" in run("info", tmp_path / "a.npz").out


def test_info_and_convert_import_no_gl(scans: Path) -> None:
    code = (
        "import sys; from viewer.cli import main; main(sys.argv[1:]); "
        "print(*{name.partition('.')[0] for name in sys.modules} & {'moderngl', 'OpenGL', 'PIL', 'tqdm'})"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, "info", str(scans / "ball.npz")],
        capture_output=True, text=True, cwd=ROOT, check=True,
    )  # fmt: skip
    assert done.stdout.splitlines()[-1] == ""


@pytest.mark.parametrize("quality", ["table", "exact"])
def test_info_of_code_words(run: Run, scans: Path, tmp_path: Path, quality: str) -> None:
    path = tmp_path / "a.cw"
    run("render", scans / "ball.npz", "-o", path, *SMALL, "--set", f"quality={quality}")
    stream = read_stream(path)
    done = run("info", path, "--json")
    assert (done.code, done.err) == (0, "")
    facts = json.loads(done.out)
    assert (facts["name"], facts["size"], facts["words"]) == ("a.cw", list(stream.size), len(stream))
    assert facts["depth"] == {
        "nearest": stream.near, "farthest": stream.far, "error": stream.depth_error(),
    }  # fmt: skip
    assert facts["finer"] == (quality == "exact")
    assert 0 < facts["elements"] <= 2000
    for name, values in decode_words(stream.words).items():
        assert facts["fields"][name] == [values.min(), values.max()]
    assert facts["tiles"] == decode_words(stream.words)["mode"].sum()
    text = run("info", path).out
    assert (
        f"{len(stream):,} for {facts['elements']:,} discs; {facts['tiles']:,} of the words are tiles" in text
    )
    low, high = facts["fields"]["z"]
    assert f"z           9 bits, {low:g} to {high:g}" in text


def test_info_of_code_words_without_any(run: Run, tmp_path: Path) -> None:
    (tmp_path / "a.cw").write_bytes(b"SCAN4DCW")
    done = run("info", tmp_path / "a.cw")
    assert done.code == 2
    assert "is not a file of code words" in done.err

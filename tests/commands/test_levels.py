"""`scan4d render --levels`: a picture of each level of an octree, written before finer levels arrive."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from byte_server import serving
from command_line import Run
from PIL import Image
from scenes import sphere

from viewer.scan import formats
from viewer.scan.octree.storage import read_header
from viewer.scan.pose import Pose

SIZE = "96x72"


@pytest.fixture(scope="module")
def octree(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("octree") / "ball.svo"
    formats.write_poses(path, iter([Pose(0, 0.0, "", sphere(9000))]), "mm")
    return path


def pictures(folder: Path) -> list[np.ndarray]:
    return [np.asarray(Image.open(file)) for file in sorted(folder.glob("*.png"))]


def test_a_file_and_a_server_give_the_same_pictures(run: Run, octree: Path, tmp_path: Path) -> None:
    with serving(octree.read_bytes()) as served:
        for number, scan in enumerate((octree, served.url)):
            (tmp_path / str(number)).mkdir()
            done = run("render", scan, "--levels", "-o", tmp_path / str(number) / "l%02d.png", "--size", SIZE)
            assert done.code == 0
    ours, theirs = pictures(tmp_path / "0"), pictures(tmp_path / "1")
    header, _ = read_header(octree.read_bytes())
    assert (
        sorted(file.name for file in (tmp_path / "0").iterdir())[-1] == f"l{len(header.levels) - 1:02d}.png"
    )
    assert len(ours) == len(theirs) >= 3
    for one, other in zip(ours, theirs, strict=True):
        np.testing.assert_array_equal(one, other)
    assert (ours[0] != ours[-1]).any()


@pytest.mark.slow
def test_standard_input_is_drawn_while_it_arrives(octree: Path, tmp_path: Path) -> None:
    """Each level is written only after the picture of the one before was announced."""
    data = octree.read_bytes()
    header, size = read_header(data)
    ends = size + np.cumsum([each.masks + each.attributes for each in (header.strays, *header.levels)])
    out = str(tmp_path / "l%02d.png")
    words = ["-m", "viewer", "render", "-", "--levels", "-o", out, "--size", SIZE]
    with subprocess.Popen(
        [sys.executable, *words], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=False
    ) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        start = 0
        for level, end in enumerate(ends[1:].tolist()):
            process.stdin.write(data[start:end])
            process.stdin.flush()
            start = end
            if header.levels[level].nodes >= 512:
                assert process.stdout.readline().decode().strip() == out % level
                assert Path(out % level).exists()
        process.stdin.close()
    assert process.returncode == 0


def test_a_scan_without_an_octree_is_refused(refused: Callable[..., str], tmp_path: Path) -> None:
    formats.write(tmp_path / "a.npz", sphere(100))
    words = refused("render", tmp_path / "a.npz", "--levels", "-o", tmp_path / "l%02d.png", "--size", SIZE)
    assert "stores no octree" in words


def test_a_cut_octree_gives_coarser_levels_and_one_message(run: Run, octree: Path, tmp_path: Path) -> None:
    with serving(octree.read_bytes()[:-100], ranges=False) as served:
        done = run("render", served.url, "--levels", "-o", tmp_path / "l%02d.png", "--size", SIZE)
    assert done.code == 2
    assert "ends within level" in done.err
    assert "a.svo" in done.err
    assert len(done.err.strip().splitlines()) == 1
    assert pictures(tmp_path)

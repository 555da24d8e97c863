"""Each kind of file on a disk that fills up at another moment: one message, and nothing is left."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from command_line import Run
from disks import small_disk
from scenes import sphere

from viewer.scan import formats

PICTURE = ("render", "demo", "--pose", "0", "--size", "160x120", "--backend", "points", "-o")
FILM = ("render", "demo", "--turntable", "8", "--size", "160x120", "--backend", "points", "-o")
WRITERS = {
    "a.png": PICTURE, "a.exr": PICTURE, "a.npz": PICTURE, "a.mp4": FILM,
    "b.npz": ("convert", "whole.ply"), "b.svo": ("convert", "whole.ply"), "b.ply": ("convert", "whole.ply"),
    "b.pcd": ("convert", "whole.ply"),
}  # fmt: skip

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="no small disk can be mounted")


QUICK = {"a.exr", "a.npz", "b.svo"}


@pytest.mark.parametrize(
    "name", [pytest.param(each, marks=[] if each in QUICK else [pytest.mark.slow]) for each in WRITERS]
)
def test_a_full_disk_is_one_message(
    name: str, run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    formats.write("whole.ply", sphere(20_000))
    with small_disk(tmp_path / "disk", 4096):
        assert run(*WRITERS[name], f"disk/{name}").code == 0
        size = Path(f"disk/{name}").stat().st_size
    for number, share in enumerate((0.0, 0.3, 0.9)):
        with small_disk(tmp_path / f"disk{number}", max(4, int(share * size / 4096) * 4)) as disk:
            done = run(*WRITERS[name], disk / name)
            assert (done.code, done.out) == (2, "")
            full = f"{disk / name}: cannot be written: the disk is full. Free some space, or use another disk"
            assert done.err.splitlines()[-1] == f"scan4d: {full}"
            assert list(disk.iterdir()) == []


def test_without_room_to_unpack_a_laz_file_is_told_so(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import laspy

    las = laspy.LasData(laspy.LasHeader(point_format=3, version="1.2"))
    las.x, las.y, las.z = np.random.default_rng(0).normal(size=(3, 20_000))
    las.write(tmp_path / "a.laz")
    with small_disk(tmp_path / "temporary", 64) as disk:
        monkeypatch.setenv("TMPDIR", str(disk))
        monkeypatch.setattr("tempfile.tempdir", None)
        done = run("info", tmp_path / "a.laz")
        assert done.code == 2
        assert "disk is full" in done.err or "No space left" in done.err
        assert list(disk.iterdir()) == []

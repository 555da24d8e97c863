"""What the window writes never replaces what its scan is read from, under whatever name."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from viewer.scan.inputs import found_among, scan_inputs
from viewer.scan.open import open_scan


def test_files_of_the_scan_are_found_under_other_names_too(tmp_path: Path) -> None:
    frames = tmp_path / "frames"
    frames.mkdir()
    for number in range(2):
        np.save(frames / f"{number}.npy", np.eye(3))
    times, linked, other = tmp_path / "times.csv", tmp_path / "link.npy", tmp_path / "other.npy"
    times.write_text("0,0.0\n1,0.5\n")
    os.link(frames / "1.npy", linked)
    other.write_bytes((frames / "1.npy").read_bytes())
    with open_scan(str(frames)) as timeline:
        paths = [other, linked, times, tmp_path / "none.npy", frames / "0.npy"]
        assert found_among(paths, scan_inputs(timeline)) == [linked, times, frames / "0.npy"]
        assert found_among([], scan_inputs(timeline)) == []
    with open_scan("demo") as timeline:
        assert found_among(paths, scan_inputs(timeline)) == []

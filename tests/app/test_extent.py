"""What a view is fitted to: the frames that are known together, but such as are astray."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest

from viewer.app.scene.extent import Extent
from viewer.scan.open import open_scan

BOX = np.random.default_rng(1).uniform(-1, 1, (500, 3))


def visited(extent: Extent) -> None:
    extent.visit()
    while not extent.take_visited():
        time.sleep(0.01)


def sequence(folder: Path, places: list[float], sizes: list[float] | None = None) -> Path:
    for frame, (place, size) in enumerate(zip(places, sizes or [1.0] * len(places), strict=True)):
        np.save(folder / f"f{frame:03d}.npy", BOX * size + np.array([place, 0, 0]))
    return folder


def test_frames_spread_over_the_scan_are_read_and_kept_out_of_its_cache(tmp_path: Path) -> None:
    with open_scan(sequence(tmp_path, [float(step) for step in range(41)])) as timeline:
        extent = Extent()
        extent.begin(timeline)
        first = timeline.pose(20)
        assert extent.around(first.bounds).high == pytest.approx(first.bounds.high), "nothing else is known"
        visited(extent)
        whole = extent.around(first.bounds)
        assert (whole.low[0], whole.high[0]) == pytest.approx((-1, 41), abs=0.05)
        assert timeline.cached() == [range(20, 21)]
        timeline.pose(39)
        assert not extent.take_visited(), "told once"


def test_frames_astray_do_not_stretch_it_and_broken_ones_are_passed_over(tmp_path: Path) -> None:
    sequence(tmp_path, [0, 1, 1e5, 3, 4, 5, 6], [1, 1, 1, 1, 1e4, 1, 1])
    (tmp_path / "f001.npy").write_bytes(b"damaged")
    with open_scan(tmp_path) as timeline:
        extent = Extent()
        extent.begin(timeline)
        shown = timeline.pose(0)
        for index in range(2, 7):
            timeline.pose(index)
        visited(extent)
        whole = extent.around(shown.bounds)
        assert (whole.low[0], whole.high[0]) == pytest.approx((-1, 7), abs=0.05)
        far = timeline.pose(2).bounds
        assert extent.around(far).high[0] == pytest.approx(far.high[0]), "the frame that is shown counts"


def test_another_scan_begins_anew(tmp_path: Path) -> None:
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    extent = Extent()
    with (
        open_scan(sequence(tmp_path / "a", [0, 9])) as old,
        open_scan(sequence(tmp_path / "b", [5, 6])) as new,
    ):
        extent.begin(old)
        old.pose(0)
        extent.begin(new)
        old.pose(1)
        visited(extent)
        whole = extent.around(new.pose(0).bounds)
        assert (whole.low[0], whole.high[0]) == pytest.approx((4, 7), abs=0.05)
        extent.close()

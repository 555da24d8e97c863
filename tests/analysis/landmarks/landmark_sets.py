"""Sets of landmarks for tests."""

from __future__ import annotations

import numpy as np

from viewer.analysis.landmarks.landmark_set import LandmarkNotes, LandmarkSet
from viewer.analysis.track import Known

NAMES = ("prn", "chR", "chL", "鼻尖", 'a "b", c', "Ünter'lid", "x" * 90, "sn")


def moving(frames: int = 6, names: tuple[str, ...] = NAMES, seed: int = 4) -> LandmarkSet:
    """Landmarks that move, in mm, at 25 frames a second: one is a gap in two frames, dense
    tracking carries one on, one is never placed."""
    rng = np.random.default_rng(seed)
    positions = 40 * rng.normal(size=(1, len(names), 3)) + rng.normal(size=(frames, len(names), 3))
    known = np.full((frames, len(names)), Known.TRACKED, np.uint8)
    known[0], known[4:, 2] = Known.PLACED, Known.CARRIED
    known[2:4, 1] = Known.GAP
    known[:, -1] = Known.PENDING
    positions[known < Known.TRACKED] = np.nan
    sigmas = np.where((known > Known.GAP) & (known < Known.PLACED), rng.random(known.shape), np.nan)
    return LandmarkSet.of(
        names,
        positions,
        known=known,
        sigmas=sigmas,
        times=np.arange(frames) / 25,
        frames=np.arange(frames),
        notes=LandmarkNotes("mm", [f"where {name[:9]} is" for name in names]),
    )


def assert_same(found: LandmarkSet, wanted: LandmarkSet, *, off: float = 0.0) -> None:
    """Names, frames, times and unit are the same, and the positions that are defined up to `off`."""
    assert found.names == wanted.names
    assert found.unit == wanted.unit
    assert found.is_framed == wanted.is_framed
    np.testing.assert_array_equal(found.frames, wanted.frames)
    np.testing.assert_allclose(found.times, wanted.times, rtol=1e-6)
    np.testing.assert_array_equal(found.is_defined, wanted.is_defined)
    there = wanted.is_defined
    np.testing.assert_allclose(found.positions[there], wanted.positions[there], rtol=0, atol=off)

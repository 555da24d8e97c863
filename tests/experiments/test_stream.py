"""A stream of noisy scanners is shown without holes, and flickers little where frames are averaged."""

from __future__ import annotations

import pytest
from experiments.preiner_2012.stream import Stream


@pytest.mark.slow
@pytest.mark.parametrize("moves", [False, True], ids=["still", "moving"])
def test_four_noisy_scanners_leave_no_holes_and_little_flicker(moves: bool) -> None:
    """Levels of 255; a median over pixels whose channels are whole levels."""
    stream = Stream(moves, before=7)
    frames = stream.frames(noise=0.1)
    single, mean = (stream.judge(frames, average) for average in (0, 8))
    assert single.backend == mean.backend == "auto_splats"
    assert max(single.holes, mean.holes) < 0.01
    assert single.flicker < 1.5
    assert mean.flicker <= (0.75 if moves else 0.5)

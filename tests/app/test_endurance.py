from __future__ import annotations

import sys
from pathlib import Path

import pytest
from endurance import FRAMES, endure, own_megabytes, playing_app, problems, trouble


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_playing_and_scrubbing_neither_grow_nor_fail(tmp_path: Path) -> None:
    with playing_app(tmp_path) as app:
        before = own_megabytes(app)
        sizes = [megabytes for _, megabytes in endure(app, seconds=50)]
        assert len(sizes) > 2
        assert problems(before, sizes) == []
        assert trouble(app) == []
        assert set(app.frames()) == set(range(FRAMES))

from __future__ import annotations

import math
import sys
from itertools import islice
from pathlib import Path

import pytest
from endurance import endure, own_megabytes, playing_app, problems, trouble


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_playing_and_scrubbing_neither_grow_nor_fail(tmp_path: Path) -> None:
    with playing_app(tmp_path) as app:
        before = own_megabytes(app)
        sizes = [megabytes for _, megabytes in islice(endure(app, math.inf), 5)]
        assert problems(before, sizes) == []
        assert trouble(app) == []

"""Whatever is pressed, clicked and dragged, nothing ends in a traceback."""

from __future__ import annotations

from pathlib import Path

import pytest
from monkey import let_loose


@pytest.mark.slow
def test_random_input_leaves_the_log_clean(tmp_path: Path) -> None:
    let_loose(tmp_path, 300, seed=4)

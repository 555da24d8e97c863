"""The screen that the window tests of a file share."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from virtual_screen import SIZE, Screen, virtual_screen


@pytest.fixture(scope="module")
def screen(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Screen]:
    with virtual_screen(tmp_path_factory.mktemp("screen"), SIZE) as screen:
        yield screen

"""What tests of the window share: the screen of a file, and a view without a window."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import pytest
from virtual_screen import SIZE, Screen, virtual_screen

if TYPE_CHECKING:
    from viewer.app.scene.viewport import Viewport


@pytest.fixture(scope="module")
def screen(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Screen]:
    with virtual_screen(tmp_path_factory.mktemp("screen"), SIZE) as screen:
        yield screen


@pytest.fixture
def viewport(request: pytest.FixtureRequest) -> Iterator[Viewport]:
    """The 3D view without a window, of the SIZE that the file of the test declares."""
    from viewer.app.scene.viewport import Viewport
    from viewer.drawing.renderer import shared_renderer

    viewport = Viewport(shared_renderer(), (0, 0, *request.module.SIZE))
    yield viewport
    viewport.release()

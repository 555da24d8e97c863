"""Shared by the tests of the primitives."""

from __future__ import annotations

import pytest


@pytest.fixture(autouse=True)
def current_context(request: pytest.FixtureRequest) -> None:
    """The shared renderer's context is the current one: other tests leave contexts of their own."""
    if "renderer" in request.fixturenames:
        request.getfixturevalue("renderer").gpu.activate()

"""A pytest plugin: Scan4D takes the driver for that of a graphics card, and chooses as it does there.

PYTHONPATH=tests/drivers python -m pytest -p as_card tests/backends
"""

from __future__ import annotations

import pytest

from viewer.gpu import context


@pytest.fixture(scope="session", autouse=True)
def no_driver_is_software() -> None:
    """Let no name of a driver say that it draws in software. Processes that tests start are not changed."""
    context._SOFTWARE = ()

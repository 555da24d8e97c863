"""Conformance suites: what every backend, reader, measure and tool has to do, also those of other packages.

Each suite is a list of checks, which a test runs one by one:

    import pytest
    from viewer.testing import backend_checks

    @pytest.mark.parametrize("check", backend_checks("dots"), ids=str)
    def test_backend(check):
        check()

Scan4D's own tests run the same checks on everything that its folders hold.
"""

from __future__ import annotations

import sys

if "pytest" in sys.modules:  # so that a check that fails shows the values that it compared
    sys.modules["pytest"].register_assert_rewrite(
        *(f"{__name__}.{part}" for part in ("backends", "measures", "readers", "tools"))
    )

from .backends import backend_checks
from .check import Check
from .measures import measure_checks
from .readers import reader_checks
from .tools import tool_checks

__all__ = ["Check", "backend_checks", "measure_checks", "reader_checks", "tool_checks"]

"""A pytest plugin for environments without large libraries: tests that need one are skipped, and say which.

PYTHONPATH=tests/drivers python -m pytest -p left_out tests/backends
"""

from __future__ import annotations

from collections.abc import Generator
from typing import Any

import pytest

LARGE = {
    "DracoPy",
    "OpenEXR",
    "av",
    "imgui_bundle",
    "laspy",
    "lzf",
    "matplotlib",
    "numba",
    "open3d",
    "potpourri3d",
    "skimage",
}


def lacking(error: BaseException | None) -> str | None:
    """The large library whose absence was at the beginning; None where that was something else."""
    while error is not None:
        if isinstance(error, ModuleNotFoundError) and (name := (error.name or "").split(".")[0]) in LARGE:
            return name
        error = error.__cause__ or error.__context__
    return None


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Report a test that failed for want of a library as skipped."""
    report = yield
    if report.failed and call.excinfo and (name := lacking(call.excinfo.value)):
        report.outcome = "skipped"
        report.longrepr = (str(item.path), item.location[1] or 0, f"needs {name}")
    return report


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(
    collector: pytest.Collector,
) -> Generator[None, pytest.CollectReport, pytest.CollectReport]:
    """Report a module of tests that imports a missing library as skipped."""
    report: Any = yield
    if report.failed and report.call.excinfo and (name := lacking(report.call.excinfo.value)):
        report.outcome = "skipped"
        report.longrepr = (str(collector.path), 0, f"needs {name}")
    return report

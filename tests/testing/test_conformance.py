"""The conformance suites, run on every backend, reader and measure of Scan4D."""

from __future__ import annotations

from pathlib import Path

import pytest
from scenes import rarely
from whole_files import write_scans

from viewer.analysis.measures.kinds import measure_kinds
from viewer.app.tools import tool_names
from viewer.backends import backend, backends
from viewer.errors import InputError
from viewer.scan import formats
from viewer.testing import Check, backend_checks, measure_checks, reader_checks, tool_checks
from viewer.testing.backends import SIZES

BACKENDS = [check for name in backends() for check in backend_checks(name)]
READERS = [check for suffix in formats.known_suffixes() for check in reader_checks(suffix)]
TOOLS = [check for name in tool_names() for check in tool_checks(name)]
MEASURES = [check for kind in measure_kinds() for check in measure_checks(kind)]
SUFFIXES = sorted({*formats.known_suffixes()} - {".laz"})
_RARE = tuple(f"odd_size_{width}x{height}" for width, height in SIZES[2:])  # which repeat what others show
_OTHER_FEEDS = ("=gs", "=ubo")  # which bring the points that another feed brings


def parameters(check: Check) -> object:
    """A check of a backend as a parameter of a test."""
    is_slow = check.name in _RARE or str(check).endswith(_OTHER_FEEDS)
    marks = [pytest.mark.backend(check.subject), *([pytest.mark.slow] if is_slow else [])]
    return pytest.param(check, id=str(check), marks=marks)


@pytest.fixture(scope="module")
def scans(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a file of each format, or several."""
    folder = tmp_path_factory.mktemp("scans")
    write_scans(folder)
    return folder


@pytest.mark.usefixtures("renderer")
@pytest.mark.parametrize(
    "check", [parameters(check) for name in backends() for check in backend_checks(name)]
)
def test_backends(check: Check) -> None:
    check()


@pytest.mark.usefixtures("renderer")
@pytest.mark.parametrize(
    ("check", "attributes", "message"),
    [
        ("declarations", {"title": " "}, "title is empty"),
        ("declarations", {"good_for": ""}, "good_for does not say"),
        ("draw_returns_a_bool", {"draw": lambda *_: None}, "draw returns None, expected a bool"),
    ],
)
def test_backends_that_say_too_little_fail(
    check: str, attributes: dict[str, object], message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name, value in attributes.items():
        monkeypatch.setattr(type(backend("points")), name, value)
    found = next(each for each in backend_checks("points") if each.name == check)
    with pytest.raises(AssertionError, match=message):
        found()


@pytest.mark.parametrize("check", READERS, ids=str)
def test_readers(check: Check) -> None:
    check()


@pytest.mark.parametrize("suffix", [*SUFFIXES, *rarely(".laz")])
def test_readers_with_files(scans: Path, suffix: str) -> None:
    paths = sorted(scans.glob(f"*{suffix}"))
    assert paths
    for path in paths:
        for check in reader_checks(suffix, path):
            check()


@pytest.mark.parametrize(
    "check", [check for kind in measure_kinds() for check in measure_checks(kind)], ids=str
)
def test_measures(check: Check) -> None:
    check()


@pytest.mark.parametrize("check", TOOLS, ids=str)
def test_tools(check: Check) -> None:
    check()


def test_names_that_nothing_has_are_refused() -> None:
    suites = {backend_checks: "dotz", reader_checks: ".zip", measure_checks: "distanse", tool_checks: "pin"}
    for suite, name in suites.items():
        with pytest.raises(InputError, match=f"unknown .* '{name}'"):
            suite(name)

"""Shared by all tests: determinism, numpy errors that raise, and the real scans."""

from __future__ import annotations

import gc
import itertools
import os
import re
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from command_line import Done, Run
from hypothesis import HealthCheck, settings
from moderngl import Buffer

from viewer import cli
from viewer.backends import backends
from viewer.splatting import lists

if TYPE_CHECKING:
    from viewer.drawing.renderer import Renderer
    from viewer.picture.surface import Surface

pytest_plugins = ["parts", "representatives"]

settings.register_profile(
    "deterministic", derandomize=True, deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("deterministic")


def pytest_addoption(parser: pytest.Parser) -> None:
    """--bless: write what is checked in anew instead of comparing with it."""
    parser.addoption("--bless", action="store_true", help="rewrite checked-in references")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Note which backend a test is about."""
    for item in items:
        if marker := item.get_closest_marker("backend"):
            assert marker.args[0] in backends(), f"{item.nodeid} is about no backend"
            item.user_properties.append(("backend", marker.args[0]))


def pytest_collection_finish() -> None:
    """Keep the collected tests, a million objects that stay to the end, out of garbage collections."""
    gc.collect()
    gc.freeze()


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Tell how long the tests of each backend took."""
    seconds = dict.fromkeys(backends(), 0.0)
    for report in itertools.chain.from_iterable(terminalreporter.stats.values()):
        if isinstance(report, pytest.TestReport):
            for name in {value for key, value in report.user_properties if key == "backend"}:
                seconds[name] += report.duration
    if any(seconds.values()):
        terminalreporter.section("seconds per backend")
        for name, taken in seconds.items():
            terminalreporter.write_line(f"{taken:8.1f}  {name}")


@pytest.fixture
def bless(request: pytest.FixtureRequest) -> bool:
    """Whether references are to be rewritten."""
    return bool(request.config.getoption("--bless"))


@pytest.fixture(autouse=True)
def numpy_errors_raise() -> Iterator[None]:
    """Overflow, invalid values and division by zero fail the test; underflow to zero is fine."""
    with np.errstate(all="raise", under="ignore"):
        yield


@pytest.fixture(scope="session", autouse=True)
def only_staging_reads() -> Iterator[None]:
    """Reading a GPU buffer fails everywhere in Scan4D but in `viewer.gpu.staging`; tests may read."""
    with pytest.MonkeyPatch.context() as patch:
        for name in ("read", "read_into"):
            patch.setattr(Buffer, name, _reading(getattr(Buffer, name)))
        yield


def _reading(function: Callable[..., Any]) -> Callable[..., Any]:
    def read(*args: Any, **kwargs: Any) -> Any:
        caller = sys._getframe(1).f_globals["__name__"]
        assert not caller.startswith("viewer.") or caller == "viewer.gpu.staging", f"{caller} reads a buffer"
        return function(*args, **kwargs)

    return read


@pytest.fixture
def short_spans(monkeypatch: pytest.MonkeyPatch) -> None:
    """Discs that tiles list are no larger with software drivers than on hardware."""
    grid = replace(lists.SOFTWARE_GRID, span=lists.HARDWARE_GRID.span)
    monkeypatch.setattr(lists, "SOFTWARE_GRID", grid)


@pytest.fixture(scope="session")
def data_dir() -> Path:
    """The folder of real scans: SCAN4D_DATA, or shared/data beside the checkout."""
    beside = Path(__file__).resolve().parents[2] / "shared" / "data"
    folder = Path(os.environ.get("SCAN4D_DATA", beside))
    if not folder.is_dir():
        pytest.skip(f"no real scans in {folder}; set SCAN4D_DATA to their folder")
    return folder


@pytest.fixture(scope="session")
def renderer() -> Renderer:
    """A headless renderer on whatever OpenGL there is; all GPU tests share it."""
    from viewer.drawing.renderer import shared_renderer

    return shared_renderer()


@pytest.fixture(autouse=True)
def current_context(request: pytest.FixtureRequest) -> None:
    """The shared renderer's context is the current one: other tests leave contexts of their own."""
    if "renderer" in request.fixturenames:
        request.getfixturevalue("renderer").gpu.activate()


@pytest.fixture
def draw(renderer: Renderer) -> Callable[..., Surface]:
    """draw(cloud or range views, camera, size, backend or its name or a variant, look, params): one finished
    Surface."""
    from viewer.testing.scenes import draw

    return draw


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Run:
    """run("render", ...): a command line in this process. Nothing ever prints a traceback."""

    def run(*argv: object) -> Done:
        code = cli.main([str(word) for word in argv])
        captured = capsys.readouterr()
        assert "Traceback" not in captured.err
        return Done(code, captured.out, captured.err)

    return run


@pytest.fixture
def refused(run: Run) -> Callable[..., str]:
    """refused("render", ...): the one message of a command line that ends with code 2."""

    def refused(*argv: object) -> str:
        done = run(*argv)
        assert done.code == 2, done
        assert done.out == ""
        assert re.fullmatch(r"scan4d: [^\n]+\n", done.err), done.err
        return done.err

    return refused

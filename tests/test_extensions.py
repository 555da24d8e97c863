"""Extensions of other packages: found by entry points; failures are reported, and no name is taken over."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest
from extended import run_with, write_installed

READER = """
import numpy as np
from viewer.scan.points import PointCloud
TITLE, SUFFIXES = "{title}", ({suffix!r},)
def read(path, frame=0):
    return PointCloud.from_arrays(np.eye(3))
"""
MEASURE = """
import numpy as np
from viewer.analysis.measures.kinds import MeasureKind
KINDS = (MeasureKind({name!r}, "Height", "of one landmark", "length", 1, 1, lambda p, options: p[:, 0, 1]),)
"""
BACKEND = """
'''Nothing at all.'''
from dataclasses import dataclass
from viewer.backends import Backend
@dataclass(frozen=True)
class Params:
    pass
class Nothing(Backend):
    title = "Nothing"
    params_class = Params
    def draw(self, pose, frame, surface):
        return False
"""


@pytest.fixture(scope="module")
def target(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with four packages: one that is right, one that fails, and two that want what is taken."""
    target = tmp_path_factory.mktemp("installed")
    write_installed(
        target,
        "acme-good 1.2",
        {
            "acme_reader": READER.format(title="Acme", suffix=".acme"),
            "acme_measure": MEASURE.format(name="acme_height"),
            "acme_backend": BACKEND,
        },
        {
            "readers": {"acme": "acme_reader"},
            "measures": {"acme": "acme_measure"},
            "backends": {"nothing": "acme_backend"},
        },
    )
    write_installed(
        target,
        "broken-pack 0.1",
        {"broken": "import no_such_library", "stops": "import sys; sys.exit(3)", "empty": "TITLE = 'Empty'"},
        {
            "readers": {"stops": "stops", "formless": "empty"},
            "measures": {"missing": "not_there_at_all"},
            "backends": {"broken": "broken", "two": "empty"},
        },
    )
    write_installed(
        target,
        "taking-pack 3.0",
        {
            "taking_reader": READER.format(title="Other", suffix=".ply"),
            "taking_measure": MEASURE.format(name="distance"),
            "taking_backend": BACKEND,
        },
        {
            "readers": {"other": "taking_reader"},
            "measures": {"other": "taking_measure"},
            "backends": {"points": "taking_backend", "nothing": "taking_backend"},
        },
    )
    return target


def command(target: Path, *words: str) -> subprocess.CompletedProcess[str]:
    return run_with(target, "-m", "viewer", *words)


@pytest.mark.slow
def test_doctor_shows_where_each_comes_from_and_what_cannot_be_used(target: Path) -> None:
    done = command(target, "doctor")
    assert done.returncode == 0, done.stderr
    _, _, rows = " ".join(done.stdout.split()).partition("Extensions of other packages ")
    expected = [
        "backend nothing acme-good 1.2, module acme_backend",
        "reader acme acme-good 1.2, module acme_reader",
        "The backend 'broken' of broken-pack 0.1 cannot be imported (ModuleNotFoundError: No module named "
        "'no_such_library'). Update the package, or remove it: "
        f"{sys.executable} -m pip uninstall broken-pack",
        "The backend 'two' of broken-pack 0.1 is not used: empty defines 0 subclasses of Backend",
        "The reader 'stops' of broken-pack 0.1 cannot be imported (SystemExit: 3)",
        "The reader 'formless' of broken-pack 0.1 is not used: the module defines neither SUFFIXES nor find",
        "The measure 'missing' of broken-pack 0.1 cannot be imported (ModuleNotFoundError: No module named "
        "'not_there_at_all')",
        "The backend 'points' of taking-pack 3.0 is not used: Scan4D already has this name. Rename its entry",
        "The backend 'nothing' of taking-pack 3.0 is not used: acme-good 1.2 already has this name",
        "The reader 'other' of taking-pack 3.0 is not used: PLY already reads '.ply'. Use other suffixes",
        "The measure 'other' of taking-pack 3.0 is not used: a kind of measure 'distance' exists",
    ]
    for text in expected:
        assert text in rows
    warnings = done.stderr.splitlines()
    assert len(warnings) == len(set(warnings)) == 9, "each once"
    assert all(line.startswith("scan4d: The ") for line in warnings)
    assert command(target, "doctor", "--quiet").stderr == ""


@pytest.mark.slow
def test_everything_that_works_goes_on(target: Path, tmp_path: Path) -> None:
    (tmp_path / "scan.acme").write_text("anything")
    info = command(target, "info", str(tmp_path / "scan.acme"), "--json")
    assert info.returncode == 0, info.stderr
    facts = json.loads(info.stdout)
    assert (facts["points"], facts["package"]) == (3, "acme-good 1.2")
    assert "read by  acme-good 1.2" in command(target, "info", str(tmp_path / "scan.acme")).stdout

    listed = command(target, "backends", "--json")
    packages = {each["name"]: each["package"] for each in json.loads(listed.stdout)}
    assert packages.pop("nothing") == "acme-good 1.2"
    assert set(packages.values()) == {""}
    assert "From the package acme-good 1.2" in command(target, "backends").stdout

    code = "from viewer.analysis.measures.kinds import measure_kinds; print('acme_height' in measure_kinds())"
    done = run_with(target, "-c", code)
    assert done.stdout == "True\n"
    assert done.stderr.count("\n") == 2, "a script sees the warnings, too"


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "    pass",
            "    size: float = param(1.0, 'Size', units='px')",
            "Params.size: param has no argument units",
        ),
        ("    pass", "    size: int = param(4)", "Params.size has no help: declare it with param(default, "),
        ("    pass", "    size: float = param(1.0, 'Size', low=2)", "Params.size has an invalid default"),
        ("    pass", "    size: float = 1.0", "Params.size is not declared with param(...)"),
        ("    params_class = Params\n", "", "Nothing does not define params_class"),
        ("(frozen=True)", "", "params_class of Nothing is not a frozen dataclass"),
        ("def draw", "def paint", "Nothing does not define draw"),
        ("'''Nothing at all.'''", "", "wrong_backend has no docstring"),
    ],
)
@pytest.mark.slow
def test_a_backend_with_faulty_declarations_is_left_out(
    old: str, new: str, message: str, tmp_path: Path
) -> None:
    imports = "import Backend\nfrom viewer.params import param"
    module = BACKEND.replace(old, new).replace("import Backend", imports)
    write_installed(
        tmp_path, "acme-wrong 1.0", {"wrong_backend": module}, {"backends": {"wrong": "wrong_backend"}}
    )
    done = command(tmp_path, "backends")
    assert done.returncode == 0, done.stderr
    assert f"backend 'wrong' of acme-wrong 1.0 is not used: {message}" in done.stderr
    assert done.stderr.count("\n") == 1
    assert "points" in done.stdout


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "'.wrong'",
            "'wrong'",
            "the suffix 'wrong' must begin with a dot and be in lower case. Write '.wrong'",
        ),
        (
            "'.wrong'",
            "'.WRONG'",
            "the suffix '.WRONG' must begin with a dot and be in lower case. Write '.wrong'",
        ),
        ("def read", "def load", "the module defines SUFFIXES, but no read"),
    ],
)
def test_a_reader_with_faulty_declarations_is_left_out(
    old: str, new: str, message: str, tmp_path: Path
) -> None:
    module = READER.format(title="Wrong", suffix=".wrong").replace(old, new)
    write_installed(
        tmp_path, "acme-wrong 1.0", {"wrong_reader": module}, {"readers": {"wrong": "wrong_reader"}}
    )
    done = command(tmp_path, "info", "demo")
    assert done.returncode == 0, done.stderr
    done = run_with(tmp_path, "-c", "from viewer.scan.formats import known_suffixes; print(known_suffixes())")
    assert f"reader 'wrong' of acme-wrong 1.0 is not used: {message}" in done.stderr
    assert ".ply" in done.stdout


def test_nothing_is_imported_for_extensions_where_there_are_none() -> None:
    code = (
        "import sys\nfrom viewer.extensions import installed_extensions\n"
        "from viewer.scan.formats import known_suffixes\n"
        "known_suffixes(); print(installed_extensions(), 'importlib.metadata' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stdout == "() False\n", done.stderr

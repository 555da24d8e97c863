"""Libraries that are not installed: each import of one says what to install."""

from __future__ import annotations

import ast
import json
import os
import re
import subprocess
import sys
import tomllib
from functools import cache
from pathlib import Path

import pytest
from source_code import modules, syntax_of
from test_layers import name_of, nodes_at_run_time

from viewer.imports import PACKAGES, missing_packages

ROOT = Path(__file__).resolve().parents[1]

# No path leads to these libraries, as where they are not installed.
_WITHOUT = """
import sys
from importlib.machinery import PathFinder
names, found = set(sys.argv.pop(1).split(",")), PathFinder.find_spec
PathFinder.find_spec = lambda name, *more: None if name in names else found(name, *more)
"""
_IMPORTS = """
import json, viewer
from viewer.errors import Scan4DError
told = []
for module, line in json.load(sys.stdin):
    try:
        exec(line, {"__name__": module})
        told.append("it is there")
    except Scan4DError as error:
        assert isinstance(error, ImportError)
        told.append(str(error))
print(json.dumps(told))
"""
_COMMAND = "from viewer.cli import main\nsys.exit(main(sys.argv[1:]))"
_TRIES = """
import viewer
from importlib.util import find_spec
assert find_spec("av") is None
space = {"__name__": "another.library"}
exec("try:\\n    import av\\nexcept ImportError as error:\\n    kind = type(error)", space)
print(space["kind"].__name__)
"""


def without(
    libraries: list[str], code: str, *words: object, told: str = ""
) -> subprocess.CompletedProcess[str]:
    """A Python process in which these libraries are missing."""
    return subprocess.run(
        [sys.executable, "-c", _WITHOUT + code, ",".join(libraries), *map(str, words)],
        input=told, capture_output=True, text=True, env={**os.environ, "PYTHONPATH": str(ROOT)},
    )  # fmt: skip


@cache
def library_imports() -> list[tuple[str, str, str]]:
    """All imports of what is neither Python's own nor Scan4D's: (module, statement, library)."""
    return [
        (name_of(path), ast.unparse(node), library)
        for path in modules()
        for node in nodes_at_run_time(syntax_of(path))
        for library in _libraries(node)
        if library not in sys.stdlib_module_names and library != "viewer"
    ]


def _libraries(node: ast.AST) -> list[str]:
    if isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
        return [node.module.partition(".")[0]]
    return [alias.name.partition(".")[0] for alias in node.names] if isinstance(node, ast.Import) else []


def declared() -> set[str]:
    """The packages that pyproject.toml asks for, without versions."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    groups = [project["dependencies"], *project["optional-dependencies"].values()]
    return {re.split(r"[><=; ]", line)[0] for group in groups for line in group}


@pytest.mark.slow
def test_packages_are_those_that_are_imported_and_declared() -> None:
    experiments = sorted((ROOT / "tools" / "experiments").rglob("*.py"))
    measured = {
        each for path in experiments for node in ast.walk(syntax_of(path)) for each in _libraries(node)
    }
    used = {library for _, _, library in library_imports()}
    assert used <= set(PACKAGES) <= used | measured
    assert {package.strip("'") for package in PACKAGES.values()} <= declared()


def test_every_import_says_what_to_install() -> None:
    needed = [each for each in library_imports() if each[2] != "numpy"]  # without it nothing begins
    lines = json.dumps([(module, line) for module, line, _ in needed])
    done = without([library for _, _, library in needed], _IMPORTS, told=lines)
    assert done.returncode == 0, done.stderr
    for (_, _, library), told in zip(needed, json.loads(done.stdout), strict=True):
        assert told == str(missing_packages(library))
        assert told.endswith(f" -m pip install {PACKAGES[library]}")


@pytest.mark.parametrize(("library", "name"), [("av", "film.mp4"), ("OpenEXR", "a.exr"), ("PIL", "a.png")])
def test_a_command_says_what_to_install(library: str, name: str, tmp_path: Path) -> None:
    render = ["render", "demo", "--pose", "0", "--size", "32x32", "-o", tmp_path / name]
    done = without([library], _COMMAND, *render)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.splitlines()[-1] == f"scan4d: {missing_packages(library)}"
    assert list(tmp_path.iterdir()) == []


def test_a_file_that_needs_a_missing_library_is_not_called_damaged(tmp_path: Path) -> None:
    (tmp_path / "scan.laz").write_bytes(b"LASF" + bytes(400))
    done = without(["laspy"], _COMMAND, "info", tmp_path / "scan.laz")
    assert done.returncode == 2
    assert str(missing_packages("laspy")) in done.stderr
    assert "damaged" not in done.stderr


def test_other_libraries_go_on_without() -> None:
    done = without(["av"], _TRIES)
    assert (done.returncode, done.stdout) == (0, "ModuleNotFoundError\n"), done.stderr

"""One name for one thing: public classes and functions differ by name, and docstrings say whose they are."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from collections import Counter, defaultdict
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import pytest
import source_code
from source_code import PACKAGE, syntax_of

BY_PROTOCOL = {"Frames", "Params", "Tool", "Settings"}  # each backend, and each tool, declares its own

# Functions that modules of a kind have under one name, or that do the work of one of that name.
FUNCTIONS_BY_PROTOCOL = {
    "add_arguments", "column_names", "find", "run", "draw", "check", "contents", "frame_count", "read",
    "read_faces", "read_colors", "read_times", "read_unit", "write", "write_poses", "render",
    "lacks", "owns", "decide", "coarser",
}  # fmt: skip

# A docstring begins with a noun or a verb that names its subject. These begin without one.
RIDDLES = re.compile(
    r"(The same|The others?|Both|Likewise|Also|And|Or|What|Which|Where|Who|Whose|Those|Them|These|They|Its?"
    r"|As|Of|To|At(?! least| most)|In|From|With|By|On|For)\b"
)

Documented = ast.ClassDef | ast.FunctionDef


@pytest.fixture(scope="module")
def modules() -> list[tuple[str, ast.Module]]:
    """The path below the package and the syntax of each module."""
    return [(file.relative_to(PACKAGE).as_posix(), syntax_of(file)) for file in source_code.modules()]


def definitions(body: list[ast.stmt], within: str = "") -> Iterator[tuple[str, Documented]]:
    """Functions, classes and their methods by qualified name."""
    for node in body:
        if isinstance(node, Documented):
            yield within + node.name, node
            if isinstance(node, ast.ClassDef):
                yield from definitions(node.body, f"{within}{node.name}.")


def riddles(syntax: ast.Module) -> list[str]:
    """The docstrings that name no subject, by the name of what they are of."""
    documented = [(name, ast.get_docstring(node) or "") for name, node in definitions(syntax.body)]
    return [f"{name}: {text.splitlines()[0]}" for name, text in documented if RIDDLES.match(text)]


def shared_names(kind: type[Documented], among: list[tuple[str, ast.Module]]) -> dict[str, list[str]]:
    """Names that several modules give to a public class or function of their own -> the modules."""
    places = defaultdict(list)
    for path, syntax in among:
        for node in syntax.body:
            if isinstance(node, kind) and not node.name.startswith("_"):
                places[node.name].append(path)
    return {name: found for name, found in places.items() if len(found) > 1}


def test_no_two_public_classes_share_a_name(modules: list[tuple[str, ast.Module]]) -> None:
    shared = shared_names(ast.ClassDef, modules)
    assert shared.keys() <= BY_PROTOCOL, shared


def test_no_two_public_functions_share_a_name(modules: list[tuple[str, ast.Module]]) -> None:
    shared = shared_names(ast.FunctionDef, modules)
    assert shared.keys() <= FUNCTIONS_BY_PROTOCOL, shared


def test_no_two_test_files_share_a_name() -> None:
    """Tests are in no packages, so pytest imports a file by its name alone."""
    files = sorted(Path(__file__).parent.rglob("*.py"))
    names = Counter(file.name for file in files if file.name != "conftest.py")
    assert not [name for name, count in names.items() if count > 1]


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("The same, and colours.", 1),
        ("Both.", 1),
        ("Of the points.", 1),
        ("The sameness of two.", 0),
        ("", 0),
    ],
)
def test_a_riddle_is_told_from_a_docstring(text: str, found: int) -> None:
    assert len(riddles(ast.parse(f'class A:\n    def f(self):\n        """{text}"""\n'))) == found


def test_docstrings_name_their_subject(modules: list[tuple[str, ast.Module]]) -> None:
    found = {path: riddles(syntax) for path, syntax in modules}
    assert not {path: told for path, told in found.items() if told}


def frames_told(syntax: ast.Module) -> list[str]:
    """The texts that tell the number of a frame without `frame_in_words`."""
    texts = [
        before.value
        for node in ast.walk(syntax)
        if isinstance(node, ast.JoinedStr)
        for before, after in pairwise(node.values)
        if isinstance(before, ast.Constant) and isinstance(after, ast.FormattedValue)
    ]
    return [text for text in texts if re.search(r"\bframe $", text, re.IGNORECASE)]


@pytest.mark.parametrize(
    ("text", "found"), [("f'frame {n}'", 1), ("f'The Frame {n} is'", 1), ("f'{n} frames, frame_{n}'", 0)]
)
def test_frames_that_are_told(text: str, found: int) -> None:
    assert len(frames_told(ast.parse(text))) == found


def test_texts_count_frames_by_one_rule(modules: list[tuple[str, ast.Module]]) -> None:
    """A text that adds 1 by itself, or forgets to, is beside the others that a person reads."""
    found = {path: told for path, syntax in modules if (told := frames_told(syntax))}
    assert list(found) == ["scan/times.py"], found


def test_classes_have_at_most_30_methods_or_say_why(modules: list[tuple[str, ast.Module]]) -> None:
    large = {
        node.name
        for _, syntax in modules
        for node in ast.walk(syntax)
        if isinstance(node, ast.ClassDef)
        if sum(isinstance(method, ast.FunctionDef) for method in node.body) > 30
        if not re.search(r"more than\s+30\s+methods\s+because", ast.get_docstring(node) or "")
    }
    assert not large


def test_kernels_have_at_most_25_branches() -> None:
    """Ruff holds all other functions to 12; it knows one limit for all that it checks at once."""
    checked = subprocess.run(
        [
            sys.executable, "-m", "ruff", "check", "--isolated", "--no-cache", "--output-format", "concise",
            "--select", "C901", "--config", "lint.mccabe.max-complexity=25",
            *sorted(map(str, PACKAGE.rglob("*_kernels.py"))),
        ],
        capture_output=True,
        text=True,
        check=False,
    )  # fmt: skip
    assert checked.returncode == 0, checked.stdout + checked.stderr


def several_results(syntax: ast.Module) -> list[str]:
    """Public functions that return a tuple of more than two results without names, by qualified name.

    Tuples of one type are values, such as a colour, a direction or a rectangle.
    """
    found = []
    for name, node in definitions(syntax.body):
        returns = getattr(node, "returns", None)
        if node.name.startswith("_") or not isinstance(returns, ast.Subscript):
            continue
        if ast.unparse(returns.value) == "tuple" and isinstance(returns.slice, ast.Tuple):
            kinds = [ast.unparse(kind) for kind in returns.slice.elts]
            if len(kinds) > 2 and len(set(kinds)) > 1:
                found.append(name)
    return found


@pytest.mark.parametrize(
    ("returns", "found"),
    [
        ("tuple[int, str, float]", ["f"]),
        ("tuple[int, int, int]", []),
        ("tuple[int, str]", []),
        ("tuple[int, ...]", []),
        ("Result", []),
    ],
)
def test_several_results_without_names(returns: str, found: list[str]) -> None:
    assert several_results(ast.parse(f"def f() -> {returns}: ...")) == found


# Functions that return more than two results without names. This list only gets shorter.
SEVERAL_RESULTS = {
    "bench/report/results.py: rank",
    "bench/scenes/registration.py: register",
    "scan/formats/_ply_kernels.py: pack_rows",
}


def test_more_than_two_results_have_names(modules: list[tuple[str, ast.Module]]) -> None:
    found = {f"{path}: {name}" for path, syntax in modules for name in several_results(syntax)}
    assert found <= SEVERAL_RESULTS, found - SEVERAL_RESULTS

"""`make mutate`: which mutants a seed chooses, and which tests run first."""

from __future__ import annotations

import ast
import importlib.util
import random
import re
from itertools import islice
from pathlib import Path
from types import ModuleType

import pytest

TOOL = Path(__file__).resolve().parents[1] / "tools" / "mutate.py"


@pytest.fixture(scope="module")
def mutate() -> ModuleType:
    spec = importlib.util.spec_from_file_location("mutate", TOOL)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_a_seed_chooses_mutants_that_change_code_alone(mutate: ModuleType) -> None:
    for part in mutate.PARTS:
        one, same, other = (list(islice(mutate.mutants(part, random.Random(seed)), 12)) for seed in (1, 1, 2))
        assert one == same != other
        for mutant in one:
            before, after = mutate.CODE[mutant["file"]].splitlines(), mutant["text"].splitlines()
            changed = [pair for pair in zip(before, after, strict=True) if pair[0] != pair[1]]
            assert [tuple(line.strip() for line in pair) for pair in changed] == [
                (mutant["line"], mutant["becomes"])
            ]
            if mutant["file"].endswith(".py"):
                ast.parse(mutant["text"])


def test_texts_types_and_comments_have_no_meaning(mutate: ModuleType) -> None:
    assert mutate.meaning("a.py", "x: int = 1  # 2") == mutate.meaning("a.py", "x: str = 1")
    assert mutate.meaning("a.py", "f('1')") == mutate.meaning("a.py", "f('2')")
    assert mutate.meaning("a.py", "x = 1") != mutate.meaning("a.py", "x = 2")
    assert mutate.meaning("a.comp", "int x = 1;  // 1") == mutate.meaning("a.comp", "int x = 1;  // 2")
    assert mutate.meaning("a.comp", "int x = 1;") != mutate.meaning("a.comp", "int x = 2;")


@pytest.mark.parametrize(
    ("file", "first"),
    [
        ("viewer/analysis/curves.py", "tests/analysis/test_curves.py"),
        ("viewer/scan/formats/npz.py", "tests/scan/formats/test_npz.py"),
        ("viewer/gpu/culling.py", "tests/gpu/test_culling.py"),
        ("shaders/chunks/cull.comp", "tests/gpu/test_culling.py"),
    ],
)
def test_the_nearest_tests_run_first(mutate: ModuleType, file: str, first: str) -> None:
    (beside,) = {tests for part, tests in mutate.PARTS.items() if re.match(part, file)}
    found = mutate.tests_of(file, beside)
    assert found[0] == first
    assert len(found) > 20, "all others follow"

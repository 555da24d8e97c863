"""`make mutate`: which mutants a seed chooses, which tests run first, and what counts as a kill."""

from __future__ import annotations

import ast
import importlib.util
import re
from itertools import islice
from pathlib import Path
from queue import Queue
from types import ModuleType

import pytest
from scenes import rarely_together

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
        one, same, other = (list(islice(mutate.mutants(part, seed), 12)) for seed in (1, 1, 2))
        assert one == same != other
        for file, _, change, text in one:
            pairs = zip(mutate.CODE[file].splitlines(), text.splitlines(), strict=True)
            ((line, becomes),) = [pair for pair in pairs if pair[0] != pair[1]]
            assert change.endswith(f": {line.strip()}  ->  {becomes.strip()}")
            if file.endswith(".py"):
                ast.parse(text)


def test_texts_and_comments_are_left_alone(mutate: ModuleType) -> None:
    code = """a = 1 + f("1 + 2", b[0])  # 1 and 2
layout(binding = 1) uniform int two;
if (c < 2 && !d) e.min(0.1);  // 0 or 1
"""
    assert [found[1] for found in mutate.FOUND.finditer(code) if found[1]] == [*"1+0<2", "&&", "min"]


def test_lines_whose_change_nobody_sees_are_left_alone(mutate: ModuleType) -> None:
    for part in mutate.PARTS:
        for _, _, change, _ in islice(mutate.mutants(part, 3), 200):
            line = change.partition(": ")[2].partition("  ->  ")[0]
            assert not re.search("|".join(mutate.UNSEEN), line), change


FILE = "viewer/srgb.py"


@pytest.mark.parametrize(
    ("test", "kills"),
    [
        (f"'mutant' not in open('{FILE}').read()", True),
        ("False", False),
        ("True", False),
        *rarely_together(
            (f"'mutant' not in open('{FILE}').read() or os.abort()", True),
            ("os.abort()", False),
            (f"'mutant' not in open('{FILE}').read() or any(0 for _ in iter(int, 1))", True),
        ),
    ],
)
@pytest.mark.slow
def test_what_fails_because_of_a_mutant_kills_it(
    test: str, kills: bool, mutate: ModuleType, tmp_path: Path
) -> None:
    for name in ("viewer", "tests"):
        (tmp_path / name).mkdir()
    (tmp_path / "tests/conftest.py").write_text('pytest_plugins = ["parts"]')
    (tmp_path / "tests/parts.py").write_bytes((TOOL.parents[1] / "tests/parts.py").read_bytes())
    (tmp_path / "tests/test_it.py").write_text(f"import os\n\ndef test_it():\n    assert {test}")
    copies = Queue[Path]()
    copies.put(tmp_path)
    assert mutate.judged(copies, (FILE, "", "", "mutant"), ["tests/test_it.py"], 60) == kills
    assert (tmp_path / FILE).read_bytes() == (TOOL.parents[1] / FILE).read_bytes()
    assert copies.get_nowait() == tmp_path


@pytest.mark.parametrize(
    ("file", "function", "first"),
    [
        ("viewer/analysis/curves.py", "", "tests/analysis/test_curves.py"),
        (
            "viewer/analysis/visible_normals.py",
            "_unfolded",
            "tests/backends/auto_splats/test_neighborhoods.py",
        ),
        ("viewer/scan/formats/npz.py", "read", "tests/scan/formats/test_npz.py"),
        ("viewer/scan/formats/_columns.py", "_as_ellipses", "tests/scan/formats/test_ellipses.py"),
        ("viewer/splatting/culling.py", "points_of", "tests/splatting/test_culling.py"),
        ("shaders/chunks/cull.comp", "is_hidden", "tests/splatting/test_culling.py"),
    ],
)
def test_the_nearest_tests_run_first(mutate: ModuleType, file: str, function: str, first: str) -> None:
    found = mutate.tests_of(file, function)
    assert first in found[:3]
    assert len(set(found)) == 8
